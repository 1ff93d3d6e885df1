//! The one way to a state that a log does not keep: simulated again from the last one before it, exactly, and proven by
//! its hash.

use crate::failure::Failure;
use crate::{log_file, stop};
use recorder::recover::Emit;
use recorder::{Log, LogError, LogProblem, Remake, StateSource};
use schemas::Hash;
use schemas::scene::{Scene, SceneRecord};
use schemas::state::StateMessage;
use sim_node::{Model, Records, Scratch, State, Stop};

/// A simulation by this program on this machine, at one of its states.
pub struct Simulation {
    pub model: Model,
    pub state: State,
    pub scratch: Scratch,
}

impl Simulation {
    /// At a state of a scene; at its first with `None`.
    pub fn at(scene: &Scene, state: Option<StateMessage>, threads: usize) -> Result<Simulation, String> {
        let (model, _) = Model::compile(scene).map_err(|error| error.to_string())?;
        let state = match state {
            Some(message) => State::from_message(&model, message).map_err(|error| error.to_string())?,
            None => State::initial(&model),
        };
        let mut scratch = Scratch::new(&model, threads);
        sim_node::evaluate(&model, &state, &mut scratch);
        Ok(Simulation { model, state, scratch })
    }

    /// Goes to another state of the same scene.
    fn stand_at(&mut self, message: StateMessage) -> Result<(), String> {
        self.state = State::from_message(&self.model, message).map_err(|error| error.to_string())?;
        sim_node::evaluate(&self.model, &self.state, &mut self.scratch);
        Ok(())
    }

    /// Makes one step.
    pub fn step(&mut self) -> Result<(), Stop> {
        sim_node::step(&self.model, &mut self.state, &mut self.scratch)
    }

    /// Its state as a message, hashed.
    fn message(&self) -> StateMessage {
        let (bodies, contacts) = (self.state.bodies.clone(), self.state.contacts.clone());
        let mut header = self.state.header();
        header.state_hash = schemas::state::encode(&header, &bodies, &contacts, &mut Vec::new());
        StateMessage { header, bodies, contacts }
    }
}

/// All states of a log: those that it keeps, and the others simulated again.
///
/// The simulation stays where it was, so that one state after the other costs no more than the steps between them.
pub struct States<'a> {
    log: &'a Log,
    threads: usize,
    simulation: Option<Simulation>,
    /// Why nothing can be simulated: said once and for all.
    refused: Option<String>,
}

impl<'a> States<'a> {
    pub fn new(log: &'a Log, threads: usize) -> States<'a> {
        States { log, threads, simulation: None, refused: None }
    }

    /// The simulation at a step of the log, whether the log keeps its state or not.
    pub fn simulation_at(mut self, step: u64) -> Result<Simulation, Failure> {
        self.go_to(step).map_err(log_file::failure)?;
        Ok(self.simulation.expect("it went there"))
    }

    fn go_to(&mut self, step: u64) -> Result<&Simulation, LogError> {
        let log = self.log;
        let not_remade = |reason: String| {
            let problem = LogProblem::NotRemade { step, reason };
            LogError { file: log.file().to_owned(), problem }
        };
        if let Some(reason) = &self.refused {
            return Err(not_remade(reason.clone()));
        }
        log.require_same_version()?;
        let kept = log.state_at_or_before(step)?;
        let from = kept.as_ref().map_or(0, |message| message.header.step);
        match &mut self.simulation {
            Some(simulation) if (from..=step).contains(&simulation.state.step) => {}
            Some(simulation) if kept.is_some() => {
                kept.map_or(Ok(()), |message| simulation.stand_at(message)).map_err(&not_remade)?;
            }
            simulation => {
                let scene = log.scene()?.scene;
                *simulation = Some(Simulation::at(&scene, kept, self.threads).map_err(&not_remade)?);
            }
        }
        let simulation = self.simulation.as_mut().expect("it was set");
        while simulation.state.step < step {
            if stop::requested() {
                return Err(not_remade(format!("interrupted after step {}", simulation.state.step)));
            }
            if let Err(stopped) = simulation.step() {
                let reason = format!("from step {from}: {stopped}");
                self.simulation = None;
                return Err(not_remade(reason));
            }
        }
        let logged = log.step(step)?.state_hash;
        let found = simulation.message().header.state_hash;
        if found != logged {
            let reason = format!(
                "from step {from} on, its state gets the hash {found}, and the log says {logged}: this machine makes other \
                 bits, or the log was altered; see `chainmail verify`"
            );
            self.refused = Some(reason.clone());
            self.simulation = None;
            return Err(not_remade(reason));
        }
        Ok(self.simulation.as_ref().expect("it was set"))
    }
}

impl StateSource for States<'_> {
    fn state(&mut self, step: u64) -> Result<Option<StateMessage>, LogError> {
        match self.log.state(step)? {
            Some(kept) => Ok(Some(kept)),
            None => Ok(Some(self.go_to(step)?.message())),
        }
    }
}

/// Makes lost steps of a broken log again.
pub struct Resimulator {
    /// Threads; no result depends on them.
    pub threads: usize,
}

impl Remake for Resimulator {
    fn remake(
        &mut self,
        scene: &SceneRecord,
        state: StateMessage,
        chained_hash: Hash,
        last: u64,
        emit: Emit<'_>,
    ) -> Result<(), String> {
        let version = env!("CARGO_PKG_VERSION");
        if scene.version != version {
            return Err(format!(
                "the lost steps can be simulated again by version {}, which wrote the log; this is version {version}",
                scene.version
            ));
        }
        let mut simulation = Simulation::at(&scene.scene, Some(state), self.threads)?;
        let mut records = Records::after(chained_hash);
        while simulation.state.step < last {
            if stop::requested() {
                return Err(format!("interrupted after step {}", simulation.state.step));
            }
            simulation.step().map_err(|stopped| stopped.to_string())?;
            let record = records.record(&simulation.model, &simulation.state, &simulation.scratch);
            emit(&record, records.state_message())?;
        }
        Ok(())
    }
}

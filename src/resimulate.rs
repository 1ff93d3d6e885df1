//! States that a log does not keep, simulated again from the last one before them: exactly, and proven by their hash.

use crate::failure::Failure;
use crate::{log_file, stop};
use recorder::recover::Emit;
use recorder::{Log, Remake};
use schemas::Hash;
use schemas::scene::{Scene, SceneRecord};
use schemas::state::StateMessage;
use sim_node::{Model, Records, Scratch, State};

/// The scene of a log and its model. Only this version's bits are its own.
pub fn model_of(log: &Log) -> Result<(Scene, Model), Failure> {
    log.require_same_version().map_err(log_file::failure)?;
    let scene = log.scene().map_err(log_file::failure)?.scene;
    let (model, _) =
        Model::compile(&scene).map_err(|error| Failure::lost(format!("{}: {error}", log.file())))?;
    Ok((scene, model))
}

/// The state after a step of a log, whether the log keeps it or not.
pub fn state_at(log: &Log, model: &Model, step: u64, threads: usize) -> Result<State, Failure> {
    let fail = |what: String| Failure::lost(format!("{}: {what}", log.file()));
    let kept = log.state_at_or_before(step).map_err(log_file::failure)?;
    let mut state = match kept {
        Some(message) => State::from_message(model, message).map_err(|error| fail(error.to_string()))?,
        None => State::initial(model),
    };
    let logged = log.step(step).map_err(log_file::failure)?.state_hash;
    let from = state.step;
    let mut scratch = Scratch::new(model, threads);
    sim_node::evaluate(model, &state, &mut scratch);
    while state.step < step {
        if stop::requested() {
            return Err(Failure::lost(format!("interrupted while step {} was made again", state.step)));
        }
        sim_node::step(model, &mut state, &mut scratch)
            .map_err(|stopped| fail(format!("simulated again from step {from}: {stopped}")))?;
    }
    let found = schemas::state::encode(&state.header(), &state.bodies, &state.contacts, &mut Vec::new());
    if found != logged {
        return Err(fail(format!(
            "simulated again from step {from}, the state of step {step} has the hash {found}, and the log says {logged}: \
             this machine makes other bits; see `chainmail verify`"
        )));
    }
    Ok(state)
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
        let (model, _) = Model::compile(&scene.scene).map_err(|error| error.to_string())?;
        let mut state = State::from_message(&model, state).map_err(|error| error.to_string())?;
        let mut scratch = Scratch::new(&model, self.threads);
        let mut records = Records::after(chained_hash);
        sim_node::evaluate(&model, &state, &mut scratch);
        while state.step < last {
            if stop::requested() {
                return Err(format!("interrupted after step {}", state.step));
            }
            sim_node::step(&model, &mut state, &mut scratch).map_err(|stopped| stopped.to_string())?;
            let record = records.record(&model, &state, &scratch);
            emit(&record, records.state_message())?;
        }
        Ok(())
    }
}

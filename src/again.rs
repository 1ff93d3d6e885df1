//! A log's scene simulated again, step by step, beside what a log says: for `verify` and `diff --explain`.

use crate::failure::Failure;
use crate::log_file;
use crate::resimulate::Simulation;
use recorder::Log;
use recorder::diff::{FieldDifference, KeyDifference, compare_records, compare_states};
use schemas::scene::Scene;
use schemas::state::StateMessage;
use schemas::step::StepRecord;
use schemas::{Hash, state};
use serde::Serialize;
use sim_node::{Records, Stop};

/// Fields of a record that are told.
const RECORD_FIELDS_TOLD_MAX: usize = 6;

/// A simulation of a log's scene by this program on this machine.
pub struct Again {
    scene: Scene,
    simulation: Simulation,
    records: Records,
    /// Whether the state has its record already: then the next record is that of the next step.
    recorded: bool,
}

/// Where a log and a simulation part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The step.
    pub step: u64,
    /// The first stage that differs; `record` if all stages agree, and `run` if the simulation stops.
    pub stage: &'static str,
    /// What the log has: a hash, in most cases.
    pub logged: String,
    /// What was simulated.
    pub simulated: String,
    /// The first field of the state that differs, if the log keeps that state: `a` is the log's.
    pub field: Option<FieldDifference>,
    /// Fields of the step record that differ: `a` is the log's.
    pub record: Vec<KeyDifference>,
}

impl Again {
    /// Before the record of step 0.
    pub fn from_start(log: &Log, threads: usize) -> Result<Again, Failure> {
        let again = Again::new(log, None, threads, Hash::default())?;
        Ok(Again { recorded: false, ..again })
    }

    /// After the state of a step that the log keeps.
    pub fn from_state(log: &Log, step: u64, threads: usize) -> Result<Again, Failure> {
        let chained_hash = log.step(step).map_err(log_file::failure)?.chained_hash;
        let missing = || Failure::lost(format!("{}: it keeps no state of step {step}", log.file()));
        let message = log.state(step).map_err(log_file::failure)?.ok_or_else(missing)?;
        Again::new(log, Some(message), threads, chained_hash)
    }

    fn new(
        log: &Log,
        state: Option<StateMessage>,
        threads: usize,
        chained_hash: Hash,
    ) -> Result<Again, Failure> {
        let scene = log.scene().map_err(log_file::failure)?.scene;
        let simulation = Simulation::at(&scene, state, threads)
            .map_err(|reason| Failure::lost(format!("{}: {reason}", log.file())))?;
        Ok(Again { scene, simulation, records: Records::after(chained_hash), recorded: true })
    }

    /// Makes the next step, or evaluates the first state, and records it.
    ///
    /// # Errors
    ///
    /// Why the simulation stops at that step.
    pub fn advance(&mut self) -> Result<StepRecord, Stop> {
        if self.recorded {
            self.simulation.step()?;
        }
        self.recorded = true;
        let Simulation { model, state, scratch } = &self.simulation;
        Ok(self.records.record(model, state, scratch))
    }

    /// The chained hash up to the last record.
    pub fn chained_hash(&self) -> Hash {
        self.records.chained_hash()
    }

    /// How a log differs from the record just made and its state; `None` if it does not. Also says whether the log
    /// keeps the state.
    pub fn compare(&self, log: &Log, simulated: &StepRecord) -> Result<(Option<Difference>, bool), Failure> {
        let step = simulated.step;
        let logged = log.step(step).map_err(log_file::failure)?;
        let kept = log.state_message(step).map_err(log_file::failure)?;
        let is_kept = kept.is_some();
        let altered = kept.filter(|message| *message.bytes != *self.records.state_message());
        if logged == *simulated && altered.is_none() {
            return Ok((None, is_kept));
        }
        let own = state::decode(self.records.state_message()).ok();
        let theirs = altered.as_ref().and_then(|message| schemas::wire::decode(&message.bytes).ok());
        let field = own.zip(theirs).and_then(|(own, theirs)| {
            compare_states(step, &theirs, &own, &self.scene).fields.into_iter().next()
        });
        let record = compare_records(&logged, simulated);
        let stages = logged.stages.in_order().into_iter().zip(simulated.stages.in_order());
        let parted = stages.into_iter().find(|((_, a), (_, b))| a != b);
        let (stage, logged, simulated) = match parted {
            Some(((stage, logged), (_, simulated))) => (stage, logged.to_owned(), simulated.to_owned()),
            None if record.is_empty() => {
                ("state", "other bytes than those that its hash is of".to_owned(), "them".to_owned())
            }
            None => ("record", "other numbers, see below".to_owned(), "these".to_owned()),
        };
        Ok((Some(Difference { step, stage, logged, simulated, field, record }), is_kept))
    }
}

impl Difference {
    /// Of a simulation that stops where a log goes on.
    pub fn stopped(step: u64, reason: &Stop) -> Difference {
        let (logged, simulated) = ("goes on".to_owned(), reason.to_string());
        Difference { step, stage: "run", logged, simulated, field: None, record: Vec::new() }
    }
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "different at step {}, stage {}:\n  the log has       {}\n  this machine has  {}",
            self.step, self.stage, self.logged, self.simulated
        )?;
        if let Some(field) = &self.field {
            let dot = if field.component.is_empty() { "" } else { "." };
            write!(
                f,
                "\n  {}, {}{dot}{}: {:?} and {:?} ({}, {}",
                field.owner, field.field, field.component, field.a, field.b, field.a_bits, field.b_bits
            )?;
            match field.ulp {
                Some(ulp) => write!(f, "; {ulp} ULP apart)")?,
                None => write!(f, ")")?,
            }
        }
        let told = self
            .record
            .iter()
            .filter(|field| !field.key.contains("hash") && !field.key.starts_with("stages"));
        for field in told.take(RECORD_FIELDS_TOLD_MAX) {
            let text = |value: &Option<serde_json::Value>| {
                value.as_ref().map_or("not there".to_owned(), |value| value.to_string())
            };
            write!(f, "\n  {}: {} and {}", field.key, text(&field.a), text(&field.b))?;
        }
        Ok(())
    }
}

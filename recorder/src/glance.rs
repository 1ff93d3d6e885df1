//! What is in a log, from its index, its first and its last record: in milliseconds, however large the log is.

use crate::fault::{Health, LogError};
use crate::message::Kind;
use crate::reader::Log;
use crate::summary::{bytes_text, outcome_text, total_j};
use schemas::Hash;
use schemas::end::Outcome;
use serde::Serialize;
use std::fmt;

/// The short account of a log. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Glance {
    /// The log file.
    pub file: String,
    /// The program that wrote it.
    pub program: String,
    /// Its version.
    pub version: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Bodies of all kinds.
    pub bodies: usize,
    /// Steps done (step 0 is not one).
    pub steps: u64,
    /// Steps that the scene asks for.
    pub steps_planned: u64,
    /// Simulated time of the last step, in seconds.
    pub sim_time_s: f64,
    /// Full states.
    pub states: u64,
    /// Frames.
    pub frames: u64,
    /// How the run ended; `None` if the log has no end record.
    pub outcome: Option<Outcome>,
    /// Kinetic, gravity and contact energy at step 0, in joules.
    pub energy_start_j: f64,
    /// The same at the last step.
    pub energy_end_j: f64,
    /// Energy taken out by damping, friction and drag until the last step, in joules.
    pub dissipated_j: f64,
    /// Size of the file, in bytes.
    pub file_bytes: u64,
    /// The chained hash of all states, as the last record has it.
    pub chained_hash: Hash,
    /// Whether the log is whole, as far as was looked.
    pub health: Health,
    /// Always `false`: see [`Summary`](crate::Summary) for the other account.
    pub every_byte_read: bool,
}

impl Glance {
    /// Reads the index, the scene, the first and the last step record and the end.
    ///
    /// # Errors
    ///
    /// [`LogError`] if one of them cannot be read, or there is no step.
    pub fn of(log: &Log) -> Result<Glance, LogError> {
        let record = log.scene()?;
        let steps = (log.count(Kind::Step) as u64).saturating_sub(1);
        let (first, last) = (log.step(0)?, log.step(steps)?);
        Ok(Glance {
            file: log.file().to_owned(),
            program: record.program,
            version: record.version,
            seed: record.scene.seed,
            bodies: record.scene.body_count(),
            steps,
            steps_planned: record.scene.time.step_count(),
            sim_time_s: last.sim_time_s,
            states: log.count(Kind::State) as u64,
            frames: log.count(Kind::FrameInfo) as u64,
            outcome: log.end()?.map(|end| end.outcome),
            energy_start_j: total_j(&first),
            energy_end_j: total_j(&last),
            dissipated_j: last.dissipated_energy_j,
            file_bytes: log.file_bytes(),
            chained_hash: last.chained_hash,
            health: log.health(),
            every_byte_read: false,
        })
    }
}

impl fmt::Display for Glance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut line = |label: &str, value: String| writeln!(f, "{label:<12} {value}");
        line("log", format!("{} ({})", self.file, bytes_text(self.file_bytes)))?;
        line("written by", format!("{} {}, seed {}", self.program, self.version, self.seed))?;
        line("bodies", self.bodies.to_string())?;
        let (steps, planned) = (self.steps, self.steps_planned);
        let of = if steps == planned { String::new() } else { format!(" of {planned}") };
        line("steps", format!("{steps}{of}, {} s of simulated time", self.sim_time_s))?;
        line("states", self.states.to_string())?;
        line("frames", self.frames.to_string())?;
        line("outcome", outcome_text(self.outcome.as_ref()))?;
        let (start_j, end_j, dissipated_j) = (self.energy_start_j, self.energy_end_j, self.dissipated_j);
        line(
            "energy",
            format!(
                "{start_j:.6e} J at the start, {end_j:.6e} J at the end, {dissipated_j:.6e} J dissipated"
            ),
        )?;
        line("chained hash", self.chained_hash.to_string())?;
        write!(f, "{:<12} {}, by its index and its ends; --check reads every byte", "health", self.health)
    }
}

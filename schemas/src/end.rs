//! The end of a run: counts and the final hash, sent once, last.

use crate::Hash;
use serde::{Deserialize, Serialize};

/// What the simulator says when it is done; the log's last message.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct End {
    /// How the run ended.
    pub outcome: Outcome,
    /// Steps done. There is a step record for each of them and one for step 0.
    pub step_count: u64,
    /// States published on `state`.
    pub state_count: u64,
    /// Keyframes published: as many frames are to come, where a renderer takes part.
    pub keyframe_count: u64,
    /// The chained hash after the last step.
    pub chained_hash: Hash,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outcome {
    /// All simulated time is done.
    Completed,
    /// A signal asked the simulator to stop; everything before that is whole.
    Interrupted,
    /// An audit or a broken invariant stopped the run; the text names step, ring and cause.
    Stopped(String),
    /// Nobody said how the run ended: its log was broken and has been recovered, which wrote this record. The text names
    /// what is missing after the last step.
    Recovered(String),
}

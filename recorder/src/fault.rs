//! What can be wrong with a log, and how whole it is.

use crate::check::CheckError;
use crate::container::Damage;
use crate::message::Kind;
use serde::Serialize;

/// A log that cannot be read, with the file that it is about.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {problem}")]
pub struct LogError {
    /// The file's path, or what the bytes were called.
    pub file: String,
    /// What is wrong.
    #[source]
    pub problem: LogProblem,
}

/// What is wrong with a log.
#[derive(Debug, thiserror::Error)]
pub enum LogProblem {
    /// The file cannot be opened or mapped.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Something else than MCAP.
    #[error("not an MCAP file: its first bytes are {found:02x?}, where 89 4d 43 41 50 30 0d 0a was expected")]
    NotMcap {
        /// The first bytes, at most eight.
        found: Vec<u8>,
    },
    /// An MCAP file of another program.
    #[error("an MCAP file, but not a log of this program: it has no /scene channel")]
    NotALog,
    /// Bytes that are not what they should be.
    #[error("at byte offset {offset}: {what}")]
    Damaged {
        /// Byte offset in the file.
        offset: u64,
        /// What is there and what was expected.
        what: String,
    },
    /// States that this program would misread.
    #[error("its state layout is {found}, this program's is {expected}: use the version that wrote the log")]
    Layout {
        /// The layout hash in the log.
        found: String,
        /// This program's.
        expected: String,
    },
    /// Written by another version, where the same one is needed.
    #[error(
        "it was written by version {found}, this is version {expected}: only the same version promises the \
         same bits"
    )]
    Version {
        /// The version in the log.
        found: String,
        /// This program's.
        expected: String,
    },
    /// A message whose content cannot be read.
    #[error("{kind} message {index} (at byte offset {offset}) cannot be read: {reason}")]
    Record {
        /// Its channel.
        kind: Kind,
        /// Which of the channel's messages, from 0.
        index: usize,
        /// Byte offset of the message in the file.
        offset: u64,
        /// What the parser said.
        reason: String,
    },
    /// The log has no such message.
    #[error("it has no {kind} message {index}: there are {count}")]
    Missing {
        /// The channel.
        kind: Kind,
        /// Which of the channel's messages was asked for, from 0.
        index: usize,
        /// How many it has.
        count: usize,
    },
    /// A state that the log does not keep, and that could not be simulated again.
    #[error("it keeps no state of step {step}, and none could be simulated again: {reason}")]
    NotRemade {
        /// The step.
        step: u64,
        /// Why.
        reason: String,
    },
    /// A promise of the log is broken.
    #[error(transparent)]
    Check(#[from] CheckError),
}

impl From<Damage> for LogProblem {
    fn from(damage: Damage) -> LogProblem {
        LogProblem::Damaged { offset: damage.offset, what: damage.what }
    }
}

/// How whole a log is, as far as it has been read. [`Log::check`](crate::Log::check) reads every byte.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case", tag = "state")]
pub enum Health {
    /// Finished: index and end record are there.
    Complete,
    /// Closed and indexed, but without an end record: the simulator was lost, or has not ended.
    Unfinished,
    /// The file ends in the middle; everything before that is whole.
    Truncated {
        /// Where reading stopped.
        offset: u64,
    },
    /// Bytes were altered; what lies before them is whole.
    Damaged {
        /// Where reading stopped.
        offset: u64,
        /// What is there and what was expected.
        what: String,
    },
    /// The bytes are whole, but a message breaks a promise of the log. Only [`Log::check`](crate::Log::check) finds this.
    Inconsistent {
        /// The promise.
        what: String,
    },
}

impl From<&LogProblem> for Health {
    fn from(problem: &LogProblem) -> Health {
        match problem {
            LogProblem::Damaged { offset, what } => Health::Damaged { offset: *offset, what: what.clone() },
            problem => Health::Inconsistent { what: problem.to_string() },
        }
    }
}

impl std::fmt::Display for Health {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Health::Complete => write!(f, "complete"),
            Health::Unfinished => write!(f, "closed, but without an end record: the run did not end"),
            Health::Truncated { offset } => write!(f, "truncated: readable up to byte offset {offset}"),
            Health::Damaged { offset, what } => write!(f, "damaged at byte offset {offset}: {what}"),
            Health::Inconsistent { what } => write!(f, "inconsistent: {what}"),
        }
    }
}

//! How a verb fails: a message for people and an exit code for scripts.

use std::fmt::Display;

/// The exit codes that users script against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done, or: the same.
    Done = 0,
    /// Differs, failed verification, or a run that its own audits stopped.
    Differs = 1,
    /// Bad input or usage.
    Input = 2,
    /// Damaged log, or a process was lost; the message says what was saved.
    Lost = 3,
}

impl Exit {
    /// The exit that a process reports by its code; what is unknown is a lost process.
    pub fn from_code(code: u8) -> Exit {
        match code {
            0 => Exit::Done,
            1 => Exit::Differs,
            2 => Exit::Input,
            _ => Exit::Lost,
        }
    }
}

/// Why a verb did not do what it was asked to.
#[derive(Debug)]
pub struct Failure {
    /// What the process exits with.
    pub exit: Exit,
    /// What is wrong, where, and how to mend it; printed to stderr after `error: `.
    pub message: String,
}

impl Failure {
    /// Bad input: nothing was done.
    pub fn input(message: impl Display) -> Failure {
        Failure { exit: Exit::Input, message: message.to_string() }
    }

    /// A damaged log, a lost process, or a disk that refuses.
    pub fn lost(message: impl Display) -> Failure {
        Failure { exit: Exit::Lost, message: message.to_string() }
    }
}

/// What every verb returns.
pub type Outcome = Result<Exit, Failure>;

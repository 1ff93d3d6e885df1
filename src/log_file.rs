//! Logs on disk, and which of the exit codes their faults have.

use crate::failure::Failure;
use recorder::{Health, Log, LogError, LogProblem};
use std::path::Path;

/// Opens a log, whole or not; what is no log of this program is bad input.
pub fn open(path: &Path) -> Result<Log, Failure> {
    Log::open(path).map_err(failure)
}

/// Opens a log that has to be whole.
pub fn open_whole(path: &Path) -> Result<Log, Failure> {
    let log = open(path)?;
    refuse_damage(&log)?;
    Ok(log)
}

/// A damaged log is a failure of its own, whatever else was found out about it.
pub fn refuse_damage(log: &Log) -> Result<(), Failure> {
    match log.health() {
        Health::Complete => Ok(()),
        health => Err(Failure::lost(format!(
            "{}: {health}; `chainmail recover {} --out FIXED` makes a whole log of what is left",
            log.file(),
            log.file()
        ))),
    }
}

/// The exit code of a fault: 2 for what is no log that this program could use, 3 for a damaged one.
pub fn failure(error: LogError) -> Failure {
    match error.problem {
        LogProblem::Io(_)
        | LogProblem::NotMcap { .. }
        | LogProblem::NotALog
        | LogProblem::Layout { .. }
        | LogProblem::Version { .. } => Failure::input(error),
        _ => Failure::lost(error),
    }
}

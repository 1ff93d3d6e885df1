//! What people and pipes get to read. A reader that has gone away is no reason to stop, let alone to panic.

use crate::failure::{Exit, Failure, Outcome};
use std::fmt::Display;
use std::io::{ErrorKind, Write};

/// Prints a report to stdout; `| head` is not an error, a full disk is.
pub fn print(report: &str) -> Outcome {
    let mut stdout = std::io::stdout().lock();
    match writeln!(stdout, "{}", report.trim_end()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::lost(format!("cannot write the report: {error}")))
        }
        _ => Ok(Exit::Done),
    }
}

/// Prints a report as indented JSON.
pub fn print_json(report: &impl serde::Serialize) -> Outcome {
    print(&serde_json::to_string_pretty(report).map_err(Failure::lost)?)
}

/// Says something on stderr; if nobody can hear it, nothing is lost.
pub fn say(text: impl Display) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

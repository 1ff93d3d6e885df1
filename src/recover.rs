//! `recover`: a whole log of what is left of a broken one.

use crate::failure::{Exit, Failure, Outcome};
use crate::resimulate::Resimulator;
use crate::terminal::{print, print_json};
use crate::{log_file, stop};
use clap::Args;
use recorder::{RecoverError, Recovery, Remake, recover};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Args)]
#[command(
    after_help = "Example:\n  chainmail recover out/drop/log.mcap --out out/drop/whole.mcap\n\nThe new log goes from step \
                        0 to the last step before which nothing is missing. Steps that are lost in the middle are \
                        simulated again and proven by the hashes after them.\n\nExit codes: 0 nothing was lost, 2 not a \
                        log, or the new log cannot be written, 3 something was lost (the new log is there), or nothing \
                        could be saved."
)]
pub struct Arguments {
    /// The broken log; it is not changed
    log: PathBuf,
    /// The log to write
    #[arg(long, value_name = "LOG")]
    out: PathBuf,
    /// Replace the log to write if it exists
    #[arg(long)]
    force: bool,
    /// Do not simulate lost steps again: end before the first of them
    #[arg(long)]
    no_remake: bool,
    /// Threads to simulate lost steps with; no result depends on them [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What was done, and with which files.
#[derive(Serialize)]
struct Report<'a> {
    log: &'a PathBuf,
    out: &'a PathBuf,
    complete: bool,
    #[serde(flatten)]
    recovery: &'a Recovery,
}

pub fn run(arguments: &Arguments) -> Outcome {
    stop::flag();
    let (log, out) = (&arguments.log, &arguments.out);
    let same = |path: &PathBuf| path.canonicalize().ok();
    if same(log).is_some_and(|log| Some(log) == same(out)) {
        return Err(Failure::input("--out names the broken log itself, which is kept. Name another"));
    }
    let threads = arguments.threads.unwrap_or_else(crate::default_threads).get();
    let mut resimulator = Resimulator { threads };
    let remake = (!arguments.no_remake).then_some(&mut resimulator as &mut dyn Remake);
    let recovery = recover(log, out, arguments.force, remake).map_err(failure)?;
    let complete = recovery.is_complete();
    if arguments.json {
        print_json(&Report { log, out, complete, recovery: &recovery })?;
    } else {
        print(&format!("log             {}\n{recovery}", out.display()))?;
    }
    if complete {
        return Ok(Exit::Done);
    }
    Err(Failure::lost(format!(
        "{} was not whole; {} holds what is left, up to step {}{}",
        log.display(),
        out.display(),
        recovery.last_step,
        advice(&recovery, out)
    )))
}

/// How the rest comes back.
fn advice(recovery: &Recovery, out: &std::path::Path) -> String {
    if recovery.last_step < recovery.steps_planned {
        format!("; `chainmail resume {} --out DIR` simulates the rest", out.display())
    } else if recovery.counts.frames < recovery.frames_due {
        format!("; `chainmail rerender {} --out DIR` makes all frames again", out.display())
    } else {
        String::new()
    }
}

fn failure(error: RecoverError) -> Failure {
    match error {
        RecoverError::Log(error) => log_file::failure(error),
        RecoverError::Nothing { .. } => Failure::lost(error),
        RecoverError::Exists { .. } | RecoverError::Write { .. } => Failure::input(error),
    }
}

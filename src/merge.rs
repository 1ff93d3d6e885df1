//! `merge`: the frames that several machines rendered, and the log whose motion they show, as one log: the one that a
//! single renderer would have led to, byte for byte.

use crate::failure::{Exit, Failure, Outcome};
use crate::log_file;
use crate::terminal::print;
use clap::Args;
use recorder::{MergeError, merge_files};
use std::path::PathBuf;

#[derive(Args)]
#[command(
    after_help = "Example, three shares of one log, on one machine or three:\n  chainmail rerender out/drop/log.mcap \
                        --spp 256 --share 1/3 --out part1\n  chainmail rerender out/drop/log.mcap --spp 256 --share 2/3 \
                        --out part2\n  chainmail rerender out/drop/log.mcap --spp 256 --share 3/3 --out part3\n  \
                        chainmail merge out/drop/log.mcap part*/part.mcap --out hi.mcap\n\ndocs/farm.md has GNU parallel \
                        and Slurm."
)]
pub struct Arguments {
    /// The log, and the parts that `rerender --share` or `--frames` wrote, in any order
    #[arg(required = true, num_args = 2.., value_name = "PARTS")]
    parts: Vec<PathBuf>,
    /// The log to write
    #[arg(long, value_name = "LOG")]
    out: PathBuf,
    /// Replace the log to write if it exists
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let out = &arguments.out;
    let same = |path: &PathBuf| path.canonicalize().ok();
    if same(out).is_some_and(|out| arguments.parts.iter().any(|part| same(part).as_ref() == Some(&out))) {
        return Err(Failure::input("--out names one of the parts; it would be lost. Name another"));
    }
    if out.exists() && !arguments.force {
        return Err(Failure::input(format!(
            "{} exists already; choose another file, or add --force to replace it",
            out.display()
        )));
    }
    let logs = arguments.parts.iter().map(|part| log_file::open(part)).collect::<Result<Vec<_>, _>>()?;
    let written = merge_files(&logs, out, arguments.force).map_err(|error| match error {
        MergeError::Log(error) => log_file::failure(error),
        MergeError::Order(_) | MergeError::Write(_) => Failure::lost(error),
        error => Failure::input(error),
    })?;
    let counts = written.counts;
    print(&format!(
        "log             {}\n{} step records, {} states, {} frames",
        out.display(),
        counts.step_records,
        counts.states,
        counts.frames
    ))?;
    Ok(Exit::Done)
}

//! `diff`: the first difference of two logs.

use crate::failure::{Exit, Outcome};
use crate::log_file;
use crate::terminal::{print, print_json};
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(
    after_help = "Example:\n  chainmail diff a/log.mcap b/log.mcap\n\nExit codes: 0 same, 1 different, \
                        2 cannot be compared, 3 damaged."
)]
pub struct Arguments {
    /// One log
    a: PathBuf,
    /// The other
    b: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let (a, b) = (log_file::open(&arguments.a)?, log_file::open(&arguments.b)?);
    let diff = recorder::diff(&a, &b);
    if arguments.json {
        print_json(&diff)?;
    } else {
        print(&diff.to_string())?;
    }
    Ok(Exit::from_code(diff.verdict.exit_code()))
}

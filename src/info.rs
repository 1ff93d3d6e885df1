//! `info`: what is in a log.

use crate::failure::{Exit, Outcome};
use crate::log_file;
use crate::terminal::{print, print_json};
use clap::Args;
use recorder::Summary;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  chainmail info out/drop/log.mcap")]
pub struct Arguments {
    /// The log
    log: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let log = log_file::open(&arguments.log)?;
    let summary = Summary::of(&log).map_err(log_file::failure)?;
    if arguments.json {
        print_json(&summary)?;
    } else {
        print(&summary.to_string())?;
    }
    log_file::refuse_damage(&log)?;
    Ok(Exit::Done)
}

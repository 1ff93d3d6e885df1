//! `info`: what is in a log.

use crate::failure::{Exit, Outcome};
use crate::log_file;
use crate::terminal::{print, print_json};
use clap::Args;
use recorder::{Glance, Health, Summary};
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  chainmail info out/drop/log.mcap")]
pub struct Arguments {
    /// The log
    log: PathBuf,
    /// Read every byte of the log also if it is larger than 64 MiB
    #[arg(long)]
    check: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// A log up to this size is read as a whole, in some 50 ms; of a larger one, its index and its ends.
const READ_BYTES_MAX: u64 = 64 << 20;

pub fn run(arguments: &Arguments) -> Outcome {
    let log = log_file::open(&arguments.log)?;
    if log.file_bytes() <= READ_BYTES_MAX || arguments.check || log.health() != Health::Complete {
        let summary = Summary::of(&log).map_err(log_file::failure)?;
        if arguments.json {
            print_json(&summary)?;
        } else {
            print(&summary.to_string())?;
        }
    } else {
        let glance = Glance::of(&log).map_err(log_file::failure)?;
        if arguments.json {
            print_json(&glance)?;
        } else {
            print(&glance.to_string())?;
        }
    }
    log_file::refuse_damage(&log)?;
    Ok(Exit::Done)
}

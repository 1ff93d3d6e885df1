//! `verify`: simulate a log's scene again, on this machine, and compare every step; and every picture, if asked to.

use crate::again::{Again, Difference};
use crate::failure::{Exit, Failure, Outcome};
use crate::progress::{Meter, Progress};
use crate::terminal::{print, print_json};
use crate::{log_file, stop};
use clap::Args;
use recorder::Log;
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Args)]
#[command(
    after_help = "Example:\n  chainmail verify out/drop/log.mcap --threads 1\n\nExit codes: 0 identical, 1 different, \
                        2 bad input, 3 damaged."
)]
pub struct Arguments {
    /// The log
    log: PathBuf,
    /// Threads to simulate with; the result must not depend on them [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Render the frames again, too, and compare the hashes of their films
    #[cfg(feature = "render")]
    #[arg(long)]
    frames: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What was compared, and where it parts.
#[derive(Serialize)]
struct Report {
    identical: bool,
    steps_compared: u64,
    states_compared: u64,
    final_chained_hash: String,
    first_difference: Option<Difference>,
    /// `None` if pictures were not asked for.
    frames: Option<Frames>,
}

/// What became of the pictures.
#[derive(Serialize)]
pub struct Frames {
    /// Frames whose films have the same hash.
    pub identical: usize,
    /// The first whose film has another one.
    pub first_difference: Option<FrameDifference>,
}

/// A frame that is another one on this machine.
#[derive(Serialize)]
pub struct FrameDifference {
    /// Its number, from 0.
    pub frame: u64,
    /// The film's hash in the log.
    pub logged: String,
    /// The hash of the film rendered now.
    pub rendered: String,
}

pub fn run(arguments: &Arguments) -> Outcome {
    stop::flag();
    let log = log_file::open(&arguments.log)?;
    log.require_same_version().map_err(log_file::failure)?;
    let threads = arguments.threads.unwrap_or_else(crate::default_threads);
    #[cfg_attr(not(feature = "render"), expect(unused_mut))]
    let mut report = compare(&log, threads.get())?;
    #[cfg(feature = "render")]
    if arguments.frames && report.identical {
        let frames = crate::still_frames::verify(&log, threads)?;
        report.identical = frames.first_difference.is_none();
        report.frames = Some(frames);
    }
    if arguments.json {
        print_json(&report)?;
    } else {
        print(&report.to_string())?;
    }
    log_file::refuse_damage(&log)?;
    Ok(if report.identical { Exit::Done } else { Exit::Differs })
}

fn compare(log: &Log, threads: usize) -> Result<Report, Failure> {
    let mut again = Again::from_start(log, threads)?;
    let mut meter = Meter::for_this_process("verify", "steps");
    let total = log.count(recorder::Kind::Step) as u64;
    let mut report = Report {
        identical: true,
        steps_compared: 0,
        states_compared: 0,
        final_chained_hash: String::new(),
        first_difference: None,
        frames: None,
    };
    for step in 0..total {
        if stop::requested() {
            return Err(Failure::lost(format!(
                "interrupted after {step} of {total} steps, all of them identical"
            )));
        }
        report.first_difference = match again.advance() {
            Err(reason) => Some(Difference::stopped(step, &reason)),
            Ok(simulated) => {
                let (difference, is_kept) = again.compare(log, &simulated)?;
                report.states_compared += u64::from(is_kept);
                difference
            }
        };
        if report.first_difference.is_some() {
            report.identical = false;
            break;
        }
        report.steps_compared += 1;
        meter.show(Progress { done: step + 1, total });
    }
    if report.identical {
        meter.finish();
    }
    report.final_chained_hash = again.chained_hash().to_string();
    Ok(report)
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(difference) = &self.first_difference {
            return write!(f, "{difference}\n{} steps before it are identical", self.steps_compared);
        }
        let same = if self.identical { "identical" } else { "the steps are identical" };
        write!(f, "{same}: {} step records and {} states", self.steps_compared, self.states_compared)?;
        match &self.frames {
            None => {}
            Some(Frames { identical, first_difference: None }) => write!(f, ", {identical} frames")?,
            Some(Frames {
                identical,
                first_difference: Some(FrameDifference { frame, logged, rendered }),
            }) => write!(
                f,
                "\ndifferent at frame {frame}, its film:\n  the log has       {logged}\n  this machine has  {rendered}\n\
                 {identical} frames before it are identical"
            )?,
        }
        write!(f, "\nfinal hash {}", self.final_chained_hash)
    }
}

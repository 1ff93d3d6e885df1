//! `verify`: simulate a log's scene again, on this machine, and compare every step.

use crate::failure::{Exit, Failure, Outcome};
use crate::progress::{Meter, Progress};
use crate::terminal::{print, print_json};
use crate::{log_file, stop};
use clap::Args;
use recorder::Log;
use schemas::step::StepRecord;
use serde::Serialize;
use sim_node::{Model, Records, Scratch, State};
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  chainmail verify out/drop/log.mcap --threads 1")]
pub struct Arguments {
    /// The log
    log: PathBuf,
    /// Threads to simulate with; the result must not depend on them [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
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
}

#[derive(Serialize)]
struct Difference {
    step: u64,
    stage: &'static str,
    logged: String,
    simulated: String,
}

pub fn run(arguments: &Arguments) -> Outcome {
    stop::flag();
    let log = log_file::open(&arguments.log)?;
    log.require_same_version().map_err(log_file::failure)?;
    let threads = arguments.threads.unwrap_or_else(crate::default_threads);
    let report = compare(&log, threads.get())?;
    if arguments.json {
        print_json(&report)?;
    } else {
        print(&report.to_string())?;
    }
    log_file::refuse_damage(&log)?;
    Ok(if report.identical { Exit::Done } else { Exit::Differs })
}

fn compare(log: &Log, threads: usize) -> Result<Report, Failure> {
    let scene = log.scene().map_err(log_file::failure)?.scene;
    let (model, _) =
        Model::compile(&scene).map_err(|error| Failure::lost(format!("{}: {error}", log.file())))?;
    let mut state = State::initial(&model);
    let mut scratch = Scratch::new(&model, threads);
    let mut records = Records::after(schemas::Hash::default());
    let mut meter = Meter::for_this_process("verify", "steps");
    let total = log.steps().len() as u64;
    let mut states_compared = 0;
    sim_node::evaluate(&model, &state, &mut scratch);
    for (step, logged) in log.steps().enumerate() {
        let step = step as u64;
        let logged = logged.map_err(log_file::failure)?;
        if stop::requested() {
            return Err(Failure::lost(format!(
                "interrupted after {step} of {total} steps, all of them identical"
            )));
        }
        if step > 0
            && let Err(stopped) = sim_node::step(&model, &mut state, &mut scratch)
        {
            let difference = Difference {
                step,
                stage: "run",
                logged: "goes on".to_owned(),
                simulated: stopped.to_string(),
            };
            return Ok(report(step, states_compared, &records, Some(difference)));
        }
        let simulated = records.record(&model, &state, &scratch);
        let kept = log.state_message(step).map_err(log_file::failure)?;
        states_compared += u64::from(kept.is_some());
        let same_bytes = kept.is_none_or(|message| *message.bytes == *records.state_message());
        if logged != simulated || !same_bytes {
            return Ok(report(step, states_compared, &records, Some(first_difference(&logged, &simulated))));
        }
        meter.show(Progress { done: step + 1, total });
    }
    meter.finish();
    Ok(report(total, states_compared, &records, None))
}

fn report(steps_compared: u64, states_compared: u64, records: &Records, first: Option<Difference>) -> Report {
    Report {
        identical: first.is_none(),
        steps_compared,
        states_compared,
        final_chained_hash: records.chained_hash().to_string(),
        first_difference: first,
    }
}

fn first_difference(logged: &StepRecord, simulated: &StepRecord) -> Difference {
    let stages = logged.stages.in_order().into_iter().zip(simulated.stages.in_order());
    let parted = stages.into_iter().find(|((_, a), (_, b))| a != b);
    let step = logged.step;
    let (stage, logged, simulated) = match parted {
        Some(((stage, logged), (_, simulated))) => (stage, logged.to_owned(), simulated.to_owned()),
        // All hashes agree: then it is a count, an energy or an audit of the record itself.
        None => ("record", format!("{logged:?}"), format!("{simulated:?}")),
    };
    Difference { step, stage, logged, simulated }
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.first_difference {
            None => write!(
                f,
                "identical: {} step records and {} states\nfinal hash {}",
                self.steps_compared, self.states_compared, self.final_chained_hash
            ),
            Some(difference) => write!(
                f,
                "different at step {}, stage {}:\n  the log has       {}\n  this machine has  {}\n{} steps before it are \
                 identical",
                difference.step,
                difference.stage,
                difference.logged,
                difference.simulated,
                self.steps_compared
            ),
        }
    }
}

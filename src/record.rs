//! `record`: a recorder process on a bus.

use crate::failure::{Exit, Failure, Outcome};
use crate::progress::{Meter, Progress};
use crate::stop;
use clap::Args;
use recorder::node::{Progress as Recording, RecordOptions, record};
use schemas::end::Outcome as RunOutcome;

#[derive(Args)]
#[command(after_help = "Example, with `chainmail render` and `chainmail sim` in two other terminals:\n  \
                        chainmail record --bus mine --out mine.mcap")]
pub struct Arguments {
    #[command(flatten)]
    options: RecordOptions,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let options = &arguments.options;
    let mut meter = Meter::for_this_process("recorder", "steps");
    let mut show = |recording: Recording| match recording {
        Recording::Waiting => meter.say(&format!("waiting on bus {} for the other processes", options.bus)),
        Recording::Recording { step, step_count, .. } => {
            meter.show(Progress { done: step, total: step_count })
        }
    };
    let recorded = record(options, stop::flag(), &mut show)
        .map_err(|error| Failure { exit: Exit::from_code(error.exit_code()), message: error.to_string() })?;
    match recorded.outcome {
        // A log that was recovered is replayed like any other.
        RunOutcome::Completed | RunOutcome::Recovered(_) => Ok(Exit::Done),
        RunOutcome::Stopped(_) => Ok(Exit::Differs),
        // A log of a run that was interrupted can be recorded again to its end.
        RunOutcome::Interrupted if !stop::requested() => Ok(Exit::Done),
        RunOutcome::Interrupted => {
            Err(Failure::lost(format!("interrupted; {} is whole up to there", options.out.display())))
        }
    }
}

//! `sim`: a simulator process on a bus.

use crate::failure::{Exit, Failure, Outcome};
use crate::progress::{Meter, Progress};
use crate::stop;
use clap::Args;
use schemas::end::Outcome as RunOutcome;
use sim_node::node::{SimOptions, run as simulate};

#[derive(Args)]
#[command(after_help = "Example, with `chainmail record` and `chainmail render` in two other terminals:\n  \
                        chainmail sim scenes/drop.toml --bus mine")]
pub struct Arguments {
    #[command(flatten)]
    options: SimOptions,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let mut options = arguments.options.clone();
    options.threads.get_or_insert_with(|| crate::default_threads().get());
    let mut meter = Meter::for_this_process("simulator", "steps");
    let mut show = |progress: sim_node::node::Progress| {
        meter.show(Progress { done: progress.steps, total: progress.step_count });
    };
    let end = simulate(&options, stop::flag(), &mut show)
        .map_err(|error| Failure { exit: Exit::from_code(error.exit_code()), message: error.to_string() })?;
    match end.outcome {
        RunOutcome::Completed => Ok(Exit::Done),
        RunOutcome::Stopped(reason) => Err(Failure { exit: Exit::Differs, message: reason }),
        RunOutcome::Recovered(missing) => Err(Failure::lost(missing)),
        RunOutcome::Interrupted => Err(Failure::lost(format!("interrupted after step {}", end.step_count))),
    }
}

//! `render`: a renderer process on a bus.

use crate::failure::{Exit, Failure, Outcome};
use crate::progress::{Meter, Progress};
use crate::stop;
use crate::terminal::say;
use clap::Args;
use render_node::node::{RenderOptions, RenderProgress, run as render};

#[derive(Args)]
#[command(after_help = "Example, with `chainmail record` and `chainmail sim` in two other terminals:\n  \
                        chainmail render --bus mine --set render.samples_per_pixel=64")]
pub struct Arguments {
    #[command(flatten)]
    options: RenderOptions,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let mut meter = Meter::for_this_process("renderer", "frames");
    let mut show = |progress: &RenderProgress| {
        meter.show(Progress { done: progress.frames_done, total: progress.frame_count });
    };
    let done = render(&arguments.options, &stop::flag(), &mut show)
        .map_err(|error| Failure { exit: Exit::from_code(error.exit_code()), message: error.to_string() })?;
    if done.non_finite_samples > 0 {
        say(format!("warning: {} samples were not finite and were left out", done.non_finite_samples));
    }
    if done.stopped {
        return Err(Failure::lost(format!("interrupted after {} frames", done.frames_done)));
    }
    Ok(Exit::Done)
}

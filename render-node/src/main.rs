//! The renderer as a process of its own: `render-node --bus NAME`.

use clap::Parser;
use render_node::node::{self, RenderOptions};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Renders the keyframes of a run on a bus.
///
/// Exit codes: 0 done, 2 bad input, 3 the simulator or the recorder was lost.
#[derive(Parser)]
#[command(version, max_term_width = 100)]
struct Arguments {
    #[command(flatten)]
    options: RenderOptions,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        if let Err(error) = signal_hook::flag::register(signal, Arc::clone(&stop)) {
            eprintln!("warning: signal {signal} cannot be caught: {error}");
        }
    }
    let mut progress =
        |done: &node::RenderProgress| eprintln!("frame {} of {}", done.frames_done, done.frame_count);
    match node::run(&arguments.options, &stop, &mut progress) {
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

//! The simulator as a program of its own. Exit codes: 0 done, 1 stopped by its own audit, 2 bad input,
//! 3 another process lost, or interrupted.

use clap::Parser;
use schemas::end::Outcome;
use sim_node::node::{SimOptions, exit_code, run};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Simulates a scene and publishes it on a bus.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    options: SimOptions,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        if let Err(error) = signal_hook::flag::register(signal, Arc::clone(&stop)) {
            eprintln!("error: signal {signal} cannot be caught: {error}");
            return ExitCode::from(3);
        }
    }
    match run(&arguments.options, stop, &mut |_| {}) {
        Ok(end) => {
            if let Outcome::Stopped(reason) = &end.outcome {
                eprintln!("error: {reason}");
            }
            ExitCode::from(exit_code(&end.outcome))
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

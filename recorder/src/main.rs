//! The recorder process, on its own; `chainmail record` does the same.

use clap::Parser;
use recorder::node::{RecordOptions, record};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Records a run from its bus into a log.
#[derive(Parser)]
#[command(version, after_help = "Example:\n  recorder --bus demo --out demo.mcap")]
struct Cli {
    #[command(flatten)]
    options: RecordOptions,
}

fn main() -> ExitCode {
    let options = Cli::parse().options;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        if let Err(error) = signal_hook::flag::register(signal, Arc::clone(&stop)) {
            eprintln!("warning: cannot catch signal {signal}: {error}");
        }
    }
    match record(&options, stop, &mut |_| {}) {
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

//! The command `chainmail`: one file per verb. It starts the three processes of a run by spawning itself.
//!
//! It knows no physics, no light and no bus protocol: everything is done by the libraries it calls.

mod again;
mod bus_file;
mod explain;
mod failure;
mod keys;
mod log_file;
mod merge;
#[cfg(feature = "movie")]
mod movie;
#[cfg(feature = "view")]
mod origin;
mod output;
mod pictures;
mod player;
mod progress;
mod scene_file;
mod stop;
mod supervise;
mod terminal;

mod diff;
mod export;
mod info;
mod plan;
mod record;
mod recover;
#[cfg(feature = "render")]
mod render;
mod replay;
#[cfg(feature = "render")]
mod rerender;
mod resimulate;
mod resume;
mod run;
#[cfg(feature = "movie")]
mod sheet;
#[cfg(feature = "render")]
mod shorthand;
mod sim;
#[cfg(feature = "render")]
mod still_frames;
#[cfg(feature = "study")]
mod study;
mod verify;
#[cfg(feature = "view")]
mod view;

use clap::{Parser, Subcommand};
use failure::Outcome;
use std::num::NonZeroUsize;
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

/// Simulates, renders and records linked rings; every bit can be replayed.
///
/// A run is three processes over shared memory: a simulator, a renderer and a recorder. The log that they
/// leave is enough to replay, render again, verify and compare the run, bit for bit.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "\
Examples:
  chainmail run scenes/drop.toml                 simulate, render and record; writes out/drop/
  chainmail info out/drop/log.mcap               what is in a log
  chainmail verify out/drop/log.mcap             simulate again and compare every step
  chainmail diff a/log.mcap b/log.mcap           the first difference of two logs
  chainmail resume out/drop/log.mcap --out again go on with a run that was cut off
  chainmail rerender out/drop/log.mcap --out hi --set render.samples_per_pixel=256

Exit codes: 0 done or same, 1 differs or stopped by an audit, 2 bad input, 3 damaged log or process lost.
RUST_LOG=debug shows what the processes do.";

#[derive(Subcommand)]
enum Verb {
    /// Do the main job: simulate, render and record a scene
    Run(run::Arguments),
    /// Start a simulator process on a bus
    Sim(sim::Arguments),
    /// Start a renderer process on a bus
    #[cfg(feature = "render")]
    Render(render::Arguments),
    /// Start a recorder process on a bus
    Record(record::Arguments),
    /// Publish a log on a bus, as if it were simulated now
    Replay(replay::Arguments),
    /// Render a log again with other camera, light, looks or film
    #[cfg(feature = "render")]
    Rerender(rerender::Arguments),
    /// Make one log of a log's motion and the frames that several machines rendered
    Merge(merge::Arguments),
    /// Make one picture of several frames of a log
    #[cfg(feature = "movie")]
    Sheet(sheet::Arguments),
    /// Simulate a log's scene again and compare every step
    Verify(verify::Arguments),
    /// Go on with a run from any of its steps, with the bits that it would have had
    Resume(resume::Arguments),
    /// Make a whole log of a broken one
    Recover(recover::Arguments),
    /// Find the first difference of two logs
    Diff(diff::Arguments),
    /// Write what a log holds for other programs: tables, pictures, a movie, a file for viewers
    Export(export::Arguments),
    /// Serve a log to Foxglove and Lichtblick, which play and seek it
    #[cfg(feature = "view")]
    View(view::Arguments),
    /// Say how other programs of iceoryx2 find a run's topics
    Bus(bus_file::Arguments),
    /// Say what is in a log
    Info(info::Arguments),
    /// Say what a scene needs, and what is left out
    Plan(plan::Arguments),
    /// Measure error against run time, stability and scaling, and write a report
    #[cfg(feature = "study")]
    Study(study::Arguments),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    let outcome = match cli.verb {
        Verb::Run(arguments) => run::run(&arguments),
        Verb::Sim(arguments) => sim::run(&arguments),
        #[cfg(feature = "render")]
        Verb::Render(arguments) => render::run(&arguments),
        Verb::Record(arguments) => record::run(&arguments),
        Verb::Replay(arguments) => replay::run(&arguments),
        #[cfg(feature = "render")]
        Verb::Rerender(arguments) => rerender::run(&arguments),
        Verb::Merge(arguments) => merge::run(&arguments),
        #[cfg(feature = "movie")]
        Verb::Sheet(arguments) => sheet::run(&arguments),
        Verb::Verify(arguments) => verify::run(&arguments),
        Verb::Resume(arguments) => resume::run(&arguments),
        Verb::Recover(arguments) => recover::run(&arguments),
        Verb::Diff(arguments) => diff::run(&arguments),
        Verb::Export(arguments) => export::run(&arguments),
        #[cfg(feature = "view")]
        Verb::View(arguments) => view::run(&arguments),
        Verb::Bus(arguments) => bus_file::run(&arguments),
        Verb::Info(arguments) => info::run(&arguments),
        Verb::Plan(arguments) => plan::run(&arguments),
        #[cfg(feature = "study")]
        Verb::Study(arguments) => study::run(&arguments),
    };
    exit_code(outcome)
}

fn exit_code(outcome: Outcome) -> ExitCode {
    let exit = outcome.unwrap_or_else(|failure| {
        terminal::say(format!("error: {}", failure.message));
        failure.exit
    });
    ExitCode::from(exit as u8)
}

/// As many threads as the machine offers; no result depends on their number.
fn default_threads() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

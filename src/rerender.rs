//! `rerender`: replay a log, render it with new settings, record: the same motion in a new log.

use crate::failure::{Failure, Outcome};
use crate::supervise::Part;
use crate::{log_file, output, run, stop};
use bus::BusName;
use clap::Args;
use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Instant;

#[derive(Args)]
#[command(after_help = "Example:\n  chainmail rerender out/drop/log.mcap --out out/drop-hi --set \
                        render.samples_per_pixel=256 --set render.camera.position_m=[0,1,8]")]
pub struct Arguments {
    /// The log
    log: PathBuf,
    /// The folder to write into
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace the run in a folder that exists
    #[arg(long)]
    force: bool,
    /// Threads of the renderer; no result depends on them [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Override a key of render.*: camera, light, looks, film; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    stop::flag();
    let log = log_file::open_whole(&arguments.log)?;
    let record = log.scene().map_err(log_file::failure)?;
    record.scene.with_render(&arguments.set).map_err(Failure::input)?;
    let same = |path: &PathBuf| path.canonicalize().ok();
    if same(&arguments.log).is_some_and(|log| Some(log) == same(&arguments.out.join("log.mcap"))) {
        return Err(Failure::input(
            "--out names the folder of the log itself; the log would be lost. Name another",
        ));
    }
    let folder = output::make(Some(&arguments.out), "", arguments.force)?;
    let start = Instant::now();
    let bus = BusName::unique();
    let threads = run::threads_arguments(arguments.threads);
    let log = std::path::absolute(&arguments.log)
        .map_err(|error| Failure::input(format!("{}: {error}", arguments.log.display())))?;
    let mut replay: Vec<OsString> = vec!["replay".into(), log.into(), "--as-fast-as-possible".into()];
    replay.extend(run::set_arguments(&arguments.set));
    let replay = Part { name: "replay", unit: "steps", arguments: replay, input: None };
    let parts = run::parts(&bus, replay, &folder.join("log.mcap"), &threads, false);
    run::finish(&folder, run::supervise_on(&bus, parts), start, arguments.json)
}

//! `run`: the main job. Three processes simulate, render and record; then frames and movie are made from the log.

use crate::failure::{Exit, Failure, Outcome};
use crate::supervise::{Ended, Part, supervise};
use crate::terminal::{print, print_json};
use crate::{log_file, output, pictures, scene_file, stop};
use bus::{Bus, BusName};
use clap::Args;
use recorder::{Log, Summary};
use serde::Serialize;
use sim_node::Model;
use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Args)]
#[command(
    after_help = "Examples:\n  chainmail run scenes/drop.toml\n  chainmail run scenes/ball.toml --out out/slow \
                        --set time.duration_s=1 --set render.samples_per_pixel=64"
)]
pub struct Arguments {
    /// The scene file
    scene: PathBuf,
    /// The folder to write into [default: out/SCENE, out/SCENE-2, ...]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the run in a folder that exists
    #[arg(long)]
    force: bool,
    /// Seed of all random numbers [default: the scene's]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Threads of the simulator and of the renderer; no result depends on them [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Override a key of the scene; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Simulate and record only
    #[arg(long)]
    no_render: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// What a run leaves behind.
#[derive(Serialize)]
struct Report {
    log: PathBuf,
    frames: Option<PathBuf>,
    movie: Option<PathBuf>,
    movie_bytes: Option<u64>,
    wall_s: f64,
    summary: Summary,
}

pub fn run(arguments: &Arguments) -> Outcome {
    stop::flag();
    // A scene that cannot be simulated is refused before anything is made.
    // The simulator gets the very text that was checked.
    let (scene, text) = scene_file::load(&arguments.scene, &arguments.set, arguments.seed)?;
    let refused =
        |error: &dyn std::fmt::Display| Failure::input(format!("{}: {error}", arguments.scene.display()));
    Model::compile(&scene).map_err(|error| refused(&error))?;
    // The simulator does not know of surfaces that are only looked at.
    #[cfg(feature = "render")]
    if !arguments.no_render && !scene.render.surfaces.is_empty() {
        render_node::RenderModel::try_compile(&scene).map_err(|error| refused(&error))?;
    }
    let stem = arguments.scene.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
    let folder = output::make(arguments.out.as_deref(), &stem, arguments.force)?;
    let no_render = arguments.no_render || !cfg!(feature = "render");
    let start = Instant::now();
    let bus = BusName::unique();
    let threads = threads_arguments(arguments.threads);
    let mut simulator: Vec<OsString> = vec!["sim".into(), "/dev/stdin".into()];
    simulator.extend(set_arguments(&arguments.set));
    simulator.extend(arguments.seed.map(|seed| format!("--seed={seed}").into()));
    simulator.extend(threads.iter().cloned());
    let simulator = Part { name: "simulator", unit: "steps", arguments: simulator, input: Some(text) };
    let parts = parts(&bus, simulator, &folder.join("log.mcap"), &threads, no_render);
    finish(&folder, supervise_on(&bus, parts), start, arguments.json)
}

/// `--set=KEY=VALUE`, in one word each: a value may begin with a dash.
pub fn set_arguments(set: &[String]) -> impl Iterator<Item = OsString> {
    set.iter().map(|set| format!("--set={set}").into())
}

/// `--threads=N`, if the user said how many.
pub fn threads_arguments(threads: Option<NonZeroUsize>) -> Vec<OsString> {
    threads.map(|threads| format!("--threads={threads}").into()).into_iter().collect()
}

/// The three processes of a run (two without a renderer), whoever plays the simulator.
pub fn parts(
    bus: &BusName,
    mut simulator: Part,
    log: &Path,
    threads: &[OsString],
    no_render: bool,
) -> Vec<Part> {
    let mut common: Vec<OsString> = vec![format!("--bus={bus}").into()];
    let mut renderer: Vec<OsString> = vec!["render".into()];
    renderer.extend(common.iter().chain(threads).cloned());
    if no_render {
        common.push("--no-render".into());
    }
    simulator.arguments.extend(common.iter().cloned());
    let mut out = OsString::from("--out=");
    out.push(log);
    let mut recorder: Vec<OsString> = vec!["record".into(), out, "--force".into()];
    recorder.extend(common);
    let recorder = Part { name: "recorder", unit: "steps", arguments: recorder, input: None };
    let renderer = Part { name: "renderer", unit: "frames", arguments: renderer, input: None };
    if no_render { vec![simulator, recorder] } else { vec![simulator, renderer, recorder] }
}

/// Supervises the parts and removes what a killed one may have left on the bus.
pub fn supervise_on(bus: &BusName, parts: Vec<Part>) -> Result<Ended, Failure> {
    // Runs whose processes were all killed could not do it themselves.
    Bus::clean_up_all();
    let ended = supervise(parts);
    if let Err(error) = Bus::clean_up(bus) {
        tracing::warn!(%error, "the bus left files behind");
    }
    ended
}

/// Makes frames and movie from the log, and reports.
pub fn finish(folder: &Path, ended: Result<Ended, Failure>, start: Instant, json: bool) -> Outcome {
    let path = folder.join("log.mcap");
    let ended = ended.map_err(|failure| with_what_is_saved(failure, &path)).and_then(|ended| {
        let nothing_yet = ended == Ended::Interrupted && !path.exists();
        if nothing_yet { Err(Failure::lost("interrupted; nothing was saved")) } else { Ok(ended) }
    });
    // A folder in which nothing came to be is not left behind; one that holds something stays.
    let ended = ended.inspect_err(|_| drop(std::fs::remove_dir(folder)))?;
    let log = log_file::open(&path)?;
    let made = pictures::export(&log, folder)?;
    let summary = Summary::of(&log).map_err(log_file::failure)?;
    let report = Report {
        log: path,
        frames: made.frames,
        movie_bytes: made.movie.as_deref().and_then(|path| path.metadata().ok()).map(|file| file.len()),
        movie: made.movie,
        wall_s: start.elapsed().as_secs_f64(),
        summary,
    };
    if json {
        print_json(&report)?;
    } else {
        print(&report.to_string())?;
    }
    log_file::refuse_damage(&log)?;
    match ended {
        Ended::Done => Ok(Exit::Done),
        Ended::Stopped => Ok(Exit::Differs),
        Ended::Interrupted => Err(Failure::lost(format!(
            "interrupted; {} is whole up to there: `chainmail resume` goes on from it",
            log.file()
        ))),
    }
}

/// Adds to the message of a lost process what can still be used.
fn with_what_is_saved(failure: Failure, path: &Path) -> Failure {
    if failure.exit != Exit::Lost {
        return failure;
    }
    let saved = match Log::open(path) {
        Ok(log) => {
            let (steps, frames) = (log.count(recorder::Kind::Step), log.count(recorder::Kind::Frame));
            format!("{} holds {steps} steps and {frames} frames up to there", path.display())
        }
        Err(_) => "nothing was saved".to_owned(),
    };
    Failure { message: format!("{}\n{saved}", failure.message), ..failure }
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{}", self.summary.to_string().trim_end())?;
        writeln!(f, "wall time       {:.1} s", self.wall_s)?;
        write!(f, "log             {}", self.log.display())?;
        if let Some(frames) = &self.frames {
            write!(f, "\nframes          {}", frames.display())?;
        }
        if let (Some(movie), Some(bytes)) = (&self.movie, self.movie_bytes) {
            write!(f, "\nmovie           {} ({:.1} MB)", movie.display(), bytes as f64 / 1e6)?;
        }
        Ok(())
    }
}

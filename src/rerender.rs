//! `rerender`: replay a log, render it with new settings, record: the same motion in a new log. A part of the frames, or
//! frames with linear light, are pictures and no log.

use crate::failure::{Exit, Failure, Outcome};
use crate::replay::scene_message;
use crate::shorthand::{Shorthands, frame_range, share};
use crate::still_frames::{self, PART_FILE, Wanted};
use crate::supervise::Part;
use crate::terminal::{print, print_json};
use crate::{log_file, output, run, stop};
use bus::BusName;
use clap::Args;
use recorder::Kind;
use serde::Serialize;
use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Args)]
#[command(
    after_help = "Examples:\n  chainmail rerender out/drop/log.mcap --out out/drop-hi --spp 256 --size 1920x1080\n  \
                        chainmail rerender out/drop/log.mcap --out still --frames 20 --exr --camera 0,1,8:0,0,0 --set \
                        render.tone_mapping=agx\n  chainmail rerender out/drop/log.mcap --out part3 --spp 256 --share 3/8\n  \
                        chainmail merge out/drop/log.mcap part*/part.mcap --out out/drop-hi.mcap"
)]
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
    #[command(flatten)]
    shorthands: Shorthands,
    /// Render these frames alone, as in 7 or 10-20 (both ends), into pictures, and part.mcap for `merge`
    #[arg(long, value_name = "FRAMES")]
    frames: Option<String>,
    /// Render every N-th frame alone, beginning with the I-th, as in 3/8: one of N shares of the work
    #[arg(long, value_name = "I/N", conflicts_with = "frames")]
    share: Option<String>,
    /// Write linear light and feature images beside each picture, as OpenEXR; part.mcap, but no log
    #[arg(long)]
    exr: bool,
    /// Make a contact sheet of so many frames: sheet.png
    #[cfg(feature = "movie")]
    #[arg(long, value_name = "N")]
    sheet: Option<usize>,
    /// Override a key of render.* (camera, light, looks, film), or record.state_every; may be given again
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
    let mut set = arguments.shorthands.overrides(&record.scene.render)?;
    set.extend_from_slice(&arguments.set);
    let scene = record.scene.with_view(&set).map_err(Failure::input)?;
    let frame_count = scene.time.frame_count();
    let frames = match (&arguments.frames, &arguments.share) {
        (Some(text), _) => Some(frame_range(text, frame_count)?.collect()),
        (None, Some(text)) => Some(share(text, frame_count)?),
        (None, None) => None,
    };
    let same = |path: &PathBuf| path.canonicalize().ok();
    if same(&arguments.log).is_some_and(|log| Some(log) == same(&arguments.out.join("log.mcap"))) {
        return Err(Failure::input(
            "--out names the folder of the log itself; the log would be lost. Name another",
        ));
    }
    let folder = output::make(Some(&arguments.out), "", arguments.force)?;
    if frames.is_some() || arguments.exr {
        let frames = frames.unwrap_or_else(|| (0..frame_count).collect());
        let threads = arguments.threads.unwrap_or_else(crate::default_threads);
        let message = scene_message(&log, &set)?;
        let wanted =
            Wanted { log: &log, scene: &scene, scene_message: &message, frames, exr: arguments.exr, threads };
        let (made, pictures) = still_frames::render(&wanted, &folder)?;
        make_sheet(arguments, &folder, &pictures)?;
        let part = Some(folder.join(PART_FILE));
        let report = Report { frames: made.frames, movie: made.movie, part, pictures: pictures.len() };
        if arguments.json {
            print_json(&report)?;
        } else {
            print(&report.to_string())?;
        }
        return Ok(Exit::Done);
    }
    let start = Instant::now();
    let bus = BusName::unique();
    let threads = run::threads_arguments(arguments.threads);
    let log = std::path::absolute(&arguments.log)
        .map_err(|error| Failure::input(format!("{}: {error}", arguments.log.display())))?;
    let mut replay: Vec<OsString> = vec!["replay".into(), log.into(), "--as-fast-as-possible".into()];
    replay.extend(run::set_arguments(&set));
    let replay = Part { name: "replay", unit: "steps", arguments: replay, input: None };
    let parts = run::parts(&bus, replay, &folder.join("log.mcap"), &threads, false);
    let exit = run::finish(&folder, run::supervise_on(&bus, parts), start, arguments.json)?;
    if wants_sheet(arguments) {
        let log = log_file::open(&folder.join("log.mcap"))?;
        let frames =
            (0..log.count(Kind::Frame)).map(|index| Ok(log.frame(index).map_err(log_file::failure)?.data));
        make_sheet(arguments, &folder, &frames.collect::<Result<Vec<_>, Failure>>()?)?;
    }
    Ok(exit)
}

/// What a rerendering without a log leaves behind.
#[derive(Serialize)]
struct Report {
    frames: Option<PathBuf>,
    movie: Option<PathBuf>,
    part: Option<PathBuf>,
    pictures: usize,
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "pictures        {}", self.pictures)?;
        if let Some(frames) = &self.frames {
            write!(f, "\nframes          {}", frames.display())?;
        }
        if let Some(movie) = &self.movie {
            write!(f, "\nmovie           {}", movie.display())?;
        }
        if let Some(part) = &self.part {
            write!(f, "\npart            {}", part.display())?;
        }
        Ok(())
    }
}

fn wants_sheet(arguments: &Arguments) -> bool {
    #[cfg(feature = "movie")]
    return arguments.sheet.is_some();
    #[cfg(not(feature = "movie"))]
    {
        let _ = arguments;
        false
    }
}

fn make_sheet(arguments: &Arguments, folder: &Path, pictures: &[Vec<u8>]) -> Result<(), Failure> {
    #[cfg(feature = "movie")]
    if let Some(count) = arguments.sheet.filter(|&count| count > 0 && !pictures.is_empty()) {
        let chosen: Vec<_> =
            crate::sheet::chosen(pictures.len(), count).map(|index| pictures[index].clone()).collect();
        crate::sheet::write(&folder.join("sheet.png"), &chosen, crate::sheet::WIDTH_PX)?;
    }
    #[cfg(not(feature = "movie"))]
    let _ = (arguments, folder, pictures);
    Ok(())
}

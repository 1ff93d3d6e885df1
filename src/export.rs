//! `export`: what a log holds, for other programs.

use crate::failure::{Exit, Failure, Outcome};
use crate::log_file;
#[cfg(feature = "movie")]
use crate::movie::{Movie, Picture};
use crate::resimulate::States as Remade;
use crate::terminal::{print, print_json};
use clap::{Args, ValueEnum};
use recorder::export::{BODIES_DRAWN_MAX, ExportError, States, csv, viewer};
use recorder::{Kept, Kind, Log, StateSource};
use serde::Serialize;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:\n  chainmail export out/drop/log.mcap --format csv --out tables\n  \
                        chainmail export out/drop/log.mcap --format viewer --out drop-viewer.mcap\n\n\
                        csv: a folder with steps.csv, bodies.csv and contacts.csv. png: a folder of pictures. mp4: a \
                        movie. viewer: an MCAP file that Foxglove, Lichtblick and Rerun show.")]
pub struct Arguments {
    /// The log
    log: PathBuf,
    /// What to write
    #[arg(long, value_enum)]
    format: Format,
    /// The file or folder to write
    #[arg(long, value_name = "PATH")]
    out: PathBuf,
    /// Which states [default: kept for csv, frames for viewer]
    #[arg(long, value_enum)]
    states: Option<Which>,
    /// Threads to simulate with; no result depends on them [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Replace what exists
    #[arg(long)]
    force: bool,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// A movie, H.264
    Mp4,
    /// Pictures, byte for byte as in the log
    Png,
    /// Tables
    Csv,
    /// A file for viewers
    Viewer,
}

#[derive(Clone, Copy, ValueEnum)]
enum Which {
    /// The state of every step; those that the log does not keep are simulated again
    All,
    /// Every state that the log keeps
    Kept,
    /// Those at frame times
    Frames,
}

/// What was written.
#[derive(Serialize)]
struct Report {
    files: Vec<Written>,
}

#[derive(Serialize)]
struct Written {
    file: PathBuf,
    bytes: u64,
}

pub fn run(arguments: &Arguments) -> Outcome {
    crate::stop::flag();
    let log = log_file::open(&arguments.log)?;
    let out = &arguments.out;
    if out.exists() && !arguments.force {
        return Err(Failure::input(format!(
            "{} exists; name another with --out, or add --force to replace it",
            out.display()
        )));
    }
    let same = |path: &Path| path.canonicalize().ok();
    if same(&arguments.log).is_some_and(|log| Some(log) == same(out)) {
        return Err(Failure::input("--out names the log itself; the log would be lost. Name another"));
    }
    let which = arguments.states.unwrap_or(match arguments.format {
        Format::Csv => Which::Kept,
        _ => Which::Frames,
    });
    let states = if let Which::Frames = which { States::Frames } else { States::All };
    let threads = arguments.threads.unwrap_or_else(crate::default_threads).get();
    let (mut kept, mut remade) = (Kept(&log), Remade::new(&log, threads));
    let source: &mut dyn StateSource = if let Which::All = which { &mut remade } else { &mut kept };
    let files = match arguments.format {
        Format::Csv => tables(&log, states, source, out)?,
        Format::Png => pictures(&log, out)?,
        Format::Mp4 => movie(&log, out)?,
        Format::Viewer => {
            note_what_is_left_out(&log)?;
            viewer(&log, states, source, create(out)?).map_err(failure)?;
            vec![out.clone()]
        }
    };
    let written = |file: PathBuf| Written { bytes: file.metadata().map_or(0, |file| file.len()), file };
    let report = Report { files: files.into_iter().map(written).collect() };
    if arguments.json {
        print_json(&report)?;
    } else {
        print(&report.to_string())?;
    }
    log_file::refuse_damage(&log)?;
    Ok(Exit::Done)
}

fn failure(error: ExportError) -> Failure {
    match error {
        ExportError::Log(error) => log_file::failure(error),
        error => Failure::lost(error),
    }
}

fn cannot_write(path: &Path, error: impl std::fmt::Display) -> Failure {
    Failure::lost(format!("cannot write {}: {error}", path.display()))
}

fn create(path: &Path) -> Result<BufWriter<File>, Failure> {
    File::create(path).map(BufWriter::new).map_err(|error| cannot_write(path, error))
}

fn make_folder(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder)
        .map_err(|error| Failure::input(format!("cannot make {}: {error}", folder.display())))
}

fn tables(
    log: &Log,
    states: States,
    source: &mut dyn StateSource,
    folder: &Path,
) -> Result<Vec<PathBuf>, Failure> {
    make_folder(folder)?;
    let mut files = Vec::new();
    let mut table = |name: &str, write: &mut dyn FnMut(&mut dyn Write) -> Result<(), ExportError>| {
        let path = folder.join(name);
        let mut file = create(&path)?;
        write(&mut file).map_err(failure)?;
        file.flush().map_err(|error| cannot_write(&path, error))?;
        files.push(path);
        Ok::<(), Failure>(())
    };
    table("steps.csv", &mut |sink| csv::steps(log, sink))?;
    table("bodies.csv", &mut |sink| csv::bodies(log, states, source, sink))?;
    table("contacts.csv", &mut |sink| csv::contacts(log, states, source, sink))?;
    Ok(files)
}

/// How many frames a log has; none is an error.
fn frame_count(log: &Log) -> Result<usize, Failure> {
    match log.count(Kind::Frame) {
        0 => Err(Failure::input(format!(
            "{}: it has no frames; `chainmail rerender` makes a log with frames from it",
            log.file()
        ))),
        count => Ok(count),
    }
}

fn pictures(log: &Log, folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let count = frame_count(log)?;
    make_folder(folder)?;
    let mut files = Vec::new();
    for frame in 0..count {
        let path = folder.join(format!("{frame:04}.png"));
        let image = log.frame(frame).map_err(log_file::failure)?;
        fs::write(&path, &image.data).map_err(|error| cannot_write(&path, error))?;
        files.push(path);
    }
    Ok(files)
}

#[cfg(feature = "movie")]
fn movie(log: &Log, path: &Path) -> Result<Vec<PathBuf>, Failure> {
    let count = frame_count(log)?;
    let picture = |frame| {
        let image = log.frame(frame).map_err(log_file::failure)?;
        Picture::from_png(&image.data).map_err(Failure::lost)
    };
    let frames_per_second = log.scene().map_err(log_file::failure)?.scene.time.frames_per_second;
    let mut movie =
        Movie::create(path, &picture(0)?, frames_per_second).map_err(|error| cannot_write(path, error))?;
    for frame in 0..count {
        movie.push(picture(frame)?).map_err(|error| cannot_write(path, error))?;
    }
    movie.finish().map_err(|error| cannot_write(path, error))?;
    Ok(vec![path.to_owned()])
}

#[cfg(not(feature = "movie"))]
fn movie(_: &Log, _: &Path) -> Result<Vec<PathBuf>, Failure> {
    Err(Failure::input("this program was built without the feature `movie`; --format png gives the pictures"))
}

fn note_what_is_left_out(log: &Log) -> Result<(), Failure> {
    let bodies = log.scene().map_err(log_file::failure)?.scene.body_count();
    if bodies > BODIES_DRAWN_MAX {
        crate::terminal::say(format!(
            "note: {bodies} bodies are too many for a viewer to draw each ({BODIES_DRAWN_MAX} at most); the file has the \
             rings' poses, and no /scene and no frames of reference of bodies"
        ));
    }
    Ok(())
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // A folder of pictures is told by its first and last.
        let count = self.files.len();
        for (number, Written { file, bytes }) in self.files.iter().enumerate() {
            if number < 3 || number + 1 == count {
                writeln!(f, "{:<15} {:.1} kB", file.display(), *bytes as f64 / 1e3)?;
            } else if number == 3 {
                writeln!(f, "...")?;
            }
        }
        write!(f, "{count} files")
    }
}

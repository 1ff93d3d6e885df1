//! `diff`: the first difference of two logs.

use crate::explain::{Explanation, explain};
use crate::failure::{Exit, Failure, Outcome};
use crate::log_file;
use crate::resimulate::States;
use crate::terminal::{print, print_json};
use clap::Args;
use recorder::Log;
use recorder::diff::{Diff, DifferencePicture, Options, diff_by, diff_with, difference_picture, html};
use serde::Serialize;
use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(
    after_help = "Examples:\n  chainmail diff a/log.mcap b/log.mcap\n  chainmail diff a/log.mcap b/log.mcap --explain\n  \
                        chainmail diff a/log.mcap b/log.mcap --html diff.html --frames-out pictures\n\n\
                        Exit codes: 0 same, 1 different, 2 cannot be compared, 3 damaged."
)]
pub struct Arguments {
    /// One log
    a: PathBuf,
    /// The other
    b: PathBuf,
    /// Compare every byte up to the first difference, even if the hashes lead to it
    #[arg(long)]
    thorough: bool,
    /// Simulate the first differing step again and say which of the logs this program agrees with
    #[arg(long)]
    explain: bool,
    /// Do not simulate states again that the logs do not keep: compare the next ones that both keep
    #[arg(long)]
    no_remake: bool,
    /// Threads to simulate with; no result depends on them [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Write a report as one HTML page, with a plot of the growth and the first differing frame
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Write a picture of each differing frame into a folder: A, B and their difference, brightened
    #[arg(long, value_name = "DIR")]
    frames_out: Option<PathBuf>,
    /// Replace a report or pictures that exist
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Steps between the powers of two at which the report's plot has points.
const PLOT_POINTS: usize = 48;

/// The report of `--json`.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    diff: &'a Diff,
    #[serde(skip_serializing_if = "Option::is_none")]
    explanation: Option<&'a Explanation>,
}

pub fn run(arguments: &Arguments) -> Outcome {
    crate::stop::flag();
    for path in [&arguments.html, &arguments.frames_out].into_iter().flatten() {
        if path.exists() && !arguments.force {
            return Err(Failure::input(format!(
                "{} exists; name another, or add --force to replace what is in it",
                path.display()
            )));
        }
    }
    let (a, b) = (log_file::open(&arguments.a)?, log_file::open(&arguments.b)?);
    let growth_points = if arguments.html.is_some() { PLOT_POINTS } else { 0 };
    let options = Options { thorough: arguments.thorough, growth_points };
    let threads = arguments.threads.unwrap_or_else(crate::default_threads).get();
    let diff = if arguments.no_remake {
        diff_with(&a, &b, options)
    } else {
        let [mut states_a, mut states_b] = [&a, &b].map(|log| States::new(log, threads));
        diff_by(&a, &b, options, [&mut states_a, &mut states_b])
    };
    if let Some(folder) = &arguments.frames_out {
        write_pictures(folder, &a, &b, &diff)?;
    }
    if let Some(path) = &arguments.html {
        let shown = differing_frames(&diff)
            .next()
            .and_then(|frame| Some((frame, difference_picture(&a, &b, frame).ok()?)));
        write(path, html(&diff, shown.as_slice()).as_bytes())?;
    }
    // What was found out is told, whatever becomes of the explanation.
    let explained = if arguments.explain { explain(&a, &b, &diff, threads) } else { Ok(None) };
    if arguments.json {
        let explanation = explained.as_ref().ok().and_then(Option::as_ref);
        print_json(&Report { diff: &diff, explanation })?;
    } else {
        let text = match &explained {
            Ok(Some(explanation)) => format!("\n{explanation}"),
            Ok(None) if arguments.explain => {
                "\nexplain  no step differs: there is nothing to simulate".to_owned()
            }
            Ok(None) | Err(_) => String::new(),
        };
        print(&format!("{diff}{text}"))?;
    }
    if let Err(failure) = explained {
        return Err(Failure { message: format!("no explanation: {}", failure.message), ..failure });
    }
    Ok(Exit::from_code(diff.verdict.exit_code()))
}

fn differing_frames(diff: &Diff) -> impl Iterator<Item = usize> {
    diff.frames.iter().flat_map(|frames| &frames.errors).map(|error| error.frame)
}

/// Writes `NNNN.png` for each differing frame that can be compared.
fn write_pictures(folder: &Path, a: &Log, b: &Log, diff: &Diff) -> Result<(), Failure> {
    fs::create_dir_all(folder)
        .map_err(|error| Failure::input(format!("cannot make {}: {error}", folder.display())))?;
    for frame in differing_frames(diff) {
        match difference_picture(a, b, frame) {
            Ok(DifferencePicture { png, .. }) => write(&folder.join(format!("{frame:04}.png")), &png)?,
            Err(reason) => crate::terminal::say(format!("warning: no picture of frame {frame}: {reason}")),
        }
    }
    Ok(())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    fs::write(path, bytes).map_err(|error| Failure::lost(format!("cannot write {}: {error}", path.display())))
}

//! Frames of a log rendered again by this process alone, into pictures and no log: a part of them, or with linear light.

use crate::failure::Failure;
use crate::pictures::{InTheMaking, Made, remove_earlier};
use crate::progress::{Meter, Progress};
use crate::verify::{FrameDifference, Frames};
use crate::{log_file, stop};
use recorder::{Kind, Log};
use render_node::node::with_environment_file;
use render_node::{
    FeatureImages, Film, Job, RenderModel, Stage, exr_bytes, film_channels, png_bytes, render_on,
};
use schemas::scene::Scene;
use schemas::state::BodyState;
use std::fs;
use std::num::NonZeroUsize;
use std::ops::RangeInclusive;
use std::path::Path;

/// What to render.
pub struct Wanted<'a> {
    pub log: &'a Log,
    /// The log's scene with its new second half.
    pub scene: &'a Scene,
    pub frames: RangeInclusive<u64>,
    /// Whether linear light and feature images are written beside each picture.
    pub exr: bool,
    pub threads: NonZeroUsize,
}

/// Renders frames into `FOLDER/frames/NNNN.png`, with `NNNN.exr` beside them if they are asked for, and a movie of more
/// than one. Returns the pictures' bytes, too.
pub fn render(wanted: &Wanted, folder: &Path) -> Result<(Made, Vec<Vec<u8>>), Failure> {
    let write = |path: &Path, bytes: &[u8]| {
        fs::write(path, bytes)
            .map_err(|error| Failure::lost(format!("cannot write {}: {error}", path.display())))
    };
    let cannot = |error: &dyn std::fmt::Display| Failure::input(error);
    let (model, _) = RenderModel::try_compile(wanted.scene).map_err(|error| cannot(&error))?;
    let (model, _) = with_environment_file(model).map_err(|error| cannot(&error))?;
    remove_earlier(folder)
        .map_err(|error| Failure::lost(format!("cannot write {}: {error}", folder.display())))?;
    let frames = folder.join("frames");
    fs::create_dir_all(&frames)
        .map_err(|error| Failure::lost(format!("cannot make {}: {error}", frames.display())))?;
    let mut movie = InTheMaking::new(wanted.log, folder)?;
    let mut meter = Meter::for_this_process("renderer", "frames");
    let total = wanted.frames.end() - wanted.frames.start() + 1;
    let mut pictures = Vec::new();
    let mut stage = Stage::default();
    for frame in wanted.frames.clone() {
        let bodies = state_of(wanted, frame)?;
        let job = Job { frame, seed: wanted.scene.seed, threads: wanted.threads };
        let film = render_on(&mut stage, &model, &bodies, &job, &mut || !stop::requested())
            .map_err(|error| cannot(&format!("frame {frame}: {error}")))?;
        let Some(film) = film else {
            return Err(Failure::lost(format!("interrupted at frame {frame}; those before it are there")));
        };
        warn_of_non_finite(frame, &film);
        let png = png_bytes(&film, model.settings()).map_err(Failure::lost)?;
        write(&frames.join(format!("{frame:04}.png")), &png)?;
        if wanted.exr {
            let features = FeatureImages::new(&model, &bodies, frame).map_err(|error| cannot(&error))?;
            let channels = film_channels(&film).into_iter().chain(features.channels()).collect();
            let bytes = exr_bytes(film.width_px as usize, film.height_px as usize, channels)
                .map_err(Failure::lost)?;
            write(&frames.join(format!("{frame:04}.exr")), &bytes)?;
        }
        if total > 1 {
            movie.push(&png);
        }
        pictures.push(png);
        meter.show(Progress { done: frame - wanted.frames.start() + 1, total });
    }
    meter.finish();
    Ok((Made { frames: Some(frames), movie: movie.finish() }, pictures))
}

/// Renders the frames of a log again, up to the first whose film has another hash than the log says.
pub fn verify(log: &Log, threads: NonZeroUsize) -> Result<Frames, Failure> {
    let scene = log.scene().map_err(log_file::failure)?.scene;
    let cannot = |error: &dyn std::fmt::Display| Failure::input(error);
    let (model, _) = RenderModel::try_compile(&scene).map_err(|error| cannot(&error))?;
    let (model, environment_hash) = with_environment_file(model).map_err(|error| cannot(&error))?;
    let total = log.count(Kind::FrameInfo);
    let mut meter = Meter::for_this_process("renderer", "frames");
    let mut stage = Stage::default();
    for index in 0..total {
        let info = log.frame_info(index).map_err(log_file::failure)?;
        if info.environment_hash != environment_hash {
            return Err(Failure::input(format!(
                "{}: frame {index} was rendered with another file of render.environment than the one that is there now",
                log.file()
            )));
        }
        let wanted = Wanted { log, scene: &scene, frames: info.frame..=info.frame, exr: false, threads };
        let bodies = state_of(&wanted, info.frame)?;
        let job = Job { frame: info.frame, seed: scene.seed, threads };
        let film = render_on(&mut stage, &model, &bodies, &job, &mut || !stop::requested())
            .map_err(|error| cannot(&format!("frame {index}: {error}")))?;
        let Some(film) = film else {
            return Err(Failure::lost(format!(
                "interrupted at frame {index}; those before it are identical"
            )));
        };
        let rendered = film.hash();
        if rendered != info.film_hash {
            let (logged, rendered) = (info.film_hash.to_string(), rendered.to_string());
            let difference = FrameDifference { frame: info.frame, logged, rendered };
            return Ok(Frames { identical: index, first_difference: Some(difference) });
        }
        meter.show(Progress { done: index as u64 + 1, total: total as u64 });
    }
    meter.finish();
    Ok(Frames { identical: total, first_difference: None })
}

/// The bodies of a frame.
fn state_of(wanted: &Wanted, frame: u64) -> Result<Vec<BodyState>, Failure> {
    let step = wanted.scene.time.frame_step(frame);
    let state = wanted.log.state(step).map_err(log_file::failure)?;
    let missing = || {
        Failure::input(format!(
            "{}: it has no state of frame {frame}, which is step {step}",
            wanted.log.file()
        ))
    };
    Ok(state.ok_or_else(missing)?.bodies)
}

fn warn_of_non_finite(frame: u64, film: &Film) {
    if let Some(place) = film.first_non_finite {
        crate::terminal::say(format!(
            "warning: frame {frame}: {} samples were not finite and were left out; the first is sample {} of pixel {}, {}",
            film.non_finite_samples, place.sample, place.x_px, place.y_px
        ));
    }
}

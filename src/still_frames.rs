//! Frames of a log rendered again by this process alone, into pictures, and a part that `merge` makes a log of: some of
//! them, or with linear light.

use crate::failure::Failure;
use crate::pictures::{InTheMaking, Made, remove_earlier};
use crate::progress::{Meter, Progress};
use crate::verify::{FrameDifference, Frames};
use crate::{log_file, stop};
use prost::Message as _;
use recorder::PartWriter;
use recorder::{Kind, Log};
use render_node::node::{frame_info, with_environment_file};
use render_node::{
    FeatureImages, Film, Job, RenderModel, Stage, exr_bytes, film_channels, png_bytes, render_on,
};
use schemas::frame::{CompressedImage, FrameInfo};
use schemas::log_time_ns;
use schemas::scene::Scene;
use schemas::state::StateMessage;
use std::fs::{self, File};
use std::num::NonZeroUsize;
use std::path::Path;

/// What to render.
pub struct Wanted<'a> {
    pub log: &'a Log,
    /// The log's scene with its new second half.
    pub scene: &'a Scene,
    /// Its message in the part.
    pub scene_message: &'a [u8],
    pub frames: Vec<u64>,
    /// Whether linear light and feature images are written beside each picture.
    pub exr: bool,
    pub threads: NonZeroUsize,
}

/// What the part of a log is called in its folder.
pub const PART_FILE: &str = "part.mcap";

/// Renders frames into `FOLDER/frames/NNNN.png`, with `NNNN.exr` beside them if they are asked for, a movie of more
/// than one, and a part of a log. Returns the pictures' bytes, too.
pub fn render(wanted: &Wanted, folder: &Path) -> Result<(Made, Vec<Vec<u8>>), Failure> {
    let write = |path: &Path, bytes: &[u8]| {
        fs::write(path, bytes)
            .map_err(|error| Failure::lost(format!("cannot write {}: {error}", path.display())))
    };
    let cannot = |error: &dyn std::fmt::Display| Failure::input(error);
    let (model, plan) = RenderModel::try_compile(wanted.scene).map_err(|error| cannot(&error))?;
    let (model, environment_hash) = with_environment_file(model).map_err(|error| cannot(&error))?;
    remove_earlier(folder)
        .map_err(|error| Failure::lost(format!("cannot write {}: {error}", folder.display())))?;
    let frames = folder.join("frames");
    fs::create_dir_all(&frames)
        .map_err(|error| Failure::lost(format!("cannot make {}: {error}", frames.display())))?;
    let part_path = folder.join(PART_FILE);
    let cannot_write =
        |error: std::io::Error| Failure::lost(format!("cannot write {}: {error}", part_path.display()));
    let mut part = File::create(&part_path)
        .and_then(|file| PartWriter::create(file, wanted.scene_message))
        .map_err(cannot_write)?;
    let mut movie = InTheMaking::new(wanted.log, folder)?;
    let mut meter = Meter::for_this_process("renderer", "frames");
    let total = wanted.frames.len() as u64;
    let mut pictures = Vec::new();
    let mut stage = Stage::default();
    for &frame in &wanted.frames {
        let state = state_of(wanted, frame)?;
        let bodies = &state.bodies;
        let job = Job { frame, seed: wanted.scene.seed, threads: wanted.threads };
        let film = render_on(&mut stage, &model, bodies, &job, &mut || !stop::requested())
            .map_err(|error| cannot(&format!("frame {frame}: {error}")))?;
        let Some(film) = film else {
            return Err(Failure::lost(format!("interrupted at frame {frame}; those before it are there")));
        };
        warn_of_non_finite(frame, &film);
        let png = png_bytes(&film, model.settings()).map_err(Failure::lost)?;
        write(&frames.join(format!("{frame:04}.png")), &png)?;
        if wanted.exr {
            let features = FeatureImages::new(&model, bodies, frame).map_err(|error| cannot(&error))?;
            let channels = film_channels(&film).into_iter().chain(features.channels()).collect();
            let bytes = exr_bytes(film.width_px as usize, film.height_px as usize, channels)
                .map_err(Failure::lost)?;
            write(&frames.join(format!("{frame:04}.exr")), &bytes)?;
        }
        if total > 1 {
            movie.push(&png);
        }
        let time_ns = log_time_ns(state.header.sim_time_s);
        let info = frame_info(frame, &state, &film, wanted.scene, &plan);
        let info = serde_json::to_vec(&FrameInfo { environment_hash, ..info }).map_err(Failure::lost)?;
        let image = CompressedImage::png(time_ns, png.clone()).encode_to_vec();
        part.write(time_ns, &image, &info).map_err(cannot_write)?;
        pictures.push(png);
        meter.show(Progress { done: pictures.len() as u64, total });
    }
    meter.finish();
    part.finish().and_then(|file| file.sync_all()).map_err(cannot_write)?;
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
        let bodies = state_at_frame(log, &scene, info.frame)?.bodies;
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

fn state_of(wanted: &Wanted, frame: u64) -> Result<StateMessage, Failure> {
    state_at_frame(wanted.log, wanted.scene, frame)
}

/// The state of a frame; a log keeps them all.
fn state_at_frame(log: &Log, scene: &Scene, frame: u64) -> Result<StateMessage, Failure> {
    let step = scene.time.frame_step(frame);
    let state = log.state(step).map_err(log_file::failure)?;
    let missing =
        || Failure::input(format!("{}: it has no state of frame {frame}, which is step {step}", log.file()));
    state.ok_or_else(missing)
}

fn warn_of_non_finite(frame: u64, film: &Film) {
    if let Some(place) = film.first_non_finite {
        crate::terminal::say(format!(
            "warning: frame {frame}: {} samples were not finite and were left out; the first is sample {} of pixel {}, {}",
            film.non_finite_samples, place.sample, place.x_px, place.y_px
        ));
    }
}

//! The renderer as a process: keyframes in, frames out. The only file that knows the bus.

use crate::environment::{EnvironmentMap, MapError};
use crate::film::{Film, SamplePlace};
use crate::frame::{Job, Stage, render_on};
use crate::model::RenderModel;
use crate::picture::png_bytes;
use crate::solids::FormulaRefused;
use crate::world::PoseError;
use bus::{Bus, BusError, BusName, Message, Publisher, Received, Subscriber};
use prost::Message as _;
use schemas::Hash;
use schemas::frame::{CompressedImage, FrameInfo};
use schemas::plan::Plan;
use schemas::scene::{Scene, SceneError, SceneRecord};
use schemas::state::{self, StateError, StateMessage};
use schemas::topics::{FRAME, FRAME_INFO, KEYFRAME, Role, SCENE};
use std::collections::VecDeque;
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Places of the frame topic's queue, in bytes: a PNG of 640 x 360 noisy pixels. Longer messages travel in pieces.
const FRAME_BYTES: usize = 1 << 20;
/// The same for what is said about a frame.
const FRAME_INFO_BYTES: usize = 1 << 14;
/// How long the bus is waited for before looking around.
const WAIT: Duration = Duration::from_millis(50);
/// How long a renderer that was asked to stop still takes keyframes, so that a simulator that was asked to stop as well
/// can end their stream in good order.
const STOP_PATIENCE: Duration = Duration::from_millis(500);

/// How a renderer process is started.
#[derive(Clone, Debug, clap::Args)]
pub struct RenderOptions {
    /// Name of the bus that the run's processes meet on
    #[arg(long, value_name = "NAME")]
    pub bus: BusName,
    /// Threads that render [default: one for each core]; pictures do not depend on it
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Changes a key of the scene's render half, as in --set render.samples_per_pixel=64; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
}

/// How far a renderer is, and in the end how far it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct RenderProgress {
    /// Frames rendered and sent.
    pub frames_done: u64,
    /// Frames that a whole run of the scene has.
    pub frame_count: u64,
    /// Rays traced.
    pub rays: u64,
    /// Samples that came out as NaN or infinite.
    pub non_finite_samples: u64,
    /// Whether it was asked to stop before the stream of keyframes ended.
    pub stopped: bool,
}

/// Why a renderer ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// A peer was lost, or the bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The stream of scenes ended without one.
    #[error("topic scene ended after {messages} messages, and one scene was expected")]
    NoScene {
        /// Messages that came.
        messages: u64,
    },
    /// A polynomial body's formula is not that of a body.
    #[error("the scene cannot be shown: {0}")]
    Surface(#[from] FormulaRefused),
    /// The environment map's file cannot be read.
    #[error(
        "render.environment.file {file}: {source}; it is looked for from the folder that the renderer is started in"
    )]
    EnvironmentFile {
        /// The file, as the scene names it.
        file: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The environment map's file holds none.
    #[error("render.environment.file {file}: {source}")]
    Environment {
        /// The file, as the scene names it.
        file: String,
        /// What is wrong with it.
        source: MapError,
    },
    /// The scene's message is not a scene.
    #[error("the message on topic scene cannot be read as a scene: {0}; are all processes of one version?")]
    SceneJson(#[source] serde_json::Error),
    /// An override that does not fit.
    #[error(transparent)]
    Override(#[from] SceneError),
    /// A keyframe that is not a state.
    #[error("keyframe {sequence}: {source}")]
    State {
        /// Number of the keyframe in its stream.
        sequence: u64,
        /// What is wrong with it.
        source: StateError,
    },
    /// A keyframe that is not a state of this scene.
    #[error("frame {frame} (step {step}): {source}")]
    Pose {
        /// Number of the frame.
        frame: u64,
        /// Its step.
        step: u64,
        /// What is wrong with it.
        source: PoseError,
    },
    /// A frame could not be written as PNG.
    #[error("frame {frame} cannot be encoded as PNG: {source}")]
    Png {
        /// Number of the frame.
        frame: u64,
        /// The encoder's reason.
        source: png::EncodingError,
    },
}

impl NodeError {
    /// What the process exits with: 2 for bad input, 3 for a lost peer or damaged data.
    pub fn exit_code(&self) -> u8 {
        match self {
            NodeError::Override(_) | NodeError::EnvironmentFile { .. } | NodeError::Environment { .. } => 2,
            NodeError::Bus(error) => error.exit_code(),
            _ => 3,
        }
    }
}

/// Gives a model the environment map that its scene names, and returns the hash of its file.
///
/// # Errors
///
/// [`NodeError::EnvironmentFile`] and [`NodeError::Environment`].
pub fn with_environment_file(model: RenderModel) -> Result<(RenderModel, Option<Hash>), NodeError> {
    let Some(environment) = &model.settings().environment else { return Ok((model, None)) };
    let file = || environment.file.clone();
    let bytes = std::fs::read(&environment.file)
        .map_err(|source| NodeError::EnvironmentFile { file: file(), source })?;
    let map =
        EnvironmentMap::decode(&bytes).map_err(|source| NodeError::Environment { file: file(), source })?;
    Ok((model.with_environment(map), Some(Hash::of(&bytes))))
}

/// Renders every keyframe of a run, and returns when their stream has ended.
///
/// `stop` ends it earlier, after the frame in progress; `progress` is called after every frame. A simulator that is
/// lost ends it between two tiles of a frame.
///
/// # Errors
///
/// [`NodeError`]. The streams of frames are ended in good order all the same, if the recorder is still there.
pub fn run(
    options: &RenderOptions,
    stop: &Arc<AtomicBool>,
    progress: &mut dyn FnMut(&RenderProgress),
) -> Result<RenderProgress, NodeError> {
    let bus = Bus::join(&options.bus, Role::Renderer, Arc::clone(stop))?;
    let mut frames = Publisher::open(&bus, &FRAME, FRAME.subscribers, FRAME_BYTES)?;
    let mut infos = Publisher::open(&bus, &FRAME_INFO, FRAME_INFO.subscribers, FRAME_INFO_BYTES)?;
    let mut scenes = Subscriber::open(&bus, &SCENE)?;
    let keyframes = Subscriber::open(&bus, &KEYFRAME)?;
    let mut keyframes =
        Keyframes { bus: &bus, topic: keyframes, waiting: VecDeque::new(), ended: false, lost: None };
    match bus.handshake(&mut [&mut frames, &mut infos], &mut [&mut scenes, &mut keyframes.topic]) {
        Err(BusError::Stopped { .. }) => return Ok(RenderProgress { stopped: true, ..Default::default() }),
        shaken => shaken?,
    }
    let outcome = render_all(options, stop, &mut scenes, &mut keyframes, &mut frames, &mut infos, progress);
    let finished = frames.finish().and(infos.finish());
    let done = outcome?;
    finished?;
    Ok(done)
}

fn render_all(
    options: &RenderOptions,
    stop: &AtomicBool,
    scenes: &mut Subscriber,
    keyframes: &mut Keyframes,
    frames: &mut Publisher,
    infos: &mut Publisher,
    progress: &mut dyn FnMut(&RenderProgress),
) -> Result<RenderProgress, NodeError> {
    let mut done = RenderProgress::default();
    let Some(scene) = receive_scene(keyframes.bus, scenes, stop)? else {
        keyframes.let_go()?;
        return Ok(RenderProgress { stopped: true, ..done });
    };
    let scene = scene.with_render(&options.overrides)?;
    let (model, plan) = RenderModel::try_compile(&scene)?;
    let (model, environment_hash) = with_environment_file(model)?;
    let threads = options.threads.or(std::thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN);
    done.frame_count = scene.time.frame_count();
    let mut next_frame = 0;
    let mut stage = Stage::default();
    while let Some(message) = keyframes.next(stop)? {
        let state = state::decode(&message.bytes)
            .map_err(|source| NodeError::State { sequence: message.sequence, source })?;
        // A replay may begin at a later frame; a scene may take several frames at one step.
        let step = state.header.step;
        let frame = scene.time.frame_at(step).filter(|&frame| frame > next_frame).unwrap_or(next_frame);
        next_frame = frame + 1;
        let job = Job { frame, seed: scene.seed, threads };
        let film = render_on(&mut stage, &model, &state.bodies, &job, &mut || keyframes.go_on());
        let Some(film) = film.map_err(|source| NodeError::Pose { frame, step, source })? else {
            break;
        };
        report_non_finite(frame, &film);
        let png = png_bytes(&film, &scene.render).map_err(|source| NodeError::Png { frame, source })?;
        frames.send(message.log_time_ns, &CompressedImage::png(message.log_time_ns, png).encode_to_vec())?;
        let info = FrameInfo { environment_hash, ..frame_info(frame, &state, &film, &scene, &plan) };
        let info = serde_json::to_vec(&info);
        infos.send(message.log_time_ns, &info.expect("a record of numbers and texts is JSON"))?;
        done.frames_done += 1;
        done.rays += film.rays;
        done.non_finite_samples += film.non_finite_samples;
        progress(&done);
    }
    if let Some(lost) = keyframes.lost.take() {
        return Err(lost.into());
    }
    done.stopped = !keyframes.ended;
    keyframes.let_go()?;
    Ok(done)
}

/// The scene; `None` if a stop was asked for before it came.
fn receive_scene(bus: &Bus, scenes: &mut Subscriber, stop: &AtomicBool) -> Result<Option<Scene>, NodeError> {
    loop {
        match scenes.receive()? {
            Received::Message(message) => {
                let record: SceneRecord =
                    serde_json::from_slice(&message.bytes).map_err(NodeError::SceneJson)?;
                return Ok(Some(record.scene));
            }
            Received::End { count } => return Err(NodeError::NoScene { messages: count }),
            Received::Nothing if stop.load(Ordering::Relaxed) => return Ok(None),
            Received::Nothing => bus.wait(WAIT)?,
        }
    }
}

/// What is said of a frame, but for the hash of its environment map's file.
pub fn frame_info(frame: u64, state: &StateMessage, film: &Film, scene: &Scene, plan: &Plan) -> FrameInfo {
    FrameInfo {
        frame,
        step: state.header.step,
        sim_time_s: state.header.sim_time_s,
        state_hash: state.header.state_hash,
        film_hash: film.hash(),
        rays: film.rays,
        samples: film.samples(),
        non_finite_samples: film.non_finite_samples,
        first_non_finite: film
            .first_non_finite
            .map(|SamplePlace { x_px, y_px, sample }| [x_px, y_px, sample]),
        environment_hash: None,
        render: scene.render.clone(),
        plan: plan.clone(),
    }
}

fn report_non_finite(frame: u64, film: &Film) {
    if let Some(SamplePlace { x_px, y_px, sample }) = film.first_non_finite {
        let count = film.non_finite_samples;
        tracing::warn!(
            frame,
            count,
            x_px,
            y_px,
            sample,
            "samples are NaN or infinite; this is the first of them"
        );
    }
}

/// The stream of keyframes.
struct Keyframes<'a> {
    bus: &'a Bus,
    topic: Subscriber,
    /// Taken from the queue of a simulator that has gone, and not rendered yet.
    waiting: VecDeque<Message>,
    ended: bool,
    lost: Option<BusError>,
}

impl Keyframes<'_> {
    /// The next keyframe; `None` when their stream has ended or a stop was asked for.
    fn next(&mut self, stop: &AtomicBool) -> Result<Option<Message>, BusError> {
        loop {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            if let Some(message) = self.waiting.pop_front() {
                return Ok(Some(message));
            }
            match self.topic.receive()? {
                Received::Message(message) => return Ok(Some(message)),
                Received::End { .. } => {
                    self.ended = true;
                    return Ok(None);
                }
                Received::Nothing => self.bus.wait(WAIT)?,
            }
        }
    }

    /// Whether a frame in progress is worth finishing: not if the simulator has gone without ending its stream.
    ///
    /// A simulator that is done leaves its last keyframes and the end of their stream in the queue, so a dead one's
    /// queue is emptied to find out.
    fn go_on(&mut self) -> bool {
        while !self.ended && self.lost.is_none() && !self.bus.alive(Role::Simulator) {
            match self.topic.receive() {
                Ok(Received::Message(message)) => self.waiting.push_back(message),
                Ok(Received::End { .. }) => self.ended = true,
                Ok(Received::Nothing) => return true,
                Err(error) => self.lost = Some(error),
            }
        }
        self.lost.is_none()
    }

    /// Takes what still comes, for a moment: see [`STOP_PATIENCE`].
    fn let_go(&mut self) -> Result<(), BusError> {
        let begin = Instant::now();
        while !self.ended && begin.elapsed() < STOP_PATIENCE {
            match self.topic.receive() {
                Ok(Received::Message(_)) => {}
                Ok(Received::Nothing) => self.bus.wait(WAIT)?,
                Ok(Received::End { .. }) | Err(_) => break,
            }
        }
        Ok(())
    }
}

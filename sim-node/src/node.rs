//! The simulator as a process: the only file that knows the bus.
//!
//! Order of messages, the same on every run: `scene` once; then for each step, from step 0, `state` (when
//! due), `step`, and `keyframe` (at frame times); then `end` once. The simulator does not know what its
//! listeners do; it waits for them when their queues are full, and stops when one is lost.

use crate::{Model, ModelError, Records, Scratch, State, check_audit, evaluate, step};
use bus::{Bus, BusError, BusName, Publisher};
use schemas::end::{End, Outcome};
use schemas::plan::Plan;
use schemas::scene::{Scene, SceneError, SceneRecord};
use schemas::state::{BodyState, ContactState, StateHeader};
use schemas::topics::{self, Role, Topic};
use schemas::{Hash, log_time_ns, wire};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Arguments of the simulator process.
#[derive(Clone, Debug, clap::Args)]
pub struct SimOptions {
    /// Scene file
    pub scene: PathBuf,
    /// Bus that all processes of the run share
    #[arg(long, value_name = "NAME")]
    pub bus: BusName,
    /// Seed of all random numbers, instead of the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Threads; the result does not depend on them
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Override a key of the scene; may be repeated
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    pub set: Vec<String>,
    /// No renderer takes part in the run
    #[arg(long)]
    pub no_render: bool,
    /// No recorder takes part in the run
    #[arg(long)]
    pub no_record: bool,
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Steps done.
    pub steps: u64,
    /// Steps of the whole run.
    pub step_count: u64,
    /// Simulated time (s).
    pub sim_time_s: f64,
}

/// Why a simulator process failed.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// The scene file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The scene is not right.
    #[error("{}: {source}", path.display())]
    Scene {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: SceneError,
    },
    /// The scene cannot be simulated.
    #[error("{}: {source}", path.display())]
    Model {
        /// The file.
        path: PathBuf,
        /// Why.
        source: ModelError,
    },
    /// Another process was lost, or the bus cannot be used.
    #[error(transparent)]
    Bus(#[from] BusError),
}

impl NodeError {
    /// The process's exit code: 2 for bad input, 3 for a lost process or an unusable bus.
    pub fn exit_code(&self) -> u8 {
        match self {
            NodeError::Read { .. } | NodeError::Scene { .. } | NodeError::Model { .. } => 2,
            NodeError::Bus(error) => error.exit_code(),
        }
    }
}

/// The exit code of a run that said how it ended: 0 completed, 1 stopped by itself, 3 interrupted.
pub fn exit_code(outcome: &Outcome) -> u8 {
    match outcome {
        Outcome::Completed => 0,
        Outcome::Stopped(_) => 1,
        Outcome::Interrupted | Outcome::Recovered(_) => 3,
    }
}

/// The topics that a simulator (or a replay) publishes, as bytes: what it says is the caller's.
#[derive(Debug)]
pub struct Publishers {
    scene: Publisher,
    state: Publisher,
    step: Publisher,
    keyframe: Publisher,
    end: Publisher,
    // Last, so that the ports go before the bus does.
    bus: Bus,
}

/// Usual sizes of messages (bytes): places in the queues are made for them. Longer ones travel in pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageBytes {
    /// The scene's.
    pub scene: usize,
    /// A state's.
    pub state: usize,
}

/// A step record: about 800 bytes of JSON.
const STEP_BYTES: usize = 2048;
/// The end: counts, a hash, and a sentence if the run was stopped.
const END_BYTES: usize = 512;

impl Publishers {
    /// Takes the simulator's part on a bus and opens its topics for those who take part in the run.
    ///
    /// # Errors
    ///
    /// [`BusError`], for instance when the bus name is in use.
    pub fn open(
        name: &BusName,
        taking_part: &[Role],
        bytes: MessageBytes,
        stop: Arc<AtomicBool>,
    ) -> Result<Publishers, BusError> {
        let bus = Bus::join(name, Role::Simulator, stop)?;
        let open = |topic: &'static Topic, bytes: usize| {
            let there = topic.subscribers.iter().filter(|role| taking_part.contains(role));
            Publisher::open(&bus, topic, &there.copied().collect::<Vec<Role>>(), bytes)
        };
        Ok(Publishers {
            scene: open(&topics::SCENE, bytes.scene)?,
            state: open(&topics::STATE, bytes.state)?,
            step: open(&topics::STEP, STEP_BYTES)?,
            keyframe: open(&topics::KEYFRAME, bytes.state)?,
            end: open(&topics::END, END_BYTES)?,
            bus,
        })
    }

    /// Waits until everyone who takes part is connected to every topic, in whatever order they started.
    ///
    /// # Errors
    ///
    /// [`BusError::Stopped`] when asked to stop while waiting.
    pub fn handshake(&mut self) -> Result<(), BusError> {
        let Publishers { scene, state, step, keyframe, end, bus } = self;
        bus.handshake(&mut [scene, state, step, keyframe, end], &mut [])
    }

    /// Publishes the scene; first and once.
    ///
    /// # Errors
    ///
    /// [`BusError::PeerLost`], as all of these.
    pub fn publish_scene(&mut self, message: &[u8]) -> Result<(), BusError> {
        self.scene.send(0, message)
    }

    /// Publishes a state.
    ///
    /// # Errors
    ///
    /// As [`Publishers::publish_scene`].
    pub fn publish_state(&mut self, log_time_ns: u64, message: &[u8]) -> Result<(), BusError> {
        self.state.send(log_time_ns, message)
    }

    /// Publishes a step record, after the step's state.
    ///
    /// # Errors
    ///
    /// As [`Publishers::publish_scene`].
    pub fn publish_step(&mut self, log_time_ns: u64, message: &[u8]) -> Result<(), BusError> {
        self.step.send(log_time_ns, message)
    }

    /// Publishes the state of a frame time, after the step's record.
    ///
    /// # Errors
    ///
    /// As [`Publishers::publish_scene`].
    pub fn publish_keyframe(&mut self, log_time_ns: u64, message: &[u8]) -> Result<(), BusError> {
        self.keyframe.send(log_time_ns, message)
    }

    /// Publishes the end, last and once, and closes all topics.
    ///
    /// # Errors
    ///
    /// As [`Publishers::publish_scene`].
    pub fn publish_end(mut self, log_time_ns: u64, message: &[u8]) -> Result<(), BusError> {
        let sent = self.end.send(log_time_ns, message);
        let publishers = [self.scene, self.state, self.step, self.keyframe, self.end];
        // Each topic gets its end, even if another's subscriber is gone; the first error is the one to report.
        let finished = publishers.map(|publisher| publisher.finish().map(|_| ()));
        finished.into_iter().fold(sent, Result::and)
    }
}

/// Runs a simulator process from scene file to end of stream. `stop`, set by a signal, ends the run in good
/// order after the step at hand.
///
/// # Errors
///
/// [`NodeError`] if there was no run, or if it could not be told to its end. A run that was interrupted or
/// stopped by its own audit is not an error here: the returned [`End`] says so.
pub fn run(
    options: &SimOptions,
    stop: Arc<AtomicBool>,
    progress: &mut dyn FnMut(Progress),
) -> Result<End, NodeError> {
    let path = || options.scene.clone();
    let text =
        std::fs::read_to_string(&options.scene).map_err(|source| NodeError::Read { path: path(), source })?;
    let mut scene = Scene::parse_seeded(&text, &options.set, options.seed)
        .map_err(|source| NodeError::Scene { path: path(), source })?;
    let (model, plan) = Model::compile(&scene).map_err(|source| NodeError::Model { path: path(), source })?;
    // The log holds the step that was taken, also where the file leaves it open.
    scene.time = model.time().clone();
    let message = scene_message(scene.clone(), plan);
    let bytes = MessageBytes { scene: message.len(), state: state_bytes(&model) };
    let mut taking_part = Vec::new();
    if !options.no_render {
        taking_part.push(Role::Renderer);
    }
    if !options.no_record {
        taking_part.push(Role::Recorder);
    }
    let mut publishers = Publishers::open(&options.bus, &taking_part, bytes, Arc::clone(&stop))?;
    publishers.handshake()?;
    publishers.publish_scene(&message)?;
    let threads = options.threads.unwrap_or(1);
    let start = Start::of(&model);
    Ok(simulate(&model, &scene, start, threads, publishers, &stop, progress)?)
}

/// The message of the topic `scene`.
pub fn scene_message(scene: Scene, plan: Plan) -> Vec<u8> {
    serde_json::to_vec(&SceneRecord::new(scene, plan)).expect("a scene has a JSON form")
}

/// Usual size of a state's message: all bodies, and with friction two contacts each.
fn state_bytes(model: &Model) -> usize {
    let contacts = if model.features.friction { 2 * model.body_count() } else { 0 };
    size_of::<StateHeader>()
        + 2 * size_of::<u64>()
        + model.body_count() * size_of::<BodyState>()
        + contacts * size_of::<ContactState>()
}

/// Where a run begins, or goes on.
#[derive(Debug)]
pub struct Start {
    state: State,
    records: Records,
    /// What was published before; with `None`, the state itself is the first to be.
    published: Option<End>,
}

impl Start {
    /// The beginning of a run.
    pub fn of(model: &Model) -> Start {
        Start { state: State::initial(model), records: Records::after(Hash::default()), published: None }
    }

    /// After the step of `state`, the last of the records that `records` followed.
    ///
    /// `scene` is what the run's messages were counted by: its states and keyframes up to this step are not published
    /// again.
    pub fn after(model: &Model, scene: &Scene, state: State, mut records: Records) -> Start {
        records.stand_at(model, &state);
        let steps = || 0..=state.step;
        let published = End {
            outcome: Outcome::Completed,
            step_count: state.step,
            state_count: steps().filter(|&step| scene.state_is_recorded(step)).count() as u64,
            keyframe_count: steps().filter(|&step| model.time().frame_at(step).is_some()).count() as u64,
            chained_hash: records.chained_hash(),
        };
        Start { state, records, published: Some(published) }
    }
}

/// Makes all steps, publishes them, and then the end.
///
/// # Errors
///
/// [`BusError`] when a listener is lost.
pub fn simulate(
    model: &Model,
    scene: &Scene,
    start: Start,
    threads: usize,
    mut publishers: Publishers,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(Progress),
) -> Result<End, BusError> {
    let end = publish_steps(model, scene, start, threads, &mut publishers, stop, progress)?;
    let log_time = log_time_ns(end.step_count as f64 * model.time().time_step_s);
    publishers.publish_end(log_time, &wire::encode(&end))?;
    Ok(end)
}

/// Makes all steps and publishes them.
fn publish_steps(
    model: &Model,
    scene: &Scene,
    start: Start,
    threads: usize,
    publishers: &mut Publishers,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(Progress),
) -> Result<End, BusError> {
    let step_count = model.time().step_count();
    let mut scratch = Scratch::new(model, threads);
    let Start { mut state, mut records, published } = start;
    evaluate(model, &state, &mut scratch);
    let mut is_published = published.is_some();
    let mut end = published.unwrap_or(End {
        outcome: Outcome::Completed,
        step_count: 0,
        state_count: 0,
        keyframe_count: 0,
        chained_hash: Hash::default(),
    });
    loop {
        // Asked once a step, so that the last state is published with its step.
        let interrupted = stop.load(Ordering::Relaxed);
        let last = state.step == step_count || interrupted;
        if !is_published {
            let record = records.record(model, &state, &scratch);
            let log_time = log_time_ns(state.sim_time_s);
            if scene.state_is_recorded(state.step) || last {
                publishers.publish_state(log_time, records.state_message())?;
                end.state_count += 1;
            }
            let message = serde_json::to_vec(&record).expect("a step record has a JSON form");
            publishers.publish_step(log_time, &message)?;
            if model.time().frame_at(state.step).is_some() {
                publishers.publish_keyframe(log_time, records.state_message())?;
                end.keyframe_count += 1;
            }
            end.step_count = state.step;
            end.chained_hash = record.chained_hash;
            progress(Progress { steps: state.step, step_count, sim_time_s: state.sim_time_s });
            let linked = record.audit.map_or(Ok(()), |audit| check_audit(model, &state, &audit));
            if let Err(reason) =
                linked.and_then(|()| records.check_momentum()).and_then(|()| records.check_energy(&record))
            {
                end.outcome = Outcome::Stopped(reason.to_string());
                return Ok(end);
            }
        }
        is_published = false;
        if state.step == step_count {
            return Ok(end);
        }
        if interrupted {
            end.outcome = Outcome::Interrupted;
            return Ok(end);
        }
        if let Err(reason) = step(model, &mut state, &mut scratch) {
            end.outcome = Outcome::Stopped(reason.to_string());
            return Ok(end);
        }
    }
}

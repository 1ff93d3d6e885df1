//! `replay`: publishes a log on the topics of a simulator; a subscriber cannot tell the difference.
//!
//! States that the log does not keep are simulated again where the scene, or `--set record.state_every`, asks for them.

use crate::failure::{Exit, Failure, Outcome};
use crate::keys::Keys;
use crate::player::{Due, KEYS, Key, Player};
use crate::progress::{Meter, Progress};
use crate::resimulate::States;
use crate::{log_file, stop};
use bus::{BusError, BusName};
use clap::{Args, ValueEnum};
use recorder::{Kind, Log, StateSource};
use schemas::end::{End, Outcome as RunOutcome};
use schemas::scene::Scene;
use schemas::topics::Role;
use schemas::{log_time_ns, state, wire};
use sim_node::node::{MessageBytes, Publishers};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::{Duration, Instant};

#[derive(Args)]
#[command(after_help = "Example, with `chainmail render` and `chainmail record` in two other terminals:\n  \
                        chainmail replay out/drop/log.mcap --bus mine --as-fast-as-possible\n\n\
                        Keys on a terminal: space pause or play, . one step, + twice and - half as fast, f as fast as \
                        possible, left and right arrow a second back and on, home and end, l loop, q quit. Seeking and \
                        looping need --no-record: a log has every step once.")]
pub struct Arguments {
    /// The log
    log: PathBuf,
    /// Bus that all processes of the run share
    #[arg(long, value_name = "NAME")]
    bus: BusName,
    /// Simulated seconds in a second of time
    #[arg(long, value_name = "X", default_value_t = 1.0, conflicts_with = "as_fast_as_possible")]
    rate: f64,
    /// Wait for nothing but full queues
    #[arg(long)]
    as_fast_as_possible: bool,
    /// First step to publish
    #[arg(long, value_name = "STEP", default_value_t = 0)]
    from_step: u64,
    /// Last step to publish [default: the log's last]
    #[arg(long, value_name = "STEP")]
    to_step: Option<u64>,
    /// Begin at rest: space plays, . makes a step
    #[arg(long)]
    paused: bool,
    /// Begin again when the last step was published; needs --no-record
    #[arg(long, requires = "no_record")]
    repeat: bool,
    /// Publish these topics alone, besides scene and end; needs --no-record
    #[arg(long, value_enum, value_delimiter = ',', value_name = "TOPICS", requires = "no_record")]
    topics: Vec<Choice>,
    /// Threads to simulate skipped states with; no result depends on them [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Override a key of render.*, or record.state_every, in the scene; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// No renderer takes part in the run
    #[arg(long)]
    no_render: bool,
    /// No recorder takes part in the run
    #[arg(long)]
    no_record: bool,
}

/// What a replay can leave out.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Choice {
    State,
    Step,
    Keyframe,
}

pub fn run(arguments: &Arguments) -> Outcome {
    stop::flag();
    if !(arguments.rate > 0.0 && arguments.rate.is_finite()) {
        return Err(Failure::input(format!("--rate {}: expected a positive number", arguments.rate)));
    }
    if arguments.from_step > 0 && !arguments.no_record {
        return Err(Failure::input(
            "--from-step: the chain of hashes starts at step 0, so a later part is no log; add --no-record to publish \
             it for other listeners",
        ));
    }
    let log = log_file::open_whole(&arguments.log)?;
    let scene = log.scene().map_err(log_file::failure)?.scene;
    let scene = scene.with_view(&arguments.set).map_err(Failure::input)?;
    let message = scene_message(&log, &arguments.set)?;
    let playback = Playback::new(arguments, &log, &scene)?;
    let mut publishers = publishers(arguments, message.len(), &log).map_err(bus_failure)?;
    publishers.handshake().and_then(|()| publishers.publish_scene(&message)).map_err(bus_failure)?;
    playback.play(publishers)
}

/// The scene message of a log that is played with other keys.
pub fn scene_message(log: &Log, set: &[String]) -> Result<Vec<u8>, Failure> {
    if set.is_empty() {
        return Ok(log.nth(Kind::Scene, 0).map_err(log_file::failure)?.bytes.into_owned());
    }
    let mut record = log.scene().map_err(log_file::failure)?;
    record.scene = record.scene.with_view(set).map_err(Failure::input)?;
    serde_json::to_vec(&record).map_err(Failure::lost)
}

fn publishers(arguments: &Arguments, scene: usize, log: &Log) -> Result<Publishers, BusError> {
    let state = log.nth(Kind::State, 0).map_or(1, |message| message.bytes.len());
    let taking_part: Vec<Role> =
        [(Role::Renderer, arguments.no_render), (Role::Recorder, arguments.no_record)]
            .into_iter()
            .filter_map(|(role, absent)| (!absent).then_some(role))
            .collect();
    Publishers::open(&arguments.bus, &taking_part, MessageBytes { scene, state }, stop::flag())
}

fn bus_failure(error: BusError) -> Failure {
    Failure { exit: Exit::from_code(error.exit_code()), message: error.to_string() }
}

/// The part of a log that is played, and how fast.
struct Playback<'a> {
    log: &'a Log,
    scene: &'a Scene,
    states: States<'a>,
    player: Player,
    topics: Vec<Choice>,
    end: End,
    /// The last step to play.
    to_step: u64,
}

/// Waits end this early at the latest, so that a signal is seen.
const LOOK_EVERY: Duration = Duration::from_millis(50);

impl<'a> Playback<'a> {
    fn new(arguments: &Arguments, log: &'a Log, scene: &'a Scene) -> Result<Playback<'a>, Failure> {
        let no_end = || Failure::lost(format!("{}: it has no end record", log.file()));
        let end = log.end().map_err(log_file::failure)?.ok_or_else(no_end)?;
        let last = end.step_count;
        let (from_step, to_step) = (arguments.from_step, arguments.to_step.unwrap_or(last));
        if from_step > to_step || to_step > last {
            return Err(Failure::input(format!(
                "steps {from_step} to {to_step}: expected a part of 0 to {last}, the steps of {}",
                log.file()
            )));
        }
        let threads = arguments.threads.unwrap_or_else(crate::default_threads).get();
        let rate = (!arguments.as_fast_as_possible).then_some(arguments.rate);
        let player = Player::new(from_step..=to_step, scene.time.time_step_s, rate, arguments.no_record)
            .paused(arguments.paused)
            .looped(arguments.repeat);
        let (states, topics) = (States::new(log, threads), arguments.topics.clone());
        Ok(Playback { log, scene, states, player, topics, end, to_step })
    }

    fn has(&self, topic: Choice) -> bool {
        self.topics.is_empty() || self.topics.contains(&topic)
    }

    fn play(mut self, mut publishers: Publishers) -> Outcome {
        let mut meter = Meter::for_this_process("replay", "steps");
        let mut keys = Keys::take();
        if keys.are_there() {
            meter.say(KEYS);
        }
        let start = Instant::now();
        // Of the range: what a run has published that came this far.
        let (mut states, mut keyframes) = (0, 0);
        let (mut played, mut quit) = (None, false);
        loop {
            let mut wait = match self.player.due(start.elapsed()) {
                Due::Over => break,
                Due::Now => Duration::ZERO,
                Due::In(left) if left < LOOK_EVERY => left,
                Due::In(_) | Due::Resting => LOOK_EVERY,
            };
            let mut is_single = false;
            if (keys.are_there() || wait > Duration::ZERO)
                && let Some(key) = keys.next(wait)
            {
                meter.say(&self.player.press(key, start.elapsed()));
                is_single = key == Key::Step;
                quit = key == Key::Quit;
                wait = Duration::ZERO;
            }
            // One more step, so that it is published as a last one is.
            let is_last = stop::requested() || quit;
            if is_last {
                self.to_step = self.player.next();
            }
            let is_due = wait == Duration::ZERO && self.player.due(start.elapsed()) == Due::Now;
            if !(is_due || is_single || is_last) {
                continue;
            }
            let step = self.player.next();
            let published = self.publish(step, &mut publishers)?;
            states += u64::from(published.state);
            keyframes += u64::from(published.keyframe);
            played = Some(step);
            meter.show(Progress { done: step, total: self.to_step });
            if is_last {
                break;
            }
            self.player.played(start.elapsed());
        }
        drop(keys);
        meter.finish();
        let step = played.unwrap_or(self.player.next());
        self.finish(publishers, step, states, keyframes)
    }

    /// Publishes a step as the simulator did.
    fn publish(&mut self, step: u64, publishers: &mut Publishers) -> Result<Published, Failure> {
        let record = self.log.step_message(step).map_err(log_file::failure)?;
        let is_keyframe = self.scene.time.frame_at(step).is_some();
        let published = Published { state: self.state_is_published(step)?, keyframe: is_keyframe };
        let message = if published.state || is_keyframe { Some(self.state_bytes(step)?) } else { None };
        let time_ns = record.log_time_ns;
        if let Some(bytes) = message.as_ref().filter(|_| published.state && self.has(Choice::State)) {
            publishers.publish_state(time_ns, bytes).map_err(bus_failure)?;
        }
        if self.has(Choice::Step) {
            publishers.publish_step(time_ns, &record.bytes).map_err(bus_failure)?;
        }
        if let Some(bytes) = message.as_ref().filter(|_| is_keyframe && self.has(Choice::Keyframe)) {
            publishers.publish_keyframe(time_ns, bytes).map_err(bus_failure)?;
        }
        Ok(published)
    }

    /// Whether a run publishes the state of a step: where the scene says so, and at the last step, unless the run was
    /// stopped there.
    fn state_is_published(&self, step: u64) -> Result<bool, Failure> {
        let is_last = match self.end.outcome {
            _ if step != self.to_step => false,
            _ if step < self.end.step_count => true,
            RunOutcome::Completed | RunOutcome::Interrupted => true,
            RunOutcome::Stopped(_) | RunOutcome::Recovered(_) => {
                self.log.state_message(step).map_err(log_file::failure)?.is_some()
            }
        };
        Ok(is_last || self.scene.state_is_recorded(step))
    }

    /// The message of a step's state, simulated again if the log does not keep it.
    fn state_bytes(&mut self, step: u64) -> Result<Vec<u8>, Failure> {
        if let Some(message) = self.log.state_message(step).map_err(log_file::failure)? {
            return Ok(message.bytes.into_owned());
        }
        let message = self.states.state(step).map_err(log_file::failure)?;
        let message = message.expect("a state is simulated again, or there is an error");
        let mut bytes = Vec::new();
        state::encode(&message.header, &message.bodies, &message.contacts, &mut bytes);
        Ok(bytes)
    }

    /// Publishes the log's own end, or that of a run that was interrupted where the replay was.
    fn finish(self, publishers: Publishers, step: u64, state_count: u64, keyframe_count: u64) -> Outcome {
        let record = self.log.step(step).map_err(log_file::failure)?;
        let time_ns = log_time_ns(record.sim_time_s);
        if step == self.end.step_count {
            let end = End { state_count, keyframe_count, ..self.end };
            publishers.publish_end(time_ns, &wire::encode(&end)).map_err(bus_failure)?;
            return Ok(Exit::Done);
        }
        let (outcome, chained_hash) = (RunOutcome::Interrupted, record.chained_hash);
        let end = End { outcome, step_count: step, state_count, keyframe_count, chained_hash };
        publishers.publish_end(time_ns, &wire::encode(&end)).map_err(bus_failure)?;
        if stop::requested() {
            return Err(Failure::lost(format!("interrupted after step {step}")));
        }
        Ok(Exit::Done)
    }
}

/// What a step has, besides its record.
struct Published {
    state: bool,
    keyframe: bool,
}

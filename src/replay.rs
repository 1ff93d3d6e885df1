//! `replay`: publishes a log on the topics of a simulator; a subscriber cannot tell the difference.

use crate::failure::{Exit, Failure, Outcome};
use crate::progress::{Meter, Progress};
use crate::{log_file, stop};
use bus::{BusError, BusName};
use clap::Args;
use recorder::{Kind, Log};
use schemas::end::End;
use schemas::scene::Scene;
use schemas::topics::Role;
use schemas::wire;
use sim_node::node::{MessageBytes, Publishers};
use std::path::PathBuf;
use std::time::{Duration, Instant};

#[derive(Args)]
#[command(after_help = "Example, with `chainmail render` and `chainmail record` in two other terminals:\n  \
                        chainmail replay out/drop/log.mcap --bus mine --as-fast-as-possible")]
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
    /// Override a key of render.* in the scene; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// No renderer takes part in the run
    #[arg(long)]
    no_render: bool,
    /// No recorder takes part in the run
    #[arg(long)]
    no_record: bool,
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
    let mut record = log.scene().map_err(log_file::failure)?;
    record.scene = record.scene.with_render(&arguments.set).map_err(Failure::input)?;
    let message = if arguments.set.is_empty() {
        log.nth(Kind::Scene, 0).map_err(log_file::failure)?.bytes.into_owned()
    } else {
        serde_json::to_vec(&record).map_err(Failure::lost)?
    };
    let playback = Playback::new(arguments, &log, &record.scene)?;
    let mut publishers = publishers(arguments, message.len(), &log).map_err(bus_failure)?;
    publishers.handshake().and_then(|()| publishers.publish_scene(&message)).map_err(bus_failure)?;
    playback.play(publishers)
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
    from_step: u64,
    to_step: u64,
    end: End,
    /// Simulated seconds in a second of time; `None` for as fast as possible.
    rate: Option<f64>,
}

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
        let rate = (!arguments.as_fast_as_possible).then_some(arguments.rate);
        Ok(Playback { log, scene, from_step, to_step, end, rate })
    }

    fn play(mut self, mut publishers: Publishers) -> Outcome {
        let mut meter = Meter::for_this_process("replay", "steps");
        let start = Instant::now();
        let (mut states, mut keyframes) = (0, 0);
        for step in self.from_step..=self.to_step {
            let record = self.log.step_message(step).map_err(log_file::failure)?;
            self.wait(start, step);
            if stop::requested() {
                self.to_step = step;
            }
            if let Some(message) = self.log.state_message(step).map_err(log_file::failure)? {
                publishers.publish_state(message.log_time_ns, &message.bytes).map_err(bus_failure)?;
                states += 1;
            }
            publishers.publish_step(record.log_time_ns, &record.bytes).map_err(bus_failure)?;
            if self.scene.time.frame_at(step).is_some() {
                let message = self.log.state_message(step).map_err(log_file::failure)?;
                let missing =
                    || Failure::lost(format!("{}: no state at the frame of step {step}", self.log.file()));
                let message = message.ok_or_else(missing)?;
                publishers.publish_keyframe(message.log_time_ns, &message.bytes).map_err(bus_failure)?;
                keyframes += 1;
            }
            meter.show(Progress { done: step, total: self.to_step });
            if step == self.to_step {
                break;
            }
        }
        meter.finish();
        self.finish(publishers, states, keyframes)
    }

    /// Publishes the log's own end, or that of a run that was interrupted where the replay was.
    fn finish(self, publishers: Publishers, state_count: u64, keyframe_count: u64) -> Outcome {
        let last = self.log.step_message(self.to_step).map_err(log_file::failure)?;
        if self.to_step == self.end.step_count {
            publishers.publish_end(last.log_time_ns, &wire::encode(&self.end)).map_err(bus_failure)?;
            return Ok(Exit::Done);
        }
        let chained_hash = self.log.step(self.to_step).map_err(log_file::failure)?.chained_hash;
        let outcome = schemas::end::Outcome::Interrupted;
        let end = End { outcome, step_count: self.to_step, state_count, keyframe_count, chained_hash };
        publishers.publish_end(last.log_time_ns, &wire::encode(&end)).map_err(bus_failure)?;
        if stop::requested() {
            return Err(Failure::lost(format!("interrupted after step {}", self.to_step)));
        }
        Ok(Exit::Done)
    }

    /// Waits until a step is due.
    fn wait(&self, start: Instant, step: u64) {
        let Some(rate) = self.rate else { return };
        let seconds = (step - self.from_step) as f64 * self.scene.time.time_step_s / rate;
        // Looked at often, so that a signal is.
        while let Ok(due) = Duration::try_from_secs_f64(seconds)
            && let Some(left) = due.checked_sub(start.elapsed())
            && !stop::requested()
        {
            std::thread::park_timeout(if left < Duration::from_millis(50) {
                left
            } else {
                Duration::from_millis(50)
            });
        }
    }
}

//! `resume`: goes on with a run from one of its steps. The new log is the one that an uninterrupted run would have left,
//! byte for byte: up to the step it is copied, and after it simulated.

use crate::failure::{Exit, Failure, Outcome};
use crate::progress::{Meter, Progress};
use crate::resimulate::{Simulation, States};
use crate::supervise::Part;
use crate::{log_file, output, run, stop};
use bus::{BusError, BusName};
use clap::Args;
use recorder::{Kind, Log};
use schemas::end::Outcome as RunOutcome;
use schemas::topics::Role;
use sim_node::node::{MessageBytes, Publishers, Start, simulate};
use sim_node::{Model, Records};
use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Args)]
#[command(
    after_help = "Examples:\n  chainmail resume out/drop/log.mcap --out out/drop-on\n  chainmail resume \
                        out/drop/log.mcap --from-step 100 --out again\n\nThe log may be one that was cut off: what is \
                        whole in it is taken. The step need not be one whose state is in the log."
)]
pub struct Arguments {
    /// The log
    log: PathBuf,
    /// The last step that is taken from the log [default: its last]
    #[arg(long, value_name = "STEP")]
    from_step: Option<u64>,
    /// The folder to write into
    #[arg(long, value_name = "DIR", required_unless_present = "bus")]
    out: Option<PathBuf>,
    /// Replace the run in a folder that exists
    #[arg(long)]
    force: bool,
    /// Threads of the simulator and of the renderer; no result depends on them [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
    /// Only simulate, as the simulator of this bus; the recorder takes the rest with `record --resume`
    #[arg(long, value_name = "NAME", conflicts_with_all = ["out", "force", "json"])]
    bus: Option<BusName>,
    /// No renderer takes part in the run; so it is if the log has no frames
    #[arg(long, requires = "bus")]
    no_render: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    stop::flag();
    let log = log_file::open(&arguments.log)?;
    let from_step = from_step(arguments, &log)?;
    if let Some(bus) = &arguments.bus {
        return publish(arguments, &log, from_step, bus);
    }
    // What cannot be simulated is refused before anything is made.
    log.require_same_version().map_err(log_file::failure)?;
    let scene = log.scene().map_err(log_file::failure)?.scene;
    Model::compile(&scene).map_err(|error| Failure::lost(format!("{}: {error}", log.file())))?;
    if log.has_renderer() && !cfg!(feature = "render") {
        return Err(Failure::input("the log has frames, and this program was built without a renderer"));
    }
    let out = arguments.out.as_deref().expect("clap asks for it");
    let same = |path: &Path| path.canonicalize().ok();
    if same(&arguments.log).is_some_and(|log| Some(log) == same(&out.join("log.mcap"))) {
        return Err(Failure::input(
            "--out names the folder of the log itself; the log would be lost. Name another",
        ));
    }
    let folder = output::make(Some(out), "", arguments.force)?;
    let start = Instant::now();
    let bus = BusName::unique();
    let threads = run::threads_arguments(arguments.threads);
    let log_path = std::path::absolute(&arguments.log)
        .map_err(|error| Failure::input(format!("{}: {error}", arguments.log.display())))?;
    let from: OsString = format!("--from-step={from_step}").into();
    let mut simulator: Vec<OsString> = vec!["resume".into(), log_path.clone().into(), from.clone()];
    simulator.extend(threads.iter().cloned());
    let simulator = Part { name: "simulator", unit: "steps", arguments: simulator, input: None };
    let log_file = folder.join("log.mcap");
    let mut parts = run::parts(&bus, simulator, &log_file, &threads, !log.has_renderer());
    if let Some(recorder) = parts.iter_mut().find(|part| part.name == "recorder") {
        let mut resume = OsString::from("--resume=");
        resume.push(&log_path);
        recorder.arguments.extend([resume, from]);
    }
    run::finish(&folder, run::supervise_on(&bus, parts), start, arguments.json)
}

/// The step to go on from.
fn from_step(arguments: &Arguments, log: &Log) -> Result<u64, Failure> {
    let steps = log.count(Kind::Step) as u64;
    let Some(last) = steps.checked_sub(1) else {
        return Err(Failure::lost(format!("{}: no step of it is whole", log.file())));
    };
    let step = arguments.from_step.unwrap_or(last);
    if step > last {
        return Err(Failure::input(format!(
            "--from-step {step}: expected 0 to {last}, the steps of {}",
            log.file()
        )));
    }
    if let Some(RunOutcome::Stopped(reason)) = log.end().map_err(log_file::failure)?.map(|end| end.outcome)
        && step == last
    {
        return Err(Failure::input(format!(
            "{}: its run was stopped at step {last} and cannot go on from there ({reason})",
            log.file()
        )));
    }
    Ok(step)
}

/// The simulator's part: what the log has up to the step is not published again, but for the keyframes whose frames it
/// has not.
fn publish(arguments: &Arguments, log: &Log, from_step: u64, bus: &BusName) -> Outcome {
    let threads = arguments.threads.unwrap_or_else(crate::default_threads).get();
    let scene = log.scene().map_err(log_file::failure)?.scene;
    let message = log.nth(Kind::Scene, 0).map_err(log_file::failure)?;
    let mut meter = Meter::for_this_process("simulator", "steps");
    let Simulation { model, state, .. } = States::new(log, threads).simulation_at(from_step)?;
    let mut records = Records::after(schemas::Hash::default());
    for step in 0..=from_step {
        records.follow(&log.step(step).map_err(log_file::failure)?);
    }
    let start = Start::after(&model, &scene, state, records);
    let state_bytes = log.nth(Kind::State, 0).map_or(1, |message| message.bytes.len());
    let bytes = MessageBytes { scene: message.bytes.len(), state: state_bytes };
    let roles = if arguments.no_render { &[Role::Recorder][..] } else { &[Role::Renderer, Role::Recorder] };
    let stop = stop::flag();
    let mut publishers = Publishers::open(bus, roles, bytes, stop.clone()).map_err(bus_failure)?;
    publishers.handshake().and_then(|()| publishers.publish_scene(&message.bytes)).map_err(bus_failure)?;
    if !arguments.no_render {
        let frames = recorder::resume::frames_kept(log, &scene, from_step) as usize;
        let keyframes = (0..=from_step).filter(|&step| scene.time.frame_at(step).is_some()).skip(frames);
        for step in keyframes {
            let kept = log.state_message(step).map_err(log_file::failure)?;
            let kept = kept.ok_or_else(|| {
                Failure::lost(format!("{}: no state at the frame of step {step}", log.file()))
            })?;
            publishers.publish_keyframe(kept.log_time_ns, &kept.bytes).map_err(bus_failure)?;
        }
    }
    let mut show = |progress: sim_node::node::Progress| {
        meter.show(Progress { done: progress.steps, total: progress.step_count });
    };
    let end = simulate(&model, &scene, start, threads, publishers, &stop, &mut show).map_err(bus_failure)?;
    match end.outcome {
        RunOutcome::Completed => Ok(Exit::Done),
        RunOutcome::Stopped(reason) => Err(Failure { exit: Exit::Differs, message: reason }),
        _ => Err(Failure::lost(format!("interrupted after step {}", end.step_count))),
    }
}

fn bus_failure(error: BusError) -> Failure {
    Failure { exit: Exit::from_code(error.exit_code()), message: error.to_string() }
}

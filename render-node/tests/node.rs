//! The renderer on a bus, with a simulator and a recorder that play their parts in threads of this test.

use bus::{Bus, BusError, BusName, Message, Publisher, Received, Subscriber};
use prost::Message as _;
use render_node::node::{NodeError, RenderOptions, RenderProgress, run};
use render_node::{RenderModel, png_bytes, render};
use schemas::frame::{CompressedImage, FrameInfo};
use schemas::log_time_ns;
use schemas::plan::Plan;
use schemas::scene::{Scene, SceneRecord};
use schemas::state::{self, BodyState, StateHeader};
use schemas::topics::{FRAME, FRAME_INFO, KEYFRAME, Role, SCENE};
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const FRAMES: u64 = 6;

fn scene() -> Scene {
    let text = "
        seed = 3
        time = { duration_s = 0.5, time_step_s = 0.01, frames_per_second = 12.0 }
        material.steel = {}
        ring = [{ major_radius_m = 1.0, minor_radius_m = 0.2, mass_kg = 1.0, material = 'steel', position_m = [0, 0, 0] }]
        render = { width_px = 40, height_px = 24, samples_per_pixel = 2 }
    ";
    Scene::parse(text, &[]).expect("the scene is valid")
}

fn bodies(frame: u64) -> [BodyState; 1] {
    let position_m = [0.0, -0.1 * frame as f64, 0.0];
    [BodyState { position_m, orientation: [0.6, 0.0, 0.0, 0.8], ..Default::default() }]
}

/// How a simulator leaves.
#[derive(Clone, Copy, PartialEq)]
enum End {
    /// It ends its streams.
    InOrder,
    /// It breaks off after this many keyframes.
    After(u64),
}

/// Publishes the scene and its keyframes.
fn simulate(name: &BusName, scene: &Scene, end: End) -> Result<(), BusError> {
    let bus = Bus::join(name, Role::Simulator, Arc::default())?;
    // The recorder of these tests does not take the scene.
    let mut scenes = Publisher::open(&bus, &SCENE, &[Role::Renderer], 4096)?;
    let mut keyframes = Publisher::open(&bus, &KEYFRAME, &[Role::Renderer], 4096)?;
    bus.handshake(&mut [&mut scenes, &mut keyframes], &mut [])?;
    let record = SceneRecord::new(scene.clone(), Plan::default());
    scenes.send(0, &serde_json::to_vec(&record).expect("a record is JSON"))?;
    let mut message = Vec::new();
    for frame in 0..FRAMES {
        if end == End::After(frame) {
            return Ok(());
        }
        let step = scene.time.frame_step(frame);
        let sim_time_s = step as f64 * scene.time.time_step_s;
        let header = StateHeader { step, sim_time_s, ..Default::default() };
        state::encode(&header, &bodies(frame), &[], &mut message);
        keyframes.send(log_time_ns(sim_time_s), &message)?;
    }
    scenes.finish()?;
    keyframes.finish()?;
    Ok(())
}

/// Receives everything that the renderer sends.
fn record(name: &BusName) -> Result<[Vec<Message>; 2], BusError> {
    let bus = Bus::join(name, Role::Recorder, Arc::default())?;
    let mut topics = [Subscriber::open(&bus, &FRAME)?, Subscriber::open(&bus, &FRAME_INFO)?];
    let [frames, infos] = &mut topics;
    bus.handshake(&mut [], &mut [frames, infos])?;
    let mut messages = [Vec::new(), Vec::new()];
    let mut ended = [false; 2];
    while ended != [true; 2] {
        for (index, topic) in topics.iter_mut().enumerate() {
            match topic.receive()? {
                Received::Message(message) => messages[index].push(message),
                Received::End { count } => {
                    assert_eq!(count, messages[index].len() as u64);
                    ended[index] = true;
                }
                Received::Nothing => {}
            }
        }
        bus.wait(Duration::from_millis(20))?;
    }
    Ok(messages)
}

struct Outcome {
    renderer: Result<RenderProgress, NodeError>,
    simulator: Result<(), BusError>,
    frames: Vec<Message>,
    infos: Vec<Message>,
}

/// Runs the three parts; the renderer is asked to stop after a frame, if one is given.
fn run_all(scene: &Scene, overrides: &[&str], end: End, stop_after: Option<u64>) -> Outcome {
    let name = BusName::unique();
    let options = RenderOptions {
        bus: name.clone(),
        threads: NonZeroUsize::new(2),
        overrides: overrides.iter().map(|text| (*text).to_owned()).collect(),
    };
    std::thread::scope(|scope| {
        let simulator = scope.spawn(|| simulate(&name, scene, end));
        let recorder = scope.spawn(|| record(&name));
        let stop = Arc::new(AtomicBool::new(false));
        let renderer = run(&options, &stop, &mut |done| {
            assert_eq!(done.frame_count, FRAMES);
            if stop_after == Some(done.frames_done) {
                stop.store(true, Ordering::Relaxed);
            }
        });
        let simulator = simulator.join().expect("the simulator does not panic");
        let [frames, infos] = recorder.join().expect("the recorder does not panic").expect("its streams end");
        Outcome { renderer, simulator, frames, infos }
    })
}

#[test]
fn every_keyframe_becomes_the_frame_that_the_library_renders() {
    let scene = scene();
    let outcome = run_all(&scene, &["render.samples_per_pixel=3"], End::InOrder, None);
    outcome.simulator.expect("the simulator loses nobody");
    let done = outcome.renderer.expect("the renderer loses nobody");
    assert_eq!((done.frames_done, done.non_finite_samples, done.stopped), (FRAMES, 0, false));
    assert_eq!((outcome.frames.len() as u64, outcome.infos.len() as u64), (FRAMES, FRAMES));
    let scene = scene.with_render(&["render.samples_per_pixel=3".to_owned()]).expect("a key of render");
    let (model, plan) = RenderModel::compile(&scene);
    for (frame, (image, info)) in (0..).zip(outcome.frames.iter().zip(&outcome.infos)) {
        let film = render(&model, &bodies(frame), frame, scene.seed, NonZeroUsize::MIN).expect("a state");
        let step = scene.time.frame_step(frame);
        let time_ns = log_time_ns(step as f64 * scene.time.time_step_s);
        assert_eq!((image.log_time_ns, info.log_time_ns), (time_ns, time_ns));
        let image = CompressedImage::decode(&image.bytes[..]).expect("a picture");
        let png = png_bytes(&film, &scene.render).expect("a film is encoded");
        assert_eq!(image, CompressedImage::png(time_ns, png));
        let info: FrameInfo = serde_json::from_slice(&info.bytes).expect("a frame's record");
        assert_eq!((info.frame, info.step, info.film_hash), (frame, step, film.hash()));
        assert_eq!((info.rays, info.render, info.plan), (film.rays, scene.render.clone(), plan.clone()));
    }
}

#[test]
fn a_lost_simulator_is_exit_code_3_and_the_streams_end() {
    let mut scene = scene();
    // A frame of minutes: what ends it is the loss.
    scene.render.samples_per_pixel = 2_000_000;
    let outcome = run_all(&scene, &[], End::After(2), None);
    outcome.simulator.expect("the simulator leaves of its own will");
    let error = outcome.renderer.expect_err("the simulator was lost");
    println!("{error}");
    assert!(matches!(error, NodeError::Bus(BusError::PeerLost { role: Role::Simulator, .. })), "{error}");
    assert_eq!(error.exit_code(), 3);
    assert!(outcome.frames.is_empty() && outcome.infos.is_empty());
}

#[test]
fn a_stop_ends_the_streams_after_the_frame_in_progress() {
    let outcome = run_all(&scene(), &[], End::InOrder, Some(2));
    let done = outcome.renderer.expect("a stop is no error");
    assert_eq!((done.frames_done, done.stopped), (2, true));
    assert_eq!((outcome.frames.len(), outcome.infos.len()), (2, 2));
    outcome.simulator.expect("its keyframes are taken");
}

#[test]
fn an_override_of_the_motion_is_exit_code_2() {
    let outcome = run_all(&scene(), &["time.duration_s=1"], End::InOrder, None);
    let error = outcome.renderer.expect_err("the motion cannot be changed");
    println!("{error}");
    assert!(matches!(error, NodeError::Override(_)), "{error}");
    assert_eq!(error.exit_code(), 2);
    assert!(outcome.frames.is_empty());
}

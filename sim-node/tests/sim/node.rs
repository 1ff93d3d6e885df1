//! The simulator as a process, with this test in the recorder's place.

use bus::{Bus, BusName, Received, Subscriber};
use schemas::end::{End, Outcome};
use schemas::scene::SceneRecord;
use schemas::step::StepRecord;
use schemas::topics::{self, Role};
use schemas::{Hash, chain, state, wire};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name)
}

fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_sim-node"))
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Everything that came, in the order of each topic.
#[derive(Default)]
struct Heard {
    scenes: Vec<Vec<u8>>,
    states: Vec<Vec<u8>>,
    steps: Vec<Vec<u8>>,
    ends: Vec<Vec<u8>>,
}

/// Plays the recorder until all topics have ended. `at_step` is called after each step record.
fn listen(name: &BusName, mut at_step: impl FnMut(usize)) -> Heard {
    let bus = Bus::join(name, Role::Recorder, Arc::new(AtomicBool::new(false))).unwrap();
    let mut subscribers = [&topics::SCENE, &topics::STATE, &topics::STEP, &topics::END]
        .map(|topic| Subscriber::open(&bus, topic).unwrap());
    let mut ports: Vec<&mut Subscriber> = subscribers.iter_mut().collect();
    bus.handshake(&mut [], &mut ports).unwrap();
    let mut heard = Heard::default();
    let mut ended = [false; 4];
    // Far beyond what the run takes; a test must not hang.
    let limit = Instant::now() + Duration::from_secs(120);
    while !ended.iter().all(|&ended| ended) {
        assert!(Instant::now() < limit, "the simulator went silent");
        let mut idle = true;
        for (index, subscriber) in subscribers.iter_mut().enumerate() {
            match subscriber.receive().unwrap() {
                Received::Nothing => continue,
                Received::End { .. } => {
                    ended[index] = true;
                    continue;
                }
                Received::Message(message) => {
                    let list = match index {
                        0 => &mut heard.scenes,
                        1 => &mut heard.states,
                        2 => &mut heard.steps,
                        _ => &mut heard.ends,
                    };
                    list.push(message.bytes);
                    if index == 2 {
                        at_step(heard.steps.len());
                    }
                }
            }
            idle = false;
        }
        if idle {
            bus.wait(Duration::from_millis(50)).unwrap();
        }
    }
    heard
}

#[test]
fn a_run_is_published_whole() {
    let name = BusName::unique();
    let path = scene("two-rings.toml");
    let mut child = start(&[
        path.to_str().unwrap(),
        "--bus",
        name.as_str(),
        "--no-render",
        "--set",
        "record.state_every=7",
        "--seed",
        "5",
    ]);
    let heard = listen(&name, |_| {});
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!((heard.scenes.len(), heard.ends.len()), (1, 1));
    let record: SceneRecord = serde_json::from_slice(&heard.scenes[0]).unwrap();
    assert_eq!(record.scene.seed, 5);
    let end: End = wire::decode(&heard.ends[0]).unwrap();
    assert_eq!(end.outcome, Outcome::Completed);
    assert_eq!((end.step_count, end.keyframe_count), (1000, 12));
    let recorded = (0..=1000).filter(|&step| record.scene.state_is_recorded(step)).count();
    // Every seventh from 0 to 994, the last, and the frames' between them.
    assert!(recorded > 144 && recorded <= 144 + 12, "{recorded}");
    assert_eq!((heard.states.len(), end.state_count), (recorded, recorded as u64));
    assert_eq!(heard.steps.len(), 1001);
    let mut chained = Hash::default();
    for (step, message) in heard.steps.iter().enumerate() {
        let record: StepRecord = serde_json::from_slice(message).unwrap();
        assert_eq!(record.step, step as u64);
        chained = chain(&chained, &record.state_hash);
        assert_eq!(record.chained_hash, chained);
    }
    assert_eq!(end.chained_hash, chained);
    let last = state::decode(heard.states.last().unwrap()).unwrap();
    assert_eq!(last.header.step, 1000);
}

#[test]
fn a_signal_ends_the_run_in_good_order() {
    let name = BusName::unique();
    let path = scene("two-rings.toml");
    let mut child = start(&[
        path.to_str().unwrap(),
        "--bus",
        name.as_str(),
        "--no-render",
        "--set",
        "time.duration_s=10000",
        "--set",
        "record.state_every=1000",
    ]);
    let process = child.id().to_string();
    let heard = listen(&name, |steps| {
        if steps == 100 {
            assert!(Command::new("kill").args(["-TERM", &process]).status().unwrap().success());
        }
    });
    assert_eq!(child.wait().unwrap().code(), Some(3));
    let end: End = wire::decode(&heard.ends[0]).unwrap();
    assert_eq!(end.outcome, Outcome::Interrupted);
    assert_eq!(end.step_count + 1, heard.steps.len() as u64);
    let last = state::decode(heard.states.last().unwrap()).unwrap();
    assert_eq!(last.header.step, end.step_count, "the last state is there");
}

#[test]
fn bad_input_is_told_with_exit_code_2() {
    let path = scene("two-rings.toml");
    let cases = [
        (vec!["nowhere.toml"], "nowhere.toml"),
        (
            vec![path.to_str().unwrap(), "--set", "time.time_step_s=1", "--set", "time.frames_per_second=1"],
            "contacts of ring",
        ),
        (vec![path.to_str().unwrap(), "--set", "ring.1.position_m=[0.0, -0.35, 0.3]"], "overlap"),
        (vec![path.to_str().unwrap(), "--set", "time.duration=1"], "did you mean"),
    ];
    for (mut arguments, expected) in cases {
        let name = BusName::unique();
        arguments.extend(["--bus", name.as_str()]);
        let output = start(&arguments).wait_with_output().unwrap();
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(expected), "{told}");
    }
}

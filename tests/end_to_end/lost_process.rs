//! kill -9 of each process: nobody hangs, the log is whole up to what was flushed, the message names the loss.

use crate::command::{self, Background, Place, message_counts, signal};
use std::time::Instant;

/// A run long enough to be interrupted at its first tenth: 240 frames.
fn long_run(place: &Place) -> Background {
    let set =
        ["--set", "time.duration_s=4", "--set", "render.samples_per_pixel=16", "--set", "render.width_px=64"];
    Background::start(place.command(&[&["run", "tiny.toml", "--out", "run"][..], &set].concat()))
}

fn kill_and_check(verb: &str, name: &str) {
    let place = Place::new();
    let mut run = long_run(&place);
    run.wait_for("renderer (frames)");
    let part = run.part(verb);
    let start = Instant::now();
    signal(part, "KILL");
    let code = run.finish();
    let elapsed = start.elapsed();
    println!(
        "{name} killed: the run ended after {elapsed:.2?} (2 s expected; 20 s allowed on a loaded machine)"
    );
    assert_eq!(code, Some(3), "{}", run.seen);
    assert!(run.seen.contains(&format!("the {name} was lost")), "{}", run.seen);
    assert!(elapsed.as_secs() < 20, "the run hung for {elapsed:?}");
    if verb != "record" {
        // Whoever else died: the recorder finished the log with what it had.
        let counts = message_counts(&place.path("run/log.mcap"));
        assert!(counts["/state"] > 100 && counts["/frame"] >= 1, "{counts:?}");
    }
    let info = place.run(&["info", "run/log.mcap"]);
    let text = String::from_utf8_lossy(&info.stdout).into_owned();
    assert!(text.contains("steps"), "{text}");
    // When the renderer dies, the simulator may come to its end in good order: then only frames are missing.
    let only_frames = verb == "render" && text.contains(" missing\n") && text.contains("interrupted");
    assert_eq!(info.status.code(), Some(if only_frames { 0 } else { 3 }), "{text}");
    // The next run on the same folder starts as if nothing had happened.
    place.expect(0, &["run", "tiny.toml", "--out", "run", "--force"]);
}

#[test]
fn killed_simulator() {
    kill_and_check("sim", "simulator");
}

#[test]
fn killed_renderer() {
    kill_and_check("render", "renderer");
}

#[test]
fn killed_recorder() {
    kill_and_check("record", "recorder");
}

#[test]
fn interrupt_finishes_the_log() {
    let place = Place::new();
    let mut run = long_run(&place);
    run.wait_for("renderer (frames)");
    signal(run.child.id(), "TERM");
    let code = run.finish();
    assert_eq!(code, Some(3), "{}", run.seen);
    assert!(run.seen.contains("interrupted"), "{}", run.seen);
    let log = place.path("run/log.mcap");
    let (counts, end) = (message_counts(&log), command::end_of(&log));
    assert_eq!(counts["/step"], end.step_count + 1);
    assert_eq!(end.outcome, schemas::end::Outcome::Interrupted);
    place.expect(0, &["verify", "run/log.mcap"]);
    // It is a whole log of a short run: it can be rendered again.
    place.expect(0, &["rerender", "run/log.mcap", "--out", "again", "--set", "render.samples_per_pixel=1"]);
    assert_eq!(message_counts(&place.path("again/log.mcap"))["/frame"], end.keyframe_count);
}

#[test]
fn a_stopped_process_loses_nothing() {
    let place = Place::new();
    let mut run =
        Background::start(place.command(&["run", "tiny.toml", "--out", "run", "--set", "time.duration_s=1"]));
    run.wait_for("renderer (frames)");
    let recorder = run.part("record");
    signal(recorder, "STOP");
    // Whether the simulator fills its queue meanwhile or not, nothing may be lost.
    signal(recorder, "CONT");
    assert_eq!(run.finish(), Some(0), "{}", run.seen);
    let log = place.path("run/log.mcap");
    assert_eq!(message_counts(&log)["/state"], command::end_of(&log).state_count);
}

//! `replay` on a terminal: keys, ranges, loops. The terminal is that of util-linux's `script`.

use crate::command::Place;
use bus::BusName;
use std::io::{Read, Write};
use std::process::{Command, Stdio};

/// Runs a shell line on a terminal of its own, presses keys one after the other, each when the text before it has been
/// shown, and returns all that was shown.
fn on_a_terminal(place: &Place, line: &str, keys: &[(&str, &str)]) -> String {
    let mut script = Command::new("script")
        .args(["-qefc", line, "/dev/null"])
        .current_dir(place.path("."))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("util-linux's script");
    let (mut input, mut output) =
        (script.stdin.take().expect("a pipe"), script.stdout.take().expect("a pipe"));
    let (mut shown, mut seen) = (String::new(), 0);
    let mut bytes = [0; 1024];
    let mut keys = keys.iter();
    let mut next = keys.next();
    loop {
        while let Some((text, key)) = next
            && let Some(at) = shown[seen..].find(text)
        {
            seen += at + text.len();
            input.write_all(key.as_bytes()).expect("a terminal");
            next = keys.next();
        }
        match output.read(&mut bytes) {
            Ok(0) | Err(_) => break,
            Ok(count) => shown += &String::from_utf8_lossy(&bytes[..count]),
        }
    }
    assert!(next.is_none(), "{next:?} was never shown:\n{shown}");
    script.wait().expect("it was started");
    shown
}

#[test]
fn keys_pause_step_seek_and_loop() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run", "--no-render"]);
    let (program, bus) = (env!("CARGO_BIN_EXE_chainmail"), BusName::unique());
    let replay = format!("{program} replay run/log.mcap --bus {bus} --no-render --no-record");
    // 60 steps of a millisecond: a second on is the end, whatever the clock says.
    let shown = on_a_terminal(
        &place,
        &format!("{replay} --paused --from-step 10; echo \"exit $?\"; stty -a"),
        &[
            ("q quit", "."),
            ("resting at step 10 of 60", "."),
            ("resting at step 11 of 60", "\x1b[C"),
            ("resting at step 60 of 60", "\x1b[H"),
            ("resting at step 10 of 60", "l"),
            ("in a loop", "-"),
            ("0.5 times as fast", "f"),
            ("as fast as possible", " "),
            ("playing at step 10 of 60", "q"),
        ],
    );
    assert!(shown.contains("exit 0"), "{shown}");
    // The terminal is as it was.
    assert!(shown.contains(" icanon") && shown.contains(" echo "), "{shown}");
    // With a recorder there is no seeking; to its end it goes by itself.
    let recorder = place
        .command(&["record", "--bus", bus.as_str(), "--no-render", "--out", "again.mcap"])
        .stderr(Stdio::null())
        .spawn();
    let shown = on_a_terminal(
        &place,
        &format!("{program} replay run/log.mcap --bus {bus} --no-render --paused; echo \"exit $?\""),
        &[("q quit", "\x1b[C"), ("add --no-record", ".f"), ("as fast as possible", " ")],
    );
    assert!(shown.contains("exit 0"), "{shown}");
    assert!(recorder.expect("a recorder").wait().expect("it was started").success());
    assert!(place.bytes("again.mcap") == place.bytes("run/log.mcap"), "the log differs");
}

#[test]
fn a_part_and_a_choice_of_topics_are_for_other_listeners() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run", "--no-render"]);
    let bus = BusName::unique();
    let replay = ["replay", "run/log.mcap", "--bus", bus.as_str(), "--no-render", "--as-fast-as-possible"];
    for part in [&["--topics", "state,step"][..], &["--repeat"], &["--from-step", "3"]] {
        let text = place.expect(2, &[&replay[..], part].concat());
        assert!(text.contains("--no-record"), "{text}");
    }
    place.expect(0, &[&replay[..], &["--no-record", "--topics", "state", "--to-step", "30"]].concat());
}

//! A disk that is full, a quota, a folder that cannot be written: a clean stop and a message that says what is safe.

use crate::command::Place;
use std::process::{Command, Stdio};

/// Simulator and recorder by hand, with a recorder that is started in its own way; returns what each exited with and
/// said.
fn simulate_and_record(place: &Place, recorder: Command, bus: &str) -> [(Option<i32>, String); 2] {
    let start = |mut command: Command| {
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the command starts")
    };
    let recorder = start(recorder);
    let set = ["--set", "time.duration_s=2"];
    let simulator = place.command(&[&["sim", "tiny.toml", "--bus", bus, "--no-render"][..], &set].concat());
    [start(simulator), recorder].map(|child| {
        let output = child.wait_with_output().expect("it was started");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!text.contains("panicked"), "{text}");
        (output.status.code(), text)
    })
}

#[test]
fn a_full_disk_stops_the_run_and_says_what_is_safe() {
    let place = Place::new();
    let bus = format!("full-{}", std::process::id());
    let recorder = place.command(&["record", "--bus", &bus, "--out", "/dev/full", "--force", "--no-render"]);
    let [(sim_code, sim), (code, said)] = simulate_and_record(&place, recorder, &bus);
    assert_eq!(code, Some(3), "{said}");
    for word in ["/dev/full", "No space left", "0 step records", "safe"] {
        assert!(said.contains(word), "'{word}' is not in: {said}");
    }
    assert_eq!(sim_code, Some(3), "{sim}");
    assert!(sim.contains("the recorder was lost"), "{sim}");
}

#[test]
fn a_quota_keeps_what_was_written_before_it() {
    let place = Place::new();
    let bus = format!("quota-{}", std::process::id());
    // So many blocks of 512 or 1024 bytes, as the shell counts.
    let mut recorder = Command::new("sh");
    recorder.args(["-c", "ulimit -f 300; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_chainmail")]);
    recorder.args(["record", "--bus", &bus, "--no-render", "--out"]).arg(place.path("log.mcap"));
    let [(sim_code, sim), (code, said)] = simulate_and_record(&place, recorder, &bus);
    assert_eq!((sim_code, code), (Some(3), Some(3)), "{sim}\n{said}");
    for word in ["log.mcap", "File too large", "safe", "chainmail recover"] {
        assert!(said.contains(word), "'{word}' is not in: {said}");
    }
    // The number of step records that it names can be read back.
    let words: Vec<&str> = said.split_whitespace().collect();
    let at = words.windows(2).position(|pair| pair == ["step", "records,"]).expect("a count");
    let safe: u64 = words[at - 1].parse().expect("a number");
    let json = place.run(&["recover", "log.mcap", "--out", "fixed.mcap", "--json"]);
    assert_eq!(json.status.code(), Some(3));
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    assert!(safe > 20 && json["counts"]["step_records"].as_u64() >= Some(safe), "{safe}: {json}");
    place.expect(0, &["verify", "fixed.mcap"]);
}

#[test]
fn a_place_that_cannot_be_written_is_refused_before_anything_starts() {
    let place = Place::new();
    // Nobody can make a folder there, whoever runs this.
    for arguments in [
        &["run", "tiny.toml", "--out", "/proc/none"][..],
        &["record", "--bus", "unwritable", "--out", "/proc/none.mcap"],
        &["run", "tiny.toml", "--out", "tiny.toml/none"],
    ] {
        let text = place.expect(2, arguments);
        assert!(text.contains("none") && text.contains("cannot"), "{arguments:?}: {text}");
    }
}

//! States that a log does not keep (`record.state_every`): every verb has them all the same, bit for bit.

use crate::command::Place;
use bus::BusName;
use std::process::Stdio;

const FEW: [&str; 3] = ["--set", "record.state_every=25", "--no-render"];
const GRAVITY: [&str; 2] = ["--set", "forces.gravity_m_per_s2=[0.0,-200.0,0.0]"];

/// Runs the tiny scene with all states kept (`all`) and with every 25th (`few`).
fn runs(place: &Place) {
    place.expect(0, &[&["run", "tiny.toml", "--out", "all", "--no-render"][..], &GRAVITY].concat());
    place.expect(0, &[&["run", "tiny.toml", "--out", "few"][..], &FEW, &GRAVITY].concat());
    assert!(place.bytes("few/log.mcap").len() < place.bytes("all/log.mcap").len());
}

#[test]
fn tables_and_viewers_get_every_state() {
    let place = Place::new();
    runs(&place);
    for log in ["all", "few"] {
        let file = format!("{log}/log.mcap");
        for (format, out) in [("csv", format!("{log}-tables")), ("viewer", format!("{log}.viewer"))] {
            let export = ["export", &file, "--format", format, "--out", &out, "--states", "all"];
            place.expect(0, &export);
        }
    }
    for table in ["steps.csv", "bodies.csv", "contacts.csv"] {
        let [all, few] = ["all", "few"].map(|log| place.bytes(&format!("{log}-tables/{table}")));
        assert!(all == few && all.len() > 1000, "{table} differs");
    }
    assert!(place.bytes("all.viewer") == place.bytes("few.viewer"));
    // Those that the log keeps, and no others, unless they are asked for.
    place.expect(0, &["export", "few/log.mcap", "--format", "csv", "--out", "kept"]);
    let lines = String::from_utf8(place.bytes("kept/bodies.csv")).expect("text").lines().count();
    assert_eq!(lines, 1 + 6 * 2);
}

/// Replays a log onto a bus and records it again.
fn recorded_again(place: &Place, log: &str, state_every: &str, out: &str) {
    let bus = BusName::unique().to_string();
    let mut recorder = place
        .command(&["record", "--bus", &bus, "--no-render", "--out", out])
        .stderr(Stdio::null())
        .spawn()
        .expect("a recorder");
    let set = format!("record.state_every={state_every}");
    place.expect(
        0,
        &[
            "replay",
            log,
            "--bus",
            &bus,
            "--as-fast-as-possible",
            "--no-render",
            "--set",
            &set,
            "--threads",
            "2",
        ],
    );
    assert!(recorder.wait().expect("it was started").success());
}

#[test]
fn a_replay_publishes_what_a_live_run_would_have() {
    let place = Place::new();
    runs(&place);
    // The recorder cannot tell a replay from a live run with the same keys.
    recorded_again(&place, "few/log.mcap", "1", "more.mcap");
    assert!(place.bytes("more.mcap") == place.bytes("all/log.mcap"), "with all states the log differs");
    recorded_again(&place, "all/log.mcap", "25", "less.mcap");
    assert!(place.bytes("less.mcap") == place.bytes("few/log.mcap"), "with few states the log differs");
    let bus = BusName::unique().to_string();
    let replay = ["replay", "few/log.mcap", "--bus", &bus, "--set", "record.reactions=true"];
    assert!(place.expect(2, &replay).contains("record.state_every"));
}

#[test]
fn two_logs_are_compared_at_the_step_where_they_part() {
    let place = Place::new();
    runs(&place);
    let drag = ["--set", "forces.linear_drag_kg_per_s=1e-9"];
    place.expect(0, &[&["run", "tiny.toml", "--out", "b"][..], &FEW, &GRAVITY, &drag].concat());
    let text = place.expect(1, &["diff", "few/log.mcap", "b/log.mcap"]);
    for word in [
        "first    step 1,",
        "of step 1, simulated again: neither log keeps it",
        "ring 1",
        "growth   step 3, 2 later",
    ] {
        assert!(text.contains(word), "nothing of '{word}':\n{text}");
    }
    // The same as with all states, but for what each log keeps.
    place.expect(0, &[&["run", "tiny.toml", "--out", "c", "--no-render"][..], &GRAVITY, &drag].concat());
    let whole = place.expect(1, &["diff", "all/log.mcap", "c/log.mcap"]);
    let told = |text: &str| {
        let lines = text
            .lines()
            .filter(|line| ["field", "growth", "in all"].iter().any(|word| line.starts_with(word)));
        lines.map(str::to_owned).collect::<Vec<_>>()
    };
    assert!(told(&text).len() > 6);
    assert_eq!(told(&text), told(&whole));
    let text = place.expect(1, &["diff", "few/log.mcap", "b/log.mcap", "--no-remake"]);
    assert!(text.contains("of step 17: the first that is to be had of both logs"), "{text}");
}

//! Bad input: a clear message, the right exit code, nothing of the user's lost, never a panic.

use crate::command::{self, Place};

#[test]
fn scenes_that_cannot_be_used() {
    let place = Place::new();
    let file = |name: &str, text: &str| std::fs::write(place.path(name), text).expect("a file");
    file("broken.toml", "[time\n");
    file("misspelt.toml", &format!("{}\n[recrod]\nstate_every = 2\n", command::TINY));
    for (arguments, words) in [
        (&["run", "missing.toml"][..], &["missing.toml", "No such file"][..]),
        (&["run", "broken.toml"], &["broken.toml", "line 1"]),
        (&["run", "misspelt.toml"], &["misspelt.toml", "recrod", "did you mean \"record\"?"]),
        (&["run", "tiny.toml", "--set", "time.time_step_s=-1"], &["time.time_step_s", "-1", "positive"]),
        (&["run", "tiny.toml", "--set", "time.time_step_s=nan"], &["time.time_step_s", "NaN"]),
        (
            &["run", "tiny.toml", "--set", "time.time_step_s=0.5", "--set", "time.frames_per_second=1"],
            &["time.time_step_s", "5e-1", "at most", "contacts of ring 1"],
        ),
        (
            &["run", "tiny.toml", "--set", "weave.0.minor_radius_m=0.3"],
            &["weave[0].minor_radius_m", "0.3", "less than 0.125"],
        ),
        (
            &[
                "run",
                "tiny.toml",
                "--set",
                "sphere=[{radius_m=0.4,mass_kg=1,material=\"steel\",position_m=[0.0,0.0,0.0]}]",
            ],
            &["ring 0", "sphere 0", "gap"],
        ),
        (&["run", "tiny.toml", "--set", "nonsense"], &["--set nonsense", "key.path=value"]),
        (&["sim", "tiny.toml", "--bus", "no spaces"], &["no spaces"]),
        (&["plan", "missing.toml"], &["missing.toml"]),
    ] {
        let text = place.expect(2, arguments);
        for word in words {
            assert!(text.contains(word), "{arguments:?} says nothing of {word}:\n{text}");
        }
    }
    assert!(!place.path("out").exists(), "a refused scene leaves no folder behind");
}

#[test]
fn output_that_exists_is_kept_without_force() {
    let place = Place::new();
    std::fs::create_dir(place.path("mine")).expect("a folder");
    std::fs::write(place.path("mine/notes.txt"), "keep").expect("a file");
    let text = place.expect(2, &["run", "tiny.toml", "--out", "mine", "--no-render"]);
    assert!(text.contains("mine") && text.contains("--force"), "{text}");
    place.expect(0, &["run", "tiny.toml", "--out", "mine", "--no-render", "--force"]);
    place.expect(0, &["run", "tiny.toml", "--out", "mine", "--no-render", "--force"]);
    assert_eq!(place.bytes("mine/notes.txt"), b"keep");
    // Without --out a new folder is made each time.
    place.expect(0, &["run", "tiny.toml", "--no-render"]);
    place.expect(0, &["run", "tiny.toml", "--no-render"]);
    assert!(place.path("out/tiny/log.mcap").exists() && place.path("out/tiny-2/log.mcap").exists());
}

#[test]
fn logs_that_cannot_be_used() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run", "--no-render"]);
    let log = place.bytes("run/log.mcap");
    std::fs::write(place.path("cut.mcap"), &log[..log.len() / 2]).expect("a file");
    std::fs::write(place.path("text.mcap"), "this is not a log at all, only some words").expect("a file");
    std::fs::write(place.path("empty.mcap"), "").expect("a file");
    let mut flipped = log.clone();
    flipped[log.len() / 2] ^= 16;
    std::fs::write(place.path("flipped.mcap"), flipped).expect("a file");
    for verb in ["verify", "info"] {
        for (name, word) in [("cut.mcap", "offset"), ("flipped.mcap", "offset")] {
            let text = place.expect(3, &[verb, name]);
            assert!(text.contains(name) && text.contains(word), "{verb} {name}:\n{text}");
        }
        for name in ["text.mcap", "empty.mcap", "missing.mcap"] {
            let text = place.expect(2, &[verb, name]);
            assert!(text.contains(name), "{verb} {name}:\n{text}");
        }
    }
    place.expect(3, &["diff", "run/log.mcap", "cut.mcap"]);
    place.expect(2, &["diff", "run/log.mcap", "text.mcap"]);
}

#[test]
fn every_verb_has_help_with_an_example() {
    let place = Place::new();
    for verb in [
        "run", "sim", "render", "record", "replay", "rerender", "verify", "diff", "export", "info", "plan",
        "merge", "bus",
    ] {
        let text = place.expect(0, &[verb, "--help"]);
        assert!(text.contains(&format!("chainmail {verb} ")), "{verb} --help shows no example:\n{text}");
    }
}

#[test]
fn a_bus_name_in_use_is_refused() {
    let place = Place::new();
    let bus = format!("taken-{}", std::process::id());
    let first = place.command(&["record", "--bus", &bus, "--out", "first.mcap", "--no-render"]);
    let mut first = command::Background::start(first);
    first.wait_for("waiting");
    let text = place.expect(2, &["record", "--bus", &bus, "--out", "second.mcap", "--no-render"]);
    assert!(text.contains(&bus) && text.contains("recorder"), "{text}");
    // The first is none the worse for it.
    place.expect(0, &["sim", "tiny.toml", "--bus", &bus, "--no-render"]);
    assert_eq!(first.finish(), Some(0));
    place.expect(0, &["verify", "first.mcap"]);
}

#[test]
fn a_reader_that_goes_away_is_no_reason_to_stop() {
    let place = Place::new();
    let mut run = place.command(&["run", "tiny.toml", "--out", "out"]);
    let mut child =
        run.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
    // Both pipes are closed at once, as `| head -0` does.
    drop((child.stdout.take(), child.stderr.take()));
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(place.path("out/frames/0003.png").exists());
}

#[test]
fn a_refused_run_takes_nothing_away() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "keep"]);
    let log = place.bytes("keep/log.mcap");
    let force = ["run", "tiny.toml", "--out", "keep", "--force"];
    place.expect(2, &[&force[..], &["--threads", "0"]].concat());
    place.expect(2, &[&force[..], &["--set", "time.time_step_s=1"]].concat());
    assert!(place.bytes("keep/log.mcap") == log && place.path("keep/frames/0003.png").exists());
    // A run that takes its place replaces pictures too, and only what a run has written.
    std::fs::write(place.path("keep/frames/mine.png"), "keep").expect("a file");
    place.expect(0, &[&force[..], &["--set", "time.duration_s=0.03"]].concat());
    assert!(!place.path("keep/frames/0003.png").exists());
    assert_eq!(place.bytes("keep/frames/mine.png"), b"keep");
}

#[test]
fn a_scene_may_come_through_a_pipe() {
    let place = Place::new();
    let mut run = place.command(&["run", "/dev/stdin", "--out", "out", "--no-render"]);
    let mut child = run.stdin(std::process::Stdio::piped()).spawn().unwrap();
    std::io::Write::write_all(&mut child.stdin.take().unwrap(), command::TINY.as_bytes()).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    place.expect(0, &["verify", "out/log.mcap"]);
}

#[test]
fn the_printed_configuration_leads_to_a_run() {
    let place = Place::new();
    let bus = bus::BusName::unique();
    let mut recorder = place.command(&["record", "--bus", bus.as_str(), "--out", "log.mcap", "--no-render"]);
    let mut recorder = command::Background::start({
        recorder.env_remove("TMPDIR");
        recorder
    });
    recorder.wait_for("waiting");
    let mut print = place.command(&["bus", bus.as_str()]);
    let text = String::from_utf8(print.env_remove("TMPDIR").output().expect("a text").stdout).expect("text");
    let config: toml::Table = text.parse().expect("TOML");
    let global = |key: &str| config["global"][key].as_str().expect("a text").to_owned();
    let services = std::path::Path::new(&global("root-path")).join("services");
    let count = services
        .read_dir()
        .expect("the bus's folder")
        .flatten()
        .filter(|service| service.file_name().to_string_lossy().starts_with(&global("prefix")));
    // Seven topics, and the events of three roles.
    assert_eq!(count.count(), 10);
    command::signal(recorder.child.id(), "INT");
    recorder.finish();
}

//! The main job across three processes: everything arrives, and the bits are the same every time.

use crate::command::{Place, end_of, message_counts};

#[test]
fn run_writes_every_state_and_every_frame() {
    let place = Place::new();
    let summary = place.expect(0, &["run", "tiny.toml", "--out", "out"]);
    let log = place.path("out/log.mcap");
    let (counts, end) = (message_counts(&log), end_of(&log));
    assert_eq!(end.step_count, 60);
    assert_eq!(end.keyframe_count, 4);
    assert_eq!(counts["/state"], end.state_count);
    assert_eq!(counts["/step"], end.step_count + 1);
    assert_eq!(counts["/frame"], end.keyframe_count);
    assert_eq!(counts["/frame_info"], end.keyframe_count);
    assert_eq!((counts["/scene"], counts["/end"]), (1, 1));
    for frame in 0..4 {
        assert_eq!(place.bytes(&format!("out/frames/{frame:04}.png"))[1..4], *b"PNG");
    }
    if cfg!(feature = "movie") {
        assert_eq!(place.bytes("out/movie.mp4")[4..8], *b"ftyp");
    }
    for word in ["log.mcap", "steps", "energy", "penetration", "links", "hash"] {
        assert!(summary.contains(word), "the summary says nothing of {word}:\n{summary}");
    }
}

#[test]
fn two_runs_and_any_number_of_threads_write_the_same_bytes() {
    let place = Place::new();
    for (out, threads) in [("one", "1"), ("two", "2"), ("again", "2")] {
        place.expect(0, &["run", "tiny.toml", "--out", out, "--threads", threads]);
    }
    assert!(place.bytes("one/log.mcap") == place.bytes("two/log.mcap"), "1 and 2 threads differ");
    assert!(place.bytes("two/log.mcap") == place.bytes("again/log.mcap"), "two runs differ");
    place.expect(0, &["diff", "one/log.mcap", "two/log.mcap"]);
}

#[test]
fn processes_started_by_hand_in_another_order_write_the_same_bytes() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run"]);
    let bus = format!("hand-{}", std::process::id());
    for (number, order) in [["record", "render", "sim"], ["sim", "record", "render"]].into_iter().enumerate()
    {
        let log = format!("hand-{number}.mcap");
        let children = order.map(|verb| {
            let arguments = match verb {
                "record" => vec!["record", "--bus", &bus, "--out", &log],
                "render" => vec!["render", "--bus", &bus],
                _ => vec!["sim", "tiny.toml", "--bus", &bus],
            };
            place.command(&arguments).spawn().expect("a process")
        });
        for (mut child, verb) in children.into_iter().zip(order) {
            assert_eq!(child.wait().expect("it was started").code(), Some(0), "{verb}");
        }
        assert!(place.bytes(&log) == place.bytes("run/log.mcap"), "started as {order:?} the log differs");
    }
}

#[test]
fn replay_recorded_again_is_the_same_file() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run"]);
    let bus = format!("replay-{}", std::process::id());
    let mut recorder =
        place.command(&["record", "--bus", &bus, "--out", "again.mcap"]).spawn().expect("a process");
    let mut renderer = place.command(&["render", "--bus", &bus]).spawn().expect("a process");
    place.expect(0, &["replay", "run/log.mcap", "--bus", &bus, "--as-fast-as-possible"]);
    assert_eq!(recorder.wait().expect("it was started").code(), Some(0));
    assert_eq!(renderer.wait().expect("it was started").code(), Some(0));
    assert!(place.bytes("again.mcap") == place.bytes("run/log.mcap"), "the replayed log differs");
    place.expect(0, &["diff", "run/log.mcap", "again.mcap"]);
}

#[test]
fn verify_simulates_the_log_again() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run", "--no-render"]);
    assert!(!message_counts(&place.path("run/log.mcap")).contains_key("/frame"));
    let text = place.expect(0, &["verify", "run/log.mcap"]);
    assert!(text.contains("identical"), "{text}");
}

#[test]
fn rerender_changes_frames_and_nothing_else() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run"]);
    let set =
        ["--set", "render.samples_per_pixel=3", "--set", "render.width_px=16", "--set", "render.height_px=9"];
    place.expect(0, &[&["rerender", "run/log.mcap", "--out", "new"][..], &set].concat());
    let counts = message_counts(&place.path("new/log.mcap"));
    assert_eq!((counts["/frame"], counts["/state"]), (4, 61));
    let text = place.expect(1, &["diff", "run/log.mcap", "new/log.mcap"]);
    assert!(text.contains("render.samples_per_pixel"), "{text}");
    assert_eq!(end_of(&place.path("run/log.mcap")), end_of(&place.path("new/log.mcap")));
    // The same settings give the same frames: the renderer cannot tell a replay from a live simulator.
    place.expect(0, &["rerender", "run/log.mcap", "--out", "same"]);
    assert!(place.bytes("same/log.mcap") == place.bytes("run/log.mcap"), "rerender without a change differs");
}

#[test]
fn rerender_has_short_words_parts_and_linear_light() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run"]);
    let small = ["--spp", "2", "--size", "32x16"];
    // Frames alone are those of the whole log, bit for bit.
    place.expect(0, &[&["rerender", "run/log.mcap", "--out", "all"][..], &small].concat());
    let part = ["rerender", "run/log.mcap", "--out", "part", "--frames", "1-2", "--exr", "--sheet", "2"];
    let text = place.expect(0, &[&part[..], &small].concat());
    assert!(text.contains("pictures        2"), "{text}");
    for frame in ["0001", "0002"] {
        let name = format!("frames/{frame}.png");
        assert!(place.bytes(&format!("part/{name}")) == place.bytes(&format!("all/{name}")), "frame {frame}");
        assert!(place.bytes(&format!("part/frames/{frame}.exr")).starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    }
    assert!(!place.path("part/log.mcap").exists() && !place.path("part/frames/0000.png").exists());
    assert!(place.bytes("part/sheet.png").starts_with(b"\x89PNG"));
    place.expect(0, &["sheet", "all/log.mcap", "--out", "sheet.png", "--count", "3"]);
    assert!(place.bytes("sheet.png").starts_with(b"\x89PNG"));
    // A camera on its own, and what is wrong is named.
    let camera = [
        "rerender",
        "run/log.mcap",
        "--out",
        "near",
        "--frames",
        "0",
        "--camera",
        "-1,2,6:0,0,0",
        "--preview",
    ];
    place.expect(0, &camera);
    for (wrong, named) in [
        (["--size", "32"], "1920x1080"),
        (["--camera", "1,2"], "1,0.5,8"),
        (["--crop", "1,2,3"], "left, top"),
        (["--frames", "3-99"], "from 0 to 3"),
        (["--spp", "0"], "samples_per_pixel"),
    ] {
        let text = place.expect(2, &[&["rerender", "run/log.mcap", "--out", "wrong"][..], &wrong].concat());
        assert!(text.contains(named), "{wrong:?}: {text}");
    }
}

#[test]
fn diff_names_step_ring_and_field() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "a", "--no-render"]);
    let set = ["--set", "forces.linear_drag_kg_per_s=1e-12"];
    place.expect(0, &[&["run", "tiny.toml", "--out", "b", "--no-render"][..], &set].concat());
    let text = place.expect(1, &["diff", "a/log.mcap", "b/log.mcap"]);
    for word in ["forces.linear_drag_kg_per_s", "step", "ring 1", "linear_velocity_m_per_s", "ULP"] {
        assert!(text.contains(word), "the diff says nothing of {word}:\n{text}");
    }
    let json = place.expect(1, &["diff", "a/log.mcap", "b/log.mcap", "--json"]);
    serde_json::from_str::<serde_json::Value>(&json).expect("JSON");
}

#[test]
fn skipped_states_are_no_loss() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "all"]);
    place.expect(0, &["run", "tiny.toml", "--out", "few", "--set", "record.state_every=25"]);
    // Steps 0, 25 and 50, the frames at 17, 33 and 50, the last at 60.
    assert_eq!(message_counts(&place.path("few/log.mcap"))["/state"], 6);
    assert_eq!(
        end_of(&place.path("few/log.mcap")).chained_hash,
        end_of(&place.path("all/log.mcap")).chained_hash
    );
    place.expect(0, &["verify", "few/log.mcap"]);
    place.expect(0, &["rerender", "few/log.mcap", "--out", "new"]);
}

#[test]
fn zero_rings_run_and_give_empty_frames() {
    let place = Place::new();
    std::fs::write(place.path("empty.toml"), "[time]\nduration_s = 0.05\ntime_step_s = 0.01\n")
        .expect("a file");
    let size = ["--set", "render.width_px=16", "--set", "render.height_px=16"];
    place.expect(0, &[&["run", "empty.toml", "--out", "run"][..], &size].concat());
    assert_eq!(message_counts(&place.path("run/log.mcap"))["/frame"], 2);
    place.expect(0, &["verify", "run/log.mcap"]);
}

//! What a log is asked: whether it is right, and where two of them part.

use crate::command::Place;
use recorder::{Kind, Log, LogWriter};
use schemas::end::End;
use schemas::frame::FrameInfo;
use schemas::step::StepRecord;
use schemas::{Hash, chain, state, wire};
use std::path::Path;

/// Copies a log as another run would have written it: one bit of ring 1's position is flipped at a step, and all
/// hashes are made anew.
fn copy_with_a_flipped_bit(from: &Path, to: &Path, flipped_step: u64, bit: u8) {
    let log = Log::open(from).expect("a log");
    let mut writer =
        LogWriter::create(std::fs::File::create(to).expect("a file"), log.has_renderer()).expect("a log");
    let mut chained_hash = Hash::default();
    let mut state_hash = Hash::default();
    for message in log.messages() {
        let mut message = message.expect("whole");
        let bytes = message.bytes.to_mut();
        match message.kind {
            Kind::State => {
                if state::decode_header(bytes).expect("a state").step == flipped_step {
                    // Header, count, ring 0; the lowest byte of x.
                    bytes[56 + 8 + 104] ^= 1 << bit;
                }
                state_hash = state::hash_of(bytes);
                bytes[24..56].copy_from_slice(&state_hash.0);
            }
            Kind::Step => {
                let mut record: StepRecord = serde_json::from_slice(bytes).expect("a record");
                record.state_hash = state_hash;
                record.stages.state = state_hash.short();
                chained_hash = chain(&chained_hash, &state_hash);
                record.chained_hash = chained_hash;
                *bytes = serde_json::to_vec(&record).expect("JSON");
            }
            Kind::End => {
                let end: End = wire::decode(bytes).expect("an end");
                *bytes = wire::encode(&End { chained_hash, ..end });
            }
            Kind::Scene | Kind::Frame | Kind::FrameInfo => {}
        }
        writer.write(&message).expect("a valid message");
    }
    writer.finish().expect("a finished log");
}

#[test]
fn diff_explains_which_log_this_program_agrees_with() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run", "--no-render"]);
    let run = place.path("run/log.mcap");
    copy_with_a_flipped_bit(&run, &place.path("at30.mcap"), 30, 0);
    copy_with_a_flipped_bit(&run, &place.path("at40.mcap"), 40, 0);
    copy_with_a_flipped_bit(&run, &place.path("at0.mcap"), 0, 0);
    for (a, b, code, words) in [
        (
            "run/log.mcap",
            "at30.mcap",
            1,
            &["step 30 made again from the state of step 29", "agrees with A"][..],
        ),
        (
            "at30.mcap",
            "run/log.mcap",
            1,
            &["agrees with B", "A        different at step 30, stage state", "ring 1"],
        ),
        ("at0.mcap", "run/log.mcap", 1, &["from the start of the run", "agrees with B"]),
        ("run/log.mcap", "run/log.mcap", 0, &["no step differs"]),
    ] {
        let text = place.expect(code, &["diff", a, b, "--explain"]);
        for word in words {
            assert!(text.contains(word), "{a} and {b}: nothing of '{word}':\n{text}");
        }
    }
    // Both logs are of other runs than this program makes.
    copy_with_a_flipped_bit(&run, &place.path("other30.mcap"), 30, 5);
    let text = place.expect(1, &["diff", "at30.mcap", "other30.mcap", "--explain"]);
    for word in
        ["agrees with neither", "A        different at step 30", "B        different at step 30", "32 ULP"]
    {
        assert!(text.contains(word), "nothing of '{word}':\n{text}");
    }
    // Each by its own scene.
    let drag = ["--set", "forces.linear_drag_kg_per_s=1e-12"];
    place.expect(0, &[&["run", "tiny.toml", "--out", "drag", "--no-render"][..], &drag].concat());
    let text = place.expect(1, &["diff", "run/log.mcap", "drag/log.mcap", "--explain"]);
    assert!(text.contains("agrees with both: the scenes make the difference"), "{text}");
    let json = place.expect(1, &["diff", "run/log.mcap", "at40.mcap", "--explain", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["explanation"]["agrees_with"], "a", "{json}");
    assert_eq!(
        (&json["first"]["step"], &json["first"]["state"]["fields"][0]["ulp"]),
        (&40.into(), &1.into())
    );
}

#[test]
fn states_that_were_skipped_are_simulated_to_explain_a_step() {
    let place = Place::new();
    let few = ["--set", "record.state_every=25", "--no-render"];
    place.expect(0, &[&["run", "tiny.toml", "--out", "a"][..], &few].concat());
    let drag = ["--set", "forces.linear_drag_kg_per_s=1e-9"];
    place.expect(0, &[&["run", "tiny.toml", "--out", "b"][..], &few, &drag].concat());
    let text = place.expect(1, &["diff", "a/log.mcap", "b/log.mcap", "--explain"]);
    for word in [
        "simulated again: neither log keeps it",
        "agrees with both",
        "step 1 made again from the state of step 0",
    ] {
        assert!(text.contains(word), "nothing of '{word}':\n{text}");
    }
}

#[test]
fn verify_names_step_stage_ring_and_field() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run", "--no-render"]);
    copy_with_a_flipped_bit(&place.path("run/log.mcap"), &place.path("other.mcap"), 30, 0);
    let text = place.expect(1, &["verify", "other.mcap", "--threads", "2"]);
    for word in
        ["step 30, stage state", "ring 1, position_m.x", "1 ULP apart", "30 steps before it are identical"]
    {
        assert!(text.contains(word), "nothing of '{word}':\n{text}");
    }
}

#[cfg(feature = "render")]
#[test]
fn verify_renders_the_frames_again() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run"]);
    let text = place.expect(0, &["verify", "run/log.mcap", "--frames"]);
    assert!(text.contains("identical: 61 step records and 61 states, 4 frames"), "{text}");
    // Another film at frame 2.
    let log = Log::open(&place.path("run/log.mcap")).expect("a log");
    let file = std::fs::File::create(place.path("other.mcap")).expect("a file");
    let mut writer = LogWriter::create(file, true).expect("a log");
    for message in log.messages() {
        let mut message = message.expect("whole");
        if message.kind == Kind::FrameInfo {
            let mut info: FrameInfo = serde_json::from_slice(&message.bytes).expect("an info");
            if info.frame == 2 {
                info.film_hash = Hash::of(b"another film");
                *message.bytes.to_mut() = serde_json::to_vec(&info).expect("JSON");
            }
        }
        writer.write(&message).expect("a valid message");
    }
    writer.finish().expect("a finished log");
    place.expect(0, &["verify", "other.mcap"]);
    let text = place.expect(1, &["verify", "other.mcap", "--frames"]);
    assert!(text.contains("different at frame 2") && text.contains("2 frames before it"), "{text}");
}

#[cfg(feature = "render")]
#[test]
fn diff_writes_a_page_and_pictures() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "a"]);
    place.expect(0, &["rerender", "a/log.mcap", "--out", "b", "--spp", "3"]);
    let diff = ["diff", "a/log.mcap", "b/log.mcap"];
    let files = ["--html", "diff.html", "--frames-out", "pictures"];
    place.expect(1, &[&diff[..], &files].concat());
    let page = String::from_utf8(place.bytes("diff.html")).expect("text");
    assert!(page.contains("render.samples_per_pixel") && page.contains("data:image/png;base64,"), "{page}");
    for frame in 0..4 {
        assert!(place.bytes(&format!("pictures/{frame:04}.png")).starts_with(b"\x89PNG"));
    }
    // What is there is kept, unless it is to be replaced.
    let text = place.expect(2, &[&diff[..], &["--html", "diff.html"]].concat());
    assert!(text.contains("diff.html") && text.contains("--force"), "{text}");
    place.expect(1, &[&diff[..], &files, &["--force"]].concat());
}

#[cfg(feature = "movie")]
#[test]
fn export_writes_tables_pictures_a_movie_and_a_viewers_file() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run"]);
    let export = |format: &str, out: &str, code: i32| {
        place.expect(code, &["export", "run/log.mcap", "--format", format, "--out", out])
    };
    export("csv", "tables", 0);
    let lines = |name: &str| String::from_utf8(place.bytes(name)).expect("text").lines().count();
    assert_eq!((lines("tables/steps.csv"), lines("tables/bodies.csv")), (62, 1 + 61 * 2));
    export("png", "pictures", 0);
    assert!(place.bytes("pictures/0003.png") == place.bytes("run/frames/0003.png"));
    export("mp4", "movie.mp4", 0);
    assert!(place.bytes("movie.mp4") == place.bytes("run/movie.mp4"), "the run's own movie");
    export("viewer", "viewer.mcap", 0);
    let counts = crate::command::message_counts(&place.path("viewer.mcap"));
    assert_eq!((counts["/camera/image"], counts["/metrics"], counts["/rings/poses"]), (4, 61, 5));
    // Nothing is written over, least of all the log.
    assert!(export("viewer", "viewer.mcap", 2).contains("--force"));
    let text = place
        .expect(2, &["export", "run/log.mcap", "--format", "viewer", "--out", "run/log.mcap", "--force"]);
    assert!(text.contains("the log itself"), "{text}");
    place.expect(0, &["run", "tiny.toml", "--out", "dark", "--no-render"]);
    let text = place.expect(2, &["export", "dark/log.mcap", "--format", "png", "--out", "none"]);
    assert!(text.contains("rerender"), "{text}");
}

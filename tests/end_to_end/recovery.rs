//! `recover`: what is left of a broken log is a log like any other; a hole is filled by simulating again.

use crate::command::{Place, message_counts};
use recorder::{Kind, Log};

#[test]
fn a_log_that_was_cut_off_works_up_to_where_it_reaches() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run"]);
    let log = place.bytes("run/log.mcap");
    std::fs::write(place.path("cut.mcap"), &log[..log.len() * 7 / 10]).expect("a file");
    let text = place.expect(3, &["info", "cut.mcap"]);
    assert!(text.contains("truncated") && text.contains("chainmail recover cut.mcap --out FIXED"), "{text}");
    let text = place.expect(3, &["recover", "cut.mcap", "--out", "fixed.mcap"]);
    for word in ["at byte", "lost", "of 60", "chainmail resume fixed.mcap"] {
        assert!(text.contains(word), "'{word}' is not in:\n{text}");
    }
    let json = place.run(&["recover", "cut.mcap", "--out", "fixed.mcap", "--force", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    let last = json["last_step"].as_u64().expect("a number");
    assert!(last > 16 && last < 60 && json["complete"] == false, "{json}");
    let text = place.expect(0, &["info", "fixed.mcap"]);
    assert!(text.contains("recovered") && text.contains(&format!("after step {last}")), "{text}");
    let text = place.expect(0, &["verify", "fixed.mcap"]);
    assert!(text.contains(&format!("{} step records", last + 1)), "{text}");
    place.expect(0, &["rerender", "fixed.mcap", "--out", "again", "--spp", "1"]);
    assert_eq!(message_counts(&place.path("again/log.mcap"))["/step"], last + 1);
    place.expect(1, &["diff", "fixed.mcap", "run/log.mcap"]);
    // What cannot be done changes nothing.
    let before = place.bytes("fixed.mcap");
    for (code, arguments) in [
        (2, ["recover", "cut.mcap", "--out", "fixed.mcap"]),
        (2, ["recover", "cut.mcap", "--out", "cut.mcap"]),
        (2, ["recover", "tiny.toml", "--out", "new.mcap"]),
        (2, ["recover", "none.mcap", "--out", "new.mcap"]),
        (2, ["recover", "cut.mcap", "--out", "none/new.mcap"]),
    ] {
        place.expect(code, &arguments);
    }
    assert!(place.bytes("fixed.mcap") == before && !place.path("new.mcap").exists());
    // A whole log is copied.
    let text = place.expect(0, &["recover", "run/log.mcap", "--out", "copy.mcap"]);
    assert!(text.contains("nothing") && place.bytes("copy.mcap") == log, "{text}");
}

#[test]
fn a_hole_is_filled_with_the_very_bytes_that_were_lost() {
    let place = Place::new();
    // Friction and skipped states: most of what is lost lies far from the last state.
    let set = ["--set", "record.state_every=25", "--set", "forces.gravity_m_per_s2=[0.0,-200.0,0.0]"];
    place.expect(0, &[&["run", "tiny.toml", "--out", "run", "--no-render"][..], &set].concat());
    let mut broken = place.bytes("run/log.mcap");
    let whole = Log::from_bytes("whole", broken.clone()).expect("a log");
    // The record of step 30, found by its hash.
    let needle = whole.step(30).expect("a record").chained_hash.to_string();
    let at = broken.windows(needle.len()).position(|bytes| bytes == needle.as_bytes()).expect("it is there");
    broken[at] ^= 1;
    std::fs::write(place.path("broken.mcap"), &broken).expect("a file");
    let text = place.expect(3, &["info", "broken.mcap"]);
    assert!(text.contains("damaged at byte offset") && text.contains("chainmail recover"), "{text}");
    let text = place.expect(0, &["recover", "broken.mcap", "--out", "fixed.mcap"]);
    assert!(text.contains("simulated and proven"), "{text}");
    assert!(place.bytes("fixed.mcap") == place.bytes("run/log.mcap"), "the hole was filled with other bytes");
    let text = place.expect(3, &["recover", "broken.mcap", "--out", "short.mcap", "--no-remake"]);
    assert!(text.contains("lost"), "{text}");
    assert!(Log::open(&place.path("short.mcap")).expect("a log").count(Kind::Step) <= 30);
    place.expect(0, &["verify", "short.mcap"]);
}

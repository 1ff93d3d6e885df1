//! Frames rendered in shares, and the log that is made of them: that of one renderer.

use crate::command::Place;

#[test]
fn shares_are_merged_to_the_log_of_one_renderer() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run"]);
    let spp = ["--spp", "3"];
    place.expect(0, &[&["rerender", "run/log.mcap", "--out", "one"][..], &spp].concat());
    let share = |share: &str, out: &str, threads: &str| {
        let rerender = ["rerender", "run/log.mcap", "--share", share, "--out", out, "--threads", threads];
        place.expect(0, &[&rerender[..], &spp].concat());
    };
    share("1/3", "a", "1");
    share("2/3", "b", "2");
    share("3/3", "c", "1");
    assert!(place.path("a/frames/0003.png").exists() && !place.path("a/frames/0001.png").exists());
    let merge = |parts: &[&str], out: &str, code: i32| {
        place.expect(code, &[&["merge"], parts, &["--out", out]].concat())
    };
    // In any order, and one part twice.
    merge(&["c/part.mcap", "run/log.mcap", "a/part.mcap", "b/part.mcap", "a/part.mcap"], "all.mcap", 0);
    assert!(place.bytes("all.mcap") == place.bytes("one/log.mcap"), "the merged log differs");
    place.expect(0, &["verify", "all.mcap", "--frames"]);
    // A log that was recorded without frames gets them all the same; a part may be a range.
    place.expect(0, &["run", "tiny.toml", "--out", "dark", "--no-render"]);
    for (frames, out) in [("0", "d"), ("1-3", "e")] {
        place.expect(0, &["rerender", "dark/log.mcap", "--frames", frames, "--out", out]);
    }
    merge(&["dark/log.mcap", "d/part.mcap", "e/part.mcap"], "lit.mcap", 0);
    assert!(place.bytes("lit.mcap") == place.bytes("run/log.mcap"), "the log with frames differs");
    // What does not fit is refused, and leaves nothing behind.
    place.expect(0, &["run", "tiny.toml", "--out", "other", "--no-render", "--set", "time.duration_s=0.07"]);
    for (parts, word) in [
        (
            &["run/log.mcap", "a/part.mcap", "c/part.mcap"][..],
            "1 of 4 frames are in no part, the first is frame 1",
        ),
        (&["a/part.mcap", "b/part.mcap", "c/part.mcap"], "0 of the files have steps"),
        (&["run/log.mcap", "dark/log.mcap", "a/part.mcap"], "2 of the files have steps"),
        (&["run/log.mcap", "a/part.mcap", "d/part.mcap"], "other settings"),
        (&["other/log.mcap", "a/part.mcap", "b/part.mcap"], "another motion"),
    ] {
        let text = merge(parts, "no.mcap", 2);
        assert!(text.contains(word), "{parts:?}: {text}");
    }
    assert!(merge(&["run/log.mcap", "a/part.mcap"], "all.mcap", 2).contains("--force"));
    assert!(merge(&["run/log.mcap", "a/part.mcap"], "a/part.mcap", 2).contains("would be lost"));
    let text = place.expect(2, &["rerender", "run/log.mcap", "--share", "0/3", "--out", "f"]);
    assert!(text.contains("3/8"), "{text}");
    // A share that was cut off counts with its whole frames.
    let part = place.bytes("a/part.mcap");
    let last = part.windows(4).rposition(|bytes| bytes == b"\x89PNG").expect("a picture");
    std::fs::write(place.path("cut.mcap"), &part[..last]).expect("a file");
    let text = merge(&["run/log.mcap", "cut.mcap", "b/part.mcap", "c/part.mcap"], "no.mcap", 2);
    assert!(text.contains("1 of 4 frames are in no part, the first is frame 3"), "{text}");
    let names = place.path(".").read_dir().expect("a folder").flatten().map(|entry| entry.file_name());
    let left: Vec<_> = names.filter(|name| name.to_string_lossy().starts_with(".chainmail")).collect();
    assert!(!place.path("no.mcap").exists() && left.is_empty(), "{left:?}");
}

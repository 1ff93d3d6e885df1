//! SIGINT and SIGTERM to any one process of a run: the log is closed, nobody hangs, and what it holds is whole. While it
//! runs, its files are its owner's alone.

use crate::command::{Background, Place, message_counts, signal};
use bus::BusName;
use std::os::unix::fs::PermissionsExt;

fn long_run(place: &Place) -> Background {
    let set = [
        "--set",
        "time.duration_s=60",
        "--set",
        "render.samples_per_pixel=16",
        "--set",
        "render.width_px=64",
    ];
    let mut command = place.command(&[&["run", "tiny.toml", "--out", "run"][..], &set].concat());
    command.env("TMPDIR", place.path(""));
    let mut run = Background::start(command);
    run.wait_for("renderer (frames)");
    run
}

#[test]
fn a_signal_to_any_process_leaves_a_log_that_goes_on() {
    for (verb, name) in
        [("sim", "INT"), ("sim", "TERM"), ("render", "INT"), ("record", "INT"), ("record", "TERM")]
    {
        let place = Place::new();
        let mut run = long_run(&place);
        signal(run.part(verb), name);
        assert_eq!(run.finish(), Some(3), "{verb}, {name}: {}", run.seen);
        // It is closed: any MCAP reader gets to its end.
        let counts = message_counts(&place.path("run/log.mcap"));
        assert!(counts["/step"] > 20, "{verb}, {name}: {counts:?}");
        if verb == "sim" {
            assert_eq!(counts["/end"], 1, "{verb}, {name}");
            place.expect(0, &["verify", "run/log.mcap"]);
        }
        let output = place.run(&["recover", "run/log.mcap", "--out", "fixed.mcap"]);
        assert!(matches!(output.status.code(), Some(0 | 3)), "{verb}, {name}");
        assert_eq!(message_counts(&place.path("fixed.mcap"))["/step"], counts["/step"], "{verb}, {name}");
        place.expect(0, &["verify", "fixed.mcap"]);
    }
}

#[test]
fn what_a_run_shares_is_its_owners_alone() {
    let place = Place::new();
    let mut run = long_run(&place);
    let folders = place.path("").read_dir().expect("a folder").flatten();
    let folders: Vec<_> =
        folders.filter(|entry| entry.file_name().to_string_lossy().starts_with("chainmail-")).collect();
    let [folder] = &folders[..] else { panic!("{folders:?}") };
    let mode = |path: std::path::PathBuf| path.metadata().map_or(0, |file| file.permissions().mode() & 0o777);
    assert_eq!(mode(folder.path()), 0o700);
    let name: BusName =
        folder.file_name().to_string_lossy()["chainmail-".len()..].parse().expect("a bus name");
    let shared = std::fs::read_dir("/dev/shm").expect("shared memory").flatten();
    let shared =
        shared.filter(|entry| entry.file_name().to_string_lossy().starts_with(&name.shared_memory_prefix()));
    let modes: Vec<_> = shared.map(|entry| (entry.file_name(), mode(entry.path()))).collect();
    assert!(modes.len() > 5, "{modes:?}");
    for (file, mode) in &modes {
        assert_eq!(mode & 0o077, 0, "{file:?} has mode {mode:o}");
    }
    signal(run.child.id(), "TERM");
    assert_eq!(run.finish(), Some(3), "{}", run.seen);
}

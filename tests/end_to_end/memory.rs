//! Memory does not grow with the length of a run.

use crate::command::{Background, Place};
use bus::BusName;

/// Memory of a process that no file backs, in bytes.
fn memory_of(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).expect("the process is there");
    let line = status.lines().find_map(|line| line.strip_prefix("RssAnon:")).expect("Linux tells");
    1024 * line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number")
}

#[test]
fn a_longer_run_needs_no_more_memory() {
    const STEPS: u64 = 30_000;
    let place = Place::new();
    let bus = BusName::unique().to_string();
    let mut recorder = place
        .command(&["record", "--bus", &bus, "--no-render", "--out", "/dev/null", "--force"])
        .spawn()
        .expect("one");
    let set = ["--set", "time.duration_s=30", "--set", "record.state_every=7"];
    let sim = ["sim", "tiny.toml", "--bus", &bus, "--no-render", "--threads", "1"];
    let mut simulator = Background::start(place.command(&[&sim[..], &set].concat()));
    // Told at each tenth of the run; the recorder is at most a queue behind.
    let mut at_tenths = Vec::new();
    for _ in 0..2 {
        simulator.wait_for(&format!(" of {STEPS}"));
    }
    for tenth in 3..=9 {
        simulator.wait_for(&format!(" of {STEPS}"));
        let memory = [simulator.child.id(), recorder.id()].map(memory_of);
        println!("after {tenth} or so tenths: simulator and recorder {memory:?} bytes");
        at_tenths.push(memory);
    }
    assert_eq!(simulator.finish(), Some(0), "{}", simulator.seen);
    assert!(recorder.wait().expect("it was started").success());
    // The smallest piece that an allocator hands out is 32 bytes: one of them lost in every step of these six tenths
    // would show. What the heap takes at a time, 132 kB, may come and go.
    let lost_min = 32 * STEPS * 6 / 10;
    for (part, name) in ["simulator", "recorder"].into_iter().enumerate() {
        let (first, last) = (at_tenths[0][part], at_tenths[6][part]);
        assert!(last < first + lost_min, "the {name} had {first} bytes, and {last} at the end");
    }
}

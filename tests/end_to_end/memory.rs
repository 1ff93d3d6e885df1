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
    const STEPS: u64 = 150_000;
    let place = Place::new();
    let bus = BusName::unique().to_string();
    let mut recorder = place
        .command(&["record", "--bus", &bus, "--no-render", "--out", "/dev/null", "--force"])
        .spawn()
        .expect("one");
    let set = ["--set", "time.duration_s=150", "--set", "record.state_every=7"];
    let sim = ["sim", "tiny.toml", "--bus", &bus, "--no-render", "--threads", "1"];
    let mut simulator = Background::start(place.command(&[&sim[..], &set].concat()));
    // Told at each tenth of the run; the recorder is at most a queue behind.
    let mut seen: Vec<(u64, [u64; 2])> = Vec::new();
    while let Some(line) = simulator.next_line() {
        let step =
            line.strip_prefix("simulator (steps): ").and_then(|rest| rest.split(' ').next()?.parse().ok());
        if let Some(step) = step.filter(|&step: &u64| step < STEPS) {
            let memory = [simulator.child.id(), recorder.id()].map(memory_of);
            println!("at step {step}: simulator and recorder {memory:?} bytes");
            seen.push((step, memory));
        }
    }
    assert_eq!(simulator.finish(), Some(0), "{}", simulator.seen);
    assert!(recorder.wait().expect("it was started").success());
    // The first two tenths fill buffers. The smallest piece that an allocator hands out is 32 bytes: a quarter of one lost in
    // every step after that would show. What the heap takes at a time, 132 kB, may come and go.
    seen.retain(|&(step, _)| step >= STEPS / 5);
    let [Some(&(from, first)), Some(&(to, last))] = [seen.first(), seen.last()] else { panic!("{seen:?}") };
    assert!(to - from >= STEPS / 2, "{seen:?}");
    for (part, name) in ["simulator", "recorder"].into_iter().enumerate() {
        let (first, last) = (first[part], last[part]);
        assert!(
            last < first + 8 * (to - from),
            "the {name} had {first} bytes at step {from}, and {last} at step {to}"
        );
    }
}

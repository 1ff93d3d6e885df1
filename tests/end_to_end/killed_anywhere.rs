//! kill -9 of one process, or of all, at any moment: what was flushed is readable, nobody hangs, nothing stays behind
//! after the next start, and the run goes on to the very log that it would have left.
//!
//! 80 moments; `CHAINMAIL_KILLS=200 cargo test --test end_to_end killed_at_any_moment -- --nocapture` tries 200.

use crate::command::Place;
use bus::BusName;
use recorder::{Kind, Log};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

const RUN: [&str; 6] = [
    "--set",
    "time.duration_s=0.5",
    "--set",
    "record.flush_every_s=0.02",
    "--set",
    "render.samples_per_pixel=1",
];
/// Runs side by side.
const BATCH: u64 = 3;

/// Who is killed.
const TARGETS: [&[&str]; 7] = [
    &["sim"],
    &["render"],
    &["record"],
    &["run"],
    &["sim", "record"],
    &["run", "record"],
    &["run", "sim", "render", "record"],
];

#[test]
fn killed_at_any_moment() {
    let count = std::env::var("CHAINMAIL_KILLS").map_or(80, |text| text.parse().expect("a number"));
    let reference = Place::new();
    let begin = Instant::now();
    reference.expect(0, &[&["run", "tiny.toml", "--out", "run"][..], &RUN].concat());
    let usual = begin.elapsed();
    let log = reference.bytes("run/log.mcap");
    let all: Vec<Outcome> = std::thread::scope(|scope| {
        let batches: Vec<_> = (0..BATCH)
            .map(|batch| {
                let log = &log;
                scope.spawn(move || {
                    (batch..count)
                        .step_by(BATCH as usize)
                        .map(|seed| kill(seed, usual, log))
                        .collect::<Vec<_>>()
                })
            })
            .collect();
        batches.into_iter().flat_map(|batch| batch.join().expect("a batch")).collect()
    });
    let slowest = all.iter().map(|outcome| outcome.gone_after).max().expect("one");
    let (read, at_all) = (all.iter().filter(|outcome| outcome.steps > 0).count(), all.len());
    let resumed = all.iter().filter(|outcome| outcome.resumed).count();
    println!(
        "{at_all} kills within three times {usual:.2?}: {read} logs had steps, {resumed} went on to the same bytes; the \
         slowest end took {slowest:.2?} (2 s expected, 20 s allowed on a loaded machine)"
    );
    assert!(slowest < Duration::from_secs(20));
    assert!(count < 80 || (read > 0 && resumed > 0), "no kill hit a run");
}

struct Outcome {
    /// How long the last process lived after the kill.
    gone_after: Duration,
    /// Step records in the recovered log.
    steps: usize,
    resumed: bool,
}

/// A number that looks random, from the seed alone.
fn spread(seed: u64) -> u64 {
    let mut x = seed.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x ^= x >> 31;
    x.wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11
}

fn kill(seed: u64, usual: Duration, reference: &[u8]) -> Outcome {
    let place = Place::new();
    let target = TARGETS[(seed % TARGETS.len() as u64) as usize];
    // Runs side by side are slower. Now and then it is over.
    let wait = usual.mul_f64((spread(seed) % 1000) as f64 * 0.003);
    let what = format!("seed {seed}: {target:?} killed after {wait:.2?}");
    let temporary = place.path("t");
    std::fs::create_dir(&temporary).expect("a folder");
    let command = |arguments: &[&str]| {
        let mut command = place.command(arguments);
        command.env("TMPDIR", &temporary).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    let mut run = command(&[&["run", "tiny.toml", "--out", "run"][..], &RUN].concat())
        .stderr(Stdio::null())
        .spawn()
        .expect("a run");
    std::thread::sleep(wait);
    let parts = children(run.id());
    let verb_of = |pid: u32| verb(pid).filter(|verb| target.contains(&verb.as_str()));
    let before = place.path("before.mcap");
    // What can be read now was flushed; a whole copy takes a moment in which more may come.
    let flushed = std::fs::copy(place.path("run/log.mcap"), &before).map_or(0, |_| steps_of(&before));
    let mut victims: Vec<u32> = parts.iter().copied().filter(|&pid| verb_of(pid).is_some()).collect();
    if target.contains(&"run") {
        victims.insert(0, run.id());
    }
    let killed_at = Instant::now();
    victims.iter().filter(|&&pid| is_alive(pid)).for_each(|&pid| {
        // It may end by itself at this very moment.
        let _ = std::process::Command::new("kill")
            .args(["-KILL", &pid.to_string()])
            .stderr(Stdio::null())
            .status();
    });
    run.wait().expect("it was started");
    while parts.iter().any(|&pid| is_alive(pid)) {
        assert!(killed_at.elapsed() < Duration::from_secs(60), "{what}: {parts:?} hang");
        std::thread::sleep(Duration::from_millis(5));
    }
    let gone_after = killed_at.elapsed();
    let buses = buses(&temporary);
    let steps = check_log(&place, &what, flushed);
    // The next run starts, and takes away what the dead have left.
    let expect = |arguments: &[&str], codes: &[i32]| {
        let output = command(arguments).output().expect("the command starts");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.code().is_some_and(|code| codes.contains(&code)),
            "{what}: {arguments:?}: {text}"
        );
    };
    let resumed = steps > 0;
    if resumed {
        expect(&["resume", "run/log.mcap", "--out", "on"], &[0, 3]);
        let whole = Log::open(&place.path("run/log.mcap")).expect("a log").health();
        let differs = place.bytes("on/log.mcap") != reference;
        assert!(!differs, "{what}: the log that was gone on with ({whole}) differs");
    } else {
        expect(&["run", "tiny.toml", "--out", "run", "--force", "--no-render"], &[0]);
    }
    for name in &buses {
        let left = std::fs::read_dir("/dev/shm").expect("shared memory").flatten();
        let prefix = name.shared_memory_prefix();
        let left: Vec<_> =
            left.filter(|entry| entry.file_name().to_string_lossy().starts_with(&prefix)).collect();
        assert!(left.is_empty(), "{what}: {left:?}");
    }
    let left: Vec<PathBuf> =
        temporary.read_dir().expect("a folder").flatten().map(|entry| entry.path()).collect();
    assert!(left.is_empty(), "{what}: {left:?}");
    Outcome { gone_after, steps, resumed }
}

/// Recovers the log that a killed run has left, if it has; returns its step records.
fn check_log(place: &Place, what: &str, flushed: usize) -> usize {
    let log = place.path("run/log.mcap");
    if !log.exists() || log.metadata().expect("a file").len() == 0 {
        assert_eq!(flushed, 0, "{what}");
        return 0;
    }
    let output = place.run(&["recover", "run/log.mcap", "--out", "fixed.mcap"]);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(0 | 3)) && !text.contains("panicked"), "{what}: {text}");
    if !place.path("fixed.mcap").exists() {
        assert_eq!(steps_of(&log), 0, "{what}: {text}");
        assert_eq!(flushed, 0, "{what}");
        return 0;
    }
    let steps = steps_of(&place.path("fixed.mcap"));
    assert!(steps >= flushed, "{what}: {flushed} steps were flushed, {steps} recovered");
    place.expect(0, &["verify", "fixed.mcap"]);
    steps
}

fn steps_of(log: &Path) -> usize {
    Log::open(log).map_or(0, |log| log.count(Kind::Step))
}

/// The buses whose directories are there.
fn buses(temporary: &Path) -> Vec<BusName> {
    let names = temporary.read_dir().expect("a folder").flatten().map(|entry| entry.file_name());
    let names = names.filter_map(|name| name.to_str()?.strip_prefix("chainmail-")?.parse().ok());
    names.collect()
}

/// The processes that a process has started.
fn children(pid: u32) -> Vec<u32> {
    let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
    let children = tasks.flat_map(|task| {
        let text = std::fs::read_to_string(task.path().join("children")).unwrap_or_default();
        text.split_whitespace().filter_map(|pid| pid.parse().ok()).collect::<Vec<u32>>()
    });
    children.collect()
}

fn verb(pid: u32) -> Option<String> {
    let line = std::fs::read_to_string(format!("/proc/{pid}/cmdline")).ok()?;
    line.split('\0').nth(1).map(str::to_owned)
}

/// Whether a process runs; one that nobody has asked for its exit code does not.
fn is_alive(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit(") ")
        .next()
        .and_then(|rest| rest.chars().next())
        .is_some_and(|state| state != 'Z' && state != 'X')
}

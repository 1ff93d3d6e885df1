//! What recording costs the simulator: the drop scene with and without a recorder, in turn.
//!
//! Prints wall times of the simulator process, their ratio pair by pair, and the final hash. Only the hash
//! could be wrong; times are for reading.

use std::process::{Child, Command, Stdio};
use std::time::Instant;

const PAIRS: usize = 5;

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let log = folder.path().join("log.mcap");
    let mut pairs = Vec::new();
    for pair in 0..PAIRS {
        let alone = simulate(&format!("alone-{}-{pair}", std::process::id()), true);
        let bus = format!("recorded-{}-{pair}", std::process::id());
        let mut recorder =
            start(&["record", "--bus", &bus, "--no-render", "--force", "--out", &log.to_string_lossy()]);
        let recorded = simulate(&bus, false);
        assert!(recorder.wait().expect("it was started").success(), "the recorder failed");
        pairs.push((alone, recorded));
        println!("pair {pair}: alone {alone:.3} s, recorded {recorded:.3} s, ratio {:.3}", recorded / alone);
    }
    pairs.sort_by(|a, b| (a.1 / a.0).total_cmp(&(b.1 / b.0)));
    let (alone, recorded) = pairs[PAIRS / 2];
    println!("recording/drop  median ratio {:.3} (recorded over alone)", recorded / alone);
    let log = recorder::Log::open(&log).expect("the log was just written");
    let end = log.end().expect("its end can be read").expect("it has an end");
    println!("recording/drop  {} steps, hash {}", end.step_count, end.chained_hash);
}

fn start(arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_chainmail"));
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().expect("the command starts")
}

/// Wall time of a simulator process, in seconds.
fn simulate(bus: &str, alone: bool) -> f64 {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/drop.toml");
    let mut arguments = vec!["sim", scene, "--bus", bus, "--no-render", "--threads", "1"];
    if alone {
        arguments.push("--no-record");
    }
    let start_time = Instant::now();
    let status = start(&arguments).wait().expect("it was started");
    assert!(status.success(), "the simulator failed");
    start_time.elapsed().as_secs_f64()
}

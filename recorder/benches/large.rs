//! Large logs: 10,000 rings a step into memory-backed storage, read back and hashed, and a glance at the whole:
//! `cargo bench -p recorder --bench large`. Prints; the only thing that can fail is that the file read back is not the one
//! that was written. `CHAINMAIL_BENCH_GB` says how large the log is (2; 10 is what `info` was measured with).

use recorder::{Glance, Kind, Log, LogWriter, Message};
use schemas::end::{End, Outcome};
use schemas::plan::Plan;
use schemas::scene::{Scene, SceneRecord};
use schemas::state::{BodyState, StateHeader};
use schemas::step::{StageHashes, StepRecord};
use schemas::{Hash, chain, log_time_ns, state, wire};
use std::path::Path;
use std::time::Instant;

const RINGS: usize = 10_000;
const STATE_BYTES: f64 = 56.0 + 16.0 + 104.0 * RINGS as f64;

fn main() {
    let gigabytes: f64 =
        std::env::var("CHAINMAIL_BENCH_GB").map_or(2.0, |text| text.parse().expect("a number"));
    let steps = (gigabytes * 1e9 / STATE_BYTES) as u64;
    // Linux keeps what lies here in memory.
    let parent = if Path::new("/dev/shm").is_dir() { "/dev/shm" } else { "." };
    let folder = tempfile::Builder::new().prefix("chainmail-bench-").tempdir_in(parent).expect("a folder");
    let path = folder.path().join("log.mcap");
    let scene = scene(steps);
    let message = serde_json::to_vec(&SceneRecord::new(scene.clone(), Plan::default())).expect("JSON");
    let file = std::fs::File::create(&path).expect("a file");
    let mut writer = LogWriter::create(file, false).expect("memory");
    writer.write(&Message::new(Kind::Scene, 0, message)).expect("a scene");
    let mut chained_hash = Hash::default();
    let (mut write_s, mut bytes, mut keyframe_count) = (0.0, 0, 0);
    for step in 0..=steps {
        let [state, record] = messages(step, &mut chained_hash);
        bytes += state.bytes.len() + record.bytes.len();
        keyframe_count += u64::from(scene.time.frame_at(step).is_some());
        let start = Instant::now();
        writer.write(&state).expect("a valid message");
        writer.write(&record).expect("a valid message");
        write_s += start.elapsed().as_secs_f64();
    }
    let end = End {
        outcome: Outcome::Completed,
        step_count: steps,
        state_count: steps + 1,
        keyframe_count,
        chained_hash,
    };
    let start = Instant::now();
    let time_ns = log_time_ns(steps as f64 * 0.001);
    writer.write(&Message::new(Kind::End, time_ns, wire::encode(&end))).expect("a valid message");
    let (_, written) = writer.finish().expect("memory");
    write_s += start.elapsed().as_secs_f64();
    let total = bytes as f64 / 1e9;
    println!(
        "{RINGS} rings, {steps} steps, {:.2} GB: write {:.2} GB/s",
        written.bytes as f64 / 1e9,
        total / write_s
    );
    for _ in 0..3 {
        let start = Instant::now();
        let glance = Glance::of(&Log::open(&path).expect("a log")).expect("whole");
        let glance_s = start.elapsed().as_secs_f64();
        assert_eq!((glance.steps, glance.states, glance.chained_hash), (steps, steps + 1, chained_hash));
        let log = Log::open(&path).expect("a log");
        let start = Instant::now();
        let checker = log.check(&mut |_, _| {}).expect("whole");
        let check_s = start.elapsed().as_secs_f64();
        assert_eq!(checker.chained_hash(), chained_hash);
        println!(
            "glance (what info shows) {:.1} ms, read and hash {:.2} GB/s",
            1e3 * glance_s,
            total / check_s
        );
    }
}

fn scene(steps: u64) -> Scene {
    let text = format!(
        "[time]\nduration_s = {}\ntime_step_s = 0.001\nframes_per_second = 24.0\n[material.steel]\n[[weave]]\npattern = \
         \"chain\"\nrows = 1\ncolumns = {RINGS}\nmajor_radius_m = 0.5\nminor_radius_m = 0.1\nring_mass_kg = 1.0\nmaterial = \
         \"steel\"\n",
        steps as f64 * 0.001
    );
    Scene::parse(&text, &[]).expect("a scene")
}

fn messages(step: u64, chained_hash: &mut Hash) -> [Message<'static>; 2] {
    let sim_time_s = step as f64 * 0.001;
    let body = |ring: usize| {
        let value = ring as f64 * 0.1 + sim_time_s / 3.0;
        BodyState {
            position_m: [value; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
            linear_velocity_m_per_s: [value; 3],
            angular_velocity_rad_per_s: [value; 3],
        }
    };
    let bodies: Vec<_> = (0..RINGS).map(body).collect();
    let mut bytes = Vec::new();
    let header = StateHeader { step, sim_time_s, ..Default::default() };
    let state_hash = state::encode(&header, &bodies, &[], &mut bytes);
    *chained_hash = chain(chained_hash, &state_hash);
    let short = || state_hash.short();
    let stages = StageHashes { candidate_pairs: short(), contacts: short(), forces: short(), state: short() };
    let record = StepRecord {
        step,
        sim_time_s,
        candidate_pairs: 9_999,
        contacts: 9_999,
        kinetic_energy_j: 1.0 / 3.0,
        gravity_energy_j: 2.0 / 3.0,
        contact_energy_j: 1.0 / 7.0,
        dissipated_energy_j: sim_time_s,
        penetration_m: 1e-4,
        penetration_beyond_bound: None,
        surface_samples: None,
        error_estimate_m: None,
        drive_work_j: None,
        reactions: None,
        audit: None,
        stages,
        state_hash,
        chained_hash: *chained_hash,
    };
    let time_ns = log_time_ns(sim_time_s);
    let record = serde_json::to_vec(&record).expect("JSON");
    [Message::new(Kind::State, time_ns, bytes), Message::new(Kind::Step, time_ns, record)]
}

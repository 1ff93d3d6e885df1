//! How long `diff` takes on two logs of a gigabyte: `cargo bench -p recorder --bench diff`. Prints times; what can fail is
//! that another difference is found than the one that was put in.

use recorder::diff::{Diff, Verdict, diff};
use recorder::{Kind, Log, LogWriter, Message};
use schemas::end::{End, Outcome};
use schemas::plan::Plan;
use schemas::scene::{Scene, SceneRecord};
use schemas::state::{BodyState, StateHeader};
use schemas::step::{StageHashes, StepRecord};
use schemas::{Hash, chain, log_time_ns, state, wire};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::time::Instant;

const RINGS: u32 = 10_000;
const STEPS: u64 = 999;
/// Where the bit is flipped: step, ring, and the number of the byte in the ring.
const FLIPPED: (u64, usize, usize) = (617, 7_321, 80);

fn main() {
    let scene = Scene::parse(
        &format!(
            "[time]\nduration_s = {}\ntime_step_s = 0.001\nframes_per_second = 24.0\n[material.steel]\n[[weave]]\n\
             pattern = \"chain\"\nrows = 1\ncolumns = {RINGS}\nmajor_radius_m = 0.5\nminor_radius_m = 0.1\n\
             ring_mass_kg = 1.0\nmaterial = \"steel\"\n",
            STEPS as f64 * 0.001
        ),
        &[],
    )
    .expect("a scene");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [a, b, c] = ["a.mcap", "b.mcap", "c.mcap"].map(|name| folder.path().join(name));
    write(&scene, &a, None);
    write(&scene, &b, Some(FLIPPED.0));
    let bytes = a.metadata().expect("a file").len();
    println!("{RINGS} rings, {} states, {:.3} GB a log", STEPS + 1, bytes as f64 / 1e9);
    report("another run by one bit", &a, &b, |found| {
        assert_eq!(found.verdict, Verdict::Differs);
        check_place(found);
    });
    std::fs::copy(&a, &c).expect("a copy");
    report("the same", &a, &c, |found| assert_eq!(found.verdict, Verdict::Same));
    flip_in_file(&c);
    report("a bit altered in the file", &a, &c, |found| {
        assert_eq!(found.verdict, Verdict::Damaged);
        check_place(found);
    });
}

/// Compares two logs four times, opening included; the files have just been written, so they are in memory mostly.
fn report(name: &str, a: &Path, b: &Path, check: impl Fn(&Diff)) {
    for _ in 0..4 {
        let start = Instant::now();
        let (a, b) = (Log::open(a).expect("a log"), Log::open(b).expect("a log"));
        let open_s = start.elapsed().as_secs_f64();
        let found = diff(&a, &b);
        let all_s = start.elapsed().as_secs_f64();
        check(&found);
        let [[read, all], _] = found.chunks_read;
        println!("diff/{name}: {all_s:.4} s, {open_s:.4} s of it to open; {read} of {all} chunks");
    }
}

fn check_place(found: &Diff) {
    let first = found.first.as_ref().expect("a difference");
    let state = first.state.as_ref().expect("a state");
    let field = &state.fields[0];
    assert_eq!((first.step, state.fields_differing, field.ulp), (FLIPPED.0, 1, Some(1)));
    assert_eq!(
        (field.body, field.field, field.component),
        (Some(FLIPPED.1), "angular_velocity_rad_per_s", "x")
    );
}

fn write(scene: &Scene, path: &Path, flipped_step: Option<u64>) {
    let file = File::create(path).expect("a file");
    let mut writer = LogWriter::create(file, false).expect("a log");
    let mut put = |kind: Kind, time_ns: u64, bytes: &[u8]| {
        writer.write(&Message::new(kind, time_ns, bytes)).expect("a valid message");
    };
    let record = SceneRecord::new(scene.clone(), Plan::default());
    put(Kind::Scene, 0, &serde_json::to_vec(&record).expect("JSON"));
    let (mut chained_hash, mut bytes, mut keyframe_count) = (Hash::default(), Vec::new(), 0);
    for step in 0..=STEPS {
        let sim_time_s = step as f64 * 0.001;
        let header = StateHeader { step, sim_time_s, ..Default::default() };
        let mut state_hash = state::encode(&header, &bodies(step), &[], &mut bytes);
        if flipped_step == Some(step) {
            bytes[64 + 104 * FLIPPED.1 + FLIPPED.2] ^= 1;
            state_hash = state::hash_of(&bytes);
            bytes[24..56].copy_from_slice(&state_hash.0);
        }
        chained_hash = chain(&chained_hash, &state_hash);
        put(Kind::State, log_time_ns(sim_time_s), &bytes);
        let record = step_record(step, state_hash, chained_hash);
        put(Kind::Step, log_time_ns(sim_time_s), &serde_json::to_vec(&record).expect("JSON"));
        keyframe_count += u64::from(scene.time.frame_at(step).is_some());
    }
    let outcome = Outcome::Completed;
    let end = End { outcome, step_count: STEPS, state_count: STEPS + 1, keyframe_count, chained_hash };
    put(Kind::End, log_time_ns(STEPS as f64 * 0.001), &wire::encode(&end));
    writer.finish().expect("a log").0.sync_all().expect("a disk");
}

fn bodies(step: u64) -> Vec<BodyState> {
    let value = |ring: u32, field: u32| f64::from(ring * 13 + field) / 7.0 + step as f64 * 1e-3;
    let body = |ring: u32| BodyState {
        position_m: [0, 1, 2].map(|axis| value(ring, axis)),
        orientation: [3, 4, 5, 6].map(|axis| value(ring, axis)),
        linear_velocity_m_per_s: [7, 8, 9].map(|axis| value(ring, axis)),
        angular_velocity_rad_per_s: [10, 11, 12].map(|axis| value(ring, axis)),
    };
    (0..RINGS).map(body).collect()
}

fn step_record(step: u64, state_hash: Hash, chained_hash: Hash) -> StepRecord {
    StepRecord {
        step,
        sim_time_s: step as f64 * 0.001,
        candidate_pairs: 1,
        contacts: 1,
        kinetic_energy_j: 1.0,
        gravity_energy_j: 0.0,
        contact_energy_j: 0.0,
        dissipated_energy_j: 0.0,
        penetration_m: 0.0,
        penetration_beyond_bound: None,
        surface_samples: None,
        error_estimate_m: None,
        drive_work_j: None,
        reactions: None,
        audit: None,
        stages: StageHashes {
            candidate_pairs: Hash::of(b"pairs").short(),
            contacts: Hash::of(b"contacts").short(),
            forces: Hash::of(&step.to_le_bytes()).short(),
            state: state_hash.short(),
        },
        state_hash,
        chained_hash,
    }
}

/// Flips the bit in the file, where nothing but a checksum tells.
fn flip_in_file(path: &Path) {
    let state = {
        let log = Log::open(path).expect("a log");
        log.state_message(FLIPPED.0).expect("whole").expect("a state").bytes.into_owned()
    };
    let bytes = std::fs::read(path).expect("a file");
    // The hash in its header is found once.
    let at = bytes.windows(56).position(|window| window == &state[..56]).expect("the state lies in the file");
    let place = (at + 64 + 104 * FLIPPED.1 + FLIPPED.2) as u64;
    let mut file = File::options().read(true).write(true).open(path).expect("a file");
    let mut byte = [0];
    file.seek(SeekFrom::Start(place)).expect("a place");
    file.read_exact(&mut byte).expect("a byte");
    file.seek(SeekFrom::Start(place)).expect("a place");
    file.write_all(&[byte[0] ^ 1]).expect("a disk");
}

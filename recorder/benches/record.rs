//! How fast states are written and read: `cargo bench -p recorder`. Prints; the only thing that can fail is
//! that the file read back is not the one that was written.

use recorder::{Kind, Log, LogWriter, Message};
use schemas::plan::Plan;
use schemas::scene::{Scene, SceneRecord};
use schemas::state::{BodyState, StateHeader};
use schemas::step::{StageHashes, StepRecord};
use schemas::{Hash, chain, log_time_ns, state};
use std::time::Instant;

const RINGS: u32 = 50;
const STEPS: u64 = 20_000;

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
    let messages = messages(scene);
    let bytes: usize = messages.iter().map(|message| message.bytes.len()).sum();
    let megabytes = bytes as f64 / 1e6;
    println!("{RINGS} rings, {STEPS} steps, {megabytes:.1} MB of messages, in memory");
    for _ in 0..3 {
        let start = Instant::now();
        let mut writer = LogWriter::create(Vec::with_capacity(2 * bytes), false).expect("memory");
        for message in &messages {
            writer.write(message).expect("a valid message");
        }
        let (file, _) = writer.finish().expect("memory");
        let write_s = start.elapsed().as_secs_f64();
        let hash = Hash::of(&file).short();
        let start = Instant::now();
        let log = Log::from_bytes("bench", file).expect("a log");
        assert_eq!(log.count(Kind::Step) as u64, STEPS + 1);
        let read: usize = log.messages().map(|message| message.expect("whole").bytes.len()).sum();
        assert_eq!(read, bytes);
        let read_s = start.elapsed().as_secs_f64();
        let start = Instant::now();
        log.check(&mut |_, _| {}).expect_err("it has no end record");
        let check_s = start.elapsed().as_secs_f64();
        println!(
            "write {:.0} MB/s, read {:.0} MB/s, check everything {:.0} MB/s, file {hash}",
            megabytes / write_s,
            megabytes / read_s,
            megabytes / check_s
        );
    }
}

fn messages(scene: Scene) -> Vec<Message<'static>> {
    let record = SceneRecord::new(scene, Plan::default());
    let mut messages = vec![Message::new(Kind::Scene, 0, serde_json::to_vec(&record).expect("JSON"))];
    let mut chained_hash = Hash::default();
    for step in 0..=STEPS {
        let sim_time_s = step as f64 * 0.001;
        let value = |ring: u32| f64::from(ring) * 0.1 + sim_time_s / 3.0;
        let body = |ring| BodyState {
            position_m: [value(ring); 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
            linear_velocity_m_per_s: [value(ring); 3],
            angular_velocity_rad_per_s: [value(ring); 3],
        };
        let bodies: Vec<_> = (0..RINGS).map(body).collect();
        let mut bytes = Vec::new();
        let header = StateHeader { step, sim_time_s, ..Default::default() };
        let state_hash = state::encode(&header, &bodies, &[], &mut bytes);
        chained_hash = chain(&chained_hash, &state_hash);
        let short = || state_hash.short();
        let stages =
            StageHashes { candidate_pairs: short(), contacts: short(), forces: short(), state: short() };
        let record = StepRecord {
            step,
            sim_time_s,
            candidate_pairs: 49,
            contacts: 49,
            kinetic_energy_j: value(1),
            gravity_energy_j: value(2),
            contact_energy_j: value(3),
            dissipated_energy_j: value(4),
            penetration_m: 1e-4,
            penetration_beyond_bound: None,
            surface_samples: None,
            error_estimate_m: None,
            drive_work_j: None,
            reactions: None,
            audit: None,
            stages,
            state_hash,
            chained_hash,
        };
        let time_ns = log_time_ns(sim_time_s);
        messages.push(Message::new(Kind::State, time_ns, bytes));
        messages.push(Message::new(Kind::Step, time_ns, serde_json::to_vec(&record).expect("JSON")));
    }
    messages
}

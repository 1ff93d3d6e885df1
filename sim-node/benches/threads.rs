//! What threads and the plan's leaving-out are worth, on one and the same hanging sheet.
//!
//! `cargo bench -p sim-node --bench threads` prints the best of a few rounds, taken in turn so that a busy
//! machine hits all alike: nanoseconds of wall time for a ring and step, the ratio to the first case, and the
//! state hash at the end, which has to be the same for all cases of a sheet.

use schemas::scene::Scene;
use schemas::state;
use sim_node::{Model, Records, Scratch, State, evaluate, step};
use std::time::Instant;

/// Rounds of each case; the best counts.
const ROUNDS: usize = 5;

/// A European 4-in-1 sheet whose first row is pinned, with gravity in its plane; undamped, so that damping is
/// among what can be left out.
fn hang(rows: u32, columns: u32) -> String {
    let pins: Vec<String> = (0..columns).map(|column| format!("[0, {column}]")).collect();
    format!(
        r#"
        [time]
        duration_s = 10.0
        time_step_s = 1e-3
        [forces]
        gravity_m_per_s2 = [0.0, 9.81, 0.0]
        [material.wire]
        line_stiffness_n_per_m2 = 3.8e5
        damping_s_per_m = 0.0
        [[weave]]
        pattern = "european-4-in-1"
        rows = {rows}
        columns = {columns}
        major_radius_m = 1.0
        minor_radius_m = 0.18
        ring_mass_kg = 0.63956
        material = "wire"
        pins = [{}]
        "#,
        pins.join(", ")
    )
}

/// How to run a sheet.
struct Case {
    name: &'static str,
    everything_on: bool,
    threads: usize,
    records: bool,
}

fn compare(rows: u32, columns: u32, warm_up: u64, steps: u64, cases: &[Case]) {
    let scene = Scene::parse(&hang(rows, columns), &[]).expect("the scene is right");
    let mut best = vec![f64::INFINITY; cases.len()];
    let mut hashes = vec![String::new(); cases.len()];
    let rings = f64::from(rows) * f64::from(columns);
    let (needed, _) = Model::compile(&scene).expect("the scene can be simulated");
    let mut start = State::initial(&needed);
    let mut scratch = Scratch::new(&needed, 2);
    for _ in 0..warm_up {
        step(&needed, &mut start, &mut scratch).expect("the run goes on");
    }
    let (everything, _) = Model::compile_everything_on(&scene).expect("the scene can be simulated");
    for _ in 0..ROUNDS {
        for (index, case) in cases.iter().enumerate() {
            let model = if case.everything_on { &everything } else { &needed };
            let mut state = start.clone();
            let mut scratch = Scratch::new(model, case.threads);
            let mut records = Records::after(schemas::Hash::default());
            evaluate(model, &state, &mut scratch);
            let begin = Instant::now();
            for _ in 0..steps {
                step(model, &mut state, &mut scratch).expect("the run goes on");
                if case.records {
                    records.record(model, &state, &scratch);
                }
            }
            let time = begin.elapsed().as_secs_f64() * 1e9 / (rings * steps as f64);
            best[index] = if time < best[index] { time } else { best[index] };
            let mut message = Vec::new();
            let hash = state::encode(&state.header(), &state.bodies, &state.contacts, &mut message);
            hashes[index] = hash.short();
        }
    }
    for (index, case) in cases.iter().enumerate() {
        let ratio = best[index] / best[0];
        println!(
            "{rows}x{columns} from step {warm_up}, {steps} steps, {:28} {:8.1} ns, {ratio:5.2} of the first, hash {}",
            case.name, best[index], hashes[index]
        );
        assert_eq!(hashes[index], hashes[0], "the same bits");
    }
}

fn main() {
    let case = |name, everything_on, threads, records| Case { name, everything_on, threads, records };
    let threads = [case("one thread", false, 1, false), case("two threads", false, 2, false)];
    compare(32, 32, 0, 400, &threads);
    compare(32, 32, 1000, 400, &threads);
    compare(32, 3200, 600, 20, &threads);
    let planned = case("as planned", false, 1, false);
    let parts = [planned, case("everything on", true, 1, false), case("recorded", false, 1, true)];
    compare(32, 32, 1000, 400, &parts);
}

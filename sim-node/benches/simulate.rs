//! Ring-steps per second, on one thread and on all, with and without records.
//!
//! `cargo bench -p sim-node` prints one line a case: rings, steps, million ring-steps per second, and the
//! state hash at the end. Times depend on the machine; the hash does not. A large hanging sheet is hardly
//! loaded while it begins to fall, so one case is timed from the third second on. `-- WORD` runs the cases whose
//! names hold the word.

use schemas::scene::Scene;
use schemas::{Hash, state};
use sim_node::{Model, Records, Scratch, State, evaluate, step};
use std::time::Instant;

/// A European 4-in-1 sheet whose first row is pinned, with gravity in its plane: every link is loaded.
fn hang(rows: u32, columns: u32) -> String {
    hang_with(rows, columns, 5e-4, 1.4e6)
}

/// The same at a time step and a stiffness.
fn hang_with(rows: u32, columns: u32, time_step: f64, stiffness: f64) -> String {
    let pins: Vec<String> = (0..columns).map(|column| format!("[0, {column}]")).collect();
    format!(
        r#"
        [time]
        duration_s = 10.0
        time_step_s = {time_step}
        [forces]
        gravity_m_per_s2 = [0.0, 9.81, 0.0]
        [material.wire]
        line_stiffness_n_per_m2 = {stiffness}
        damping_s_per_m = 0.3
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

fn run(name: &str, text: &str, warm_up: u64, steps: u64, threads: usize, records: bool) {
    // Words after `--` choose the cases whose names hold one of them.
    let mut chosen = std::env::args().skip(1).filter(|word| !word.starts_with('-')).peekable();
    if chosen.peek().is_some() && !chosen.any(|word| format!("{name}, {threads} threads").contains(&word)) {
        return;
    }
    let scene = Scene::parse(text, &[]).expect("the scene is right");
    let (model, _) = Model::compile(&scene).expect("the scene can be simulated");
    let mut state = State::initial(&model);
    let mut scratch = Scratch::new(&model, threads);
    let mut diary = Records::after(Hash::default());
    evaluate(&model, &state, &mut scratch);
    for _ in 0..warm_up {
        step(&model, &mut state, &mut scratch).expect("the run goes on");
    }
    let mut contacts = 0;
    let mut penetration_m: f64 = 0.0;
    let start = Instant::now();
    for _ in 0..steps {
        step(&model, &mut state, &mut scratch).expect("the run goes on");
        if records {
            let record = diary.record(&model, &state, &scratch);
            contacts += record.contacts;
            if record.penetration_m > penetration_m {
                penetration_m = record.penetration_m;
            }
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    let ring_steps = (model.ring_count() as u64 * steps) as f64;
    let mut message = Vec::new();
    let hash = state::encode(&state.header(), &state.bodies, &state.contacts, &mut message);
    print!("{name:16} {:5} rings {steps:6} steps {threads} threads", model.ring_count());
    print!(" {:7.3} M ring-steps/s, hash {}", ring_steps / seconds * 1e-6, hash.short());
    if records {
        let per_ring = contacts as f64 / ring_steps;
        print!(", recorded: {per_ring:.2} contacts a ring, penetration {penetration_m:.5} m");
    }
    println!();
}

fn main() {
    let drop = include_str!("../../scenes/drop.toml");
    for records in [false, true] {
        run("drop", drop, 0, 4000, 1, records);
        run("hang 16x16", &hang(16, 16), 0, 4000, 1, records);
        run("hang 32x32", &hang(32, 32), 0, 2000, 1, records);
        run("hang 32x32", &hang(32, 32), 0, 2000, 2, records);
        run("the same, 3 s on", &hang(32, 32), 6000, 1000, 1, records);
        run("the same, 3 s on", &hang(32, 32), 6000, 1000, 2, records);
    }
    // Steps of 1 ms, as stiff as they allow; the large sheet after 1.5 s, when it is loaded.
    let sheet = hang_with(32, 32, 1e-3, 3.8e5);
    run("hang 32x32, 1 ms", &sheet, 0, 1000, 1, false);
    run("hang 32x32, 1 ms, 3 s on", &sheet, 3000, 1000, 1, false);
    run("hang 32x32, 1 ms, 3 s on", &sheet, 3000, 1000, 2, false);
    run("hang 32x3200, 1 ms, 1.5 s on", &hang_with(32, 3200, 1e-3, 3.8e5), 1500, 100, 1, false);
}

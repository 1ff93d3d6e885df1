//! How deep wires press in, and at what price: 4 s of the 32x32 sheet that hangs from its first row.
//!
//! `cargo bench -p sim-node --bench hang` prints for some steps, stiffnesses and dampings the deepest contact of any
//! step as a share of the wires, links that are left, energy from nowhere over energy released, and microseconds
//! of one thread for each ring and simulated second: of the steps alone, and with the records that a run makes.
//! Times depend on the machine, the rest does not.

use schemas::Hash;
use schemas::scene::Scene;
use sim_node::{Model, Records, Scratch, State, audit, evaluate, step};
use std::time::{Duration, Instant};

/// Time step (s), line stiffness (N/m^2), damping (s/m), penetration for which the bound is stated.
const CASES: [(f64, f64, f64, f64); 10] = [
    (5e-4, 1.4e6, 0.3, 0.05),
    (5e-4, 1.4e6, 3.0, 0.05),
    (5e-4, 3e6, 3.0, 0.0125),
    (5e-4, 5e6, 3.0, 0.004),
    (4e-4, 3e6, 0.5, 0.03),
    (4e-4, 3e6, 3.0, 0.03),
    (4e-4, 5e6, 0.5, 0.01),
    (4e-4, 5e6, 3.0, 0.01),
    (3e-4, 5e6, 3.0, 0.03),
    (2.5e-4, 5e6, 3.0, 0.05),
];

fn scene(time_step_s: f64, stiffness: f64, damping: f64, penetration: f64) -> Scene {
    let pins: Vec<String> = (0..32).map(|column| format!("[0, {column}]")).collect();
    let text = format!(
        r#"
        [time]
        duration_s = 4.0
        time_step_s = {time_step_s:?}
        frames_per_second = 50.0
        [method]
        stability_penetration = {penetration:?}
        [forces]
        gravity_m_per_s2 = [0.0, 9.81, 0.0]
        [material.wire]
        line_stiffness_n_per_m2 = {stiffness:?}
        damping_s_per_m = {damping:?}
        [[weave]]
        pattern = "european-4-in-1"
        rows = 32
        columns = 32
        major_radius_m = 1.0
        minor_radius_m = 0.18
        ring_mass_kg = 0.63956
        material = "wire"
        pins = [{}]
        "#,
        pins.join(", ")
    );
    Scene::parse(&text, &[]).expect("the scene is right")
}

fn run((time_step_s, stiffness, damping, penetration): (f64, f64, f64, f64)) {
    print!("{time_step_s:7.1e} s {stiffness:8.1e} N/m^2 {damping:4} s/m, {:4.1} %", 100.0 * penetration);
    let (model, _) = match Model::compile(&scene(time_step_s, stiffness, damping, penetration)) {
        Ok(compiled) => compiled,
        Err(error) => return println!(": {error}"),
    };
    let (mut state, mut scratch) = (State::initial(&model), Scratch::new(&model, 1));
    let mut records = Records::after(Hash::default());
    evaluate(&model, &state, &mut scratch);
    let mut record = records.record(&model, &state, &scratch);
    let energy = |record: &schemas::step::StepRecord| {
        record.kinetic_energy_j
            + record.gravity_energy_j
            + record.contact_energy_j
            + record.dissipated_energy_j
    };
    let (start, gravity) = (energy(&record), record.gravity_energy_j);
    let (mut deepest, mut beyond, mut drift, mut released): (f64, u64, f64, f64) = (0.0, 0, 0.0, 0.0);
    let (mut steps_alone, mut recorded) = (Duration::ZERO, Duration::ZERO);
    for _ in 0..model.time().step_count() {
        let before = Instant::now();
        if let Err(stop) = step(&model, &mut state, &mut scratch) {
            return println!(": {stop}");
        }
        let between = Instant::now();
        record = records.record(&model, &state, &scratch);
        steps_alone += between - before;
        recorded += between.elapsed();
        if let Err(stop) = records.check_energy(&record) {
            return println!(": {stop}");
        }
        let share = record.penetration_m / 0.36;
        deepest = if share > deepest { share } else { deepest };
        beyond += u64::from(record.penetration_beyond_bound.is_some());
        let off = (energy(&record) - start).abs();
        drift = if off > drift { off } else { drift };
        let fallen = gravity - record.gravity_energy_j;
        released = if fallen > released { fallen } else { released };
    }
    let links = audit(&model, &state);
    let unit = 1e6 / (model.ring_count() as f64 * 4.0);
    println!(
        ": {:.2} % deep, {beyond} steps beyond the bound, {} of {} links, drift {:.1e}, {:.0} us, {:.0} us with records",
        100.0 * deepest,
        links.links_intact,
        links.links,
        drift / released,
        unit * steps_alone.as_secs_f64(),
        unit * (steps_alone + recorded).as_secs_f64(),
    );
}

fn main() {
    CASES.into_iter().for_each(run);
}

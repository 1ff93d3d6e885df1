//! The contact laws side by side: what a force costs and how wrong it is, and ring-steps per second.
//!
//! `cargo bench -p sim-node --bench laws`. First two crossed linked rings, 5 % of the wire deep: relative error (root of the
//! mean square over steps) and time of one evaluation of forces, most of which is the pair's. Then the 5 by 10 sheet,
//! hanging and loaded, with the default law on the same scene beside. Times depend on the machine; errors and hashes
//! do not.

use schemas::scene::Scene;
use schemas::state;
use sim_node::{Model, Scratch, State, evaluate, step};
use std::time::Instant;

const MINOR: f64 = 0.18;
const DEPTH: f64 = 0.05;
/// Converged force over stiffness at that depth (m^3).
const FORCE: f64 = 5.680674850e-05;
const STIFFNESS: f64 = 1e6;

fn surface(sampler: &str, samples: u32, average: &str) -> String {
    format!(
        "contact_law = \"surface-integral\"\nsurface = {{ sampler = \"{sampler}\", samples = {samples}, average = \"{average}\" }}"
    )
}

fn model(text: &str) -> Model {
    let scene = Scene::parse(text, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"));
    Model::compile(&scene).unwrap_or_else(|error| panic!("{error}")).0
}

fn crossed(method: &str) -> String {
    let ring = |x: f64, rest: &str| {
        format!(
            "[[ring]]\nmajor_radius_m = 1.0\nminor_radius_m = {MINOR:?}\nmass_kg = 1.0\nmaterial = \"wire\"
            position_m = [{x:?}, 0.0, 0.0]\n{rest}\n"
        )
    };
    format!(
        "[time]\nduration_s = 1.0\ntime_step_s = 1e-6\n[method]\n{method}\n[material.wire]
        surface_stiffness_n_per_m3 = {STIFFNESS:?}\n{}{}",
        ring(0.0, "pinned = true"),
        ring(1.0, "orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]")
    )
}

/// The force on the second ring in a step, and with `times` evaluations the nanoseconds of one.
fn pair(name: &str, method: &str, repetitions: u64, force: f64) {
    if left_out("pair", name) {
        return;
    }
    let model = model(&crossed(method));
    let mut state = State::initial(&model);
    let mut scratch = Scratch::new(&model, 1);
    let pose = state.bodies[1];
    let mut squares = 0.0;
    for number in 0..repetitions {
        state.bodies[1] = pose;
        state.bodies[1].position_m[0] = 2.0 - 2.0 * MINOR + DEPTH * MINOR;
        state.step = number;
        step(&model, &mut state, &mut scratch).expect("the run goes on");
        let error = -state.bodies[1].linear_velocity_m_per_s[0] / 1e-6 / force - 1.0;
        squares += error * error;
    }
    let samples = if method.contains("samples") { model.method().surface.samples } else { 0 };
    let count = 40_000_000 / (200 + 20 * u64::from(samples));
    let start = Instant::now();
    let before = seconds(&start);
    for _ in 0..count {
        evaluate(&model, &state, &mut scratch);
    }
    let each = (seconds(&start) - before) / count as f64;
    let error =
        if force > 0.0 { format!("{:.1e}", (squares / repetitions as f64).sqrt()) } else { "-".to_owned() };
    println!("pair  {name:28} error {error:>8}, {:9.0} ns", each * 1e9);
}

fn sheet(name: &str, method: &str, integrator: &str, steps: u64) {
    if left_out("sheet", name) {
        return;
    }
    // Damping is explicit in rk4, and its bound counts it.
    let time_step_s = if integrator == "rk4" { 1e-4 } else { 5e-4 };
    let pins: Vec<String> = (0..5).map(|column| format!("[0, {column}]")).collect();
    let text = format!(
        "[time]\nduration_s = 10.0\ntime_step_s = {time_step_s:?}\n[method]\nintegrator = \"{integrator}\"\n{method}
        [forces]\ngravity_m_per_s2 = [0.0, 9.81, 0.0]
        [material.wire]\nline_stiffness_n_per_m2 = 1e6\npoint_stiffness_n_per_m = 1e5\nsurface_stiffness_n_per_m3 = 4e6
        damping_s_per_m = 0.3
        [[weave]]\npattern = \"european-4-in-1\"\nrows = 10\ncolumns = 5\nmajor_radius_m = 1.0
        minor_radius_m = {MINOR:?}\nring_mass_kg = 0.64\nmaterial = \"wire\"\npins = [{}]",
        pins.join(", ")
    );
    let model = model(&text);
    let mut state = State::initial(&model);
    let mut scratch = Scratch::new(&model, 1);
    let warm_up = if method.contains("samples") { 1000 } else { 4000 };
    for _ in 0..warm_up {
        step(&model, &mut state, &mut scratch).expect("the run goes on");
    }
    let start = Instant::now();
    let before = seconds(&start);
    for _ in 0..steps {
        step(&model, &mut state, &mut scratch).expect("the run goes on");
    }
    let rate = (model.ring_count() as u64 * steps) as f64 / (seconds(&start) - before);
    let hash = state::encode(&state.header(), &state.bodies, &state.contacts, &mut Vec::new());
    println!("sheet {name:28} {integrator:6} {:10.0} ring-steps/s, hash {}", rate, hash.short());
}

/// Whether a word on the command line leaves a line out: what has it in its name is measured.
fn left_out(kind: &str, name: &str) -> bool {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let name = format!("{kind} {name}");
    !words.is_empty() && !words.iter().any(|word| name.contains(word.as_str()))
}

/// Seconds of processor time, so that other work on the machine counts little; of wall time where there is no such clock.
fn seconds(start: &Instant) -> f64 {
    let scheduled = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = scheduled.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

fn main() {
    pair("centreline-arc", "", 1, 0.0);
    pair("centreline-minima", "contact_law = \"centreline-minima\"", 1, 0.0);
    pair("quadrature", &surface("quadrature", 1, "area"), 1, STIFFNESS * FORCE);
    for samples in [16, 64, 256, 1024, 4096, 16384] {
        for sampler in ["uniform-angles", "uniform", "stratified", "sobol", "patch"] {
            let repetitions = if samples > 2000 { 16 } else { 64 };
            pair(
                &format!("{sampler} {samples}"),
                &surface(sampler, samples, "area"),
                repetitions,
                STIFFNESS * FORCE,
            );
        }
    }
    sheet("centreline-arc", "", "verlet", 10_000);
    sheet("centreline-minima", "contact_law = \"centreline-minima\"", "verlet", 10_000);
    sheet("quadrature", &surface("quadrature", 1, "area"), "verlet", 10_000);
    for integrator in ["verlet", "rk4"] {
        for sampler in ["uniform-angles", "uniform", "stratified", "sobol"] {
            sheet(&format!("{sampler} 1000"), &surface(sampler, 1000, "area"), integrator, 1000);
        }
    }
    sheet("patch 64", &surface("patch", 64, "area"), "verlet", 5000);
    sheet("uniform-angles 1000, all", &surface("uniform-angles", 1000, "all-samples"), "rk4", 1000);
}

//! Contact law, integrator and scene: speed, penetration, energy, links, side by side.
//!
//! `cargo bench -p sim-node --bench table` prints a Markdown table; words on the command line choose lines that have
//! all of them. Each line is run twice: once for the time of the steps alone, once with a record of each step. Times
//! depend on the machine; all else does not.

use schemas::Hash;
use schemas::scene::{Integrator, Scene};
use sim_node::{Model, Records, Scratch, State, check_audit, evaluate, step};
use std::time::Instant;

/// A scene: its name, simulated time (s), step of the implicit methods (s; explicit ones take half their bound,
/// `dopri5` a frame), the law's stiffness (N/m^2) and the rest.
struct Case {
    name: &'static str,
    duration_s: f64,
    implicit_s: f64,
    stiffness: f64,
    rest: String,
}

/// A line that would take longer is cut off there (s).
const LONGEST_S: f64 = 3.0;

const LAWS: [(&str, &str); 4] = [
    ("centreline-arc", "contact_law = \"centreline-arc\""),
    ("centreline-minima", "contact_law = \"centreline-minima\""),
    ("surface, quadrature", "contact_law = \"surface-integral\""),
    (
        "surface, uniform",
        "contact_law = \"surface-integral\"\nsurface = { sampler = \"uniform\", samples = 1000, average = \"area\" }",
    ),
];

fn ring(position: &str, rest: &str) -> String {
    format!(
        "[[ring]]\nmajor_radius_m = 1.0\nminor_radius_m = 0.18\nmass_kg = 0.64\nmaterial = \"wire\"\n\
         position_m = {position}\n{rest}\n"
    )
}

fn sheet(rows: u32, columns: u32, rest: &str) -> String {
    format!(
        "[[weave]]\npattern = \"european-4-in-1\"\nrows = {rows}\ncolumns = {columns}\nmajor_radius_m = 1.0\n\
         minor_radius_m = 0.18\nring_mass_kg = 0.64\nmaterial = \"wire\"\n{rest}\n"
    )
}

fn cases() -> Vec<Case> {
    let crossed = "orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]";
    let pins: Vec<String> = (0..8).map(|column| format!("[0, {column}]")).collect();
    let two = ring("[0.0, 0.0, 0.0]", "pinned = true") + &ring("[0.0, 1.2, 0.0]", crossed);
    let case = |name, duration_s, implicit_s, stiffness, rest| Case {
        name,
        duration_s,
        implicit_s,
        stiffness,
        rest,
    };
    vec![
        case("two rings", 4.0, 5e-3, 1e6, two.replace("[0.0, 1.2", "[1.2, 0.0")),
        case("hang 8x8", 1.0, 5e-3, 1e6, sheet(8, 8, &format!("pins = [{}]", pins.join(", ")))),
        case(
            "drop 6x6",
            1.0,
            5e-3,
            1e6,
            sheet(6, 6, "rotation_rad = [0.0, 1.5707963267948966, 0.0]\nposition_m = [4.0, 0.0, 0.0]")
                + "[[sphere]]\nradius_m = 2.0\nmass_kg = 1.0\nmaterial = \"wire\"\nposition_m = [8.0, 3.5, -3.5]\npinned = true\n",
        ),
        case(
            "chain of 12",
            1.0,
            5e-3,
            1e6,
            "[[weave]]\npattern = \"chain\"\nrows = 1\ncolumns = 12\nmajor_radius_m = 1.0\nminor_radius_m = 0.18\n\
             ring_mass_kg = 0.64\nmaterial = \"wire\"\npins = [[0, 0], [0, 11]]\nrotation_rad = [0.0, 0.0, 1.5707963267948966]\n"
                .to_owned(),
        ),
        case("stiff pair", 1.0, 1e-3, 1e9, two.replace("[0.0, 1.2", "[1.2, 0.0")),
    ]
}

fn text(case: &Case, law: &str, integrator: Integrator) -> String {
    let k = case.stiffness;
    let time_step_s = match integrator {
        Integrator::Verlet | Integrator::Rk4 => "\"auto\"".to_owned(),
        Integrator::Dopri5 => "0.02".to_owned(),
        Integrator::BackwardEuler | Integrator::EnergyDecaying => format!("{:?}", case.implicit_s),
    };
    let (duration, point, surface) = (case.duration_s, 0.1 * k, 4.0 * k);
    format!(
        "[time]\nduration_s = {duration:?}\ntime_step_s = {time_step_s}\nframes_per_second = 50.0\n[method]\n\
         integrator = \"{}\"\n{law}\n[forces]\ngravity_m_per_s2 = [9.81, 0.0, 0.0]\n[material.wire]\n\
         line_stiffness_n_per_m2 = {k:?}\npoint_stiffness_n_per_m = {point:?}\nsurface_stiffness_n_per_m3 = {surface:?}\n\
         damping_s_per_m = 0.3\n{}",
        integrator.name(),
        case.rest
    )
}

/// What a run was like, or why it was not.
fn measure(text: &str) -> Result<String, String> {
    let scene = Scene::parse(text, &[]).map_err(|error| error.to_string())?;
    let (model, _) = Model::compile(&scene).map_err(|error| error.to_string())?;
    let count = model.time().step_count();
    let (mut spent, mut runs, mut stop) = (0.0, 0.0, None);
    let (mut done, mut evaluations) = (0, 0);
    // The processor's clock is coarse: again and again until it has something to tell.
    while spent < 0.1 {
        let mut state = State::initial(&model);
        let mut scratch = Scratch::new(&model, 1);
        let start = Instant::now();
        let before = seconds(&start);
        for _ in 0..count {
            if let Err(error) = step(&model, &mut state, &mut scratch) {
                stop = Some(error.to_string());
                break;
            }
            if start.elapsed().as_secs_f64() > LONGEST_S {
                break;
            }
        }
        spent += seconds(&start) - before;
        runs += 1.0;
        (done, evaluations) = (state.step, scratch.force_evaluations());
    }
    let spent = spent / runs;
    let mut state = State::initial(&model);
    let mut scratch = Scratch::new(&model, 1);
    let mut records = Records::after(Hash::default());
    evaluate(&model, &state, &mut scratch);
    let first = records.record(&model, &state, &scratch);
    let total = |r: &schemas::step::StepRecord| {
        r.kinetic_energy_j + r.gravity_energy_j + r.contact_energy_j + r.dissipated_energy_j
    };
    let (mut penetration, mut gain, mut loss, mut scale, mut links) = (0.0, 0.0, 0.0, 1e-300, String::new());
    for _ in 0..done {
        if step(&model, &mut state, &mut scratch).is_err() {
            break;
        }
        let record = records.record(&model, &state, &scratch);
        let exchanged = record.kinetic_energy_j
            + record.contact_energy_j
            + (record.gravity_energy_j - first.gravity_energy_j).abs();
        let drift = total(&record) - total(&first);
        let largest = |kept: &mut f64, value: f64| {
            if value > *kept {
                *kept = value;
            }
        };
        largest(&mut penetration, record.penetration_m);
        largest(&mut scale, exchanged);
        largest(&mut gain, drift);
        largest(&mut loss, -drift);
        if let Some(audit) = record.audit {
            links = format!("{}/{}", audit.links_intact, audit.links);
            if check_audit(&model, &state, &audit).is_err() {
                stop = Some(format!("broken at {:.2} s", state.sim_time_s));
                break;
            }
        }
    }
    let row = format!(
        "{:.1e} | {:.2} | {:.2e} | {:.3} | {:.3} | +{:.1e} −{:.1e} | {} | {:.1}",
        model.time().time_step_s,
        done as f64 * model.time().time_step_s,
        model.ring_count() as f64 * done as f64 / spent,
        spent / (done as f64 * model.time().time_step_s),
        penetration / 0.0036,
        gain / scale,
        loss / scale,
        links,
        evaluations as f64 / done as f64
    );
    Ok(match stop {
        Some(reason) => format!("{row} | {reason} |"),
        None => format!("{row} | |"),
    })
}

/// Seconds of processor time, so that other work on the machine counts little; of wall time where there is no such clock.
fn seconds(start: &Instant) -> f64 {
    let scheduled = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = scheduled.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let first = |text: &str| text.split(&[':', ';'][..]).next().unwrap_or_default().to_owned();
    println!(
        "| scene | law | integrator | step (s) | simulated (s) | ring-steps/s | CPU s per s | penetration (% of 2 r) | energy gained, lost | links | evaluations a step | |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for case in cases() {
        for (name, law) in LAWS {
            for integrator in Integrator::ALL {
                let line = format!("| {} | {name} | {} |", case.name, integrator.name());
                // Where forces jump, and be it between two orders of a quadrature, an adaptive method follows each jump down to
                // its shortest step.
                let jumps = integrator == Integrator::Dopri5 && name != "centreline-arc";
                if !words.iter().all(|word| line.contains(word.as_str())) {
                    continue;
                }
                if jumps {
                    println!("{line} left out: forces jump |");
                } else {
                    match measure(&text(&case, law, integrator)) {
                        Ok(row) => println!("{line} {row}"),
                        Err(reason) => println!("{line} refused: {} |", first(&reason)),
                    }
                }
            }
        }
    }
}

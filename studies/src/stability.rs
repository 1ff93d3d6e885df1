//! Where runs blow up, against the predicted limit.

use crate::Effort;
use crate::report::{Axis, Figure, Map, Section};
use crate::timing::compile;
use schemas::scene::Integrator;
use sim_node::{Model, Scratch, State, audit, check_audit, mechanical_energy, step};

/// Outcomes, from good to bad.
const OUTCOMES: [&str; 4] = ["stable", "inaccurate", "unstable", "link lost"];

/// A stable run whose largest energy is above that of the start by this share of the energy exchanged is called inaccurate.
const INACCURATE: f64 = 0.02;
/// One whose energy grows beyond this many times it is called unstable.
const UNSTABLE: f64 = 2.0;

/// No run is shorter (s): the rings of the slowest scene meet after 0.17 s.
const SHORTEST_S: f64 = 0.4;

/// A kind of map: what changes upwards, and the scene.
struct Kind {
    id: &'static str,
    title: &'static str,
    caption: &'static str,
    label: &'static str,
    /// The values upwards: the first, and the factor from one to the next.
    values: (f64, f64),
    scene: fn(f64) -> Setting,
}

/// A scene without time and method.
struct Setting {
    rest: String,
    /// A time in which the fastest contact swings by a radian (s): the map's steps go about it.
    scale_s: f64,
}

const KINDS: [Kind; 4] = [
    Kind {
        id: "stiffness",
        title: "Stiffness and time step",
        caption: "A ring dropped into a pinned one, undamped. The softest material lets it sink in far deeper than the bound is stated for.",
        label: "line stiffness (N/m^2)",
        values: (1e3, 10.0),
        scene: |k| linked(k, 0.0),
    },
    Kind {
        id: "damping",
        title: "Damping and time step",
        caption: "The same with k 1e5 N/m^2 and damping along the line.",
        label: "line damping (N s/m^2)",
        values: (10.0, 4.0),
        scene: |c| linked(1e5, c),
    },
    Kind {
        id: "mass-ratio",
        title: "Mass ratio and time step",
        caption: "Two linked free rings that fly apart, of which the one is lighter; k 1e5 N/m^2.",
        label: "mass ratio",
        values: (1.0, 10.0),
        scene: |ratio| apart(1e5, ratio),
    },
    Kind {
        id: "speed",
        title: "Speed and time step",
        caption: "The same two rings with equal masses, k 1e5 N/m^2: how far the faster ring presses in, and at last through, is a matter of speed.",
        label: "speed (m/s)",
        values: (0.25, 2.0),
        scene: |speed| fast(1e5, speed),
    },
];

const ACROSS: &str = "orientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]";

fn ring(mass: f64, position: [f64; 3], more: &str) -> String {
    format!(
        "[[ring]]\nmajor_radius_m = 1.0\nminor_radius_m = 0.18\nmass_kg = {mass:?}\nmaterial = \"wire\"\nposition_m = {position:?}\n{more}\n"
    )
}

/// The swing of the lightest ring on a contact arc at a depth of a twentieth of both radii.
fn swing(k: f64, mass: f64) -> f64 {
    // About 0.4 m of arc.
    (mass / (0.4 * k)).sqrt()
}

fn linked(k: f64, damping: f64) -> Setting {
    let rest = format!(
        "[forces]\ngravity_m_per_s2 = [0.0, -9.81, 0.0]\n[material.wire]\nline_stiffness_n_per_m2 = {k:?}\nline_damping_n_s_per_m2 = {damping:?}\n{}{}",
        ring(1.0, [0.0; 3], &format!("{ACROSS}\npinned = true")),
        ring(1.0, [0.1, -1.5, 0.05], "linear_velocity_m_per_s = [0.0, -1.0, 0.0]")
    );
    Setting { rest, scale_s: swing(k, 1.0) }
}

fn apart(k: f64, ratio: f64) -> Setting {
    let light = 1.0 / ratio;
    let rest = format!(
        "[material.wire]\nline_stiffness_n_per_m2 = {k:?}\n{}{}",
        ring(1.0, [0.0; 3], ACROSS),
        ring(light, [0.1, -1.3, 0.2], "linear_velocity_m_per_s = [0.3, -2.0, 0.5]")
    );
    Setting { rest, scale_s: swing(k, light / (1.0 + light)) }
}

fn fast(k: f64, speed: f64) -> Setting {
    let rest = format!(
        "[material.wire]\nline_stiffness_n_per_m2 = {k:?}\n{}{}",
        ring(1.0, [0.0; 3], ACROSS),
        ring(1.0, [0.1, -1.3, 0.2], &format!("linear_velocity_m_per_s = [0.0, -{speed:?}, 0.0]"))
    );
    Setting { rest, scale_s: swing(k, 0.5) }
}

const INTEGRATORS: [Integrator; 4] =
    [Integrator::Verlet, Integrator::Rk4, Integrator::EnergyDecaying, Integrator::BackwardEuler];

/// Parts of the work.
pub(crate) const PARTS: usize = KINDS.len() * INTEGRATORS.len();

pub(crate) fn study(effort: Effort, step: &mut dyn FnMut(&str)) -> Section {
    let mut figures = Vec::new();
    for kind in &KINDS {
        for integrator in INTEGRATORS {
            step(&format!("{}, {}", kind.title, integrator.name()));
            figures.push(Figure::Map(map(kind, integrator, effort)));
        }
    }
    Section {
        faults: Vec::new(),
        id: "stability",
        title: "Stability maps".to_owned(),
        text: vec![format!(
            "Each cell is a run of some hundred swings of the contact at a time step over the time in which the stiffest contact swings by a \
             radian. Stable: the largest energy stays within {} % of the start's, plus what is exchanged. Unstable: it grows beyond {UNSTABLE} times \
             that, or a number is not finite. The line is the bound that the program predicts before the first step, and beyond \
             which it refuses to start; here the check is off. The bound counts depths up to method.stability_penetration; an implicit \
             method has none.",
            100.0 * INACCURATE
        )],
        figures,
    }
}

fn map(kind: &Kind, integrator: Integrator, effort: Effort) -> Map {
    let (rows, columns) = (effort.pick(4, 7), effort.pick(8, 16));
    let ys: Vec<f64> =
        (0..rows).map(|row| kind.values.0 * libm::pow(kind.values.1, f64::from(row))).collect();
    let (low, high) = (0.05_f64, 8.0_f64);
    let factor = libm::pow(high / low, 1.0 / f64::from(columns - 1));
    let xs: Vec<f64> = (0..columns).map(|column| low * libm::pow(factor, f64::from(column))).collect();
    let mut cells = Vec::new();
    let mut limit = Vec::new();
    for &y in &ys {
        let setting = (kind.scene)(y);
        limit.push(bound(&setting, integrator));
        for &x in &xs {
            let (outcome, why) = outcome(&setting, integrator, x * setting.scale_s, effort);
            cells.push((
                outcome,
                format!("{} = {y:.3e}, step {:.2e} s: {why}", kind.label, x * setting.scale_s),
            ));
        }
    }
    Map {
        id: format!("stability-{}-{}", kind.id, integrator.name()),
        title: format!("{}: {}", kind.title, integrator.name()),
        caption: kind.caption.to_owned(),
        x: (Axis::log("time step over the swing's time"), xs),
        y: (Axis::log(kind.label), ys),
        cells,
        outcomes: OUTCOMES.map(str::to_owned).to_vec(),
        limit,
    }
}

fn text(setting: &Setting, integrator: Integrator, time_step_s: f64, duration_s: f64) -> String {
    format!(
        "[time]\nduration_s = {duration_s:?}\ntime_step_s = {time_step_s:?}\nframes_per_second = {:?}\n[method]\nintegrator = \"{}\"\n{}",
        1.0 / duration_s,
        integrator.name(),
        setting.rest
    )
}

/// The predicted limit over the scale; not finite where there is none.
fn bound(setting: &Setting, integrator: Integrator) -> f64 {
    let step = 0.01 * setting.scale_s;
    compile(&text(setting, integrator, step, 100.0 * step))
        .map_or(f64::NAN, |model| model.largest_time_step_s() / setting.scale_s)
}

/// The outcome's number and the reason.
fn outcome(setting: &Setting, integrator: Integrator, time_step_s: f64, effort: Effort) -> (usize, String) {
    let swings = effort.pick(300.0, 600.0) * setting.scale_s;
    // Long enough for the first touch and some more.
    let duration = if swings > SHORTEST_S { swings } else { SHORTEST_S };
    match compile(&text(setting, integrator, time_step_s, duration)) {
        Ok(model) => run(&model, effort),
        Err(reason) => (2, reason),
    }
}

fn run(model: &Model, effort: Effort) -> (usize, String) {
    let mut state = State::initial(model);
    let mut scratch = Scratch::new(model, 1);
    let (kinetic, potential) = mechanical_energy(model, &state);
    let start = kinetic + potential;
    // What can be exchanged: the motion at the start and a fall by a ring's radius.
    let scale = kinetic + model.bodies().iter().map(|body| body.mass_kg).sum::<f64>() * 1e-3;
    let (mut most, mut largest_kinetic) = (0.0, scale);
    let count = model.time().step_count();
    let looks = count / effort.pick(40, 80) + 1;
    for number in 1..=count {
        if let Err(stop) = step(model, &mut state, &mut scratch) {
            return (2, stop.to_string());
        }
        if number % looks == 0 || number == count {
            let now = audit(model, &state);
            if check_audit(model, &state, &now).is_err() {
                return (3, format!("a link is lost at step {number}"));
            }
            let (kinetic, potential) = mechanical_energy(model, &state);
            if kinetic < 100.0 * scale && kinetic > largest_kinetic {
                largest_kinetic = kinetic;
            }
            let gained = kinetic + potential - start;
            if gained > most {
                most = gained;
            }
            if !(gained < 100.0 * UNSTABLE * largest_kinetic) {
                return (2, format!("the energy grows without limit at step {number}"));
            }
        }
    }
    let share = most / largest_kinetic;
    let told = format!("energy gained {:.2} % of what is exchanged", 100.0 * share);
    (if share > UNSTABLE { 2 } else { usize::from(share > INACCURATE) }, told)
}

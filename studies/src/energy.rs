//! Energy over long runs.

use crate::Effort;
use crate::report::{Axis, Figure, Plot, Point, Section, Series, Table};
use crate::timing::compile;
use schemas::Hash;
use schemas::scene::Integrator;
use sim_node::{Model, Records, Scratch, State, evaluate, step};

/// Parts of the work.
pub(crate) const PARTS: usize = METHODS.len();

/// Integrators with the share of `verlet`'s bound that their step is.
const METHODS: [(Integrator, f64); 4] = [
    (Integrator::Verlet, 0.5),
    (Integrator::Rk4, 0.5),
    (Integrator::EnergyDecaying, 2.0),
    (Integrator::BackwardEuler, 2.0),
];

/// A sheet that falls into its first row and swings on, without damping and friction.
fn scene(integrator: Integrator, time_step_s: f64, steps: u64) -> Result<Model, String> {
    compile(&format!(
        "[time]\nduration_s = {:?}\ntime_step_s = {time_step_s:?}\nframes_per_second = {:?}\n[method]\nintegrator = \"{}\"\n[forces]\n\
         gravity_m_per_s2 = [0.0, 9.81, 0.0]\n[material.wire]\nline_stiffness_n_per_m2 = 1e5\n[[weave]]\n\
         pattern = \"european-4-in-1\"\nrows = 4\ncolumns = 4\nmajor_radius_m = 1.0\nminor_radius_m = 0.18\nring_mass_kg = 1.0\n\
         material = \"wire\"\npins = [[0, 0], [0, 1], [0, 2], [0, 3]]\n",
        time_step_s * steps as f64,
        1.0 / (time_step_s * steps as f64),
        integrator.name()
    ))
}

pub(crate) fn study(effort: Effort, part: &mut dyn FnMut(&str)) -> Section {
    let bound = scene(Integrator::Verlet, 1e-5, 10).map_or(1e-3, |model| model.largest_time_step_s());
    let duration = effort.pick(20_000.0, 1_000_000.0) * 0.5 * bound;
    let mut series = Vec::new();
    let mut rows = Vec::new();
    for (colour, (integrator, share)) in METHODS.into_iter().enumerate() {
        part(integrator.name());
        let time_step_s = share * bound;
        let steps = (duration / time_step_s) as u64;
        let ran = scene(integrator, time_step_s, steps).and_then(|model| drift(&model, 200));
        let name = integrator.name().to_owned();
        match ran {
            Ok((points, evaluations)) => {
                let at_end = points.last().map_or(f64::NAN, |point| point.1);
                let largest =
                    points.iter().map(|point| point.1.abs()).fold(0.0, |a, b| if b > a { b } else { a });
                rows.push(vec![
                    name.clone(),
                    format!("{time_step_s:.2e}"),
                    steps.to_string(),
                    evaluations.to_string(),
                    format!("{at_end:+.1e}"),
                    format!("{largest:.1e}"),
                ]);
                let points = points.into_iter().map(|(time, share)| {
                    Point::at(time, share, format!("{name}: {share:+.2e} at {time:.2} s"))
                });
                series.push(Series { name: name.clone(), colour, points: points.collect() });
            }
            Err(reason) => rows.push(vec![name, format!("{time_step_s:.2e}"), steps.to_string(), reason]),
        }
    }
    rows.iter_mut().for_each(|row| row.resize(6, String::new()));
    Section {
        faults: Vec::new(),
        id: "energy",
        title: "Energy over long runs".to_owned(),
        text: vec![
            "A sheet of 4 by 4 rings that falls into its pinned first row and swings on for ever: no damping, no friction, so its energy should \
             stay as it is."
                .to_owned(),
        ],
        figures: vec![
            Figure::Plot(Plot {
                id: "energy-drift".to_owned(),
                title: "Energy gained or lost".to_owned(),
                caption: "How far mechanical and contact energy are from their sum at the start, over the largest kinetic energy; the sign \
                          is told on hover."
                    .to_owned(),
                x: Axis::linear("simulated time (s)"),
                y: Axis::log("energy gained or lost, over the largest kinetic energy"),
                series,
                levels: Vec::new(),
            }),
            Figure::Table(Table {
                id: "energy-table".to_owned(),
                title: "Drift per method".to_owned(),
                caption: "The same simulated time with each method; shares of the largest kinetic energy.".to_owned(),
                head: ["integrator", "step (s)", "steps", "force evaluations", "at the end", "largest"].map(str::to_owned).to_vec(),
                rows,
            }),
        ],
    }
}

/// Energy gained over the largest kinetic energy, at some times, and the number of force evaluations.
fn drift(model: &Model, looks: u64) -> Result<(Vec<(f64, f64)>, u64), String> {
    let mut state = State::initial(model);
    let mut scratch = Scratch::new(model, 1);
    let mut records = Records::after(Hash::default());
    evaluate(model, &state, &mut scratch);
    let first = records.record(model, &state, &scratch);
    let total = |r: &schemas::step::StepRecord| {
        r.kinetic_energy_j + r.gravity_energy_j + r.contact_energy_j + r.dissipated_energy_j
    };
    let start = total(&first);
    let every = model.time().step_count() / looks + 1;
    let (mut points, mut largest) = (Vec::new(), 0.0);
    for number in 1..=model.time().step_count() {
        step(model, &mut state, &mut scratch).map_err(|stop| stop.to_string())?;
        if number % every == 0 {
            let record = records.record(model, &state, &scratch);
            if record.kinetic_energy_j > largest {
                largest = record.kinetic_energy_j;
            }
            points.push((state.sim_time_s, total(&record) - start));
        }
    }
    points.iter_mut().for_each(|point| point.1 /= largest);
    Ok((points, scratch.force_evaluations()))
}

//! Error against run time of the contact laws: one force between two crossed rings.

use crate::Effort;
use crate::accuracy::slope;
use crate::report::{Axis, Figure, Plot, Point, Section, Series, Table};
use crate::timing::{Times, compile};
use sim_node::{Model, Scratch, State, evaluate, step};

/// The wire's radius, that of the ring being 1 m.
const WIRE: f64 = 0.18;
const STIFFNESS: f64 = 1e6;
const TIME_STEP_S: f64 = 1e-6;

/// Depths over the wire's radius, and the force over the stiffness (m^3) there: the area-weighted integral of depth for rings of
/// R 1 m and r 0.18 m that cross at a right angle, by converged quadrature of another program, to ten digits.
const DEPTHS: [(f64, f64); 4] =
    [(0.01, 2.332392252e-06), (0.02, 9.269322302e-06), (0.05, 5.680674850e-05), (0.10, 2.197514082e-04)];

const SAMPLERS: [&str; 5] = ["uniform-angles", "uniform", "stratified", "sobol", "patch"];

/// Parts of the work.
pub(crate) const PARTS: usize = DEPTHS.len();

fn scene(method: &str) -> Result<Model, String> {
    let ring = |x: f64, more: &str| {
        format!(
            "[[ring]]\nmajor_radius_m = 1.0\nminor_radius_m = {WIRE:?}\nmass_kg = 1.0\nmaterial = \"wire\"\n\
             position_m = [{x:?}, 0.0, 0.0]\n{more}\n"
        )
    };
    compile(&format!(
        "[time]\nduration_s = 1.0\ntime_step_s = {TIME_STEP_S:?}\n[method]\n{method}\n[material.wire]\n\
         surface_stiffness_n_per_m3 = {STIFFNESS:?}\nline_stiffness_n_per_m2 = 1e6\npoint_stiffness_n_per_m = 1e5\n{}{}",
        ring(0.0, "pinned = true"),
        ring(1.0, "orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]")
    ))
}

fn surface(sampler: &str, samples: u32) -> String {
    format!(
        "contact_law = \"surface-integral\"\nsurface = {{ sampler = \"{sampler}\", samples = {samples}, average = \"area\" }}"
    )
}

/// A force of the law at a depth, sampled anew in each of some steps.
struct Force {
    /// Relative errors, one a step.
    errors: Vec<f64>,
    times: Times,
}

fn force(model: &Model, share: f64, right: f64, seeds: u64, effort: Effort) -> Result<Force, String> {
    let mut state = State::initial(model);
    let mut scratch = Scratch::new(model, 1);
    let mut errors = Vec::new();
    let pose = state.bodies[1];
    for number in 0..seeds {
        state.bodies[1] = pose;
        state.bodies[1].position_m[0] = 2.0 - 2.0 * WIRE + share * WIRE;
        state.step = number;
        step(model, &mut state, &mut scratch).map_err(|stop| stop.to_string())?;
        // From rest, one step of a unit mass.
        errors.push(-state.bodies[1].linear_velocity_m_per_s[0] / TIME_STEP_S / right - 1.0);
    }
    state.bodies[1] = pose;
    state.bodies[1].position_m[0] = 2.0 - 2.0 * WIRE + share * WIRE;
    let times = Times::of(effort.pick(3, 5), 1e-3, || {
        evaluate(model, &state, &mut scratch);
    });
    Ok(Force { errors, times })
}

/// The root of the mean square, with a 95 % interval from its own scatter.
fn root_mean_square(errors: &[f64]) -> (f64, [f64; 2]) {
    let count = errors.len() as f64;
    let squares: Vec<f64> = errors.iter().map(|error| error * error).collect();
    let mean = squares.iter().sum::<f64>() / count;
    let variance = squares.iter().map(|square| (square - mean) * (square - mean)).sum::<f64>();
    let doubt = if count > 1.0 { 1.96 * (variance / (count * (count - 1.0))).sqrt() } else { 0.0 };
    let low = mean - doubt;
    (mean.sqrt(), [(if low > 0.01 * mean { low } else { 0.01 * mean }).sqrt(), (mean + doubt).sqrt()])
}

pub(crate) fn study(effort: Effort, step: &mut dyn FnMut(&str)) -> Section {
    let seeds = effort.pick(16, 64);
    let most = effort.pick(12, 14);
    let mut figures = Vec::new();
    let mut slopes = Vec::new();
    let mut costs = Vec::new();
    for (share, integral) in DEPTHS {
        let depth = format!("{} %", 100.0 * share);
        step(&format!("forces at a depth of {depth} of the wire's radius"));
        let right = STIFFNESS * integral;
        let mut series = Vec::new();
        for (colour, sampler) in SAMPLERS.into_iter().enumerate() {
            let mut points = Vec::new();
            let mut runs = Vec::new();
            for samples in (4..=most).step_by(2).map(|power| 1_u32 << power) {
                let label = format!("{sampler}, {samples} samples");
                let found = scene(&surface(sampler, samples))
                    .and_then(|model| force(&model, share, right, seeds, effort));
                match found {
                    Ok(found) => {
                        let (error, interval) = root_mean_square(&found.errors);
                        let ns = 1e9 * found.times.median;
                        let told = format!("{label}: relative error {error:.2e}, {ns:.0} ns");
                        let mut point = Point::at(ns, error, told);
                        point.x_spread = Some([1e9 * found.times.low, 1e9 * found.times.high]);
                        point.y_interval = Some(interval);
                        runs.push((libm::log(f64::from(samples)), libm::log(error)));
                        points.push(point);
                    }
                    Err(reason) => points.push(Point::failed(f64::NAN, label, reason)),
                }
            }
            // Where hits are rare the error of few samples says little.
            let last = runs.len().saturating_sub(4);
            slopes.push(vec![
                depth.clone(),
                sampler.to_owned(),
                slope(&runs[last..]).map_or_else(|| "-".to_owned(), |slope| format!("{slope:.2}")),
            ]);
            series.push(Series { name: sampler.to_owned(), colour, points });
        }
        let quadrature =
            scene(&surface("quadrature", 1)).and_then(|model| force(&model, share, right, 1, effort));
        if let Ok(found) = quadrature {
            let (error, _) = root_mean_square(&found.errors);
            let ns = 1e9 * found.times.median;
            let told = format!("quadrature: relative error {error:.2e}, {ns:.0} ns");
            costs.push(vec![
                depth.clone(),
                "surface-integral, quadrature".to_owned(),
                format!("{ns:.0}"),
                format!("{error:.1e}"),
            ]);
            series.push(Series {
                name: "quadrature".to_owned(),
                colour: SAMPLERS.len(),
                points: vec![Point::at(ns, error, told)],
            });
        }
        for law in ["centreline-arc", "centreline-minima"] {
            let found = scene(&format!("contact_law = \"{law}\""))
                .and_then(|model| force(&model, share, right, 1, effort));
            if let Ok(found) = found {
                let ns = 1e9 * found.times.median;
                costs.push(vec![
                    depth.clone(),
                    law.to_owned(),
                    format!("{ns:.0}"),
                    "a law of its own".to_owned(),
                ]);
            }
        }
        figures.push(Figure::Plot(Plot {
            id: format!("contact-{}", (1000.0 * share) as u32),
            title: format!("Contact force, {depth} of the wire's radius deep"),
            caption: format!(
                "The force between two rings that cross at a right angle, {depth} of the wire's radius deep: relative error (root mean \
                 square over {seeds} draws, bars: 95 %) against the time of one evaluation of all forces of the scene. \
                 Uniform sampling falls as the square root of the number of samples."
            ),
            x: Axis::log("time of one evaluation (ns)"),
            y: Axis::log("relative error of the force"),
            series,
            levels: Vec::new(),
        }));
    }
    figures.push(Figure::Table(Table {
        id: "contact-slopes".to_owned(),
        title: "How the error falls with the number of samples".to_owned(),
        caption: "Slope of the logarithms over the four largest numbers of samples: -0.5 is plain Monte Carlo. At small depths hardly any sample \
                  hits, and the slope is noise."
            .to_owned(),
        head: ["depth", "sampler", "slope"].map(str::to_owned).to_vec(),
        rows: slopes,
    }));
    figures.push(Figure::Table(Table {
        id: "contact-costs".to_owned(),
        title: "The laws that do not sample".to_owned(),
        caption: "Time of one evaluation of all forces of the two rings; the laws of the centrelines integrate other springs, so their force \
                  is no approximation of the surface integral."
            .to_owned(),
        head: ["depth", "law", "ns", "relative error"].map(str::to_owned).to_vec(),
        rows: costs,
    }));
    Section {
        faults: Vec::new(),
        id: "contact",
        title: "Error against run time: contact force".to_owned(),
        text: vec![
            "The surface integral by every sampler, against its converged value, and the other laws' times beside it."
                .to_owned(),
        ],
        figures,
    }
}

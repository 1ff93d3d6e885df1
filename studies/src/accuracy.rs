//! Error against run time of the integrators.

use crate::problem::{self, Answer, ErrorOf, Problem};
use crate::report::{Axis, Figure, Plot, Point, Section, Series, Table};
use crate::timing::{compile, compile_scene, finish, time};
use crate::{Effort, NamedScene};
use schemas::scene::{Integrator, Scene};
use sim_node::{Model, State};

/// Below this an error is rounding, not the method's.
const ROUNDING: f64 = 1e-11;

/// The reference's tolerance, and how much finer than the finest run the one that checks it is.
const REFERENCE_TOLERANCE: f64 = 1e-12;
const FINER: u64 = 8;

pub(crate) fn parts(own: Option<&NamedScene>) -> usize {
    let problems = if own.is_some() { 1 } else { problem::all(1).len() };
    problems * Integrator::ALL.len()
}

pub(crate) fn study(effort: Effort, own: Option<&NamedScene>, step: &mut dyn FnMut(&str)) -> Section {
    let mut figures = Vec::new();
    let mut orders = Vec::new();
    let levels = effort.pick(4, 6);
    match own {
        Some(own) => figures.push(Figure::Plot(diagram(&OwnScene(own), effort, &mut orders, step))),
        None => {
            for problem in problem::all(levels) {
                figures.push(Figure::Plot(diagram(&problem, effort, &mut orders, step)));
            }
        }
    }
    figures.push(Figure::Table(Table {
        id: "orders".to_owned(),
        title: "Observed order, and force evaluations".to_owned(),
        caption: "Order: the slope of error over number of steps, by least squares over the four finest runs whose error is the \
                  method's and not rounding. Evaluations: of all forces, in the finest run. Smooth problems give verlet 2, rk4 4, energy-decaying 2, \
                  backward-euler 1; where contacts open and close inside a step, no method keeps more than 2."
            .to_owned(),
        head: ["problem", "integrator", "order", "smallest error", "evaluations"].map(str::to_owned).to_vec(),
        rows: orders,
    }));
    Section {
        faults: Vec::new(),
        id: "accuracy",
        title: "Error against run time: integrators".to_owned(),
        text: vec![
            "Each point is one run: a number of steps, or for dopri5 a tolerance. Down and to the left is better. A point at the upper edge \
             is a run that failed; hover over it for the reason."
                .to_owned(),
        ],
        figures,
    }
}

/// What a work-precision diagram is made of.
trait Subject {
    fn id(&self) -> &str;
    fn title(&self) -> &str;
    fn caption(&self) -> &str;
    fn duration_s(&self) -> f64;
    fn steps(&self) -> Vec<u64>;
    /// The scene with an integrator, a number of steps and a tolerance.
    fn model(&self, integrator: Integrator, steps: u64, tolerance: f64) -> Result<Model, String>;
    /// How wrong a state is, if a formula says so.
    fn formula(&self) -> Option<&ErrorOf>;
}

impl Subject for Problem {
    fn id(&self) -> &str {
        self.id
    }

    fn title(&self) -> &str {
        self.title
    }

    fn caption(&self) -> &str {
        self.caption
    }

    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    fn steps(&self) -> Vec<u64> {
        self.steps.clone()
    }

    fn model(&self, integrator: Integrator, steps: u64, tolerance: f64) -> Result<Model, String> {
        let time_step_s = self.duration_s / steps as f64;
        compile(&format!(
            "[time]\nduration_s = {:?}\ntime_step_s = {time_step_s:?}\nframes_per_second = {:?}\n[method]\nintegrator = \"{}\"\n\
             tolerance = {tolerance:?}\nabsolute_tolerance = {tolerance:?}\n{}",
            self.duration_s,
            1.0 / self.duration_s,
            integrator.name(),
            self.rest
        ))
    }

    fn formula(&self) -> Option<&ErrorOf> {
        match &self.answer {
            Answer::Formula(error) => Some(error),
            Answer::FinerRun => None,
        }
    }
}

/// The user's scene.
struct OwnScene<'a>(&'a NamedScene);

impl Subject for OwnScene<'_> {
    fn id(&self) -> &str {
        "own"
    }

    fn title(&self) -> &str {
        &self.0.name
    }

    fn caption(&self) -> &str {
        "The scene as it is, with each integrator. Error: the root mean square of all places at the end (m)."
    }

    fn duration_s(&self) -> f64 {
        self.0.scene.time.duration_s
    }

    fn steps(&self) -> Vec<u64> {
        let own = self.0.scene.time.step_count();
        [8, 4, 2, 1].iter().map(|part| own.div_ceil(*part)).chain([2 * own]).collect()
    }

    fn model(&self, integrator: Integrator, steps: u64, tolerance: f64) -> Result<Model, String> {
        let mut scene: Scene = self.0.scene.clone();
        scene.time.time_step_s = scene.time.duration_s / steps as f64;
        scene.method.integrator = integrator;
        scene.method.tolerance = tolerance;
        scene.method.absolute_tolerance = tolerance;
        compile_scene(&scene)
    }

    fn formula(&self) -> Option<&ErrorOf> {
        None
    }
}

/// The places at the end of the reference run, and how far the check is from them.
struct Reference {
    places: Vec<[f64; 3]>,
    doubt: Result<f64, String>,
}

impl Reference {
    fn of(subject: &dyn Subject, frames: u64) -> Result<Reference, String> {
        let adaptive = finish(subject.model(Integrator::Dopri5, frames, REFERENCE_TOLERANCE)?)?;
        let places: Vec<_> = adaptive.state.bodies.iter().map(|body| body.position_m).collect();
        let finest = subject.steps().last().copied().unwrap_or(1);
        let doubt = subject
            .model(Integrator::Rk4, FINER * finest, REFERENCE_TOLERANCE)
            .and_then(finish)
            .map(|check| distance(&check.state, &places));
        Ok(Reference { places, doubt })
    }
}

/// The root mean square of the bodies' distances from their places.
fn distance(state: &State, places: &[[f64; 3]]) -> f64 {
    let squares: f64 = state
        .bodies
        .iter()
        .zip(places)
        .flat_map(|(body, place)| body.position_m.iter().zip(place))
        .map(|(a, b)| (a - b) * (a - b))
        .sum();
    (squares / places.len() as f64).sqrt()
}

fn diagram(
    subject: &dyn Subject,
    effort: Effort,
    orders: &mut Vec<Vec<String>>,
    step: &mut dyn FnMut(&str),
) -> Plot {
    // The adaptive method's own steps are cut at these only.
    let frames = 4;
    let mut levels = Vec::new();
    let mut caption = subject.caption().to_owned();
    let reference = if subject.formula().is_some() {
        None
    } else {
        match Reference::of(subject, frames) {
            Ok(reference) => {
                match &reference.doubt {
                    Ok(doubt) => levels.push(("what the reference is sure of".to_owned(), *doubt)),
                    Err(reason) => {
                        caption.push_str(&format!(" The reference could not be checked: {reason}."))
                    }
                }
                Some(reference)
            }
            Err(reason) => {
                caption.push_str(&format!(" There is no reference: {reason}."));
                None
            }
        }
    };
    let error = |state: &State| match (subject.formula(), &reference) {
        (Some(formula), _) => formula(state),
        (None, Some(reference)) => distance(state, &reference.places),
        (None, None) => f64::NAN,
    };
    let mut series = Vec::new();
    for (colour, integrator) in Integrator::ALL.into_iter().enumerate() {
        step(&format!("{}, {}", subject.title(), integrator.name()));
        let settings: Vec<(u64, f64)> = match integrator {
            Integrator::Dopri5 => {
                (2..effort.pick(9, 12)).map(|power| (frames, libm::pow(10.0, -f64::from(power)))).collect()
            }
            _ => subject.steps().into_iter().map(|steps| (steps, 1e-6)).collect(),
        };
        let mut points = Vec::new();
        let mut runs = Vec::new();
        for (steps, tolerance) in settings {
            let setting = match integrator {
                Integrator::Dopri5 => format!("tolerance {tolerance:.0e}"),
                _ => format!("{steps} steps of {:.2e} s", subject.duration_s() / steps as f64),
            };
            let label = format!("{}, {setting}", integrator.name());
            let done = subject.model(integrator, steps, tolerance).and_then(finish);
            match done {
                Ok(done) => {
                    let wrong = error(&done.state);
                    let times = time(&done.model, effort.pick(3, 5));
                    let mut point = Point::at(
                        times.median,
                        wrong,
                        format!(
                            "{label}: error {wrong:.2e}, {:.2e} s, {} evaluations",
                            times.median, done.evaluations
                        ),
                    );
                    point.x_spread = Some([times.low, times.high]);
                    if !wrong.is_finite() {
                        point = Point::failed(times.median, label, "the result is not a number".to_owned());
                    }
                    runs.push((steps, wrong, done.evaluations));
                    points.push(point);
                }
                Err(reason) => points.push(Point::failed(f64::NAN, label, reason)),
            }
        }
        let order = if integrator == Integrator::Dopri5 { None } else { observed_order(&runs) };
        let smallest = runs.iter().map(|run| run.1).fold(f64::INFINITY, |a, b| if b < a { b } else { a });
        orders.push(vec![
            subject.title().to_owned(),
            integrator.name().to_owned(),
            order.map_or_else(
                || {
                    if smallest < ROUNDING && integrator != Integrator::Dopri5 {
                        "exact to rounding".to_owned()
                    } else {
                        "-".to_owned()
                    }
                },
                |order| format!("{order:.2}"),
            ),
            if smallest.is_finite() { format!("{smallest:.1e}") } else { "-".to_owned() },
            runs.last().map_or_else(|| "-".to_owned(), |run| run.2.to_string()),
        ]);
        series.push(Series { name: integrator.name().to_owned(), colour, points });
    }
    Plot {
        id: format!("accuracy-{}", subject.id()),
        title: subject.title().to_owned(),
        caption,
        x: Axis::log("time of one run on one core (s)"),
        y: Axis::log("error"),
        series,
        levels,
    }
}

/// The slope of the logarithms of error and number of steps, over the four finest runs above rounding.
fn observed_order(runs: &[(u64, f64, u64)]) -> Option<f64> {
    let points: Vec<(f64, f64)> = runs
        .iter()
        .rev()
        .filter(|run| run.1 > ROUNDING && run.1 < 0.3)
        .take(4)
        .map(|run| (libm::log(run.0 as f64), libm::log(run.1)))
        .collect();
    slope(&points).map(|slope| -slope)
}

/// The slope of a line through points, by least squares; none of fewer than three.
pub(crate) fn slope(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 3 {
        return None;
    }
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0, sum.1 + point.1));
    let (x, y) = (x / count, y / count);
    let (mut xx, mut xy) = (0.0, 0.0);
    for point in points {
        xx += (point.0 - x) * (point.0 - x);
        xy += (point.0 - x) * (point.1 - y);
    }
    Some(xy / xx)
}

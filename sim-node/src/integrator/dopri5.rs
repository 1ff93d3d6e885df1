//! Dormand and Prince's method of order five with its embedded error estimate: inner steps as long as the
//! tolerance allows, and a scene's step is only how far apart states are.
//!
//! The one thing to know: nothing but the state is carried from one step to the next. The first inner step of
//! each is sized anew from the state's own slopes, which costs two evaluations.
//!
//! # Error
//! Each body's error counts as displacement and velocity of its surface: positions (m), angles times
//! the bounding radius, velocities (m/s), angular velocities times the radius. Its scale is
//! `absolute_tolerance` plus `tolerance` times the bounding radius, or times the surface's speed. The largest
//! quotient over all bodies must be at most 1. So the choice does not depend on where the scene is.
//!
//! # Contact
//! Onset and loss of contact are kinks in the force. Where nothing touches anything the way to the first contact is
//! known: each body moves with the velocity and acceleration of the inner step's start, and the root of the smallest
//! gap along it ends the step; what the guess lacks is made up for by the next, shorter one. When the last contact ends
//! or the first begins the next inner step is sized anew, from the slopes of the other side. All other kinks,
//! as in a sheet that always touches somewhere, are left to the error estimate: a step across one is refused until it
//! is so short that the kink's error is tolerated. Measured on bouncing balls (`tests/sim/dopri5.rs`). No inner
//! step moves two bodies against each other by more than a quarter of both wires' radii together once they may touch
//! (`risk`), so none passes over a contact.
//!
//! # Source
//! J. R. Dormand, P. J. Prince, "A family of embedded Runge-Kutta formulae", J. Comp. Appl. Math. 6 (1980),
//! table 2 (RK5(4)7M). Step control and first step: E. Hairer, S. P. Norsett, G. Wanner, "Solving Ordinary
//! Differential Equations I", sections II.4 and IV.2 (PI control with beta = 0.04). Deviation: the largest
//! body's error instead of the mean square.

use super::explicit::{Setting, Slope, Stages, Tableau};
use crate::overlap::gap;
use crate::risk;
use crate::step::Stop;
use crate::wrench::Velocity;
use crate::{Model, Scratch, State, motion};
use geometry::{Circle, Vec3};
use nalgebra::Quaternion;

/// The seventh stage is the end of the step, and the first of the next.
pub(crate) const TABLEAU: Tableau = Tableau {
    rows: &[
        &[],
        &[1.0 / 5.0],
        &[3.0 / 40.0, 9.0 / 40.0],
        &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
        &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
        &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
        &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
    ],
    weights: &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0],
};

/// Weights of order five less those of order four.
const ERROR: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];
/// No inner step is shorter than this share of the step: what is left there is not the method's error.
const SHORTEST: f64 = 1e-13;

/// Advances all bodies and contacts by one step; step number and time are the caller's.
///
/// # Errors
///
/// [`Stop::Tolerance`] where no inner step is short enough.
pub(crate) fn advance(model: &Model, state: &mut State, scratch: &mut Scratch) -> Result<(), Stop> {
    let whole = model.time().time_step_s;
    scratch.stages.start_at(state);
    evaluate(0, 0.0, model, state, scratch);
    // A step of no length would never end.
    let mut time_step = larger(SHORTEST * whole, first_step(model, state, scratch));
    let mut before = 1e-4;
    let (mut done, mut refused) = (0.0, false);
    let mut touches = scratch.evaluation.touches();
    while done < whole {
        let limit = risk::longest_step(model, &state.bodies, time_step, &mut scratch.risk);
        // A speed that is not finite goes on to the check that names it.
        let hopeless = limit < time_step && !(limit > SHORTEST * whole);
        if limit < time_step {
            time_step = limit;
        }
        if !touches && let Some(flight) = flight(model, scratch, time_step) {
            time_step = larger(SHORTEST * whole, flight);
        }
        // A rest shorter than a hundredth of the step is not worth a step of its own.
        let last = hopeless || !(done + 1.01 * time_step < whole);
        if last {
            time_step = whole - done;
        }
        for stage in 1..TABLEAU.rows.len() {
            evaluate(stage, time_step, model, state, scratch);
        }
        let error = error(model, &scratch.stages, time_step);
        let shortest = time_step < SHORTEST * whole;
        if error <= 1.0 || hopeless || (shortest && error.is_nan()) {
            accept(time_step, model, state, scratch);
            // What is not a number stays so, and is named after the step.
            done = if last || error.is_nan() { whole } else { done + time_step };
            let least = 1e-4;
            let clamped = if error > least { error } else { least };
            let growth = 0.9 * libm::pow(clamped, -0.17) * libm::pow(before, 0.04);
            let largest = if refused { 1.0 } else { 10.0 };
            time_step *= if growth < largest { growth } else { largest };
            before = clamped;
            refused = false;
            if scratch.evaluation.touches() != touches && done < whole {
                touches = !touches;
                time_step = larger(SHORTEST * whole, first_step(model, state, scratch));
                before = 1e-4;
            }
        } else if shortest {
            return Err(Stop::Tolerance { step: state.step + 1, inner_step_s: time_step, error });
        } else {
            let shrink = 0.9 * libm::pow(error, -0.2);
            time_step *= if shrink > 0.2 { shrink } else { 0.2 };
            refused = true;
        }
    }
    scratch.evaluation_age_s = 0.0;
    Ok(())
}

fn evaluate(stage: usize, time_step: f64, model: &Model, state: &State, scratch: &mut Scratch) {
    let Scratch { evaluation, moment, stages, pool, .. } = scratch;
    let mut setting = Setting { model, evaluation, moment, pool: pool.as_deref(), springs: &state.contacts };
    stages.evaluate(&TABLEAU, stage, time_step, &mut setting);
}

/// Moves to the end of an inner step; its last slopes are the first ones of the next.
fn accept(time_step: f64, model: &Model, state: &mut State, scratch: &mut Scratch) {
    let time = scratch.stages.time + time_step;
    scratch.drive_work_j += scratch.stages.drive_work(&TABLEAU, time_step);
    scratch.stages.add_impulse(&TABLEAU, time_step, &mut scratch.impulse);
    state.dissipated_energy_j += scratch.stages.finish(&TABLEAU, time_step, model, state);
    scratch.keep_springs(&mut state.contacts);
    motion::store(model, time, &mut state.bodies);
    let stages = &mut scratch.stages;
    stages.start_at(state);
    stages.time = time;
    stages.reuse_last();
    for (slope, point) in stages.slopes[0].iter_mut().zip(&stages.start) {
        let w = slope.velocity.angular;
        // The end's quaternion has been normalised since.
        slope.orientation = Quaternion::new(0.0, 0.5 * w.x, 0.5 * w.y, 0.5 * w.z) * point.orientation;
    }
}

/// When the first contact begins (s from the start of the inner step), if within a time: along the parabolas on
/// which the bodies start.
fn flight(model: &Model, scratch: &mut Scratch, longest: f64) -> Option<f64> {
    let bodies = model.bodies().len() as u32;
    let planes = bodies..bodies + model.planes().len() as u32;
    let free = |body: &u32| !model.bodies()[*body as usize].pinned;
    let on_planes = planes.flat_map(|plane| (0..bodies).filter(free).map(move |body| (body, plane)));
    let mut pairs: Vec<(u32, u32)> = scratch.evaluation.neighbours.pairs().to_vec();
    pairs.retain(|&(_, b)| b < bodies);
    pairs.extend(on_planes);
    let Scratch { moment, stages, .. } = scratch;
    // Which pairs meet by a time.
    let mut meet = |time: f64, pairs: &[(u32, u32)]| -> Vec<(u32, u32)> {
        for (index, body) in model.bodies().iter().enumerate() {
            let (start, slope) = (&stages.start[index], &stages.slopes[0][index]);
            let mut point = start.moved(slope, time);
            point.position += slope.acceleration.linear * (0.5 * time * time);
            moment.circles[index] =
                Circle::from_pose(point.position, &point.unit_orientation(), body.major_radius);
        }
        motion::place(model, stages.time + time, moment);
        let met = |&&(a, b): &&(u32, u32)| {
            model.near(&moment.circles, a, b) && gap(model, &moment.circles, a, b) < 0.0
        };
        pairs.iter().filter(met).copied().collect()
    };
    let mut pairs = meet(longest, &pairs);
    // Wires that touch by less than the law can see have met already: they do not begin to.
    let touching = meet(0.0, &pairs);
    pairs.retain(|pair| !touching.contains(pair));
    if pairs.is_empty() {
        return None;
    }
    let (mut apart, mut met) = (0.0, longest);
    // As near as numbers go: the end is the first number at which they touch.
    for _ in 0..60 {
        let middle = 0.5 * (apart + met);
        let first = meet(middle, &pairs);
        if first.is_empty() {
            apart = middle;
        } else {
            (met, pairs) = (middle, first);
        }
    }
    Some(met)
}

/// The size of the first inner step (s), from the slopes at the state and after a small step along them.
fn first_step(model: &Model, state: &State, scratch: &mut Scratch) -> f64 {
    let whole = model.time().time_step_s;
    let scale = Scale::of(model);
    let mut sizes = (0.0, 0.0);
    for (index, body) in model.bodies().iter().enumerate().filter(|(_, body)| !body.pinned) {
        let (start, slope) = (&scratch.stages.start[index], &scratch.stages.slopes[0][index]);
        let speed = surface_speed(&start.velocity, body.bounding_radius);
        let place = body.bounding_radius / scale.place(body.bounding_radius);
        sizes.0 = larger(sizes.0, larger(speed / scale.velocity(speed), place));
        sizes.1 = larger(sizes.1, scale.quotient(body.bounding_radius, speed, slope));
    }
    let guess = if sizes.1 > 1e-10 * sizes.0 { 0.01 * sizes.0 / sizes.1 } else { whole };
    let guess = if guess < whole { guess } else { whole };
    evaluate(1, 5.0 * guess, model, state, scratch);
    let mut bend = 0.0;
    for (index, body) in model.bodies().iter().enumerate().filter(|(_, body)| !body.pinned) {
        let slopes = &scratch.stages.slopes;
        let speed = surface_speed(&scratch.stages.start[index].velocity, body.bounding_radius);
        let change = slopes[1][index].less(&slopes[0][index]);
        bend = larger(bend, scale.quotient(body.bounding_radius, speed, &change) / guess);
    }
    let steepest = larger(sizes.1, bend);
    let second = if steepest > 1e-15 { libm::pow(0.01 / steepest, 0.2) } else { whole };
    let time_step = if second < 100.0 * guess { second } else { 100.0 * guess };
    // Also where the state is not finite.
    if time_step < whole { time_step } else { whole }
}

/// The largest error of a body in units of what is tolerated.
fn error(model: &Model, stages: &Stages, time_step: f64) -> f64 {
    let scale = Scale::of(model);
    let mut largest = 0.0;
    for (index, body) in model.bodies().iter().enumerate().filter(|(_, body)| !body.pinned) {
        let start = &stages.start[index];
        let before = surface_speed(&start.velocity, body.bounding_radius);
        let last = &stages.slopes[TABLEAU.rows.len() - 1][index];
        let after = surface_speed(&last.velocity, body.bounding_radius);
        let error = stages.combined(index, &ERROR);
        let quotient = scale.quotient(body.bounding_radius, larger(before, after), &error) * time_step;
        if !(quotient <= largest) {
            largest = quotient;
        }
        if largest.is_nan() {
            return largest;
        }
    }
    largest
}

/// What is tolerated.
struct Scale {
    relative: f64,
    absolute: f64,
}

impl Scale {
    fn of(model: &Model) -> Scale {
        let method = model.method();
        Scale { relative: method.tolerance, absolute: method.absolute_tolerance }
    }

    fn place(&self, radius: f64) -> f64 {
        self.absolute + self.relative * radius
    }

    fn velocity(&self, speed: f64) -> f64 {
        self.absolute + self.relative * speed
    }

    /// The largest part of a slope in units of what is tolerated.
    fn quotient(&self, radius: f64, speed: f64, slope: &Slope) -> f64 {
        let length = |v: &Vec3| v.norm_squared().sqrt();
        let turn = 2.0 * slope.orientation.norm_squared().sqrt() * radius;
        let place = length(&slope.velocity.linear) + turn;
        let velocity = surface_speed(&slope.acceleration, radius);
        larger(place / self.place(radius), velocity / self.velocity(speed))
    }
}

/// The largest speed of a point of a body, or more (m/s).
fn surface_speed(velocity: &Velocity, radius: f64) -> f64 {
    velocity.linear.norm_squared().sqrt() + radius * velocity.angular.norm_squared().sqrt()
}

/// The larger of two numbers; the first one if it is NaN.
fn larger(a: f64, b: f64) -> f64 {
    if b <= a || a.is_nan() { a } else { b }
}

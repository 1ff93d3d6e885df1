//! Backward Euler, for contacts so stiff that no explicit step would do.
//!
//! The one thing to know: a step of length `h` finds the velocities `V` at its end with
//! `x = x0 + h v`, `q = exp(h w) q0`, `m v = m v0 + h F(x, q, V)`, `I(q) w = L0 + h T(x, q, V)`
//! by Newton's iteration; `L0` is the angular momentum at the start, so that no gyroscopic term is needed.
//!
//! # Newton's iteration
//! The matrix is that of `jacobian`, solved by conjugate gradients (`system`). A step along its solution is
//! shortened where it overshoots: where the residual, along the step, has turned round by more than half. Nor
//! may a surface move by more than half the thinnest wire in one iteration. It ends when the change of
//! velocity is below [`TOLERANCE`] of the fastest surface's speed. A step that does not end is made again in two
//! halves, down to 2^-12 of the step; then the run stops.
//!
//! # Limits
//! No friction, and rings, spheres and planes with the law `centreline-arc` only: the others have no Jacobian here.
//! A spin `w` with `w h` above about 1 makes the iteration slow and then the step short.
//! It is of first order and takes energy from every motion: at `omega h = 0.2` a vibration loses
//! 4 % of its energy in a step. Right for what comes to rest, and for previews.
//!
//! # Source
//! E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II", section IV.3.

mod jacobian;
mod system;

use crate::body::Body;
use crate::forces::{Evaluation, SlipMotion};
use crate::state::{Motion, renormalised};
use crate::step::{Stop, check_finite};
use crate::wrench::Velocity;
use crate::{Model, Scratch, State, motion};
use geometry::{Circle, Vec3, rotation};
use nalgebra::UnitQuaternion;
use system::{Six, System, dot};

/// Change of velocity at which the iteration ends, as a share of the fastest surface's speed.
const TOLERANCE: f64 = 1e-9;
const ITERATIONS_MAX: usize = 60;
/// Halvings of a step at most.
const DEPTH_MAX: u32 = 12;

/// Where a step starts.
struct Base {
    position: Vec3,
    orientation: UnitQuaternion<f64>,
    velocity: Vec3,
    /// About the centre (kg m^2/s), World.
    angular_momentum: Vec3,
}

/// What a step found: pose and velocity of each body, and the power lost and driven.
struct Found {
    motions: Vec<Motion>,
    lost: f64,
    drive: f64,
}

/// Advances all bodies by one step; step number and time are the caller's.
///
/// # Errors
///
/// [`Stop::NoSolution`] where the shortest part of the step has none either.
pub(crate) fn advance(model: &Model, state: &mut State, scratch: &mut Scratch) -> Result<(), Stop> {
    // Equations with a number that is not finite have no solution, and the number's name says more.
    check_finite(model, state)?;
    let mut drive_work = 0.0;
    let time = state.sim_time_s;
    let whole = model.time().time_step_s;
    part(model, state, scratch, (time, whole), 0, &mut drive_work)?;
    scratch.drive_work_j = drive_work;
    scratch.evaluation_age_s = 0.0;
    state.contacts.clear();
    Ok(())
}

/// A part of the step from a time on, in halves where it has to be.
fn part(
    model: &Model,
    state: &mut State,
    scratch: &mut Scratch,
    (time, length): (f64, f64),
    depth: u32,
    drive_work: &mut f64,
) -> Result<(), Stop> {
    let base: Vec<Base> = model.bodies().iter().zip(&state.bodies).map(|(b, s)| Base::of(b, s)).collect();
    let Some(found) = solve(model, scratch, &base, time + length, length) else {
        if depth == DEPTH_MAX {
            return Err(Stop::NoSolution { step: state.step + 1, part_s: length });
        }
        let half = 0.5 * length;
        part(model, state, scratch, (time, half), depth + 1, drive_work)?;
        motion::store(model, time + half, &mut state.bodies);
        return part(model, state, scratch, (time + half, half), depth + 1, drive_work);
    };
    for (index, (motion, body)) in found.motions.iter().zip(&mut state.bodies).enumerate() {
        if !model.bodies()[index].pinned {
            motion.store(body);
        }
    }
    state.dissipated_energy_j += length * found.lost;
    *drive_work += length * found.drive;
    Ok(())
}

impl Base {
    fn of(body: &Body, state: &schemas::state::BodyState) -> Base {
        let motion = Motion::of(state);
        Base {
            position: motion.position,
            orientation: motion.orientation,
            velocity: motion.linear,
            angular_momentum: momentum(body, &frame(body, &motion), &motion.angular),
        }
    }
}

fn frame(body: &Body, motion: &Motion) -> Circle {
    Circle::from_pose(motion.position, &motion.orientation, body.major_radius)
}

/// `I w`, World.
fn momentum(body: &Body, frame: &Circle, angular: &Vec3) -> Vec3 {
    let [i1, i2, i3] = body.inertia_kg_m2;
    frame.u * (i1 * angular.dot(&frame.u))
        + frame.w * (i2 * angular.dot(&frame.w))
        + frame.normal * (i3 * angular.dot(&frame.normal))
}

/// `I^-1 L`, World; 0 for a pinned body.
fn spin_of(body: &Body, frame: &Circle, momentum: &Vec3) -> Vec3 {
    let [j1, j2, j3] = body.inverse_inertia;
    frame.u * (j1 * momentum.dot(&frame.u))
        + frame.w * (j2 * momentum.dot(&frame.w))
        + frame.normal * (j3 * momentum.dot(&frame.normal))
}

/// One step of a length that ends at a time.
fn solve(model: &Model, scratch: &mut Scratch, base: &[Base], time: f64, length: f64) -> Option<Found> {
    let mut iteration = Iteration { model, base, time, length };
    let mut velocities: Vec<Six> = base
        .iter()
        .zip(model.bodies())
        .map(|(base, body)| {
            let motion = Motion {
                position: base.position,
                orientation: base.orientation,
                linear: base.velocity,
                angular: Vec3::zeros(),
            };
            let w = spin_of(body, &frame(body, &motion), &base.angular_momentum);
            let v = base.velocity;
            if body.pinned { [0.0; 6] } else { [v.x, v.y, v.z, w.x, w.y, w.z] }
        })
        .collect();
    let mut residual = iteration.residual(scratch, &velocities);
    for _ in 0..ITERATIONS_MAX {
        let system = iteration.system(scratch);
        let negative: Vec<Six> = residual.iter().map(|r| r.map(|value| -value)).collect();
        let mut change = system.solve(&negative);
        iteration.limit(&mut change);
        let downhill = dot(&change, &residual);
        let mut share = 1.0;
        let start = velocities.clone();
        for trial in 0..6 {
            velocities = moved(&start, &change, share);
            residual = iteration.residual(scratch, &velocities);
            let slope = dot(&change, &residual);
            if !(slope > -0.5 * downhill) || trial == 5 {
                break;
            }
            // Where the slope would be zero if it were straight.
            let zero = share * downhill / (downhill - slope);
            share = if zero > 0.1 * share { zero } else { 0.1 * share };
        }
        let (moved_by, fastest) = (iteration.fastest(&change) * share, iteration.fastest(&velocities));
        let gravity = model.gravity().norm_squared().sqrt() * length;
        if moved_by <= TOLERANCE * (fastest + gravity) {
            return Some(iteration.found(scratch, &velocities));
        }
        if !moved_by.is_finite() {
            return None;
        }
    }
    None
}

fn moved(start: &[Six], change: &[Six], share: f64) -> Vec<Six> {
    let add = |(start, change): (&Six, &Six)| core::array::from_fn(|i| start[i] + share * change[i]);
    start.iter().zip(change).map(add).collect()
}

struct Iteration<'a> {
    model: &'a Model,
    base: &'a [Base],
    time: f64,
    length: f64,
}

fn halves(six: &Six) -> (Vec3, Vec3) {
    (Vec3::new(six[0], six[1], six[2]), Vec3::new(six[3], six[4], six[5]))
}

impl Iteration<'_> {
    fn motion(&self, index: usize, velocity: &Six) -> Motion {
        let (linear, angular) = halves(velocity);
        let base = &self.base[index];
        Motion {
            position: base.position + linear * self.length,
            orientation: renormalised(rotation::exp(angular * self.length) * base.orientation),
            linear,
            angular,
        }
    }

    /// What momentum lacks, for velocities; the forces at that place are in the scratch afterwards.
    fn residual(&mut self, scratch: &mut Scratch, velocities: &[Six]) -> Vec<Six> {
        let (model, length) = (self.model, self.length);
        let Scratch { evaluation, moment, pool, .. } = scratch;
        for (index, (body, velocity)) in model.bodies().iter().zip(velocities).enumerate() {
            let motion = self.motion(index, velocity);
            moment.circles[index] = frame(body, &motion);
            moment.velocities[index] = Velocity { linear: motion.linear, angular: motion.angular };
        }
        motion::place(model, self.time, moment);
        let slip = SlipMotion { since: (&moment.velocities, 0.0), kept: (&moment.velocities, 0.0) };
        evaluation.evaluate(model, moment, &[], slip, pool.as_deref());
        let lack = |(index, body): (usize, &Body)| {
            if body.pinned {
                return [0.0; 6];
            }
            let (base, wrench) = (&self.base[index], &evaluation.wrenches[index]);
            let Velocity { linear, angular } = moment.velocities[index];
            let force = wrench.force + model.gravity() * body.mass_kg - linear * drag(body, &linear);
            let torque = wrench.torque - angular * body.axial_drag.drag;
            let r = (linear - base.velocity) * body.mass_kg - force * length;
            let turned = momentum(body, &moment.circles[index], &angular);
            let t = turned - base.angular_momentum - torque * length;
            [r.x, r.y, r.z, t.x, t.y, t.z]
        };
        model.bodies().iter().enumerate().map(lack).collect()
    }

    /// The matrix at the place of the last evaluation.
    fn system(&self, scratch: &Scratch) -> System {
        let (model, moment) = (self.model, &scratch.moment);
        let mut system = System::default();
        for (index, body) in model.bodies().iter().enumerate() {
            let mut block = [[0.0; 6]; 6];
            if body.pinned {
                (0..6).for_each(|i| block[i][i] = 1.0);
            } else {
                let linear = body.mass_kg + self.length * drag(body, &moment.velocities[index].linear);
                (0..3).for_each(|i| block[i][i] = linear);
                let circle = &moment.circles[index];
                for column in 0..3 {
                    let mut unit = Vec3::zeros();
                    unit[column] = 1.0;
                    let inertia = momentum(body, circle, &unit);
                    (0..3).for_each(|row| block[3 + row][3 + column] = inertia[row]);
                    block[3 + column][3 + column] += self.length * body.axial_drag.drag;
                }
            }
            system.diagonal.push(block);
        }
        let pairs = scratch.evaluation.candidates(model, moment);
        jacobian::add_contacts(model, moment, pairs, self.length, &mut system);
        system
    }

    /// The speed of the fastest surface, for velocities or changes of them.
    fn fastest(&self, velocities: &[Six]) -> f64 {
        let mut fastest = 0.0;
        for (body, velocity) in self.model.bodies().iter().zip(velocities) {
            let (linear, angular) = halves(velocity);
            let speed = linear.norm_squared().sqrt() + body.bounding_radius * angular.norm_squared().sqrt();
            // A NaN stays.
            if !(speed <= fastest) {
                fastest = speed;
            }
        }
        fastest
    }

    /// Shortens a change so that no surface moves by more than half the thinnest wire.
    fn limit(&self, change: &mut [Six]) {
        let thinnest = self.model.bodies().iter().fold(f64::INFINITY, |thinnest, body| {
            if body.minor_radius < thinnest { body.minor_radius } else { thinnest }
        });
        let share = 0.5 * thinnest / (self.fastest(change) * self.length);
        if self.model.body_count() > 1 && share < 1.0 {
            change.iter_mut().flatten().for_each(|value| *value *= share);
        }
    }

    fn found(&self, scratch: &Scratch, velocities: &[Six]) -> Found {
        let (model, moment) = (self.model, &scratch.moment);
        let (drive, mut lost) = motion::power(model, moment, &scratch.evaluation);
        let loses = Evaluation::loses(model);
        let mut motions = Vec::with_capacity(velocities.len());
        for (index, (body, velocity)) in model.bodies().iter().zip(velocities).enumerate() {
            let motion = self.motion(index, velocity);
            if !body.pinned {
                lost += drag(body, &motion.linear) * motion.linear.norm_squared()
                    + body.axial_drag.drag * motion.angular.norm_squared();
                if loses {
                    let wrench = &scratch.evaluation.lost[index];
                    lost -= wrench.force.dot(&motion.linear) + wrench.torque.dot(&motion.angular);
                }
            }
            motions.push(motion);
        }
        Found { motions, lost, drive }
    }
}

/// The coefficient of drag at a velocity (kg/s).
fn drag(body: &Body, linear: &Vec3) -> f64 {
    body.linear_drag.drag + body.quadratic_drag * linear.norm_squared().sqrt()
}

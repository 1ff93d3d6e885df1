//! Implicit methods, for contacts so stiff that no explicit step would do: what `backward-euler` and
//! `energy-decaying` share.
//!
//! The one thing to know: the unknowns are the bodies' velocities, the mean ones of the step or those at its end;
//! they give poses, these give forces, and Newton's iteration makes momentum agree with the forces' impulse.
//!
//! # Newton's iteration
//! The matrix is that of `jacobian`, solved by conjugate gradients (`system`). A step along its solution is
//! shortened where it overshoots: where the residual, along the step, has turned round by more than half. Nor
//! may a surface move by more than half the thinnest wire in one iteration. It ends when the change of
//! velocity is below [`TOLERANCE`] of the fastest surface's speed. A step that does not end is made again in two
//! halves, down to 2^-12 of the step; then the run stops.
//!
//! # Limits
//! Rings, spheres and planes with the laws `centreline-arc` and `centreline-minima` only: the others have no Jacobian
//! here. A spin `w` with `w h` above about 1 makes the iteration slow and then the step short.

mod backward_euler;
mod energy_decaying;
mod jacobian;
mod system;
mod touches;

use crate::body::Body;
use crate::state::Motion;
use crate::step::{Stop, check_finite};
use crate::{Model, Scratch, State, motion};
use backward_euler::BackwardEuler;
use energy_decaying::EnergyDecaying;
use geometry::{Circle, Vec3};
use nalgebra::UnitQuaternion;
use schemas::scene::Integrator;
use schemas::state::ContactState;
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
    linear: Vec3,
    angular: Vec3,
    /// About the centre (kg m^2/s), World.
    angular_momentum: Vec3,
    /// The body's own z axis.
    axis: Vec3,
}

/// A part of a step.
#[derive(Clone, Copy)]
struct Part<'a> {
    model: &'a Model,
    base: &'a [Base],
    /// When it ends (s).
    end: f64,
    /// How long it is (s).
    length: f64,
    /// Friction's springs at its start.
    springs: &'a [ContactState],
}

/// What a step found: pose and velocity of each body, and the power lost and driven.
struct Found {
    motions: Vec<Motion>,
    lost: f64,
    drive: f64,
}

/// The equations of one part of a step.
trait Equations {
    /// Forces at the end that velocities lead to, into the scratch.
    fn evaluate(&mut self, scratch: &mut Scratch, velocities: &[Six]);
    /// What momentum lacks there.
    fn residual(&self, scratch: &Scratch, velocities: &[Six]) -> Vec<Six>;
    /// The matrix there, in the given iteration; what it learns on the way may change the residual.
    fn system(&mut self, scratch: &Scratch, velocities: &[Six], iteration: usize) -> System;
    /// The end of the part, there.
    fn found(&mut self, scratch: &Scratch, velocities: &[Six]) -> Found;
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
    let whole = Part { model, base: &base, end: time + length, length, springs: &state.contacts };
    let found = match model.integrator() {
        Integrator::EnergyDecaying => whole.solve(EnergyDecaying::new(whole, scratch), scratch),
        _ => whole.solve(BackwardEuler { part: whole }, scratch),
    };
    let Some(found) = found else {
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
    scratch.keep_springs(&mut state.contacts);
    state.dissipated_energy_j += length * found.lost;
    *drive_work += length * found.drive;
    Ok(())
}

impl Base {
    fn of(body: &Body, state: &schemas::state::BodyState) -> Base {
        let motion = Motion::of(state);
        let frame = frame(body, &motion);
        Base {
            position: motion.position,
            orientation: motion.orientation,
            linear: motion.linear,
            angular: motion.angular,
            angular_momentum: momentum(body, &frame, &motion.angular),
            axis: frame.normal,
        }
    }
}

fn frame(body: &Body, motion: &Motion) -> Circle {
    Circle::from_pose(motion.position, &motion.orientation, body.major_radius)
}

/// `I w`, World.
fn momentum(body: &Body, frame: &Circle, angular: &Vec3) -> Vec3 {
    along_axes(&body.inertia_kg_m2, frame, angular)
}

/// `I^-1 L`, World; 0 for a pinned body.
fn spin_of(body: &Body, frame: &Circle, momentum: &Vec3) -> Vec3 {
    along_axes(&body.inverse_inertia, frame, momentum)
}

fn along_axes([of_u, of_w, of_normal]: &[f64; 3], frame: &Circle, vector: &Vec3) -> Vec3 {
    frame.u * (of_u * vector.dot(&frame.u))
        + frame.w * (of_w * vector.dot(&frame.w))
        + frame.normal * (of_normal * vector.dot(&frame.normal))
}

impl Part<'_> {
    fn solve<E: Equations>(&self, mut equations: E, scratch: &mut Scratch) -> Option<Found> {
        let start = |(base, body): (&Base, &Body)| {
            let (v, w) = (base.linear, base.angular);
            if body.pinned { [0.0; 6] } else { [v.x, v.y, v.z, w.x, w.y, w.z] }
        };
        let mut velocities: Vec<Six> = self.base.iter().zip(self.model.bodies()).map(start).collect();
        equations.evaluate(scratch, &velocities);
        for number in 0..ITERATIONS_MAX {
            let system = equations.system(scratch, &velocities, number);
            let mut residual = equations.residual(scratch, &velocities);
            let negative: Vec<Six> = residual.iter().map(|r| r.map(|value| -value)).collect();
            let mut change = system.solve(&negative);
            self.limit(&mut change);
            let downhill = dot(&change, &residual);
            let mut share = 1.0;
            let start = velocities.clone();
            for trial in 0..6 {
                velocities = moved(&start, &change, share);
                equations.evaluate(scratch, &velocities);
                residual = equations.residual(scratch, &velocities);
                let slope = dot(&change, &residual);
                if !(slope > -0.5 * downhill) || trial == 5 {
                    break;
                }
                // Where the slope would be zero if it were straight.
                let zero = share * downhill / (downhill - slope);
                share = if zero > 0.1 * share { zero } else { 0.1 * share };
            }
            let (moved_by, fastest) = (self.fastest(&change) * share, self.fastest(&velocities));
            let gravity = self.model.gravity().norm_squared().sqrt() * self.length;
            if moved_by <= TOLERANCE * (fastest + gravity) {
                return Some(equations.found(scratch, &velocities));
            }
            if !moved_by.is_finite() {
                return None;
            }
        }
        None
    }

    /// The masses' part of the matrix: `per_mass` times mass and inertia, and drag over the part's length.
    fn masses(&self, scratch: &Scratch, velocities: &[Six], per_mass: f64) -> System {
        let mut system = System::default();
        for (index, body) in self.model.bodies().iter().enumerate() {
            let mut block = [[0.0; 6]; 6];
            if body.pinned {
                (0..6).for_each(|i| block[i][i] = 1.0);
            } else {
                let linear = halves(&velocities[index]).0;
                let entry = per_mass * body.mass_kg + self.length * drag(body, &linear);
                (0..3).for_each(|i| block[i][i] = entry);
                let circle = &scratch.moment.circles[index];
                for column in 0..3 {
                    let mut unit = Vec3::zeros();
                    unit[column] = per_mass;
                    let inertia = momentum(body, circle, &unit);
                    (0..3).for_each(|row| block[3 + row][3 + column] = inertia[row]);
                    block[3 + column][3 + column] += self.length * body.axial_drag.drag;
                }
            }
            system.diagonal.push(block);
        }
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
}

fn moved(start: &[Six], change: &[Six], share: f64) -> Vec<Six> {
    let add = |(start, change): (&Six, &Six)| core::array::from_fn(|i| start[i] + share * change[i]);
    start.iter().zip(change).map(add).collect()
}

fn halves(six: &Six) -> (Vec3, Vec3) {
    (Vec3::new(six[0], six[1], six[2]), Vec3::new(six[3], six[4], six[5]))
}

/// The coefficient of drag at a velocity (kg/s).
fn drag(body: &Body, linear: &Vec3) -> f64 {
    body.linear_drag.drag + body.quadratic_drag * linear.norm_squared().sqrt()
}

/// The power that drag takes at velocities (W).
fn drag_power(body: &Body, linear: &Vec3, angular: &Vec3) -> f64 {
    drag(body, linear) * linear.norm_squared() + body.axial_drag.drag * angular.norm_squared()
}

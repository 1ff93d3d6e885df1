//! Drift, kick, drift of bodies that are not symmetric tops, for `verlet`.
//!
//! # Free motion
//! The kinetic energy of rotation is split into that of a symmetric top and the rest. With the axes `j`, whose
//! moment of inertia is nearest to that of another one, `i`, and `k`, the third:
//!
//! `L_i^2 / 2I_i + L_j^2 / 2I_j + L_k^2 / 2I_k = (top: I_i, I_i, I_k) + L_j^2 / 2 (1/I_j - 1/I_i)`
//!
//! Both parts can be solved exactly: the top as in [`super::verlet`], the rest by a turn about the body's axis `j`
//! with the constant rate `L_j (1/I_j - 1/I_i)`. Half of the rest, the top, half of the rest: second order,
//! symplectic, reversible; the angular momentum `L` in World is not touched at all, and so kept to the last
//! bit. The energy swings about its value by an amount of second order in the step.
//!
//! # Source
//! J. Touma and J. Wisdom, "Lie-Poisson integrators for rigid body dynamics in the solar system", Astronomical
//! Journal 107 (1994); F. Fasso, "Comparison of splitting algorithms for the rigid body", Journal of
//! Computational Physics 189 (2003). Deviation: the axes of the top are chosen by the moments.

use crate::body::Body;
use crate::state::{Motion, renormalised};
use crate::wrench::Velocity;
use crate::{Model, Scratch, State};
use geometry::{Circle, Vec3, rotation};
use nalgebra::UnitQuaternion;
use schemas::state::BodyState;

/// Free motion of the bodies after the tops from the state to the middle of the step, into the scratch.
pub(crate) fn drift_to_middle(model: &Model, state: &State, scratch: &mut Scratch, time: f64) {
    for index in model.top_count()..model.body_count() {
        let body = &model.bodies()[index];
        let mut motion = Motion::of(&state.bodies[index]);
        if !body.pinned {
            motion.position += motion.linear * time;
            let momentum = momentum(body, &motion.orientation, &motion.angular);
            motion.orientation = turned(body, motion.orientation, &momentum, time);
            motion.angular = angular_velocity(body, &motion.orientation, &momentum);
        }
        scratch.moment.circles[index] = Circle::from_pose(motion.position, &motion.orientation, 0.0);
        scratch.moment.velocities[index] = Velocity { linear: motion.linear, angular: motion.angular };
        scratch.verlet.orientations[index] = motion.orientation;
    }
}

/// The kick and the second drift of the bodies after the tops; returns the energy lost. `loses`: there is an
/// inelastic part of the contact forces.
pub(crate) fn kick_and_drift(model: &Model, state: &mut State, scratch: &Scratch, loses: bool) -> f64 {
    let half = 0.5 * model.time().time_step_s;
    let step = model.time().time_step_s;
    let mut lost = 0.0;
    for index in model.top_count()..model.body_count() {
        let body = &model.bodies()[index];
        if body.pinned {
            continue;
        }
        let Velocity { linear, angular } = scratch.moment.velocities[index];
        let (orientation, wrench) = (scratch.verlet.orientations[index], scratch.evaluation.wrenches[index]);
        let acceleration = wrench.force * body.inverse_mass + model.gravity();
        let linear_after = linear + acceleration * step;
        let momentum = momentum(body, &orientation, &angular) + wrench.torque * step;
        if loses {
            // Under a constant wrench the velocities change evenly: their means are those of before and after.
            let angular_after = angular_velocity(body, &orientation, &momentum);
            let inelastic = &scratch.evaluation.lost[index];
            let work = inelastic.force.dot(&(linear + linear_after))
                + inelastic.torque.dot(&(angular + angular_after));
            lost -= half * work;
        }
        let orientation = renormalised(turned(body, orientation, &momentum, half));
        let motion = Motion {
            position: scratch.moment.circles[index].centre + linear_after * half,
            orientation,
            linear: linear_after,
            angular: angular_velocity(body, &orientation, &momentum),
        };
        let after: &mut BodyState = &mut state.bodies[index];
        motion.store(after);
    }
    lost
}

fn momentum(body: &Body, orientation: &UnitQuaternion<f64>, angular: &Vec3) -> Vec3 {
    let (u, w, normal) = rotation::axes(orientation);
    let [i1, i2, i3] = body.inertia_kg_m2;
    u * (i1 * angular.dot(&u)) + w * (i2 * angular.dot(&w)) + normal * (i3 * angular.dot(&normal))
}

fn angular_velocity(body: &Body, orientation: &UnitQuaternion<f64>, momentum: &Vec3) -> Vec3 {
    let (u, w, normal) = rotation::axes(orientation);
    let [j1, j2, j3] = body.inverse_inertia;
    u * (j1 * momentum.dot(&u)) + w * (j2 * momentum.dot(&w)) + normal * (j3 * momentum.dot(&normal))
}

/// Free rotation for a time with this angular momentum, World axes.
fn turned(body: &Body, q: UnitQuaternion<f64>, momentum: &Vec3, time: f64) -> UnitQuaternion<f64> {
    let [i, j, k] = top_axes(&body.inertia_kg_m2);
    let inverse = &body.inverse_inertia;
    let about = |q: UnitQuaternion<f64>, axis: usize, share: f64, time: f64| {
        let (u, w, normal) = rotation::axes(&q);
        let component = momentum.dot(&[u, w, normal][axis]);
        let mut turn = Vec3::zeros();
        turn[axis] = component * share * time;
        q * rotation::exp(turn)
    };
    let rest = inverse[j] - inverse[i];
    let q = about(q, j, rest, 0.5 * time);
    // The spin about the axis is not changed by the precession, so the two turns of the top can be done in turn.
    let q = about(q, k, inverse[k] - inverse[i], time);
    let q = rotation::exp(momentum * (inverse[i] * time)) * q;
    about(q, j, rest, 0.5 * time)
}

/// The axes `i` and `j` with the nearest inverse moments, and the third.
fn top_axes(inertia: &[f64; 3]) -> [usize; 3] {
    let apart = |a: usize, b: usize| (1.0 / inertia[a] - 1.0 / inertia[b]).abs();
    let mut best = [0, 1, 2];
    for axes in [[1, 2, 0], [0, 2, 1]] {
        if apart(axes[0], axes[1]) < apart(best[0], best[1]) {
            best = axes;
        }
    }
    best
}

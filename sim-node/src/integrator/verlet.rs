//! Drift, kick, drift: the exact free motion of symmetric tops for half a step, all forces at once for a
//! whole step, free motion for the other half.
//!
//! The one thing to know: forces are evaluated once, at the middle of the step, so nothing is carried from
//! step to step but the state. Second order; symplectic and reversible without damping and friction.
//!
//! # Free motion
//! A symmetric top keeps its angular momentum `L` and its spin `w3` about its axis `n`; its angular velocity
//! is `L / I1 + w3 (1 - I3 / I1) n`. The first part turns the whole body, the second turns it about its own
//! axis: `q <- exp(t L / I1) q exp(t w3 (1 - I3 / I1) e3)`, exact for any spin and any time.
//!
//! # Kick
//! Gravity and linear drag are solved exactly with the contact force held constant (see `body::Decay`), for
//! rotation along each principal axis. Friction is evaluated with the velocities before the kick; damping
//! with a rate that damping itself has slowed (see `contact`). Both are first order in the step.

use crate::body::Body;
use crate::forces::{Evaluation, SlipMotion};
use crate::integrator::asymmetric;
use crate::state::{Motion, renormalised};
use crate::wrench::{Velocity, Wrench};
use crate::{Model, Scratch, State, motion};
use geometry::{Circle, Vec3, rotation};
use nalgebra::UnitQuaternion;

/// Advances all bodies and contacts by one step; step number and time are the caller's.
pub(crate) fn advance(model: &Model, state: &mut State, scratch: &mut Scratch) {
    let time_step = model.time().time_step_s;
    drift_to_middle(model, state, scratch, 0.5 * time_step);
    motion::place(model, state.sim_time_s + 0.5 * time_step, &mut scratch.moment);
    let velocities = scratch.moment.velocities.as_slice();
    // The velocity before the kick is the velocity between the last evaluation and this one.
    let slip = SlipMotion { since: (velocities, time_step), kept: (velocities, time_step) };
    let pool = scratch.pool.as_ref();
    scratch.evaluation.evaluate(model, &scratch.moment, &state.contacts, slip, pool);
    scratch.keep_springs(&mut state.contacts);
    let (drive, lost) = motion::power(model, &scratch.moment, &scratch.evaluation);
    scratch.drive_work_j = drive * time_step;
    state.dissipated_energy_j += lost * time_step;
    let loses = Evaluation::loses(model);
    state.dissipated_energy_j += match (model.features.gravity, model.features.drag) {
        (false, false) => kick_and_drift::<false, false>(model, state, scratch, loses),
        (false, true) => kick_and_drift::<false, true>(model, state, scratch, loses),
        (true, false) => kick_and_drift::<true, false>(model, state, scratch, loses),
        (true, true) => kick_and_drift::<true, true>(model, state, scratch, loses),
    };
    state.dissipated_energy_j += asymmetric::kick_and_drift(model, state, scratch, loses);
    scratch.evaluation_age_s = 0.5 * time_step;
}

/// Free motion from the state to the middle of the step, into the scratch.
fn drift_to_middle(model: &Model, state: &State, scratch: &mut Scratch, time: f64) {
    asymmetric::drift_to_middle(model, state, scratch, time);
    let tops = &model.bodies()[..model.top_count()];
    for (index, (body, before)) in tops.iter().zip(&state.bodies).enumerate() {
        let mut motion = Motion::of(before);
        let spin = split(body, &motion);
        if !body.pinned {
            motion.position += motion.linear * time;
            motion.orientation = turn(&motion.orientation, &spin, time);
        }
        let circle = Circle::from_pose(motion.position, &motion.orientation, body.major_radius);
        scratch.moment.velocities[index] =
            Velocity { linear: motion.linear, angular: spin.0 + circle.normal * spin.1 };
        scratch.moment.circles[index] = circle;
        scratch.orientations[index] = motion.orientation;
        scratch.precession[index] = spin;
    }
}

/// The kick and the second drift of each body; returns the energy lost. `loses`: there is an inelastic part
/// of the contact forces.
fn kick_and_drift<const GRAVITY: bool, const DRAG: bool>(
    model: &Model,
    state: &mut State,
    scratch: &Scratch,
    loses: bool,
) -> f64 {
    let time = 0.5 * model.time().time_step_s;
    let mut lost = 0.0;
    let tops = &model.bodies()[..model.top_count()];
    for (index, (body, after)) in tops.iter().zip(&mut state.bodies).enumerate() {
        if body.pinned {
            continue;
        }
        let mut acceleration = scratch.evaluation.wrenches[index].force * body.inverse_mass;
        if GRAVITY {
            acceleration += model.gravity();
        }
        let kick = Kick {
            body,
            normal: scratch.moment.circles[index].normal,
            velocity: scratch.moment.velocities[index],
            acceleration,
            torque: scratch.evaluation.wrenches[index].torque,
        };
        let (linear, spin) = kick.apply::<DRAG>();
        if DRAG {
            lost += kick.drag_loss();
        }
        if loses {
            lost -= kick.work(&scratch.evaluation.lost[index]);
        }
        let orientation = renormalised(turn(&scratch.orientations[index], &spin, time));
        let (_, _, normal) = rotation::axes(&orientation);
        let motion = Motion {
            position: scratch.moment.circles[index].centre + linear * time,
            orientation,
            linear,
            angular: spin.0 + normal * spin.1,
        };
        motion.store(after);
    }
    lost
}

/// Angular velocity as `L / I1` and the free spin about the axis.
#[inline]
fn split(body: &Body, motion: &Motion) -> (Vec3, f64) {
    let (_, _, normal) = rotation::axes(&motion.orientation);
    let spin = motion.angular.dot(&normal) * body.spin_share;
    (motion.angular - normal * spin, spin)
}

/// Free rotation for a time.
#[inline]
fn turn(q: &UnitQuaternion<f64>, spin: &(Vec3, f64), time: f64) -> UnitQuaternion<f64> {
    rotation::exp(spin.0 * time) * q * rotation::exp(Vec3::new(0.0, 0.0, spin.1 * time))
}

/// One body at the moment of the kick.
struct Kick<'a> {
    body: &'a Body,
    /// The body's axis.
    normal: Vec3,
    velocity: Velocity,
    /// Of contact and gravity.
    acceleration: Vec3,
    /// Of contact.
    torque: Vec3,
}

impl Kick<'_> {
    /// Angular acceleration about and across the axis.
    #[inline]
    fn angular_acceleration(&self) -> (f64, Vec3) {
        let about = self.torque.dot(&self.normal);
        let across = self.torque - self.normal * about;
        (about * self.body.inverse_axial, across * self.body.inverse_transverse)
    }

    /// Angular velocity about and across the axis.
    #[inline]
    fn angular_velocity(&self) -> (f64, Vec3) {
        let about = self.velocity.angular.dot(&self.normal);
        (about, self.velocity.angular - self.normal * about)
    }

    /// Linear velocity, and angular velocity as free motion splits it, after the kick.
    #[inline]
    fn apply<const DRAG: bool>(&self) -> (Vec3, (Vec3, f64)) {
        let (linear_drag, axial_drag, transverse_drag) =
            (&self.body.linear_drag, &self.body.axial_drag, &self.body.transverse_drag);
        let (about_acceleration, across_acceleration) = self.angular_acceleration();
        let (about, across) = self.angular_velocity();
        let kept = |velocity: Vec3, keep: f64| if DRAG { velocity * keep } else { velocity };
        let linear = kept(self.velocity.linear, linear_drag.keep) + self.acceleration * linear_drag.gain;
        let about = if DRAG { about * axial_drag.keep } else { about } + about_acceleration * axial_drag.gain;
        let across = kept(across, transverse_drag.keep) + across_acceleration * transverse_drag.gain;
        // w = across + about n; the free spin is the share of `about` that is not precession.
        let spin = about * self.body.spin_share;
        (linear, (across + self.normal * (about - spin), spin))
    }

    /// Energy that drag takes during the kick (J).
    fn drag_loss(&self) -> f64 {
        let (v, a) = (self.velocity.linear, self.acceleration);
        let (about_acceleration, across_acceleration) = self.angular_acceleration();
        let (about, across) = self.angular_velocity();
        let linear = self.body.linear_drag.loss(v.norm_squared(), v.dot(&a), a.norm_squared());
        let axial = self.body.axial_drag.loss(
            about * about,
            about * about_acceleration,
            about_acceleration * about_acceleration,
        );
        let transverse = self.body.transverse_drag.loss(
            across.norm_squared(),
            across.dot(&across_acceleration),
            across_acceleration.norm_squared(),
        );
        linear + axial + transverse
    }

    /// Work that a constant wrench does during the kick (J): force times the path that the changing velocity
    /// covers in it.
    fn work(&self, wrench: &Wrench) -> f64 {
        let (about_acceleration, across_acceleration) = self.angular_acceleration();
        let (about, across) = self.angular_velocity();
        let body = self.body;
        let path = self.velocity.linear * body.linear_drag.gain + self.acceleration * body.linear_drag.reach;
        let across = across * body.transverse_drag.gain + across_acceleration * body.transverse_drag.reach;
        let about = about * body.axial_drag.gain + about_acceleration * body.axial_drag.reach;
        wrench.force.dot(&path) + wrench.torque.dot(&(across + self.normal * about))
    }
}

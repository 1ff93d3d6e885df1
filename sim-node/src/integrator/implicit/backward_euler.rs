//! Backward Euler: a step of length `h` finds the velocities `V` at its end with
//! `x = x0 + h v`, `q = exp(h w) q0`, `m v = m v0 + h F(x, q, V)`, `I(q) w = L0 + h T(x, q, V)`; `L0` is the angular
//! momentum at the start, so that no gyroscopic term is needed.
//!
//! The one thing to know: it is of first order and takes energy from every motion: at `omega h = 0.2` a vibration
//! loses 4 % of its energy in a step. Right for what comes to rest, and for previews.
//!
//! Friction's springs are stretched by `h` times the slip of those velocities and shortened to Coulomb's limit at the
//! end: backward Euler, too, so any friction stiffness is stable, and a contact that sticks does not creep.
//!
//! # Source
//! E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II", section IV.3.

use super::jacobian::{self, Share};
use super::system::{Six, System};
use super::{Equations, Found, Part, drag, drag_power, frame, halves, momentum};
use crate::body::Body;
use crate::forces::{Evaluation, SlipMotion};
use crate::state::{Motion, renormalised};
use crate::wrench::Velocity;
use crate::{Scratch, motion};
use geometry::rotation;

pub(super) struct BackwardEuler<'a> {
    pub part: Part<'a>,
}

impl BackwardEuler<'_> {
    fn motion(&self, index: usize, velocity: &Six) -> Motion {
        let (linear, angular) = halves(velocity);
        let base = &self.part.base[index];
        Motion {
            position: base.position + linear * self.part.length,
            orientation: renormalised(rotation::exp(angular * self.part.length) * base.orientation),
            linear,
            angular,
        }
    }
}

impl Equations for BackwardEuler<'_> {
    fn evaluate(&mut self, scratch: &mut Scratch, velocities: &[Six]) {
        let Part { model, end, length, springs, .. } = self.part;
        let Scratch { evaluation, moment, pool, .. } = scratch;
        for (index, (body, velocity)) in model.bodies().iter().zip(velocities).enumerate() {
            let motion = self.motion(index, velocity);
            moment.circles[index] = frame(body, &motion);
            moment.velocities[index] = Velocity { linear: motion.linear, angular: motion.angular };
        }
        motion::place(model, end, moment);
        let slip = SlipMotion { since: (&moment.velocities, length), kept: (&moment.velocities, length) };
        evaluation.evaluate(model, moment, springs, slip, pool.as_deref());
    }

    fn residual(&self, scratch: &Scratch, _: &[Six]) -> Vec<Six> {
        let Part { model, length, .. } = self.part;
        let Scratch { evaluation, moment, .. } = scratch;
        let lack = |(index, body): (usize, &Body)| {
            if body.pinned {
                return [0.0; 6];
            }
            let (base, wrench) = (&self.part.base[index], &evaluation.wrenches[index]);
            let Velocity { linear, angular } = moment.velocities[index];
            let force = wrench.force + model.gravity() * body.mass_kg - linear * drag(body, &linear);
            let torque = wrench.torque - angular * body.axial_drag.drag;
            let r = (linear - base.linear) * body.mass_kg - force * length;
            let turned = momentum(body, &moment.circles[index], &angular);
            let t = turned - base.angular_momentum - torque * length;
            [r.x, r.y, r.z, t.x, t.y, t.z]
        };
        model.bodies().iter().enumerate().map(lack).collect()
    }

    fn system(&mut self, scratch: &Scratch, velocities: &[Six], _: usize) -> System {
        let Part { model, length, .. } = self.part;
        let mut system = self.part.masses(scratch, velocities, 1.0);
        let (stiffness, damping) = (length * length, length);
        let share = Share { stiffness, damping, friction_stiffness: stiffness, friction_damping: damping };
        jacobian::add_contacts(model, scratch, &mut system, None, |_, _| share);
        system
    }

    fn found(&mut self, scratch: &Scratch, velocities: &[Six]) -> Found {
        let (model, moment) = (self.part.model, &scratch.moment);
        let (drive, mut lost) = motion::power(model, moment, &scratch.evaluation);
        let loses = Evaluation::loses(model);
        let mut motions = Vec::with_capacity(velocities.len());
        for (index, (body, velocity)) in model.bodies().iter().zip(velocities).enumerate() {
            let motion = self.motion(index, velocity);
            if !body.pinned {
                lost += drag_power(body, &motion.linear, &motion.angular);
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

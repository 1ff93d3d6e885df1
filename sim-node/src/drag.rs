//! Drag on a body: linear, quadratic and angular coefficients, and the quadratic part of a step of `verlet`.
//!
//! Linear and angular drag are exact in the kick (`body::Decay`). Quadratic drag alone has a closed form too:
//! `v' = -c |v| v / m` gives `v(t) = v / (1 + c |v| t / m)`. `verlet` applies it for half a step before and half a
//! step after all else, a symmetric splitting: second order, exact where nothing else acts, stable for any
//! step. The Runge-Kutta methods have it in their slopes.

use crate::{Model, State};
use geometry::Vec3;
use schemas::scene::{Drag, Forces};

/// Drag coefficients of a ring: its own, or those of all rings.
pub(crate) fn of_ring(own: Option<Drag>, forces: &Forces) -> Drag {
    own.unwrap_or(Drag {
        linear_kg_per_s: forces.linear_drag_kg_per_s,
        quadratic_kg_per_m: forces.quadratic_drag_kg_per_m,
        angular_kg_m2_per_s: forces.angular_drag_kg_m2_per_s,
    })
}

/// A body without drag.
pub(crate) const NONE: Drag =
    Drag { linear_kg_per_s: 0.0, quadratic_kg_per_m: 0.0, angular_kg_m2_per_s: 0.0 };

/// Slows all bodies by quadratic drag for a time; returns the energy taken (J).
pub(crate) fn slow(model: &Model, state: &mut State, time: f64) -> f64 {
    let mut lost = 0.0;
    for (body, pose) in model.bodies().iter().zip(&mut state.bodies) {
        if body.pinned {
            continue;
        }
        let before = Vec3::from(pose.linear_velocity_m_per_s);
        let speed = before.norm_squared().sqrt();
        let kept = 1.0 / (1.0 + body.quadratic_drag * speed * body.inverse_mass * time);
        let after = before * kept;
        lost += 0.5 * body.mass_kg * (before.norm_squared() - after.norm_squared());
        pose.linear_velocity_m_per_s = (after + Vec3::zeros()).into();
    }
    lost
}

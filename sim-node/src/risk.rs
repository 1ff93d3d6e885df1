//! How far a step may go before one body could pass through another unseen.
//!
//! # The bound
//! A body's surface moves by at most `(|v| + a |w|) h` in a step `h`, with the bounding radius `a`; two surfaces
//! approach by at most twice the largest such motion. Two rings' centrelines that are a sum of radii `s` apart
//! cross only after that far, so a step in which no two surfaces move against each other by more than
//! [`SHARE`] of the thinnest sum ends with the contact seen, and not deeper than that share. It is a
//! function of the state alone, and needs no pairs. A body far away that flies fast shortens the step of all:
//! that is the price.
//!
//! # Limits
//! Velocities are those of the state; what forces add within the step is not counted, and a material
//! that is too soft to stop a wire within its radius lets it through at any step.

use crate::Model;
use geometry::Vec3;
use schemas::state::BodyState;

/// Largest approach in a step, as a share of the smallest sum of two wires' radii.
const SHARE: f64 = 0.25;

/// The longest step in which nothing passes through anything (s); infinite where nothing moves.
pub(crate) fn longest_step(model: &Model, bodies: &[BodyState]) -> f64 {
    if bodies.len() < 2 {
        // A half-space cannot be passed through, only entered.
        return f64::INFINITY;
    }
    let mut fastest = 0.0;
    let mut thinnest = f64::INFINITY;
    for (body, state) in model.bodies().iter().zip(bodies) {
        let linear = Vec3::from(state.linear_velocity_m_per_s).norm_squared().sqrt();
        let angular = Vec3::from(state.angular_velocity_rad_per_s).norm_squared().sqrt();
        let speed = linear + body.bounding_radius * angular;
        if speed > fastest {
            fastest = speed;
        }
        if body.minor_radius < thinnest {
            thinnest = body.minor_radius;
        }
    }
    // Both approach by `fastest h`; both are at least as thick as the thinnest.
    SHARE * (2.0 * thinnest) / (2.0 * fastest)
}

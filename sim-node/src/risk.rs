//! How far a step may go before one body could pass through another unseen.
//!
//! # The bound
//! A body's surface moves by at most `(|v| + a |w|) h` in a step `h`, with the bounding radius `a`. Two surfaces
//! that approach at most at `u = |v_A - v_B| + a_A |w_A| + a_B |w_B|` first close the gap of their bounding
//! spheres, and two wires' centrelines, a sum of radii `s` apart, cross only after that far again. So a step of
//! `(gap + SHARE s) / u` ends with the contact seen, and not deeper than [`SHARE`] of `s`. The smallest over all pairs
//! is a function of the state alone.
//!
//! # Cost
//! The fastest body of all gives a bound that needs no pairs. Only where that would shorten the step are pairs
//! looked for: those whose bounding spheres, each wider by its own motion within the step, overlap. A body that flies
//! fast and far away shortens no one's step.
//!
//! # Limits
//! Velocities are those of the state; what forces add within the step is not counted, and a material
//! that is too soft to stop a wire within its radius lets it through at any step. A polynomial body is taken to be as thick
//! as its box of bounds is.

use crate::body::{Body, Shape};
use crate::{Model, broad};
use geometry::Vec3;
use schemas::state::BodyState;

/// Largest approach in a step, as a share of the smallest sum of two wires' radii.
const SHARE: f64 = 0.25;
/// Where a body would go farther than so many of the largest radii, nobody looks for pairs.
const FARTHEST: f64 = 1e6;

/// Working memory; nothing in it changes a result.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    search: broad::Workspace,
    centres: Vec<Vec3>,
    radii: Vec<f64>,
    pairs: Vec<(u32, u32)>,
}

/// The longest step up to `limit` in which nothing passes through anything (s); `limit` where nothing does.
pub(crate) fn longest_step(
    model: &Model,
    bodies: &[BodyState],
    limit: f64,
    workspace: &mut Workspace,
) -> f64 {
    if bodies.len() < 2 {
        // A half-space cannot be passed through, only entered.
        return limit;
    }
    let (mut fastest, mut largest) = (0.0, 0.0);
    let mut thinnest = f64::INFINITY;
    for (body, state) in model.bodies().iter().zip(bodies) {
        let speed = surface_speed(body, state);
        fastest = if speed > fastest { speed } else { fastest };
        largest = if body.bounding_radius > largest { body.bounding_radius } else { largest };
        let thickness = thickness(body);
        thinnest = if thickness < thinnest { thickness } else { thinnest };
    }
    // Both approach by `fastest h`; both are at least as thick as the thinnest.
    let anyone = SHARE * (2.0 * thinnest) / (2.0 * fastest);
    if anyone >= limit {
        return limit;
    }
    if !(fastest * limit <= FARTHEST * largest) {
        return anyone;
    }
    among_pairs(model, bodies, limit, workspace)
}

fn among_pairs(model: &Model, bodies: &[BodyState], limit: f64, workspace: &mut Workspace) -> f64 {
    let Workspace { search, centres, radii, pairs } = workspace;
    centres.clear();
    centres.extend(bodies.iter().map(|state| Vec3::from(state.position_m)));
    radii.clear();
    let all = model.bodies().iter().zip(bodies);
    radii.extend(all.map(|(body, state)| body.bounding_radius + surface_speed(body, state) * limit));
    broad::find_pairs(model.broad_phase(), centres, radii, 0.0, search, pairs);
    let mut longest = limit;
    for &(a, b) in pairs.iter().filter(|&&(a, b)| model.interacts(a, b)) {
        let (a, b) = (a as usize, b as usize);
        let (body_a, body_b) = (&model.bodies()[a], &model.bodies()[b]);
        let linear = |body: usize| Vec3::from(bodies[body].linear_velocity_m_per_s);
        let apart = (centres[a] - centres[b]).norm_squared().sqrt();
        let gap = apart - body_a.bounding_radius - body_b.bounding_radius;
        let gap = if gap > 0.0 { gap } else { 0.0 };
        let relative = (linear(a) - linear(b)).norm_squared().sqrt();
        let approach = relative + turning_speed(body_a, &bodies[a]) + turning_speed(body_b, &bodies[b]);
        let step = (gap + SHARE * (thickness(body_a) + thickness(body_b))) / approach;
        longest = if step < longest { step } else { longest };
    }
    longest
}

/// The largest speed of a point of a body, or more (m/s).
fn surface_speed(body: &Body, state: &BodyState) -> f64 {
    Vec3::from(state.linear_velocity_m_per_s).norm_squared().sqrt() + turning_speed(body, state)
}

fn turning_speed(body: &Body, state: &BodyState) -> f64 {
    body.bounding_radius * Vec3::from(state.angular_velocity_rad_per_s).norm_squared().sqrt()
}

/// Radius of a wire, or half of how thick a body is where it is thinnest (m).
fn thickness(body: &Body) -> f64 {
    let least = |v: &Vec3| {
        let pair = if v.x < v.y { v.x } else { v.y };
        if v.z < pair { v.z } else { pair }
    };
    match &body.shape {
        Shape::Ring { .. } | Shape::Sphere { .. } | Shape::Capsule { .. } => body.minor_radius,
        Shape::Box { core_m, edge_radius_m } => least(core_m) + edge_radius_m,
        Shape::Polynomial { half_extents_m, .. } => least(half_extents_m),
    }
}

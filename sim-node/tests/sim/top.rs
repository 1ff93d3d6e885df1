//! Torque-free symmetric top: `R(t) = exp(t L / I1) R0 exp(t w3 (1 - I3 / I1) e3)`, with the angular momentum
//! `L` and the spin `w3` about the axis constant.

use crate::support::{Run, check, one_ring, order};
use geometry::Vec3;
use nalgebra::{Quaternion, UnitQuaternion};
use schemas::state::BodyState;

const MATERIAL: &str = "[material.wire]";
const R: f64 = 1.0;
const WIRE: f64 = 0.18;
const I1: f64 = 0.625 * WIRE * WIRE + 0.5 * R * R;
const I3: f64 = 0.75 * WIRE * WIRE + R * R;

fn quaternion(body: &BodyState) -> UnitQuaternion<f64> {
    let [x, y, z, w] = body.orientation;
    UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
}

fn angular_momentum(body: &BodyState) -> Vec3 {
    let n = quaternion(body) * Vec3::z();
    let w = Vec3::from(body.angular_velocity_rad_per_s);
    w * I1 + n * ((I3 - I1) * w.dot(&n))
}

/// Spins a ring for `duration_s`; returns the angle (rad) between its pose and the closed form, and the
/// relative error of its angular momentum.
fn errors(
    integrator: &str,
    start: UnitQuaternion<f64>,
    l: Vec3,
    time_step_s: f64,
    duration_s: f64,
) -> (f64, f64) {
    errors_with(integrator, MATERIAL, start, l, time_step_s, duration_s)
}

/// The same with settings of the method before the material.
fn errors_with(
    integrator: &str,
    head: &str,
    start: UnitQuaternion<f64>,
    l: Vec3,
    time_step_s: f64,
    duration_s: f64,
) -> (f64, f64) {
    let mut run =
        Run::new(&one_ring(time_step_s, duration_s, integrator, head, "position_m = [0.0, 0.0, 0.0]"));
    let n = start * Vec3::z();
    let spin = l.dot(&n) / I3;
    let w = l / I1 + n * (spin * (1.0 - I3 / I1));
    let body = &mut run.state.bodies[0];
    body.orientation = start.into_inner().coords.into();
    body.angular_velocity_rad_per_s = w.into();
    run.finish();
    let precession = UnitQuaternion::from_scaled_axis(l * (duration_s / I1));
    let own = UnitQuaternion::from_scaled_axis(Vec3::z() * (spin * (1.0 - I3 / I1) * duration_s));
    let expected = precession * start * own;
    let body = &run.state.bodies[0];
    let scale = if l.norm() > 0.0 { l.norm() } else { 1.0 };
    (quaternion(body).angle_to(&expected), (angular_momentum(body) - l).norm() / scale)
}

fn tilted() -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vec3::x() * 0.35)
}

#[test]
fn verlet_turns_a_free_top_exactly() {
    // Each step rounds the pose and the velocity by some 1e-16 relative, which turns the pose by as much
    // times the angle still to come: with N steps and a total angle A at most about N A 1e-16.
    let l = Vec3::new(0.3, -0.2, 1.1);
    let (angle, momentum) = errors("verlet", tilted(), l, 1e-2, 10.0);
    check("A1 angle (rad)", angle, 1000.0 * 22.0 * 1e-16);
    check("A1 angular momentum", momentum, 1000.0 * 4e-16);

    let l = Vec3::new(0.0, 0.0, 2.0);
    let nearly_flat = UnitQuaternion::from_scaled_axis(Vec3::x() * (2e-10_f64).sqrt());
    let (angle, momentum) = errors("verlet", nearly_flat, l, 1e-2, 10.0);
    check("A2 angle (rad)", angle, 1000.0 * 40.0 * 1e-16);
    check("A2 angular momentum", momentum, 1000.0 * 4e-16);

    let l = Vec3::new(0.6, 0.0, 0.8) * (1e4 * I1);
    let (angle, momentum) = errors("verlet", tilted(), l, 1e-3, 1.0);
    check("A3 (1e4 rad/s) angle (rad)", angle, 1000.0 * 1e4 * 1e-16);
    check("A3 angular momentum", momentum, 1000.0 * 4e-16);

    let (angle, momentum) = errors("verlet", tilted(), Vec3::zeros(), 1e-2, 10.0);
    check("A4 angle (rad)", angle, 1e-15);
    check("A4 angular momentum", momentum, 0.0);
}

#[test]
fn rk4_turns_a_free_top_with_fourth_order() {
    let l = Vec3::new(0.3, -0.2, 1.1);
    let (coarse, _) = errors("rk4", tilted(), l, 2e-2, 10.0);
    let (fine, _) = errors("rk4", tilted(), l, 1e-2, 10.0);
    let observed = order(coarse, fine);
    println!("errors {coarse:.2e} and {fine:.2e} rad: order {observed:.2}");
    // The leading error is of order 4; the next one is |w| h = 0.04 smaller.
    assert!((observed - 4.0).abs() < 0.15, "{observed}");
}

#[test]
fn dopri5_turns_a_free_top_within_its_tolerance() {
    let l = Vec3::new(0.3, -0.2, 1.1);
    let head = "tolerance = 1e-10\n absolute_tolerance = 1e-10\n [material.wire]";
    let (angle, momentum) = errors_with("dopri5", head, tilted(), l, 0.04, 10.0);
    // At each inner step an error of 1e-10 relative to the radius; 22 rad take some hundreds of them, and what
    // is wrong in the spin grows with the time left.
    check("angle (rad)", angle, 500.0 * 1e-10 * 22.0);
    check("angular momentum", momentum, 500.0 * 1e-10);
}

#[test]
fn quaternions_stay_unit() {
    for integrator in ["verlet", "rk4", "dopri5"] {
        let ring = "position_m = [0.0, 0.0, 0.0]\n angular_velocity_rad_per_s = [30.0, -20.0, 10.0]";
        let mut run = Run::new(&one_ring(1e-3, 10.0, integrator, MATERIAL, ring));
        run.finish();
        let length = quaternion(&run.state.bodies[0]).into_inner().norm();
        check(&format!("{integrator}: quaternion's length less 1"), (length - 1.0).abs(), 4e-16);
    }
}

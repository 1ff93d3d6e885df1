//! Bounces with closed forms: a ring that falls flat on a plane touches all round, so its contact is one
//! spring of stiffness `2 pi R k`; a sphere on a plane is one spring anyway.

use crate::support::{Run, check, one_ring, order};
use geometry::Vec3;
use schemas::scene::Scene;

const PI: f64 = core::f64::consts::PI;
/// Speed of approach (m/s).
const V0: f64 = 2.0;

/// What a bounce looked like.
struct Bounce {
    restitution: f64,
    contact_time_s: f64,
    depth_m: f64,
}

/// Runs until well after the bounce. The body approaches along -z with `V0` from just above the plane z = 0;
/// `rest` is the height of its centre when it touches.
fn bounce(text: &str, rest: f64) -> Bounce {
    let mut run = Run::new(text);
    let time_step = run.model.time().time_step_s;
    let (mut pushed, mut lowest) = (0_u64, f64::INFINITY);
    let count = run.model.time().step_count();
    for _ in 0..count {
        let before = run.state.bodies[0].linear_velocity_m_per_s[2];
        run.step();
        let body = &run.state.bodies[0];
        pushed += u64::from(body.linear_velocity_m_per_s[2] != before);
        if body.position_m[2] < lowest {
            lowest = body.position_m[2];
        }
    }
    let restitution = run.state.bodies[0].linear_velocity_m_per_s[2] / V0;
    Bounce { restitution, contact_time_s: pushed as f64 * time_step, depth_m: rest - lowest }
}

/// A ring falling flat; `k` and the dampings are those of the line law.
fn flat_ring(integrator: &str, k: f64, damping: &str, steps_per_radian: f64) -> (Bounce, f64) {
    let omega = (2.0 * PI * k).sqrt();
    let time_step = 1.0 / (omega * steps_per_radian);
    let head = format!(
        "[material.wire]\n line_stiffness_n_per_m2 = {k:?}\n {damping}\n \
         [[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = 0.0\n material = \"wire\""
    );
    let ring = format!("position_m = [0.0, 0.0, 0.18001]\n linear_velocity_m_per_s = [0.0, 0.0, -{V0:?}]");
    let duration = 8.0 / omega;
    (bounce(&one_ring(time_step, duration, integrator, &head, &ring), 0.18), omega)
}

#[test]
fn undamped_ring_bounces_with_its_whole_circle() {
    for (integrator, steps_per_radian) in [("verlet", 500.0), ("rk4", 500.0)] {
        let (bounce, omega) = flat_ring(integrator, 1e4, "", steps_per_radian);
        let h = 1.0 / steps_per_radian;
        // Onset and end of contact fall inside a step, where the force has a kink: speed is wrong by h^2 / 2 at
        // most at each, depth by the method's h^2 / 24 and by half a step's movement at the lowest point.
        check(&format!("{integrator}: restitution"), (bounce.restitution - 1.0).abs(), h * h);
        check(
            &format!("{integrator}: contact time in steps"),
            (bounce.contact_time_s * omega / PI - 1.0).abs() * PI / h,
            2.0,
        );
        check(&format!("{integrator}: depth"), (bounce.depth_m * omega / V0 - 1.0).abs(), h * h);
    }
}

/// Restitution of a Kelvin-Voigt contact that never pulls: it ends when the force is zero, before the
/// penetration is. `e = exp(-2 z acos(z) / sqrt(1 - z^2))`.
fn kelvin_voigt(ratio: f64) -> (f64, f64, f64) {
    let root = (1.0 - ratio * ratio).sqrt();
    let angle = libm::acos(ratio);
    (libm::exp(-2.0 * ratio * angle / root), 2.0 * angle / root, libm::exp(-ratio * angle / root))
}

#[test]
fn ring_with_kelvin_voigt_damping() {
    let (k, ratio) = (1e4, 0.2);
    let c = 2.0 * ratio * (k / (2.0 * PI)).sqrt();
    let (restitution, time, depth) = kelvin_voigt(ratio);
    let mut errors = Vec::new();
    for steps_per_radian in [200.0, 400.0] {
        let damping = format!("line_damping_n_s_per_m2 = {c:?}");
        let (bounce, omega) = flat_ring("verlet", k, &damping, steps_per_radian);
        let h = 1.0 / steps_per_radian;
        // The force jumps to c v0 at the onset, which falls inside a step: the speed is off by at most half a
        // step of it, a part ratio h, there and then by the same growth at the end, where e = 0.57 is left.
        let allowed = 2.0 * ratio * h / restitution;
        check("verlet: restitution", (bounce.restitution / restitution - 1.0).abs(), allowed);
        check("verlet: depth", (bounce.depth_m * omega / (V0 * depth) - 1.0).abs(), 2.0 * ratio * h);
        check("verlet: time in steps", (bounce.contact_time_s * omega - time).abs() / h, 3.0);
        errors.push((bounce.restitution / restitution - 1.0).abs());
    }
    let (bounce, _) = flat_ring("rk4", k, &format!("line_damping_n_s_per_m2 = {c:?}"), 400.0);
    let allowed = 2.0 * ratio / 400.0 / restitution;
    check("rk4: restitution", (bounce.restitution / restitution - 1.0).abs(), allowed);
    println!("verlet: errors {errors:?}");
}

#[test]
fn ring_with_hunt_crossley_damping() {
    // m v dv/dd = -K d (1 + z v) has the integral v / z - ln(1 + z v) / z^2 + K d^2 / (2 m): at the way in
    // (v0, d = 0) and out (-v1, d = 0) it is the same.
    let z = 0.2;
    let damping = format!("damping_s_per_m = {z}");
    for (integrator, steps_per_radian) in [("verlet", 400.0), ("rk4", 400.0)] {
        let (bounce, _) = flat_ring(integrator, 1e4, &damping, steps_per_radian);
        let v1 = bounce.restitution * V0;
        let before = z * V0 - libm::log(1.0 + z * V0);
        let after = -z * v1 - libm::log(1.0 - z * v1);
        println!("{integrator}: restitution {:.4}", bounce.restitution);
        // First order in verlet (as above, with a damping of z v0 at the deepest); smooth in rk4.
        let allowed = if integrator == "verlet" { z * V0 / steps_per_radian } else { 1e-4 };
        check(&format!("{integrator}: the integral's change"), (after / before - 1.0).abs(), allowed);
    }
}

#[test]
fn sphere_with_kelvin_voigt_damping() {
    let (k, mass, radius) = (1e4_f64, 0.5, 0.3);
    for (integrator, ratio) in [("verlet", 0.0), ("verlet", 0.3), ("rk4", 0.0), ("rk4", 0.3)] {
        let omega = (k / mass).sqrt();
        let c = 2.0 * ratio * (k * mass).sqrt();
        let steps_per_radian = 400.0;
        let h = 1.0 / steps_per_radian;
        let text = format!(
            r#"
            [time]
            duration_s = {:?}
            time_step_s = {:?}
            [method]
            integrator = "{integrator}"
            [material.rubber]
            point_stiffness_n_per_m = {k:?}
            point_damping_n_s_per_m = {c:?}
            [[sphere]]
            radius_m = {radius}
            mass_kg = {mass}
            material = "rubber"
            position_m = [0.1, -0.2, 0.30001]
            linear_velocity_m_per_s = [0.0, 0.0, -{V0:?}]
            [[plane]]
            normal = [0.0, 0.0, 1.0]
            offset_m = 0.0
            material = "rubber"
            "#,
            8.0 / omega,
            1.0 / (omega * steps_per_radian)
        );
        let bounce = bounce(&text, radius);
        let (restitution, time, depth) = kelvin_voigt(ratio);
        // As for the ring: the jump of the force at the onset.
        let allowed = 2.0 * ratio * h / restitution + h * h;
        let name = format!("{integrator}, ratio {ratio}");
        check(&format!("{name}: restitution"), (bounce.restitution / restitution - 1.0).abs(), allowed);
        check(&format!("{name}: depth"), (bounce.depth_m * omega / (V0 * depth) - 1.0).abs(), allowed);
        check(&format!("{name}: time in steps"), (bounce.contact_time_s * omega - time).abs() / h, 3.0);
    }
}

#[test]
fn bounce_on_an_edge_is_second_order() {
    // A ring that falls on its edge: the contact is an arc that grows and shrinks. There is no closed form, so
    // a much finer run stands in for it. Where in a step the onset falls adds an error of the same order and
    // of any sign; the mean square over twelve heights of fall evens it out.
    let place = |time_step_s: f64, height: f64| {
        let head = "[material.wire]\n line_stiffness_n_per_m2 = 1e5\n [forces]\n \
                    gravity_m_per_s2 = [0.0, 0.0, -9.81]\n [[plane]]\n normal = [0.0, 0.0, 1.0]\n \
                    offset_m = 0.0\n material = \"wire\"";
        let ring = format!("position_m = [0.0, 0.0, {height:?}]\n orientation = [0.0, 0.6, 0.0, 0.8]");
        let mut run = Run::new(&one_ring(time_step_s, 0.4, "verlet", head, &ring));
        run.finish();
        Vec3::from(run.state.bodies[0].position_m)
    };
    let mut squares = [0.0; 3];
    for index in 0..12 {
        let height = 1.3 + 0.0137 * f64::from(index);
        let exact = place(1e-5, height);
        for (square, time_step_s) in squares.iter_mut().zip([8e-4, 4e-4, 2e-4]) {
            *square += (place(time_step_s, height) - exact).norm_squared();
        }
    }
    let errors = squares.map(|square: f64| (square / 12.0).sqrt());
    let observed = order(errors[0], errors[2]) / 2.0;
    println!("errors of place {errors:?} m, order {observed:.2}");
    // Second order; and the errors of the onset, where the force begins as depth to the power 3/2, fall
    // with order 2.5, so what is seen lies between. Twelve values leave a quarter of an order of doubt.
    assert!(observed > 1.75 && observed < 2.75, "{observed}");
}

#[test]
fn contact_law_mixes_materials_as_documented() {
    // Two materials: harmonic mean of stiffnesses 1e4 and 3e4 is 1.5e4.
    let text = r#"
        [time]
        duration_s = 0.1
        time_step_s = 2e-5
        [material.soft]
        point_stiffness_n_per_m = 1e4
        [material.hard]
        point_stiffness_n_per_m = 3e4
        [[sphere]]
        radius_m = 0.3
        mass_kg = 0.5
        material = "soft"
        position_m = [0.0, 0.0, 0.30001]
        linear_velocity_m_per_s = [0.0, 0.0, -2.0]
        [[plane]]
        normal = [0.0, 0.0, 1.0]
        offset_m = 0.0
        material = "hard"
        "#;
    assert!(Scene::parse(text, &[]).is_ok());
    let bounce = bounce(text, 0.3);
    let omega = (1.5e4_f64 / 0.5).sqrt();
    let h = 2e-5 * omega;
    check("depth", (bounce.depth_m * omega / V0 - 1.0).abs(), h * h);
}

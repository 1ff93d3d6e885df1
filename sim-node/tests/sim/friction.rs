//! Coulomb friction on an incline: a ring lying flat sticks without creep while `tan a <= mu`, and slides
//! with `g (sin a - mu cos a)` beyond, in every direction alike.

use crate::support::{Run, check, one_ring};
use geometry::Vec3;

const G: f64 = 9.81;
/// tan of the incline.
const SLOPE: f64 = 0.5;
const K: f64 = 1e4;
const FRICTION_STIFFNESS: f64 = 1e3;

/// A ring lying flat in equilibrium on the plane z = 0; gravity leans by the incline towards the direction
/// (cos, sin) in the plane.
fn incline(mu: f64, direction: (f64, f64), integrator: &str, duration_s: f64) -> Run {
    let cos = 1.0 / (1.0 + SLOPE * SLOPE).sqrt();
    let sin = SLOPE * cos;
    let (x, y) = (G * sin * direction.0, G * sin * direction.1);
    let head = format!(
        "[forces]\n gravity_m_per_s2 = [{x:?}, {y:?}, {:?}]\n [material.wire]\n \
         line_stiffness_n_per_m2 = {K:?}\n line_damping_n_s_per_m2 = 200.0\n friction_coefficient = {mu:?}\n \
         friction_stiffness_n_per_m = {FRICTION_STIFFNESS:?}\n \
         [[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = 0.0\n material = \"wire\"",
        -G * cos
    );
    let mut run = Run::new(&one_ring(5e-4, duration_s, integrator, &head, "position_m = [0.0, 0.0, 0.181]"));
    let depth = G * cos / (2.0 * core::f64::consts::PI * K);
    run.state.bodies[0].position_m[2] = 0.18 - depth;
    run
}

fn along(run: &Run, direction: (f64, f64)) -> f64 {
    let [x, y, _] = run.state.bodies[0].position_m;
    x * direction.0 + y * direction.1
}

const DIRECTIONS: [(f64, f64); 4] =
    [(1.0, 0.0), (0.0, 1.0), (0.866_025_403_784_438_6, 0.5), (-0.5, 0.866_025_403_784_438_6)];

#[test]
fn ring_sticks_without_creep() {
    for integrator in ["verlet", "rk4", "backward-euler", "energy-decaying"] {
        for direction in DIRECTIONS {
            let mut run = incline(0.6, direction, integrator, 6.0);
            run.steps(4000);
            let early = along(&run, direction);
            run.finish();
            let late = along(&run, direction);
            check(&format!("{integrator}: creep from 2 s to 6 s (m)"), (late - early).abs(), 1e-9);
            // The spring holds exactly m g sin; what it had slipped before it held does not matter.
            let hold = G * SLOPE / (1.0 + SLOPE * SLOPE).sqrt();
            let spring = Vec3::from(run.state.contacts[0].spring_m).norm();
            check("spring (m)", (spring - hold / FRICTION_STIFFNESS).abs(), 1e-9);
        }
    }
}

#[test]
fn ring_slides_with_the_difference() {
    let mu = 0.3;
    let cos = 1.0 / (1.0 + SLOPE * SLOPE).sqrt();
    let expected = G * cos * (SLOPE - mu);
    for integrator in ["verlet", "rk4", "backward-euler", "energy-decaying"] {
        let mut measured = Vec::new();
        for direction in DIRECTIONS {
            let mut run = incline(mu, direction, integrator, 2.0);
            let speed = |run: &Run| {
                let [x, y, _] = run.state.bodies[0].linear_velocity_m_per_s;
                x * direction.0 + y * direction.1
            };
            run.steps(2000);
            let early = speed(&run);
            run.finish();
            let acceleration = speed(&run) - early;
            // The ring was set down level and has to lean first; what is left of that after one second moves
            // the normal force by less than a millionth.
            check(&format!("{integrator}: acceleration"), (acceleration / expected - 1.0).abs(), 1e-6);
            measured.push(acceleration);
        }
        let spread = measured
            .iter()
            .fold(0.0, |m: f64, a| if (a - measured[0]).abs() > m { (a - measured[0]).abs() } else { m });
        check(&format!("{integrator}: difference between directions (m/s^2)"), spread, 1e-7);
    }
}

#[test]
fn sphere_rolls_down_without_slipping() {
    // Rolling solid sphere: a = g sin / (1 + 2/5), while tan a <= 3.5 mu.
    let mut run = Run::new(
        r#"
        [time]
        duration_s = 2.0
        time_step_s = 5e-4
        [forces]
        gravity_m_per_s2 = [3.0, 0.0, -9.0]
        [material.rubber]
        point_stiffness_n_per_m = 1e5
        point_damping_n_s_per_m = 100.0
        friction_coefficient = 0.8
        friction_stiffness_n_per_m = 2e4
        [[sphere]]
        radius_m = 0.5
        mass_kg = 1.0
        material = "rubber"
        position_m = [0.0, 0.0, 0.501]
        [[plane]]
        normal = [0.0, 0.0, 1.0]
        offset_m = 0.0
        material = "rubber"
        "#,
    );
    run.steps(2000);
    let early = run.state.bodies[0].linear_velocity_m_per_s[0];
    run.finish();
    let body = &run.state.bodies[0];
    let acceleration = body.linear_velocity_m_per_s[0] - early;
    check("acceleration", (acceleration / (3.0 / 1.4) - 1.0).abs(), 2e-3);
    // The lever is the radius less half the penetration of m g / k = 9e-5 m: a part 1e-4 of it.
    let slip = body.linear_velocity_m_per_s[0] - 0.5 * body.angular_velocity_rad_per_s[1];
    check("slip over speed", (slip / body.linear_velocity_m_per_s[0]).abs(), 5e-4);
}

#[test]
fn sliding_ring_on_its_edge_begins_to_roll() {
    // It slides with -mu g and spins up until v = w (R + r); then it rolls with v0 / (1 + g), where
    // g = I3 / (m (R + r)^2) = 0.73564, from the time v0 g / (mu g0 (1 + g)) on.
    let (v0, mu, outer) = (2.0, 0.3, 1.18);
    let share = (0.75 * 0.0324 + 1.0) / (outer * outer);
    let head = format!(
        "[forces]\n gravity_m_per_s2 = [0.0, 0.0, -{G}]\n [material.wire]\n \
         line_stiffness_n_per_m2 = 1e6\n line_damping_n_s_per_m2 = 2e3\n friction_coefficient = {mu}\n \
         friction_stiffness_n_per_m = 1e5\n \
         [[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = 0.0\n material = \"wire\""
    );
    let ring = format!(
        "position_m = [0.0, 0.0, {outer}]\n orientation = [-0.7071067811865476, 0.0, 0.0, 0.7071067811865476]\n \
         linear_velocity_m_per_s = [{v0:?}, 0.0, 0.0]"
    );
    let rolls_after = v0 * share / (mu * G * (1.0 + share));
    for integrator in ["verlet", "rk4", "backward-euler", "energy-decaying"] {
        let mut run = Run::new(&one_ring(1e-4, 1.2 * rolls_after, integrator, &head, &ring));
        let while_sliding = (0.5 * rolls_after / 1e-4) as u64;
        run.steps(while_sliding);
        let speed = run.state.bodies[0].linear_velocity_m_per_s[0];
        let expected = v0 - mu * G * while_sliding as f64 * 1e-4;
        // The ring was set down at no penetration, so the normal force needs some milliseconds to be m g.
        check(&format!("{integrator}: sliding speed"), (speed / expected - 1.0).abs(), 2e-3);
        run.finish();
        let speed = run.state.bodies[0].linear_velocity_m_per_s[0];
        // The lever is shorter by the penetration of 3e-4 m, and the last slip is stretched into the spring.
        check(&format!("{integrator}: rolling speed"), (speed * (1.0 + share) / v0 - 1.0).abs(), 2e-3);
    }
}

#[test]
fn friction_only_remembers_contacts_that_rub() {
    let mut smooth = Run::new(include_str!("../../../scenes/two-rings.toml"));
    smooth.finish();
    assert!(smooth.state.contacts.is_empty());
    let mut rough = incline(0.6, (1.0, 0.0), "verlet", 0.1);
    rough.finish();
    assert_eq!(rough.state.contacts.len(), 1);
    let spring = Vec3::from(rough.state.contacts[0].spring_m);
    assert!(spring.x < 0.0 && spring.z.abs() < 1e-6 * spring.norm(), "{spring:?}");
}

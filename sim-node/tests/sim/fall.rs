//! Fall with linear drag: `v = v_end + (v0 - v_end) exp(-t / T)`, `T = m / c`, `v_end = g T`, and
//! `x = x0 + v_end t + (v0 - v_end) T (1 - exp(-t / T))`; rotation decays about and across the axis.

use crate::support::{Run, check, one_ring, order};

const G: f64 = 9.81;
const DRAG: f64 = 0.8;

fn fall(integrator: &str, time_step_s: f64) -> (f64, f64) {
    let head = format!(
        "[forces]\n gravity_m_per_s2 = [0.0, 0.0, -{G}]\n linear_drag_kg_per_s = {DRAG}\n [material.wire]"
    );
    let ring = "position_m = [0.0, 0.0, 5.0]\n linear_velocity_m_per_s = [1.0, 0.0, 3.0]";
    let mut run = Run::new(&one_ring(time_step_s, 2.0, integrator, &head, ring));
    run.finish();
    let body = &run.state.bodies[0];
    let (t, decay_time) = (2.0, 1.0 / DRAG);
    let left = libm::exp(-t / decay_time);
    let end = -G * decay_time;
    let speed = end + (3.0 - end) * left;
    let height = 5.0 + end * t + (3.0 - end) * decay_time * (1.0 - left);
    let along = decay_time * (1.0 - left);
    let speed_error = (body.linear_velocity_m_per_s[2] - speed).abs();
    let position_error =
        (body.position_m[2] - height).abs() + (body.position_m[0] - along).abs() + body.position_m[1].abs();
    (speed_error, position_error)
}

#[test]
fn verlet_has_the_exact_speed_and_second_order_in_place() {
    let (speed, coarse) = fall("verlet", 2e-2);
    // Every step multiplies by exp(-h / T) once: 100 roundings.
    check("speed (m/s)", speed, 100.0 * 2e-16 * 12.0);
    let (_, fine) = fall("verlet", 1e-2);
    let observed = order(coarse, fine);
    println!("place errors {coarse:.2e} and {fine:.2e} m: order {observed:.3}");
    assert!((observed - 2.0).abs() < 0.02, "{observed}");
}

#[test]
fn rk4_has_fourth_order() {
    let (coarse, fine) = (fall("rk4", 4e-2), fall("rk4", 2e-2));
    for (name, observed) in [("speed", order(coarse.0, fine.0)), ("place", order(coarse.1, fine.1))] {
        println!("{name}: order {observed:.3}");
        assert!((observed - 4.0).abs() < 0.1, "{name}: {observed}");
    }
}

#[test]
fn free_fall_without_drag_is_exact() {
    let head = format!("[forces]\n gravity_m_per_s2 = [0.0, 0.0, -{G}]\n [material.wire]");
    for integrator in ["verlet", "rk4"] {
        let mut run = Run::new(&one_ring(1e-2, 1.0, integrator, &head, "position_m = [0.0, 0.0, 0.0]"));
        run.finish();
        let height = run.state.bodies[0].position_m[2];
        // A parabola is of second degree: both methods have it but for 100 roundings of 5 m.
        check(&format!("{integrator}: height (m)"), (height + 0.5 * G).abs(), 100.0 * 1e-15);
    }
}

#[test]
fn spin_decays_about_and_across_the_axis() {
    let drag = 0.4;
    let head = format!("[forces]\n angular_drag_kg_m2_per_s = {drag}\n [material.wire]");
    let (i1, i3) = (0.625 * 0.0324 + 0.5, 0.75 * 0.0324 + 1.0);
    let ring = "position_m = [0.0, 0.0, 0.0]\n angular_velocity_rad_per_s = [0.0, 0.0, 7.0]";
    let mut run = Run::new(&one_ring(1e-2, 2.0, "verlet", &head, ring));
    run.finish();
    let [x, y, z] = run.state.bodies[0].angular_velocity_rad_per_s;
    let expected = 7.0 * libm::exp(-drag * 2.0 / i3);
    // 200 steps, each rounds some 1e-16 of 7 rad/s a few times.
    check("about the axis (rad/s)", (z - expected).abs() + x.abs() + y.abs(), 200.0 * 5e-15);
    let ring = "position_m = [0.0, 0.0, 0.0]\n angular_velocity_rad_per_s = [7.0, 0.0, 0.0]";
    let mut run = Run::new(&one_ring(1e-2, 2.0, "verlet", &head, ring));
    run.finish();
    let [x, y, z] = run.state.bodies[0].angular_velocity_rad_per_s;
    let expected = 7.0 * libm::exp(-drag * 2.0 / i1);
    check("across the axis (rad/s)", (x - expected).abs() + y.abs() + z.abs(), 200.0 * 5e-15);
}

#[test]
fn drag_takes_what_is_missing() {
    let head = format!(
        "[forces]\n linear_drag_kg_per_s = {DRAG}\n angular_drag_kg_m2_per_s = 0.3\n [material.wire]"
    );
    let ring = "position_m = [0.0, 0.0, 0.0]\n linear_velocity_m_per_s = [1.0, 2.0, 3.0]\n \
                angular_velocity_rad_per_s = [3.0, -2.0, 4.0]";
    for (integrator, allowed) in [("verlet", 1e-12), ("rk4", 1.3e-6)] {
        let mut run = Run::new(&one_ring(1e-2, 2.0, integrator, &head, ring));
        let (before, _) = sim_node::mechanical_energy(&run.model, &run.state);
        run.finish();
        let (after, _) = sim_node::mechanical_energy(&run.model, &run.state);
        let missing = before - after - run.state.dissipated_energy_j;
        println!("{integrator}: {before:.3} J before, {after:.3} J after");
        // Verlet integrates the loss in closed form: rounding of 200 steps of 20 J. Runge-Kutta's error is of
        // the order of (|w| h)^4 / 120 of 18.6 J, with |w| h = 0.054 rad.
        check(&format!("{integrator}: unaccounted energy (J)"), missing.abs(), allowed);
    }
}

//! Materials given by what they do: restitution, damping ratio, and Hertz's contact modulus.

use crate::support::{Run, check, order};
use sim_node::{Records, evaluate};

/// A ball or a ring in flat flight towards a floor, without gravity; returns speed after over speed before.
fn bounce(integrator: &str, time_step_s: f64, material: &str, body: &str, speed: f64) -> f64 {
    let text = format!(
        r#"
        [time]
        duration_s = 0.3
        time_step_s = {time_step_s:?}
        [method]
        integrator = "{integrator}"
        [material.rubber]
        {material}
        [[plane]]
        normal = [0.0, 0.0, 1.0]
        offset_m = 0.0
        material = "rubber"
        {body}
        mass_kg = 0.7
        material = "rubber"
        position_m = [0.0, 0.0, 0.2001]
        linear_velocity_m_per_s = [0.0, 0.0, -{speed:?}]
        "#
    );
    let mut run = Run::new(&text);
    run.finish();
    run.state.bodies[0].linear_velocity_m_per_s[2] / speed
}

const BALL: &str = "[[sphere]]\n radius_m = 0.2";
const RING: &str = "[[ring]]\n major_radius_m = 0.6\n minor_radius_m = 0.2";

#[test]
fn restitution_is_what_the_material_says() {
    for e in [0.2, 0.5, 0.9] {
        for (what, law, body) in [
            ("ball, linear", "point_stiffness_n_per_m = 2e4", BALL),
            ("ball, Hertz", "contact_modulus_pa = 1e5", BALL),
            ("ring", "line_stiffness_n_per_m2 = 1e4", RING),
            ("ring, modulus", "contact_modulus_pa = 2e4", RING),
        ] {
            let material = format!("{law}\nrestitution = {e:?}\nrestitution_speed_m_per_s = 2.0");
            // rk4 takes damping as it is; the contacts last some 400 steps and more, and their onset is all that is
            // left of its error.
            let measured = bounce("rk4", 5e-5, &material, body, 2.0);
            check(&format!("{what}: restitution {e} by rk4"), (measured - e).abs(), 2e-4);
            // verlet weakens damping by a share that vanishes with the step.
            let errors = [1e-4, 5e-5].map(|h| (bounce("verlet", h, &material, body, 2.0) - e).abs());
            check(&format!("{what}: restitution {e} by verlet"), errors[1], 0.02);
            let observed = order(errors[0], errors[1]);
            println!("{what}: order {observed:.2} at {e}");
            assert!(observed > 0.8 || errors[1] < 1e-3, "{what} {e}: {errors:?}");
        }
    }
    // Slower is bouncier: with e = 0.5 at 2 m/s, an impact at 0.02 m/s loses about a hundredth of that.
    let material = "point_stiffness_n_per_m = 2e4\nrestitution = 0.5\nrestitution_speed_m_per_s = 2.0";
    let slow = bounce("rk4", 5e-5, material, BALL, 0.02);
    assert!(slow > 0.98 && slow < 1.0, "{slow}");
}

/// Kelvin-Voigt with the clamp at zero force: `e = exp(-2 z acos(z) / sqrt(1 - z^2))`.
#[test]
fn damping_ratio_is_that_of_the_lightest_ball() {
    for z in [0.1_f64, 0.5] {
        let material = format!("point_stiffness_n_per_m = 2e4\ndamping_ratio = {z:?}");
        let measured = bounce("rk4", 5e-5, &material, BALL, 2.0);
        let expected = libm::exp(-2.0 * z * libm::acos(z) / (1.0 - z * z).sqrt());
        // The onset jumps by c v and falls within a step of a contact of some 370.
        check(&format!("restitution at ratio {z}"), (measured - expected).abs(), 3e-3);
    }
}

/// Force of two bodies pressed together by hand, read from the reaction of the first one, which is pinned.
fn press(material: &str, bodies: &str, second_m: [f64; 3]) -> (f64, f64) {
    let text = format!(
        "[time]\n duration_s = 1.0\n time_step_s = 1e-9\n [record]\n reactions = true\n [material.steel]\n \
         {material}\n {bodies}"
    );
    let mut run = Run::new(&text);
    let last = run.state.bodies.len() - 1;
    run.state.bodies[last].position_m = second_m;
    evaluate(&run.model, &run.state, &mut run.scratch);
    let record = Records::after(schemas::Hash::default()).record(&run.model, &run.state, &run.scratch);
    let pins = record.reactions.expect("asked for").pins;
    let [x, y, z] = pins[0].force_n;
    ((x * x + y * y + z * z).sqrt(), record.contact_energy_j)
}

fn crossed_rings(major: f64, minor: f64) -> String {
    let ring = |place: &str, more: &str| {
        format!(
            "[[ring]]\n major_radius_m = {major:?}\n minor_radius_m = {minor:?}\n mass_kg = 1.0\n \
             material = \"steel\"\n position_m = {place}\n {more}\n"
        )
    };
    let upright = "orientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]\n pinned = true";
    // Linked: the second one's wire passes through the first one's hole.
    ring("[0.0, 0.0, 0.0]", upright) + &ring(&format!("[0.0, {:?}, 0.0]", -(2.0 * major - 3.0 * minor)), "")
}

#[test]
fn crossed_wires_press_as_hertz_says() {
    let (modulus, minor) = (1e9, 1e-3);
    for (ratio, what) in [(1e-5, "nearly straight"), (0.15, "a fair ring"), (0.25, "a thick ring")] {
        let major: f64 = minor / ratio;
        let bodies = crossed_rings(major, minor);
        for depth in [1e-8, 1e-7] {
            let second = [0.0, -(2.0 * major - 2.0 * minor + depth), 0.0];
            let (force, energy) = press(&format!("contact_modulus_pa = {modulus:?}"), &bodies, second);
            // 4/3 E* sqrt(radius) d^1.5 with the curvatures 1/r across and -1/(R - r) along each wire.
            let radius = 1.0 / (1.0 / minor - 1.0 / (major - minor));
            let hertz = 4.0 / 3.0 * modulus * radius.sqrt() * depth * depth.sqrt();
            let expected = hertz / (1.0 - ratio).sqrt();
            // First terms in depth over wire, and rounding of the gap against the ring's size.
            let allowed = 4.0 * depth / minor + 4e-16 * major / depth;
            check(&format!("{what}, depth {depth:e} m: force"), (force / expected - 1.0).abs(), allowed);
            check(
                &format!("{what}, depth {depth:e} m: energy"),
                (energy / (0.4 * expected * depth) - 1.0).abs(),
                allowed,
            );
        }
    }
}

#[test]
fn spheres_press_as_hertz_says() {
    let ball = |radius: f64, place: &str, pinned: bool| {
        format!(
            "[[sphere]]\n radius_m = {radius:?}\n mass_kg = 1.0\n material = \"steel\"\n position_m = {place}\n \
             pinned = {pinned}\n"
        )
    };
    let bodies = ball(0.2, "[0.0, 0.0, 0.0]", true) + &ball(0.3, "[0.0, 0.0, 0.6]", false);
    let (depth, modulus): (f64, f64) = (1e-3, 7e6);
    let (force, energy) = press("contact_modulus_pa = 7e6", &bodies, [0.0, 0.0, 0.5 - depth]);
    let expected = 4.0 / 3.0 * modulus * 0.12_f64.sqrt() * depth * depth.sqrt();
    // Rounding of the gap: 1e-16 of 0.5 m in 1 mm, one and a half times.
    check("ball on ball", (force / expected - 1.0).abs(), 1e-13);
    check("its energy", (energy / (0.4 * expected * depth) - 1.0).abs(), 2e-13);
    // A material with a point stiffness beside it: the two in series have no law of Hertz; the point law holds.
    let (linear, _) = press("point_stiffness_n_per_m = 3e4", &bodies, [0.0, 0.0, 0.5 - depth]);
    check("linear", (linear / (3e4 * depth) - 1.0).abs(), 1e-12);
}

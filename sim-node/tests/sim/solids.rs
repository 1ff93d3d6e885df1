//! Capsules and boxes: free motion, bounces, rest, friction, energy and momentum.

use crate::support::{Run, check, order};
use geometry::Vec3;
use schemas::scene::Scene;
use sim_node::{Model, Scratch, mechanical_energy};

/// A scene with this time, head and bodies; the material is `matter`.
fn scene(time_step_s: f64, duration_s: f64, integrator: &str, material: &str, rest: &str) -> String {
    format!(
        r#"
        [time]
        duration_s = {duration_s:?}
        time_step_s = {time_step_s:?}
        frames_per_second = 1.0
        [method]
        integrator = "{integrator}"
        [material.matter]
        {material}
        {rest}
        "#
    )
}

/// A free box of 1 kg with these half extents and angular velocity.
fn spinning(integrator: &str, time_step_s: f64, duration_s: f64, half: [f64; 3], angular: [f64; 3]) -> Run {
    let body = format!(
        "[[box]]\n half_extents_m = {half:?}\n mass_kg = 1.0\n material = \"matter\"\n \
         position_m = [0.0, 0.0, 0.0]\n angular_velocity_rad_per_s = {angular:?}"
    );
    Run::new(&scene(time_step_s, duration_s, integrator, "", &body))
}

/// Angular velocity in the body's own axes, by its quaternion.
fn body_angular(run: &Run) -> Vec3 {
    let body = &run.state.bodies[0];
    let [x, y, z, w] = body.orientation;
    let q = nalgebra::UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
    q.inverse_transform_vector(&Vec3::from(body.angular_velocity_rad_per_s))
}

const HALF: [f64; 3] = [0.3, 0.5, 0.9];

/// Euler's equations for the same box, in its own axes, by the classical Runge-Kutta method with tiny steps.
fn euler(angular: [f64; 3], duration_s: f64) -> Vec3 {
    let [a, b, c] = HALF.map(|half| half * half / 3.0);
    let (i1, i2, i3) = (b + c, c + a, a + b);
    let rate = |w: &Vec3| {
        Vec3::new((i2 - i3) / i1 * w.y * w.z, (i3 - i1) / i2 * w.z * w.x, (i1 - i2) / i3 * w.x * w.y)
    };
    let steps = 100_000;
    let h = duration_s / f64::from(steps);
    let mut w = Vec3::from(angular);
    for _ in 0..steps {
        let k1 = rate(&w);
        let k2 = rate(&(w + k1 * (0.5 * h)));
        let k3 = rate(&(w + k2 * (0.5 * h)));
        let k4 = rate(&(w + k3 * h));
        w += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
    }
    w
}

#[test]
fn a_free_box_turns_as_eulers_equations_say() {
    // Nearly about the intermediate axis, which is y: it tumbles over and over.
    let angular = [0.1, 6.0, 0.05];
    let exact = euler(angular, 4.0);
    for (integrator, expected, coarse) in [("verlet", 2.0, 4e-3), ("rk4", 4.0, 8e-3)] {
        let errors = [coarse, 0.5 * coarse, 0.25 * coarse].map(|time_step_s| {
            let mut run = spinning(integrator, time_step_s, 4.0, HALF, angular);
            run.finish();
            (body_angular(&run) - exact).norm()
        });
        let observed = order(errors[0], errors[2]) / 2.0;
        println!("{integrator}: errors {errors:?} rad/s, order {observed:.2}, expected {expected}");
        // Of the classical Runge-Kutta method the term of fourth order happens to be small here.
        assert!(observed > expected - 0.3 && observed < expected + 1.3, "{observed}");
        assert!(errors[0] < 1e-4);
    }
}

#[test]
fn a_free_box_keeps_its_angular_momentum_to_rounding_and_its_energy_bounded() {
    let angular = [0.1, 6.0, 0.05];
    let mut run = spinning("verlet", 2e-3, 40.0, HALF, angular);
    let [a, b, c] = HALF.map(|half| half * half / 3.0);
    let moments = Vec3::new(b + c, c + a, a + b);
    let momentum = |run: &Run| {
        let body = &run.state.bodies[0];
        let [x, y, z, w] = body.orientation;
        let q = nalgebra::UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
        q * moments.component_mul(&body_angular(run))
    };
    let (first, (energy, _)) = (momentum(&run), mechanical_energy(&run.model, &run.state));
    let (mut worst, mut swing) = (0.0, 0.0);
    for _ in 0..20_000 {
        run.step();
        let off = (momentum(&run) - first).norm() / first.norm();
        worst = if off > worst { off } else { worst };
        let change = (mechanical_energy(&run.model, &run.state).0 / energy - 1.0).abs();
        swing = if change > swing { change } else { swing };
    }
    // The state holds the angular velocity: making momentum of it and back costs a few roundings of 1e-16, at
    // worst all in one direction for 20,000 steps.
    check("angular momentum, relative", worst, 1e-11);
    // (h w)^2 = 1.4e-4 times a number below one, and not growing with time.
    check("energy, relative", swing, 1.4e-4);
}

const FLOOR: &str = "[[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = 0.0\n material = \"matter\"\n";
const GRAVITY: &str = "[forces]\n gravity_m_per_s2 = [0.0, 0.0, -9.81]\n";

#[test]
fn bodies_bounce_off_a_box_and_energy_and_momentum_are_kept() {
    let bodies = r#"
        [[ring]]
        major_radius_m = 0.5
        minor_radius_m = 0.1
        mass_kg = 0.4
        material = "matter"
        position_m = [1.4, 0.3, 0.2]
        linear_velocity_m_per_s = [-2.0, 0.1, -0.3]
        orientation = [0.3, 0.5, 0.1, 0.8062257748298549]
        [[sphere]]
        radius_m = 0.2
        mass_kg = 0.5
        material = "matter"
        position_m = [-1.2, 0.1, 0.3]
        linear_velocity_m_per_s = [2.0, 0.2, 0.0]
        [[capsule]]
        radius_m = 0.15
        half_length_m = 0.4
        mass_kg = 0.6
        material = "matter"
        position_m = [0.1, -1.3, 0.2]
        linear_velocity_m_per_s = [0.0, 2.0, 0.3]
        orientation = [0.3, 0.1, 0.4, 0.8602325267042627]
        [[box]]
        half_extents_m = [0.3, 0.4, 0.5]
        edge_radius_m = 0.05
        mass_kg = 1.0
        material = "matter"
        position_m = [0.0, 0.0, 0.0]
        [[box]]
        half_extents_m = [0.2, 0.3, 0.25]
        mass_kg = 0.8
        material = "matter"
        position_m = [0.1, 1.5, 0.2]
        linear_velocity_m_per_s = [0.0, -2.0, 0.1]
        angular_velocity_rad_per_s = [1.0, 2.0, 3.0]
        "#;
    let material = "line_stiffness_n_per_m2 = 1e5\n point_stiffness_n_per_m = 1e5";
    let run = |integrator: &str, h: f64| {
        let mut run = Run::new(&scene(h, 1.2, integrator, material, bodies));
        let (before, _) = mechanical_energy(&run.model, &run.state);
        let start = momenta(&run);
        let mut pushed = [false; 5];
        let count = run.model.time().step_count();
        for _ in 0..count {
            let old: Vec<_> = run.state.bodies.iter().map(|body| body.linear_velocity_m_per_s).collect();
            run.step();
            for (pushed, (old, new)) in pushed.iter_mut().zip(old.iter().zip(&run.state.bodies)) {
                *pushed |= *old != new.linear_velocity_m_per_s;
            }
        }
        assert_eq!(pushed, [true; 5], "every body meets another one");
        let (after, _) = mechanical_energy(&run.model, &run.state);
        let end = momenta(&run);
        let linear = (end.0 - start.0).norm();
        let angular = (end.1 - start.1).norm();
        ((after / before - 1.0).abs(), linear, angular)
    };
    let (energy, linear, angular) = run("verlet", 5e-5);
    // Forces are opposite to the last bit; 24,000 steps of roundings of some 1e-16.
    check("momentum (N s)", linear, 1e-12);
    check("angular momentum (N m s)", angular, 1e-11);
    // The stiffest mode is of some 1,000 rad/s: (h w)^2 / 24 is 1e-4 while in contact; what is left
    // afterwards is what the kinks at onset and end of contacts, and of Gauss points, leave.
    check("energy after the bounces, relative", energy, 1e-3);
    let (energy, ..) = run("rk4", 5e-5);
    check("energy with rk4, relative", energy, 1e-4);
}

/// Sums of momentum and of angular momentum about the origin.
fn momenta(run: &Run) -> (Vec3, Vec3) {
    let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
    for (body, state) in run.model.bodies().iter().zip(&run.state.bodies) {
        let [x, y, z, w] = state.orientation;
        let q = nalgebra::UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
        let velocity = Vec3::from(state.linear_velocity_m_per_s) * body.mass_kg;
        let spin = q.inverse_transform_vector(&Vec3::from(state.angular_velocity_rad_per_s));
        linear += velocity;
        angular += Vec3::from(state.position_m).cross(&velocity)
            + q * Vec3::from(body.inertia_kg_m2).component_mul(&spin);
    }
    (linear, angular)
}

#[test]
fn a_stack_of_boxes_and_a_lying_capsule_come_to_rest() {
    let bodies = r#"
        [[capsule]]
        radius_m = 0.1
        half_length_m = 0.3
        mass_kg = 0.5
        material = "matter"
        position_m = [2.0, 0.0, 0.1001]
        orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]
        [[box]]
        half_extents_m = [0.4, 0.4, 0.2]
        edge_radius_m = 0.02
        mass_kg = 2.0
        material = "matter"
        position_m = [0.0, 0.0, 0.2001]
        [[box]]
        half_extents_m = [0.3, 0.3, 0.15]
        mass_kg = 1.0
        material = "matter"
        position_m = [0.03, 0.01, 0.5502]
        orientation = [0.0, 0.0, 0.13, 0.9915139938498094]
        [[box]]
        half_extents_m = [0.2, 0.1, 0.3]
        edge_radius_m = 0.05
        mass_kg = 0.5
        material = "matter"
        position_m = [0.0, 0.05, 1.0003]
        "#;
    let material = "line_stiffness_n_per_m2 = 2e5\n point_stiffness_n_per_m = 1e5\n \
                    damping_s_per_m = 30.0\n friction_coefficient = 0.5\n friction_stiffness_n_per_m = 2e4";
    let mut run = Run::new(&scene(1e-4, 3.0, "verlet", material, &format!("{GRAVITY}{FLOOR}{bodies}")));
    let start: Vec<_> = run.state.bodies.clone();
    run.finish();
    for (index, (body, start)) in run.state.bodies.iter().zip(&start).enumerate() {
        let speed = Vec3::from(body.linear_velocity_m_per_s).norm();
        let moved = (Vec3::from(body.position_m) - Vec3::from(start.position_m)).norm();
        check(&format!("speed of body {index} (m/s)"), speed, 1e-4);
        // It sinks by its weight over the stiffness, about 1e-4 m, and what the gaps at the start were.
        check(&format!("way of body {index} (m)"), moved, 2e-3);
    }
}

#[test]
fn a_box_on_a_slope_sticks_below_the_angle_of_friction_and_slides_above() {
    let angle = libm::atan(0.4);
    let normal = [libm::sin(angle), 0.0, libm::cos(angle)];
    // The box lies on the slope: turned by the angle about y.
    let (sin, cos) = (libm::sin(0.5 * angle), libm::cos(0.5 * angle));
    let position = [0.2001 * normal[0], 0.0, 0.2001 * normal[2]];
    let rest = |friction: f64| {
        let material = format!(
            "point_stiffness_n_per_m = 1e5\n damping_s_per_m = 30.0\n friction_coefficient = {friction:?}\n \
             friction_stiffness_n_per_m = 5e4"
        );
        let body = format!(
            "{GRAVITY}[[plane]]\n normal = {normal:?}\n offset_m = 0.0\n material = \"matter\"\n \
             [[box]]\n half_extents_m = [0.4, 0.3, 0.2]\n mass_kg = 1.0\n material = \"matter\"\n \
             position_m = {position:?}\n orientation = [0.0, {sin:?}, 0.0, {cos:?}]"
        );
        let mut run = Run::new(&scene(1e-4, 1.0, "verlet", &material, &body));
        run.steps(5000);
        let half = Vec3::from(run.state.bodies[0].position_m);
        let speed = Vec3::from(run.state.bodies[0].linear_velocity_m_per_s).norm();
        run.finish();
        let last = Vec3::from(run.state.bodies[0].linear_velocity_m_per_s).norm();
        ((Vec3::from(run.state.bodies[0].position_m) - half).norm(), last - speed)
    };
    let (creep, _) = rest(0.5);
    // No creep: what is left of the settling after half a second.
    check("creep on a slope of 0.4 with friction 0.5 (m)", creep, 1e-6);
    let (_, gain) = rest(0.2);
    // a = g (sin - mu cos) = g cos (0.4 - 0.2), for half a second.
    let expected = 0.5 * 9.81 * libm::cos(angle) * 0.2;
    check("speed gained while sliding, relative error", (gain / expected - 1.0).abs(), 1e-3);
}

#[test]
fn solids_have_the_same_bits_with_everything_on_and_from_any_state() {
    let material = "damping_s_per_m = 3.0\n friction_coefficient = 0.4";
    let bodies = r#"
        [[capsule]]
        radius_m = 0.1
        half_length_m = 0.3
        mass_kg = 0.5
        material = "matter"
        position_m = [0.1, 0.0, 0.6]
        orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]
        [[box]]
        half_extents_m = [0.4, 0.3, 0.2]
        edge_radius_m = 0.02
        mass_kg = 2.0
        material = "matter"
        position_m = [0.0, 0.0, 0.2001]
        angular_velocity_rad_per_s = [0.0, 0.0, 2.0]
        "#;
    let text = scene(1e-4, 1.0, "verlet", material, &format!("{GRAVITY}{FLOOR}{bodies}"));
    let (mut run, mut all) = (Run::new(&text), Run::new(&text));
    all.model = Model::compile_everything_on(&Scene::parse(&text, &[]).unwrap()).unwrap().0;
    all.scratch = Scratch::new(&all.model, 1);
    for _ in 0..4 {
        run.steps(500);
        all.steps(500);
        assert_eq!(run.state, all.state);
        assert!(!run.state.contacts.is_empty(), "friction has something to remember");
        run.scratch = Scratch::new(&run.model, 1);
    }
}

#[test]
fn gaps_and_overlaps_of_solids_are_told_by_name() {
    let bodies = |x: f64| {
        format!(
            "[[capsule]]\n radius_m = 0.1\n half_length_m = 0.3\n mass_kg = 1.0\n material = \"matter\"\n \
             position_m = [{x:?}, 0.0, 0.0]\n \
             [[box]]\n half_extents_m = [0.4, 0.4, 0.2]\n edge_radius_m = 0.05\n mass_kg = 2.0\n \
             material = \"matter\"\n position_m = [0.0, 0.0, 0.0]"
        )
    };
    let compile = |x: f64| {
        let text = scene(1e-4, 1.0, "verlet", "", &bodies(x));
        Model::compile(&Scene::parse(&text, &[]).unwrap()).map(|_| ())
    };
    assert_eq!(compile(0.5), Ok(()), "touching");
    let message = compile(0.48).unwrap_err().to_string();
    println!("{message}");
    assert!(message.starts_with("capsule 0 and box 0 overlap at the start: their gap is -2"), "{message}");
}

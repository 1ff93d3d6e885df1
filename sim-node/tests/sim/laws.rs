//! The contact laws beside the default: rest, period, energy, momentum, bits.

use crate::conservation::total;
use crate::support::{Run, check};
use schemas::scene::Scene;
use sim_node::{Model, Scratch, State, step};

/// Every law and sampler, as keys of `method`.
const METHODS: [&str; 8] = [
    r#"contact_law = "centreline-minima""#,
    r#"contact_law = "surface-integral""#,
    r#"contact_law = "surface-integral"
       surface = { sampler = "uniform-angles", average = "all-samples" }"#,
    r#"contact_law = "surface-integral"
       surface = { sampler = "uniform" }"#,
    r#"contact_law = "surface-integral"
       surface = { sampler = "stratified" }"#,
    r#"contact_law = "surface-integral"
       surface = { sampler = "sobol" }"#,
    r#"contact_law = "surface-integral"
       surface = { sampler = "patch", samples = 64 }"#,
    r#"contact_law = "surface-integral"
       surface = { average = "all-samples" }"#,
];

/// Rings and spheres of different sizes thrown at each other, some of them onto a plane, with damping and friction.
const COLLISION: &str = r#"
    [material.wire]
    line_stiffness_n_per_m2 = 2e5
    point_stiffness_n_per_m = 2e5
    surface_stiffness_n_per_m3 = 2e6
    damping_s_per_m = 0.1
    point_damping_n_s_per_m = 5.0
    surface_damping_n_s_per_m3 = 100.0
    friction_coefficient = 0.4
    friction_stiffness_n_per_m = 1e4
    [[ring]]
    major_radius_m = 1.0
    minor_radius_m = 0.18
    mass_kg = 1.0
    material = "wire"
    position_m = [0.0, 0.0, 0.0]
    angular_velocity_rad_per_s = [1.0, 2.0, 3.0]
    [[ring]]
    major_radius_m = 0.8
    minor_radius_m = 0.1
    mass_kg = 0.7
    material = "wire"
    position_m = [1.1, 0.1, 0.0]
    orientation = [0.6, 0.0, 0.0, 0.8]
    linear_velocity_m_per_s = [-3.0, 0.5, 0.0]
    [[ring]]
    major_radius_m = 1.0
    minor_radius_m = 0.18
    mass_kg = 2.0
    material = "wire"
    position_m = [-2.6, 0.0, 0.3]
    linear_velocity_m_per_s = [4.0, 0.0, 0.1]
    angular_velocity_rad_per_s = [0.0, -5.0, 1.0]
    [[sphere]]
    radius_m = 0.6
    mass_kg = 1.5
    material = "wire"
    position_m = [0.2, 0.1, 2.0]
    linear_velocity_m_per_s = [0.0, 0.0, -5.0]
    [[sphere]]
    radius_m = 0.4
    mass_kg = 0.5
    material = "wire"
    position_m = [0.3, 0.2, 3.1]
    linear_velocity_m_per_s = [0.0, 0.0, -6.0]
"#;

const PLANE: &str = r#"
    [[plane]]
    normal = [0.0, 0.0, 1.0]
    offset_m = -1.2
    material = "wire"
"#;

fn collision(method: &str, integrator: &str, rest: &str) -> Run {
    let head = format!(
        "[time]\nduration_s = 0.4\ntime_step_s = 2e-4\n[method]\nintegrator = \"{integrator}\"\n{method}\n"
    );
    Run::new(&format!("{head}{COLLISION}{rest}"))
}

#[test]
fn every_law_keeps_momentum_and_the_same_bits() {
    for method in METHODS {
        for integrator in ["verlet", "rk4"] {
            let mut run = collision(method, integrator, "");
            let (before, mut met) = (total(&run), false);
            let mut half = None;
            for step in 0..2000 {
                if step == 1000 {
                    half = Some(run.state.clone());
                }
                run.step();
                met |= !run.state.contacts.is_empty();
            }
            let after = total(&run);
            // Roundings of forces of 1e3 N over 2e-4 s, 8000 times; angular momentum with levers of up to 4 m, and to the
            // order of the step where a body turns: rk4's orientation is exact to h^5 in each.
            check(&format!("{integrator}, {method}: momentum lost"), (after.0 - before.0).norm(), 1e-12);
            let angular = if integrator == "rk4" { 1e-7 } else { 1e-11 };
            check("   angular momentum lost", (after.1 - before.1).norm(), angular);
            assert!(met, "nothing was hit");
            // Going on from the middle gives the same bits.
            let mut again = collision(method, integrator, "");
            again.state = half.expect("the middle was passed");
            again.steps(1000);
            assert_eq!(again.state, run.state, "{method}: a continued run differs");
        }
    }
}

#[test]
fn parts_forced_on_and_threads_change_no_bit() {
    for method in METHODS {
        let text = format!(
            "[time]\nduration_s = 0.02\ntime_step_s = 1e-3\n[method]\n{method}\n
            [forces]\ngravity_m_per_s2 = [0.0, 9.81, 0.0]
            [material.wire]\npoint_stiffness_n_per_m = 1e3\nsurface_stiffness_n_per_m3 = 1e5
            [[weave]]\npattern = \"european-4-in-1\"\nrows = 34\ncolumns = 30
            major_radius_m = 1.0\nminor_radius_m = 0.24\nring_mass_kg = 1.1\nmaterial = \"wire\"\npins = [[0, 0]]"
        );
        let scene = Scene::parse(&text, &[]).expect("the scene is right");
        let (plain, _) = Model::compile(&scene).expect("it can be simulated");
        let (everything, _) = Model::compile_everything_on(&scene).expect("it can be simulated");
        let end = |model: &Model, threads: usize| {
            let (mut state, mut scratch) = (State::initial(model), Scratch::new(model, threads));
            // Pressed together so that linked rings touch.
            for body in &mut state.bodies {
                body.position_m = body.position_m.map(|x| 0.94 * x);
            }
            for _ in 0..3 {
                step(model, &mut state, &mut scratch).expect("the run goes on");
            }
            state
        };
        let expected = end(&plain, 1);
        let pushed = expected.bodies.iter().filter(|body| body.linear_velocity_m_per_s[0] != 0.0).count();
        assert!(pushed > 500, "{method}: only {pushed} rings are pushed");
        for threads in [2, 3, 8] {
            assert_eq!(end(&plain, threads), expected, "{method} with {threads} threads");
        }
        assert_eq!(end(&everything, 1), expected, "{method} with everything on");
    }
}

#[test]
fn shapes_without_the_law_are_refused() {
    let text = "[time]\nduration_s = 1.0\ntime_step_s = 1e-5\n[method]\ncontact_law = \"surface-integral\"\n[material.wire]\n[[capsule]]
        radius_m = 0.1\nhalf_length_m = 0.5\nmass_kg = 1.0\nmaterial = \"wire\"\nposition_m = [0.0, 0.0, 0.0]";
    let scene = Scene::parse(text, &[]).expect("the scene is right");
    let message = Model::compile(&scene).expect_err("there is no law for it").to_string();
    println!("{message}");
    for part in ["method.contact_law = surface-integral", "capsule 0", "centreline-arc"] {
        assert!(message.contains(part), "{part} is missing in: {message}");
    }
}

/// A ring that hangs in a pinned one, in its own plane, with what is appended to `method`; gravity along -x so that it
/// hangs below the fixed ring's inner side.
fn hanging(method: &str, material: &str, time_step_s: f64) -> Run {
    Run::new(&format!(
        r#"
        [time]
        duration_s = 100.0
        time_step_s = {time_step_s:?}
        [method]
        {method}
        [forces]
        gravity_m_per_s2 = [9.81, 0.0, 0.0]
        [material.wire]
        {material}
        [[ring]]
        major_radius_m = 1.0
        minor_radius_m = 0.18
        mass_kg = 1.0
        material = "wire"
        position_m = [0.0, 0.0, 0.0]
        pinned = true
        [[ring]]
        major_radius_m = 1.0
        minor_radius_m = 0.18
        mass_kg = 1.0
        material = "wire"
        position_m = [1.64, 0.0, 0.0]
        orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]
        "#
    ))
}

/// At rest a ring hangs as deep as its law says: the surface law at 1 % of r where its tabled force (relative to stiffness,
/// 2.332392252e-6 m^3) carries the ring, a minimum's spring at m g / k.
#[test]
fn a_hanging_ring_rests_at_its_depth() {
    let surface_stiffness = 9.81 / 2.332392252e-06;
    let surface =
        format!("surface_stiffness_n_per_m3 = {surface_stiffness:?}\nsurface_damping_n_s_per_m3 = 4e4");
    let point = "point_stiffness_n_per_m = 1e4\npoint_damping_n_s_per_m = 100.0";
    for (method, material, expected, allowed) in [
        // 2x8 points: the force is right to 1.1e-7, and the depth to half of that.
        (METHODS[1], surface.as_str(), 0.0018, 2e-7),
        // 64 Sobol points, new ones in each step: 2e-2 of the force each, shaking a spring that averages over a period.
        (METHODS[6], surface.as_str(), 0.0018, 3e-2),
        (METHODS[0], point, 9.81 / 1e4, 1e-9),
    ] {
        let mut run = hanging(method, material, 1e-3);
        run.steps(10_000);
        let depth = run.state.bodies[1].position_m[0] - 1.64;
        check(&format!("{method}: depth {depth:.9}, error"), (depth / expected - 1.0).abs(), allowed);
    }
}

/// Without friction the hanging ring swings in its own plane like a pendulum of length R - 2 r + depth, at a small
/// amplitude.
#[test]
fn a_hanging_ring_swings_with_its_period() {
    let surface_stiffness = 9.81 / 2.332392252e-06;
    let material = format!("surface_stiffness_n_per_m3 = {surface_stiffness:?}");
    let mut run = hanging(METHODS[1], &material, 5e-4);
    let length = 1.0 - 0.36 + 0.0018;
    let amplitude = 1e-3;
    run.state.bodies[1].position_m =
        [1.0 + length * libm::cos(amplitude), 0.0, length * libm::sin(amplitude)];
    let (mut crossings, mut before) = (Vec::new(), run.state.bodies[1].position_m[2]);
    while crossings.len() < 11 {
        run.step();
        let after = run.state.bodies[1].position_m[2];
        if (before < 0.0) != (after < 0.0) {
            crossings.push(run.state.sim_time_s - run.model.time().time_step_s * after / (after - before));
        }
        before = after;
    }
    let period = (crossings[10] - crossings[0]) / 5.0;
    // A swing by t moves the contact round the fixed wire, whose bending there is 1/r - cos t / (R - r cos t): larger by
    // the part c t^2 / 2 with c = R / (R - r)^2 / kappa, so that the contact's energy at rest, m g depth / 3, goes with
    // the root of it down. That takes c depth / (6 length) off the pendulum's stiffness.
    let (major, minor, depth) = (1.0, 0.18, 0.0018);
    let kappa = 1.0 / minor - 1.0 / (major - minor);
    let softer = major / ((major - minor) * (major - minor)) / kappa * depth / (6.0 * length);
    let expected = 2.0 * std::f64::consts::PI * (length / (9.81_f64 * (1.0 - softer))).sqrt();
    println!("the bending of the fixed wire makes the period longer by {:.1e}", 0.5 * softer);
    // That correction is of first order in depth / r = 0.01, and 8e-5 itself; the amplitude adds 1e-6 / 16, the
    // second-order step (w h)^2 / 24 = 1.6e-7.
    check(&format!("period {period:.6} s, error"), (period / expected - 1.0).abs(), 2e-5);
}

/// Undamped, what the contacts store comes back: the energy error falls with the step, down to what the quadrature's
/// own error leaves (its points move with the patch, so its sum is the gradient of an energy to that error only).
#[test]
fn surface_contacts_conserve_energy_with_the_order_of_the_method() {
    let drift = |integrator: &str, time_step_s: f64| {
        let text = format!(
            "[time]\nduration_s = 0.2\ntime_step_s = {time_step_s:?}\n[method]\nintegrator = \"{integrator}\"\n{}
            {}",
            METHODS[1],
            COLLISION
                .replace("damping_s_per_m = 0.1", "damping_s_per_m = 0.0")
                .replace("damping_n_s_per_m = 5.0", "damping_n_s_per_m = 0.0")
                .replace("damping_n_s_per_m3 = 100.0", "damping_n_s_per_m3 = 0.0")
                .replace("friction_coefficient = 0.4", "friction_coefficient = 0.0")
        );
        let mut run = Run::new(&text);
        let energy = |run: &Run| sim_node::mechanical_energy(&run.model, &run.state).0;
        let start = energy(&run);
        run.finish();
        // By the end the bodies have parted again: all energy is kinetic.
        (energy(&run) / start - 1.0).abs()
    };
    for integrator in ["verlet", "rk4"] {
        let errors = [4e-4, 2e-4, 1e-4].map(|time_step| drift(integrator, time_step));
        println!("{integrator}: {errors:?} of the energy at 0.4, 0.2 and 0.1 ms");
        // Depths up to a fifth of the wire, where the quadrature is good to 1e-4 of the contact's energy.
        check(&format!("{integrator}: energy gained or lost"), errors[2], 3e-5);
    }
}

/// Rings and spheres come to rest on a plane under every law, and stay there.
#[test]
fn bodies_come_to_rest_on_a_plane() {
    for method in METHODS {
        let mut text = format!("[time]\nduration_s = 3.0\ntime_step_s = 2e-4\n[method]\n{method}\n");
        text += "[forces]\ngravity_m_per_s2 = [0.0, 0.0, -9.81]\n";
        text += COLLISION;
        text += PLANE;
        let mut run = Run::new(&text);
        run.finish();
        for (body, state) in run.model.bodies().iter().zip(&run.state.bodies) {
            let height = state.position_m[2] + 1.2;
            assert!(height > 0.0 && height < 4.0, "{method}: {body:?} is at {height} m over the plane");
        }
    }
}

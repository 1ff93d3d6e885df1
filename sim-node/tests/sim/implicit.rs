//! The implicit method: its order, stiffness far beyond the explicit bound, and what is refused.

use crate::support::{Drop, Run, check, one_ring, order};
use geometry::Vec3;
use schemas::Hash;
use schemas::scene::Scene;
use sim_node::{Model, Records, Scratch, check_audit, evaluate, step};

const METHODS: [(&str, f64); 2] = [("backward-euler", 1.0), ("energy-decaying", 2.0)];

#[test]
fn a_vibration_is_followed_with_the_methods_order() {
    // A ball that presses on its plane: z = 0.499 + 5e-4 cos(100 t).
    let error = |integrator: &str, time_step_s: f64| {
        let text = format!(
            r#"
            [time]
            duration_s = 0.05
            time_step_s = {time_step_s:?}
            [method]
            integrator = "{integrator}"
            [forces]
            gravity_m_per_s2 = [0.0, 0.0, -10.0]
            [material.rubber]
            point_stiffness_n_per_m = 1e4
            [[sphere]]
            radius_m = 0.5
            mass_kg = 1.0
            material = "rubber"
            position_m = [0.0, 0.0, 0.5]
            [[plane]]
            normal = [0.0, 0.0, 1.0]
            offset_m = 0.0
            material = "rubber"
            "#
        );
        let mut run = Run::new(&text);
        run.state.bodies[0].position_m[2] = 0.4995;
        run.finish();
        (run.state.bodies[0].position_m[2] - 0.499 - 5e-4 * libm::cos(5.0)).abs()
    };
    for (integrator, expected) in METHODS {
        let (coarse, fine) = (error(integrator, 2e-4), error(integrator, 1e-4));
        let observed = order(coarse, fine);
        println!("{integrator}: {coarse:.2e} and {fine:.2e} m, order {observed:.2}");
        // w h = 0.02 and 0.01; the next terms of the series come with powers of that and of the 5 rad turned.
        assert!((observed - expected).abs() < 0.15, "{observed}");
    }
}

#[test]
fn a_free_top_keeps_its_angular_momentum() {
    let ring = "position_m = [0.0, 0.0, 0.0]\n angular_velocity_rad_per_s = [0.6, -0.4, 1.1]";
    let (i1, i3) = (0.52025, 1.0243);
    for (integrator, _) in METHODS {
        let mut run = Run::new(&one_ring(1e-2, 5.0, integrator, "[material.wire]", ring));
        let momentum = |run: &Run| {
            let body = &run.state.bodies[0];
            let [x, y, z, w] = body.orientation;
            let axis = Vec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
            let spin = Vec3::from(body.angular_velocity_rad_per_s);
            spin * i1 + axis * ((i3 - i1) * spin.dot(&axis))
        };
        let before = momentum(&run);
        run.finish();
        // Each step leaves what the iteration's tolerance, 1e-9, leaves at most.
        check(integrator, (momentum(&run) - before).norm() / before.norm(), 500.0 * 1e-9);
    }
}

#[test]
fn stiffness_sets_no_bound_and_a_ball_comes_to_rest() {
    for (integrator, _) in METHODS {
        for exponent in [4, 8, 10] {
            let drop = Drop { stiffness: libm::pow(10.0, f64::from(exponent)), ratio: 0.05 };
            let mut run = Run::new(&drop.scene(integrator, "", 1e-3, 3.0));
            let energy = |run: &Run| {
                let body = &run.state.bodies[0];
                let speed = body.linear_velocity_m_per_s[2];
                0.5 * speed * speed + 9.81 * (body.position_m[2] - 0.3)
            };
            let (start, mut largest, mut evaluations) = (energy(&run), 0.0, 0);
            for _ in 0..run.model.time().step_count() {
                run.step();
                evaluations = run.scratch.force_evaluations();
                if energy(&run) > largest {
                    largest = energy(&run);
                }
            }
            let omega = libm::pow(10.0, 0.5 * f64::from(exponent)) * 1e-3;
            println!(
                "{integrator}, w h = {omega:e}: energy {:.4} of the start at most, height {:.3e} m at the end, \
                 {evaluations} evaluations",
                largest / start,
                run.state.bodies[0].position_m[2] - 0.3
            );
            // Without the spring's energy, which is positive: never more than at the start, but for rounding
            // and the first-order error of free fall, g h v.
            assert!(largest < start + 9.81 * 1e-3 * 3.2, "{largest}");
            if integrator == "backward-euler" && exponent > 4 {
                assert!((run.state.bodies[0].position_m[2] - 0.3).abs() < 1e-5, "at rest");
            }
        }
    }
}

/// A 4x4 sheet under gravity in its plane, with a step a hundred times `verlet`'s bound.
fn stiff_sheet(integrator: &str) -> String {
    format!(
        r#"
        [time]
        duration_s = 0.4
        time_step_s = 2e-3
        frames_per_second = 50.0
        [method]
        integrator = "{integrator}"
        [forces]
        gravity_m_per_s2 = [0.0, 9.81, 0.0]
        [material.wire]
        line_stiffness_n_per_m2 = 1e9
        damping_s_per_m = 0.3
        [[weave]]
        pattern = "european-4-in-1"
        rows = 4
        columns = 4
        major_radius_m = 1.0
        minor_radius_m = 0.18
        ring_mass_kg = 0.63956
        material = "wire"
        pins = [[0, 0], [0, 1], [0, 2], [0, 3]]
        "#
    )
}

#[test]
fn a_stiff_sheet_keeps_its_links_and_its_energy() {
    for (integrator, friction) in METHODS.iter().flat_map(|(method, _)| [(method, 0.0), (method, 0.3)]) {
        let rough = format!(
            "friction_coefficient = {friction:?}\n friction_stiffness_n_per_m = 1e7\n damping_s_per_m"
        );
        let mut run = Run::new(&stiff_sheet(integrator).replace("damping_s_per_m", &rough));
        let verlet = Scene::parse(&stiff_sheet("verlet"), &["method.on_risk=subdivide".to_owned()]).unwrap();
        let bound = Model::compile(&verlet).unwrap().0.largest_time_step_s();
        let mut records = Records::after(Hash::default());
        evaluate(&run.model, &run.state, &mut run.scratch);
        let first = records.record(&run.model, &run.state, &run.scratch);
        records.check_energy(&first).unwrap();
        let (mut penetration, mut fresh) = (0.0, run.state.clone());
        for number in 0..run.model.time().step_count() {
            run.step();
            if number < 20 {
                let mut scratch = Scratch::new(&run.model, 1);
                step(&run.model, &mut fresh, &mut scratch).unwrap();
                assert_eq!(run.state, fresh, "the state alone decides");
            }
            let record = records.record(&run.model, &run.state, &run.scratch);
            records.check_energy(&record).unwrap();
            if record.penetration_m > penetration {
                penetration = record.penetration_m;
            }
            if let Some(audit) = record.audit {
                check_audit(&run.model, &run.state, &audit).unwrap();
            }
        }
        let each = run.scratch.force_evaluations() as f64 / run.model.time().step_count() as f64;
        println!(
            "{integrator}, friction {friction}: 2e-3 s, {:.0} times verlet's bound; penetration {:.3} % of 2 r; {each:.1} evaluations a step",
            2e-3 / bound,
            penetration / 0.0036
        );
        assert!(penetration < 0.02 * 0.36);
    }
}

/// The energy of the motion and of contacts, after a step (J).
fn energy(run: &Run, records: &mut Records) -> (f64, f64) {
    let record = records.record(&run.model, &run.state, &run.scratch);
    let all = record.kinetic_energy_j + record.gravity_energy_j + record.contact_energy_j;
    (all, record.dissipated_energy_j)
}

/// A ring thrown against its pinned neighbour, again and again, without gravity and drag.
fn rattle(stiffness: f64, integrator: &str) -> String {
    format!(
        r#"
        [time]
        duration_s = 2.0
        time_step_s = 1e-3
        frames_per_second = 100.0
        [method]
        integrator = "{integrator}"
        [material.wire]
        line_stiffness_n_per_m2 = {stiffness:?}
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
        position_m = [1.2, 0.0, 0.0]
        orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]
        linear_velocity_m_per_s = [8.0, 1.0, 2.0]
        angular_velocity_rad_per_s = [1.0, -3.0, 2.0]
        "#
    )
}

#[test]
fn impacts_at_any_stiffness_add_no_energy() {
    for (integrator, _) in METHODS {
        for exponent in [4, 6, 8, 10, 12] {
            let mut run = Run::new(&rattle(libm::pow(10.0, f64::from(exponent)), integrator));
            let mut records = Records::after(Hash::default());
            evaluate(&run.model, &run.state, &mut run.scratch);
            let start = energy(&run, &mut records).0;
            let (mut before, mut rise, mut last) = (start, 0.0, 0.0);
            for _ in 0..run.model.time().step_count() {
                run.step();
                let (all, lost) = energy(&run, &mut records);
                assert_eq!(lost, 0.0, "nothing is damped");
                if all - before > rise {
                    rise = all - before;
                }
                (before, last) = (all, all);
            }
            println!(
                "{integrator}, 1e{exponent} N/m^2: no step adds more than {:.1e} of {start:.1} J; {:.3} are left",
                rise / start,
                last / start
            );
            // Turning normals: the share of penetration over thickness, and Newton's tolerance.
            assert!(rise < 1e-3 * start, "{rise}");
        }
    }
}

/// A ring that hangs from a pinned one by a contact far stiffer than the step resolves swings in its own plane.
#[test]
fn a_swing_on_an_unresolved_contact_keeps_the_order() {
    for (integrator, expected) in METHODS {
        let text = rattle(1e9, integrator)
            .replace("[method]", "[forces]\n gravity_m_per_s2 = [9.81, 0.0, 0.0]\n [method]")
            .replace("[1.2, 0.0, 0.0]", "[1.64, 0.0, 0.0]")
            .replace("[8.0, 1.0, 2.0]", "[0.0, 0.0, 0.0]")
            .replace("[1.0, -3.0, 2.0]", "[0.0, 0.0, 0.0]");
        // Down to where the contact bears the weight.
        let mut still = Run::with(&text, &["method.integrator=\"backward-euler\"".to_owned()]);
        still.steps(500);
        let end = |time_step_s: f64| {
            let mut run = Run::with(
                &text,
                &[format!("time.time_step_s={time_step_s:?}"), "time.frames_per_second=62.5".to_owned()],
            );
            run.state.bodies = still.state.bodies.clone();
            run.state.bodies[1].linear_velocity_m_per_s = [0.0, 0.0, 1.0];
            let mut records = Records::after(Hash::default());
            evaluate(&run.model, &run.state, &mut run.scratch);
            let start = energy(&run, &mut records).0;
            run.steps(libm::round(1.6 / time_step_s) as u64);
            (Vec3::from(run.state.bodies[1].position_m), energy(&run, &mut records).0 - start)
        };
        let steps = [16e-3, 8e-3, 4e-3, 2e-3];
        let ends = steps.map(end);
        let apart: Vec<f64> = ends.windows(2).map(|pair| (pair[1].0 - pair[0].0).norm()).collect();
        let lost = ends.map(|end| end.1 / 0.5);
        println!(
            "{integrator}: {apart:?} m apart, orders {:.2} and {:.2}; energy lost of 0.5 J {lost:?}",
            order(apart[0], apart[1]),
            order(apart[1], apart[2])
        );
        assert!((order(apart[1], apart[2]) - expected).abs() < 0.3);
    }
}

#[test]
fn what_has_no_jacobian_is_refused() {
    let refused = |text: &str| Model::compile(&Scene::parse(text, &[]).unwrap()).unwrap_err().to_string();
    for (integrator, _) in METHODS {
        let law =
            stiff_sheet(integrator).replace("[forces]", "contact_law = \"surface-integral\"\n [forces]");
        let message = refused(&law);
        assert!(message.contains(integrator) && message.contains("centreline-arc"), "{message}");
    }
}

//! The momentum audit: quiet where the program is right, and loud where a body is moved by no force.

use crate::support::Run;
use schemas::Hash;
use sim_node::{Model, Records, Stop, Unexplained, evaluate};

/// A sheet on a ball, a capsule, a box and a floor, pinned at one ring and shaken at another, with what else is said.
fn busy(integrator: &str, forces: &str, wire: &str) -> String {
    format!(
        r#"
        [time]
        duration_s = 0.5
        time_step_s = 2e-4
        frames_per_second = 5000.0
        [method]
        integrator = "{integrator}"
        [forces]
        gravity_m_per_s2 = [1.0, 0.0, -9.81]
        {forces}
        [material.wire]
        line_stiffness_n_per_m2 = 4e4
        point_stiffness_n_per_m = 1e4
        {wire}
        [motion.shaker]
        shake = {{ translation_m = [0.0, 0.1, 0.05], frequency_hz = 5.0 }}
        [[weave]]
        pattern = "european-4-in-1"
        rows = 5
        columns = 4
        major_radius_m = 1.0
        minor_radius_m = 0.18
        ring_mass_kg = 0.63956
        material = "wire"
        pins = [[0, 0]]
        [[weave.grip]]
        motion = "shaker"
        rings = [[0, 3]]
        [[sphere]]
        radius_m = 1.5
        mass_kg = 3.0
        material = "wire"
        position_m = [2.0, 2.0, -2.26]
        linear_velocity_m_per_s = [0.0, 0.0, 10.0]
        [[capsule]]
        radius_m = 0.3
        half_length_m = 0.6
        mass_kg = 1.0
        material = "wire"
        position_m = [1.0, 4.5, -2.0]
        linear_velocity_m_per_s = [0.0, 0.0, 8.0]
        angular_velocity_rad_per_s = [2.0, 0.0, 1.0]
        [[box]]
        half_extents_m = [0.4, 0.5, 0.6]
        edge_radius_m = 0.05
        mass_kg = 2.0
        material = "wire"
        position_m = [4.0, 4.0, -3.1]
        angular_velocity_rad_per_s = [1.0, 2.0, -1.0]
        [[plane]]
        normal = [0.0, 0.0, 1.0]
        offset_m = -4.0
        material = "wire"
        "#
    )
}

const DRAG: &str =
    "linear_drag_kg_per_s = 0.05\n angular_drag_kg_m2_per_s = 0.01\n quadratic_drag_kg_per_m = 0.02";
const RUBBING: &str = "damping_s_per_m = 0.2\n friction_coefficient = 0.3\n friction_stiffness_n_per_m = 1e3";

/// The worst shares of what rounding allows, of momentum and of angular momentum.
fn worst(run: &mut Run) -> [f64; 2] {
    let mut records = Records::after(Hash::default());
    evaluate(&run.model, &run.state, &mut run.scratch);
    records.record(&run.model, &run.state, &run.scratch);
    let mut worst = [0.0; 2];
    for _ in 0..run.model.time().step_count() {
        run.step();
        records.record(&run.model, &run.state, &run.scratch);
        records.check_momentum().unwrap_or_else(|stop| panic!("{stop}"));
        let Unexplained { linear_n_s, linear_allowed_n_s, angular_n_m_s, angular_allowed_n_m_s, .. } =
            records.unexplained().expect("each step follows a record");
        let shares = [linear_n_s / linear_allowed_n_s, angular_n_m_s / angular_allowed_n_m_s];
        for (worst, share) in worst.iter_mut().zip(shares) {
            *worst = if share > *worst { share } else { *worst };
        }
    }
    worst
}

#[test]
fn only_forces_change_momentum() {
    let parts = "on_risk = \"subdivide\"\n integrator";
    for (forces, wire) in [("", ""), ("", RUBBING), (DRAG, RUBBING)] {
        for (integrator, key) in
            [("verlet", "integrator"), ("verlet", parts), ("rk4", "integrator"), ("dopri5", "integrator")]
        {
            let mut text = busy(integrator, forces, wire).replace("integrator =", &format!("{key} ="));
            if key == parts {
                text = text.replace("time_step_s = 2e-4", "time_step_s = 2e-2").replace("5000.0", "50.0");
            }
            if integrator == "dopri5" {
                text = text.replace("duration_s = 0.5", "duration_s = 0.1");
            }
            let mut run = Run::new(&text);
            let [linear, angular] = worst(&mut run);
            println!(
                "{key} {integrator}, {forces:.6} {wire:.6}: {linear:.1e} of what is allowed, angular {angular:.1e}"
            );
            assert!(linear > 0.0 && linear < 1.0);
            let audited = integrator == "verlet" && forces.is_empty();
            assert!(if audited { angular > 0.0 && angular < 1.0 } else { angular == 0.0 });
        }
    }
}

/// A velocity that changes by no force is seen in its step, down to a few hundred units in the last place of all
/// bodies' momentum; so is a turn.
#[test]
fn a_body_moved_by_no_force_stops_the_run() {
    for angular in [false, true] {
        let mut run = Run::new(&busy("verlet", "", RUBBING));
        let mut records = Records::after(Hash::default());
        run.steps(500);
        records.record(&run.model, &run.state, &run.scratch);
        run.step();
        let body = &mut run.state.bodies[9];
        let velocity =
            if angular { &mut body.angular_velocity_rad_per_s } else { &mut body.linear_velocity_m_per_s };
        velocity[1] += 1e-10;
        records.record(&run.model, &run.state, &run.scratch);
        let stop = records.check_momentum().unwrap_err();
        println!("{stop}");
        let Stop::MomentumGained { step: 501, what, gained, allowed } = &stop else { panic!("{stop}") };
        assert_eq!(what.contains("angular"), angular);
        // The ring's mass, or its moment of inertia about an axis in between, times the change.
        assert!((0.3e-10..1e-10).contains(gained) && *allowed < 2e-11, "{stop}");
        assert!(stop.to_string().contains("step 501") && stop.to_string().contains("verify"), "{stop}");
        // What does not follow the last record is not judged by it.
        run.steps(2);
        records.record(&run.model, &run.state, &run.scratch);
        assert!(records.check_momentum().is_ok() && records.unexplained().is_none());
    }
}

#[test]
fn the_plan_says_what_is_audited() {
    let part = |text: &str| {
        let scene = schemas::scene::Scene::parse(text, &[]).unwrap();
        let plan = Model::compile(&scene).unwrap().1;
        plan.entries.into_iter().find(|entry| entry.part == "audit/momentum").unwrap()
    };
    let entry = part(&busy("verlet", "", ""));
    assert!(entry.needed && entry.reason == "21 free bodies", "{entry:?}");
    let implicit =
        "[time]\n duration_s = 1.0\n time_step_s = 1e-3\n [method]\n integrator = \"backward-euler\"";
    let entry = part(implicit);
    assert!(!entry.needed && entry.reason.contains("residual"), "{entry:?}");
}

//! The length of a step: chosen from the scene, cut into parts, and its error estimated.

use crate::support::{Run, check, order};
use schemas::Hash;
use schemas::scene::Scene;
use sim_node::{Model, Records, Scratch, check_audit, evaluate, step};

#[test]
fn an_automatic_step_is_half_the_bound_and_frames_fall_on_it() {
    let drop = include_str!("../../../scenes/drop.toml");
    for (integrator, frames_per_second) in [("verlet", 24.0), ("rk4", 60.0), ("verlet", 1e5)] {
        let set = [
            "time.time_step_s=auto".to_owned(),
            format!("time.frames_per_second={frames_per_second:?}"),
            format!("method.integrator={integrator}"),
        ];
        let scene = Scene::parse(drop, &set).unwrap();
        let (model, plan) = Model::compile(&scene).unwrap();
        let (time, bound) = (model.time(), model.largest_time_step_s());
        let share = time.time_step_s / bound;
        println!("{integrator}: {:e} s, {share:.3} of the bound", time.time_step_s);
        assert!(share <= 0.5 && !time.automatic);
        // No more parts than needed: one part fewer would be beyond the half.
        let parts = 1.0 / (frames_per_second * time.time_step_s);
        assert!(parts < 1.5 || parts / (parts - 1.0) * share > 0.5, "{parts}");
        for frame in 0..time.frame_count() {
            let apart = time.frame_step(frame) as f64 * time.time_step_s - frame as f64 / frames_per_second;
            assert!(apart.abs() < 1e-12, "frame {frame} is {apart:e} s from its step");
        }
        let line = plan.entries.iter().find(|entry| entry.part == "time/step").unwrap();
        assert!(line.reason.contains("\"auto\"") && line.reason.contains("contacts of ring"), "{line:?}");
    }
}

#[test]
fn an_automatic_step_without_a_bound_is_a_frame() {
    let text = "[time]\n duration_s = 1.0\n time_step_s = \"auto\"\n frames_per_second = 10.0";
    let run = Run::new(text);
    assert_eq!(run.model.time().time_step_s, 0.1);
}

/// The 16x16 sheet that the peers were measured with; `gravity` in its plane loads every link, across it the
/// sheet swings down from two corners.
fn sheet(pins: &str, gravity: &str, frames: u32, duration_s: f64) -> String {
    format!(
        r#"
        [time]
        duration_s = {duration_s:?}
        time_step_s = {:?}
        frames_per_second = {frames}.0
        [method]
        on_risk = "subdivide"
        [forces]
        gravity_m_per_s2 = {gravity}
        [material.wire]
        line_stiffness_n_per_m2 = 1.4e6
        damping_s_per_m = 0.3
        [[weave]]
        pattern = "european-4-in-1"
        rows = 16
        columns = 16
        major_radius_m = 1.0
        minor_radius_m = 0.18
        ring_mass_kg = 0.63956
        material = "wire"
        pins = [{pins}]
        "#,
        1.0 / f64::from(frames)
    )
}

#[test]
fn links_survive_any_step_that_is_subdivided() {
    let row: Vec<String> = (0..16).map(|column| format!("[0, {column}]")).collect();
    let hang = (row.join(", "), "[0.0, 9.81, 0.0]");
    let drop = ("[0, 0], [0, 15]".to_owned(), "[0.0, 0.0, -9.81]");
    for (name, (pins, gravity)) in [("hang", hang), ("drop", drop)] {
        for frames in [60, 30, 20] {
            let text = sheet(&pins, gravity, frames, 0.6);
            let bold = text.replace("on_risk = \"subdivide\"", "");
            assert!(Model::compile(&Scene::parse(&bold, &[]).unwrap()).is_err(), "refused without");
            let mut run = Run::new(&text);
            let mut records = Records::after(Hash::default());
            let mut penetration = 0.0;
            evaluate(&run.model, &run.state, &mut run.scratch);
            records.record(&run.model, &run.state, &run.scratch);
            for _ in 0..run.model.time().step_count() {
                run.step();
                let record = records.record(&run.model, &run.state, &run.scratch);
                if record.penetration_m > penetration {
                    penetration = record.penetration_m;
                }
                let audit = record.audit.expect("each step is a frame");
                check_audit(&run.model, &run.state, &audit).unwrap();
                records.check_energy(&record).unwrap();
            }
            let parts = run.scratch.force_evaluations() / run.model.time().step_count();
            println!("{name} 1/{frames} s: {parts} parts, penetration {:.2} % of 2 r", penetration / 0.0036);
            assert!(parts > 2);
        }
    }
}

#[test]
fn parts_are_a_function_of_the_state() {
    let row: Vec<String> = (0..16).map(|column| format!("[0, {column}]")).collect();
    for integrator in ["verlet", "rk4"] {
        let text = sheet(&row.join(", "), "[0.0, 9.81, 0.0]", 60, 0.1)
            .replace("rows = 16", "rows = 4")
            .replace("[method]", &format!("[method]\n integrator = \"{integrator}\""));
        let mut run = Run::new(&text);
        let mut fresh = run.state.clone();
        for _ in 0..6 {
            run.step();
            let mut scratch = Scratch::new(&run.model, 1);
            step(&run.model, &mut fresh, &mut scratch).unwrap();
        }
        assert_eq!(run.state, fresh, "{integrator}");
    }
}

#[test]
fn a_fast_body_makes_parts_that_pass_through_nothing() {
    // A ring flies edge on at a pinned one's wire, across it, at 60 m/s: in one step of 1/60 s it would be 1 m
    // further, with the wire in its hole. The wire must throw it back.
    let text = r#"
        [time]
        duration_s = 0.05
        time_step_s = 0.016666666666666666
        frames_per_second = 60.0
        [method]
        on_risk = "subdivide"
        [material.wire]
        line_stiffness_n_per_m2 = 2e8
        [[ring]]
        major_radius_m = 1.0
        minor_radius_m = 0.05
        mass_kg = 1.0
        material = "wire"
        position_m = [0.0, 0.0, 0.0]
        pinned = true
        [[ring]]
        major_radius_m = 1.0
        minor_radius_m = 0.05
        mass_kg = 1.0
        material = "wire"
        position_m = [1.0, 0.0, 1.2]
        orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]
        linear_velocity_m_per_s = [0.0, 0.0, -60.0]
        "#;
    let mut run = Run::new(text);
    run.finish();
    let body = &run.state.bodies[1];
    println!("height {:.3} m, speed {:.3} m/s", body.position_m[2], body.linear_velocity_m_per_s[2]);
    assert!(body.position_m[2] > 1.1 && body.linear_velocity_m_per_s[2] > 0.0);
    // Undamped: the energy is back, but for half the square of w h in the contact, which is below 1/16.
    check("speed", (body.linear_velocity_m_per_s[2] / 60.0 - 1.0).abs(), 0.03);
}

/// What flies fast where it meets nothing shortens no step; nor does a common velocity of all.
#[test]
fn a_fast_body_far_away_shortens_no_step() {
    let parts = |integrator: &str, place_m: f64, speed: f64| {
        let pair = |z: f64, more: &str| {
            format!(
                "[[ring]]\n major_radius_m = 1.0\n minor_radius_m = 0.05\n mass_kg = 1.0\n material = \"wire\"\n \
                 position_m = [0.0, 0.0, {z:?}]\n linear_velocity_m_per_s = [0.0, 0.0, {speed:?}]\n {more}\n"
            )
        };
        let text = format!(
            "[time]\n duration_s = 0.05\n time_step_s = 0.01\n frames_per_second = 100.0\n[method]\n \
             integrator = \"{integrator}\"\n on_risk = \"subdivide\"\n[material.wire]\n \
             line_stiffness_n_per_m2 = 1e3\n{}{}\
             [[box]]\n half_extents_m = [0.3, 0.3, 0.3]\n mass_kg = 1.0\n material = \"wire\"\n \
             position_m = [{place_m:?}, 0.0, 0.0]\n linear_velocity_m_per_s = [0.0, 1e4, 0.0]\n",
            pair(0.0, ""),
            pair(1.0, "angular_velocity_rad_per_s = [0.0, 0.0, 0.1]"),
        );
        let mut run = Run::new(&text);
        run.finish();
        run.scratch.force_evaluations()
    };
    for integrator in ["verlet", "dopri5"] {
        let (still, moving) = (parts(integrator, 1e3, 0.0), parts(integrator, 1e3, 500.0));
        let near = parts(integrator, 3.0, 0.0);
        println!(
            "{integrator}: {still} evaluations, {moving} with all at 500 m/s, {near} with the fast one near"
        );
        // At 1e4 m/s against rings 0.05 m thick, a step passes nothing in 9e-6 s of the first 2e-4 s.
        // With one speed for all, each step of 1e-2 s would be in 8,000 parts.
        assert!(still < 250 && moving < 250 && near > still + 3, "{still} {moving} {near}");
    }
}

#[test]
fn the_estimate_of_a_steps_error_has_its_order() {
    // A ball presses on a plane and vibrates without leaving it: smooth. The local error has the order of the
    // method and one more.
    let estimate = |integrator: &str, time_step_s: f64| {
        let text = format!(
            r#"
            [time]
            duration_s = {time_step_s:?}
            time_step_s = {time_step_s:?}
            frames_per_second = 1.0
            [method]
            integrator = "{integrator}"
            tolerance = 1e-3
            [record]
            error_estimate = true
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
        run.state.bodies[0].position_m[2] = 0.4991;
        run.state.bodies[0].linear_velocity_m_per_s[2] = 0.003;
        evaluate(&run.model, &run.state, &mut run.scratch);
        let record = Records::after(Hash::default()).record(&run.model, &run.state, &run.scratch);
        record.error_estimate_m.expect("step 0 is a frame")
    };
    for (integrator, expected, time_step_s) in [
        ("verlet", 3.0, 2e-3),
        ("rk4", 5.0, 2e-3),
        ("energy-decaying", 3.0, 5e-4),
        ("backward-euler", 2.0, 5e-4),
    ] {
        let (coarse, fine) = (estimate(integrator, time_step_s), estimate(integrator, 0.5 * time_step_s));
        let observed = order(coarse, fine);
        println!("{integrator}: {coarse:.2e} and {fine:.2e} m, order {observed:.2}");
        // w h = 0.2 and 0.1: the next term of the series is that much smaller, and may be twice as large to
        // begin with. The implicit methods have a next term of the other sign: 0.05 and 0.025.
        assert!((observed - expected).abs() < 0.4, "{observed}");
    }
    println!("dopri5: {:.2e} m", estimate("dopri5", 2e-3));
}

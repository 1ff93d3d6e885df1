//! Equal bits: twice, for any number of threads, from any state on, with anything left out or not.

use crate::support::Run;
use proptest::prelude::*;
use schemas::scene::Scene;
use schemas::{Hash, state};
use sim_node::{Model, Records, Scratch, State, evaluate, step};

fn bits(state: &State) -> Hash {
    let mut message = Vec::new();
    state::encode(&state.header(), &state.bodies, &state.contacts, &mut message)
}

/// A sheet that falls on a ball and a floor, with everything that the program has.
fn busy(rows: u32, columns: u32, integrator: &str) -> String {
    format!(
        r#"
        [time]
        duration_s = 0.2
        time_step_s = 2e-4
        [method]
        integrator = "{integrator}"
        [forces]
        gravity_m_per_s2 = [0.0, 0.0, -9.81]
        linear_drag_kg_per_s = 0.05
        angular_drag_kg_m2_per_s = 0.01
        [material.wire]
        line_stiffness_n_per_m2 = 4e4
        point_stiffness_n_per_m = 1e4
        damping_s_per_m = 0.2
        friction_coefficient = 0.3
        friction_stiffness_n_per_m = 1e3
        [[weave]]
        pattern = "european-4-in-1"
        rows = {rows}
        columns = {columns}
        major_radius_m = 1.0
        minor_radius_m = 0.18
        ring_mass_kg = 0.63956
        material = "wire"
        pins = [[0, 0]]
        [[sphere]]
        radius_m = 1.5
        mass_kg = 3.0
        material = "wire"
        position_m = [2.0, 2.0, -2.26]
        linear_velocity_m_per_s = [0.0, 0.0, 10.0]
        [[plane]]
        normal = [0.0, 0.0, 1.0]
        offset_m = -4.0
        material = "wire"
        "#
    )
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    for (integrator, steps) in [("verlet", 60), ("dopri5", 8)] {
        same_for_any_number_of_threads(integrator, steps);
    }
}

fn same_for_any_number_of_threads(integrator: &str, steps: u64) {
    let scene = Scene::parse(&busy(34, 34, integrator), &[]).unwrap();
    let (model, _) = Model::compile(&scene).unwrap();
    let run = |threads: usize| {
        let mut state = State::initial(&model);
        let mut scratch = Scratch::new(&model, threads);
        let mut records = Records::after(Hash::default());
        for _ in 0..steps {
            step(&model, &mut state, &mut scratch).unwrap();
            records.record(&model, &state, &scratch);
        }
        (bits(&state), records.chained_hash(), state.contacts.len())
    };
    let one = run(1);
    assert!(one.2 > 0 || integrator != "verlet", "there are contacts with friction");
    for threads in [1, 2, 3, 8] {
        assert_eq!(run(threads), one, "{threads} threads");
    }
}

#[test]
fn neighbour_lists_and_memory_do_not_matter() {
    for (integrator, steps) in
        [("verlet", 400), ("rk4", 400), ("dopri5", 60), ("backward-euler", 60), ("energy-decaying", 60)]
    {
        let mut run = Run::new(&busy(4, 3, integrator));
        let mut fresh = run.state.clone();
        for _ in 0..steps {
            run.step();
            let mut scratch = Scratch::new(&run.model, 1);
            step(&run.model, &mut fresh, &mut scratch).unwrap();
        }
        assert_eq!(bits(&run.state), bits(&fresh), "{integrator}");
    }
}

#[test]
fn a_run_goes_on_from_any_message() {
    for (integrator, pause) in [
        ("verlet", 1),
        ("verlet", 137),
        ("verlet", 402),
        ("rk4", 211),
        ("dopri5", 137),
        ("energy-decaying", 137),
    ] {
        let mut run = Run::new(&busy(4, 3, integrator));
        run.steps(pause);
        let mut message = Vec::new();
        state::encode(&run.state.header(), &run.state.bodies, &run.state.contacts, &mut message);
        let read = state::decode(&message).unwrap();
        let mut resumed = State::from_message(&run.model, read).unwrap();
        let mut scratch = Scratch::new(&run.model, 1);
        for _ in 0..300 {
            run.step();
            step(&run.model, &mut resumed, &mut scratch).unwrap();
        }
        assert_eq!(resumed.step, pause + 300);
        assert!(!resumed.contacts.is_empty() || integrator != "verlet" || pause < 10, "friction was at work");
        assert_eq!(bits(&run.state), bits(&resumed), "{integrator}, paused at {pause}");
    }
}

#[test]
fn a_mirrored_scene_is_mirrored_but_for_rounding() {
    // Not bits, but a check that no axis is special: the same collision along x, y and z.
    let along = |axis: usize| {
        let mut velocity = [0.0; 3];
        velocity[axis] = -1.0;
        let mut position = [0.0; 3];
        position[axis] = 1.05;
        let text = format!(
            r#"
            [time]
            duration_s = 0.2
            time_step_s = 1e-4
            [material.wire]
            point_stiffness_n_per_m = 1e4
            [[sphere]]
            radius_m = 0.5
            mass_kg = 1.0
            material = "wire"
            position_m = [0.0, 0.0, 0.0]
            [[sphere]]
            radius_m = 0.5
            mass_kg = 1.0
            material = "wire"
            position_m = {position:?}
            linear_velocity_m_per_s = {velocity:?}
            "#
        );
        let mut run = Run::new(&text);
        run.finish();
        run.state.bodies[0].linear_velocity_m_per_s[axis]
    };
    assert_eq!(along(0).to_bits(), along(1).to_bits());
    assert_eq!(along(0).to_bits(), along(2).to_bits());
    assert!((along(0) + 1.0).abs() < 1e-5, "equal spheres exchange their speeds: {}", along(0));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// Leaving out what a scene does not need changes no bit of any state or record.
    #[test]
    fn everything_on_gives_the_same_bits(
        gravity in prop::option::of(-12.0..12.0_f64),
        drag in prop::option::of(0.01..0.5_f64),
        damping in prop::option::of(0.05..0.5_f64),
        friction in prop::option::of(0.05..1.0_f64),
        sphere in any::<bool>(),
        plane in any::<bool>(),
        rk4 in any::<bool>(),
        tilt in -0.5..0.5_f64,
    ) {
        let scene = random_scene(gravity, drag, damping, friction, (sphere, plane, rk4), tilt);
        let scene = Scene::parse(&scene, &[]).unwrap();
        let (needed, plan) = Model::compile(&scene).unwrap();
        let (everything, full_plan) = Model::compile_everything_on(&scene).unwrap();
        prop_assert!(plan.entries.iter().any(|entry| !entry.needed));
        prop_assert!(full_plan.entries.iter().filter(|entry| entry.needed).count()
            > plan.entries.iter().filter(|entry| entry.needed).count() || friction.is_some());
        let run = |model: &Model| {
            let mut state = State::initial(model);
            let mut scratch = Scratch::new(model, 1);
            let mut records = Records::after(Hash::default());
            evaluate(model, &state, &mut scratch);
            let mut all = vec![records.record(model, &state, &scratch)];
            for _ in 0..150 {
                step(model, &mut state, &mut scratch).unwrap();
                all.push(records.record(model, &state, &scratch));
            }
            all
        };
        prop_assert_eq!(run(&needed), run(&everything));
    }
}

fn random_scene(
    gravity: Option<f64>,
    drag: Option<f64>,
    damping: Option<f64>,
    friction: Option<f64>,
    (sphere, plane, rk4): (bool, bool, bool),
    tilt: f64,
) -> String {
    let number = |value: Option<f64>| format!("{:?}", value.unwrap_or(0.0));
    let mut text = format!(
        r#"
        [time]
        duration_s = 0.2
        time_step_s = 2e-4
        [method]
        integrator = "{}"
        [forces]
        gravity_m_per_s2 = [0.0, {tilt:?}, {}]
        linear_drag_kg_per_s = {}
        angular_drag_kg_m2_per_s = {}
        [material.wire]
        line_stiffness_n_per_m2 = 1e4
        damping_s_per_m = {}
        friction_coefficient = {}
        [[weave]]
        pattern = "european-4-in-1"
        rows = 2
        columns = 2
        major_radius_m = 1.0
        minor_radius_m = 0.24
        ring_mass_kg = 0.6
        material = "wire"
        rotation_rad = [{tilt:?}, 0.1, 0.0]
        pins = [[0, 0]]
        "#,
        if rk4 { "rk4" } else { "verlet" },
        number(gravity),
        number(drag),
        number(drag.map(|drag| 0.1 * drag)),
        number(damping),
        number(friction),
    );
    if gravity.is_none() {
        text = text.replace(&format!("gravity_m_per_s2 = [0.0, {tilt:?}, 0.0]"), "");
    }
    if sphere {
        text += r#"
        [[sphere]]
        radius_m = 0.5
        mass_kg = 0.4
        material = "wire"
        position_m = [0.5, 0.5, -2.2]
        linear_velocity_m_per_s = [0.1, 0.0, 60.0]
        "#;
    }
    if plane {
        text += r#"
        [[plane]]
        normal = [0.0, 0.0, 1.0]
        offset_m = -4.0
        material = "wire"
        "#;
    }
    text
}

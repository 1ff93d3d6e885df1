//! Prescribed motion and reactions: driven bodies are exactly where they should be, their work is in the
//! balance, and what pins and grippers bear is what is missing elsewhere.

use crate::support::{Run, check, order};
use schemas::step::StepRecord;
use sim_node::{Records, Scratch, evaluate};

/// Two linked rings: the first follows a motion, the second hangs in it.
fn shaken(time_step_s: f64, integrator: &str, damping: f64) -> String {
    format!(
        r#"
        [time]
        duration_s = 0.5
        time_step_s = {time_step_s:?}
        [method]
        integrator = "{integrator}"
        [forces]
        gravity_m_per_s2 = [0.0, -9.8, 0.0]
        [record]
        reactions = true
        [material.wire]
        line_stiffness_n_per_m2 = 1e4
        damping_s_per_m = {damping:?}
        [motion.hand]
        pivot_m = [0.3, 0.1, 0.0]
        axis = [0.0, 0.6, 0.8]
        keyframe = [{{ time_s = 0.2, translation_m = [0.1, 0.05, 0.0], angle_rad = 0.7 }}, {{ time_s = 0.4 }}]
        shake = {{ translation_m = [0.0, 0.02, 0.01], frequency_hz = 7.0, ramp_s = 0.1 }}
        [[ring]]
        major_radius_m = 0.4
        minor_radius_m = 0.06
        mass_kg = 0.5
        material = "wire"
        position_m = [0.0, 0.0, 0.0]
        orientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]
        motion = "hand"
        [[ring]]
        major_radius_m = 0.4
        minor_radius_m = 0.06
        mass_kg = 0.1
        material = "wire"
        position_m = [0.01, -0.66, 0.02]
        "#
    )
}

fn mechanical(record: &StepRecord) -> f64 {
    record.kinetic_energy_j + record.gravity_energy_j + record.contact_energy_j
}

/// Runs to the end with all records; returns them.
fn recorded(run: &mut Run) -> Vec<StepRecord> {
    let mut records = Records::after(schemas::Hash::default());
    evaluate(&run.model, &run.state, &mut run.scratch);
    let mut all = Vec::new();
    loop {
        let record = records.record(&run.model, &run.state, &run.scratch);
        records.check_energy(&record).expect("no energy comes from nowhere");
        all.push(record);
        if run.state.step == run.model.time().step_count() {
            return all;
        }
        run.step();
    }
}

#[test]
fn driven_bodies_are_where_the_scene_says() {
    for integrator in ["verlet", "rk4", "dopri5", "backward-euler", "energy-decaying"] {
        let mut run = Run::new(&shaken(1e-3, integrator, 0.2));
        let start = run.state.bodies[0];
        let mut worst = 0.0;
        while run.state.step < 500 {
            run.step();
            let body = &run.state.bodies[0];
            let t = run.state.sim_time_s;
            let smooth = |s: f64| (s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s));
            let (share, rate) = match t {
                t if t < 0.2 => smooth(t / 0.2),
                t if t < 0.4 => (1.0 - smooth((t - 0.2) / 0.2).0, -smooth((t - 0.2) / 0.2).1),
                _ => (0.0, 0.0),
            };
            let (angle, turning) = (0.7 * share, 0.7 * rate / 0.2);
            let circular = 14.0 * core::f64::consts::PI;
            let (size, growth) = if t < 0.1 { smooth(t / 0.1) } else { (1.0, 0.0) };
            let wave = size * libm::sin(circular * t);
            // About the unit axis (0, 0.6, 0.8), by Rodrigues' formula for d = start - pivot = (-0.3, -0.1, 0).
            let (c, s) = (libm::cos(angle), libm::sin(angle));
            let (d, n) = ([-0.3, -0.1, 0.0], [0.0, 0.6, 0.8]);
            let cross = [n[1] * d[2] - n[2] * d[1], n[2] * d[0] - n[0] * d[2], n[0] * d[1] - n[1] * d[0]];
            let along = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
            let moved = [0.1 * share, 0.05 * share + 0.02 * wave, 0.01 * wave];
            let pivot = [0.3, 0.1, 0.0];
            for axis in 0..3 {
                let turned = d[axis] * c + cross[axis] * s + n[axis] * along * (1.0 - c);
                let error = (body.position_m[axis] - (pivot[axis] + moved[axis] + turned)).abs();
                let spin = (body.angular_velocity_rad_per_s[axis] - n[axis] * turning).abs();
                for error in [error, 0.1 * spin] {
                    if error > worst {
                        worst = error;
                    }
                }
            }
            let speed = 0.05 * rate * if t < 0.4 { 1.0 / 0.2 } else { 0.0 }
                + 0.02 * (size * circular * libm::cos(circular * t) + growth / 0.1 * libm::sin(circular * t));
            let turned_x = d[0] * c + cross[0] * s;
            let turned_z = d[2] * c + cross[2] * s + n[2] * along * (1.0 - c);
            let expected = speed + turning * (n[2] * turned_x - n[0] * turned_z);
            let error = (body.linear_velocity_m_per_s[1] - expected).abs();
            if error > worst {
                worst = error;
            }
        }
        // Sines of angles up to 22 rad and a handful of sums of numbers of size 1.
        check(&format!("{integrator}: pose and velocity"), worst, 3e-14);
        // After the last keyframe the shake alone is left: orientation as at the start.
        assert_eq!(run.state.bodies[0].orientation, start.orientation);
    }
}

#[test]
fn work_of_motions_balances_the_energy() {
    for (integrator, expected_order) in [("verlet", 2.0), ("rk4", 2.0)] {
        let errors = [1e-3, 5e-4, 2.5e-4].map(|time_step_s| {
            let mut run = Run::new(&shaken(time_step_s, integrator, 0.2));
            let all = recorded(&mut run);
            let (first, last) = (&all[0], &all[all.len() - 1]);
            let work: f64 =
                all.iter().map(|record| record.drive_work_j.expect("the scene has a motion")).sum();
            let gained = mechanical(last) - mechanical(first) + last.dissipated_energy_j;
            println!("{integrator} h {time_step_s}: work {work:.6} J, found {gained:.6} J");
            assert!(work.abs() > 0.02, "the motion works");
            (gained - work).abs()
        });
        let observed = order(errors[0], errors[2]) / 2.0;
        println!(
            "{integrator}: unbalanced {errors:?} J, order {observed:.2}, at least {expected_order} less 0.5"
        );
        // Onsets of contact make the error uneven; of three halvings' mean half an order may be missing.
        assert!(observed > expected_order - 0.5, "{observed}");
    }
}

/// A ball of infinite mass at speed V gives a ball at rest 2 V, without damping: work 2 m V^2.
#[test]
fn piston_gives_twice_its_speed() {
    for (integrator, allowed) in [("verlet", 2e-5), ("rk4", 2e-5), ("dopri5", 2e-5)] {
        let text = format!(
            r#"
            [time]
            duration_s = 1.0
            time_step_s = 1e-4
            [method]
            integrator = "{integrator}"
            [material.rubber]
            point_stiffness_n_per_m = 1e4
            [motion.piston]
            interpolation = "linear"
            keyframe = [{{ time_s = 2.0, translation_m = [3.0, 0.0, 0.0] }}]
            [[sphere]]
            radius_m = 0.5
            mass_kg = 1.0
            material = "rubber"
            position_m = [0.0, 0.0, 0.0]
            motion = "piston"
            [[sphere]]
            radius_m = 0.5
            mass_kg = 2.0
            material = "rubber"
            position_m = [1.25, 0.0, 0.0]
            "#
        );
        let mut run = Run::new(&text);
        let work: f64 = recorded(&mut run).iter().map(|record| record.drive_work_j.unwrap()).sum();
        let speed = run.state.bodies[1].linear_velocity_m_per_s[0];
        // A contact of 222 steps: its onset falls within a step, (pi / 222)^2 / 12 of the speed for verlet.
        check(&format!("{integrator}: speed over 2 V"), (speed / 3.0 - 1.0).abs(), allowed);
        check(&format!("{integrator}: work over 2 m V^2"), (work / 9.0 - 1.0).abs(), 2.0 * allowed);
    }
}

const SHEET: &str = r#"
    [time]
    duration_s = 6.0
    time_step_s = 1e-3
    [forces]
    gravity_m_per_s2 = [0.0, -9.8, 0.0]
    linear_drag_kg_per_s = 0.05
    angular_drag_kg_m2_per_s = 2e-3
    [record]
    reactions = true
    [material.wire]
    line_stiffness_n_per_m2 = 1e4
    damping_s_per_m = 2.0
    [motion.hand]
    pivot_m = [0.5, 0.0, 0.0]
    keyframe = [{ time_s = 0.5, translation_m = [0.0, 0.05, 0.0] }]
    [[weave]]
    pattern = "european-4-in-1"
    rows = 4
    columns = 4
    major_radius_m = 0.4
    minor_radius_m = 0.06
    ring_mass_kg = 0.01
    material = "wire"
    rotation_rad = [3.141592653589793, 0.0, 0.0]
    pins = [[0, 0], [0, 1]]
    grip = [{ motion = "hand", rings = [[0, 2], [0, 3]] }]
"#;

#[test]
fn supports_bear_the_weight_at_rest() {
    let mut run = Run::new(SHEET);
    let all = recorded(&mut run);
    let last = &all[all.len() - 1];
    let reactions = last.reactions.as_ref().expect("the scene asks for them");
    assert_eq!(reactions.pins.iter().map(|pin| pin.body).collect::<Vec<_>>(), [0, 1]);
    assert_eq!(reactions.motions.len(), 1);
    let hand = &reactions.motions[0];
    assert_eq!((hand.motion.as_str(), hand.translation_m), ("hand", [0.0, 0.05, 0.0]));
    let sum =
        |axis: usize| reactions.pins.iter().map(|pin| pin.force_n[axis]).sum::<f64>() + hand.force_n[axis];
    let weight = 16.0 * 0.01 * 9.8;
    println!(
        "at rest but for {:.1e} J; pins and hand bear {:?} N",
        last.kinetic_energy_j,
        [sum(0), sum(1), sum(2)]
    );
    // What is still moving: rings of 0.01 kg that have lost all but a speed of sqrt(2 E / m), of periods of 0.1 s
    // and more.
    let rest = 14.0 * 0.01 * 60.0 * (2.0 * last.kinetic_energy_j / 0.01).sqrt();
    check("weight (N)", (sum(1) + weight).abs(), rest + 1e-12);
    check("sideways (N)", sum(0).abs() + sum(2).abs(), 2.0 * rest + 1e-12);
    assert!(rest < 0.01 * weight, "it hangs still: {rest}");
    // Nothing turns: the moments of pins, hand and weight about the World's z axis cancel.
    let mut moment = 0.0;
    for pin in &reactions.pins {
        let [x, y, _] = run.state.bodies[pin.body as usize].position_m;
        moment += pin.torque_n_m[2] + x * pin.force_n[1] - y * pin.force_n[0];
    }
    moment += hand.torque_n_m[2] + 0.5 * hand.force_n[1] - 0.05 * hand.force_n[0];
    for body in &run.state.bodies {
        moment += body.position_m[0] * 0.01 * 9.8;
    }
    check("moment (N m)", moment.abs(), 3.0 * rest + 1e-12);
}

/// In each step the supports bear what gravity gives and the momentum does not get, to rounding.
#[test]
fn reactions_close_the_balance_of_momentum() {
    let mut run =
        Run::with(SHEET, &["forces.linear_drag_kg_per_s=0".to_owned(), "time.duration_s=1".to_owned()]);
    let mut records = Records::after(schemas::Hash::default());
    evaluate(&run.model, &run.state, &mut run.scratch);
    let momentum = |run: &Run| -> f64 {
        let free = run.state.bodies.iter().zip(run.model.bodies()).filter(|(_, body)| !body.pinned);
        free.map(|(state, body)| body.mass_kg * state.linear_velocity_m_per_s[1]).sum()
    };
    let mut worst = 0.0;
    for _ in 0..1000 {
        let before = momentum(&run);
        run.step();
        let gained = momentum(&run) - before;
        let record = records.record(&run.model, &run.state, &run.scratch);
        let reactions = record.reactions.unwrap();
        let mut borne: f64 = reactions.pins.iter().map(|pin| pin.force_n[1]).sum();
        borne += reactions.motions[0].force_n[1];
        let error = (1e-3 * (-16.0 * 0.01 * 9.8 - borne) - gained).abs();
        if error > worst {
            worst = error;
        }
    }
    // Sums over 16 rings of momenta of some 0.03 N s.
    check("momentum unaccounted for in a step (N s)", worst, 16.0 * 4.0 * 2e-16 * 0.03);
}

#[test]
fn a_run_with_motions_goes_on_from_any_state() {
    for integrator in ["verlet", "rk4", "dopri5", "energy-decaying"] {
        let text = shaken(1e-3, integrator, 0.2);
        let mut whole = Run::new(&text);
        whole.steps(200);
        let mut part = Run::new(&text);
        part.steps(90);
        part.scratch = Scratch::new(&part.model, 2);
        part.steps(110);
        assert_eq!(whole.state, part.state);
    }
}

/// The first record has no work yet; scenes without motions have none to tell, and reactions only on request.
#[test]
fn records_are_silent_about_what_is_not_there() {
    let mut run = Run::new(&shaken(1e-3, "verlet", 0.0));
    let all = recorded(&mut run);
    assert_eq!(all[0].drive_work_j, Some(0.0));
    let mut run = Run::new(include_str!("../../../scenes/two-rings.toml"));
    let all = recorded(&mut run);
    assert!(all.iter().all(|record| record.drive_work_j.is_none() && record.reactions.is_none()));
    let text = serde_json::to_string(&all[1]).unwrap();
    assert!(!text.contains("drive_work") && !text.contains("reactions"), "{text}");
}

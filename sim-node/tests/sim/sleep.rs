//! Islands at rest: they fall asleep, cost nothing, wake, and no bit depends on anything but the state.

use crate::support::Run;
use schemas::{Hash, state};
use sim_node::{Records, Scratch, State, check_audit, evaluate, step};
use std::time::Instant;

const SLEEP: &str = "sleep = { speed_m_per_s = 1e-3, acceleration_m_per_s2 = 0.05 }";

/// A 6x6 sheet that hangs from its first row, in thick air, and a ball far away that flies towards it.
fn sheet(integrator: &str, sleep: &str, friction: f64) -> String {
    let pins: Vec<String> = (0..6).map(|column| format!("[0, {column}]")).collect();
    format!(
        r#"
        [time]
        duration_s = 20.0
        time_step_s = 2.5e-4
        frames_per_second = 20.0
        [method]
        integrator = "{integrator}"
        {sleep}
        [forces]
        gravity_m_per_s2 = [0.0, 9.81, 0.0]
        linear_drag_kg_per_s = 1.0
        angular_drag_kg_m2_per_s = 0.4
        [material.wire]
        line_stiffness_n_per_m2 = 1e6
        point_stiffness_n_per_m = 1e5
        damping_s_per_m = 0.3
        line_damping_n_s_per_m2 = 300.0
        friction_coefficient = {friction:?}
        [[weave]]
        pattern = "european-4-in-1"
        rows = 6
        columns = 6
        major_radius_m = 1.0
        minor_radius_m = 0.18
        ring_mass_kg = 0.64
        material = "wire"
        pins = [{}]
        [[sphere]]
        radius_m = 1.2
        mass_kg = 2.0
        material = "wire"
        position_m = [4.0, -150.0, -60.0]
        linear_velocity_m_per_s = [0.0, 0.0, 4.0]
        "#,
        pins.join(", ")
    )
}

fn still(run: &Run) -> usize {
    let zero = |body: &&schemas::state::BodyState| {
        body.linear_velocity_m_per_s == [0.0; 3] && body.angular_velocity_rad_per_s == [0.0; 3]
    };
    run.state.bodies.iter().filter(zero).count()
}

fn hash(state: &State) -> Hash {
    state::encode(&state.header(), &state.bodies, &state.contacts, &mut Vec::new())
}

/// Steps until all rings have been at rest for twenty steps: an island that stops where forces do not balance goes on.
fn settle(run: &mut Run) -> u64 {
    let mut at_rest = 0;
    while at_rest < 20 {
        run.step();
        at_rest = if still(run) >= 36 { at_rest + 1 } else { 0 };
        assert!(run.state.sim_time_s < 18.0, "{} rings at rest", still(run));
    }
    run.state.step
}

#[test]
fn a_settled_sheet_sleeps_and_costs_next_to_nothing() {
    for (integrator, friction, ball) in [("verlet", 0.0, true), ("verlet", 0.3, true), ("verlet", 0.0, false)]
    {
        let text = |sleep| {
            let text = sheet(integrator, sleep, friction);
            if ball { text } else { text[..text.find("[[sphere]]").unwrap()].to_owned() }
        };
        let (mut run, mut awake) = (Run::new(&text(SLEEP)), Run::new(&text("")));
        let mut records = Records::after(Hash::default());
        evaluate(&run.model, &run.state, &mut run.scratch);
        let first = records.record(&run.model, &run.state, &run.scratch);
        records.check_energy(&first).unwrap();
        let steps = settle(&mut run);
        awake.steps(steps);
        let (rest, springs) = (run.state.bodies.clone(), run.state.contacts.clone());
        // The shortest of ten, as other work on the machine only makes them longer.
        let seconds = |run: &mut Run| {
            let each = (0..10).map(|_| {
                let start = Instant::now();
                run.steps(40);
                start.elapsed().as_secs_f64()
            });
            each.fold(f64::INFINITY, |least, x| if x < least { x } else { least })
        };
        let (asleep_s, awake_s) = (seconds(&mut run), seconds(&mut awake));
        assert_eq!(run.state.bodies[..36], rest[..36], "rings stay where they are");
        assert_eq!(run.state.contacts, springs);
        let record = records.record(&run.model, &run.state, &run.scratch);
        records.check_energy(&record).unwrap();
        let other = Records::after(Hash::default()).record(&awake.model, &awake.state, &awake.scratch);
        println!(
            "{integrator}, friction {friction}, a ball in flight {ball}: asleep after {:.2} s; a step costs {:.4} of one awake; {} contacts \
             ({} awake), deepest {:.3e} m ({:.3e})",
            steps as f64 * 2.5e-4,
            asleep_s / awake_s,
            record.contacts,
            other.contacts,
            record.penetration_m,
            other.penetration_m
        );
        assert!(record.contacts > 40, "contacts at rest are still told of");
        check_audit(&run.model, &run.state, &sim_node::audit(&run.model, &run.state)).unwrap();
        // Where the sheet that was never stopped is: within what speeds of 1 mm/s against this drag are worth.
        let apart = run.state.bodies[..36]
            .iter()
            .zip(&awake.state.bodies)
            .map(|(a, b)| (geometry::Vec3::from(a.position_m) - geometry::Vec3::from(b.position_m)).norm());
        let apart = apart.fold(0.0, |largest, x| if x > largest { x } else { largest });
        println!("  {apart:.2e} m from the sheet that does not sleep, allowed 1e-2");
        assert!(apart < 1e-2, "{apart}");
    }
}

#[test]
fn what_comes_near_wakes_an_island() {
    let mut run = Run::new(&sheet("verlet", SLEEP, 0.0));
    settle(&mut run);
    let rest = run.state.bodies.clone();
    // The ball is put before the sheet, and hits it.
    run.state.bodies[36].position_m = [3.0, 3.0, -3.0];
    run.state.bodies[36].linear_velocity_m_per_s = [0.0, 0.0, 8.0];
    let mut woken = None;
    let mut touched = false;
    for _ in 0..2000 {
        run.step();
        let distance = run.state.bodies[36].position_m[2].abs();
        if woken.is_none() && still(&run) == 6 {
            woken = Some(distance);
        }
        touched |= run.state.bodies[36].linear_velocity_m_per_s[2] < 6.0;
    }
    let woken = woken.expect("the sheet wakes");
    println!("woken with the ball's centre {woken:.2} m from the sheet's plane");
    // Bounding radii of 1.18 and 1.2 m: before the ball's surface reaches the wires.
    assert!(woken > 1.2 + 0.18 && touched);
    assert!(run.state.bodies[..36].iter().zip(&rest).any(|(a, b)| a.position_m != b.position_m));
}

#[test]
fn gravity_wakes_what_hangs_in_the_air() {
    // All velocities are zero at the start.
    let mut run = Run::new(&sheet("verlet", SLEEP, 0.0));
    run.state.bodies[36].linear_velocity_m_per_s = [0.0; 3];
    run.step();
    assert_eq!(still(&run), 6, "only the pinned ones are at rest");
}

#[test]
fn a_sleeping_run_goes_on_from_any_state() {
    for (integrator, friction) in [("verlet", 0.3), ("rk4", 0.0), ("backward-euler", 0.0)] {
        // Two islands: one settles sooner than the other comes.
        let text = sheet(integrator, SLEEP, friction).replace("time_step_s = 2.5e-4", "time_step_s = 2.5e-5");
        let text = if integrator == "rk4" { text } else { sheet(integrator, SLEEP, friction) };
        let mut run = Run::new(&text);
        // Near its rest, so that it need not fall for long.
        let mut settled = Run::new(&sheet("verlet", SLEEP, friction));
        settle(&mut settled);
        run.state.bodies.clone_from(&settled.state.bodies);
        run.state.contacts.clone_from(&settled.state.contacts);
        run.state.bodies[36].position_m = [3.0, 3.0, -2.36];
        run.state.bodies[36].linear_velocity_m_per_s = [0.0, 0.0, 4.0];
        let mut fresh = run.state.clone();
        let (mut slept, mut woke) = (false, false);
        for _ in 0..300 {
            run.step();
            let mut scratch = Scratch::new(&run.model, 1);
            step(&run.model, &mut fresh, &mut scratch).unwrap();
            assert_eq!(hash(&run.state), hash(&fresh), "{integrator}, step {}", run.state.step);
            slept |= still(&run) == 36;
            woke |= slept && still(&run) == 6;
        }
        assert!(slept && woke, "{integrator}: {slept} {woke}");
    }
}

/// 1,100 balls on a floor, a few of them thrown.
fn balls() -> String {
    let mut text = format!(
        r#"
        [time]
        duration_s = 1.0
        time_step_s = 2.5e-4
        frames_per_second = 10.0
        [method]
        {SLEEP}
        [forces]
        gravity_m_per_s2 = [0.0, 0.0, -9.81]
        [material.rubber]
        point_stiffness_n_per_m = 1e4
        point_damping_n_s_per_m = 60.0
        [[plane]]
        normal = [0.0, 0.0, 1.0]
        offset_m = 0.0
        material = "rubber"
        "#
    );
    for index in 0..1100 {
        let (x, y) = (2.2 * f64::from(index % 33), 2.2 * f64::from(index / 33));
        let speed = if index % 97 == 5 { 3.0 } else { 0.0 };
        text += &format!(
            "[[sphere]]\n radius_m = 1.0\n mass_kg = 1.0\n material = \"rubber\"\n position_m = [{x:?}, {y:?}, 1.0]\n \
             linear_velocity_m_per_s = [{speed:?}, 0.0, 0.0]\n"
        );
    }
    text
}

#[test]
fn islands_sleep_alike_on_any_number_of_threads() {
    let text = balls();
    let run = |threads: usize| {
        let mut run = Run::new(&text);
        run.scratch = Scratch::new(&run.model, threads);
        run.steps(2400);
        (hash(&run.state), still(&run))
    };
    let one = run(1);
    println!("{} of 1100 balls asleep", one.1);
    assert!(one.1 > 500 && one.1 < 1100, "{}", one.1);
    for threads in [2, 3] {
        assert_eq!(run(threads), one, "{threads} threads");
    }
}

#[test]
fn audits_hold_while_islands_fall_asleep() {
    let mut run = Run::new(&balls());
    let mut records = Records::after(Hash::default());
    evaluate(&run.model, &run.state, &mut run.scratch);
    let first = records.record(&run.model, &run.state, &run.scratch);
    records.check_energy(&first).unwrap();
    let mut fell_asleep = 0;
    for _ in 0..2400 {
        let before = still(&run);
        run.step();
        fell_asleep += usize::from(still(&run) > before);
        let record = records.record(&run.model, &run.state, &run.scratch);
        records.check_momentum().unwrap();
        records.check_energy(&record).unwrap();
    }
    assert!(fell_asleep > 0);
}

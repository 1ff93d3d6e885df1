//! `resume`: a run that goes on from any step leaves the log of the run that was never interrupted.

use crate::command::{Background, Place, TINY, signal};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use schemas::scene::Scene;
use schemas::state;
use sim_node::{Model, Records, Scratch, State, evaluate, step};

#[test]
fn the_log_is_that_of_the_uninterrupted_run() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run"]);
    let log = place.bytes("run/log.mcap");
    // The first step, one with a frame, one without, the last but one, the last.
    for from in ["0", "17", "31", "59", "60"] {
        place.expect(0, &["resume", "run/log.mcap", "--from-step", from, "--out", "on", "--force"]);
        assert!(place.bytes("on/log.mcap") == log, "from step {from} the log differs");
    }
    assert!(place.path("on/frames/0003.png").exists());
    // Cut off in the middle, recovered or not.
    std::fs::write(place.path("cut.mcap"), &log[..log.len() * 6 / 10]).expect("a file");
    place.expect(0, &["resume", "cut.mcap", "--out", "on", "--force"]);
    assert!(place.bytes("on/log.mcap") == log, "from a log that was cut off the log differs");
    place.expect(3, &["recover", "cut.mcap", "--out", "fixed.mcap"]);
    place.expect(0, &["resume", "fixed.mcap", "--out", "on", "--force", "--threads", "1"]);
    assert!(place.bytes("on/log.mcap") == log, "from a recovered log the log differs");
    for (arguments, word) in [
        (&["resume", "run/log.mcap", "--from-step", "61", "--out", "new"][..], "0 to 60"),
        (&["resume", "run/log.mcap", "--out", "run", "--force"], "would be lost"),
        (&["resume", "run/log.mcap", "--out", "run"], "the log would be lost"),
        (&["resume", "none.mcap", "--out", "new"], "none.mcap"),
    ] {
        let text = place.expect(2, arguments);
        assert!(text.contains(word), "{arguments:?}: {text}");
    }
    assert!(place.bytes("run/log.mcap") == log && !place.path("new").exists());
}

#[test]
fn skipped_states_are_simulated_again() {
    let place = Place::new();
    let set = ["--set", "record.state_every=25", "--set", "forces.gravity_m_per_s2=[0.0,-200.0,0.0]"];
    place.expect(0, &[&["run", "tiny.toml", "--out", "run", "--no-render"][..], &set].concat());
    for from in ["24", "40"] {
        place.expect(0, &["resume", "run/log.mcap", "--from-step", from, "--out", "on", "--force"]);
        assert!(
            place.bytes("on/log.mcap") == place.bytes("run/log.mcap"),
            "from step {from} the log differs"
        );
    }
}

#[test]
fn an_interrupted_run_goes_on() {
    let place = Place::new();
    // Frames that take their time, so that the run is still there when the first are done.
    let set = ["time.duration_s=2", "render.samples_per_pixel=16", "render.width_px=64"]
        .map(|set| format!("--set={set}"));
    let run = |out: &'static str| ["run", "tiny.toml", "--out", out, &set[0], &set[1], &set[2]];
    let mut interrupted = Background::start(place.command(&run("part")));
    interrupted.wait_for("renderer (frames)");
    signal(interrupted.child.id(), "INT");
    assert_eq!(interrupted.finish(), Some(3), "{}", interrupted.seen);
    assert!(interrupted.seen.contains("chainmail resume"), "{}", interrupted.seen);
    place.expect(0, &["resume", "part/log.mcap", "--out", "on"]);
    place.expect(0, &run("whole"));
    assert!(place.bytes("on/log.mcap") == place.bytes("whole/log.mcap"), "the log differs");
}

/// All messages of a run, and the contacts that it had.
fn messages(model: &Model, threads: usize) -> (Vec<(Vec<u8>, schemas::step::StepRecord)>, u64) {
    let (mut state, mut scratch) = (State::initial(model), Scratch::new(model, threads));
    let mut records = Records::after(schemas::Hash::default());
    let (mut all, mut contacts) = (Vec::new(), 0);
    evaluate(model, &state, &mut scratch);
    loop {
        let record = records.record(model, &state, &scratch);
        records.check_momentum().and_then(|()| records.check_energy(&record)).expect("it goes on");
        contacts += record.contacts;
        all.push((records.state_message().to_vec(), record));
        if state.step == model.time().step_count() {
            return (all, contacts);
        }
        step(model, &mut state, &mut scratch).expect("it goes on");
    }
}

/// Goes on from a step and compares every record and state after it.
fn resumed_is_equal(
    text: &str,
    overrides: &[String],
    from: usize,
    threads: usize,
) -> Result<u64, TestCaseError> {
    let scene = Scene::parse(text, overrides).expect("a scene");
    let (model, _) = Model::compile(&scene).expect("a model");
    let (all, contacts) = messages(&model, 1);
    let from = from % all.len();
    let message = state::decode(&all[from].0).expect("a state");
    let mut state = State::from_message(&model, message).expect("of this model");
    let mut records = Records::after(schemas::Hash::default());
    all[..=from].iter().for_each(|(_, record)| records.follow(record));
    records.stand_at(&model, &state);
    let mut scratch = Scratch::new(&model, threads);
    evaluate(&model, &state, &mut scratch);
    for (bytes, logged) in &all[from + 1..] {
        step(&model, &mut state, &mut scratch).expect("it went on before");
        let record = records.record(&model, &state, &scratch);
        prop_assert_eq!(&record, logged, "from step {}", from);
        prop_assert!(records.state_message() == &bytes[..], "step {} from {}", record.step, from);
        records.check_momentum().and_then(|()| records.check_energy(&record)).expect("it went on before");
    }
    Ok(contacts)
}

const LAWS: [&str; 3] = ["centreline-arc", "centreline-minima", "surface-integral"];
const INTEGRATORS: [&str; 5] = ["verlet", "rk4", "dopri5", "energy-decaying", "backward-euler"];

/// The implicit integrators know the other laws alone.
fn fit(law: &str, integrator: &str) -> bool {
    law != "surface-integral" || !["energy-decaying", "backward-euler"].contains(&integrator)
}

#[test]
fn every_law_integrator_and_friction_goes_on_with_the_same_bits() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut contacts = 0;
    for law in LAWS {
        for integrator in INTEGRATORS {
            if !fit(law, integrator) {
                continue;
            }
            for friction in ["0.0", "0.4"] {
                let overrides = [
                    format!("method.contact_law=\"{law}\""),
                    format!("method.integrator=\"{integrator}\""),
                    format!("material.steel.friction_coefficient={friction}"),
                    "forces.gravity_m_per_s2=[20.0,-200.0,5.0]".to_owned(),
                    "time.duration_s=0.04".to_owned(),
                ];
                // The seed is fixed, so a failure is one everywhere.
                let from = (0_usize..41).new_tree(&mut runner).expect("a value").current();
                let equal = resumed_is_equal(TINY, &overrides, from, 1 + from % 2);
                let found = equal.unwrap_or_else(|error| panic!("{overrides:?} from step {from}: {error}"));
                println!("{law}, {integrator}, friction {friction}, from step {from}: {found} contacts");
                contacts += found;
            }
        }
    }
    assert!(contacts > 30, "the rings must touch: {contacts}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn any_step_goes_on_with_the_same_bits(
        law in 0_usize..3,
        integrator in 0_usize..5,
        friction in 0.0..0.8_f64,
        from in 0_usize..60,
        sleep in any::<bool>(),
        pull in -100.0..100.0_f64,
    ) {
        prop_assume!(fit(LAWS[law], INTEGRATORS[integrator]));
        let mut overrides = vec![
            format!("method.contact_law=\"{}\"", LAWS[law]),
            format!("method.integrator=\"{}\"", INTEGRATORS[integrator]),
            format!("material.steel.friction_coefficient={friction:?}"),
            format!("forces.gravity_m_per_s2=[{pull:?},-100.0,0.0]"),
        ];
        if sleep {
            overrides.push("method.sleep={speed_m_per_s=0.05,acceleration_m_per_s2=300.0}".to_owned());
        }
        resumed_is_equal(TINY, &overrides, from, 1)?;
    }
}

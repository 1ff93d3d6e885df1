//! The bound on the time step: safe, not silly, and stated for a penetration that a scene may choose.

use crate::blow_up::cases;
use crate::support::Run;
use schemas::Hash;
use schemas::scene::Scene;
use sim_node::{Model, ModelError, Records, evaluate};

/// Below the bound nothing blows up, and beyond a stated multiple of it everything does. For `rk4` the bound counts
/// damping, with levers that a hanging contact does not have.
#[test]
fn the_bound_is_safe_and_not_silly() {
    let cases = cases();
    // The last one takes minutes; the bench has it.
    for case in &cases[..cases.len() - 1] {
        let energy = case.energy();
        for (integrator, multiple) in [("verlet", 3.5), ("rk4", 10.0)] {
            let inside = case.run(integrator, 0.95, energy);
            println!(
                "{}, {integrator}, {:.3e} s: gained {:.1e} of the energy, {:.1} % deep, {}",
                case.name,
                case.bound(integrator),
                inside.gained_share,
                100.0 * inside.penetration_share,
                inside.stop.as_deref().unwrap_or("not stopped")
            );
            assert!(!inside.blown_up, "{}, {integrator}: {inside:?}", case.name);
            let beyond = case.run(integrator, multiple, energy);
            assert!(beyond.blown_up, "{}, {integrator}: {beyond:?}", case.name);
        }
    }
}

/// A 4x4 sheet that hangs.
fn sheet(time_step_s: f64, stiffness: f64, penetration: Option<f64>) -> Scene {
    let method = penetration.map_or(String::new(), |share| format!("stability_penetration = {share:?}"));
    let text = format!(
        r#"
        [time]
        duration_s = 0.5
        time_step_s = {time_step_s:?}
        [method]
        {method}
        [forces]
        gravity_m_per_s2 = [0.0, 9.81, 0.0]
        [material.wire]
        line_stiffness_n_per_m2 = {stiffness:?}
        damping_s_per_m = 3.0
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
    );
    Scene::parse(&text, &[]).unwrap()
}

fn bound(scene: &Scene) -> f64 {
    Model::compile(scene).unwrap().0.largest_time_step_s()
}

/// The deepest contact, and the deepest that the bound does not cover, as shares of both wires' radii together.
fn deepest(scene: &Scene) -> (f64, Option<f64>) {
    let mut run = Run::of(scene);
    let mut records = Records::after(Hash::default());
    evaluate(&run.model, &run.state, &mut run.scratch);
    let (mut deepest, mut beyond) = (0.0, None);
    for _ in 0..run.model.time().step_count() {
        run.step();
        let record = records.record(&run.model, &run.state, &run.scratch);
        records.check_energy(&record).unwrap();
        let share = record.penetration_m / 0.36;
        deepest = if share > deepest { share } else { deepest };
        beyond = match (beyond, record.penetration_beyond_bound) {
            (Some(a), Some(b)) => Some(if a > b { a } else { b }),
            (a, b) => a.or(b),
        };
    }
    (deepest, beyond)
}

#[test]
fn the_bound_goes_with_the_fourth_root_of_the_penetration_it_is_stated_for() {
    let (usual, shallow) = (bound(&sheet(1e-5, 2e6, None)), bound(&sheet(1e-5, 2e6, Some(0.01))));
    assert_eq!(usual, bound(&sheet(1e-5, 2e6, Some(0.05))));
    let expected = libm::sqrt(libm::sqrt(5.0));
    println!("{usual:e} s for 5 %, {shallow:e} s for 1 %: {:.6}, expected {expected:.6}", shallow / usual);
    // The length of the arc is the root of the depth exactly, and nothing else stiffens here.
    assert!((shallow / usual / expected - 1.0).abs() < 1e-12);
    // What is beyond the usual bound runs where little penetration is promised, and keeps the promise.
    let step = 0.98 * shallow;
    let error = Model::compile(&sheet(step, 2e6, None)).unwrap_err();
    assert!(matches!(error, ModelError::TimeStep { .. }), "{error}");
    assert!(error.to_string().contains("method.stability_penetration"), "{error}");
    let kept = deepest(&sheet(step, 2e6, Some(0.01)));
    println!("{:.3} % deep", 100.0 * kept.0);
    assert!(kept.0 < 0.01 && kept.1.is_none(), "{kept:?}");
}

#[test]
fn a_penetration_that_the_bound_does_not_cover_is_told() {
    // Soft enough to go deeper than 1 %; the step is as long as that depth allows.
    let step = 0.98 * bound(&sheet(1e-5, 1e5, Some(0.01)));
    let (deepest_share, beyond) = deepest(&sheet(step, 1e5, Some(0.01)));
    println!("{:.2} % deep, told {beyond:?}", 100.0 * deepest_share);
    let beyond = beyond.expect("it is deeper");
    assert!(
        (beyond / deepest_share - 1.0).abs() < 1e-12 && deepest_share > 0.01 / (0.98 * 0.98 * 0.98 * 0.98)
    );
    // Half the step covers sixteen times the depth: the same scene has nothing to tell.
    let half = sheet(0.5 * step, 1e5, Some(0.01));
    let covered = Model::compile(&half).unwrap().0.covered_penetration();
    let share = 0.49_f64;
    let expected = 0.01 / (share * share * share * share);
    assert!((covered / expected - 1.0).abs() < 1e-12, "{covered}, expected {expected}");
    let (deepest_share, beyond) = deepest(&half);
    assert!(deepest_share > 0.01 && beyond.is_none(), "{deepest_share} {beyond:?}");
    // Two parts a step, each of at most half the bound, cover as much.
    let mut in_parts = sheet(step, 1e5, Some(0.01));
    in_parts.method.on_risk = schemas::scene::OnRisk::Subdivide;
    let covered = Model::compile(&in_parts).unwrap().0.covered_penetration();
    assert!((covered / 0.16 - 1.0).abs() < 1e-12, "{covered}");
}

/// Only so many bodies fit around one: a heap of a thousand is bound as one of thirteen.
#[test]
fn many_bodies_bind_no_more_than_those_that_fit_around_one() {
    let heap = |count: usize| {
        let mut text = "[time]\n duration_s = 1.0\n time_step_s = 1e-5\n [material.wire]\n".to_owned();
        for number in 0..count {
            text += &format!(
                "[[sphere]]\n radius_m = 0.5\n mass_kg = 1.0\n material = \"wire\"\n position_m = [{number}.0, 0.0, 0.0]\n"
            );
        }
        bound(&Scene::parse(&text, &[]).unwrap())
    };
    let (two, thirteen, many) = (heap(2), heap(13), heap(1000));
    println!("{two:e} s for 2 spheres, {thirteen:e} s for 13, {many:e} s for 1000");
    assert!((many / thirteen - 1.0).abs() < 1e-12 && thirteen < two);
}

/// Rings without links may lie on each other; with links they would have to be folded over for it, which is said in
/// the plan.
#[test]
fn rings_that_may_lie_on_each_other_are_bound_by_it() {
    let rings = |second: &str, third: bool| {
        let ring = |place: &str| {
            format!(
                "[[ring]]\n major_radius_m = 1.0\n minor_radius_m = 0.18\n mass_kg = 1.0\n material = \"wire\"\n {place}\n"
            )
        };
        let text = format!(
            "[time]\n duration_s = 1.0\n time_step_s = 1e-5\n [material.wire]\n line_stiffness_n_per_m2 = 1e5\n{}{}{}",
            ring("position_m = [0.0, 0.0, 0.0]"),
            ring(second),
            if third { ring("position_m = [0.0, 0.0, 9.0]") } else { String::new() }
        );
        bound(&Scene::parse(&text, &[]).unwrap())
    };
    let apart = "position_m = [0.0, 0.0, 4.0]";
    // One spring of k 2 pi R between two masses of 1, counted twice for its impacts; with a third one two of them.
    let spring = 1e5 * 2.0 * core::f64::consts::PI * 2.0;
    let expected = 2.0 / libm::sqrt(2.0 * spring);
    for third in [false, true] {
        let bound = rings(apart, third);
        assert!((bound / expected - 1.0).abs() < 1e-12, "{bound} s, expected {expected}");
    }
    let linked = rings(
        "position_m = [0.0, 1.0, 0.0]\n orientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]",
        false,
    );
    assert!(linked > 1.5 * rings(apart, false), "{linked}");
    let (_, plan) = Model::compile(&sheet(0.98 * bound(&sheet(1e-5, 1e6, None)), 1e6, None)).unwrap();
    let line = plan.entries.iter().find(|entry| entry.part == "time/penetration").unwrap();
    assert!(
        line.reason.contains("lie on each other") && line.reason.contains("covered up to 5.4"),
        "{line:?}"
    );
}

//! Bodies deep inside each other, and in poses where the direction of the contact is not defined. No scene may
//! start so; here the state is set by hand.

use crate::support::{ACROSS, Run, Vec3, check, head, parse, ring};
use sim_node::{Model, ModelError};

const K: f64 = 1e4;
const PI: f64 = core::f64::consts::PI;

/// Eight Gauss points for a quarter of a circle, in the tangent of half its angle, miss its length by 9.3e-12 of it.
const WHOLE_CIRCLE: f64 = 1e-11;

/// Two free rings that are apart, of mass 1.
fn two(second: [f64; 2], first_more: &str) -> Run {
    two_with_step(0.05, second, first_more)
}

/// The same with a step of this share of the bound.
fn two_with_step(share: f64, second: [f64; 2], first_more: &str) -> Run {
    let text = head(1e-5, "verlet", K, "")
        + &ring([1.0, 0.18], 1.0, [0.0; 3], first_more)
        + &ring(second, 1.0, [0.0, 0.0, 9.0], "");
    Run::at_bound(&parse(&text), share)
}

/// No contact is stronger than all of a wire at full depth.
fn strongest() -> f64 {
    K * 0.36 * 2.0 * PI
}

#[test]
fn deep_overlap_gives_back_what_is_stored_and_no_more() {
    // From just touching, `2 R - 2 r` apart, to centrelines that touch (2 r) and that have crossed.
    for depth in [0.18, 0.342, 0.36, 0.361, 0.5, 0.7] {
        for aside in [0.0, 1e-3] {
            let mut run = two([1.0, 0.18], ACROSS);
            run.state.bodies[1].position_m = [aside, -1.64 - depth, 0.0];
            let stored = run.contact_energy();
            let mut most = 0.0;
            let mut force: f64 = 0.0;
            for _ in 0..4000 {
                let before = run.velocity(1);
                run.step();
                let pushed = (run.velocity(1) - before).norm() / run.time_step();
                force = if pushed > force { pushed } else { force };
                let moving = run.kinetic_energy() + run.contact_energy();
                most = if moving > most { moving } else { most };
            }
            println!("{depth} m deep, {aside} m aside: {stored:.3} J stored, at most {most:.3} J of motion");
            check("  force", force, strongest());
            // Where centrelines cross, the direction of the push turns over within a step.
            check("  energy, relative gain", most / stored - 1.0, 0.02);
        }
    }
}

#[test]
fn identical_rings_are_refused_and_push_nowhere() {
    let text = head(1e-5, "verlet", K, "")
        + &ring([1.0, 0.18], 1.0, [0.0; 3], "")
        + &ring([1.0, 0.18], 1.0, [0.0; 3], "");
    let error = Model::compile(&parse(&text)).unwrap_err();
    let ModelError::Overlap { gap_m, .. } = error else { panic!("{error}") };
    assert!(error.to_string().contains("ring 0 and ring 1") && (gap_m + 0.36).abs() < 1e-12, "{error}");

    for turned in [
        "",
        ACROSS,
        "orientation = [0.18257418583505536, 0.3651483716701107, 0.5477225575051661, 0.7302967433402214]",
    ] {
        let mut run = two_with_step(0.01, [1.0, 0.18], turned);
        run.state.bodies[1] = run.state.bodies[0];
        check(
            "energy, relative error",
            (run.contact_energy() / (0.5 * K * 0.36 * 0.36 * 2.0 * PI) - 1.0).abs(),
            WHOLE_CIRCLE,
        );
        // Every point of one centreline is on the other: no push has a direction, so there is none.
        run.guarded(2000).unwrap();
        assert_eq!((run.velocity(0), run.velocity(1)), (Vec3::zeros(), Vec3::zeros()));
        assert_eq!(run.position(0), run.position(1));
        // A thousandth of a wire apart they push each other on, with what is stored and no more.
        run.state.bodies[1].position_m[2] += 1e-4;
        let stored = run.contact_energy();
        for _ in 0..2000 {
            let before = run.velocity(1);
            run.step();
            let force = (run.velocity(1) - before).norm() / run.time_step();
            assert!(force <= strongest(), "{force:e} N");
            let moving = run.kinetic_energy() + run.contact_energy();
            assert!(moving <= 1.05 * stored, "{moving:e} J from {stored:e} J");
        }
        let apart = (run.position(1) - run.position(0)).norm();
        println!("{apart:e} m apart in the end");
        assert!(apart > 1e-3);
    }
}

/// Coaxial and `height` apart: every point of one centreline is as deep in the other ring as the next, so
/// the force is `k (2 r - height)` times the circumference.
#[test]
fn coaxial_rings_push_straight_apart() {
    for height in [1e-9, 0.1, 0.2, 0.35] {
        let mut run = two([1.0, 0.18], "");
        run.state.bodies[1].position_m = [0.0, 0.0, height];
        run.step();
        let expected = K * (0.36 - height) * 2.0 * PI * run.time_step();
        let [x, y, z] = run.state.bodies[1].linear_velocity_m_per_s;
        check("force, relative error", (z / expected - 1.0).abs(), WHOLE_CIRCLE);
        check("aside, relative", (x * x + y * y).sqrt() / expected, 1e-14);
        check("twist (rad/s)", run.spin(1).norm() / (expected / 0.5), 1e-14);
        assert_eq!(run.velocity(0), -run.velocity(1));
    }
}

#[test]
fn coplanar_rings_push_along_the_line_of_their_centres() {
    for depth in [1e-6, 0.05, 0.3] {
        let mut run = two([1.0, 0.18], "");
        run.state.bodies[1].position_m = [2.36 - depth, 0.0, 0.0];
        run.step();
        let [x, y, z] = run.state.bodies[1].linear_velocity_m_per_s;
        assert!(x > 0.0 && z == 0.0, "{x} {y} {z}");
        // At 1e-6 m the arcs' ends, and so their middle, are known to 1e-16 / 1e-3 of a radian.
        check("aside, relative", y.abs() / x, 1e-12);
        check("twist, relative", run.spin(1).norm() / x, 1e-12);
    }
    // One within the other: all of it touches, and nothing is left of the force.
    let mut run = two([0.74, 0.18], "");
    run.state.bodies[1].position_m = [0.0; 3];
    let expected = 0.5 * K * 0.1 * 0.1 * 2.0 * PI * 0.74;
    check("energy, relative error", (run.contact_energy() / expected - 1.0).abs(), WHOLE_CIRCLE);
    run.step();
    check("push (m/s)", run.velocity(1).norm(), 1e-12 * strongest() * run.time_step());
    assert_ne!(Vec3::zeros(), run.position(0) - Vec3::x());
}

#[test]
fn spheres_in_one_place_stay_finite() {
    let sphere = |x: f64| {
        format!(
            "[[sphere]]\n radius_m = 0.5\n mass_kg = 1.0\n material = \"wire\"\n position_m = [{x:?}, 0.0, 0.0]\n"
        )
    };
    let text = head(1e-5, "verlet", K, "")
        + &ring([1.0, 0.18], 1.0, [0.0, 0.0, 9.0], "")
        + &sphere(0.0)
        + &sphere(3.0);
    // Sphere on sphere, and a sphere's centre on a ring's axis and on its centreline.
    for (sphere, place) in [(2, [0.0; 3]), (2, [0.0, 0.0, 9.0]), (2, [1.0, 0.0, 9.0])] {
        let mut run = Run::at_bound(&parse(&text), 0.05);
        run.state.bodies[sphere].position_m = place;
        let stored = run.contact_energy();
        run.steps(2000);
        let moving = run.kinetic_energy() + run.contact_energy();
        println!("{place:?}: {stored:e} J stored, {moving:e} J of motion");
        assert!(moving <= 1.02 * stored, "{moving:e} J from {stored:e} J");
    }
}

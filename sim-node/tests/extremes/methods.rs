//! The cases again with implicit methods and with steps in parts, which accept any time step.

use crate::support::{ACROSS, Run, Vec3, check, head, parse, ring};
use schemas::scene::{OnRisk, Scene};
use sim_node::{BodyName, Stop, step};

/// Methods that accept any step: an integrator, and whether its steps are made in parts.
const ANY_STEP: [(&str, bool); 4] =
    [("backward-euler", false), ("energy-decaying", false), ("verlet", true), ("rk4", true)];

fn scene(integrator: &str, parts: bool, stiffness: f64, wire: &str, rest: &str) -> Scene {
    let mut scene = parse(&(head(1e-3, integrator, stiffness, wire) + rest));
    if parts {
        scene.method.on_risk = OnRisk::Subdivide;
    }
    scene
}

/// A ring that hangs in a pinned one, a little off its place of rest.
fn hanging(integrator: &str, parts: bool, stiffness: f64) -> Scene {
    let rest = "[forces]\n gravity_m_per_s2 = [0.0, -9.81, 0.0]\n".to_owned()
        + &ring([1.0, 0.18], 1.0, [0.0; 3], &format!("{ACROSS}\n pinned = true"))
        + &ring([1.0, 0.18], 1.0, [0.03, -1.635, 0.02], "");
    scene(integrator, parts, stiffness, "damping_s_per_m = 0.3", &rest)
}

/// Cases 2 and 3: any stiffness with the same step, and 0.3 to 3000 times the bound of `verlet`.
#[test]
fn any_stiffness_runs_at_any_step() {
    for (integrator, parts) in ANY_STEP {
        for stiffness in [1e2, 1e4, 1e6, 1e8, 1e10] {
            // In parts each step of 1e10 N/m^2 takes thousands of evaluations.
            let steps = if parts { 60 } else { 300 };
            let mut run = Run::new(&hanging(integrator, parts, stiffness));
            run.guarded(steps).unwrap_or_else(|stop| panic!("{integrator}, k = {stiffness:e}: {stop}"));
            let lowest = run.position(1).y;
            println!("{integrator}, k = {stiffness:e}: y = {lowest:.4} m after {steps} steps");
            assert!(lowest < -1.5 && lowest > if stiffness < 1e4 { -2.4 } else { -1.8 });
        }
    }
}

/// Case 1: a heavy and a light ring; momentum is kept to rounding by steps in parts, and to the residual by implicit
/// ones.
#[test]
fn rings_a_million_times_apart_in_mass_keep_their_momentum_by_any_method() {
    for (integrator, parts) in ANY_STEP {
        let standard = [1.0, 0.18];
        let rest = ring(standard, 1e3, [0.0; 3], ACROSS)
            + &ring(standard, 1e-3, [0.0, -1.3, 0.0], "linear_velocity_m_per_s = [0.0, -1.0, 0.0]");
        let mut run = Run::new(&scene(integrator, parts, 1e6, "", &rest));
        let momentum = |run: &Run| 1e3 * run.velocity(0) + 1e-3 * run.velocity(1);
        let before = momentum(&run);
        run.guarded(1000).unwrap_or_else(|stop| panic!("{integrator}: {stop}"));
        // Newton's iteration ends at 1e-9 of the speed, in each of the steps in contact; rounding is far below.
        let allowed = if parts { 1e-9 * 1e-3 } else { 1e-9 * 1e-3 * 100.0 };
        check(&format!("{integrator}: momentum gained (kg m/s)"), (momentum(&run) - before).norm(), allowed);
        assert!(run.velocity(1) != -Vec3::y(), "they met");
    }
}

/// Case 9: lengths times a power of four. Tolerances of the implicit methods are shares of the speed.
#[test]
fn scaling_changes_no_bit_of_any_method() {
    for (integrator, parts) in ANY_STEP {
        let plain = hanging(integrator, parts, 1e5);
        let mut run = Run::new(&plain);
        run.steps(100);
        for exponent in [-10, 1, 10] {
            let root = libm::exp2(f64::from(exponent));
            let s = root * root;
            let mut scaled = plain.clone();
            scaled.time.time_step_s *= root;
            scaled.time.duration_s *= root;
            scaled.time.frames_per_second /= root;
            let wire = scaled.materials.get_mut("wire").unwrap();
            wire.line_stiffness_n_per_m2 = wire.line_stiffness_n_per_m2.map(|k| k / (s * s));
            wire.damping_s_per_m /= root;
            for ring in &mut scaled.rings {
                ring.major_radius_m *= s;
                ring.minor_radius_m *= s;
                ring.position_m.iter_mut().for_each(|x| *x *= s);
            }
            let mut other = Run::new(&scaled);
            other.steps(100);
            let (a, b) = (&run.state.bodies[1], &other.state.bodies[1]);
            assert_eq!(a.position_m.map(|x| x * s), b.position_m, "{integrator}, scale {s:e}");
            assert_eq!(a.linear_velocity_m_per_s.map(|v| v * root), b.linear_velocity_m_per_s);
            assert_eq!(a.angular_velocity_rad_per_s.map(|w| w / root), b.angular_velocity_rad_per_s);
        }
    }
}

/// Case 10: 2^23 m from the origin.
#[test]
fn far_from_the_origin_any_method_stays_near() {
    for (integrator, parts) in ANY_STEP {
        let here = hanging(integrator, parts, 1e4);
        let mut there = here.clone();
        let offset = 8_388_608.0;
        there.rings.iter_mut().for_each(|ring| ring.position_m[0] += offset);
        let (mut near, mut far) = (Run::new(&here), Run::new(&there));
        near.guarded(200).unwrap();
        far.guarded(200).unwrap_or_else(|stop| panic!("{integrator}: {stop}"));
        let apart = (far.position(1) - Vec3::new(offset, 0.0, 0.0) - near.position(1)).norm();
        // A place is known to 2^-30 m; each of 200 steps (of at most 64 parts) rounds it a few times.
        let allowed = 3.0 * 200.0 * if parts { 64.0 } else { 1.0 } * libm::exp2(-30.0);
        check(&format!("{integrator}: farthest from the run at the origin (m)"), apart, allowed);
    }
}

/// Case 17: named in its step.
#[test]
fn a_number_that_is_not_finite_is_seen_by_any_method() {
    for (integrator, parts) in ANY_STEP {
        for bad in [f64::NAN, f64::INFINITY] {
            for field in 0..4 {
                let mut run = Run::new(&hanging(integrator, parts, 1e5));
                let body = &mut run.state.bodies[1];
                match field {
                    0 => body.position_m[1] = bad,
                    1 => body.orientation[2] = bad,
                    2 => body.linear_velocity_m_per_s[0] = bad,
                    _ => body.angular_velocity_rad_per_s[2] = bad,
                }
                let stop = step(&run.model, &mut run.state, &mut run.scratch).unwrap_err();
                let Stop::NonFinite { step, body, .. } = stop else { panic!("{integrator}: {stop}") };
                assert_eq!(body, BodyName::Ring(1), "{integrator}, number {field} is {bad}");
                assert!(step <= 1);
            }
        }
    }
}

/// Case 16: in parts a ring that would be through its link in one step is thrown back; a step that is soft enough to let
/// it through ends the run.
#[test]
fn a_ring_shot_at_its_link_is_held_or_missed_aloud() {
    for integrator in ["verlet", "rk4"] {
        let shot = |stiffness: f64| {
            let mut scene = hanging(integrator, true, stiffness);
            scene.rings[1].position_m[1] = -1.3;
            scene.rings[1].linear_velocity_m_per_s[1] = -400.0;
            Run::new(&scene).guarded(20)
        };
        shot(1e8).unwrap_or_else(|stop| panic!("{integrator}: {stop}"));
        let stop = shot(1e2).unwrap_err();
        println!("{integrator}: {stop}");
        assert!(matches!(stop, Stop::LinkBroken { .. }), "{stop}");
    }
}

/// Cases 4 and 5: deep overlaps and one place for both, set by hand.
#[test]
fn deep_overlap_creates_no_energy_by_any_method() {
    for (integrator, parts) in ANY_STEP {
        for place in [[0.0, -1.9, 0.0], [0.0, -2.0, 0.0], [0.0, -2.3, 0.0], [0.0, 0.0, 0.1], [0.0; 3]] {
            let across = if place[1] < 0.0 { ACROSS } else { "" };
            let rest =
                ring([1.0, 0.18], 1.0, [0.0; 3], across) + &ring([1.0, 0.18], 1.0, [0.0, 0.0, 9.0], "");
            let mut run = Run::new(&scene(integrator, parts, 1e4, "", &rest));
            run.state.bodies[1].position_m = place;
            let stored = run.contact_energy();
            let mut most = 0.0;
            for _ in 0..200 {
                run.step();
                let moving = run.kinetic_energy() + run.contact_energy();
                most = if moving > most { moving } else { most };
            }
            println!("{integrator}, {place:?}: {stored:.3} J stored, at most {most:.3} J of motion");
            // Where centrelines cross, the direction of the push turns over within a step of half the bound.
            assert!(most <= 1.3 * stored, "{integrator}, {place:?}: {most} J from {stored} J");
        }
    }
}

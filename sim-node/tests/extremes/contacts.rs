//! Contacts of bodies that differ a lot, very soft and very stiff ones, thin wires, friction at its limits.

use crate::support::{ACROSS, INTEGRATORS, Run, Vec3, check, head, parse, ring};
use sim_node::Stop;

#[test]
fn rings_a_million_times_apart_in_mass_keep_their_momentum() {
    let standard = [1.0, 0.18];
    let text = head(1e-5, "verlet", 1e6, "")
        + &ring(standard, 1e3, [0.0; 3], ACROSS)
        + &ring(standard, 1e-3, [0.0, -1.3, 0.0], "linear_velocity_m_per_s = [0.0, -1.0, 0.0]");
    let mut run = Run::at_bound(&parse(&text), 0.5);
    let momentum = |run: &Run| 1e3 * run.velocity(0) + 1e-3 * run.velocity(1);
    let (before, mut turned) = (momentum(&run), 0);
    let steps = (1.0 / run.time_step()) as u64;
    for _ in 0..steps {
        let speed = run.velocity(1).y;
        run.guarded(1).unwrap();
        turned += u64::from(speed < 0.0 && run.velocity(1).y >= 0.0);
    }
    assert!(turned > 0, "the light ring bounced");
    // Forces are opposite to the last bit; each step rounds each velocity once, by half an ulp at most.
    let allowed = steps as f64 * f64::EPSILON * 3e-3;
    check("momentum gained (kg m/s)", (momentum(&run) - before).norm(), allowed);
    let light = run.velocity(1) + Vec3::y();
    check("heavy ring's share", (run.velocity(0) + 1e-6 * light).norm() / light.norm(), 1e-6 * 1e-9);
    println!("bound on the step {:e} s, {steps} steps", 2.0 * run.time_step());
}

/// An undamped sphere on a plane: it leaves with the speed it came with, after half a period of its spring,
/// and in between it is pressed in by `v sqrt(m / k)`.
#[test]
fn a_bounce_is_the_same_for_any_stiffness() {
    let speed = 3.1321;
    for integrator in INTEGRATORS {
        for stiffness in [1e2, 1e4, 1e6, 1e8, 1e10_f64] {
            let depth = speed / stiffness.sqrt();
            let start = 0.5 + 0.01 * depth;
            let text = head(1e-9, integrator, 1e4, &format!("point_stiffness_n_per_m = {stiffness:?}"))
                + &format!(
                    "[[sphere]]\n radius_m = 0.5\n mass_kg = 1.0\n material = \"wire\"\n \
                     position_m = [0.0, 0.0, {start:?}]\n \
                     linear_velocity_m_per_s = [0.0, 0.0, {:?}]\n\
                     [[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = 0.0\n material = \"wire\"\n",
                    -speed
                );
            // verlet's error of the period is (omega h)^2 / 24, of the depth (omega h)^2 / 8.
            let mut run = Run::at_bound(&parse(&text), 1.0 / 200.0);
            let (mut inside, mut deepest) = (0, 0.0);
            while run.velocity(0).z < 0.0 || run.position(0).z < 0.5 {
                run.step();
                let pressed = 0.5 - run.position(0).z;
                inside += u64::from(pressed > 0.0);
                deepest = if pressed > deepest { pressed } else { deepest };
                assert!(run.state.step < 2000, "it comes back");
            }
            let time = inside as f64 * run.time_step();
            let expected = core::f64::consts::PI / stiffness.sqrt();
            println!("{integrator}, k = {stiffness:e} N/m, {} steps:", run.state.step);
            check("  contact time, relative error", (time / expected - 1.0).abs(), 1e-2);
            check("  restitution less 1", (run.velocity(0).z / speed - 1.0).abs(), 1e-2);
            check("  depth, relative error", (deepest / depth - 1.0).abs(), 1e-2);
        }
    }
}

/// The same with an automatic step: half the bound, a tenth of a period. By going through all depths of the first force
/// (`omega h` up to 0.71) a bounce of `verlet` gives back 0.88 to 1.13 of the energy, of `rk4` (0.92) 0.92 to 1.05, and so
/// the speed to 7 %; the time in contact is known to two steps.
#[test]
fn an_automatic_step_bounces_at_any_stiffness() {
    let speed = 3.1321;
    for (integrator, error) in [("verlet", 0.07), ("rk4", 0.07), ("dopri5", 1e-3)] {
        for stiffness in [1e2, 1e4, 1e6, 1e8, 1e10_f64] {
            let depth = speed / stiffness.sqrt();
            let text = format!(
                "[time]\n duration_s = {:?}\n time_step_s = \"auto\"\n frames_per_second = {:?}\n[method]\n \
                 integrator = \"{integrator}\"\n[material.wire]\n point_stiffness_n_per_m = {stiffness:?}\n\
                 [[sphere]]\n radius_m = 0.5\n mass_kg = 1.0\n material = \"wire\"\n \
                 position_m = [0.0, 0.0, {:?}]\n linear_velocity_m_per_s = [0.0, 0.0, {:?}]\n\
                 [[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = 0.0\n material = \"wire\"\n",
                8.0 / stiffness.sqrt(),
                stiffness.sqrt() / 8.0,
                0.5 + 0.01 * depth,
                -speed
            );
            let mut run = Run::new(&parse(&text));
            let steps = run.model.time().step_count();
            let mut inside = 0;
            for _ in 0..steps {
                run.guarded(1).unwrap_or_else(|stop| panic!("{integrator}, {stiffness:e}: {stop}"));
                inside += u64::from(run.position(0).z < 0.5);
            }
            println!("{integrator}, k = {stiffness:e} N/m, {steps} steps of {:e} s:", run.time_step());
            check("  restitution less 1", (run.velocity(0).z / speed - 1.0).abs(), error);
            if integrator == "dopri5" {
                // Its step has no bound and is the whole run.
                continue;
            }
            let time = inside as f64 * run.time_step() * stiffness.sqrt();
            let apart = (time - core::f64::consts::PI).abs() / (run.time_step() * stiffness.sqrt());
            check("  contact time, steps off", apart, 2.0);
        }
    }
}

#[test]
fn linked_rings_bounce_whatever_their_stiffness() {
    for stiffness in [1e2, 1e4, 1e6, 1e8, 1e10] {
        for integrator in INTEGRATORS {
            let text = head(1e-9, integrator, stiffness, "")
                + &ring([1.0, 0.18], 1.0, [0.0; 3], &format!("{ACROSS}\n pinned = true"))
                + &ring([1.0, 0.18], 1.0, [0.1, -1.5, 0.05], "");
            let mut scene = parse(&text);
            // Fast enough to press the wires in by about a twentieth, for which the bound is made.
            scene.rings[1].linear_velocity_m_per_s[1] = -0.006 * f64::sqrt(stiffness);
            let mut run = Run::at_bound(&scene, 0.5);
            run.guarded(3000).unwrap_or_else(|stop| panic!("{integrator}, k = {stiffness:e}: {stop}"));
        }
    }
}

#[test]
fn wires_of_a_thousandth_of_their_ring_hold() {
    let scene = |speed: f64| {
        let text = head(1e-4, "verlet", 1e6, "damping_s_per_m = 1.0")
            + "[forces]\n gravity_m_per_s2 = [0.0, -9.81, 0.0]\n"
            + &ring([1.0, 1e-3], 0.01, [0.0; 3], &format!("{ACROSS}\n pinned = true"))
            + &ring([1.0, 1e-3], 0.01, [0.0, -1.99, 0.0], "");
        let mut scene = parse(&text);
        scene.rings[1].linear_velocity_m_per_s[1] = -speed;
        scene
    };
    let mut run = Run::new(&scene(0.0));
    run.guarded(10_000).unwrap();
    let deepest = -1.998 - run.position(1).y;
    println!("{deepest:e} m lower than where the wires touch, of {:e} m", 2e-3);
    assert!(deepest < 2e-3 && run.position(1).y < -1.9);
    // Faster than a wire a step, it goes through, and that is seen in the same step.
    let mut run = Run::new(&scene(100.0));
    let stop = run.guarded(10).unwrap_err();
    println!("{stop}");
    assert!(matches!(stop, Stop::LinkBroken { step: 1..=2, links: 1, intact: 0, .. }), "{stop}");
}

/// A ring that lies on a floor and slides along x.
fn sliding(friction_coefficient: f64, speed: f64, height: f64) -> Run {
    let wire = format!(
        "damping_s_per_m = 0.5\n friction_coefficient = {friction_coefficient:?}\n \
         friction_stiffness_n_per_m = 1e4"
    );
    let text = head(1e-4, "verlet", 1e5, &wire)
        + "[forces]\n gravity_m_per_s2 = [0.0, 0.0, -9.81]\n"
        + "[[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = 0.0\n material = \"wire\"\n"
        + &ring([1.0, 0.18], 1.0, [0.0, 0.0, 0.18 + height], "");
    let mut scene = parse(&text);
    scene.rings[0].linear_velocity_m_per_s[0] = speed;
    Run::new(&scene)
}

#[test]
fn friction_at_its_limits() {
    // None: the speed is what it was, to the last bit.
    let mut run = sliding(0.0, 1.0, 0.0);
    run.guarded(5000).unwrap();
    assert_eq!(run.velocity(0), Vec3::new(1.0, 0.0, run.velocity(0).z));
    // Without slip there is nothing to divide by, and nothing moves aside.
    let mut run = sliding(0.5, 0.0, 0.1);
    run.guarded(5000).unwrap();
    // Only what rounding leaves of the torque.
    check("aside without slip (m/s)", libm::hypot(run.velocity(0).x, run.velocity(0).y), 1e-15);
    check("spin without slip (rad/s)", run.spin(0).norm(), 1e-15);
    // As much as one likes: it stops dead and stays, and friction gives no energy.
    let mut run = sliding(1e6, 1.0, 0.0);
    run.guarded(20_000).unwrap();
    let speed = run.velocity(0).norm();
    println!("after 2 s with a coefficient of 1e6: {speed:e} m/s, x = {} m", run.position(0).x);
    assert!(run.position(0).iter().all(|x| x.abs() < 3.0));
    assert!(run.kinetic_energy() < 0.5);
}

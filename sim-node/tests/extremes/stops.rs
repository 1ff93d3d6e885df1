//! Runs that cannot go on: each ends with a diagnostic, in the step where it is seen.

use crate::support::{ACROSS, BOUNDED, INTEGRATORS, Run, head, parse, ring};
use schemas::scene::Scene;
use sim_node::{BodyName, Stop, step};

/// A pair that vibrates in a lasting contact.
fn pressed(integrator: &str) -> Scene {
    let text = head(1e-9, integrator, 1e5, "")
        + "[forces]\n gravity_m_per_s2 = [0.0, -200.0, 0.0]\n"
        + &ring([1.0, 0.18], 1.0, [0.0; 3], &format!("{ACROSS}\n pinned = true"))
        + &ring([1.0, 0.18], 1.0, [0.03, -1.63, 0.02], "");
    parse(&text)
}

#[test]
fn a_time_step_far_beyond_the_bound_ends_by_energy_or_link() {
    for integrator in BOUNDED {
        let mut scene = pressed(integrator);
        scene.time.time_step_s = 4.0 * crate::support::bound(&scene);
        let mut run = Run::beyond(&scene);
        let stop = run.guarded(20_000).unwrap_err();
        println!("{integrator}: {stop}");
        let (Stop::EnergyGained { step, .. } | Stop::LinkBroken { step, .. }) = &stop else {
            panic!("{stop}")
        };
        let said = stop.to_string();
        assert!(said.contains(&format!("step {step}")) && said.contains("ring 0 and ring 1"), "{said}");
        assert!(run.state.bodies.iter().all(|body| body.position_m.iter().all(|x| x.is_finite())));
    }
}

/// With the energy audit off, what blows up grows until a number is not finite; then the step says so, and the
/// broad phase bears with whatever comes before.
#[test]
fn a_blow_up_that_nobody_watches_ends_by_name() {
    let mut text = head(1e-9, "rk4", 1e5, "") + "[forces]\n linear_drag_kg_per_s = 1e3\n";
    for x in 0..40 {
        text += &ring(
            [1.0, 0.18],
            1.0,
            [3.0 * f64::from(x), 0.0, 0.0],
            "linear_velocity_m_per_s = [1.0, 0.5, 0.0]",
        );
    }
    for choice in ["grid", "range-tree", "sweep-and-prune", "brute"] {
        let mut scene = Scene::parse(&text, &[format!("method.broad_phase={choice}")]).unwrap();
        // Drag takes a thousand times more than there is: each step turns the speed round and makes it larger.
        scene.time.time_step_s = 1.0;
        let mut run = Run::beyond(&scene);
        let stop = (0..1000).find_map(|_| step(&run.model, &mut run.state, &mut run.scratch).err());
        let stop = stop.expect("it cannot go on for ever");
        println!("{choice}: {stop}");
        let Stop::NonFinite { step, .. } = stop else { panic!("{stop}") };
        assert_eq!(step, run.state.step);
    }
}

#[test]
fn a_number_that_is_not_finite_is_seen_in_its_step() {
    for integrator in INTEGRATORS {
        let at_rest = Run::at_bound(&pressed(integrator), 0.5);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for field in 0..13 {
                let mut run = Run::at_bound(&pressed(integrator), 0.5);
                let body = &mut run.state.bodies[1];
                match field {
                    0..3 => body.position_m[field] = bad,
                    3..7 => body.orientation[field - 3] = bad,
                    7..10 => body.linear_velocity_m_per_s[field - 7] = bad,
                    _ => body.angular_velocity_rad_per_s[field - 10] = bad,
                }
                let stop = step(&run.model, &mut run.state, &mut run.scratch).unwrap_err();
                let Stop::NonFinite { step, body, .. } = stop else { panic!("{stop}") };
                assert_eq!((step, body), (1, BodyName::Ring(1)), "{integrator}, number {field} is {bad}");
                assert_eq!(run.state.bodies[0], at_rest.state.bodies[0], "a pinned ring stays");
            }
        }
    }
}

#[test]
fn a_ring_shot_through_its_link_ends_the_run() {
    let mut scene = pressed("verlet");
    scene.rings[1].position_m[1] = -1.2;
    scene.rings[1].linear_velocity_m_per_s[1] = -1e4;
    let stop = Run::at_bound(&scene, 1.0).guarded(100).unwrap_err();
    println!("{stop}");
    let Stop::LinkBroken { a, b, intact, links, .. } = stop else { panic!("{stop}") };
    assert_eq!((a, b, intact, links), (BodyName::Ring(0), BodyName::Ring(1), 0, 1));
}

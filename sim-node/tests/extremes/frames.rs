//! The same scene elsewhere, larger, and with its bodies in another order.

use crate::support::{ACROSS, BOUNDED, Run, Vec3, check, head, parse, ring};
use schemas::scene::Scene;

/// A linked pair on a shaker and a ball over a floor, with everything that contacts have; with the default law a
/// capsule and a box too, which the others refuse.
fn busy(integrator: &str, law: &str) -> Scene {
    let wire = "point_stiffness_n_per_m = 2e3\n surface_stiffness_n_per_m3 = 4e4\n damping_s_per_m = 0.25\n \
                line_damping_n_s_per_m2 = 2.0\n point_damping_n_s_per_m = 1.0\n \
                surface_damping_n_s_per_m3 = 10.0\n friction_coefficient = 0.3\n friction_stiffness_n_per_m = 2e3";
    let law_keys = format!("[method]\n contact_law = {law}\n");
    let mut text = head(2.5e-4, integrator, 2e4, wire).replace("[method]\n", &law_keys)
        + "[forces]\n gravity_m_per_s2 = [0.0, -9.81, 0.0]\n linear_drag_kg_per_s = 0.05\n \
           quadratic_drag_kg_per_m = 0.01\n angular_drag_kg_m2_per_s = 0.01\n"
        + "[motion.shaker]\n keyframe = [{ time_s = 0.5, translation_m = [0.0, 0.1, 0.0], angle_rad = 0.2 }]\n \
           shake = { translation_m = [0.02, 0.0, 0.0], frequency_hz = 3.0, ramp_s = 0.25 }\n"
        + &ring([1.0, 0.18], 1.0, [0.0; 3], &format!("{ACROSS}\n motion = \"shaker\""))
        + &ring([1.0, 0.18], 1.0, [0.1, -1.5, 0.05], "angular_velocity_rad_per_s = [0.0, 3.0, 1.0]")
        + "[[sphere]]\n radius_m = 0.5\n mass_kg = 1.0\n material = \"wire\"\n \
           position_m = [0.3, -2.4, 1.2]\n linear_velocity_m_per_s = [0.5, -3.0, 0.0]\n\
           [[plane]]\n normal = [0.0, 1.0, 0.0]\n offset_m = -3.0\n material = \"wire\"\n";
    if law == LAWS[0] {
        text += "[[capsule]]\n radius_m = 0.25\n half_length_m = 0.5\n mass_kg = 1.0\n material = \"wire\"\n \
                 position_m = [1.7, -2.4, 0.0]\n linear_velocity_m_per_s = [-3.0, 0.0, 0.0]\n\
                 [[box]]\n half_extents_m = [0.25, 0.375, 0.5]\n edge_radius_m = 0.0625\n mass_kg = 1.0\n \
                 material = \"wire\"\n position_m = [-1.5, -2.5, 0.5]\n \
                 angular_velocity_rad_per_s = [1.0, 2.0, -1.0]\n";
    }
    parse(&text)
}

/// Contact laws, the default first, as a scene writes them.
const LAWS: [&str; 4] = [
    "\"centreline-arc\"",
    "\"centreline-minima\"",
    "\"surface-integral\"",
    "\"surface-integral\"\n surface = { sampler = \"sobol\", samples = 256 }",
];

/// The same motion with all lengths `s` times, all times `sqrt(s)` times as long; masses and gravity stay. A force
/// stays too, so a line stiffness (force per length squared) goes with `s^-2`, and so on.
fn scaled(scene: &Scene, root: f64) -> Scene {
    let (mut scene, s) = (scene.clone(), root * root);
    scene.time.time_step_s *= root;
    scene.time.duration_s *= root;
    scene.time.frames_per_second /= root;
    scene.forces.linear_drag_kg_per_s /= root;
    scene.forces.quadratic_drag_kg_per_m /= s;
    scene.forces.angular_drag_kg_m2_per_s *= s * root;
    for material in scene.materials.values_mut() {
        material.line_stiffness_n_per_m2 = material.line_stiffness_n_per_m2.map(|k| k / (s * s));
        material.point_stiffness_n_per_m /= s;
        material.surface_stiffness_n_per_m3 /= s * s * s;
        material.surface_damping_n_s_per_m3 /= s * s * root;
        material.friction_stiffness_n_per_m /= s;
        material.damping_s_per_m /= root;
        material.line_damping_n_s_per_m2 /= s * root;
        material.point_damping_n_s_per_m /= root;
    }
    let motion = |position: &mut [f64; 3], linear: &mut [f64; 3], angular: &mut [f64; 3]| {
        position.iter_mut().for_each(|x| *x *= s);
        linear.iter_mut().for_each(|v| *v *= root);
        angular.iter_mut().for_each(|w| *w /= root);
    };
    for ring in &mut scene.rings {
        ring.major_radius_m *= s;
        ring.minor_radius_m *= s;
        motion(&mut ring.position_m, &mut ring.linear_velocity_m_per_s, &mut ring.angular_velocity_rad_per_s);
    }
    for ball in &mut scene.spheres {
        ball.radius_m *= s;
        motion(&mut ball.position_m, &mut ball.linear_velocity_m_per_s, &mut ball.angular_velocity_rad_per_s);
    }
    for capsule in &mut scene.capsules {
        capsule.radius_m *= s;
        capsule.half_length_m *= s;
        let (linear, angular) =
            (&mut capsule.linear_velocity_m_per_s, &mut capsule.angular_velocity_rad_per_s);
        motion(&mut capsule.position_m, linear, angular);
    }
    for cuboid in &mut scene.boxes {
        cuboid.half_extents_m.iter_mut().for_each(|x| *x *= s);
        cuboid.edge_radius_m *= s;
        motion(
            &mut cuboid.position_m,
            &mut cuboid.linear_velocity_m_per_s,
            &mut cuboid.angular_velocity_rad_per_s,
        );
    }
    for motion in scene.motions.values_mut() {
        motion.pivot_m.iter_mut().for_each(|x| *x *= s);
        for keyframe in &mut motion.keyframes {
            keyframe.time_s *= root;
            keyframe.translation_m.iter_mut().for_each(|x| *x *= s);
        }
        if let Some(shake) = &mut motion.shake {
            shake.translation_m.iter_mut().for_each(|x| *x *= s);
            shake.frequency_hz /= root;
            shake.start_s *= root;
            shake.ramp_s *= root;
        }
    }
    scene.planes.iter_mut().for_each(|plane| plane.offset_m *= s);
    scene
}

/// Powers of two round nothing: from micrometres to thousands of kilometres every bit is the same. (`dopri5` has a
/// tolerance in metres, and so a size of its own.)
#[test]
fn scaling_by_a_power_of_four_changes_no_bit() {
    let default = BOUNDED.map(|integrator| (integrator, LAWS[0], 4000));
    let others = LAWS[1..].iter().map(|law| ("verlet", *law, 800));
    for (integrator, law, steps) in default.into_iter().chain(others) {
        let scene = busy(integrator, law);
        let mut run = Run::new(&scene);
        let mut springs = 0;
        for _ in 0..steps {
            run.step();
            springs += run.state.contacts.len();
        }
        println!(
            "{integrator}, {law}: {springs} springs of friction, {:.3} J lost",
            run.state.dissipated_energy_j
        );
        assert!(springs > 50 && run.state.dissipated_energy_j > 0.0, "things touch and rub");
        for exponent in [-10, -1, 1, 10] {
            let root = libm::exp2(f64::from(exponent));
            let s = root * root;
            let mut other = Run::new(&scaled(&scene, root));
            other.steps(steps);
            for (a, b) in run.state.bodies.iter().zip(&other.state.bodies) {
                assert_eq!(a.position_m.map(|x| x * s), b.position_m, "{integrator}, {law}, scale {s:e}");
                assert_eq!(a.orientation, b.orientation);
                assert_eq!(a.linear_velocity_m_per_s.map(|v| v * root), b.linear_velocity_m_per_s);
                assert_eq!(a.angular_velocity_rad_per_s.map(|w| w / root), b.angular_velocity_rad_per_s);
            }
            for (a, b) in run.state.contacts.iter().zip(&other.state.contacts) {
                assert_eq!(a.spring_m.map(|x| x * s), b.spring_m);
            }
            assert_eq!(run.state.dissipated_energy_j * s, other.state.dissipated_energy_j);
        }
    }
}

/// 2^23 m from the origin a position is known to 2^-30 m. A swinging pair there stays near what it does here.
#[test]
fn far_from_the_origin_only_rounding_differs() {
    let text = head(1e-3, "verlet", 1e4, "damping_s_per_m = 1.0")
        + "[forces]\n gravity_m_per_s2 = [0.0, -9.81, 0.0]\n"
        + &ring([1.0, 0.18], 1.0, [0.0; 3], &format!("{ACROSS}\n pinned = true"))
        + &ring([1.0, 0.18], 1.0, [0.0, -1.625, 0.0], "linear_velocity_m_per_s = [0.125, 0.0, 0.0]");
    let here = parse(&text);
    let offset = 8_388_608.0;
    for direction in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 1.0, -1.0]] {
        let mut there = here.clone();
        for ring in &mut there.rings {
            (0..3).for_each(|axis| ring.position_m[axis] += offset * direction[axis]);
        }
        let (mut near, mut far) = (Run::new(&here), Run::new(&there));
        let mut worst = 0.0;
        let steps = 1000;
        for _ in 0..steps {
            near.step();
            far.guarded(1).unwrap();
            let apart = (far.position(1) - offset * Vec3::from(direction) - near.position(1)).norm();
            worst = if apart > worst { apart } else { worst };
        }
        // Each step rounds a position three times, to 2^-30 m at most; contacts turn that into a vibration of the
        // same size, gravity brings it back.
        check("farthest from the run at the origin (m)", worst, 3.0 * steps as f64 * libm::exp2(-30.0));
    }
}

/// Sums run in the order of the bodies' numbers, so another order rounds otherwise, and changes nothing else.
#[test]
fn the_order_of_the_bodies_is_only_rounding() {
    let sheet = |order: &dyn Fn(usize) -> usize| {
        let text = format!(
            "{}[forces]\n gravity_m_per_s2 = [0.0, 9.81, 0.0]\n[[weave]]\n pattern = \"european-4-in-1\"\n \
             rows = 4\n columns = 4\n major_radius_m = 1.0\n minor_radius_m = 0.18\n ring_mass_kg = 0.64\n \
             material = \"wire\"\n pins = [[0, 0], [0, 1], [0, 2], [0, 3]]\n",
            head(2e-4, "verlet", 1e5, "damping_s_per_m = 0.3")
        );
        let mut scene = parse(&text);
        let rings = scene.rings.clone();
        scene.rings = (0..rings.len()).map(|index| rings[order(index)].clone()).collect();
        let mut run = Run::new(&scene);
        run.guarded(1500).unwrap();
        run
    };
    let straight = sheet(&|index| index);
    let apart = |order: &dyn Fn(usize) -> usize| {
        let other = sheet(order);
        assert_eq!(other.model.linked_pairs().len(), straight.model.linked_pairs().len());
        (0..16).fold(0.0, |worst, index| {
            let apart = (other.position(index) - straight.position(order(index))).norm();
            if apart > worst { apart } else { worst }
        })
    };
    // Only rings of different rows touch. Within its row a ring may have any number.
    for order in [|index| index ^ 1, |index| index ^ 3, |index| index & 12 | (index + 1) & 3] {
        check("farthest apart, rows in order (m)", apart(&order), 1e-9);
    }
    // Of two equal rings the one with the lower number carries the arc along which the contact is summed. So with the
    // numbers turned round other contacts are a little stiffer: by a share of how far the wires press in.
    check("farthest apart, rows turned round (m)", apart(&|index| 15 - index), 5e-3);
    // Bodies that do not meet give equal bits in any order.
    let loose = |order: [f64; 3]| {
        let rings = order.map(|x| {
            let spin = format!("angular_velocity_rad_per_s = [1.0, {x:?}, 3.0]");
            ring([1.0, 0.18], 1.0, [9.0 * x, 0.0, 0.0], &spin)
        });
        let mut run = Run::new(&parse(&(head(1e-3, "verlet", 1e4, "") + &rings.concat())));
        run.steps(200);
        let mut bodies = run.state.bodies.clone();
        bodies.sort_by(|a, b| a.position_m[0].total_cmp(&b.position_m[0]));
        bodies
    };
    assert_eq!(loose([1.0, 2.0, 3.0]), loose([3.0, 1.0, 2.0]));
}

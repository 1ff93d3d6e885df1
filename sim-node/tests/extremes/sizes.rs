//! Wires from thin to as thick as their ring, and a hundred thousand rings.

use crate::support::{ACROSS, Run, Vec3, head, parse, ring};
use schemas::scene::Scene;
use sim_node::broad::{Method, Workspace, find_pairs};
use sim_node::{Model, Records, evaluate};

#[test]
fn wires_thinner_than_their_ring_run_and_others_are_refused() {
    let two = |minor: f64| {
        head(1e-4, "verlet", 1e4, "damping_s_per_m = 0.3")
            + "[forces]\n gravity_m_per_s2 = [0.0, 0.0, -9.81]\n"
            + "[[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = 0.0\n material = \"wire\"\n"
            + &ring([1.0, minor], 1.0, [0.0, 0.0, 1.05 * minor], "")
            + &ring(
                [1.0, minor],
                1.0,
                [0.3, 0.1, 3.2 * minor + 0.01],
                "angular_velocity_rad_per_s = [1.0, 0.0, 0.0]",
            )
    };
    let below = 1.0_f64.next_down();
    for minor in [1e-3, 0.1, 0.49, 0.5, 0.999, below] {
        let mut run = Run::at_bound(&parse(&two(minor)), 0.5);
        run.guarded(3000).unwrap_or_else(|stop| panic!("r = {minor:?} m: {stop}"));
        let heights = [run.position(0).z, run.position(1).z];
        println!("r = {minor} m: centres {heights:?} m high after {} s", run.state.sim_time_s);
        assert!(heights.iter().all(|&z| z > 0.5 * minor && z < 5.0));
    }
    for minor in [1.0, 1.0_f64.next_up(), 2.0] {
        let error = Scene::parse(&two(minor), &[]).expect_err("thicker than its ring").to_string();
        let said = ["ring[0].minor_radius_m", "less than major_radius_m = 1.0"];
        assert!(said.iter().all(|part| error.contains(part)), "{error}");
    }
}

/// Samples of the whole surface miss a contact of thin wires: a share of about 1e-9 of it is inside. The step record says
/// so; by quadrature the same contact has its force.
#[test]
fn samples_that_miss_a_thin_contact_are_told() {
    let run = |sampler: &str| {
        let text = head(1e-5, "verlet", 1e4, "").replace(
            "[method]\n",
            &format!(
                "[method]\n contact_law = \"surface-integral\"\n surface = {{ sampler = \"{sampler}\" }}\n"
            ),
        ) + &ring([1.0, 1e-3], 1.0, [0.0; 3], ACROSS)
            + &ring([1.0, 1e-3], 1.0, [0.0, -1.998, 0.0], "");
        let mut run = Run::new(&parse(&text));
        // A hundredth of the wires' radii deep.
        run.state.bodies[1].position_m[1] -= 2e-5;
        let mut records = Records::after(schemas::Hash::default());
        evaluate(&run.model, &run.state, &mut run.scratch);
        let record = records.record(&run.model, &run.state, &run.scratch);
        run.step();
        (record, run.velocity(1).norm())
    };
    let (record, speed) = run("uniform");
    let samples = record.surface_samples.expect("samples are drawn");
    println!("{samples:?}, {speed} m/s");
    assert_eq!((samples.pairs, samples.missed, samples.samples, samples.hits), (1, 1, 2000, 0));
    assert_eq!(speed, 0.0);
    // Samples in a box about the patch hit it.
    let (record, speed) = run("patch");
    let samples = record.surface_samples.expect("samples are drawn");
    println!("{samples:?}, {speed} m/s");
    assert!(samples.missed == 0 && samples.hits > 100 && samples.hits <= samples.samples && speed > 0.0);
    let (record, speed) = run("quadrature");
    println!("quadrature: {speed} m/s");
    assert!(record.surface_samples.is_none() && speed > 0.0);
}

/// A ring goes through the hole of one like itself if `R - r >= r`.
#[test]
fn rings_are_linked_while_their_holes_are_wide_enough() {
    let linked = |minor: f64| {
        let text = head(1e-5, "verlet", 1e4, "")
            + &ring([1.0, minor], 1.0, [0.0; 3], ACROSS)
            + &ring([1.0, minor], 1.0, [0.0, -1.0, 0.0], "");
        Model::compile(&parse(&text)).map(|(model, _)| model.linked_pairs().len())
    };
    for minor in [1e-3, 0.49, 0.5_f64.next_down(), 0.5] {
        assert_eq!(linked(minor), Ok(1), "r = {minor:?} m");
    }
    for minor in [0.5 + 1e-7, 0.6, 0.999] {
        let error = linked(minor).unwrap_err().to_string();
        assert!(error.contains("ring 0 and ring 1 overlap"), "r = {minor:?} m: {error}");
    }
}

#[test]
fn a_hundred_thousand_rings_move() {
    let text = format!(
        "{}[forces]\n gravity_m_per_s2 = [0.0, 9.81, 0.0]\n[[weave]]\n pattern = \"european-4-in-1\"\n rows = 320\n \
         columns = 320\n major_radius_m = 1.0\n minor_radius_m = 0.18\n ring_mass_kg = 0.64\n material = \"wire\"\n",
        head(1e-4, "verlet", 1e4, "")
    );
    let mut run = Run::new(&parse(&text));
    let count = run.model.ring_count();
    // Rows of 320, each row linked with the next: twice for each ring but one in a row's end.
    assert_eq!((count, run.model.linked_pairs().len()), (102_400, 319 * 639));
    run.steps(10);
    let mut records = Records::after(schemas::Hash::default());
    evaluate(&run.model, &run.state, &mut run.scratch);
    let record = records.record(&run.model, &run.state, &run.scratch);
    // The candidates of the last evaluation are the pairs whose bounding spheres overlap: checked as a whole
    // against another broad phase, and that one against all rings for a thousand of them.
    let centres: Vec<_> = (0..count).map(|body| run.position(body)).collect();
    let mut pairs = Vec::new();
    find_pairs(Method::RangeTree, &centres, &vec![1.18; count], 0.0, &mut Workspace::default(), &mut pairs);
    assert_eq!(record.candidate_pairs, pairs.len() as u64);
    for a in (0..count).step_by(count / 1000) {
        let near = |&b: &usize| b > a && (centres[a] - centres[b]).norm_squared() < 2.36 * 2.36;
        let expected = (0..count).filter(near).count();
        assert_eq!(pairs.iter().filter(|pair| pair.0 as usize == a).count(), expected, "pairs of ring {a}");
    }
    println!("{} candidate pairs, {:.2} a ring", pairs.len(), pairs.len() as f64 / count as f64);
    let fallen = run.position(0) - Vec3::from(run.model.initial_bodies()[0].position_m);
    assert!((fallen.y - 9.81 * 0.5e-6).abs() < 1e-12, "{fallen:?}");
    memory();
}

/// The most memory that this process had, where the system tells.
fn memory() {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return };
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let Some(kilobytes) = peak.and_then(|peak| peak.trim().trim_end_matches(" kB").parse::<u64>().ok())
    else {
        return;
    };
    println!("at most {} MB", kilobytes / 1000);
    assert!(kilobytes < 1_000_000, "{kilobytes} kB");
}

//! The scenes that come with the program: nothing passes through anything.

use crate::support::{Run, check};
use sim_node::{Records, check_audit, evaluate};

/// A ring hangs in a fixed ring whose plane is across its own, and swings in its own plane without friction:
/// its centre goes round the fixed wire at the distance `R - 2 r + d`. The wire bends upwards along the contact,
/// by `x^2 / (2 R)` and so by `d / (5 kappa R)` in the mean over the pressure: that much longer is the pendulum.
#[test]
fn ring_hanging_in_a_ring_swings_like_a_pendulum() {
    let (k, gravity, amplitude) = (1e6, 9.81, 1e-3);
    // Penetration at rest: m g = (4/3) k d sqrt(2 d / kappa), kappa = 1 / (2 r) - 1 / R.
    let kappa: f64 = 1.0 / 0.36 - 1.0;
    let depth = libm::cbrt({
        let root = gravity / (4.0 / 3.0 * k) * (0.5 * kappa).sqrt();
        root * root
    });
    let length = 1.0 - 0.36 + depth;
    let text = format!(
        r#"
        [time]
        duration_s = 8.2
        time_step_s = 2e-4
        [forces]
        gravity_m_per_s2 = [0.0, -{gravity}, 0.0]
        [material.wire]
        line_stiffness_n_per_m2 = {k:?}
        damping_s_per_m = 0.5
        [[ring]]
        major_radius_m = 1.0
        minor_radius_m = 0.18
        mass_kg = 1.0
        material = "wire"
        position_m = [0.0, 0.0, 0.0]
        orientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]
        pinned = true
        [[ring]]
        major_radius_m = 1.0
        minor_radius_m = 0.18
        mass_kg = 1.0
        material = "wire"
        position_m = [0.0, -1.63, 0.0]
        "#
    );
    let mut run = Run::new(&text);
    run.state.bodies[1].position_m =
        [length * libm::sin(amplitude), -1.0 - length * libm::cos(amplitude), 0.0];
    let mut crossings = Vec::new();
    for _ in 0..run.model.time().step_count() {
        let before = run.state.bodies[1].position_m[0];
        run.step();
        let after = run.state.bodies[1].position_m[0];
        if before > 0.0 && after <= 0.0 {
            crossings.push(run.state.sim_time_s - 2e-4 * after / (after - before));
        }
    }
    let swings = crossings.len() - 1;
    let period = (crossings[swings] - crossings[0]) / swings as f64;
    let pendulum = length + depth / (5.0 * kappa);
    let expected = 2.0 * core::f64::consts::PI * (pendulum / gravity).sqrt();
    println!("{swings} swings, period {period:.6} s, expected {expected:.6} s, depth {depth:.2e} m");
    // Depth and bend are first terms of series in depth over 2 r = 1e-3; together they make up 6e-4 of the
    // length, half of which counts in the period.
    check("period", (period / expected - 1.0).abs(), 3e-7);
}

/// Runs a scene to its end; checks links, penetration and energy on the way.
fn survives(name: &str, text: &str, energy_share: f64) {
    let mut run = Run::new(text);
    let mut records = Records::after(schemas::Hash::default());
    evaluate(&run.model, &run.state, &mut run.scratch);
    let first = records.record(&run.model, &run.state, &run.scratch);
    let energy = |r: &schemas::step::StepRecord| r.kinetic_energy_j + r.gravity_energy_j + r.contact_energy_j;
    let start = energy(&first);
    let (mut penetration, mut gap, mut error, mut lowest) = (0.0, f64::INFINITY, 0.0, start);
    let mut audits = u64::from(first.audit.is_some());
    for _ in 0..run.model.time().step_count() {
        run.step();
        let record = records.record(&run.model, &run.state, &run.scratch);
        if record.penetration_m > penetration {
            penetration = record.penetration_m;
        }
        let off = (energy(&record) + record.dissipated_energy_j - start).abs();
        if off > error {
            error = off;
        }
        if energy(&record) < lowest {
            lowest = energy(&record);
        }
        records.check_energy(&record).unwrap();
        if let Some(audit) = record.audit {
            audits += 1;
            check_audit(&run.model, &run.state, &audit).unwrap();
            if let Some(found) = audit.gap_min_m
                && found < gap
            {
                gap = found;
            }
        }
    }
    let wires = 2.0 * 0.06;
    println!(
        "{name}: penetration {:.2} % of 2 r, smallest gap {:.2} % of 2 r, {error:.3e} J unaccounted of {:.3} J released, \
         {audits} audits",
        100.0 * penetration / wires,
        100.0 * gap / wires,
        start - lowest
    );
    assert_eq!(audits, run.model.time().frame_count() + 1, "one a frame and one at the end");
    // The scenes' materials were chosen for it: the bound on the time step is made for 5 %.
    assert!(penetration < 0.05 * wires, "{penetration}");
    assert!(gap > -0.05 * wires, "{gap}");
    // The integrator's own error; the time steps were chosen so that it stays below this.
    assert!(error < energy_share * (start - lowest), "{error}");
}

#[test]
fn drop() {
    survives("drop", include_str!("../../../scenes/drop.toml"), 0.015);
}

#[test]
fn ball() {
    survives("ball", include_str!("../../../scenes/ball.toml"), 0.015);
}

#[test]
fn two_rings() {
    survives("two-rings", include_str!("../../../scenes/two-rings.toml"), 0.05);
}

//! The scenes that come with the program: nothing passes through anything.

use crate::support::Run;
use sim_node::{Records, check_audit, evaluate};

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

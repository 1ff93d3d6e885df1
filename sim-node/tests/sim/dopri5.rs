//! The adaptive method: closed forms reached for few evaluations, tops, and equal bits.

use crate::support::{Drop, Run};

#[test]
fn bounces_take_as_many_evaluations_at_any_stiffness() {
    for exponent in [2, 4, 6, 8, 10] {
        let drop = Drop { stiffness: libm::pow(10.0, f64::from(exponent)), ratio: 0.05 };
        let exact = drop.height_at(1.5);
        for (target, allowed) in [(1e-3, 2000), (1e-6, 3000)] {
            // The loosest tolerance that meets the target, as in the reference's table.
            let found = (2..13).find_map(|digits| {
                let tolerance = libm::pow(10.0, -f64::from(digits));
                let method = format!("tolerance = {tolerance:e}\n absolute_tolerance = {tolerance:e}");
                let mut run = Run::new(&drop.scene("dopri5", &method, 0.25, 1.5));
                run.finish();
                let error = (run.state.bodies[0].position_m[2] - exact).abs();
                (error < target).then(|| (tolerance, error, run.scratch.force_evaluations()))
            });
            let (tolerance, error, evaluations) = found.expect("some tolerance meets the target");
            println!(
                "k = 1e{exponent}: {error:.1e} m with tolerance {tolerance:e}, {evaluations} evaluations"
            );
            // The table: 1.3e3 to 1.8e3 for 1e-3 m and 2.3e3 to 2.6e3 for 1e-6 m.
            assert!(evaluations <= allowed, "{evaluations}");
        }
    }
}

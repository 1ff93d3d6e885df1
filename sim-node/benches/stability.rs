//! Where runs blow up, against the bound on the time step: the table of `docs/methods.md`.
//!
//! `cargo bench -p sim-node --bench stability` prints for each case and integrator the bound, the share of it from
//! which on the energy audit stops the run, and the share from which on it blows up, both found by going up in
//! steps of 5 %.

#[path = "../tests/sim/blow_up.rs"]
mod blow_up;

fn main() {
    println!(
        "{:48} {:7} {:>10} {:>8} {:>8} {:>9}",
        "case", "method", "bound (s)", "stopped", "blown up", "depth"
    );
    for case in blow_up::cases() {
        let energy = case.energy();
        for integrator in ["verlet", "rk4"] {
            let (mut stopped, mut blown_up, mut deepest) = (None, None, 0.0);
            let mut share = 0.2;
            while share < 10.0 && blown_up.is_none() {
                let outcome = case.run(integrator, share, energy);
                if stopped.is_none() && outcome.stop.is_some() {
                    stopped = Some(share);
                }
                if outcome.blown_up {
                    blown_up = Some(share);
                } else {
                    deepest = outcome.penetration_share;
                }
                share *= 1.05;
            }
            let text = |share: Option<f64>| share.map_or("> 10".to_owned(), |share| format!("{share:.2}"));
            println!(
                "{:48} {integrator:7} {:10.3e} {:>8} {:>8} {:7.1} %",
                case.name,
                case.bound(integrator),
                text(stopped),
                text(blown_up),
                100.0 * deepest
            );
        }
    }
}

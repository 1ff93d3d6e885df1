//! What each pair of bodies in contact does to both, pair by pair.

use crate::forces::Evaluation;
use crate::wrench::{Velocity, Wrench};
use geometry::Vec3;

/// The contact of one pair at one moment.
#[derive(Clone, Debug)]
pub(super) struct Touch {
    pub pair: (u32, u32),
    pub on_a: Wrench,
    pub on_b: Wrench,
    /// The inelastic part of both.
    pub lost_on_a: Wrench,
    pub lost_on_b: Wrench,
    /// Energy in the springs (J).
    pub energy: f64,
    /// Sum of the pressure's magnitudes (N).
    pub size: f64,
}

impl Touch {
    pub(super) fn none(pair: (u32, u32)) -> Touch {
        let zero = Wrench::ZERO;
        Touch { pair, on_a: zero, on_b: zero, lost_on_a: zero, lost_on_b: zero, energy: 0.0, size: 0.0 }
    }

    fn add(&mut self, other: &Touch) {
        self.on_a.add(&other.on_a);
        self.on_b.add(&other.on_b);
        self.lost_on_a.add(&other.lost_on_a);
        self.lost_on_b.add(&other.lost_on_b);
        self.energy += other.energy;
        self.size += other.size;
    }

    /// The power of the whole forces and of their inelastic part at the velocities of A and B (W).
    pub(super) fn powers(&self, a: &Velocity, b: &Velocity) -> (f64, f64) {
        let power =
            |wrench: &Wrench, v: &Velocity| wrench.force.dot(&v.linear) + wrench.torque.dot(&v.angular);
        let whole = power(&self.on_a, a) + power(&self.on_b, b);
        (whole, power(&self.lost_on_a, a) + power(&self.lost_on_b, b))
    }
}

fn three([x, y, z, _]: [f64; 4]) -> Vec3 {
    Vec3::new(x, y, z)
}

/// All pairs in contact, in order, each once.
pub(super) fn touches(evaluation: &Evaluation) -> Vec<Touch> {
    let mut all: Vec<Touch> = Vec::new();
    for arc in evaluation.arc_forces() {
        let wrench = |force, torque| Wrench { force: three(force), torque: three(torque) };
        let against = |force: [f64; 4], torque| Wrench { force: -three(force), torque: three(torque) };
        let [lost, lost_a, lost_b] = arc.lost;
        all.push(Touch {
            pair: (arc.a, arc.b),
            on_a: wrench(arc.force, arc.torque_a),
            on_b: against(arc.force, arc.torque_b),
            lost_on_a: wrench(lost, lost_a),
            lost_on_b: against(lost, lost_b),
            energy: arc.energy(),
            size: arc.torque_b[3],
        });
    }
    for force in evaluation.pair_forces() {
        all.push(Touch {
            pair: (force.a, force.b),
            on_a: force.on_a,
            on_b: force.on_b,
            lost_on_a: force.lost_on_a,
            lost_on_b: force.lost_on_b,
            energy: force.energy,
            size: force.contacts().map(|contact| contact.normal_force).sum(),
        });
    }
    all.sort_by_key(|touch| touch.pair);
    all.dedup_by(|next, kept| {
        let same = next.pair == kept.pair;
        if same {
            kept.add(next);
        }
        same
    });
    all
}

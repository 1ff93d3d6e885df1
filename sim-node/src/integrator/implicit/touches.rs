//! What each pair of bodies in contact does to both, pair by pair.

use crate::Scratch;
use crate::wrench::{Velocity, Wrench};
use geometry::Vec3;

/// The contact of one pair at one moment.
#[derive(Clone, Debug)]
pub(super) struct Touch {
    pub pair: (u32, u32),
    /// Without friction.
    pub on_a: Wrench,
    pub on_b: Wrench,
    /// Friction alone.
    pub friction_on_a: Wrench,
    pub friction_on_b: Wrench,
    /// What damping has of the forces without friction.
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
        Touch {
            pair,
            on_a: zero,
            on_b: zero,
            friction_on_a: zero,
            friction_on_b: zero,
            lost_on_a: zero,
            lost_on_b: zero,
            energy: 0.0,
            size: 0.0,
        }
    }

    fn add(&mut self, other: &Touch) {
        self.on_a.add(&other.on_a);
        self.on_b.add(&other.on_b);
        self.friction_on_a.add(&other.friction_on_a);
        self.friction_on_b.add(&other.friction_on_b);
        self.lost_on_a.add(&other.lost_on_a);
        self.lost_on_b.add(&other.lost_on_b);
        self.energy += other.energy;
        self.size += other.size;
    }

    /// The power of the forces without friction, and what damping has of it, at the velocities of A and B (W).
    pub(super) fn powers(&self, a: &Velocity, b: &Velocity) -> (f64, f64) {
        let whole = power(&self.on_a, a) + power(&self.on_b, b);
        (whole, power(&self.lost_on_a, a) + power(&self.lost_on_b, b))
    }

    /// The power of friction (W).
    pub(super) fn friction_power(&self, a: &Velocity, b: &Velocity) -> f64 {
        power(&self.friction_on_a, a) + power(&self.friction_on_b, b)
    }
}

fn power(wrench: &Wrench, v: &Velocity) -> f64 {
    wrench.force.dot(&v.linear) + wrench.torque.dot(&v.angular)
}

fn less(whole: &Wrench, part: &Wrench) -> Wrench {
    Wrench { force: whole.force - part.force, torque: whole.torque - part.torque }
}

fn three([x, y, z, _]: [f64; 4]) -> Vec3 {
    Vec3::new(x, y, z)
}

/// All pairs in contact at the last evaluation, in order, each once.
pub(super) fn touches(scratch: &Scratch) -> Vec<Touch> {
    let Scratch { evaluation, moment, .. } = scratch;
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
            ..Touch::none((arc.a, arc.b))
        });
    }
    for force in evaluation.pair_forces() {
        let mut rubs = Wrench::ZERO;
        force.rubs.iter().for_each(|rub| rubs.push(&rub.lever, rub.force));
        let centre = &moment.circles[force.a as usize].centre;
        let from_b = moment.circles.get(force.b as usize).map_or(Vec3::zeros(), |b| centre - b.centre);
        let back = rubs.reaction(&from_b);
        all.push(Touch {
            pair: (force.a, force.b),
            on_a: less(&force.on_a, &rubs),
            on_b: less(&force.on_b, &back),
            friction_on_a: rubs,
            friction_on_b: back,
            lost_on_a: less(&force.lost_on_a, &rubs),
            lost_on_b: less(&force.lost_on_b, &back),
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

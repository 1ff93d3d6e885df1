//! Coulomb friction: one tangential spring for each connected contact.
//!
//! The spring stretches with the slip at the contact's force centre and is turned with the contact by
//! projection onto the new tangent plane. Its force, with damping in the same proportion to stiffness as
//! in the normal direction, never exceeds the friction coefficient times the normal force: beyond that the
//! spring is shortened and the contact slides. A contact at rest therefore holds a load with no creep.
//!
//! # Why one spring a contact and not one a quadrature point
//! The points of an arc move along the wire when the arc grows, so a spring would have to be handed from
//! point to point; the arc's force centre moves continuously. What is given up is the twisting moment of a
//! long arc about its normal: a ring lying flat on a plane spins without friction.
//!
//! # Source
//! S. Luding, "Cohesive, frictional powders: contact models for tension", Granular Matter 10 (2008), section
//! 2.3. Deviations: static and dynamic coefficients are equal; damping is tied to the normal law's.

use crate::contact::Pair;
use crate::wrench::Velocity;
use geometry::Vec3;
use schemas::state::ContactState;

/// What friction needs to know of a contact.
pub(crate) struct Grip {
    /// The contact's force centre, from A's centre.
    pub lever: Vec3,
    /// Direction of the normal force on A, of any length.
    pub normal: Vec3,
    /// The normal force (N).
    pub normal_force: f64,
    /// Damping over stiffness of the contact (s).
    pub damping_time: f64,
}

/// What friction does at one contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rub {
    /// Where it acts: the contact's force centre, from A's centre.
    pub lever: Vec3,
    /// Direction of the normal force, of unit length.
    pub normal: Vec3,
    /// Force on A (N).
    pub force: Vec3,
    /// What Coulomb's limit leaves of the force that spring and damper ask for: 1 where the contact sticks.
    pub share: f64,
    /// Of the tangential damper (N s/m).
    pub damper: f64,
}

impl Rub {
    /// A contact without friction.
    pub(crate) const NONE: Rub = Rub {
        lever: Vec3::new(0.0, 0.0, 0.0),
        normal: Vec3::new(0.0, 0.0, 0.0),
        force: Vec3::new(0.0, 0.0, 0.0),
        share: 0.0,
        damper: 0.0,
    };
}

/// How friction's springs of one pair stretch in this evaluation.
pub(crate) struct Slip<'a> {
    /// The pair's springs as the last step left them.
    pub old: &'a [ContactState],
    /// Coulomb's coefficient.
    pub coefficient: f64,
    /// The spring's stiffness (N/m).
    pub stiffness: f64,
    /// Relative velocity of A by which the springs have moved since, and for how long (s).
    pub since: (Velocity, f64),
    /// The same for the springs that are kept for the next step.
    pub kept: (Velocity, f64),
}

impl Slip<'_> {
    /// A pair without friction.
    pub(crate) const NONE: Slip<'static> = Slip {
        old: &[],
        coefficient: 0.0,
        stiffness: 1.0,
        since: (Velocity::ZERO, 0.0),
        kept: (Velocity::ZERO, 0.0),
    };

    /// The old spring of each new contact, by the angles of their middles; zero for a contact without one.
    pub(crate) fn recognise(&self, mids: &[(f64, f64)]) -> [Vec3; 2] {
        let likeness = |new: usize, old: usize| {
            let contact = &self.old[old];
            contact.mid_cos * mids[new].0 + contact.mid_sin * mids[new].1
        };
        let spring = |old: usize| Vec3::from(self.old[old].spring_m);
        let none = Vec3::zeros();
        match (self.old.len(), mids.len()) {
            (1, 1) => [spring(0), none],
            (1, 2) if likeness(1, 0) > likeness(0, 0) => [none, spring(0)],
            (1, 2) => [spring(0), none],
            (2, 1) if likeness(0, 1) > likeness(0, 0) => [spring(1), none],
            (2, 1) => [spring(0), none],
            (2, 2) => {
                let straight = likeness(0, 0) + likeness(1, 1);
                let crossed = likeness(0, 1) + likeness(1, 0);
                if crossed > straight { [spring(1), spring(0)] } else { [spring(0), spring(1)] }
            }
            _ => [none, none],
        }
    }

    /// The friction on A, and the spring to keep for the next step.
    pub(crate) fn friction(&self, pair: &Pair, grip: &Grip, old: Vec3) -> (Rub, Vec3) {
        let length = grip.normal.norm_squared().sqrt();
        let normal = if length > 0.0 { grip.normal * (1.0 / length) } else { Vec3::zeros() };
        let tangent = |vector: Vec3| vector - normal * normal.dot(&vector);
        // B's matter relative to A's at the force centre.
        let slip = |relative: &Velocity| tangent(-(relative.linear + relative.angular.cross(&grip.lever)));
        let old = tangent(old);
        let damper = self.stiffness * grip.damping_time;
        let damping = slip(&pair.relative) * (damper / (1.0 + pair.implicit * damper));
        let limit = self.coefficient * grip.normal_force;
        let limited = |(velocity, time): &(Velocity, f64)| {
            let spring = old + slip(velocity) * *time;
            let force = spring * self.stiffness + damping;
            let size = force.norm_squared().sqrt();
            if size > limit {
                let force = force * (limit / size);
                (force, limit / size, (force - damping) * (1.0 / self.stiffness))
            } else {
                (force, 1.0, spring)
            }
        };
        let (force, share, _) = limited(&self.since);
        (Rub { lever: grip.lever, normal, force, share, damper }, limited(&self.kept).2)
    }
}

//! Velocities and forces of rigid bodies, each with its angular part.

use geometry::Vec3;

/// Linear and angular velocity of a body (m/s, rad/s), World axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Velocity {
    pub linear: Vec3,
    pub angular: Vec3,
}

impl Velocity {
    pub(crate) const ZERO: Velocity =
        Velocity { linear: Vec3::new(0.0, 0.0, 0.0), angular: Vec3::new(0.0, 0.0, 0.0) };
}

/// A force and its torque about a body's centre (N, N m), World axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wrench {
    pub force: Vec3,
    pub torque: Vec3,
}

impl Wrench {
    pub(crate) const ZERO: Wrench =
        Wrench { force: Vec3::new(0.0, 0.0, 0.0), torque: Vec3::new(0.0, 0.0, 0.0) };

    #[inline]
    pub(crate) fn add(&mut self, other: &Wrench) {
        self.force += other.force;
        self.torque += other.torque;
    }

    /// Adds a force that acts at `lever` from the centre.
    #[inline]
    pub(crate) fn push(&mut self, lever: &Vec3, force: Vec3) {
        self.force += force;
        self.torque += lever.cross(&force);
    }

    /// What the other body of the pair gets: the opposite force along the same line, its torque about
    /// that body's centre, which lies at `-from_other` from this one's.
    #[inline]
    pub(crate) fn reaction(&self, from_other: &Vec3) -> Wrench {
        Wrench { force: -self.force, torque: -(self.torque + from_other.cross(&self.force)) }
    }
}

/// The velocity of A's centre relative to B's matter at that place, and the relative angular velocity.
#[inline]
pub(crate) fn relative_velocity(a: &Velocity, b: &Velocity, from_b: &Vec3) -> Velocity {
    Velocity { linear: (a.linear - b.linear) - b.angular.cross(from_b), angular: a.angular - b.angular }
}

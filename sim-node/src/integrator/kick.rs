//! The kick of `verlet` and the drift after it.
//!
//! The one thing to know: velocities change here, and only here; what is taken out of the motion is summed
//! up body by body, in order.

// Loops over lanes go over several arrays at once, and become vector instructions as they stand.
#![allow(clippy::needless_range_loop)]

use super::lanes::{Chunk, Classes, Constants, Decays, LANES, Lane, Lane3, ZERO, get, normal, set, turn};
use crate::Model;
use crate::body::Decay;
use crate::wrench::{Velocity, Wrench};
use geometry::{Circle, Vec3};
use nalgebra::UnitQuaternion;
use schemas::state::BodyState;

/// What is summed over the bodies of a chunk during the kick.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    /// Energy lost (J).
    pub lost: f64,
    /// Some number of a body is not finite.
    pub broken: bool,
}

/// The kick and the second drift of a chunk.
pub(super) struct Kicks<'a> {
    pub model: &'a Model,
    pub first_block: usize,
    pub classes: &'a Classes,
    pub circles: &'a [Circle],
    pub velocities: &'a [Velocity],
    pub orientations: &'a [UnitQuaternion<f64>],
    pub wrenches: &'a [Wrench],
    /// The inelastic part of the wrenches, where there is one.
    pub lost: Option<&'a [Wrench]>,
    pub bodies: &'a mut [BodyState],
    pub sums: &'a mut Sums,
}

impl Chunk for Kicks<'_> {
    #[inline(always)]
    fn work(self) {
        match (self.model.features.gravity, self.model.features.drag) {
            (false, false) => self.all::<false, false>(),
            (false, true) => self.all::<false, true>(),
            (true, false) => self.all::<true, false>(),
            (true, true) => self.all::<true, true>(),
        }
    }
}

impl Kicks<'_> {
    #[inline(always)]
    fn all<const GRAVITY: bool, const DRAG: bool>(self) {
        let without_drag = Decay::new(0.0, 1.0, self.model.time().time_step_s);
        let gravity = self.model.gravity();
        let mut sums = Sums::default();
        let (mut middle, mut after) = (Middle::ZERO, After::ZERO);
        for (index, bodies) in self.bodies.chunks_mut(LANES).enumerate() {
            let own = index * LANES..index * LANES + bodies.len();
            middle.load(
                &self.circles[own.clone()],
                &self.velocities[own.clone()],
                &self.wrenches[own.clone()],
            );
            if let Some(lost) = self.lost {
                middle.load_lost(&lost[own.clone()]);
            }
            let constants = self.classes.of(self.first_block + index);
            let kick = |lane| middle.kick::<GRAVITY, DRAG>(constants, &without_drag, gravity, lane);
            let mut lost = ZERO;
            for lane in 0..LANES {
                let kick = kick(lane);
                let (linear, precession, spin) = kick.apply::<DRAG>();
                set(&mut after.linear, lane, linear);
                set(&mut after.precession, lane, precession);
                after.spin[lane] = spin;
                let centre = get(&middle.centre, lane) + linear * constants.half_time[lane];
                set(&mut after.position, lane, centre);
                lost[lane] = if DRAG { kick.drag_loss() } else { 0.0 };
            }
            if self.lost.is_some() {
                for lane in 0..LANES {
                    lost[lane] -=
                        kick(lane).work(&get(&middle.lost_force, lane), &get(&middle.lost_torque, lane));
                }
            }
            after.load_orientations(&self.orientations[own]);
            turn(&mut after.orientation, &after.precession, &after.spin, &constants.half_time);
            sums.broken |= after.finish();
            for (lane, body) in (0..LANES).zip(bodies) {
                // A pinned body stays as it is.
                if constants.half_time[lane] != 0.0 {
                    after.store(lane, body);
                    sums.lost += lost[lane];
                }
            }
        }
        *self.sums = sums;
    }
}

/// What the kicks of a block start from.
struct Middle {
    centre: Lane3,
    normal: Lane3,
    linear: Lane3,
    angular: Lane3,
    force: Lane3,
    torque: Lane3,
    lost_force: Lane3,
    lost_torque: Lane3,
}

impl Middle {
    const ZERO: Middle = Middle {
        centre: [ZERO; 3],
        normal: [ZERO; 3],
        linear: [ZERO; 3],
        angular: [ZERO; 3],
        force: [ZERO; 3],
        torque: [ZERO; 3],
        lost_force: [ZERO; 3],
        lost_torque: [ZERO; 3],
    };

    #[inline(always)]
    fn load(&mut self, circles: &[Circle], velocities: &[Velocity], wrenches: &[Wrench]) {
        for (lane, ((circle, velocity), wrench)) in
            (0..LANES).zip(circles.iter().zip(velocities).zip(wrenches))
        {
            set(&mut self.centre, lane, circle.centre);
            set(&mut self.normal, lane, circle.normal);
            set(&mut self.linear, lane, velocity.linear);
            set(&mut self.angular, lane, velocity.angular);
            set(&mut self.force, lane, wrench.force);
            set(&mut self.torque, lane, wrench.torque);
        }
    }

    #[inline(always)]
    fn load_lost(&mut self, lost: &[Wrench]) {
        for (lane, lost) in (0..LANES).zip(lost) {
            set(&mut self.lost_force, lane, lost.force);
            set(&mut self.lost_torque, lane, lost.torque);
        }
    }

    /// The kick of one body; `without_drag` is everyone's decay where nothing is dragged.
    #[inline(always)]
    fn kick<const GRAVITY: bool, const DRAG: bool>(
        &self,
        constants: &Constants,
        without_drag: &Decay,
        gravity: Vec3,
        lane: usize,
    ) -> Kick {
        let decay = |decays: &Decays| if DRAG { decays.get(lane) } else { *without_drag };
        let acceleration = get(&self.force, lane) * constants.inverse_mass[lane];
        Kick {
            inverse_axial: constants.inverse_axial[lane],
            inverse_transverse: constants.inverse_transverse[lane],
            spin_share: constants.spin_share[lane],
            linear_drag: decay(&constants.linear_drag),
            axial_drag: decay(&constants.axial_drag),
            transverse_drag: decay(&constants.transverse_drag),
            normal: get(&self.normal, lane),
            velocity: Velocity { linear: get(&self.linear, lane), angular: get(&self.angular, lane) },
            acceleration: if GRAVITY { acceleration + gravity } else { acceleration },
            torque: get(&self.torque, lane),
        }
    }
}

/// A block after its kick.
struct After {
    position: Lane3,
    orientation: [Lane; 4],
    linear: Lane3,
    angular: Lane3,
    precession: Lane3,
    spin: Lane,
}

impl After {
    const ZERO: After = After {
        position: [ZERO; 3],
        orientation: [ZERO; 4],
        linear: [ZERO; 3],
        angular: [ZERO; 3],
        precession: [ZERO; 3],
        spin: ZERO,
    };

    #[inline(always)]
    fn load_orientations(&mut self, orientations: &[UnitQuaternion<f64>]) {
        for (lane, q) in (0..LANES).zip(orientations) {
            for (numbers, value) in self.orientation.iter_mut().zip([q.i, q.j, q.k, q.w]) {
                numbers[lane] = value;
            }
        }
    }

    /// Brings the quaternions, just turned, back to unit length and finds the angular velocities; true if
    /// some number is not finite.
    ///
    /// The length by one Newton step towards `1 / sqrt(n)`, exact to rounding for a length that is off by
    /// rounding. Negative zeros go: a sign without meaning must not reach a hash.
    #[inline(always)]
    fn finish(&mut self) -> bool {
        let mut sums = ZERO;
        for lane in 0..LANES {
            let [i, j, k, w] = &mut self.orientation;
            let square = i[lane] * i[lane] + j[lane] * j[lane] + k[lane] * k[lane] + w[lane] * w[lane];
            let scale = 1.5 - 0.5 * square;
            for numbers in [i, j, k, w] {
                numbers[lane] = numbers[lane] * scale + 0.0;
            }
            let axis = normal(&self.orientation, lane);
            let angular = get(&self.precession, lane) + axis * self.spin[lane];
            set(&mut self.angular, lane, angular + Vec3::zeros());
            let (linear, position) = (get(&self.linear, lane), get(&self.position, lane));
            set(&mut self.linear, lane, linear + Vec3::zeros());
            set(&mut self.position, lane, position + Vec3::zeros());
            // A sum is finite only if all its parts are; it may overflow where they are, so the caller looks
            // again. Of the quaternion only the angle can be broken, and it breaks the axis.
            let all =
                [&self.position, &self.linear, &self.angular].map(|v| v[0][lane] + v[1][lane] + v[2][lane]);
            sums[lane] = all[0] + all[1] + all[2] + square;
        }
        !sums.iter().sum::<f64>().is_finite()
    }

    #[inline(always)]
    fn store(&self, lane: usize, body: &mut BodyState) {
        body.position_m = get(&self.position, lane).into();
        body.orientation = [0, 1, 2, 3].map(|number: usize| self.orientation[number][lane]);
        body.linear_velocity_m_per_s = get(&self.linear, lane).into();
        body.angular_velocity_rad_per_s = get(&self.angular, lane).into();
    }
}

/// One body at the moment of the kick.
struct Kick {
    inverse_axial: f64,
    inverse_transverse: f64,
    spin_share: f64,
    linear_drag: Decay,
    axial_drag: Decay,
    transverse_drag: Decay,
    /// The body's axis.
    normal: Vec3,
    velocity: Velocity,
    /// Of contact and gravity.
    acceleration: Vec3,
    /// Of contact.
    torque: Vec3,
}

impl Kick {
    /// Angular acceleration about and across the axis.
    #[inline(always)]
    fn angular_acceleration(&self) -> (f64, Vec3) {
        let about = self.torque.dot(&self.normal);
        let across = self.torque - self.normal * about;
        (about * self.inverse_axial, across * self.inverse_transverse)
    }

    /// Angular velocity about and across the axis.
    #[inline(always)]
    fn angular_velocity(&self) -> (f64, Vec3) {
        let about = self.velocity.angular.dot(&self.normal);
        (about, self.velocity.angular - self.normal * about)
    }

    /// Linear velocity, precession and free spin after the kick.
    #[inline(always)]
    fn apply<const DRAG: bool>(&self) -> (Vec3, Vec3, f64) {
        let (linear_drag, axial_drag, transverse_drag) =
            (&self.linear_drag, &self.axial_drag, &self.transverse_drag);
        let (about_acceleration, across_acceleration) = self.angular_acceleration();
        let (about, across) = self.angular_velocity();
        let kept = |velocity: Vec3, keep: f64| if DRAG { velocity * keep } else { velocity };
        let linear = kept(self.velocity.linear, linear_drag.keep) + self.acceleration * linear_drag.gain;
        let about = if DRAG { about * axial_drag.keep } else { about } + about_acceleration * axial_drag.gain;
        let across = kept(across, transverse_drag.keep) + across_acceleration * transverse_drag.gain;
        // w = across + about n; the free spin is the share of `about` that is not precession.
        let spin = about * self.spin_share;
        (linear, across + self.normal * (about - spin), spin)
    }

    /// Energy that drag takes during the kick (J).
    #[inline(always)]
    fn drag_loss(&self) -> f64 {
        let (v, a) = (self.velocity.linear, self.acceleration);
        let (about_acceleration, across_acceleration) = self.angular_acceleration();
        let (about, across) = self.angular_velocity();
        let linear = self.linear_drag.loss(v.norm_squared(), v.dot(&a), a.norm_squared());
        let axial = self.axial_drag.loss(
            about * about,
            about * about_acceleration,
            about_acceleration * about_acceleration,
        );
        let transverse = self.transverse_drag.loss(
            across.norm_squared(),
            across.dot(&across_acceleration),
            across_acceleration.norm_squared(),
        );
        linear + axial + transverse
    }

    /// Work that a constant wrench does during the kick (J): force times the path that the changing velocity
    /// covers in it.
    #[inline(always)]
    fn work(&self, force: &Vec3, torque: &Vec3) -> f64 {
        let (about_acceleration, across_acceleration) = self.angular_acceleration();
        let (about, across) = self.angular_velocity();
        let path = self.velocity.linear * self.linear_drag.gain + self.acceleration * self.linear_drag.reach;
        let across = across * self.transverse_drag.gain + across_acceleration * self.transverse_drag.reach;
        let about = about * self.axial_drag.gain + about_acceleration * self.axial_drag.reach;
        force.dot(&path) + torque.dot(&(across + self.normal * about))
    }
}

//! Prescribed motion: bodies that are where the scene says at each time, whatever pulls at them.
//!
//! Their poses and velocities are functions of simulated time alone, so they follow exactly in every
//! integrator: stages ask for the stage's time, and at the end of a step the state gets the step's time. To
//! the contacts they are bodies of infinite mass that move.
//!
//! # Energy
//! A driven body does work on those that it touches: `-(F . v + torque . w)` with the contact's wrench on the
//! driven body. Integrators add it up over the step as they evaluate forces, and the energy audit takes it
//! from the balance. The kinetic energy and weight of the driven bodies themselves are the drive's matter and
//! are in no sum.

use crate::Model;
use crate::forces::{Evaluation, Moment};
use crate::state::Motion;
use crate::wrench::{Velocity, Wrench};
use geometry::{Circle, Vec3, rotation};
use schemas::scene::{self, Interpolation};
use schemas::state::BodyState;

/// One motion of the scene, ready to be asked.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    pub name: String,
    pivot: Vec3,
    axis: Vec3,
    interpolation: Interpolation,
    /// Time, translation and angle; the first is that of rest at time 0.
    keys: Vec<(f64, Vec3, f64)>,
    shake: Option<scene::Shake>,
}

/// A body that follows a drive: its number, its drive's, and its pose at time 0.
#[derive(Clone, Debug)]
pub(crate) struct Driven {
    pub body: u32,
    pub drive: u32,
    start: Motion,
}

/// Where a drive is at some time: translation and angle, and their rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Displacement {
    pub translation: Vec3,
    pub angle: f64,
    velocity: Vec3,
    angular_speed: f64,
}

impl Drive {
    pub(crate) fn new(name: &str, motion: &scene::Motion) -> Drive {
        let mut keys = vec![(0.0, Vec3::zeros(), 0.0)];
        keys.extend(motion.keyframes.iter().map(|k| (k.time_s, Vec3::from(k.translation_m), k.angle_rad)));
        Drive {
            name: name.to_owned(),
            pivot: Vec3::from(motion.pivot_m),
            axis: Vec3::from(motion.axis),
            interpolation: motion.interpolation,
            keys,
            shake: motion.shake.clone(),
        }
    }

    /// Translation and angle at a time, and their rates; where the rate jumps, the later one.
    pub(crate) fn at(&self, time: f64) -> Displacement {
        let later = self.keys.partition_point(|key| key.0 <= time);
        // A time before the start is rounding of 0.
        let from = &self.keys[if later == 0 { 0 } else { later - 1 }];
        let mut now =
            Displacement { translation: from.1, angle: from.2, velocity: Vec3::zeros(), angular_speed: 0.0 };
        if let (Some(to), true) = (self.keys.get(later), later > 0) {
            let duration = to.0 - from.0;
            let (share, rate) = match self.interpolation {
                Interpolation::Linear => ((time - from.0) / duration, 1.0),
                Interpolation::Smooth => smooth((time - from.0) / duration),
            };
            now.translation += (to.1 - from.1) * share;
            now.angle += (to.2 - from.2) * share;
            now.velocity = (to.1 - from.1) * (rate / duration);
            now.angular_speed = (to.2 - from.2) * (rate / duration);
        }
        if let Some(shake) = &self.shake {
            let (value, rate) = sinusoid(shake, time);
            let amplitude = Vec3::from(shake.translation_m);
            now.translation += amplitude * value;
            now.velocity += amplitude * rate;
            now.angle += shake.angle_rad * value;
            now.angular_speed += shake.angle_rad * rate;
        }
        now
    }

    /// The pivot at a time, carried along by the translation (m).
    pub(crate) fn pivot_at(&self, time: f64) -> Vec3 {
        self.pivot + self.at(time).translation
    }

    /// Pose and velocity at a time of a body that follows from `start` at time 0.
    fn carry(&self, start: &Motion, time: f64) -> Motion {
        let now = self.at(time);
        let turn = rotation::exp(self.axis * now.angle);
        let lever = start.position - self.pivot;
        let turned = turn * lever;
        let angular = self.axis * now.angular_speed;
        Motion {
            // Written so that at time 0 the pose is the scene's to the last bit.
            position: start.position + (now.translation + (turned - lever)),
            orientation: turn * start.orientation,
            linear: now.velocity + angular.cross(&turned),
            angular,
        }
    }
}

/// `3 s^2 - 2 s^3` and its derivative.
fn smooth(share: f64) -> (f64, f64) {
    (share * share * (3.0 - 2.0 * share), 6.0 * share * (1.0 - share))
}

/// A shake's sinusoid of amplitude 1 at a time, and its rate.
fn sinusoid(shake: &scene::Shake, time: f64) -> (f64, f64) {
    let since = time - shake.start_s;
    if since < 0.0 {
        return (0.0, 0.0);
    }
    let circular = 2.0 * core::f64::consts::PI * shake.frequency_hz;
    let (sine, cosine) = libm::sincos(circular * since);
    let (size, growth) = if since < shake.ramp_s {
        let (size, growth) = smooth(since / shake.ramp_s);
        (size, growth / shake.ramp_s)
    } else {
        (1.0, 0.0)
    };
    (size * sine, size * circular * cosine + growth * sine)
}

/// The drives of a scene, by name, and the bodies that follow them, in order.
pub(crate) fn compile(scene: &scene::Scene, initial: &mut [BodyState]) -> (Vec<Drive>, Vec<Driven>) {
    let drives: Vec<Drive> = scene.motions.iter().map(|(name, motion)| Drive::new(name, motion)).collect();
    let names = scene.rings.iter().map(|r| &r.motion).chain(scene.spheres.iter().map(|s| &s.motion));
    let mut driven = Vec::new();
    for (body, name) in names.enumerate() {
        let Some(name) = name else { continue };
        let drive = drives
            .binary_search_by(|drive| drive.name.as_str().cmp(name))
            .expect("a resolved scene names existing motions");
        let start = Motion::of(&initial[body]);
        drives[drive].carry(&start, 0.0).store(&mut initial[body]);
        driven.push(Driven { body: body as u32, drive: drive as u32, start });
    }
    (drives, driven)
}

impl Model {
    /// Pose and velocity of a driven body at a simulated time.
    pub(crate) fn prescribed(&self, driven: &Driven, time: f64) -> Motion {
        self.drives()[driven.drive as usize].carry(&driven.start, time)
    }
}

/// Puts the driven bodies where they are at a time, for an evaluation of forces.
pub(crate) fn place(model: &Model, time: f64, moment: &mut Moment) {
    for driven in model.driven() {
        let (index, motion) = (driven.body as usize, model.prescribed(driven, time));
        let radius = model.bodies()[index].major_radius;
        moment.circles[index] = Circle::from_pose(motion.position, &motion.orientation, radius);
        moment.velocities[index] = Velocity { linear: motion.linear, angular: motion.angular };
    }
}

/// Puts the driven bodies where they are at a time, into a state.
pub(crate) fn store(model: &Model, time: f64, bodies: &mut [BodyState]) {
    for driven in model.driven() {
        model.prescribed(driven, time).store(&mut bodies[driven.body as usize]);
    }
}

/// The power of the drives, and what of it damping and friction take at the driven bodies, in an evaluation
/// (W).
pub(crate) fn power(model: &Model, moment: &Moment, evaluation: &Evaluation) -> (f64, f64) {
    let (mut drive, mut lost) = (0.0, 0.0);
    for driven in model.driven() {
        let (of_drive, of_loss) = power_at(driven.body as usize, model, moment, evaluation);
        drive += of_drive;
        lost += of_loss;
    }
    (drive, lost)
}

/// The same at one driven body.
pub(crate) fn power_at(body: usize, model: &Model, moment: &Moment, evaluation: &Evaluation) -> (f64, f64) {
    let velocity = &moment.velocities[body];
    let power = |wrench: &Wrench| wrench.force.dot(&velocity.linear) + wrench.torque.dot(&velocity.angular);
    let lost = if Evaluation::loses(model) { -power(&evaluation.lost[body]) } else { 0.0 };
    (-power(&evaluation.wrenches[body]), lost)
}

#[cfg(test)]
mod tests {
    use super::Drive;
    use geometry::Vec3;
    use schemas::scene::{Interpolation, Keyframe, Motion, Shake};

    fn motion(interpolation: Interpolation) -> Motion {
        let keyframe = |time_s: f64, x: f64, angle_rad: f64| Keyframe {
            time_s,
            translation_m: [x, 0.5 * x, 0.0],
            angle_rad,
        };
        Motion {
            pivot_m: [1.0, 2.0, 3.0],
            axis: [0.6, 0.0, 0.8],
            interpolation,
            keyframes: vec![keyframe(1.0, 2.0, 0.0), keyframe(1.5, 2.0, 4.0)],
            shake: Some(Shake {
                translation_m: [0.0, 0.0, 0.1],
                angle_rad: 0.2,
                frequency_hz: 3.0,
                start_s: 0.25,
                ramp_s: 0.5,
            }),
        }
    }

    /// Rates are the derivatives of values, by central differences.
    #[test]
    fn rates_are_derivatives() {
        for interpolation in [Interpolation::Linear, Interpolation::Smooth] {
            let drive = Drive::new("m", &motion(interpolation));
            let (mut worst, h) = (0.0, 1e-5);
            for time in [0.1, 0.3, 0.74, 0.9, 1.2, 1.4, 2.0] {
                let (before, now, after) = (drive.at(time - h), drive.at(time), drive.at(time + h));
                let velocity = (after.translation - before.translation) * (0.5 / h);
                let speed = (after.angle - before.angle) * (0.5 / h);
                let error = (velocity - now.velocity).norm() + (speed - now.angular_speed).abs();
                if error > worst {
                    worst = error;
                }
            }
            // Third derivatives reach 5e3 times an amplitude of 0.3, over 6, times h^2; rounding 1e-16 / h.
            println!("{interpolation:?}: rates off by {worst:.1e}, allowed 1e-7");
            assert!(worst < 1e-7, "{worst}");
        }
    }

    #[test]
    fn keyframes_are_met_and_kept() {
        let drive = Drive::new("m", &Motion { shake: None, ..motion(Interpolation::Smooth) });
        assert_eq!(drive.at(0.0).translation, Vec3::zeros());
        assert_eq!(drive.at(0.5).translation, Vec3::new(1.0, 0.5, 0.0));
        assert_eq!((drive.at(1.0).translation.x, drive.at(1.0).angle), (2.0, 0.0));
        assert_eq!((drive.at(1.5).angle, drive.at(9.0).angle), (4.0, 4.0));
        assert_eq!(drive.at(9.0).angular_speed, 0.0);
    }
}

//! Prescribed motion: bodies that go where the scene says, whatever pulls at them. Grippers, shakers.

use super::SceneError;
use super::validate::{not_negative, positive, refuse, refuse_number, unit, vector};
use serde::{Deserialize, Serialize};

/// A rigid motion as a function of time: rings and spheres that name it move with it as one rigid body.
///
/// Keyframes and shake add up. At time 0 everything is where the scene puts it; a body at `p` then is at
/// `pivot + translation(t) + turn(t) (p - pivot)`, where `turn` is about `axis` by the angle at that time.
/// Velocities follow from it. After the last keyframe the motion stays there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Point about which it turns, in metres; carried along by the translation.
    #[serde(default)]
    pub pivot_m: [f64; 3],
    /// Unit vector about which it turns, right-handed, World.
    #[serde(default = "Motion::default_axis")]
    pub axis: [f64; 3],
    /// How it goes from one keyframe to the next.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// Where it is at some times, from the start on.
    #[serde(default, rename = "keyframe", skip_serializing_if = "Vec::is_empty")]
    pub keyframes: Vec<Keyframe>,
    /// A sinusoid on top.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shake: Option<Shake>,
}

impl Motion {
    fn default_axis() -> [f64; 3] {
        [0.0, 0.0, 1.0]
    }

    /// Checks every value; `key` makes a field's path.
    pub(super) fn validate(&self, key: &dyn Fn(&str) -> String) -> Result<(), SceneError> {
        vector(&key("pivot_m"), &self.pivot_m)?;
        unit(&key("axis"), &self.axis)?;
        let mut before = 0.0;
        for (index, keyframe) in self.keyframes.iter().enumerate() {
            let key = |field: &str| key(&format!("keyframe[{index}].{field}"));
            positive(&key("time_s"), keyframe.time_s)?;
            if keyframe.time_s <= before {
                let expected = format!("more than {before:?}, the time of the keyframe before");
                return Err(refuse_number(&key("time_s"), keyframe.time_s, &expected));
            }
            before = keyframe.time_s;
            vector(&key("translation_m"), &keyframe.translation_m)?;
            angle(&key("angle_rad"), keyframe.angle_rad)?;
        }
        if let Some(shake) = &self.shake {
            let key = |field: &str| key(&format!("shake.{field}"));
            vector(&key("translation_m"), &shake.translation_m)?;
            angle(&key("angle_rad"), shake.angle_rad)?;
            positive(&key("frequency_hz"), shake.frequency_hz)?;
            not_negative(&key("start_s"), shake.start_s)?;
            not_negative(&key("ramp_s"), shake.ramp_s)?;
        }
        Ok(())
    }

    /// Turns every `-0.0` into `0.0`.
    pub(super) fn canonicalise_zeros(&mut self) {
        let zero = |vector: &mut [f64]| vector.iter_mut().for_each(|value| *value += 0.0);
        zero(&mut self.pivot_m);
        zero(&mut self.axis);
        for keyframe in &mut self.keyframes {
            zero(&mut keyframe.translation_m);
            keyframe.angle_rad += 0.0;
        }
        if let Some(shake) = &mut self.shake {
            zero(&mut shake.translation_m);
            shake.angle_rad += 0.0;
        }
    }
}

/// How a motion goes from one keyframe to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// At constant speed; the speed jumps at the keyframes.
    Linear,
    /// With the share `3 s^2 - 2 s^3` of the way after the share `s` of the time: at rest at each keyframe,
    /// and at 1.5 times the mean speed between.
    #[default]
    Smooth,
}

/// Where a motion is at one time, from where the scene puts its bodies. At time 0 it is there: that needs no
/// keyframe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Keyframe {
    /// Simulated time, above 0, in seconds.
    pub time_s: f64,
    /// Translation, in metres.
    #[serde(default)]
    pub translation_m: [f64; 3],
    /// Angle about the motion's axis, in radians; may be many turns.
    #[serde(default)]
    pub angle_rad: f64,
}

/// A sinusoid: amplitude times `sin(2 pi f (t - start))` from its start on, growing over a ramp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shake {
    /// Amplitude of the translation, in metres.
    #[serde(default)]
    pub translation_m: [f64; 3],
    /// Amplitude of the angle, in radians.
    #[serde(default)]
    pub angle_rad: f64,
    /// Frequency, in hertz.
    pub frequency_hz: f64,
    /// When it starts, in seconds.
    #[serde(default)]
    pub start_s: f64,
    /// Time over which the amplitude grows to its full size, as `3 s^2 - 2 s^3`, in seconds; with 0 the speed
    /// jumps at the start.
    #[serde(default)]
    pub ramp_s: f64,
}

fn angle(key: &str, value: f64) -> Result<(), SceneError> {
    // Beyond this the angle's rounding is more than a microradian.
    if value.abs() <= 1e9 {
        return Ok(());
    }
    Err(refuse(key, format!("{value:?}"), "a finite angle of at most 1e9 rad"))
}

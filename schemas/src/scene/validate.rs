//! Every value of a scene is checked here, once, before anything is computed from it.

use super::materials::drag;
use super::parse::suggestion;
use super::render;
use super::{Motion, Scene, SceneError};
use std::fmt::Display;

/// No coordinate may be larger than this, in metres: its square, and the square of that, stay finite.
const LENGTH_MAX_M: f64 = 1e12;
/// The largest number of frames for each step: one, and what rounding may add to the product of two decimals.
/// It is too little to bring two of a billion frames together.
const ONE_FRAME_A_STEP: f64 = 1.0 + 1e-12;
/// A run of more steps than this is a slip of the pen.
const STEP_COUNT_MAX: f64 = 1e12;
/// More rings than this do not fit the 32-bit numbers of bodies, by far.
const RING_COUNT_MAX: u64 = 10_000_000;

impl Scene {
    /// Turns every `-0.0` into `0.0`, so that a sign without meaning cannot reach a hash.
    pub(super) fn canonicalise_zeros(&mut self) {
        let zero = |vector: &mut [f64]| vector.iter_mut().for_each(|value| *value += 0.0);
        zero(&mut self.forces.gravity_m_per_s2);
        self.motions.values_mut().for_each(Motion::canonicalise_zeros);
        for weave in &mut self.weaves {
            zero(&mut weave.position_m);
            zero(&mut weave.rotation_rad);
        }
        for ring in &mut self.rings {
            zero(&mut ring.position_m);
            zero(&mut ring.orientation);
            zero(&mut ring.linear_velocity_m_per_s);
            zero(&mut ring.angular_velocity_rad_per_s);
        }
        for sphere in &mut self.spheres {
            zero(&mut sphere.position_m);
            zero(&mut sphere.linear_velocity_m_per_s);
            zero(&mut sphere.angular_velocity_rad_per_s);
        }
        for plane in &mut self.planes {
            zero(&mut plane.normal);
            plane.offset_m += 0.0;
        }
        self.canonicalise_solids();
    }

    /// Makes unit quaternions and unit normals exact to rounding; they were checked to be near.
    pub(super) fn normalise_directions(&mut self) {
        let unit = |vector: &mut [f64]| {
            let norm = norm(vector);
            // A vector that is unit to rounding is left alone, so that resolving twice changes nothing.
            if (norm - 1.0).abs() > 4.0 * f64::EPSILON {
                vector.iter_mut().for_each(|value| *value /= norm);
            }
        };
        self.rings.iter_mut().for_each(|ring| unit(&mut ring.orientation));
        self.planes.iter_mut().for_each(|plane| unit(&mut plane.normal));
        self.motions.values_mut().for_each(|motion| unit(&mut motion.axis));
        self.solid_orientations().for_each(unit);
    }

    /// Checks every value, as [`Scene::parse`] does: for a scene that comes from a log, which may be anybody's.
    ///
    /// # Errors
    ///
    /// [`SceneError`] names the key, the value and what was expected.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.validate_time()?;
        self.validate_method()?;
        vector("forces.gravity_m_per_s2", &self.forces.gravity_m_per_s2)?;
        not_negative("forces.linear_drag_kg_per_s", self.forces.linear_drag_kg_per_s)?;
        not_negative("forces.quadratic_drag_kg_per_m", self.forces.quadratic_drag_kg_per_m)?;
        not_negative("forces.angular_drag_kg_m2_per_s", self.forces.angular_drag_kg_m2_per_s)?;
        for (name, material) in &self.materials {
            let key = |field: &str| format!("material.{name}.{field}");
            material.validate(&key)?;
            positive(&key("point_stiffness_n_per_m"), material.point_stiffness_n_per_m)?;
            positive(&key("surface_stiffness_n_per_m3"), material.surface_stiffness_n_per_m3)?;
            positive(&key("friction_stiffness_n_per_m"), material.friction_stiffness_n_per_m)?;
            not_negative(&key("damping_s_per_m"), material.damping_s_per_m)?;
            not_negative(&key("line_damping_n_s_per_m2"), material.line_damping_n_s_per_m2)?;
            not_negative(&key("point_damping_n_s_per_m"), material.point_damping_n_s_per_m)?;
            not_negative(&key("surface_damping_n_s_per_m3"), material.surface_damping_n_s_per_m3)?;
            not_negative(&key("friction_coefficient"), material.friction_coefficient)?;
        }
        if self.method.surface.samples == 0 || self.method.surface.samples > 1 << 24 {
            let key = "method.surface.samples";
            return Err(refuse(key, self.method.surface.samples, "from 1 to 16777216 samples"));
        }
        for (name, motion) in &self.motions {
            motion.validate(&|field: &str| format!("motion.{name}.{field}"))?;
        }
        self.validate_weaves()?;
        self.validate_rings()?;
        self.validate_spheres_and_planes()?;
        self.validate_solids()?;
        if self.record.state_every == 0 {
            return Err(refuse("record.state_every", 0, "1 or more steps"));
        }
        // A day is as good as never, and a duration that every clock takes.
        let flush_every_s = self.record.flush_every_s;
        if !(0.001..=86400.0).contains(&flush_every_s) {
            return Err(refuse_number("record.flush_every_s", flush_every_s, "0.001 to 86400 seconds"));
        }
        render::validate(&self.render)
    }

    fn validate_time(&self) -> Result<(), SceneError> {
        not_negative("time.duration_s", self.time.duration_s)?;
        positive("time.frames_per_second", self.time.frames_per_second)?;
        positive("time.time_step_s", self.time.time_step_s)?;
        let steps = self.time.duration_s / self.time.time_step_s;
        if steps.is_nan() || steps > STEP_COUNT_MAX {
            let expected = format!("at most {STEP_COUNT_MAX:e} steps in time.duration_s, not {steps:e}");
            return Err(refuse_number("time.time_step_s", self.time.time_step_s, &expected));
        }
        if self.time.duration_s * self.time.frames_per_second > 1e9 {
            return Err(refuse_number(
                "time.frames_per_second",
                self.time.frames_per_second,
                "at most 1e9 frames in all",
            ));
        }
        if self.time.frames_per_second * self.time.time_step_s > ONE_FRAME_A_STEP {
            let expected = format!(
                "at most one frame a step: {:?} with time.time_step_s = {:?}",
                1.0 / self.time.time_step_s,
                self.time.time_step_s
            );
            return Err(refuse_number("time.frames_per_second", self.time.frames_per_second, &expected));
        }
        Ok(())
    }

    fn validate_method(&self) -> Result<(), SceneError> {
        let tolerance = self.method.tolerance;
        if !(1e-13..=0.1).contains(&tolerance) {
            return Err(refuse_number("method.tolerance", tolerance, "a number from 1e-13 to 0.1"));
        }
        let penetration = self.method.stability_penetration;
        if !(1e-6..=1.0).contains(&penetration) {
            let expected = "a share of the wires from 1e-6 to 1 (0.05 unless said otherwise)";
            return Err(refuse_number("method.stability_penetration", penetration, expected));
        }
        if let Some(sleep) = &self.method.sleep {
            positive("method.sleep.speed_m_per_s", sleep.speed_m_per_s)?;
            positive("method.sleep.acceleration_m_per_s2", sleep.acceleration_m_per_s2)?;
            if self.record.reactions {
                let expected = "false with method.sleep: what sleeping bodies bear is not computed";
                return Err(refuse("record.reactions", true, expected));
            }
        }
        positive("method.absolute_tolerance", self.method.absolute_tolerance)
    }

    fn validate_weaves(&self) -> Result<(), SceneError> {
        let mut total = 0_u64;
        for (index, weave) in self.weaves.iter().enumerate() {
            let key = |field: &str| format!("weave[{index}].{field}");
            total = total.saturating_add(weave.ring_count());
            if total > RING_COUNT_MAX {
                let expected = format!("at most {RING_COUNT_MAX} rings in all");
                return Err(refuse(&key("rows"), weave.rows, &expected));
            }
            weave.validate(&key)?;
            self.material_exists(&key("material"), &weave.material)?;
            for (index, grip) in weave.grips.iter().enumerate() {
                self.motion_exists(&key(&format!("grip[{index}].motion")), Some(&grip.motion), false)?;
            }
        }
        Ok(())
    }

    fn validate_rings(&self) -> Result<(), SceneError> {
        for (index, ring) in self.rings.iter().enumerate() {
            let key = |field: &str| format!("ring[{index}].{field}");
            radii(&key, ring.major_radius_m, ring.minor_radius_m)?;
            positive(&key("mass_kg"), ring.mass_kg)?;
            vector(&key("position_m"), &ring.position_m)?;
            unit(&key("orientation"), &ring.orientation)?;
            vector(&key("linear_velocity_m_per_s"), &ring.linear_velocity_m_per_s)?;
            vector(&key("angular_velocity_rad_per_s"), &ring.angular_velocity_rad_per_s)?;
            self.material_exists(&key("material"), &ring.material)?;
            drag(&key, ring.drag.as_ref())?;
            self.motion_exists(&key("motion"), ring.motion.as_ref(), ring.pinned)?;
        }
        Ok(())
    }

    fn validate_spheres_and_planes(&self) -> Result<(), SceneError> {
        for (index, sphere) in self.spheres.iter().enumerate() {
            let key = |field: &str| format!("sphere[{index}].{field}");
            positive(&key("radius_m"), sphere.radius_m)?;
            positive(&key("mass_kg"), sphere.mass_kg)?;
            vector(&key("position_m"), &sphere.position_m)?;
            vector(&key("linear_velocity_m_per_s"), &sphere.linear_velocity_m_per_s)?;
            vector(&key("angular_velocity_rad_per_s"), &sphere.angular_velocity_rad_per_s)?;
            self.material_exists(&key("material"), &sphere.material)?;
            drag(&key, sphere.drag.as_ref())?;
            self.motion_exists(&key("motion"), sphere.motion.as_ref(), sphere.pinned)?;
        }
        for (index, plane) in self.planes.iter().enumerate() {
            let key = |field: &str| format!("plane[{index}].{field}");
            unit(&key("normal"), &plane.normal)?;
            vector(&key("offset_m"), &[plane.offset_m])?;
            self.material_exists(&key("material"), &plane.material)?;
        }
        Ok(())
    }

    fn motion_exists(&self, key: &str, name: Option<&String>, pinned: bool) -> Result<(), SceneError> {
        let Some(name) = name else { return Ok(()) };
        if pinned {
            return Err(refuse(key, name, "no motion for a pinned body: take one of the two away"));
        }
        if self.motions.contains_key(name) {
            return Ok(());
        }
        Err(SceneError::UnknownName {
            key: key.to_owned(),
            value: name.to_owned(),
            what: "motion",
            suggestion: suggestion(name, self.motions.keys().map(String::as_str)),
        })
    }

    pub(super) fn material_exists(&self, key: &str, name: &str) -> Result<(), SceneError> {
        if self.materials.contains_key(name) {
            return Ok(());
        }
        Err(SceneError::UnknownName {
            key: key.to_owned(),
            value: name.to_owned(),
            what: "material",
            suggestion: suggestion(name, self.materials.keys().map(String::as_str)),
        })
    }
}

pub(super) fn radii(key: &dyn Fn(&str) -> String, major_m: f64, minor_m: f64) -> Result<(), SceneError> {
    positive(&key("major_radius_m"), major_m)?;
    positive(&key("minor_radius_m"), minor_m)?;
    if minor_m >= major_m {
        let expected = format!("less than major_radius_m = {major_m:?}");
        return Err(refuse_number(&key("minor_radius_m"), minor_m, &expected));
    }
    Ok(())
}

pub(super) fn positive(key: &str, value: f64) -> Result<(), SceneError> {
    if value.is_normal() && value > 0.0 && value <= LENGTH_MAX_M * LENGTH_MAX_M {
        return Ok(());
    }
    Err(refuse_number(key, value, &format!("a positive number{}", limits(value))))
}

pub(super) fn not_negative(key: &str, value: f64) -> Result<(), SceneError> {
    if value == 0.0 || positive(key, value).is_ok() {
        return Ok(());
    }
    Err(refuse_number(key, value, &format!("0 or a positive number{}", limits(value))))
}

/// The limits of a positive number ([`positive`]), for a value that is positive and beyond them.
fn limits(value: f64) -> &'static str {
    if value > 0.0 { " from 2.3e-308 to 1e24" } else { "" }
}

pub(super) fn vector(key: &str, values: &[f64]) -> Result<(), SceneError> {
    if values.iter().all(|value| value.abs() <= LENGTH_MAX_M) {
        return Ok(());
    }
    Err(refuse(key, format!("{values:?}"), "finite numbers of at most 1e12"))
}

pub(super) fn unit(key: &str, values: &[f64]) -> Result<(), SceneError> {
    let length = norm(values);
    if (length - 1.0).abs() <= 1e-6 {
        return Ok(());
    }
    Err(refuse(key, format!("{values:?} (of length {length:?})"), "length 1, within 1e-6"))
}

pub(super) fn unit_or_longer(key: &str, values: &[f64]) -> Result<(), SceneError> {
    vector(key, values)?;
    if norm(values) > 1e-150 {
        return Ok(());
    }
    Err(refuse(key, format!("{values:?}"), "a direction, not zero"))
}

pub(super) fn colour(key: &str, values: &[f64; 3]) -> Result<(), SceneError> {
    if values.iter().all(|value| (0.0..=LENGTH_MAX_M).contains(value)) {
        return Ok(());
    }
    Err(refuse(key, format!("{values:?}"), "three numbers from 0 to 1e12"))
}

pub(super) fn norm(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

pub(super) fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A number as one would write it: `{:?}` turns to powers of ten where `{}` would print hundreds of digits.
pub(super) fn refuse_number(key: &str, value: f64, expected: &str) -> SceneError {
    refuse(key, format!("{value:?}"), expected)
}

pub(super) fn refuse(key: &str, value: impl Display, expected: &str) -> SceneError {
    SceneError::Value { key: key.to_owned(), value: value.to_string(), expected: expected.to_owned() }
}

//! Bodies besides rings, spheres and planes: capsules, boxes, bodies of a formula.

use super::validate::{not_negative, positive, refuse, refuse_number, unit, vector};
use super::{Scene, SceneError};
use crate::state::BodyState;
use serde::{Deserialize, Serialize};

/// A rigid solid capsule: all points within a radius of a segment of its own z axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Capsule {
    /// Radius of the wall and of the two caps, in metres.
    pub radius_m: f64,
    /// Half the length of the segment, that is of the wall without the caps, in metres.
    pub half_length_m: f64,
    /// Mass, in kilograms.
    pub mass_kg: f64,
    /// Name of the material.
    pub material: String,
    /// Centre at step 0, in metres.
    pub position_m: [f64; 3],
    /// Unit quaternion `[x, y, z, w]` at step 0.
    #[serde(default = "identity")]
    pub orientation: [f64; 4],
    /// Velocity at step 0.
    #[serde(default)]
    pub linear_velocity_m_per_s: [f64; 3],
    /// Angular velocity at step 0, World axes.
    #[serde(default)]
    pub angular_velocity_rad_per_s: [f64; 3],
    /// A pinned capsule never moves.
    #[serde(default)]
    pub pinned: bool,
}

/// A rigid solid box, with edges and corners that may be rounded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cuboid {
    /// Half the lengths along the box's own x, y and z axes, from face to face, in metres.
    pub half_extents_m: [f64; 3],
    /// Radius of the edges and corners, in metres; 0 for sharp ones. Less than each half extent.
    #[serde(default)]
    pub edge_radius_m: f64,
    /// Mass, in kilograms.
    pub mass_kg: f64,
    /// Name of the material.
    pub material: String,
    /// Centre at step 0, in metres.
    pub position_m: [f64; 3],
    /// Unit quaternion `[x, y, z, w]` at step 0.
    #[serde(default = "identity")]
    pub orientation: [f64; 4],
    /// Velocity at step 0.
    #[serde(default)]
    pub linear_velocity_m_per_s: [f64; 3],
    /// Angular velocity at step 0, World axes.
    #[serde(default)]
    pub angular_velocity_rad_per_s: [f64; 3],
    /// A pinned box never moves.
    #[serde(default)]
    pub pinned: bool,
}

/// A rigid solid body bounded by a polynomial: the points where its formula is negative.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Polynomial {
    /// The formula in `x`, `y` and `z`, negative inside: sums, products, whole powers, parentheses and decimal numbers,
    /// of a degree of at most 16; for example `(x^2 + y^2 + z^2 + 3)^2 - 16*(x^2 + y^2)`.
    pub formula: String,
    /// Metres per unit of the formula's coordinates.
    #[serde(default = "one")]
    pub scale_m: f64,
    /// Radius of a ball about the formula's origin that holds the whole body, in metres; a body without such a ball is
    /// refused.
    pub bounding_radius_m: f64,
    /// Mass, in kilograms; either this or the density is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// Density, in kilograms per cubic metre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_kg_per_m3: Option<f64>,
    /// Name of the material.
    pub material: String,
    /// Where the formula's origin is at step 0, in metres.
    pub position_m: [f64; 3],
    /// Unit quaternion `[x, y, z, w]` from the formula's axes to World at step 0.
    #[serde(default = "identity")]
    pub orientation: [f64; 4],
    /// Velocity of the centre of mass at step 0.
    #[serde(default)]
    pub linear_velocity_m_per_s: [f64; 3],
    /// Angular velocity at step 0, World axes.
    #[serde(default)]
    pub angular_velocity_rad_per_s: [f64; 3],
    /// A pinned body never moves.
    #[serde(default)]
    pub pinned: bool,
}

/// What all solids have: a pose and a velocity at step 0.
trait Placed {
    /// Position, orientation, linear and angular velocity, with their keys.
    fn vectors(&self) -> [(&'static str, &[f64]); 4];
    fn vectors_mut(&mut self) -> [&mut [f64]; 4];
    /// The state at step 0; a pinned body is at rest.
    fn state(&self) -> BodyState;
}

macro_rules! placed {
    ($solid:ty) => {
        impl Placed for $solid {
            fn vectors(&self) -> [(&'static str, &[f64]); 4] {
                [
                    ("position_m", &self.position_m),
                    ("orientation", &self.orientation),
                    ("linear_velocity_m_per_s", &self.linear_velocity_m_per_s),
                    ("angular_velocity_rad_per_s", &self.angular_velocity_rad_per_s),
                ]
            }

            fn vectors_mut(&mut self) -> [&mut [f64]; 4] {
                [
                    &mut self.position_m,
                    &mut self.orientation,
                    &mut self.linear_velocity_m_per_s,
                    &mut self.angular_velocity_rad_per_s,
                ]
            }

            fn state(&self) -> BodyState {
                let moving = |velocity: [f64; 3]| if self.pinned { [0.0; 3] } else { velocity };
                BodyState {
                    position_m: self.position_m,
                    orientation: self.orientation,
                    linear_velocity_m_per_s: moving(self.linear_velocity_m_per_s),
                    angular_velocity_rad_per_s: moving(self.angular_velocity_rad_per_s),
                }
            }
        }
    };
}

placed!(Capsule);
placed!(Cuboid);
placed!(Polynomial);

impl Scene {
    fn solids(&self) -> impl Iterator<Item = &dyn Placed> {
        let capsules = self.capsules.iter().map(|capsule| capsule as &dyn Placed);
        let boxes = self.boxes.iter().map(|cuboid| cuboid as &dyn Placed);
        capsules.chain(boxes).chain(self.polynomials.iter().map(|body| body as &dyn Placed))
    }

    fn solids_mut(&mut self) -> impl Iterator<Item = &mut dyn Placed> {
        let capsules = self.capsules.iter_mut().map(|capsule| capsule as &mut dyn Placed);
        let boxes = self.boxes.iter_mut().map(|cuboid| cuboid as &mut dyn Placed);
        capsules.chain(boxes).chain(self.polynomials.iter_mut().map(|body| body as &mut dyn Placed))
    }

    /// The solids at step 0, in the order of a state.
    pub(super) fn initial_solids(&self) -> impl Iterator<Item = BodyState> {
        self.solids().map(|solid| solid.state())
    }

    pub(super) fn canonicalise_solids(&mut self) {
        for solid in self.solids_mut() {
            solid.vectors_mut().into_iter().flatten().for_each(|value| *value += 0.0);
        }
    }

    /// The orientations, to be made unit.
    pub(super) fn solid_orientations(&mut self) -> impl Iterator<Item = &mut [f64]> {
        self.solids_mut().map(|solid| {
            let [_, orientation, _, _] = solid.vectors_mut();
            orientation
        })
    }

    pub(super) fn validate_solids(&self) -> Result<(), SceneError> {
        for (index, capsule) in self.capsules.iter().enumerate() {
            let key = |field: &str| format!("capsule[{index}].{field}");
            positive(&key("radius_m"), capsule.radius_m)?;
            positive(&key("half_length_m"), capsule.half_length_m)?;
            positive(&key("mass_kg"), capsule.mass_kg)?;
            validate_placed(&key, capsule)?;
            self.material_exists(&key("material"), &capsule.material)?;
        }
        for (index, cuboid) in self.boxes.iter().enumerate() {
            let key = |field: &str| format!("box[{index}].{field}");
            let edge = cuboid.edge_radius_m;
            not_negative(&key("edge_radius_m"), edge)?;
            for half in cuboid.half_extents_m {
                positive(&key("half_extents_m"), half)?;
                if edge >= half {
                    let expected = format!("less than each of half_extents_m = {:?}", cuboid.half_extents_m);
                    return Err(refuse_number(&key("edge_radius_m"), edge, &expected));
                }
            }
            positive(&key("mass_kg"), cuboid.mass_kg)?;
            validate_placed(&key, cuboid)?;
            self.material_exists(&key("material"), &cuboid.material)?;
        }
        for (index, body) in self.polynomials.iter().enumerate() {
            let key = |field: &str| format!("polynomial[{index}].{field}");
            positive(&key("scale_m"), body.scale_m)?;
            positive(&key("bounding_radius_m"), body.bounding_radius_m)?;
            match (body.mass_kg, body.density_kg_per_m3) {
                (Some(mass), None) => positive(&key("mass_kg"), mass)?,
                (None, Some(density)) => positive(&key("density_kg_per_m3"), density)?,
                (mass, _) => {
                    let given = if mass.is_some() { "given beside density_kg_per_m3" } else { "not given" };
                    return Err(refuse(&key("mass_kg"), given, "either mass_kg or density_kg_per_m3"));
                }
            }
            validate_placed(&key, body)?;
            self.material_exists(&key("material"), &body.material)?;
        }
        Ok(())
    }
}

fn validate_placed(key: &dyn Fn(&str) -> String, solid: &dyn Placed) -> Result<(), SceneError> {
    for (name, values) in solid.vectors() {
        if name == "orientation" { unit(&key(name), values)? } else { vector(&key(name), values)? }
    }
    Ok(())
}

fn one() -> f64 {
    1.0
}

fn identity() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

//! Bodies besides rings, spheres and planes: capsules, boxes.

use super::validate::{not_negative, positive, refuse_number, unit, vector};
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

impl Scene {
    fn solids(&self) -> impl Iterator<Item = &dyn Placed> {
        let capsules = self.capsules.iter().map(|capsule| capsule as &dyn Placed);
        capsules.chain(self.boxes.iter().map(|cuboid| cuboid as &dyn Placed))
    }

    fn solids_mut(&mut self) -> impl Iterator<Item = &mut dyn Placed> {
        let capsules = self.capsules.iter_mut().map(|capsule| capsule as &mut dyn Placed);
        capsules.chain(self.boxes.iter_mut().map(|cuboid| cuboid as &mut dyn Placed))
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
        Ok(())
    }
}

fn validate_placed(key: &dyn Fn(&str) -> String, solid: &dyn Placed) -> Result<(), SceneError> {
    for (name, values) in solid.vectors() {
        if name == "orientation" { unit(&key(name), values)? } else { vector(&key(name), values)? }
    }
    Ok(())
}

fn identity() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

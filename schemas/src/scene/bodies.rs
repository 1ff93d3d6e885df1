//! Bodies and their materials.

use super::Scene;
use crate::state::BodyState;
use serde::{Deserialize, Serialize};

/// How a body's surface answers to contact.
///
/// Along a contact arc the force per unit length is `max(0, k d (1 + z d') + c d')` with the penetration `d`,
/// its rate `d'`, the line stiffness `k` and the two dampings `z` (Hunt-Crossley) and `c` (Kelvin-Voigt);
/// at a contact point (sphere against sphere or plane, and everywhere under the law `centreline-minima`) it is the same
/// with the point stiffness and damping, and under the law `surface-integral` per area with those of the surface.
/// It never pulls. The integrator `rk4` takes the rate as it is; `verlet` takes damping implicitly, with the
/// rate `d' / (1 + h/2 w L C)`: time step `h`, both bodies' mobility `w`, length `L` of the arc (1 at a
/// point) and `C = k d z + c`. So no damping is too strong for a step, and strong damping is felt less than
/// its constant says, by a share that vanishes with the step (docs/methods.md has `w`). Two materials in contact count with the harmonic mean of their stiffnesses, the
/// arithmetic mean of their dampings and the geometric mean of their friction coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Stiffness of a ring's wire per length of contact arc, in newtons per square metre.
    /// A resolved material has either this or a contact modulus; without both it is 1e4.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line_stiffness_n_per_m2: Option<f64>,
    /// Hertz's effective modulus of two bodies of this material, `E / (2 (1 - nu^2))` of Young's modulus and
    /// Poisson's ratio, in pascals; instead of a line stiffness. Wires get the line stiffness `E* / 2`, with
    /// which two straight crossed wires press as Hertz says; for rings hooked into each other it is
    /// `1 / sqrt(1 - r/R)` times that. Sphere against sphere or plane presses by Hertz's law,
    /// `4/3 E* sqrt(r) d^1.5`; other contact points have the point stiffness.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_modulus_pa: Option<f64>,
    /// Stiffness of contact points, in newtons per metre.
    #[serde(default = "Material::default_point_stiffness")]
    pub point_stiffness_n_per_m: f64,
    /// Stiffness of a surface per area inside another body, in newtons per cubic metre: for the contact law
    /// `surface-integral`.
    #[serde(
        default = "Material::default_surface_stiffness",
        skip_serializing_if = "Material::is_default_surface"
    )]
    pub surface_stiffness_n_per_m3: f64,
    /// Hunt-Crossley damping `z`, in seconds per metre: damping that grows with penetration.
    /// `verlet` takes it implicitly: see above.
    #[serde(default)]
    pub damping_s_per_m: f64,
    /// Kelvin-Voigt damping `c` per length of contact arc, in newton seconds per square metre; implicit
    /// likewise.
    #[serde(default)]
    pub line_damping_n_s_per_m2: f64,
    /// Kelvin-Voigt damping `c` of contact points, in newton seconds per metre; implicit likewise.
    #[serde(default)]
    pub point_damping_n_s_per_m: f64,
    /// Kelvin-Voigt damping `c` per area inside another body, in newton seconds per cubic metre: for the contact law
    /// `surface-integral`; implicit likewise.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub surface_damping_n_s_per_m3: f64,
    /// Instead of damping constants: an impact at `restitution_speed_m_per_s` leaves this share of the speed.
    /// Resolves to the Hunt-Crossley damping that does it, whatever the masses, stiffness and shapes are.
    /// Slower impacts keep more, as metals do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restitution: Option<f64>,
    /// The speed at which `restitution` holds, in metres per second; without it 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restitution_speed_m_per_s: Option<f64>,
    /// Instead of damping constants: the share of critical damping. Resolves to Kelvin-Voigt dampings
    /// `c = 2 z sqrt(k m)`: at points for the mass of the lightest free sphere, and along arcs for two of the
    /// lightest free rings, of this material where there are any, that cross with a penetration of a
    /// twentieth of both wires. Heavier bodies and longer arcs are damped in another proportion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping_ratio: Option<f64>,
    /// Coulomb's coefficient of friction.
    #[serde(default)]
    pub friction_coefficient: f64,
    /// Stiffness of the tangential spring of friction, in newtons per metre.
    #[serde(default = "Material::default_friction_stiffness")]
    pub friction_stiffness_n_per_m: f64,
}

impl Material {
    /// Stiffness along contact arcs, given or by the contact modulus (N/m^2).
    pub fn line_stiffness(&self) -> f64 {
        match (self.line_stiffness_n_per_m2, self.contact_modulus_pa) {
            (Some(stiffness), _) => stiffness,
            (None, Some(modulus)) => 0.5 * modulus,
            (None, None) => 1e4,
        }
    }

    fn default_point_stiffness() -> f64 {
        1e4
    }

    fn default_surface_stiffness() -> f64 {
        1e6
    }

    fn is_default_surface(value: &f64) -> bool {
        *value == Material::default_surface_stiffness()
    }

    fn default_friction_stiffness() -> f64 {
        1e3
    }
}

/// Drag on one body: the force `-(linear + quadratic |v|) v` and the torque `-angular w`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drag {
    /// Linear drag coefficient, in kilograms per second.
    #[serde(default)]
    pub linear_kg_per_s: f64,
    /// Quadratic drag coefficient, in kilograms per metre.
    #[serde(default)]
    pub quadratic_kg_per_m: f64,
    /// Angular drag coefficient, in kilogram square metres per second.
    #[serde(default)]
    pub angular_kg_m2_per_s: f64,
}

/// A rigid ring: a solid torus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// From the centre to the centreline of the wire, in metres.
    pub major_radius_m: f64,
    /// Radius of the wire, in metres.
    pub minor_radius_m: f64,
    /// Mass, in kilograms.
    pub mass_kg: f64,
    /// Name of the material.
    pub material: String,
    /// Centre at step 0, in metres.
    pub position_m: [f64; 3],
    /// Unit quaternion `[x, y, z, w]` at step 0; the ring's axis is its own z.
    #[serde(default = "identity")]
    pub orientation: [f64; 4],
    /// Velocity at step 0.
    #[serde(default)]
    pub linear_velocity_m_per_s: [f64; 3],
    /// Angular velocity at step 0, World axes.
    #[serde(default)]
    pub angular_velocity_rad_per_s: [f64; 3],
    /// A pinned ring never moves.
    #[serde(default)]
    pub pinned: bool,
    /// Its own drag, instead of what `forces` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drag: Option<Drag>,
    /// Name of the motion that the ring follows exactly, whatever pulls at it; velocities at step 0 come from
    /// there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<String>,
}

/// A rigid solid sphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    /// Radius, in metres.
    pub radius_m: f64,
    /// Mass, in kilograms.
    pub mass_kg: f64,
    /// Name of the material.
    pub material: String,
    /// Centre at step 0, in metres.
    pub position_m: [f64; 3],
    /// Velocity at step 0.
    #[serde(default)]
    pub linear_velocity_m_per_s: [f64; 3],
    /// Angular velocity at step 0, World axes.
    #[serde(default)]
    pub angular_velocity_rad_per_s: [f64; 3],
    /// A pinned sphere never moves.
    #[serde(default)]
    pub pinned: bool,
    /// Its drag; a sphere without has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drag: Option<Drag>,
    /// Name of the motion that the sphere follows exactly, whatever pulls at it; velocities at step 0 come from
    /// there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<String>,
}

/// A fixed half-space: the points with `normal . p < offset` are solid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Unit normal, out of the solid.
    pub normal: [f64; 3],
    /// Signed distance of the surface from World's origin along the normal, in metres.
    pub offset_m: f64,
    /// Name of the material.
    pub material: String,
}

impl Scene {
    /// The moving bodies of a resolved scene at step 0, in the order of a state: rings, spheres, capsules,
    /// boxes, polynomials. Pinned bodies are at rest. A polynomial's pose is that of its formula's frame: a state has
    /// that of its centre of mass and principal axes, which the simulator finds.
    pub fn initial_bodies(&self) -> Vec<BodyState> {
        let moving = |pinned: bool, velocity: [f64; 3]| if pinned { [0.0; 3] } else { velocity };
        let rings = self.rings.iter().map(|ring| BodyState {
            position_m: ring.position_m,
            orientation: ring.orientation,
            linear_velocity_m_per_s: moving(ring.pinned, ring.linear_velocity_m_per_s),
            angular_velocity_rad_per_s: moving(ring.pinned, ring.angular_velocity_rad_per_s),
        });
        let spheres = self.spheres.iter().map(|sphere| BodyState {
            position_m: sphere.position_m,
            orientation: identity(),
            linear_velocity_m_per_s: moving(sphere.pinned, sphere.linear_velocity_m_per_s),
            angular_velocity_rad_per_s: moving(sphere.pinned, sphere.angular_velocity_rad_per_s),
        });
        rings.chain(spheres).chain(self.initial_solids()).collect()
    }
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

fn identity() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

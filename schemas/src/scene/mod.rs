//! The scene: what happens (bodies, materials, forces, method, time) and how to look at it (`render`).
//!
//! A scene file is TOML. [`Scene::parse`] reads it with overrides, lays out the weaves, checks every value
//! and returns the *resolved* scene: explicit bodies and planes, nothing left to expand. The
//! resolved scene is what the simulator publishes and the log keeps, as JSON.

mod bodies;
mod error;
mod materials;
mod motion;
mod parse;
pub mod render;
mod solids;
mod surface;
mod time;
mod validate;
mod weave;

pub use bodies::{Drag, Material, Plane, Ring, Sphere};
pub use error::SceneError;
pub use motion::{Interpolation, Keyframe, Motion, Shake};
pub use solids::{Capsule, Cuboid, Polynomial};
pub use surface::{SurfaceAverage, SurfaceIntegral, SurfaceSampler};
pub use time::Time;
pub use weave::{Grip, Pattern, Weave};

use crate::plan::Plan;
use crate::{Hash, state};
use render::Render;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A scene. After [`Scene::parse`] it is resolved: `weaves` is empty and every value has been checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Seed of all random numbers, of the simulator and the renderer.
    #[serde(default)]
    pub seed: u64,
    /// How long, in which steps, and when a frame is taken.
    pub time: Time,
    /// How the equations of motion are solved.
    #[serde(default)]
    pub method: Method,
    /// Forces that act on every body.
    #[serde(default)]
    pub forces: Forces,
    /// Materials of contact, by name.
    #[serde(default, rename = "material")]
    pub materials: BTreeMap<String, Material>,
    /// Motions that the scene prescribes to some bodies, by name.
    #[serde(default, rename = "motion", skip_serializing_if = "BTreeMap::is_empty")]
    pub motions: BTreeMap<String, Motion>,
    /// Patches of woven rings; empty once resolved.
    #[serde(default, rename = "weave", skip_serializing_if = "Vec::is_empty")]
    pub weaves: Vec<Weave>,
    /// Rings.
    #[serde(default, rename = "ring")]
    pub rings: Vec<Ring>,
    /// Solid spheres.
    #[serde(default, rename = "sphere")]
    pub spheres: Vec<Sphere>,
    /// Solid capsules.
    #[serde(default, rename = "capsule", skip_serializing_if = "Vec::is_empty")]
    pub capsules: Vec<Capsule>,
    /// Solid boxes.
    #[serde(default, rename = "box", skip_serializing_if = "Vec::is_empty")]
    pub boxes: Vec<Cuboid>,
    /// Solid bodies bounded by a polynomial.
    #[serde(default, rename = "polynomial", skip_serializing_if = "Vec::is_empty")]
    pub polynomials: Vec<Polynomial>,
    /// Fixed half-spaces.
    #[serde(default, rename = "plane")]
    pub planes: Vec<Plane>,
    /// What the log keeps.
    #[serde(default)]
    pub record: Record,
    /// How to look at it.
    #[serde(default)]
    pub render: Render,
}

impl Scene {
    /// Moving bodies: what a state has one entry for.
    pub fn body_count(&self) -> usize {
        self.rings.len()
            + self.spheres.len()
            + self.capsules.len()
            + self.boxes.len()
            + self.polynomials.len()
    }

    /// The name of a moving body by its number in a state, as a person counts them: `ring 3`, `sphere 0`, `box 1`.
    pub fn body_name(&self, index: usize) -> String {
        let counts = [
            ("ring", self.rings.len()),
            ("sphere", self.spheres.len()),
            ("capsule", self.capsules.len()),
            ("box", self.boxes.len()),
            ("polynomial", self.polynomials.len()),
        ];
        let mut rest = index;
        for (name, count) in counts {
            if rest < count {
                return format!("{name} {rest}");
            }
            rest -= count;
        }
        format!("body {index}")
    }

    /// Whether the log keeps the full state of a step: every `record.state_every` steps, at every frame (so
    /// that the log can be rendered again), and at the last step.
    pub fn state_is_recorded(&self, step: u64) -> bool {
        step.is_multiple_of(self.record.state_every) || self.time.is_audited(step)
    }
}

/// How the equations of motion are solved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Method {
    /// The integrator.
    pub integrator: Integrator,
    /// `dopri5`: error of an inner step relative to the body's size (place, angle) and to its surface's speed
    /// (velocity), without unit; from 1e-13 to 0.1.
    #[serde(skip_serializing_if = "Method::is_default_tolerance")]
    pub tolerance: f64,
    /// `dopri5`: error of an inner step that is tolerated anyway, in metres of displacement and metres per
    /// second of the surface.
    #[serde(skip_serializing_if = "Method::is_default_absolute_tolerance")]
    pub absolute_tolerance: f64,
    /// What is done about a step in which a body could pass through another.
    #[serde(skip_serializing_if = "OnRisk::is_stop")]
    pub on_risk: OnRisk,
    /// How far two rings' wires press into each other at most, as a share of both wires' radii together; from
    /// 1e-6 to 1. The bound on the time step is stated for it: deeper contacts are stiffer. A step record tells of
    /// contacts that are deeper than the step allows.
    #[serde(skip_serializing_if = "Method::is_default_stability_penetration")]
    pub stability_penetration: f64,
    /// The law of contact.
    pub contact_law: ContactLaw,
    /// How the law `surface-integral` takes its integral.
    #[serde(skip_serializing_if = "SurfaceIntegral::is_default")]
    pub surface: SurfaceIntegral,
    /// How pairs of bodies that are near each other are found. No bit of a state depends on it.
    #[serde(skip_serializing_if = "BroadPhase::is_auto")]
    pub broad_phase: BroadPhase,
    /// Lets islands of bodies at rest sleep; without it none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sleep: Option<Sleep>,
}

/// When an island of bodies that are near each other sleeps: none of them moves any more, and none costs
/// anything, until something moves near it or the forces on a body change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sleep {
    /// Speed of a surface below which a body may go to rest (m/s).
    pub speed_m_per_s: f64,
    /// Acceleration of a surface below which it may, and up to which the forces on it let it sleep (m/s^2).
    pub acceleration_m_per_s2: f64,
}

impl Default for Method {
    fn default() -> Self {
        Method {
            integrator: Integrator::default(),
            tolerance: 1e-6,
            absolute_tolerance: 1e-9,
            on_risk: OnRisk::default(),
            stability_penetration: 0.05,
            contact_law: ContactLaw::default(),
            surface: SurfaceIntegral::default(),
            broad_phase: BroadPhase::default(),
            sleep: None,
        }
    }
}

impl Method {
    fn is_default_tolerance(value: &f64) -> bool {
        *value == Method::default().tolerance
    }

    fn is_default_absolute_tolerance(value: &f64) -> bool {
        *value == Method::default().absolute_tolerance
    }

    fn is_default_stability_penetration(value: &f64) -> bool {
        *value == Method::default().stability_penetration
    }
}

/// What is done about a step in which a body could pass through another, or which is beyond the method's
/// stability bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnRisk {
    /// A step beyond the bound is refused before the run; a broken link stops the run when it is noticed.
    #[default]
    Stop,
    /// The step is made in `2^n` equal parts, as many as the state asks for; any step is accepted. `dopri5`
    /// does so by itself.
    Subdivide,
}

impl OnRisk {
    /// Whether it is the default.
    pub fn is_stop(&self) -> bool {
        *self == OnRisk::Stop
    }
}

/// An integrator of the equations of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Drift-kick-drift splitting with the exact free motion of a symmetric top: second order, symplectic
    /// without damping, one force evaluation a step.
    #[default]
    Verlet,
    /// The classical Runge-Kutta method of fourth order: four force evaluations a step.
    Rk4,
    /// Dormand and Prince's method of order five with inner steps as long as `tolerance` allows: for a
    /// target accuracy. `time.time_step_s` is then only how far apart states are.
    Dopri5,
    /// Backward Euler: first order, stable with any step and stiffness, takes energy from every motion. For
    /// stiffness of 1e8 and beyond, what comes to rest, and previews.
    BackwardEuler,
    /// Mean forces between the trapezoidal rule's and the end's, for each contact so that none adds energy: second
    /// order, stable with any step and stiffness, takes the energy of vibrations that the step does not resolve.
    /// For stiffness of 1e8 and beyond. Friction is of first order.
    EnergyDecaying,
}

impl Integrator {
    /// Every integrator.
    pub const ALL: [Integrator; 5] = [
        Integrator::Verlet,
        Integrator::Rk4,
        Integrator::Dopri5,
        Integrator::BackwardEuler,
        Integrator::EnergyDecaying,
    ];

    /// Whether it solves equations for the end of its step, so that no stiffness bounds the step.
    pub fn is_implicit(self) -> bool {
        matches!(self, Integrator::BackwardEuler | Integrator::EnergyDecaying)
    }

    /// Its name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Integrator::Verlet => "verlet",
            Integrator::Rk4 => "rk4",
            Integrator::Dopri5 => "dopri5",
            Integrator::BackwardEuler => "backward-euler",
            Integrator::EnergyDecaying => "energy-decaying",
        }
    }
}

/// A way to find the pairs of bodies that are near each other. All find the same pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BroadPhase {
    /// What the plan takes for the fastest, by the number of bodies.
    #[default]
    Auto,
    /// Cells as wide as the longest reach.
    Grid,
    /// A layered range tree with fractional cascading.
    RangeTree,
    /// Intervals along the axis of the widest spread, in order.
    SweepAndPrune,
    /// Every pair is looked at.
    Brute,
}

impl BroadPhase {
    /// Whether the choice is left to the plan.
    pub fn is_auto(&self) -> bool {
        *self == BroadPhase::Auto
    }
}

/// A law of contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContactLaw {
    /// Potential along the certified contact arcs of one centreline inside the other body.
    #[default]
    CentrelineArc,
    /// A spring at each local minimum of the distance between a centreline and the other body.
    CentrelineMinima,
    /// Integral of the depth over the part of each surface that is inside the other body.
    SurfaceIntegral,
}

impl ContactLaw {
    /// The law as a scene writes it.
    pub fn name(&self) -> &'static str {
        match self {
            ContactLaw::CentrelineArc => "centreline-arc",
            ContactLaw::CentrelineMinima => "centreline-minima",
            ContactLaw::SurfaceIntegral => "surface-integral",
        }
    }
}

/// Forces that act on every body.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Forces {
    /// Acceleration of gravity in World, in metres per second squared.
    pub gravity_m_per_s2: [f64; 3],
    /// Linear drag coefficient `c` of the force `-c v` on each ring, in kilograms per second.
    pub linear_drag_kg_per_s: f64,
    /// Quadratic drag coefficient `c` of the force `-c |v| v` on each ring, in kilograms per metre.
    #[serde(skip_serializing_if = "Forces::is_zero")]
    pub quadratic_drag_kg_per_m: f64,
    /// Angular drag coefficient `c` of the torque `-c w` on each ring, in kilogram square metres per second.
    pub angular_drag_kg_m2_per_s: f64,
}

impl Forces {
    fn is_zero(value: &f64) -> bool {
        *value == 0.0
    }
}

/// What the log keeps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Record {
    /// A full state every so many steps, at every frame and at the last step; a step record for every step, always.
    pub state_every: u64,
    /// Whether the step record of each frame, and of the last step, holds an estimate of the error of a step.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub error_estimate: bool,
    /// Whether the step records tell what each pin and each prescribed motion has to bear.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub reactions: bool,
    /// At most so many seconds of a clock on the wall, or 64 MiB, of a run are lost when its processes die: so often the
    /// log is brought to the disk. No byte of the finished log depends on it but this number itself.
    #[serde(skip_serializing_if = "Record::is_default_flush")]
    pub flush_every_s: f64,
}

impl Record {
    /// Seconds between two flushes where a scene says nothing else.
    pub const FLUSH_EVERY_S: f64 = 1.0;

    fn is_default_flush(value: &f64) -> bool {
        *value == Record::FLUSH_EVERY_S
    }
}

impl Default for Record {
    fn default() -> Self {
        Record {
            state_every: 1,
            error_estimate: false,
            reactions: false,
            flush_every_s: Record::FLUSH_EVERY_S,
        }
    }
}

/// The first message of a log: everything needed to run it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneRecord {
    /// `chainmail`.
    pub program: String,
    /// The program's version: only the same version promises the same bits.
    pub version: String,
    /// The hash of the state layout (see [`state::layout_hash`]).
    pub layout_hash: Hash,
    /// The resolved scene.
    pub scene: Scene,
    /// What the scene needs of the simulator, and what was left out.
    pub plan: Plan,
}

impl SceneRecord {
    /// The record of a scene and its plan, made by this version of the program.
    pub fn new(scene: Scene, plan: Plan) -> SceneRecord {
        SceneRecord {
            program: "chainmail".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            layout_hash: state::layout_hash(),
            scene,
            plan,
        }
    }
}

/// JSON Schema of [`SceneRecord`], written beside its channel.
pub const SCENE_JSON_SCHEMA: &str = r#"{"title":"chainmail.Scene","type":"object","properties":{"program":{"type":"string"},"version":{"type":"string"},"layout_hash":{"type":"string"},"scene":{"type":"object"},"plan":{"type":"object"}}}"#;

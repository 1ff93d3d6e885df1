//! The record of one step: counts, energies, audits and hashes. Small, one for every step, always.

use crate::Hash;
use serde::{Deserialize, Serialize};

/// One line of a run's diary; JSON in the log, so that any MCAP viewer plots it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Steps done; the initial state is step 0.
    pub step: u64,
    /// Simulated time in seconds.
    pub sim_time_s: f64,
    /// Pairs whose bounding spheres overlap.
    pub candidate_pairs: u64,
    /// Contacts: connected contact arcs and contact points.
    pub contacts: u64,
    /// Translational and rotational kinetic energy, in joules.
    pub kinetic_energy_j: f64,
    /// Potential energy in the field of gravity, zero at World's origin, in joules.
    pub gravity_energy_j: f64,
    /// Energy stored in the contacts' normal springs, in joules: of the step's force evaluation, carried to the state
    /// by the power of the elastic forces.
    pub contact_energy_j: f64,
    /// Energy taken out by damping, friction and drag since step 0, in joules.
    pub dissipated_energy_j: f64,
    /// Largest penetration found by the force quadrature, in metres; 0 without contact.
    pub penetration_m: f64,
    /// The deepest contact of two rings as a share of both wires' radii together, where that is deeper than what the
    /// bound on the time step covers (`method.stability_penetration`, and what a shorter step adds to it); else
    /// `None`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub penetration_beyond_bound: Option<f64>,
    /// What the samples of the law `surface-integral` found in the step's last evaluation; `None` with another law or by
    /// quadrature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface_samples: Option<SurfaceSamples>,
    /// Estimated error of one step from this state (m): how far apart one step and two half steps put a body,
    /// at most; with `record.error_estimate` at frame times and at the last step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_estimate_m: Option<f64>,
    /// Work that prescribed motions did in this step on the bodies that they do not move themselves, in
    /// joules; `None` in a scene without them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive_work_j: Option<f64>,
    /// What pins and prescribed motions bear; `None` unless the scene asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reactions: Option<Reactions>,
    /// The audit, made at frame times and at the last step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub audit: Option<Audit>,
    /// A hash per stage of the step, so that a difference has a place.
    pub stages: StageHashes,
    /// BLAKE3 of the state message, as in its header.
    pub state_hash: Hash,
    /// The chained hash up to this step.
    pub chained_hash: Hash,
}

/// How well the samples of the law `surface-integral` see the contacts: a contact that no sample hits has no force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SurfaceSamples {
    /// Pairs that overlap, by their certified contact arcs.
    pub pairs: u64,
    /// Those of them that no sample hit: they push with no force at all.
    pub missed: u64,
    /// Samples of all their surfaces.
    pub samples: u64,
    /// Samples inside the other body.
    pub hits: u64,
}

impl std::ops::AddAssign for SurfaceSamples {
    fn add_assign(&mut self, other: SurfaceSamples) {
        self.pairs += other.pairs;
        self.missed += other.missed;
        self.samples += other.samples;
        self.hits += other.hits;
    }
}

impl std::iter::Sum for SurfaceSamples {
    fn sum<I: Iterator<Item = SurfaceSamples>>(all: I) -> SurfaceSamples {
        all.fold(SurfaceSamples::default(), |mut sum, one| {
            sum += one;
            sum
        })
    }
}

/// What holds the mail, and what it bears: contact forces and weight, not the inertia of a driven body.
///
/// Of the step's force evaluation: for `verlet` in the middle of the step. World axes; a force down is a pull
/// down on the holder. At rest all forces together are the weight of everything held.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Reactions {
    /// Each pinned body, in order.
    pub pins: Vec<PinReaction>,
    /// Each prescribed motion, by name.
    pub motions: Vec<MotionReaction>,
}

/// What a pinned body's support bears.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PinReaction {
    /// The body's number in the state.
    pub body: u32,
    /// Force, in newtons.
    pub force_n: [f64; 3],
    /// Torque about the body's centre, in newton metres.
    pub torque_n_m: [f64; 3],
}

/// What a prescribed motion bears: the sum over the bodies that follow it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionReaction {
    /// Its name in the scene.
    pub motion: String,
    /// Its translation at that moment, in metres.
    pub translation_m: [f64; 3],
    /// Its angle, in radians.
    pub angle_rad: f64,
    /// Force, in newtons.
    pub force_n: [f64; 3],
    /// Torque about its pivot, which the translation carries along, in newton metres.
    pub torque_n_m: [f64; 3],
}

/// What is checked at each frame time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Audit {
    /// Pairs of rings that were linked at step 0.
    pub links: u64,
    /// How many of them are still linked (closed form).
    pub links_intact: u64,
    /// Smallest gap between any two candidate bodies, in metres; negative is penetration. `None` without candidates.
    pub gap_min_m: Option<f64>,
}

/// The stages of a step in their order; each is hashed on its own.
///
/// 64 bits of BLAKE3 as 16 hexadecimal digits. Equal inputs to a stage give equal hashes, so the first
/// stage that differs between two runs is the one to look at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StageHashes {
    /// The sorted list of candidate pairs.
    pub candidate_pairs: String,
    /// Contact arcs and points: place, penetration, normal force.
    pub contacts: String,
    /// Force and torque on each body.
    pub forces: String,
    /// Bodies and contact history after the step: the first 16 digits of the state hash.
    pub state: String,
}

impl StageHashes {
    /// The stages' names and hashes in the order in which a step runs them.
    pub fn in_order(&self) -> [(&'static str, &str); 4] {
        [
            ("candidate_pairs", &self.candidate_pairs),
            ("contacts", &self.contacts),
            ("forces", &self.forces),
            ("state", &self.state),
        ]
    }
}

/// JSON Schema of [`StepRecord`], written beside its channel.
pub const STEP_JSON_SCHEMA: &str = r#"{"title":"chainmail.Step","type":"object","properties":{"step":{"type":"integer"},"sim_time_s":{"type":"number"},"candidate_pairs":{"type":"integer"},"contacts":{"type":"integer"},"kinetic_energy_j":{"type":"number"},"gravity_energy_j":{"type":"number"},"contact_energy_j":{"type":"number"},"dissipated_energy_j":{"type":"number"},"penetration_m":{"type":"number"},"penetration_beyond_bound":{"type":"number"},"surface_samples":{"type":"object","properties":{"pairs":{"type":"integer"},"missed":{"type":"integer"},"samples":{"type":"integer"},"hits":{"type":"integer"}}},"error_estimate_m":{"type":"number"},"drive_work_j":{"type":"number"},"reactions":{"type":"object","properties":{"pins":{"type":"array","items":{"type":"object","properties":{"body":{"type":"integer"},"force_n":{"type":"array","items":{"type":"number"}},"torque_n_m":{"type":"array","items":{"type":"number"}}}}},"motions":{"type":"array","items":{"type":"object","properties":{"motion":{"type":"string"},"translation_m":{"type":"array","items":{"type":"number"}},"angle_rad":{"type":"number"},"force_n":{"type":"array","items":{"type":"number"}},"torque_n_m":{"type":"array","items":{"type":"number"}}}}}}},"audit":{"type":"object","properties":{"links":{"type":"integer"},"links_intact":{"type":"integer"},"gap_min_m":{"type":["number","null"]}}},"stages":{"type":"object","properties":{"candidate_pairs":{"type":"string"},"contacts":{"type":"string"},"forces":{"type":"string"},"state":{"type":"string"}}},"state_hash":{"type":"string"},"chained_hash":{"type":"string"}}}"#;

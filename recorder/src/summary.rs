//! What is in a log, in a page: for `info`, and for the end of a run.

use crate::check::Counts;
use crate::fault::{Health, LogError};
use crate::message::{Kind, Message};
use crate::reader::Log;
use schemas::Hash;
use schemas::end::Outcome;
use schemas::scene::Scene;
use schemas::step::{Audit, StepRecord, SurfaceSamples};
use serde::Serialize;
use std::fmt;

/// The account of a log. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// The log file.
    pub file: String,
    /// The program that wrote it.
    pub program: String,
    /// Its version.
    pub version: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Rings in the scene.
    pub rings: usize,
    /// Spheres in the scene.
    pub spheres: usize,
    /// Capsules in the scene.
    pub capsules: usize,
    /// Boxes in the scene.
    pub boxes: usize,
    /// Polynomial bodies in the scene.
    pub polynomials: usize,
    /// Steps done (step 0 is not one).
    pub steps: u64,
    /// Steps that the scene asks for.
    pub steps_planned: u64,
    /// Simulated time of the last step, in seconds.
    pub sim_time_s: f64,
    /// Full states.
    pub states: u64,
    /// Bytes of the states.
    pub state_bytes: u64,
    /// Frames.
    pub frames: u64,
    /// Frames that were to come and did not.
    pub frames_missing: u64,
    /// How the run ended; `None` if the log has no end record.
    pub outcome: Option<Outcome>,
    /// The energies; `None` without a step record.
    pub energy: Option<Energy>,
    /// Largest penetration of any step, in metres.
    pub penetration_max_m: f64,
    /// The same as a share of the thinnest wire's diameter; `None` without rings.
    pub penetration_max_share: Option<f64>,
    /// Contacts deeper than the bound on the time step covers; `None` without any.
    pub beyond_bound: Option<BeyondBound>,
    /// What the samples of the law `surface-integral` found in all steps; `None` where none are drawn.
    pub surface_samples: Option<SurfaceSamples>,
    /// Pairs of rings that were linked at the start; `None` without an audit.
    pub links: Option<u64>,
    /// How many were still linked at the last audit.
    pub links_intact: Option<u64>,
    /// Smallest gap of any audit, in metres; negative is penetration.
    pub gap_min_m: Option<f64>,
    /// Size of the file, in bytes.
    pub file_bytes: u64,
    /// The chained hash of all states.
    pub chained_hash: Hash,
    /// Whether every byte is as it was written.
    pub health: Health,
}

/// Where wires pressed deeper into each other than the bound on the time step covers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BeyondBound {
    /// The first step with such a contact.
    pub first_step: u64,
    /// Steps with one.
    pub steps: u64,
    /// The deepest, as a share of both wires' radii together.
    pub penetration_max_share: f64,
}

/// Energy at the start and at the end, and how well the account balances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Energy {
    /// Kinetic, gravity and contact energy at step 0, in joules.
    pub start_j: f64,
    /// The same at the last step.
    pub end_j: f64,
    /// Energy taken out by damping, friction and drag, in joules.
    pub dissipated_j: f64,
    /// Work of prescribed motions since the start, in joules.
    pub drive_work_j: f64,
    /// Energy from nowhere: end + dissipated - start - work of prescribed motions, in joules.
    pub drift_j: f64,
    /// The largest drift of any step, by amount, in joules.
    pub drift_max_j: f64,
    /// The largest energy exchanged, in joules: the largest that kinetic, contact or dissipated energy, or
    /// the change of gravity's, has been.
    pub exchanged_max_j: f64,
    /// `drift_max_j` over `exchanged_max_j`; 0 if nothing was exchanged.
    pub drift_max_share: f64,
}

impl Summary {
    /// Reads a whole log, every byte of it.
    ///
    /// A damaged log has a summary too, of what lies before the damage: see [`Summary::health`].
    ///
    /// # Errors
    ///
    /// [`LogError`] if not even the scene can be read.
    pub fn of(log: &Log) -> Result<Summary, LogError> {
        let record = log.scene()?;
        let scene = &record.scene;
        let mut sums = Sums::default();
        let (mut counts, mut frames_missing) = (Counts::default(), 0);
        let checked = log.check(&mut |message, step| sums.add(message, step, &mut counts));
        if let Ok(checker) = &checked {
            frames_missing = checker.frames_missing();
        }
        Ok(Summary {
            file: log.file().to_owned(),
            program: record.program,
            version: record.version,
            seed: scene.seed,
            rings: scene.rings.len(),
            spheres: scene.spheres.len(),
            capsules: scene.capsules.len(),
            boxes: scene.boxes.len(),
            polynomials: scene.polynomials.len(),
            steps: counts.step_records.saturating_sub(1),
            steps_planned: scene.time.step_count(),
            sim_time_s: sums.sim_time_s,
            states: counts.states,
            state_bytes: counts.state_bytes,
            frames: counts.frames,
            frames_missing,
            outcome: log.end().ok().flatten().map(|end| end.outcome),
            energy: sums.energy,
            penetration_max_m: sums.penetration_max_m,
            penetration_max_share: wire_diameter_min_m(scene)
                .map(|diameter| sums.penetration_max_m / diameter),
            beyond_bound: sums.beyond_bound,
            surface_samples: sums.surface_samples,
            links: sums.audit.map(|audit| audit.links),
            links_intact: sums.audit.map(|audit| audit.links_intact),
            gap_min_m: sums.gap_min_m,
            file_bytes: log.file_bytes(),
            chained_hash: sums.chained_hash,
            health: log.health(),
        })
    }
}

fn wire_diameter_min_m(scene: &Scene) -> Option<f64> {
    let diameters = scene.rings.iter().map(|ring| 2.0 * ring.minor_radius_m);
    diameters.reduce(|a, b| if b < a { b } else { a })
}

/// What is added up over the messages.
#[derive(Default)]
struct Sums {
    first: Option<StepRecord>,
    energy: Option<Energy>,
    sim_time_s: f64,
    penetration_max_m: f64,
    beyond_bound: Option<BeyondBound>,
    surface_samples: Option<SurfaceSamples>,
    audit: Option<Audit>,
    gap_min_m: Option<f64>,
    chained_hash: Hash,
}

impl Sums {
    fn add(&mut self, message: &Message, step: Option<&StepRecord>, counts: &mut Counts) {
        match message.kind {
            Kind::State => {
                counts.states += 1;
                counts.state_bytes += message.bytes.len() as u64;
            }
            Kind::FrameInfo => counts.frames += 1,
            Kind::Step => counts.step_records += 1,
            Kind::Scene | Kind::Frame | Kind::End => {}
        }
        if let Some(step) = step {
            self.add_step(step);
        }
    }

    fn add_step(&mut self, step: &StepRecord) {
        self.sim_time_s = step.sim_time_s;
        self.chained_hash = step.chained_hash;
        raise(&mut self.penetration_max_m, step.penetration_m);
        if let Some(share) = step.penetration_beyond_bound {
            let none = BeyondBound { first_step: step.step, steps: 0, penetration_max_share: 0.0 };
            let beyond = self.beyond_bound.get_or_insert(none);
            beyond.steps += 1;
            raise(&mut beyond.penetration_max_share, share);
        }
        if let Some(samples) = step.surface_samples {
            *self.surface_samples.get_or_insert_default() += samples;
        }
        if let Some(audit) = step.audit {
            self.audit = Some(audit);
            self.gap_min_m = match (self.gap_min_m, audit.gap_min_m) {
                (Some(a), Some(b)) => Some(if b < a { b } else { a }),
                (a, b) => a.or(b),
            };
        }
        let first = self.first.get_or_insert_with(|| step.clone());
        let start_j = total_j(first);
        let end_j = total_j(step);
        let before_j = self.energy.map_or(0.0, |energy| energy.drive_work_j);
        let drive_work_j = before_j + step.drive_work_j.unwrap_or(0.0);
        let drift_j = end_j + step.dissipated_energy_j - start_j - drive_work_j;
        let exchanged_j = [
            step.kinetic_energy_j,
            step.contact_energy_j,
            step.dissipated_energy_j,
            drive_work_j,
            step.gravity_energy_j - first.gravity_energy_j,
        ];
        let mut energy = self.energy.unwrap_or(Energy {
            start_j,
            end_j,
            dissipated_j: 0.0,
            drive_work_j,
            drift_j: 0.0,
            drift_max_j: 0.0,
            exchanged_max_j: 0.0,
            drift_max_share: 0.0,
        });
        (energy.end_j, energy.dissipated_j, energy.drift_j) = (end_j, step.dissipated_energy_j, drift_j);
        energy.drive_work_j = drive_work_j;
        if drift_j.abs() > energy.drift_max_j.abs() {
            energy.drift_max_j = drift_j;
        }
        exchanged_j.iter().for_each(|exchanged| raise(&mut energy.exchanged_max_j, exchanged.abs()));
        if energy.exchanged_max_j > 0.0 {
            energy.drift_max_share = energy.drift_max_j / energy.exchanged_max_j;
        }
        self.energy = Some(energy);
    }
}

/// Kinetic, gravity and contact energy.
pub(crate) fn total_j(step: &StepRecord) -> f64 {
    step.kinetic_energy_j + step.gravity_energy_j + step.contact_energy_j
}

fn raise(largest: &mut f64, value: f64) {
    if value > *largest {
        *largest = value;
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut line = |label: &str, value: String| writeln!(f, "{label:<12} {value}");
        line("log", format!("{} ({})", self.file, bytes_text(self.file_bytes)))?;
        line("written by", format!("{} {}, seed {}", self.program, self.version, self.seed))?;
        let plural =
            |count: usize, one: &str, many: &str| format!("{count} {}", if count == 1 { one } else { many });
        let mut bodies = plural(self.rings, "ring", "rings");
        for (count, one, many) in [
            (self.spheres, "sphere", "spheres"),
            (self.capsules, "capsule", "capsules"),
            (self.boxes, "box", "boxes"),
            (self.polynomials, "polynomial body", "polynomial bodies"),
        ] {
            if count > 0 {
                bodies += &format!(", {}", plural(count, one, many));
            }
        }
        line("bodies", bodies)?;
        let planned = if self.steps == self.steps_planned {
            String::new()
        } else {
            format!(" of {}", self.steps_planned)
        };
        line("steps", format!("{}{planned}, {} s of simulated time", self.steps, self.sim_time_s))?;
        line("states", format!("{} ({})", self.states, bytes_text(self.state_bytes)))?;
        let missing = if self.frames_missing > 0 {
            format!(", {} missing", self.frames_missing)
        } else {
            String::new()
        };
        line("frames", format!("{}{missing}", self.frames))?;
        line("outcome", outcome_text(self.outcome.as_ref()))?;
        if let Some(energy) = &self.energy {
            line(
                "energy",
                format!(
                    "{:.6e} J at the start, {:.6e} J at the end, {:.6e} J dissipated",
                    energy.start_j, energy.end_j, energy.dissipated_j
                ),
            )?;
            if energy.drive_work_j != 0.0 {
                line("work of motions", format!("{:.6e} J", energy.drive_work_j))?;
            }
            line(
                "energy drift",
                format!(
                    "{:.3e} J at the end, {:.3e} J at most, {:.2e} of the largest energy exchanged",
                    energy.drift_j, energy.drift_max_j, energy.drift_max_share
                ),
            )?;
        }
        let share = self
            .penetration_max_share
            .map(|share| format!(", {:.3} % of the wire's diameter", 100.0 * share));
        line(
            "penetration",
            format!("{:.3e} m at most{}", self.penetration_max_m, share.unwrap_or_default()),
        )?;
        if let Some(beyond) = &self.beyond_bound {
            let text = format!(
                "in {} steps from step {} on, wires pressed deeper into each other than the time step covers: up to \
                 {:.3} %; take a smaller time.time_step_s or a stiffer material",
                beyond.steps,
                beyond.first_step,
                100.0 * beyond.penetration_max_share
            );
            line("warning", text)?;
        }
        if let Some(samples) = self.surface_samples.filter(|samples| samples.missed > 0) {
            let text = format!(
                "{} of {} contacts, counted in each step, were hit by no sample and had no force ({} hits of {} samples); \
                 take more method.surface.samples, or the sampler patch or quadrature",
                samples.missed, samples.pairs, samples.hits, samples.samples
            );
            line("warning", text)?;
        }
        if let (Some(links), Some(intact)) = (self.links, self.links_intact) {
            line("links", format!("{intact} of {links} intact"))?;
        }
        if let Some(gap) = self.gap_min_m {
            line("smallest gap", format!("{gap:.3e} m"))?;
        }
        line("chained hash", self.chained_hash.to_string())?;
        write!(f, "{:<12} {}", "health", self.health)
    }
}

/// How a run ended, in words.
pub fn outcome_text(outcome: Option<&Outcome>) -> String {
    match outcome {
        None => "no end record: the run did not end, or the log was cut short".to_owned(),
        Some(Outcome::Completed) => "completed".to_owned(),
        Some(Outcome::Interrupted) => "interrupted".to_owned(),
        Some(Outcome::Stopped(reason)) => format!("stopped: {reason}"),
        Some(Outcome::Recovered(missing)) => format!("not known: the log was recovered, {missing}"),
    }
}

/// A size for people.
pub(crate) fn bytes_text(bytes: u64) -> String {
    match bytes {
        0..10_000 => format!("{bytes} bytes"),
        10_000..10_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        10_000_000..10_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

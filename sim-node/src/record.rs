//! The diary of a run: one record for each step, and the state's message.

use crate::contact::Contact;
use crate::momentum::{self, Momentum, Unexplained};
use crate::overlap::gap;
use crate::reaction::reactions;
use crate::state::Motion;
use crate::{BodyName, Model, Scratch, State, Stop, estimate};
use geometry::circle::linked;
use geometry::rotation;
use schemas::step::{Audit, StageHashes, StepRecord};
use schemas::{Hash, chain, state};

/// The share of a run's energy that may come from nowhere before the run is stopped. The integrators' own
/// error stays well below it in scenes within the stability bound (the tests measure it); an unstable contact
/// doubles the energy within a few steps.
const ENERGY_GAIN_SHARE: f64 = 0.1;

/// The energy budget of a run since its first record.
#[derive(Clone, Copy, Debug)]
struct EnergyAudit {
    /// Mechanical energy plus energy lost in the first record (J).
    start: f64,
    /// Gravity's energy there (J).
    gravity: f64,
    /// The largest energy of the motion so far (J).
    scale: f64,
}

/// Records the steps of one run, in order.
#[derive(Debug)]
pub struct Records {
    chained_hash: Hash,
    energy: Option<EnergyAudit>,
    /// Momentum at the last record, and its step.
    momentum: Option<(u64, Momentum)>,
    unexplained: Option<Unexplained>,
    /// The pair of the deepest contact in the last record, and its depth (m).
    deepest: Option<(BodyName, BodyName, f64)>,
    /// Work of prescribed motions since the first record (J).
    drive_work: f64,
    /// The message of the last recorded state.
    message: Vec<u8>,
    /// Canonical bytes of one stage.
    stage: Vec<u8>,
}

impl Records {
    /// Records for a run that starts ([`Hash::default`]) or goes on from a step with this chained hash.
    pub fn after(chained_hash: Hash) -> Records {
        Records {
            chained_hash,
            energy: None,
            momentum: None,
            unexplained: None,
            deepest: None,
            drive_work: 0.0,
            message: Vec::new(),
            stage: Vec::new(),
        }
    }

    /// Takes over a record that was made before: the audits of a run that goes on know what they knew then.
    pub fn follow(&mut self, record: &StepRecord) {
        if self.energy.is_some() {
            self.drive_work += record.drive_work_j.unwrap_or(0.0);
        }
        self.chained_hash = record.chained_hash;
        // It was judged when it was made; this keeps what it is judged by.
        let _ = self.check_energy(record);
    }

    /// Takes over the state of the last record that was followed: the next step's momentum is compared with its.
    pub fn stand_at(&mut self, model: &Model, state: &State) {
        let angular = momentum::is_angular(model, state.step) || momentum::is_angular(model, state.step + 1);
        self.momentum = Some((state.step, sums(model, state, angular).momentum));
    }

    /// The message of the last recorded state: the bytes of the topic `state` and of the log.
    pub fn state_message(&self) -> &[u8] {
        &self.message
    }

    /// The chained hash up to the last recorded step.
    pub fn chained_hash(&self) -> Hash {
        self.chained_hash
    }

    /// Records the step that was just made (or the state that was just evaluated).
    ///
    /// Contacts and forces are those of the step's evaluation: for `verlet` at the middle of the step, for
    /// `rk4` in its last stage. Contact energy is carried from there to the state by the power of the
    /// elastic forces, so that all energies are those of one moment, to second order in the step.
    ///
    /// The audit (links, smallest gap) is made at frame times and at the last step.
    pub fn record(&mut self, model: &Model, state: &State, scratch: &Scratch) -> StepRecord {
        let state_hash = state::encode(&state.header(), &state.bodies, &state.contacts, &mut self.message);
        self.chained_hash = chain(&self.chained_hash, &state_hash);
        let time = model.time();
        let audited = time.is_audited(state.step);
        // A balance takes the sums of two steps, the last of them at a frame.
        let angular = momentum::is_angular(model, state.step) || momentum::is_angular(model, state.step + 1);
        let Sums { kinetic: kinetic_energy_j, gravity: gravity_energy_j, momentum } =
            sums(model, state, angular);
        if self.energy.is_some() {
            self.drive_work += scratch.drive_work_j;
        }
        let mut contacts = scratch.evaluation.contacts(&scratch.moment);
        // Contacts at rest are in no evaluation.
        let (mut resting_pairs, mut resting_energy) = (0, 0.0);
        if let Some(asleep) = scratch.asleep.as_ref().filter(|asleep| !asleep.contacts.is_empty()) {
            (resting_pairs, resting_energy) = (asleep.candidate_pairs, asleep.energy);
            contacts.extend_from_slice(&asleep.contacts);
            contacts.sort_by_key(|&(a, b, contact)| (a, b, contact.arc));
        }
        let (penetration_m, penetration_beyond_bound) = penetration(model, &contacts);
        let deepest = contacts.iter().find(|contact| contact.2.penetration == penetration_m);
        self.deepest = deepest.map(|&(a, b, _)| (model.body_name(a), model.body_name(b), penetration_m));
        let before = self.momentum.replace((state.step, momentum));
        self.unexplained = match &before {
            Some((step, before)) if step + 1 == state.step && momentum::left_out(model).is_none() => {
                let sums = [before, &momentum];
                Some(Unexplained::of(model, state.step, sums, &scratch.impulse, &contacts))
            }
            _ => None,
        };
        let (stages, candidate_pairs) = self.stages(model, scratch, &contacts, &state_hash);
        StepRecord {
            step: state.step,
            sim_time_s: state.sim_time_s,
            candidate_pairs: candidate_pairs + resting_pairs,
            contacts: contacts.len() as u64,
            kinetic_energy_j,
            gravity_energy_j,
            contact_energy_j: contact_energy(model, state, scratch) + resting_energy,
            dissipated_energy_j: state.dissipated_energy_j,
            penetration_m,
            penetration_beyond_bound,
            surface_samples: scratch.moment.random.as_ref().map(|_| scratch.evaluation.surface_samples()),
            error_estimate_m: (audited && model.estimates_error())
                .then(|| estimate::step_error(model, state)),
            drive_work_j: (!model.driven().is_empty()).then_some(scratch.drive_work_j + 0.0),
            reactions: model.records_reactions().then(|| reactions(model, state, scratch)),
            audit: audited.then(|| audit(model, state)),
            stages,
            state_hash,
            chained_hash: self.chained_hash,
        }
    }

    /// Whether the energy of a step, the one just recorded, lets the run go on.
    ///
    /// # Errors
    ///
    /// [`Stop::EnergyGained`] if there is more energy than at the first record, and what was lost since, by
    /// more than a tenth of the largest energy that the motion has had.
    pub fn check_energy(&mut self, record: &StepRecord) -> Result<(), Stop> {
        let total = record.kinetic_energy_j
            + record.gravity_energy_j
            + record.contact_energy_j
            + record.dissipated_energy_j
            - self.drive_work;
        let first = EnergyAudit { start: total, gravity: record.gravity_energy_j, scale: 0.0 };
        let audit = self.energy.get_or_insert(first);
        let motion = record.kinetic_energy_j
            + record.contact_energy_j.abs()
            + (record.gravity_energy_j - audit.gravity).abs();
        if motion > audit.scale {
            audit.scale = motion;
        }
        let gained_j = total - audit.start;
        // Rounding of the sums, which are of the size of gravity's energy, is not a gain.
        let rounding = 1e-9 * (audit.start.abs() + record.gravity_energy_j.abs());
        let (share, scale_j) = (ENERGY_GAIN_SHARE, audit.scale);
        if gained_j > share * scale_j + rounding {
            let deepest = self.deepest.map_or(String::new(), |(a, b, depth)| {
                format!("; the deepest contact is that of {a} and {b}, {depth:.3e} m")
            });
            return Err(Stop::EnergyGained { step: record.step, gained_j, share, scale_j, deepest });
        }
        Ok(())
    }

    /// What the last step changed of the free bodies' momentum without a force; `None` where it is not audited, and for
    /// a step that does not follow the last record.
    pub fn unexplained(&self) -> Option<Unexplained> {
        self.unexplained
    }

    /// Whether the momentum of the step just recorded lets the run go on.
    ///
    /// # Errors
    ///
    /// [`Stop::MomentumGained`] if it changed by more than forces from outside and rounding explain.
    pub fn check_momentum(&self) -> Result<(), Stop> {
        self.unexplained.map_or(Ok(()), |unexplained| unexplained.check())
    }

    /// The hash of each stage, and how many candidate pairs there are.
    fn stages(
        &mut self,
        model: &Model,
        scratch: &Scratch,
        contacts: &[(u32, u32, Contact)],
        state_hash: &Hash,
    ) -> (StageHashes, u64) {
        let evaluation = &scratch.evaluation;
        let bytes = &mut self.stage;
        bytes.clear();
        for &(a, b) in evaluation.candidates(model, &scratch.moment) {
            put_pair(bytes, a, b);
        }
        let candidate_count = (bytes.len() / PAIR_BYTES) as u64;
        let candidate_pairs = Hash::of(bytes).short();
        bytes.clear();
        for (a, b, contact) in contacts {
            put_pair(bytes, *a, *b);
            bytes.extend_from_slice(&contact.arc.to_le_bytes());
            put(bytes, &[contact.mid_cos, contact.mid_sin, contact.penetration, contact.normal_force]);
        }
        let contacts = Hash::of(bytes).short();
        bytes.clear();
        for wrench in &evaluation.wrenches {
            let (f, t) = (&wrench.force, &wrench.torque);
            put(bytes, &[f.x, f.y, f.z, t.x, t.y, t.z]);
        }
        let forces = Hash::of(bytes).short();
        (StageHashes { candidate_pairs, contacts, forces, state: state_hash.short() }, candidate_count)
    }
}

/// The deepest contact (m); and the deepest of two rings as a share of both wires, where the time step's bound does
/// not cover it.
fn penetration(model: &Model, contacts: &[(u32, u32, Contact)]) -> (f64, Option<f64>) {
    let (mut deepest, mut share) = (0.0, model.covered_penetration());
    let mut beyond = None;
    for &(a, b, contact) in contacts {
        if contact.penetration > deepest {
            deepest = contact.penetration;
        }
        if (b as usize) < model.ring_count() && share.is_finite() {
            let wires = model.bodies()[a as usize].minor_radius + model.bodies()[b as usize].minor_radius;
            if contact.penetration > share * wires {
                share = contact.penetration / wires;
                beyond = Some(share);
            }
        }
    }
    (deepest, beyond)
}

/// Bytes of a pair of bodies in a stage's hash.
const PAIR_BYTES: usize = 2 * size_of::<u32>();

fn put_pair(bytes: &mut Vec<u8>, a: u32, b: u32) {
    bytes.extend_from_slice(&a.to_le_bytes());
    bytes.extend_from_slice(&b.to_le_bytes());
}

fn put(bytes: &mut Vec<u8>, values: &[f64]) {
    for value in values {
        bytes.extend_from_slice(&value.to_le_bytes());
    }
}

/// Kinetic energy, and potential energy in the field of gravity (zero at World's origin), in joules, of all
/// bodies but those on prescribed motions: theirs is the drive's.
pub fn mechanical_energy(model: &Model, state: &State) -> (f64, f64) {
    let sums = sums(model, state, false);
    (sums.kinetic, sums.gravity)
}

/// Sums over the bodies.
struct Sums {
    kinetic: f64,
    gravity: f64,
    momentum: Momentum,
}

fn sums(model: &Model, state: &State, angular: bool) -> Sums {
    let mut sums = Sums { kinetic: 0.0, gravity: 0.0, momentum: Momentum::ZERO };
    for (body, pose) in model.bodies().iter().zip(&state.bodies) {
        if body.driven {
            continue;
        }
        let motion = Motion::of(pose);
        let (u, w, normal) = rotation::axes(&motion.orientation);
        sums.momentum.add(body, &motion, (&u, &w, &normal), angular);
        sums.kinetic += 0.5 * body.mass_kg * motion.linear.norm_squared()
            + body.rotational_energy((&u, &w, &normal), &motion.angular);
        sums.gravity -= body.mass_kg * model.gravity().dot(&motion.position);
    }
    sums
}

/// Energy in the normal springs at the state (J): that of the last evaluation, less the elastic forces'
/// work since.
fn contact_energy(model: &Model, state: &State, scratch: &Scratch) -> f64 {
    let evaluation = &scratch.evaluation;
    let energy = evaluation.elastic_energy();
    let age = scratch.evaluation_age_s;
    if age == 0.0 {
        return energy;
    }
    let loses = crate::forces::Evaluation::loses(model);
    let mut power = 0.0;
    for (index, pose) in state.bodies.iter().enumerate() {
        let motion = Motion::of(pose);
        let wrench = &evaluation.wrenches[index];
        let (mut force, mut torque) = (wrench.force, wrench.torque);
        if loses {
            force -= evaluation.lost[index].force;
            torque -= evaluation.lost[index].torque;
        }
        power += force.dot(&motion.linear) + torque.dot(&motion.angular);
    }
    energy - age * power
}

/// Looks at all links and gaps of a state.
pub fn audit(model: &Model, state: &State) -> Audit {
    let circles = model.circles(&state.bodies);
    let links_intact = model
        .linked_pairs()
        .iter()
        .filter(|&&(a, b)| linked(&circles[a as usize], &circles[b as usize]))
        .count() as u64;
    let mut neighbours = crate::broad::Neighbours::default();
    neighbours.update(model, &circles);
    let mut gap_min_m: Option<f64> = None;
    // The list holds pairs that are a little farther apart than candidates; they are left out, so that the
    // audit is of the candidates alone.
    let candidates = neighbours.pairs().iter().filter(|&&(a, b)| model.near(&circles, a, b));
    for &(a, b) in candidates {
        let gap = gap(model, &circles, a, b);
        if gap_min_m.is_none_or(|smallest| gap < smallest) {
            gap_min_m = Some(gap + 0.0);
        }
    }
    Audit { links: model.linked_pairs().len() as u64, links_intact, gap_min_m }
}

/// Whether an audit lets the run go on.
///
/// # Errors
///
/// [`Stop::LinkBroken`] names the first pair of rings that came apart.
pub fn check_audit(model: &Model, state: &State, audit: &Audit) -> Result<(), Stop> {
    if audit.links_intact == audit.links {
        return Ok(());
    }
    let circles = model.circles(&state.bodies);
    let broken =
        model.linked_pairs().iter().find(|&&(a, b)| !linked(&circles[a as usize], &circles[b as usize]));
    let Some(&(a, b)) = broken else { return Ok(()) };
    Err(Stop::LinkBroken {
        step: state.step,
        a: model.body_name(a),
        b: model.body_name(b),
        intact: audit.links_intact,
        links: audit.links,
    })
}

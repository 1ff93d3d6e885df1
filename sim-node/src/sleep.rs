//! Islands at rest that sleep: their bodies stay where they are, and their contacts are not looked at, until
//! something comes near or pulls.
//!
//! The one thing to know: a sleeping body is one with velocities of exactly zero, and whether it sleeps is a
//! function of the state, so a run goes on from any logged state with the same bits. What is kept in the scratch only
//! saves finding out again.
//!
//! # Islands
//! Free bodies hang together where their bounding spheres overlap. Pinned bodies and planes part islands.
//! Bodies on prescribed motions count as moving.
//!
//! # Falling asleep
//! At the end of a step an island goes to rest if each of its bodies is slower than `speed_m_per_s`, and the step has
//! changed its velocity by less than `acceleration_m_per_s2` times the step; velocities count as those of the
//! surface, `|v| + a |w|` with the bounding radius `a`. What kinetic energy is left counts as dissipated.
//!
//! # Staying asleep
//! An island sleeps through a step if all its velocities are zero, nothing that moves is near it, and the forces on each
//! body at rest, contacts and gravity, would accelerate it by less than that. The step is then made with its bodies as
//! if pinned. Near is what a bounding sphere overlaps that is widened by twice the way of the step: a body that is thrown
//! farther than that by a force within one step meets pinned bodies in it, and wakes them at the next.
//!
//! # Limits
//! A motion slower than both thresholds is stopped: a slow slide without friction, the last swings of a pendulum.

use crate::body::Body;
use crate::contact::Contact;
use crate::forces::{Evaluation, Moment, SlipMotion};
use crate::integrator::verlet::VerletScratch;
use crate::state::Motion;
use crate::step::{Stop, advance_whole};
use crate::wrench::Velocity;
use crate::{Model, Scratch, State, broad};
use geometry::{Circle, Vec3, rotation};
use schemas::scene::Sleep;
use schemas::state::{BodyState, ContactState};

/// Moving bodies up to which looking at each of them with all that rest is cheapest.
const FEW: usize = 16;

/// What is known of the sleeping bodies.
pub(crate) struct Asleep {
    /// Which bodies sleep.
    bodies: Vec<bool>,
    /// All bodies when that was found out.
    at: Vec<BodyState>,
    /// Friction's springs between them, and between them and what is fixed.
    springs: Vec<ContactState>,
    /// The model with the sleepers pinned.
    model: Model,
    /// Free bodies that do not sleep.
    awake: usize,
    /// Candidate pairs that are not looked at.
    pub candidate_pairs: u64,
    /// Contacts that are not looked at, in order.
    pub contacts: Vec<(u32, u32, Contact)>,
    /// Energy in their normal springs (J).
    pub energy: f64,
}

/// Advances all bodies by one step, the sleeping ones not at all; step number and time are the caller's. Returns
/// whether all numbers were seen to be finite already.
pub(crate) fn advance(
    model: &Model,
    limits: &Sleep,
    state: &mut State,
    scratch: &mut Scratch,
) -> Result<bool, Stop> {
    let known = scratch.asleep.take().filter(|asleep| asleep.holds(model, state));
    let asleep = known.unwrap_or_else(|| Box::new(Asleep::find(model, limits, state, scratch)));
    let mut finite = true;
    if asleep.awake > 0 {
        let before = state.bodies.clone();
        finite = advance_whole(&asleep.model, state, scratch)?;
        for ((body, before), _) in state.bodies.iter_mut().zip(&before).zip(&asleep.bodies).filter(|x| *x.1) {
            *body = *before;
        }
        state.contacts.extend_from_slice(&asleep.springs);
        state.contacts.sort_by_key(|contact| (contact.body_a, contact.body_b, contact.arc));
        asleep.put_to_rest(limits, &before, state, scratch);
    } else {
        scratch.evaluation_age_s = 0.0;
    }
    scratch.asleep = Some(asleep);
    Ok(finite)
}

impl Asleep {
    /// Whether it is still those that sleep.
    fn holds(&self, model: &Model, state: &State) -> bool {
        let same = |index: usize, body: &BodyState| {
            let asleep = self.bodies[index];
            let still = !model.bodies()[index].pinned && is_still(body);
            still == asleep && (!asleep || *body == self.at[index])
        };
        if !state.bodies.iter().enumerate().all(|(index, body)| same(index, body)) {
            return false;
        }
        let resting = state.contacts.iter().filter(|contact| self.rests(contact.body_a, contact.body_b));
        if !resting.eq(&self.springs) {
            return false;
        }
        met(model, &state.bodies, &self.bodies).is_empty()
    }

    fn resting_count(&self) -> usize {
        self.bodies.iter().filter(|asleep| **asleep).count()
    }

    /// Whether neither body of a pair moves, and one of them sleeps.
    fn rests(&self, a: u32, b: u32) -> bool {
        let sleeps = |body: u32| self.bodies.get(body as usize).copied().unwrap_or(false);
        let fixed = |body: u32| self.model.bodies().get(body as usize).is_none_or(|b| b.pinned && !b.driven);
        (sleeps(a) || sleeps(b)) && fixed(a) && fixed(b)
    }

    /// Finds out who sleeps, and makes the scratch ready for those who do not.
    fn find(model: &Model, limits: &Sleep, state: &State, scratch: &mut Scratch) -> Asleep {
        let moment = &mut scratch.moment;
        for (index, (body, pose)) in model.bodies().iter().zip(&state.bodies).enumerate() {
            moment.circles[index] = circle(body, pose);
            let motion = Motion::of(pose);
            moment.velocities[index] = Velocity { linear: motion.linear, angular: motion.angular };
        }
        moment.random = model.random_of_step(state.step);
        let bodies = model.bodies();
        let mut quiet: Vec<bool> =
            bodies.iter().zip(&state.bodies).map(|(body, pose)| !body.pinned && is_still(pose)).collect();
        let mut all = Evaluation::new(model);
        if quiet.iter().any(|still| *still) {
            let still = moment.velocities.as_slice();
            let slip = SlipMotion { since: (still, 0.0), kept: (still, 0.0) };
            all.evaluate(model, moment, &state.contacts, slip, scratch.pool.as_deref());
            for (index, quiet) in quiet.iter_mut().enumerate().filter(|(_, quiet)| **quiet) {
                let (body, wrench) = (&bodies[index], &all.wrenches[index]);
                let linear = wrench.force * body.inverse_mass + model.gravity();
                let zero = Vec3::zeros();
                let angular = body.angular_acceleration(&moment.circles[index], &zero, &wrench.torque);
                // A force that is no number lets nobody sleep.
                *quiet = surface(body, &linear, &angular) <= limits.acceleration_m_per_s2;
            }
            for body in met(model, &state.bodies, &quiet) {
                quiet[body] = false;
            }
            spread(model, &all, moment, &mut quiet);
        }
        let mut asleep = Asleep {
            awake: bodies.iter().zip(&quiet).filter(|(body, asleep)| !body.pinned && !**asleep).count(),
            model: model.with_pins(&quiet),
            bodies: quiet,
            at: state.bodies.clone(),
            springs: Vec::new(),
            candidate_pairs: 0,
            contacts: Vec::new(),
            energy: 0.0,
        };
        let springs = state.contacts.iter().filter(|contact| asleep.rests(contact.body_a, contact.body_b));
        asleep.springs = springs.copied().collect();
        asleep.count(model, &all, moment);
        let count = scratch.evaluation.count + all.count;
        scratch.evaluation = Evaluation::new(model);
        scratch.evaluation.count = count;
        scratch.verlet = VerletScratch::of(&asleep.model);
        scratch.parts.clear();
        asleep
    }

    /// What the record is told of the contacts at rest.
    fn count(&mut self, model: &Model, all: &Evaluation, moment: &Moment) {
        if self.resting_count() == 0 {
            return;
        }
        let pairs = all.candidates(model, moment).filter(|&&(a, b)| self.rests(a, b));
        self.candidate_pairs = pairs.count() as u64;
        let mut contacts = all.contacts(moment);
        contacts.retain(|&(a, b, _)| self.rests(a, b));
        self.contacts = contacts;
        let arcs = all.arc_forces().filter(|arc| self.rests(arc.a, arc.b)).map(|arc| arc.energy());
        let pairs = all.pair_forces().filter(|pair| self.rests(pair.a, pair.b)).map(|pair| pair.energy);
        self.energy = arcs.chain(pairs).sum();
    }

    /// Stops the islands that have come to rest in a step that started at `before`.
    fn put_to_rest(&self, limits: &Sleep, before: &[BodyState], state: &mut State, scratch: &mut Scratch) {
        let model = &self.model;
        let change = limits.acceleration_m_per_s2 * model.time().time_step_s;
        let mut quiet = vec![false; before.len()];
        for (index, body) in model.bodies().iter().enumerate() {
            let (now, then) = (Motion::of(&state.bodies[index]), Motion::of(&before[index]));
            let (linear, angular) = (now.linear - then.linear, now.angular - then.angular);
            quiet[index] = self.bodies[index]
                || !body.pinned
                    && surface(body, &now.linear, &now.angular) <= limits.speed_m_per_s
                    && surface(body, &linear, &angular) <= change;
        }
        if !quiet.iter().zip(&self.bodies).any(|(quiet, asleep)| *quiet && !asleep) {
            return;
        }
        let Scratch { evaluation, moment, .. } = scratch;
        for (index, body) in state.bodies.iter().enumerate().filter(|(index, _)| !self.bodies[*index]) {
            moment.circles[index] = circle(&model.bodies()[index], body);
        }
        evaluation.neighbours.update(model, &moment.circles);
        spread(model, evaluation, moment, &mut quiet);
        for (index, body) in state.bodies.iter_mut().enumerate() {
            if quiet[index] && !self.bodies[index] {
                let (of, motion) = (&model.bodies()[index], Motion::of(body));
                let (u, w, normal) = rotation::axes(&motion.orientation);
                let [i1, i2, i3] = of.inertia_kg_m2;
                let (push, spin) = (motion.linear * of.mass_kg, &motion.angular);
                let turn = u * (i1 * u.dot(spin)) + w * (i2 * w.dot(spin)) + normal * (i3 * normal.dot(spin));
                // For the momentum audit.
                scratch.impulse.linear -= push;
                scratch.impulse.angular -= motion.position.cross(&push) + turn;
                state.dissipated_energy_j += 0.5 * of.mass_kg * motion.linear.norm_squared()
                    + of.rotational_energy((&u, &w, &normal), &motion.angular);
                body.linear_velocity_m_per_s = [0.0; 3];
                body.angular_velocity_rad_per_s = [0.0; 3];
            }
        }
    }
}

/// Which of the bodies at rest a moving one may touch within the step: those that it overlaps with a bounding sphere
/// widened by twice its way and a fiftieth of its radius.
fn met(model: &Model, bodies: &[BodyState], rests: &[bool]) -> Vec<usize> {
    let moves = |body: usize| {
        let of = &model.bodies()[body];
        !rests[body] && (of.driven || !of.pinned)
    };
    let movers: Vec<usize> = (0..bodies.len()).filter(|&body| moves(body)).collect();
    let mut found = Vec::new();
    if movers.is_empty() || !rests.iter().any(|rests| *rests) {
        return found;
    }
    let centre = |body: usize| Vec3::from(bodies[body].position_m);
    let reach = |body: usize| {
        let (of, motion) = (&model.bodies()[body], Motion::of(&bodies[body]));
        let way = surface(of, &motion.linear, &motion.angular) * model.time().time_step_s;
        of.bounding_radius + if rests[body] { 0.0 } else { 2.0 * way + 0.02 * of.bounding_radius }
    };
    if movers.len() <= FEW {
        let widened: Vec<(Vec3, f64)> = movers.iter().map(|&mover| (centre(mover), reach(mover))).collect();
        let near = |body: usize, (at, radius): &(Vec3, f64)| {
            let both = model.bodies()[body].bounding_radius + radius;
            (centre(body) - at).norm_squared() < both * both
        };
        let resting = (0..bodies.len()).filter(|&body| rests[body]);
        found.extend(resting.filter(|&body| widened.iter().any(|mover| near(body, mover))));
        return found;
    }
    let centres: Vec<Vec3> = (0..bodies.len()).map(centre).collect();
    let radii: Vec<f64> = (0..bodies.len()).map(reach).collect();
    let mut pairs = Vec::new();
    broad::find_pairs(
        model.broad_phase(),
        &centres,
        &radii,
        0.0,
        &mut broad::Workspace::default(),
        &mut pairs,
    );
    for (a, b) in pairs {
        let (a, b) = (a as usize, b as usize);
        if rests[a] && moves(b) {
            found.push(a);
        } else if rests[b] && moves(a) {
            found.push(b);
        }
    }
    found
}

/// Leaves only whole islands quiet: those without a body that is not, and without a driven one near.
fn spread(model: &Model, evaluation: &Evaluation, moment: &Moment, quiet: &mut [bool]) {
    let mut parent: Vec<u32> = (0..quiet.len() as u32).collect();
    fn root(parent: &mut [u32], mut body: u32) -> u32 {
        while parent[body as usize] != body {
            parent[body as usize] = parent[parent[body as usize] as usize];
            body = parent[body as usize];
        }
        body
    }
    let free = |body: u32, quiet: &[bool]| {
        model.bodies().get(body as usize).is_some_and(|free| !free.pinned || quiet[body as usize])
    };
    for &(a, b) in evaluation.candidates(model, moment) {
        if free(a, quiet) && free(b, quiet) {
            let (a, b) = (root(&mut parent, a), root(&mut parent, b));
            // The lower number stands for both, whatever the order of the pairs.
            let (low, high) = if a < b { (a, b) } else { (b, a) };
            parent[high as usize] = low;
        }
    }
    let mut restless = vec![false; quiet.len()];
    for body in 0..quiet.len() {
        if free(body as u32, quiet) && (!quiet[body] || near_driven(model, moment, body)) {
            restless[root(&mut parent, body as u32) as usize] = true;
        }
    }
    for body in 0..quiet.len() {
        quiet[body] = quiet[body] && !restless[root(&mut parent, body as u32) as usize];
    }
}

/// Whether a body on a prescribed motion is near another.
fn near_driven(model: &Model, moment: &Moment, body: usize) -> bool {
    model.driven().iter().any(|driven| model.near(&moment.circles, body as u32, driven.body))
}

fn circle(body: &Body, pose: &BodyState) -> Circle {
    let motion = Motion::of(pose);
    Circle::from_pose(motion.position, &motion.orientation, body.major_radius)
}

/// Velocities of exactly zero.
fn is_still(body: &BodyState) -> bool {
    body.linear_velocity_m_per_s == [0.0; 3] && body.angular_velocity_rad_per_s == [0.0; 3]
}

/// The largest speed of a point of a body, or more; or acceleration.
fn surface(body: &Body, linear: &Vec3, angular: &Vec3) -> f64 {
    linear.norm_squared().sqrt() + body.bounding_radius * angular.norm_squared().sqrt()
}

//! Drift, kick, drift: the exact free motion of symmetric tops for half a step, all forces at once for a
//! whole step, free motion for the other half.
//!
//! The one thing to know: forces are evaluated once, at the middle of the step, so nothing is carried from
//! step to step but the state. Second order; symplectic and reversible without damping and friction.
//!
//! # Free motion
//! A symmetric top keeps its angular momentum `L` and its spin `w3` about its axis `n`; its angular velocity
//! is `L / I1 + w3 (1 - I3 / I1) n`. The first part turns the whole body, the second turns it about its own
//! axis: `q <- exp(t L / I1) q exp(t w3 (1 - I3 / I1) e3)`, exact for any spin and any time.
//!
//! # Kick
//! Gravity and linear drag are solved exactly with the contact force held constant (see `body::Decay`), for
//! rotation along each principal axis. Friction is evaluated with the velocities before the kick; damping
//! with a rate that damping itself has slowed (see `contact`). Both are first order in the step.
//!
//! # Order of work
//! Two passes over the bodies, one before and one after the forces, each cut into chunks of a fixed size
//! that any thread may take, and into blocks of bodies side by side (see `lanes`). Sums over bodies are made
//! chunk by chunk and then added up in order, so that the number of threads reaches no bit.

use super::asymmetric;
use super::kick::{Kicks, Sums};
use super::lanes::{
    Bodies, Chunk, Classes, Constants, LANES, Lane3, ZERO, get, normal, on_threads, set, turn, whole,
};
use crate::contact::kernel::MotionLine;
use crate::forces::{Evaluation, SlipMotion};
use crate::wrench::Velocity;
use crate::{Model, Scratch, State, motion};
use bytemuck::Zeroable;
use geometry::Circle;
use geometry::lanes::Line;
use nalgebra::{Quaternion, UnitQuaternion};
use schemas::scene::Integrator;
use schemas::state::BodyState;

/// Blocks in a chunk: what one thread takes at a time, and what sums are made over first.
const CHUNK_BLOCKS: usize = 16;
const CHUNK_BODIES: usize = CHUNK_BLOCKS * LANES;

/// Working memory of this integrator; empty with another.
#[derive(Debug, Default)]
pub(crate) struct VerletScratch {
    classes: Classes,
    /// Orientations in the middle of the step.
    pub(super) orientations: Vec<UnitQuaternion<f64>>,
    sums: Vec<Sums>,
}

impl VerletScratch {
    /// The memory that a model's steps need: none with another integrator.
    pub(crate) fn of(model: &Model) -> VerletScratch {
        if model.integrator() != Integrator::Verlet {
            return VerletScratch::default();
        }
        let tops = &model.bodies()[..model.top_count()];
        VerletScratch {
            classes: Classes::new(tops, 0.5 * model.time().time_step_s),
            orientations: vec![UnitQuaternion::identity(); model.body_count()],
            sums: vec![Sums::default(); tops.len().div_ceil(CHUNK_BODIES)],
        }
    }
}

/// Advances all bodies and contacts by one step; step number and time are the caller's. True if all numbers
/// of the state were seen to be finite.
pub(crate) fn advance(model: &Model, state: &mut State, scratch: &mut Scratch) -> bool {
    let time_step = model.time().time_step_s;
    drift_to_middle(model, state, scratch);
    asymmetric::drift_to_middle(model, state, scratch, 0.5 * time_step);
    motion::place(model, state.sim_time_s + 0.5 * time_step, &mut scratch.moment);
    let driven = model.driven().iter().map(|driven| driven.body as usize);
    scratch.evaluation.take(&scratch.moment, driven.chain(model.top_count()..model.body_count()));
    let velocities = scratch.moment.velocities.as_slice();
    // The velocity before the kick is the velocity between the last evaluation and this one.
    let slip = SlipMotion { since: (velocities, time_step), kept: (velocities, time_step) };
    let pool = scratch.pool.as_deref();
    scratch.evaluation.evaluate(model, &scratch.moment, &state.contacts, slip, pool);
    scratch.evaluation_age_s = 0.5 * time_step;
    scratch.keep_springs(&mut state.contacts);
    let (drive, lost) = motion::power(model, &scratch.moment, &scratch.evaluation);
    scratch.drive_work_j = drive * time_step;
    state.dissipated_energy_j += lost * time_step;
    kick_and_drift(model, state, scratch);
    let sums = &scratch.verlet.sums;
    state.dissipated_energy_j += sums.iter().map(|sums| sums.lost).sum::<f64>();
    let loses = Evaluation::loses(model);
    state.dissipated_energy_j += asymmetric::kick_and_drift(model, state, scratch, loses);
    model.top_count() == model.body_count() && !scratch.verlet.sums.iter().any(|sums| sums.broken)
}

/// Free motion of the tops from the state to the middle of the step, into the scratch.
fn drift_to_middle(model: &Model, state: &State, scratch: &mut Scratch) {
    let Scratch { evaluation, moment, verlet, pool, level, .. } = scratch;
    let lines = evaluation.lines.chunks_mut(CHUNK_BODIES);
    let mut motions = evaluation.motions.chunks_mut(CHUNK_BODIES);
    let loses = Evaluation::loses(model);
    let circles = moment.circles.chunks_mut(CHUNK_BODIES);
    let velocities = moment.velocities.chunks_mut(CHUNK_BODIES);
    let orientations = verlet.orientations.chunks_mut(CHUNK_BODIES);
    let classes = &verlet.classes;
    let tops = &state.bodies[..model.top_count()];
    let chunks = tops.chunks(CHUNK_BODIES).zip(circles).zip(velocities).zip(orientations).zip(lines);
    let drifts =
        chunks.enumerate().map(|(chunk, ((((bodies, circles), velocities), orientations), lines))| {
            let first_block = chunk * CHUNK_BLOCKS;
            let motions = motions.next().filter(|_| loses);
            Drift { first_block, classes, bodies, circles, velocities, orientations, lines, motions }
        });
    on_threads(pool.as_deref(), *level, drifts);
}

/// The kick and the second drift of the tops, from the scratch to the state.
fn kick_and_drift(model: &Model, state: &mut State, scratch: &mut Scratch) {
    let Scratch { evaluation, moment, verlet, pool, level, .. } = scratch;
    let VerletScratch { classes, orientations, sums } = verlet;
    let loses = Evaluation::loses(model);
    let tops = &mut state.bodies[..model.top_count()];
    let chunks = tops.chunks_mut(CHUNK_BODIES).zip(sums).enumerate();
    let kicks = chunks.map(|(chunk, (bodies, sums))| {
        let own = chunk * CHUNK_BODIES..chunk * CHUNK_BODIES + bodies.len();
        Kicks {
            model,
            first_block: chunk * CHUNK_BLOCKS,
            classes,
            circles: &moment.circles[own.clone()],
            velocities: &moment.velocities[own.clone()],
            orientations: &orientations[own.clone()],
            wrenches: &evaluation.wrenches[own.clone()],
            lost: loses.then(|| &evaluation.lost[own]),
            bodies,
            sums,
        }
    });
    on_threads(pool.as_deref(), *level, kicks);
}

/// Free motion of a chunk from the state to the middle of the step, into the scratch.
struct Drift<'a> {
    first_block: usize,
    classes: &'a Classes,
    bodies: &'a [BodyState],
    circles: &'a mut [Circle],
    velocities: &'a mut [Velocity],
    orientations: &'a mut [UnitQuaternion<f64>],
    /// The same for the kernel, with velocities where there is damping.
    lines: &'a mut [Line],
    motions: Option<&'a mut [MotionLine]>,
}

impl Chunk for Drift<'_> {
    #[inline(always)]
    fn work(self) {
        let circles = self.circles.chunks_mut(LANES);
        let velocities = self.velocities.chunks_mut(LANES);
        let orientations = self.orientations.chunks_mut(LANES);
        let lines = self.lines.chunks_mut(LANES);
        let mut motions = self.motions.map(|motions| motions.chunks_mut(LANES));
        let blocks = self.bodies.chunks(LANES).zip(circles).zip(velocities).zip(orientations).zip(lines);
        for (index, ((((bodies, circles), velocities), orientations), lines)) in blocks.enumerate() {
            let constants = self.classes.of(self.first_block + index);
            let mut bodies = Bodies::load(whole(bodies, BodyState::zeroed(), &mut None));
            let angular = drift(constants, &mut bodies);
            let out = circles.iter_mut().zip(velocities.iter_mut()).zip(orientations).zip(lines);
            for (lane, (((circle, velocity), orientation), line)) in (0..LANES).zip(out) {
                let [i, j, k, w] = &bodies.orientation;
                let q = Quaternion::new(w[lane], i[lane], j[lane], k[lane]);
                *orientation = UnitQuaternion::new_unchecked(q);
                let centre = get(&bodies.position, lane);
                *circle = Circle::from_pose(centre, orientation, constants.major_radius[lane]);
                *velocity = Velocity { linear: get(&bodies.linear, lane), angular: get(&angular, lane) };
                line.take(circle);
            }
            if let Some(motions) = motions.as_mut().and_then(Iterator::next) {
                motions.iter_mut().zip(velocities).for_each(|(motion, velocity)| motion.take(velocity));
            }
        }
    }
}

/// Half a step of free motion; returns the angular velocity after it.
#[allow(clippy::needless_range_loop)] // As in `lanes`.
#[inline(always)]
fn drift(constants: &Constants, bodies: &mut Bodies) -> Lane3 {
    let (mut precession, mut spin, mut angular) = ([ZERO; 3], ZERO, [ZERO; 3]);
    for lane in 0..LANES {
        let (axis, turning) = (normal(&bodies.orientation, lane), get(&bodies.angular, lane));
        spin[lane] = turning.dot(&axis) * constants.spin_share[lane];
        set(&mut precession, lane, turning - axis * spin[lane]);
        let moved = get(&bodies.position, lane) + get(&bodies.linear, lane) * constants.half_time[lane];
        set(&mut bodies.position, lane, moved);
    }
    turn(&mut bodies.orientation, &precession, &spin, &constants.half_time);
    for lane in 0..LANES {
        let axis = normal(&bodies.orientation, lane);
        set(&mut angular, lane, get(&precession, lane) + axis * spin[lane]);
    }
    angular
}

#[cfg(test)]
mod tests {
    use crate::{Model, Scratch, State, step};
    use geometry::lanes::Level;
    use schemas::scene::Scene;

    /// With the processor's vector instructions and without: the same bits, slow and fast spins side by side.
    #[test]
    fn vector_instructions_reach_no_bit() {
        let text = include_str!("../../../scenes/ball.toml");
        let near = [
            "sphere.0.position_m=[0.0, -0.3, -1.0]".to_owned(),
            "forces.linear_drag_kg_per_s=0.1".to_owned(),
            "forces.angular_drag_kg_m2_per_s=0.01".to_owned(),
        ];
        let (model, _) = Model::compile(&Scene::parse(text, &near).unwrap()).unwrap();
        let run = |level: Level| {
            let mut state = State::initial(&model);
            for (index, body) in state.bodies.iter_mut().enumerate().step_by(5) {
                body.angular_velocity_rad_per_s[2] = [40.0, 4e3, 4e4][index % 3];
            }
            let mut scratch = Scratch::new(&model, 1);
            scratch.level = level;
            for _ in 0..500 {
                step(&model, &mut state, &mut scratch).unwrap();
            }
            state
        };
        assert!(model.body_count() % super::LANES != 0, "the last block is not full");
        assert_eq!(run(Level::new()), run(Level::baseline()));
    }
}

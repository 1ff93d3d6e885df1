//! One step, and what can stop a run.

use crate::forces::SlipMotion;
use crate::integrator::{dopri5, implicit, rk4, verlet};
use crate::model::BodyName;
use crate::momentum::{self, Impulse};
use crate::state::Motion;
use crate::subdivide::advance_in_parts;
use crate::team::in_pool;
use crate::{Model, Scratch, State, drag, motion, sleep, wrench::Velocity};
use geometry::Circle;
use schemas::scene::{Integrator, OnRisk};
use schemas::state::BodyState;

/// Why a run cannot go on. The state is left as it was when this was noticed.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum Stop {
    /// A number of the state is NaN or infinite.
    #[error("step {step}: {field} of {body} is {value}, not a finite number")]
    NonFinite {
        /// The step that made it.
        step: u64,
        /// Whose number it is.
        body: BodyName,
        /// Its name in the state.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// Rings that were linked at the start are not any more: one has passed through another.
    #[error(
        "step {step}: {a} and {b} were linked at the start and are not any more (links left: {intact} of \
         {links}); take a smaller time.time_step_s or a stiffer material"
    )]
    LinkBroken {
        /// The step of the audit.
        step: u64,
        /// One ring of the first broken pair.
        a: BodyName,
        /// The other.
        b: BodyName,
        /// Links that are left.
        intact: u64,
        /// Links at the start.
        links: u64,
    },
    /// An implicit method finds no solution in any part of the step.
    #[error(
        "step {step}: the implicit equations have no solution that is found, down to parts of {part_s:e} s; \
         take a smaller time.time_step_s, or another method.integrator"
    )]
    NoSolution {
        /// The step.
        step: u64,
        /// The shortest part that was tried (s).
        part_s: f64,
    },
    /// `dopri5` cannot reach its tolerance with any inner step.
    #[error(
        "step {step}: an inner step of {inner_step_s:e} s still has {error:.3e} times the error that is \
         tolerated; take a larger method.tolerance or method.absolute_tolerance"
    )]
    Tolerance {
        /// The step.
        step: u64,
        /// The shortest inner step that was tried (s).
        inner_step_s: f64,
        /// Its error over the tolerated one.
        error: f64,
    },
    /// Momentum changed by more than all forces together and rounding explain: a fault of the program or the machine.
    #[error(
        "step {step}: {gained:.3e} {what} came from nowhere: gravity, drag, pinned and driven bodies and planes did not \
         give it, and rounding explains at most {allowed:.3e}; this is a fault of the program or of the machine, not of the \
         scene: see whether `chainmail verify` makes the same states from the log, and report it"
    )]
    MomentumGained {
        /// The step.
        step: u64,
        /// Unit and quantity: momentum or angular momentum.
        what: &'static str,
        /// What is not explained, in that unit.
        gained: f64,
        /// What rounding explains at most.
        allowed: f64,
    },
    /// More energy is there than can be: the time step is too long for what happens.
    #[error(
        "step {step}: {gained_j:.3e} J of energy came from nowhere, more than {share} of all that the motion \
         had ({scale_j:.3e} J){deepest}; take a smaller time.time_step_s or a softer material"
    )]
    EnergyGained {
        /// The step.
        step: u64,
        /// Mechanical energy and energy lost, less the energy at the start (J).
        gained_j: f64,
        /// The largest share of `scale_j` that is accepted.
        share: f64,
        /// The largest sum so far of kinetic energy, contact energy and change of gravity's (J).
        scale_j: f64,
        /// Where it may come from: the deepest contact of the step, in words; empty without one.
        deepest: String,
    },
}

/// Advances a state by one time step.
///
/// # Errors
///
/// [`Stop::NonFinite`] names step, body and field; nothing is repaired. [`Stop::Tolerance`] with `dopri5`.
///
/// # Panics
///
/// If the state or the scratch was made for a model with another number of bodies.
pub fn step(model: &Model, state: &mut State, scratch: &mut Scratch) -> Result<(), Stop> {
    assert_eq!(state.bodies.len(), model.body_count(), "bodies of the state and of the model");
    assert_eq!(scratch.moment.circles.len(), model.body_count(), "bodies of the scratch and of the model");
    scratch.moment.random = model.random_of_step(state.step);
    scratch.drive_work_j = 0.0;
    scratch.impulse = Impulse::ZERO;
    scratch.with_torque = momentum::is_angular(model, state.step + 1);
    let finite = match &model.method().sleep {
        None => advance_whole(model, state, scratch)?,
        Some(limits) => sleep::advance(model, limits, state, scratch)?,
    };
    state.step += 1;
    state.sim_time_s = state.step as f64 * model.time().time_step_s;
    state.dissipated_energy_j += 0.0;
    motion::store(model, state.sim_time_s, &mut state.bodies);
    if finite { Ok(()) } else { check_finite(model, state) }
}

/// One step, in parts where the scene asks for it; step number and time are the caller's. Returns whether all numbers
/// were seen to be finite already.
pub(crate) fn advance_whole(model: &Model, state: &mut State, scratch: &mut Scratch) -> Result<bool, Stop> {
    let in_parts = model.method().on_risk == OnRisk::Subdivide && model.integrator() != Integrator::Dopri5;
    if in_parts { advance_in_parts(model, state, scratch) } else { advance(model, state, scratch) }
}

/// One step of the model's length; step number and time are the caller's. Returns whether all numbers were seen
/// to be finite already.
pub(crate) fn advance(model: &Model, state: &mut State, scratch: &mut Scratch) -> Result<bool, Stop> {
    let pool = scratch.pool.clone();
    let pool = pool.as_deref();
    match model.integrator() {
        // Only these have so much to share that others had better stay awake all the time.
        Integrator::Verlet => Ok(in_pool(pool, || advance_verlet(model, state, scratch))),
        Integrator::Rk4 => {
            in_pool(pool, || rk4::advance(model, state, scratch));
            Ok(false)
        }
        Integrator::Dopri5 => in_pool(pool, || dopri5::advance(model, state, scratch)).map(|()| false),
        Integrator::BackwardEuler | Integrator::EnergyDecaying => {
            implicit::advance(model, state, scratch).map(|()| false)
        }
    }
}

/// A step of `verlet`, between two half steps of quadratic drag where there is any. Returns whether all
/// numbers are finite.
fn advance_verlet(model: &Model, state: &mut State, scratch: &mut Scratch) -> bool {
    slow(model, state, scratch);
    let finite = verlet::advance(model, state, scratch);
    let given = Impulse::of_kick(model, &scratch.moment, &scratch.evaluation, scratch.with_torque);
    scratch.impulse.add(&given, 1.0);
    slow(model, state, scratch);
    finite
}

/// Half a step of quadratic drag, where there is any.
fn slow(model: &Model, state: &mut State, scratch: &mut Scratch) {
    if model.features.quadratic_drag {
        let before = momentum::linear(model, state);
        state.dissipated_energy_j += drag::slow(model, state, 0.5 * model.time().time_step_s);
        scratch.impulse.linear += momentum::linear(model, state) - before;
    }
}

/// Evaluates the contact forces at a state without moving it, so that the state can be recorded: needed for
/// the first state of a run, for which no step has made them.
pub fn evaluate(model: &Model, state: &State, scratch: &mut Scratch) {
    scratch.wake(model);
    for (index, (body, pose)) in model.bodies().iter().zip(&state.bodies).enumerate() {
        let motion = Motion::of(pose);
        scratch.moment.circles[index] =
            Circle::from_pose(motion.position, &motion.orientation, body.major_radius);
        scratch.moment.velocities[index] = Velocity { linear: motion.linear, angular: motion.angular };
    }
    scratch.moment.random = model.random_of_step(state.step);
    let velocities = scratch.moment.velocities.as_slice();
    let slip = SlipMotion { since: (velocities, 0.0), kept: (velocities, 0.0) };
    let pool = scratch.pool.as_deref();
    scratch.evaluation.evaluate(model, &scratch.moment, &state.contacts, slip, pool);
    scratch.evaluation_age_s = 0.0;
    scratch.drive_work_j = 0.0;
}

pub(crate) fn check_finite(model: &Model, state: &State) -> Result<(), Stop> {
    for (index, body) in state.bodies.iter().enumerate() {
        let numbers: &[f64; 13] = bytemuck::cast_ref(body);
        // A sum is finite only if all its parts are (and it may overflow where they are: looked at below).
        let sum: f64 = numbers.iter().sum();
        if !sum.is_finite() {
            find_non_finite(model, state.step, index, body)?;
        }
    }
    Ok(())
}

#[cold]
fn find_non_finite(model: &Model, step: u64, index: usize, body: &BodyState) -> Result<(), Stop> {
    let fields: [(&'static str, &[f64]); 4] = [
        ("position_m", &body.position_m),
        ("orientation", &body.orientation),
        ("linear_velocity_m_per_s", &body.linear_velocity_m_per_s),
        ("angular_velocity_rad_per_s", &body.angular_velocity_rad_per_s),
    ];
    for (field, values) in fields {
        if let Some(&value) = values.iter().find(|value| !value.is_finite()) {
            return Err(Stop::NonFinite { step, body: model.body_name(index as u32), field, value });
        }
    }
    Ok(())
}

//! The state: everything that the next step needs, and nothing else.

use crate::Model;
use geometry::Vec3;
use nalgebra::{Quaternion, UnitQuaternion};
use schemas::Hash;
use schemas::state::{BodyState, ContactState, StateHeader, StateMessage};

/// The state of a run after a step. Two equal states go on with equal bits, whatever came before them.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Steps done; the initial state is step 0.
    pub step: u64,
    /// Simulated time in seconds: `step * time_step`, never a running sum.
    pub sim_time_s: f64,
    /// Mechanical energy taken out by damping, friction and drag since step 0 (J). Energy in friction's
    /// springs counts as taken out until they give it back.
    pub dissipated_energy_j: f64,
    /// Poses and velocities: rings, then spheres, each in scene order.
    pub bodies: Vec<BodyState>,
    /// What friction remembers, ordered by (`body_a`, `body_b`, `arc`); empty without friction.
    pub contacts: Vec<ContactState>,
}

/// A state that does not belong to the model it was given with.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("the state of step {step} has {found} bodies, but the scene has {expected}")]
pub struct StateMismatch {
    /// The state's step.
    pub step: u64,
    /// Bodies in the state.
    pub found: usize,
    /// Bodies in the scene.
    pub expected: usize,
}

impl State {
    /// The state before the first step.
    pub fn initial(model: &Model) -> State {
        State {
            step: 0,
            sim_time_s: 0.0,
            dissipated_energy_j: 0.0,
            bodies: model.initial_bodies().to_vec(),
            contacts: Vec::new(),
        }
    }

    /// The state that a message holds.
    ///
    /// # Errors
    ///
    /// [`StateMismatch`] if the model has another number of bodies.
    pub fn from_message(model: &Model, message: StateMessage) -> Result<State, StateMismatch> {
        let StateMessage { header, bodies, contacts } = message;
        let (found, expected) = (bodies.len(), model.body_count());
        if found != expected {
            return Err(StateMismatch { step: header.step, found, expected });
        }
        Ok(State {
            step: header.step,
            sim_time_s: header.sim_time_s,
            dissipated_energy_j: header.dissipated_energy_j,
            bodies,
            contacts,
        })
    }

    /// The header of the state's message; its hash is still to be computed by [`schemas::state::encode`].
    pub fn header(&self) -> StateHeader {
        StateHeader {
            step: self.step,
            sim_time_s: self.sim_time_s,
            dissipated_energy_j: self.dissipated_energy_j,
            state_hash: Hash::default(),
        }
    }
}

/// Pose and velocity of a body as vectors, World axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    pub position: Vec3,
    pub orientation: UnitQuaternion<f64>,
    pub linear: Vec3,
    pub angular: Vec3,
}

impl Motion {
    #[inline]
    pub(crate) fn of(body: &BodyState) -> Motion {
        let [x, y, z, w] = body.orientation;
        Motion {
            position: Vec3::from(body.position_m),
            orientation: UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
            linear: Vec3::from(body.linear_velocity_m_per_s),
            angular: Vec3::from(body.angular_velocity_rad_per_s),
        }
    }

    /// The body state, without negative zeros: a sign without meaning must not reach a hash.
    #[inline]
    pub(crate) fn store(&self, body: &mut BodyState) {
        let zero = Vec3::zeros();
        body.position_m = (self.position + zero).into();
        let q = self.orientation.quaternion();
        body.orientation = [q.i + 0.0, q.j + 0.0, q.k + 0.0, q.w + 0.0];
        body.linear_velocity_m_per_s = (self.linear + zero).into();
        body.angular_velocity_rad_per_s = (self.angular + zero).into();
    }
}

/// The same rotation with its quaternion's length brought back to 1: one Newton step towards
/// `1 / sqrt(n)`, exact to rounding for a length that is off by rounding.
#[inline]
pub(crate) fn renormalised(q: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let q = q.into_inner();
    let scale = 1.5 - 0.5 * q.norm_squared();
    UnitQuaternion::new_unchecked(q * scale)
}

//! Why a scene that reads well cannot be simulated.

use crate::BodyName;
use geometry::polynomial::SolidError;

/// A scene that reads well and cannot be simulated.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum ModelError {
    /// Two bodies overlap at the start: their contact would fling them apart.
    #[error(
        "{a} and {b} overlap at the start: their gap is {gap_m:e} m, expected 0 or more; move one of them, \
         or make it smaller"
    )]
    Overlap {
        /// One body.
        a: BodyName,
        /// The other.
        b: BodyName,
        /// Their gap (m); negative.
        gap_m: f64,
    },
    /// The time step is too long for the stiffest contact, for drag or for spin.
    #[error(
        "time.time_step_s = {time_step_s:e}: expected at most {largest_s:e} s, the bound set by {cause}; \
         take a smaller step (or \"auto\"), a softer material, method.on_risk = \"subdivide\", or, where wires press \
         little into each other, state how little in method.stability_penetration"
    )]
    TimeStep {
        /// The step as given (s).
        time_step_s: f64,
        /// The largest step that is accepted (s).
        largest_s: f64,
        /// What sets the bound.
        cause: String,
    },
    /// A formula that is not that of a body.
    #[error("{body}: {cause}")]
    Surface {
        /// The body.
        body: BodyName,
        /// What is wrong with it.
        cause: SolidError,
    },
    /// Two bodies that could meet, without a law of contact for their shapes.
    #[error("{a} and {b} could meet, and {reason}; pin {pins}, or leave one of them out")]
    Shapes {
        /// One body.
        a: BodyName,
        /// The other.
        b: BodyName,
        /// Why there is none.
        reason: &'static str,
        /// Which of them to pin.
        pins: &'static str,
    },
    /// A contact law that has no answer for a shape.
    #[error(
        "method.contact_law = {law}: expected rings, spheres and planes only, and there is {body}; take it out, or \
         take the law centreline-arc"
    )]
    Law {
        /// The law, as the scene writes it.
        law: &'static str,
        /// The first body that it cannot take.
        body: BodyName,
    },
    /// An integrator that has no answer for what the scene holds.
    #[error(
        "method.integrator = {integrator}: expected no {what}; take it out, or take verlet, rk4 or dopri5"
    )]
    Integrator {
        /// The integrator, as the scene writes it.
        integrator: &'static str,
        /// What it cannot take.
        what: &'static str,
    },
    /// More bodies than 32-bit numbers can name.
    #[error("{count} bodies: expected at most {largest}")]
    TooManyBodies {
        /// Bodies and planes in the scene.
        count: usize,
        /// The largest number.
        largest: usize,
    },
}

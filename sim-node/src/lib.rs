//! The motion of linked rigid rings, spheres and planes: deterministic, step by step.
//!
//! The one thing to know: a [`Model`] is compiled from a scene and never changes, a [`State`] is all that
//! the next step needs, and [`step`] makes the one after. The same model and state give the same bits on
//! every machine, with any number of threads, in any build.

// `!(x > 0.0)` is meant as written: a NaN must take the branch that finds nothing.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod body;
pub mod broad;
mod chunk;
mod contact;
mod drag;
mod estimate;
mod forces;
mod gather;
mod integrator;
mod model;
mod momentum;
mod motion;
mod name;
mod narrow;
pub mod node;
mod overlap;
mod plan;
mod polynomials;
mod reaction;
mod record;
mod refusal;
mod risk;
mod scratch;
mod sleep;
mod stability;
mod state;
mod step;
mod subdivide;
mod team;
mod wrench;

pub use body::{Body, Shape};
pub use model::{BodyName, Compile, HalfSpace, Model, ModelError};
pub use momentum::Unexplained;
pub use record::{Records, audit, check_audit, mechanical_energy};
pub use scratch::Scratch;
pub use state::{State, StateMismatch};
pub use step::{Stop, evaluate, step};

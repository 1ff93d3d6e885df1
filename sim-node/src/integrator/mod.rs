//! Integrators of the equations of motion, a file each.

mod kick;
mod lanes;
pub(crate) mod rk4;
pub(crate) mod verlet;

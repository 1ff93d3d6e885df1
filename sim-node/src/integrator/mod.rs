//! Integrators of the equations of motion, a file each.

pub(crate) mod asymmetric;
pub(crate) mod rk4;
pub(crate) mod verlet;

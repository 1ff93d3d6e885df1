//! Integrators of the equations of motion, a file each.

pub(crate) mod asymmetric;
pub(crate) mod dopri5;
pub(crate) mod explicit;
pub(crate) mod implicit;
mod kick;
mod lanes;
pub(crate) mod rk4;
pub(crate) mod verlet;

//! Tests of the simulator: closed forms, conservation, orders of convergence, and equal bits.
//!
//! Tolerances are derived beside the assertions; `cargo test -- --nocapture` prints what was measured.

mod blow_up;
mod bounce;
mod broad;
mod conservation;
mod determinism;
mod dopri5;
mod drag;
mod every_body;
mod fall;
mod friction;
mod golden;
mod implicit;
mod laws;
mod material;
mod momentum;
mod motion;
mod node;
mod refusals;
mod samplers;
mod scenes;
mod sheet;
mod sleep;
mod solids;
mod stability;
mod steps;
mod support;
mod surfaces;
mod top;
mod weaves;

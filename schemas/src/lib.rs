//! The contract between the simulator, the renderer and the recorder: what a scene, a state, a step
//! record, a frame and an end of stream are, and on which topic each of them travels.
//!
//! # Units, frames and signs
//!
//! - SI units and radians everywhere; a name that crosses a boundary (file, flag, message) ends in its unit.
//! - One right-handed inertial frame, *World*. Positions, velocities, forces and torques are given in it.
//! - A body's own frame has its origin at the centre of mass. A ring's axis is its own z axis and its
//!   centreline lies in its own x-y plane.
//! - `orientation` is the unit quaternion `[x, y, z, w]` that turns body axes into World axes.
//! - `gap` is the signed distance between two surfaces: positive apart, negative overlapping;
//!   `penetration` is `max(0, -gap)`. A contact `normal` points from body A to body B.
//! - `major_radius` runs from a ring's centre to the centreline of its wire, `minor_radius` is the wire's.
//!
//! This crate knows no physics, no light and no files: text in, values out.

mod hash;
mod log_time;

pub mod end;
pub mod frame;
pub mod plan;
pub mod scene;
pub mod state;
pub mod step;
pub mod topics;
pub mod wire;

pub use hash::{Hash, ParseHashError, chain};
pub use log_time::log_time_ns;

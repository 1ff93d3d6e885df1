//! Tests of the renderer's core: is the light right, is the nearest surface found, are the bits the same?

mod determinism;
mod edges;
mod hits;
mod light;
mod picture;
mod solids;
mod staging;
mod warps;

//! Tests of the renderer's core: is the light right, is the nearest surface found, are the bits the same?

mod bsdfs;
mod cameras;
mod determinism;
mod edges;
mod film;
mod hits;
mod leaks;
mod light;
mod mis;
mod picture;
mod reference;
mod sky;
mod solids;
mod staging;
mod surfaces;
mod torus_lanes;
mod warps;

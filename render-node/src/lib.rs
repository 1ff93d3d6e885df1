//! An exact, deterministic path tracer of rings, spheres, capsules, boxes, polynomial bodies and planes.
//!
//! Tori are not approximated: a ray meets the surface itself (see [`geometry::torus`]). A frame is a function of
//! the scene, the state, the frame's number and the seed; the number of threads does not change a bit of it.
//!
//! ```
//! use render_node::{RenderModel, render};
//! use schemas::{scene::Scene, state::BodyState};
//! use std::num::NonZeroUsize;
//!
//! let scene = r#"
//!     time = { duration_s = 0.0, time_step_s = 0.001 }
//!     material.steel = {}
//!     ring = [{ major_radius_m = 1.0, minor_radius_m = 0.2, mass_kg = 1.0, material = "steel", position_m = [0, 0, 0] }]
//!     render = { width_px = 8, height_px = 8, samples_per_pixel = 4 }
//! "#;
//! let scene = Scene::parse(scene, &[])?;
//! let (model, plan) = RenderModel::compile(&scene);
//! assert!(plan.needs("light/sky") && !plan.needs("light/area"));
//! let bodies = [BodyState { orientation: [0.0, 0.0, 0.0, 1.0], ..Default::default() }];
//! let film = render(&model, &bodies, 0, scene.seed, NonZeroUsize::MIN)?;
//! assert_eq!(film.hash(), render(&model, &bodies, 0, scene.seed, NonZeroUsize::new(3).unwrap())?.hash());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How it works
//! [`RenderModel::compile`] takes the `render` half of a scene and the shapes of its bodies. For each frame [`World`] puts
//! the bodies into their places and builds a tree of boxes over them; then the paths of a tile's pixels go from vertex to vertex
//! together (`PathTracer::follow`), and all their rays are traced at once. Rays are met exactly in `f64`; `f32` only culls, and wide
//! of all rounding.
//!
//! # Limits
//! Colours are red, green and blue, not spectra. A rough coating of plastic loses what would leave it after a second reflection. At each
//! vertex one light, chosen uniformly, is asked for its light. A ray
//! leaves a surface 1e-6 of the smallest radius away from it, so coordinates should stay below 1e8 of the smallest radius. A
//! body that is 1e5 times farther away than the others are large costs time: nothing is culled any more.

// `!(x > 0.0)` is meant as written: a NaN must take the branch that finds nothing.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod bvh;
mod camera;
mod colour;
mod environment;
mod exr_file;
mod features;
mod film;
mod flat;
mod frame;
mod light;
mod model;
mod path;
mod picture;
mod radiance_file;
mod ray;
mod rings;
mod sampler;
mod sieve;
mod solids;
mod tone;
mod world;

pub mod bsdf;
pub mod node;
pub mod warp;

pub use bvh::Tracer;
pub use environment::{EnvironmentMap, MapError, MapSample};
pub use exr_file::encode as exr_bytes;
pub use features::{FeatureImages, film_channels};
pub use film::{Film, PixelSums, SamplePlace, luminance};
pub use frame::{Job, Stage, add_samples, render, render_on, render_while};
pub use model::RenderModel;
pub use picture::{png_bytes, srgb_bytes, srgb_code};
pub use ray::Ray;
pub use sampler::Sampler;
pub use solids::{FormulaRefused, initial_states};
pub use tone::tone_map;
pub use world::{Hierarchy, Hit, PoseError, ShadowEnd, World};

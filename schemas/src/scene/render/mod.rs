//! How to look at a scene: camera, light, looks of materials, film. The simulator never reads this half.
//!
//! The one thing to know: every key has a default, and a key that has its default is not written into a log, so
//! scenes and logs from before a key existed mean what they meant.

mod bounces;
mod film;
mod light;
mod look;
mod validate;

pub use bounces::UNLIMITED;
pub use film::{DirectLight, Filter, FilterShape, Sampler};
pub use light::{Light, Sky};
pub use look::{Bsdf, Look, Metal};
pub(super) use validate::validate;

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The second half of a scene; `rerender` replaces it alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Render {
    /// Width of a frame, in pixels.
    pub width_px: u32,
    /// Height of a frame, in pixels.
    pub height_px: u32,
    /// The part of the picture that is rendered: left, top, width and height in pixels. Its pixels are those of the
    /// whole picture, bit for bit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crop_px: Option<[u32; 4]>,
    /// Paths traced through each pixel.
    pub samples_per_pixel: u32,
    /// Where the random numbers of a path come from.
    #[serde(skip_serializing_if = "is_default")]
    pub sampler: Sampler,
    /// How the light around a pixel's middle counts.
    #[serde(skip_serializing_if = "is_default")]
    pub filter: Filter,
    /// Reflections that a path follows at most; 0 is direct light only, `"unlimited"` leaves the end to Russian
    /// roulette ([`UNLIMITED`]).
    #[serde(with = "bounces")]
    pub bounces_max: u32,
    /// Reflections after which a path goes on only with the probability of its throughput (Russian roulette).
    #[serde(skip_serializing_if = "is_default_roulette")]
    pub roulette_after: u32,
    /// How light from lights is found; the mean of many samples does not depend on it.
    #[serde(skip_serializing_if = "is_default")]
    pub direct_light: DirectLight,
    /// Factor on radiance before the picture is encoded.
    pub exposure: f64,
    /// The camera.
    pub camera: Camera,
    /// Radiance that comes from where nothing is.
    pub sky: Sky,
    /// Lights.
    #[serde(rename = "light")]
    pub lights: Vec<Light>,
    /// Looks of the materials, by the names that bodies use; a material without one is grey.
    #[serde(rename = "look")]
    pub looks: BTreeMap<String, Look>,
}

/// Reflections that every path makes before Russian roulette, unless a scene says otherwise: most light has come by then.
const ROULETTE_AFTER: u32 = 3;

fn is_default_roulette(bounces: &u32) -> bool {
    *bounces == ROULETTE_AFTER
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Default for Render {
    fn default() -> Self {
        Render {
            width_px: 640,
            height_px: 360,
            crop_px: None,
            samples_per_pixel: 16,
            sampler: Sampler::default(),
            filter: Filter::default(),
            bounces_max: 2,
            roulette_after: ROULETTE_AFTER,
            direct_light: DirectLight::default(),
            exposure: 1.0,
            camera: Camera::default(),
            sky: Sky::default(),
            lights: Vec::new(),
            looks: BTreeMap::new(),
        }
    }
}

/// A pinhole camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// Where it stands, in metres.
    pub position_m: [f64; 3],
    /// The point in the middle of the picture, in metres.
    pub look_at_m: [f64; 3],
    /// The direction that is up in the picture; not parallel to the view.
    pub up: [f64; 3],
    /// Angle from the bottom to the top of the picture, in radians.
    pub vertical_field_of_view_rad: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Camera {
            position_m: [0.0, 0.0, 5.0],
            look_at_m: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            vertical_field_of_view_rad: 0.7,
        }
    }
}

//! How to look at a scene: camera, light, looks of materials, film. The simulator never reads this half.
//!
//! The one thing to know: every key has a default, and a key that has its default is not written into a log, so
//! scenes and logs from before a key existed mean what they meant.

mod bounces;
mod camera;
mod film;
mod light;
mod look;
mod surface;
mod validate;

pub use bounces::UNLIMITED;
pub use camera::{Camera, Projection, Viewpoint};
pub use film::{ColourBy, Colouring, DirectLight, Filter, FilterShape, Sampler, ToneMapping};
pub use light::{Environment, Light, Sky};
pub use look::{Bsdf, Look, Metal};
pub use surface::{RootFinder, Surface};
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
    /// Paths traced through each pixel; the most, where `noise_max` is given.
    pub samples_per_pixel: u32,
    /// A pixel gets no more samples once its standard error is at most this share of its luminance (plus a hundredth of
    /// white, which is all that one can see in the dark). It is looked at after every 16 samples, from 32 on, so it depends on
    /// nothing but the pixel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_max: Option<f64>,
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
    /// Light that a path brings after its first reflection is cut down to this luminance. It takes the bright specks away that
    /// metal throws at diffuse surfaces, and some of the light with them: the mean is too dark there. Without it nothing is cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub indirect_max: Option<f64>,
    /// How the places are found where a ray meets rings and polynomials.
    #[serde(skip_serializing_if = "is_default")]
    pub root_finder: RootFinder,
    /// How light from lights is found; the mean of many samples does not depend on it.
    #[serde(skip_serializing_if = "is_default")]
    pub direct_light: DirectLight,
    /// Factor on radiance before the picture is encoded.
    pub exposure: f64,
    /// How linear radiance becomes the colours of a picture.
    #[serde(skip_serializing_if = "is_default")]
    pub tone_mapping: ToneMapping,
    /// What the colours of bodies mean.
    #[serde(skip_serializing_if = "is_default")]
    pub colouring: Colouring,
    /// The camera.
    pub camera: Camera,
    /// Radiance that comes from where nothing is.
    pub sky: Sky,
    /// A picture of the light from all around; it takes the place of the sky.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment: Option<Environment>,
    /// Lights.
    #[serde(rename = "light")]
    pub lights: Vec<Light>,
    /// Surfaces that are only looked at.
    #[serde(rename = "surface", skip_serializing_if = "Vec::is_empty")]
    pub surfaces: Vec<Surface>,
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
            noise_max: None,
            sampler: Sampler::default(),
            filter: Filter::default(),
            bounces_max: 2,
            roulette_after: ROULETTE_AFTER,
            indirect_max: None,
            root_finder: RootFinder::default(),
            direct_light: DirectLight::default(),
            exposure: 1.0,
            tone_mapping: ToneMapping::default(),
            colouring: Colouring::default(),
            camera: Camera::default(),
            sky: Sky::default(),
            environment: None,
            lights: Vec::new(),
            surfaces: Vec::new(),
            looks: BTreeMap::new(),
        }
    }
}

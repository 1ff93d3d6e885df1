//! How samples are chosen and how they become a pixel.

use serde::{Deserialize, Serialize};

/// Where the random numbers of a path come from. Each is a function of (seed, frame, pixel, sample, dimension).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampler {
    /// Points of the Sobol sequence, scrambled anew for every pixel and pair of dimensions: evenly spread, so that
    /// noise falls faster than with independent numbers. Powers of two are the best counts of samples.
    #[default]
    Sobol,
    /// Independent ChaCha8 numbers.
    Independent,
}

/// How light from lights is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DirectLight {
    /// By asking a light and by following the reflection, each weighted by how well it does (multiple importance
    /// sampling, power heuristic).
    #[default]
    Mis,
    /// By asking a light alone; mirrors still see lights.
    Lights,
    /// By following the reflection alone.
    Bsdf,
}

/// How the light around a pixel's middle counts. Samples are drawn with the filter's shape as density, so each counts
/// the same and belongs to one pixel alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Filter {
    /// The filter's shape.
    pub shape: FilterShape,
    /// How far it reaches, in pixels: half the width of a box, half the base of a tent, where a Gaussian is cut off.
    pub radius_px: f64,
}

impl Default for Filter {
    fn default() -> Self {
        Filter { shape: FilterShape::Box, radius_px: 0.5 }
    }
}

/// The shape of a pixel filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FilterShape {
    /// The same everywhere within a square.
    #[default]
    Box,
    /// Falls linearly along each axis.
    Tent,
    /// A Gaussian of the distance with a standard deviation of half the radius, cut off at the radius.
    Gaussian,
}

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

/// How linear radiance becomes the colours of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ToneMapping {
    /// None: what is brighter than white is white.
    #[default]
    Srgb,
    /// A fit of the film-like curve of ACES: deep shadows, highlights that roll off.
    Aces,
    /// A fit of AgX: highlights that roll off and lose their colour softly.
    Agx,
}

/// What the colours of bodies mean.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Colouring {
    /// What a body's colour shows.
    pub by: ColourBy,
    /// What the last colour stands for: 1 m/s of speed, or 0.05 of the thinner wire's diameter of penetration, if nothing is
    /// said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
}

/// What a body's colour shows. Colours run from violet over green to yellow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ColourBy {
    /// The look of its material.
    #[default]
    Look,
    /// Its speed.
    Speed,
    /// How deep it is in other rings, at most, as a share of the thinner wire's diameter. Rings among themselves only.
    Penetration,
    /// Its number: neighbours differ.
    Number,
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

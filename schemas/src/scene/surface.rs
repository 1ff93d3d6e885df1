//! How the contact law `surface-integral` takes its integral.

use serde::{Deserialize, Serialize};

/// The integral of depth over the part of each surface that is inside the other body.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceIntegral {
    /// How its points are placed.
    pub sampler: SurfaceSampler,
    /// Points on each body of a pair, in each step; `quadrature` takes as many as the patch needs. At most 2^24.
    pub samples: u32,
    /// What the sum is divided by.
    pub average: SurfaceAverage,
}

impl Default for SurfaceIntegral {
    fn default() -> Self {
        SurfaceIntegral {
            sampler: SurfaceSampler::default(),
            samples: 1000,
            average: SurfaceAverage::default(),
        }
    }
}

impl SurfaceIntegral {
    /// Whether nothing was changed.
    pub fn is_default(&self) -> bool {
        *self == SurfaceIntegral::default()
    }
}

/// Where the points of a surface integral lie. All but `quadrature` are random: a function of seed, step and pair, the
/// same in all stages of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceSampler {
    /// Independent, uniform in both angles: the original's.
    UniformAngles,
    /// Independent, uniform by area.
    Uniform,
    /// One in each cell of a grid over the whole surface, by area.
    Stratified,
    /// Scrambled Sobol points over the whole surface, by area.
    Sobol,
    /// Scrambled Sobol points in a box round the patch.
    Patch,
    /// Gauss points on rays from the patch's deepest point to its edge; cross-sections where that does not do.
    #[default]
    Quadrature,
}

/// What the sum over a surface's points is divided by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceAverage {
    /// Each point counts with its area: the force is `surface_stiffness_n_per_m3` times the integral of depth.
    #[default]
    Area,
    /// The mean over all samples, those outside too: the original's. The force is `point_stiffness_n_per_m` times the
    /// mean depth, so it falls with the share of the surface that is inside. Dampings are those of contact points.
    AllSamples,
}

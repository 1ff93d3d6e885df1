//! Rough metal: one reflection at its facets, and what comes after more than one.

use super::BsdfSample;
use super::fresnel::ComplexIndex;
use super::ggx::Ggx;
use crate::warp;
use core::f64::consts::FRAC_1_PI;
use geometry::Vec3;

/// Heights of the view for which the share of a single reflection is known, less one.
const HEIGHTS: usize = 32;
/// Strata of the random numbers by which it is found: of the height, and of half a turn.
const STRATA: (u32, u32) = (48, 24);

/// A rough metal.
///
/// Light that one facet throws onto another is not lost but leaves at last, as from a Lambertian surface in the metal's
/// colour, so that a metal without loss sends all light back at any roughness.
///
/// # Source
/// Kulla and Conty, "Revisiting Physically Based Shading at Imageworks", SIGGRAPH course 2017: what is lost by view and by
/// light, multiplied, so that light takes the same way back; its colour by eq. 12 of Turquin, "Practical multiple
/// scattering compensation for microfacet models", 2019. Deviation: the table is made for the one alpha that a surface has.
#[derive(Clone, Debug)]
pub struct RoughConductor {
    index: ComplexIndex,
    facets: Ggx,
    /// Share of a white metal's light that leaves after one reflection, by the height of the view in equal steps from 0 to 1.
    once: [f64; HEIGHTS + 1],
    /// Colour of the rest, over pi and the mean of the rest's share.
    rest: Vec3,
}

impl RoughConductor {
    /// A metal with facets.
    pub fn new(index: ComplexIndex, facets: Ggx) -> RoughConductor {
        let once: [f64; HEIGHTS + 1] = std::array::from_fn(|step| {
            // At the horizon itself no facet is seen.
            let height = if step > 0 { step as f64 / HEIGHTS as f64 } else { 1e-3 };
            single_reflection(&facets, height)
        });
        // Means over directions count with the cosine: of a table that is linear in between, by Simpson's rule exactly.
        let mean_once = (0..HEIGHTS).map(|step| {
            let (low, high) = (step as f64 / HEIGHTS as f64, (step + 1) as f64 / HEIGHTS as f64);
            let middle = 0.5 * (low + high) * 0.5 * (once[step] + once[step + 1]);
            (low * once[step] + 4.0 * middle + high * once[step + 1]) / (6.0 * HEIGHTS as f64)
        });
        let mean_once = 2.0 * mean_once.sum::<f64>();
        let mean_reflectance = index.diffuse_reflectance();
        let mean_lost = 1.0 - mean_once;
        let rest = mean_reflectance.map(|mean| {
            let colour = mean * mean * mean_once / (1.0 - mean * mean_lost);
            // Nearly polished: what rounding leaves is no light.
            if mean_lost > 1e-6 { colour * FRAC_1_PI / mean_lost } else { 0.0 }
        });
        RoughConductor { index, facets, once, rest }
    }

    /// The metal's refractive index.
    pub fn index(&self) -> &ComplexIndex {
        &self.index
    }

    /// Share of a white metal's light along this height that does not leave after one reflection.
    #[inline]
    fn lost(&self, height: f64) -> f64 {
        let scaled = height * HEIGHTS as f64;
        let step = (scaled as usize).min(HEIGHTS - 1);
        let share = scaled - step as f64;
        let once = self.once[step] + (self.once[step + 1] - self.once[step]) * share;
        if once < 1.0 { 1.0 - once } else { 0.0 }
    }

    #[inline]
    pub(super) fn eval(&self, wo: &Vec3, wi: &Vec3) -> Vec3 {
        let (value, cosine) = self.facets.eval(wo, wi);
        self.index.reflectance(cosine) * value + self.rest * (self.lost(wo.z) * self.lost(wi.z) * wi.z)
    }

    #[inline]
    pub(super) fn pdf(&self, wo: &Vec3, wi: &Vec3) -> f64 {
        let lost = self.lost(wo.z);
        (1.0 - lost) * self.facets.pdf(wo, wi) + lost * FRAC_1_PI * wi.z
    }

    #[inline]
    pub(super) fn sample(&self, wo: &Vec3, (u, v): (f64, f64)) -> Option<BsdfSample> {
        let lost = self.lost(wo.z);
        // What chose is again uniform.
        let wi = if u < lost {
            warp::cosine_hemisphere((u / lost, v))
        } else {
            self.facets.sample(wo, ((u - lost) / (1.0 - lost), v))?.0
        };
        let pdf = self.pdf(wo, &wi);
        (pdf > 0.0).then(|| BsdfSample { wi, weight: self.eval(wo, &wi) / pdf, pdf: Some(pdf) })
    }
}

/// The share of light that facets of white mirrors send out after one reflection, by the height of the view: the mean weight
/// of evenly spread samples.
fn single_reflection(facets: &Ggx, height: f64) -> f64 {
    let wo = Vec3::new((1.0 - height * height).sqrt(), 0.0, height);
    let mut sum = 0.0;
    for k in 0..STRATA.0 {
        // As 1 - s^2: what is lost is lost in the distribution's long tail, at the end of the interval.
        let s = (f64::from(k) + 0.5) / f64::from(STRATA.0);
        for l in 0..STRATA.1 {
            // The other half of the turn is this one's mirror image.
            let square = (1.0 - s * s, (f64::from(l) + 0.5) / f64::from(2 * STRATA.1));
            sum += facets.sample(&wo, square).map_or(0.0, |(_, weight, _)| 2.0 * s * weight);
        }
    }
    sum / f64::from(STRATA.0 * STRATA.1)
}

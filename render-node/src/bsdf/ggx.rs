//! Rough surfaces: facets whose normals are distributed as GGX.

use crate::warp;
use core::f64::consts::PI;
use geometry::Vec3;

/// The GGX (Trowbridge-Reitz) distribution of facets, the same in all directions along the surface.
///
/// # Source
/// Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, eq. 33 (distribution); Heitz,
/// "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", JCGT 3(2), 2014, eq. 72 and 99 (masking and
/// shadowing by Smith, correlated in height); Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", CGF
/// 42(8), 2023 (sampling). Of one reflection alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    /// Width of the distribution: the tangent of the angle below which half of the facets' projected area lies.
    pub alpha: f64,
}

impl Ggx {
    /// Share of the surface's projected area whose facets have this normal, per solid angle.
    #[inline]
    pub fn density(&self, normal: &Vec3) -> f64 {
        let alpha_squared = self.alpha * self.alpha;
        let cosine_squared = normal.z * normal.z;
        let sine_squared = normal.x * normal.x + normal.y * normal.y;
        // As sine and cosine, so that a narrow peak keeps its digits.
        let spread = sine_squared + alpha_squared * cosine_squared;
        alpha_squared / (PI * spread * spread)
    }

    /// Smith's Lambda: hidden area over visible area, as seen from a direction.
    #[inline]
    fn hidden(&self, direction: &Vec3) -> f64 {
        let cosine_squared = direction.z * direction.z;
        let sine_squared = direction.x * direction.x + direction.y * direction.y;
        0.5 * ((1.0 + self.alpha * self.alpha * sine_squared / cosine_squared).sqrt() - 1.0)
    }

    /// The facets' reflection of white mirrors per solid angle of `wi`, times its cosine, and the cosine of the angle
    /// at which light meets the facets. For directions above the surface; zero at the horizon.
    #[inline]
    pub fn eval(&self, wo: &Vec3, wi: &Vec3) -> (f64, f64) {
        if !(wo.z > 0.0) {
            return (0.0, 1.0);
        }
        let half = (wo + wi).normalize();
        let visible = 1.0 / (1.0 + self.hidden(wo) + self.hidden(wi));
        (self.density(&half) * visible / (4.0 * wo.z), wo.dot(&half))
    }

    /// Density with which [`Ggx::sample`] chooses `wi`.
    #[inline]
    pub fn pdf(&self, wo: &Vec3, wi: &Vec3) -> f64 {
        if !(wo.z > 0.0) {
            return 0.0;
        }
        let half = (wo + wi).normalize();
        self.density(&half) / ((1.0 + self.hidden(wo)) * 4.0 * wo.z)
    }

    /// Reflects `wo` at a facet that it sees: `wi`, `eval` over `pdf`, and the cosine at the facet. `None` if that
    /// leads into the surface.
    #[inline]
    pub fn sample(&self, wo: &Vec3, (u, v): (f64, f64)) -> Option<(Vec3, f64, f64)> {
        if !(wo.z > 0.0) {
            return None;
        }
        // In the frame where the facets are those of a sphere, a visible normal is the middle between the view and a
        // uniform point of a spherical cap.
        let view = Vec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z).normalize();
        let z = (1.0 - u) * (1.0 + view.z) - view.z;
        let squared = 1.0 - z * z;
        let radius = if squared > 0.0 { squared.sqrt() } else { 0.0 };
        let (cosine, sine) = warp::circle_point(v);
        let cap = Vec3::new(radius * cosine, radius * sine, z) + view;
        let normal = Vec3::new(self.alpha * cap.x, self.alpha * cap.y, cap.z).normalize();
        let cosine = wo.dot(&normal);
        let wi = (normal * (2.0 * cosine) - wo).normalize();
        if !(wi.z > 0.0 && cosine > 0.0) {
            return None;
        }
        let (out, into) = (self.hidden(wo), self.hidden(&wi));
        Some((wi, (1.0 + out) / (1.0 + out + into), cosine))
    }
}

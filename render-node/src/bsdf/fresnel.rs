//! What an even surface reflects: Fresnel's formulas, and measured metals.

use geometry::Vec3;
use schemas::scene::render::{Look, Metal};

/// The complex refractive index `eta + i k` of a metal against air, for red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComplexIndex {
    /// Real part.
    pub eta: Vec3,
    /// Imaginary part: the extinction coefficient.
    pub k: Vec3,
}

impl ComplexIndex {
    pub(super) fn of(look: &Look) -> ComplexIndex {
        match (look.eta, look.k) {
            (Some(eta), Some(k)) => ComplexIndex { eta: Vec3::from(eta), k: Vec3::from(k) },
            _ => ComplexIndex::measured(look.metal.unwrap_or_default()),
        }
    }

    /// A metal as measured, at 650, 550 and 450 nm for red, green and blue, linear between the wavelengths of the
    /// publication.
    ///
    /// # Source
    /// Steel: Karlsson and Ribbing, J. Appl. Phys. 53, 6340 (1982), ferritic stainless steel Avesta 393 M. Brass: Querry,
    /// report CRDC-CR-85034 (1985), 70 % copper, 30 % zinc. Gold, copper, silver: Johnson and Christy, Phys. Rev. B 6, 4370
    /// (1972). Aluminium: Hagemann, Gudat and Kunz, J. Opt. Soc. Am. 65, 742 (1975). All as tabulated, in the public
    /// domain, by refractiveindex.info.
    pub fn measured(metal: Metal) -> ComplexIndex {
        let (eta, k) = match metal {
            Metal::Steel => ([2.1942, 1.9043, 1.4945], [3.4813, 3.1704, 2.7709]),
            Metal::Brass => ([0.444, 0.527, 1.094], [3.695, 2.765, 1.829]),
            Metal::Gold => ([0.1556, 0.4241, 1.3831], [3.6024, 2.4721, 1.9155]),
            Metal::Aluminium => ([1.4838, 0.9983, 0.6471], [7.5771, 6.5077, 5.4043]),
            Metal::Copper => ([0.2378, 1.0066, 1.2404], [3.6264, 2.5823, 2.3929]),
            Metal::Silver => ([0.0522, 0.0596, 0.0400], [4.4093, 3.5974, 2.6484]),
        };
        ComplexIndex { eta: Vec3::from(eta), k: Vec3::from(k) }
    }

    /// Share of unpolarised light that is reflected, by the cosine of the angle to the normal.
    #[inline]
    pub fn reflectance(&self, cosine: f64) -> Vec3 {
        self.eta.zip_map(&self.k, |eta, k| conductor_reflectance(cosine, eta, k))
    }

    /// The same for light from all sides alike, by the midpoint rule.
    pub(super) fn diffuse_reflectance(&self) -> Vec3 {
        const PARTS: u32 = 64;
        // Parts of equal share of the density `2 cosine`.
        let term = |part: u32| self.reflectance(((f64::from(part) + 0.5) / f64::from(PARTS)).sqrt());
        (0..PARTS).map(term).sum::<Vec3>() / f64::from(PARTS)
    }
}

/// Share of unpolarised light that a metal of the refractive index `eta + i k` reflects.
///
/// # Source
/// Born and Wolf, "Principles of Optics", section 14.2, eq. 24 ff., with `a^2` and `b^2` there.
#[inline]
fn conductor_reflectance(cosine: f64, eta: f64, k: f64) -> f64 {
    let cosine_squared = cosine * cosine;
    let sine_squared = 1.0 - cosine_squared;
    let difference = eta * eta - k * k - sine_squared;
    let sum = (difference * difference + 4.0 * eta * eta * k * k).sqrt();
    let a_squared = 0.5 * (sum + difference);
    let a = if a_squared > 0.0 { a_squared.sqrt() } else { 0.0 };
    let (even, odd) = (sum + cosine_squared, 2.0 * a * cosine);
    let perpendicular = (even - odd) / (even + odd);
    let (even, odd) = (cosine_squared * sum + sine_squared * sine_squared, odd * sine_squared);
    let parallel = perpendicular * (even - odd) / (even + odd);
    0.5 * (perpendicular + parallel)
}

/// Share of unpolarised light that the surface of a clear body reflects from outside, by the cosine of the angle to the
/// normal and the body's refractive index (above 1).
///
/// # Source
/// Fresnel's formulas with Snell's law: Born and Wolf, "Principles of Optics", section 1.5, eq. 21.
#[inline]
pub fn dielectric_reflectance(cosine: f64, index: f64) -> f64 {
    let inner_squared = 1.0 - (1.0 - cosine * cosine) / (index * index);
    let inner = if inner_squared > 0.0 { inner_squared.sqrt() } else { 0.0 };
    let perpendicular = (cosine - index * inner) / (cosine + index * inner);
    let parallel = (index * cosine - inner) / (index * cosine + inner);
    0.5 * (perpendicular * perpendicular + parallel * parallel)
}

/// Share of light from all sides alike that the surface of a clear body reflects from outside: the mean of
/// [`dielectric_reflectance`] with the density `2 cosine`, by the midpoint rule.
pub(super) fn diffuse_reflectance(index: f64) -> f64 {
    const PARTS: u32 = 4096;
    let term = |part: u32| {
        // Parts of equal share of the density: its cumulative distribution is the cosine's square.
        let share = (f64::from(part) + 0.5) / f64::from(PARTS);
        dielectric_reflectance(share.sqrt(), index)
    };
    (0..PARTS).map(term).sum::<f64>() / f64::from(PARTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight down both formulas are the textbook's `((n - 1)^2 + k^2) / ((n + 1)^2 + k^2)`, at the horizon all is
    /// reflected, and a metal without extinction is a clear body.
    #[test]
    fn reflectances_have_their_limits() {
        for (eta, k) in [(1.5, 0.0), (2.2, 3.5), (0.05, 4.4), (1.0, 2.0)] {
            let straight = ((eta - 1.0) * (eta - 1.0) + k * k) / ((eta + 1.0) * (eta + 1.0) + k * k);
            assert!((conductor_reflectance(1.0, eta, k) - straight).abs() < 1e-15);
            assert!((conductor_reflectance(0.0, eta, k) - 1.0).abs() < 1e-15);
        }
        for step in 0..=100 {
            let cosine = f64::from(step) / 100.0;
            let (metal, clear) =
                (conductor_reflectance(cosine, 1.5, 0.0), dielectric_reflectance(cosine, 1.5));
            assert!((metal - clear).abs() < 1e-14, "{cosine}: {metal} against {clear}");
        }
        // At Brewster's angle one polarisation vanishes: tan = n, and the other is ((n^2 - 1) / (n^2 + 1))^2.
        let brewster = dielectric_reflectance(1.0 / (1.0_f64 + 1.5 * 1.5).sqrt(), 1.5);
        assert!((brewster - 0.5 * (1.25_f64 / 3.25) * (1.25 / 3.25)).abs() < 1e-15);
    }

    /// Against the closed form of Walsh, "The reflection factor of a polished glass surface for diffused light" (1926). The
    /// midpoint rule errs most where the reflectance rises steeply towards the horizon: in its last part, of 1/4096, by a
    /// share of some hundredths.
    #[test]
    fn diffuse_reflectance_is_walshs() {
        for n in [1.1, 1.33, 1.5, 2.4_f64] {
            let squared = n * n;
            let (less, more, fourth) = (squared - 1.0, squared + 1.0, squared * squared);
            let walsh = 0.5
                + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0) * (n + 1.0))
                + squared * less * less / (more * more * more) * libm::log((n - 1.0) / (n + 1.0))
                - 2.0 * n * squared * (squared + 2.0 * n - 1.0) / (more * (fourth - 1.0))
                + 8.0 * fourth * (fourth + 1.0) / (more * (fourth - 1.0) * (fourth - 1.0)) * libm::log(n);
            let found = diffuse_reflectance(n);
            println!("index {n}: diffuse reflectance {found:.7}, Walsh {walsh:.7}, tolerance 1e-5");
            assert!((found - walsh).abs() < 1e-5);
        }
    }
}

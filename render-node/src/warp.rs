//! Directions and offsets from points of the unit square: turns of a circle, cosine-weighted hemisphere, cone, filters.

mod lanes;

use geometry::Vec3;
pub(crate) use lanes::{Frames, cosine_hemispheres};

/// `(cos, sin)` of `turns` full turns, for `turns` from 0 to 1.
///
/// The angle is brought to within an eighth of a turn of an axis, exactly, and put into the Taylor series of
/// degree 15, whose first left-out term is below 1e-16 there. Elementary operations alone.
#[inline]
pub fn circle_point(turns: f64) -> (f64, f64) {
    let quarters = 4.0 * turns;
    let nearest = (quarters + 0.5) as u32;
    let angle = (quarters - f64::from(nearest)) * core::f64::consts::FRAC_PI_2;
    let x = angle * angle;
    let sine = angle
        * (1.0
            + x * (-1.0 / 6.0
                + x * (1.0 / 120.0
                    + x * (-1.0 / 5_040.0
                        + x * (1.0 / 362_880.0
                            + x * (-1.0 / 39_916_800.0
                                + x * (1.0 / 6_227_020_800.0 - x * (1.0 / 1_307_674_368_000.0))))))));
    let cosine = 1.0
        + x * (-0.5
            + x * (1.0 / 24.0
                + x * (-1.0 / 720.0
                    + x * (1.0 / 40_320.0
                        + x * (-1.0 / 3_628_800.0
                            + x * (1.0 / 479_001_600.0 - x * (1.0 / 87_178_291_200.0)))))));
    match nearest & 3 {
        0 => (cosine, sine),
        1 => (-sine, cosine),
        2 => (-cosine, -sine),
        _ => (sine, -cosine),
    }
}

/// A direction with density `cos(angle to z) / pi` per solid angle on the hemisphere of +z.
#[inline]
pub fn cosine_hemisphere((u, v): (f64, f64)) -> Vec3 {
    let (cosine, sine) = circle_point(v);
    let radius = u.sqrt();
    Vec3::new(radius * cosine, radius * sine, (1.0 - u).sqrt())
}

/// A direction with uniform density within the cone of all directions whose angle to +z has a cosine of at
/// least `1 - one_minus_cos_max`, that is with density `1 / (2 pi one_minus_cos_max)`.
///
/// The cone is given in this way because the cosine of a narrow one is 1 to rounding.
#[inline]
pub fn uniform_cone((u, v): (f64, f64), one_minus_cos_max: f64) -> Vec3 {
    let below_one = u * one_minus_cos_max;
    let radius = (below_one * (2.0 - below_one)).sqrt();
    let (cosine, sine) = circle_point(v);
    Vec3::new(radius * cosine, radius * sine, 1.0 - below_one)
}

/// Distance from the middle along one axis with the density of a tent of half base 1, from a number from 0 to 1.
#[inline]
pub fn tent(u: f64) -> f64 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() }
}

/// A point of the unit disc with the density of a Gaussian of standard deviation 1/2 that is cut off at the rim.
#[inline]
pub fn gaussian_disc((u, v): (f64, f64)) -> (f64, f64) {
    // The squared radius is exponential of mean 2 sigma^2 = 1/2, cut off at 1.
    let rim = libm::exp(-2.0);
    let radius = (-0.5 * libm::log(1.0 - u * (1.0 - rim))).sqrt();
    let (cosine, sine) = circle_point(v);
    (radius * cosine, radius * sine)
}

/// A right-handed frame of unit vectors whose z axis is given.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First axis.
    pub x: Vec3,
    /// Second axis.
    pub y: Vec3,
    /// The given axis.
    pub z: Vec3,
}

impl Frame {
    /// The frame of a unit vector.
    ///
    /// # Source
    /// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017, eq. 5 ff.
    #[inline]
    pub fn about(axis: &Vec3) -> Frame {
        let sign = 1.0_f64.copysign(axis.z);
        let a = -1.0 / (sign + axis.z);
        let b = axis.x * axis.y * a;
        Frame {
            x: Vec3::new(1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x),
            y: Vec3::new(b, sign + axis.y * axis.y * a, -axis.y),
            z: *axis,
        }
    }

    /// A vector of the frame in World.
    #[inline]
    pub fn world(&self, local: &Vec3) -> Vec3 {
        self.x * local.x + self.y * local.y + self.z * local.z
    }

    /// A vector of World in the frame.
    #[inline]
    pub fn local(&self, world: &Vec3) -> Vec3 {
        Vec3::new(self.x.dot(world), self.y.dot(world), self.z.dot(world))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circle_points_are_those_of_the_library() {
        let mut worst = 0.0;
        for k in 0..=4_000 {
            let turns = f64::from(k) / 4_000.0;
            let (cosine, sine) = circle_point(turns);
            let angle = turns * core::f64::consts::TAU;
            for error in [cosine - libm::cos(angle), sine - libm::sin(angle)] {
                worst = if error.abs() > worst { error.abs() } else { worst };
            }
        }
        // Rounding of the angle (up to 8e-16 at 2 pi) and of the series.
        println!("largest error {worst:e}, tolerance 1.5e-15");
        assert!(worst < 1.5e-15);
        assert_eq!(circle_point(0.25), (0.0, 1.0));
        assert_eq!(circle_point(1.0), (1.0, 0.0));
    }

    #[test]
    fn frames_are_orthonormal() {
        for axis in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, 0.0, -0.8], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]] {
            let axis = Vec3::from(axis);
            let frame = Frame::about(&axis);
            let [x, y, z] = [Vec3::x(), Vec3::y(), Vec3::z()].map(|local| frame.world(&local));
            assert_eq!(z, axis);
            assert!((x.cross(&y) - z).norm() < 1e-15 && x.dot(&y).abs() < 1e-15);
            let there_and_back = frame.local(&frame.world(&Vec3::new(0.3, -0.5, 0.7)));
            assert!((there_and_back - Vec3::new(0.3, -0.5, 0.7)).norm() < 1e-15);
        }
    }
}

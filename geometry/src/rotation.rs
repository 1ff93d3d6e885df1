//! Rotations: the exponential map and the axes of a rotated frame.

use crate::Vec3;
use nalgebra::{Quaternion, UnitQuaternion};

/// The rotation about `rotation_vector` by its length (rad, right-hand rule), of unit length within rounding
/// (a few `1e-16`) and not normalised again. See [`half_angle`].
#[inline]
pub fn exp(rotation_vector: Vec3) -> UnitQuaternion<f64> {
    let (cosine, sine_over_angle) = half_angle(rotation_vector.norm_squared());
    let v = rotation_vector * sine_over_angle;
    UnitQuaternion::new_unchecked(Quaternion::new(cosine, v.x, v.y, v.z))
}

/// Square of the angle up to which [`half_angle_short`] is exact to rounding (rad^2).
pub const SHORT_ANGLE_SQUARED: f64 = 1.0 / 1024.0;

/// `cos(angle / 2)` and `sin(angle / 2) / angle` from the angle's square: what a unit quaternion is made of.
///
/// Up to one radian by the Taylor series in the square of the angle, which needs no square root and no
/// special case at zero, and is cut off earlier up to [`SHORT_ANGLE_SQUARED`]; beyond by `libm`.
///
/// # Source
/// The first left-out term of each series is below `(1/4)^9 / 18! < 1e-21` at one radian.
#[inline]
pub fn half_angle(angle_squared: f64) -> (f64, f64) {
    if angle_squared <= SHORT_ANGLE_SQUARED {
        half_angle_short(angle_squared)
    } else if angle_squared <= 1.0 {
        let x = 0.25 * angle_squared;
        (series(&COSINE, x), 0.5 * series(&SINE, x))
    } else {
        let angle = angle_squared.sqrt();
        (libm::cos(0.5 * angle), libm::sin(0.5 * angle) / angle)
    }
}

/// [`half_angle`] for a square of at most [`SHORT_ANGLE_SQUARED`], without a branch: for loops over many
/// bodies. The first left-out terms are below `2^-48 / 8! < 1e-19`.
#[inline(always)]
pub fn half_angle_short(angle_squared: f64) -> (f64, f64) {
    let x = 0.25 * angle_squared;
    let cosine = ((COSINE[3] * x + COSINE[2]) * x + COSINE[1]) * x + COSINE[0];
    let sine = ((SINE[3] * x + SINE[2]) * x + SINE[1]) * x + SINE[0];
    (cosine, 0.5 * sine)
}

/// The axes of the rotated frame, `(u, w, normal)`: the columns of the rotation matrix, that is the
/// images of the x, y and z axes. `q` must be of unit length; the axes are unit and orthogonal as far
/// as it is.
#[inline]
pub fn axes(q: &UnitQuaternion<f64>) -> (Vec3, Vec3, Vec3) {
    let (i, j, k, w) = (q.i, q.j, q.k, q.w);
    let (i2, j2, k2) = (i + i, j + j, k + k);
    let (ii, jj, kk) = (i * i2, j * j2, k * k2);
    let (ij, ik, jk) = (i * j2, i * k2, j * k2);
    let (wi, wj, wk) = (w * i2, w * j2, w * k2);
    (
        Vec3::new(1.0 - (jj + kk), ij + wk, ik - wj),
        Vec3::new(ij - wk, 1.0 - (ii + kk), jk + wi),
        Vec3::new(ik + wj, jk - wi, 1.0 - (ii + jj)),
    )
}

#[inline]
fn series(coefficients: &[f64; 9], x: f64) -> f64 {
    let mut sum = coefficients[8];
    for &c in coefficients[..8].iter().rev() {
        sum = sum * x + c;
    }
    sum
}

/// `cos(sqrt(x))`: (-1)^k / (2 k)!.
const COSINE: [f64; 9] = [
    1.0,
    -1.0 / 2.0,
    1.0 / 24.0,
    -1.0 / 720.0,
    1.0 / 40_320.0,
    -1.0 / 3_628_800.0,
    1.0 / 479_001_600.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 20_922_789_888_000.0,
];

/// `sin(sqrt(x)) / sqrt(x)`: (-1)^k / (2 k + 1)!.
const SINE: [f64; 9] = [
    1.0,
    -1.0 / 6.0,
    1.0 / 120.0,
    -1.0 / 5_040.0,
    1.0 / 362_880.0,
    -1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 1_307_674_368_000.0,
    1.0 / 355_687_428_096_000.0,
];

//! Rotations: the exponential map and the axes of a rotated frame.

use crate::Vec3;
use nalgebra::{Quaternion, UnitQuaternion};

/// The rotation about `rotation_vector` by its length (rad, right-hand rule).
///
/// Up to one radian by the Taylor series of `cos` and `sin(x) / x` in the square of the angle, which
/// needs no square root and no special case at zero; beyond by `libm`. The result is of unit length
/// within rounding (a few `1e-16`) and is not normalised again.
///
/// # Source
/// The first left-out term of each series is below `(1/4)^9 / 18! < 1e-21` at one radian.
#[inline]
pub fn exp(rotation_vector: Vec3) -> UnitQuaternion<f64> {
    let angle_squared = rotation_vector.norm_squared();
    let (cosine, sine_over_angle) = if angle_squared <= 1.0 {
        let x = 0.25 * angle_squared;
        (series(&COSINE, x), 0.5 * series(&SINE, x))
    } else {
        let angle = angle_squared.sqrt();
        (libm::cos(0.5 * angle), libm::sin(0.5 * angle) / angle)
    };
    let v = rotation_vector * sine_over_angle;
    UnitQuaternion::new_unchecked(Quaternion::new(cosine, v.x, v.y, v.z))
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

//! Planes: all points `p` with `normal . p = offset`.

use crate::Vec3;

/// Ray parameter at which the ray crosses the plane beyond `t_min`, or `None`.
///
/// `normal` is a unit vector and `offset` the plane's height along it (m). A ray within or parallel to
/// the plane never hits. Hits from both sides count.
#[inline]
pub fn ray_plane(origin: &Vec3, direction: &Vec3, normal: &Vec3, offset: f64, t_min: f64) -> Option<f64> {
    let t = (offset - normal.dot(origin)) / normal.dot(direction);
    // A division by zero gives an infinity or NaN.
    (t > t_min && t < f64::INFINITY).then_some(t)
}

/// Signed height above the plane: positive on the side the normal points to (m).
#[inline]
pub fn distance(point: &Vec3, normal: &Vec3, offset: f64) -> f64 {
    normal.dot(point) - offset
}

/// The plane's normal, turned to the side a ray with this direction comes from.
#[inline]
pub fn facing_normal(normal: &Vec3, direction: &Vec3) -> Vec3 {
    if normal.dot(direction) > 0.0 { -normal } else { *normal }
}

//! Spheres.

use crate::{Aabb, Vec3, shift::closest_approach};

/// Ray parameter of the first hit of the sphere beyond `t_min`, or `None`.
///
/// `direction` is a unit vector, lengths are in metres, all in one frame. From inside, the hit is the
/// exit. The equation is solved about the point of closest approach, which keeps full precision for
/// origins far away, and for an origin on the sphere the other end of the chord is exact to rounding.
/// A ray that only touches (double root) misses or hits as rounding decides.
#[inline]
pub fn ray_sphere(origin: &Vec3, direction: &Vec3, centre: &Vec3, radius: f64, t_min: f64) -> Option<f64> {
    let (s, point) = closest_approach(&(origin - centre), direction, radius);
    // The rest of the dot product is not exactly zero: it is the rounding of `s`.
    let rest = point.dot(direction);
    let discriminant = radius * radius - (point.norm_squared() - rest * rest);
    if !(discriminant > 0.0) {
        return None;
    }
    let half_chord = discriminant.sqrt();
    let near = s + (-rest - half_chord);
    if near > t_min {
        return Some(near);
    }
    let far = s + (half_chord - rest);
    (far > t_min).then_some(far)
}

/// Outward unit normal of the sphere at a point on it.
#[inline]
pub fn normal(point: &Vec3, centre: &Vec3) -> Vec3 {
    (point - centre).normalize()
}

/// Signed distance from the sphere: negative inside (m).
#[inline]
pub fn distance(point: &Vec3, centre: &Vec3, radius: f64) -> f64 {
    (point - centre).norm() - radius
}

/// The smallest box around the sphere.
pub fn bounding_box(centre: &Vec3, radius: f64) -> Aabb {
    let half = Vec3::new(radius, radius, radius);
    Aabb { min: centre - half, max: centre + half }
}

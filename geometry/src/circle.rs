//! Circles in space: the centrelines of rings. Links and closest points.

use crate::{Vec3, rotation::axes};
use nalgebra::UnitQuaternion;

pub use crate::closest::{ClosestPoints, closest_points};

/// A circle in space with an orthonormal right-handed frame: its points are
/// `centre + radius * (cos(t) * u + sin(t) * w)`, and `normal = u x w`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Centre (m).
    pub centre: Vec3,
    /// Unit vector from the centre to the point at `t = 0`.
    pub u: Vec3,
    /// Unit vector from the centre to the point a quarter turn on.
    pub w: Vec3,
    /// Unit vector perpendicular to the circle's plane; the ring's axis.
    pub normal: Vec3,
    /// Distance of all points from the centre (m); positive.
    pub radius: f64,
}

impl Circle {
    /// The circle of a ring at `position`, whose axis is the local z axis and whose point `t = 0` lies on
    /// the local x axis.
    #[inline]
    pub fn from_pose(position: Vec3, orientation: &UnitQuaternion<f64>, radius: f64) -> Circle {
        let (u, w, normal) = axes(orientation);
        Circle { centre: position, u, w, normal, radius }
    }

    /// The point at parameter `t`, given `cos(t)` and `sin(t)` (m).
    #[inline]
    pub fn point(&self, cos: f64, sin: f64) -> Vec3 {
        self.centre + (self.u * cos + self.w * sin) * self.radius
    }

    /// The point of the circle closest to `point` (m). On the axis all points are equally close: the one
    /// at `t = 0` is returned.
    #[inline]
    pub fn closest_point(&self, point: &Vec3) -> Vec3 {
        let d = point - self.centre;
        let (x, y) = (d.dot(&self.u), d.dot(&self.w));
        let rho = (x * x + y * y).sqrt();
        if rho > 0.0 { self.point(x / rho, y / rho) } else { self.point(1.0, 0.0) }
    }
}

/// Distance from a point to the nearest point of a circle (m); minus the minor radius it is the signed
/// distance from a ring's surface.
#[inline]
pub fn point_circle_distance(point: &Vec3, circle: &Circle) -> f64 {
    let d = point - circle.centre;
    let (x, y, height) = (d.dot(&circle.u), d.dot(&circle.w), d.dot(&circle.normal));
    let inward = (x * x + y * y).sqrt() - circle.radius;
    (inward * inward + height * height).sqrt()
}

/// Whether the two circles are linked, that is cannot be drawn apart without cutting one.
///
/// Circle B meets the plane of A in two points; they are linked exactly when one of the two lies inside
/// the disc of A and the other outside. In closed form, without a root or a division. Circles that touch
/// or cross (distance 0) are on the border between linked and not linked, and so is the answer: with
/// exact arithmetic it is `false`, rounding may give either. Coplanar and parallel circles are not linked.
#[inline]
pub fn linked(a: &Circle, b: &Circle) -> bool {
    let d = b.centre - a.centre;
    // Height of B's points over A's plane: h + h_u cos(t) + h_w sin(t).
    let h = d.dot(&a.normal);
    let h_u = b.radius * b.u.dot(&a.normal);
    let h_w = b.radius * b.w.dot(&a.normal);
    let amplitude_squared = h_u * h_u + h_w * h_w;
    let under_root = amplitude_squared - h * h;
    if !(under_root > 0.0) {
        return false;
    }
    // Their squared distance from A's centre, less that of A's own points, at the two points where the
    // height is 0 is (mean +- sqrt(under_root) * half_difference) / amplitude_squared: the signs differ
    // when the mean is smaller than the rest.
    let p = 2.0 * b.radius * d.dot(&b.u);
    let q = 2.0 * b.radius * d.dot(&b.w);
    let constant = d.norm_squared() + b.radius * b.radius - a.radius * a.radius;
    let mean = constant * amplitude_squared - h * (p * h_u + q * h_w);
    let half_difference = q * h_u - p * h_w;
    mean * mean < under_root * (half_difference * half_difference)
}

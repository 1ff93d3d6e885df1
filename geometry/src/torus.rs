//! The torus, in its own frame: axis z, centre at the origin. `rho = sqrt(x^2 + y^2)`.
//!
//! With `X = x^2 + y^2 + z^2` the surface is `((X - R^2 - r^2) / 2R)^2 + z^2 = r^2`: the points whose
//! image `(y, z)` with `y = (X - R^2 - r^2) / 2R` lies on the circle of radius `r` about 0. Along a ray
//! `y` has degree two and `z` degree one, so the ray runs through that plane on a parabola, and the
//! quartic `y^2 + z^2 - r^2` comes out with an error of `1e-16` times the *local* size of `y`, however
//! thin the wire is.

use crate::{Aabb, Circle, Vec3, bernstein, shift::closest_approach};

/// The clip volumes are larger than the torus by this part, so that a ray never starts on the surface
/// it is looking for (in its own plane a ray enters the enclosing sphere and the torus at one point).
/// Large against rounding (1e-16), small enough to cost nothing.
const MARGIN: f64 = 1e-6;

/// Ray parameter of the first crossing of the torus beyond `t_min`, or `None`.
///
/// All in the torus' own frame; `direction` is a unit vector, lengths in metres,
/// `0 < minor_radius <= major_radius`. From inside the wire the crossing is the exit. A ray that only
/// touches the surface (a double root) does not cross it and misses. The result is a function of these
/// arguments alone and never of other objects on the ray, so any order of traversal gives the same bits.
///
/// # Method
/// The ray is cut to the enclosing sphere and slab, its parameter counted from the closest approach to
/// the centre, the quartic written in Bernstein form on what is left (no sign change: a certain miss), its
/// first root isolated and found by [`bernstein::find_root`], and polished by two Newton steps on
/// `(rho - R)^2 + z^2 - r^2`, which does not suffer from the quartic's cancellations.
#[inline]
pub fn ray_torus(
    origin: &Vec3,
    direction: &Vec3,
    major_radius: f64,
    minor_radius: f64,
    t_min: f64,
) -> Option<f64> {
    let outer = (major_radius + minor_radius) * (1.0 + MARGIN);
    let (s, p) = closest_approach(origin, direction, outer);
    // Zero but for rounding; kept, so that a direction that is unit only to rounding costs no accuracy.
    let b = p.dot(direction);
    let squared = p.norm_squared();
    let discriminant = outer * outer - squared;
    if !(discriminant > 0.0) {
        return None;
    }
    let half_chord = discriminant.sqrt();
    let (mut start, mut end) = (-half_chord, half_chord);
    if start < t_min - s {
        start = t_min - s;
    }
    // The slab.
    let height = minor_radius * (1.0 + MARGIN);
    let (mut z_start, mut z_end) = (p.z + direction.z * start, p.z + direction.z * end);
    if (z_start > height && z_end > height) || (z_start < -height && z_end < -height) || !(start < end) {
        return None;
    }
    if z_start > height || z_start < -height {
        z_start = if z_start > height { height } else { -height };
        start = (z_start - p.z) / direction.z;
    }
    if z_end > height || z_end < -height {
        z_end = if z_end > height { height } else { -height };
        end = (z_end - p.z) / direction.z;
    }
    let x_start = squared + start * (2.0 * b + start);
    let x_end = squared + end * (2.0 * b + end);
    // Both ends within the hole: so is all between.
    let hole = (major_radius - minor_radius) * (1.0 - MARGIN);
    let hole_squared = hole * hole;
    if x_start - z_start * z_start < hole_squared && x_end - z_end * z_end < hole_squared && hole > 0.0 {
        return None;
    }
    let radii = major_radius * major_radius + minor_radius * minor_radius;
    let scale = 0.5 / major_radius;
    let y = [
        (x_start - radii) * scale,
        (squared + b * (start + end) + start * end - radii) * scale,
        (x_end - radii) * scale,
    ];
    let r_squared = minor_radius * minor_radius;
    let q = [z_start * z_start - r_squared, z_start * z_end - r_squared, z_end * z_end - r_squared];
    let quartic = quartic_from(&y, &q);

    let ray = RayTorus { p, direction, major_radius, r_squared, start, end };
    let mut hit = f64::NAN;
    bernstein::find_root(&quartic, |x| {
        hit = s + ray.polish(start + x * (end - start));
        hit > t_min
    })
    .map(|_| hit)
}

/// Bernstein coefficients of `y^2 + q`, both given by coefficients of degree 2.
#[inline]
fn quartic_from(y: &[f64; 3], q: &[f64; 3]) -> [f64; 5] {
    const THIRD: f64 = 1.0 / 3.0;
    const SIXTH: f64 = 1.0 / 6.0;
    [
        y[0] * y[0] + q[0],
        y[0] * y[1] + 0.5 * (q[0] + q[1]),
        (y[0] * y[2] + 2.0 * y[1] * y[1]) * THIRD + (q[0] + 4.0 * q[1] + q[2]) * SIXTH,
        y[1] * y[2] + 0.5 * (q[1] + q[2]),
        y[2] * y[2] + q[2],
    ]
}

struct RayTorus<'a> {
    p: Vec3,
    direction: &'a Vec3,
    major_radius: f64,
    r_squared: f64,
    start: f64,
    end: f64,
}

impl RayTorus<'_> {
    /// Two Newton steps on `(rho - R)^2 + z^2 - r^2` from a root of the quartic. A step that would leave
    /// the clipped ray, or is too large to be a correction (at a grazing hit the slope is nearly zero),
    /// is not taken.
    #[inline]
    fn polish(&self, mut u: f64) -> f64 {
        let step_max = (self.end - self.start) * 1e-3;
        for _ in 0..2 {
            let x = self.p.x + u * self.direction.x;
            let y = self.p.y + u * self.direction.y;
            let z = self.p.z + u * self.direction.z;
            let rho = (x * x + y * y).sqrt();
            let across = rho - self.major_radius;
            let value = across * across + z * z - self.r_squared;
            let slope =
                2.0 * (across * (x * self.direction.x + y * self.direction.y) / rho + z * self.direction.z);
            let step = value / slope;
            let next = u - step;
            if step < step_max && step > -step_max && next >= self.start && next <= self.end {
                u = next;
            }
        }
        u
    }
}

/// `(rho - R)^2 + z^2 - r^2` at a point: negative inside the wire, 0 on the surface (m^2).
#[inline]
pub fn value(point: &Vec3, major_radius: f64, minor_radius: f64) -> f64 {
    let across = (point.x * point.x + point.y * point.y).sqrt() - major_radius;
    across * across + point.z * point.z - minor_radius * minor_radius
}

/// Gradient of [`value`] (m); points away from the wire's centreline. On the axis, where it is not
/// defined, the part across the axis is taken as 0.
#[inline]
pub fn gradient(point: &Vec3, major_radius: f64) -> Vec3 {
    let rho = (point.x * point.x + point.y * point.y).sqrt();
    let factor = if rho > 0.0 { 2.0 * (rho - major_radius) / rho } else { 0.0 };
    Vec3::new(factor * point.x, factor * point.y, 2.0 * point.z)
}

/// Outward unit normal at a point on the surface (or near it: it points from the nearest point of the
/// wire's centreline). On the centreline itself, where no direction is better than another, it is +z.
#[inline]
pub fn normal(point: &Vec3, major_radius: f64) -> Vec3 {
    let g = gradient(point, major_radius);
    let length = g.norm();
    if length > 0.0 { g / length } else { Vec3::new(0.0, 0.0, 1.0) }
}

/// The point of the surface closest to `point` (m). On the axis the direction of +x is taken, on the
/// wire's centreline that of +z.
pub fn closest_point(point: &Vec3, major_radius: f64, minor_radius: f64) -> Vec3 {
    let rho = (point.x * point.x + point.y * point.y).sqrt();
    let radial =
        if rho > 0.0 { Vec3::new(point.x / rho, point.y / rho, 0.0) } else { Vec3::new(1.0, 0.0, 0.0) };
    let centreline = radial * major_radius;
    let away = point - centreline;
    let length = away.norm();
    let outward = if length > 0.0 { away / length } else { Vec3::new(0.0, 0.0, 1.0) };
    centreline + outward * minor_radius
}

/// The smallest box around the ring with this centreline and minor radius, in the frame of the circle's
/// centre.
pub fn bounding_box(circle: &Circle, minor_radius: f64) -> Aabb {
    let half = circle.u.zip_map(&circle.w, |u, w| circle.radius * (u * u + w * w).sqrt() + minor_radius);
    Aabb { min: circle.centre - half, max: circle.centre + half }
}

//! The torus, in its own frame: axis z, centre at the origin. `rho = sqrt(x^2 + y^2)`.
//!
//! With `X = x^2 + y^2 + z^2` the surface is `((X - R^2 - r^2) / 2R)^2 + z^2 = r^2`: the points whose
//! image `(y, z)` with `y = (X - R^2 - r^2) / 2R` lies on the circle of radius `r` about 0. Along a ray
//! `y` has degree two and `z` degree one, so the ray runs through that plane on a parabola, and the
//! quartic `y^2 + z^2 - r^2` comes out with an error of `1e-16` times the *local* size of `y`, however
//! thin the wire is.

use crate::{Aabb, Circle, Vec3, bernstein, companion, shift::closest_approach};

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
    crossing::<false>(origin, direction, major_radius, minor_radius, t_min)
}

/// [`ray_torus`] with the roots of the same quartic found by [`companion::find_root`]: to compare, and slower. A double root
/// may count.
pub fn ray_torus_by_companion(
    origin: &Vec3,
    direction: &Vec3,
    major_radius: f64,
    minor_radius: f64,
    t_min: f64,
) -> Option<f64> {
    crossing::<true>(origin, direction, major_radius, minor_radius, t_min)
}

#[inline]
fn crossing<const COMPANION: bool>(
    origin: &Vec3,
    direction: &Vec3,
    major_radius: f64,
    minor_radius: f64,
    t_min: f64,
) -> Option<f64> {
    let outer = (major_radius + minor_radius) * (1.0 + MARGIN);
    let (s, p) = closest_approach(origin, direction, outer);
    let clip = Clip::new(&p, direction, major_radius, minor_radius, t_min - s)?;
    let ray = Ray { p, direction, major_radius, r_squared: minor_radius * minor_radius, clip };
    let mut hit = f64::NAN;
    let accept = |x| {
        hit = s + ray.polish(clip.start + x * (clip.end - clip.start));
        hit > t_min
    };
    let found = if COMPANION {
        companion::find_root(&ray.quartic(), accept)
    } else {
        bernstein::find_root(&ray.quartic(), accept)
    };
    found.map(|_| hit)
}

/// The part of a ray that may meet the torus; `u = t - s` counts from the point `p` of closest approach.
#[derive(Clone, Copy)]
struct Clip {
    start: f64,
    end: f64,
    /// Height over the torus' plane at both ends.
    z_start: f64,
    z_end: f64,
    /// Squared distance from the centre at `p`, and the coefficient of `2 u` in that at `u`: zero but for
    /// rounding, and kept, so that a direction that is unit only to rounding costs no accuracy.
    squared: f64,
    linear: f64,
}

impl Clip {
    /// Cuts the ray to the enclosing sphere, the slab and `u >= u_min`; `None` if nothing is left or all of
    /// it is inside the hole.
    #[inline]
    fn new(p: &Vec3, direction: &Vec3, major_radius: f64, minor_radius: f64, u_min: f64) -> Option<Clip> {
        let outer = (major_radius + minor_radius) * (1.0 + MARGIN);
        let squared = p.norm_squared();
        let discriminant = outer * outer - squared;
        if !(discriminant > 0.0) {
            return None;
        }
        let half_chord = discriminant.sqrt();
        let (mut start, mut end) = (-half_chord, half_chord);
        if start < u_min {
            start = u_min;
        }
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
        let clip = Clip { start, end, z_start, z_end, squared, linear: p.dot(direction) };
        // Both ends within the hole, a convex cylinder: so is all between.
        let hole = (major_radius - minor_radius) * (1.0 - MARGIN);
        let hole_squared = if hole > 0.0 { hole * hole } else { 0.0 };
        let in_hole = clip.distance_squared(start) - z_start * z_start < hole_squared
            && clip.distance_squared(end) - z_end * z_end < hole_squared;
        (!in_hole).then_some(clip)
    }

    /// Squared distance from the centre at `u`.
    #[inline]
    fn distance_squared(&self, u: f64) -> f64 {
        self.squared + u * (2.0 * self.linear + u)
    }
}

/// A clipped ray and a torus.
struct Ray<'a> {
    p: Vec3,
    direction: &'a Vec3,
    major_radius: f64,
    r_squared: f64,
    clip: Clip,
}

impl Ray<'_> {
    /// Bernstein coefficients of `y^2 + z^2 - r^2` on the clipped ray.
    #[inline]
    fn quartic(&self) -> [f64; 5] {
        const THIRD: f64 = 1.0 / 3.0;
        const SIXTH: f64 = 1.0 / 6.0;
        let Clip { start, end, z_start, z_end, squared, linear } = self.clip;
        let radii = self.major_radius * self.major_radius + self.r_squared;
        let scale = 0.5 / self.major_radius;
        let y = [
            (self.clip.distance_squared(start) - radii) * scale,
            (squared + linear * (start + end) + start * end - radii) * scale,
            (self.clip.distance_squared(end) - radii) * scale,
        ];
        let q = [
            z_start * z_start - self.r_squared,
            z_start * z_end - self.r_squared,
            z_end * z_end - self.r_squared,
        ];
        [
            y[0] * y[0] + q[0],
            y[0] * y[1] + 0.5 * (q[0] + q[1]),
            (y[0] * y[2] + 2.0 * y[1] * y[1]) * THIRD + (q[0] + 4.0 * q[1] + q[2]) * SIXTH,
            y[1] * y[2] + 0.5 * (q[1] + q[2]),
            y[2] * y[2] + q[2],
        ]
    }

    /// Two Newton steps on `(rho - R)^2 + z^2 - r^2` from a root of the quartic. A step that would leave
    /// the clipped ray, or is too large to be a correction (at a grazing hit the slope is nearly zero),
    /// is not taken.
    #[inline]
    fn polish(&self, mut u: f64) -> f64 {
        let Clip { start, end, .. } = self.clip;
        let step_max = (end - start) * 1e-3;
        for _ in 0..2 {
            let x = self.p.x + u * self.direction.x;
            let y = self.p.y + u * self.direction.y;
            let z = self.p.z + u * self.direction.z;
            let rho = (x * x + y * y).sqrt();
            let across = rho - self.major_radius;
            let value = across * across + z * z - self.r_squared;
            // Both multiplied by rho, which saves a division.
            let half_slope =
                across * (x * self.direction.x + y * self.direction.y) + z * self.direction.z * rho;
            let step = 0.5 * value * rho / half_slope;
            let next = u - step;
            if step < step_max && step > -step_max && next >= start && next <= end {
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

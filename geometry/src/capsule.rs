//! Capsules, in their own frame: all points within a radius of the segment `|z| <= half_length` of the z axis.

use crate::{Aabb, Vec3, shift::closest_approach, sphere};

/// Outward unit direction from the nearest point of the segment to `point`, and the distance from it (m).
///
/// On the segment itself the direction is the x axis: a fixed choice where there is none.
#[inline]
pub fn segment_distance(point: &Vec3, half_length: f64) -> (Vec3, f64) {
    let z = if point.z > half_length {
        point.z - half_length
    } else if point.z < -half_length {
        point.z + half_length
    } else {
        0.0
    };
    let apart = Vec3::new(point.x, point.y, z);
    let distance = apart.norm_squared().sqrt();
    if distance > 0.0 { (apart * (1.0 / distance), distance) } else { (Vec3::x(), 0.0) }
}

/// The part of the line `origin + t direction` inside the capsule: where it enters and where it leaves, or
/// `None`. `direction` is a unit vector.
///
/// A capsule is convex, so the part is one interval: from the first to the last of the places where the line
/// meets the wall between the caps, or a cap's sphere beyond the wall's end. A line that only touches misses or
/// hits as rounding decides.
pub fn ray_interval(origin: &Vec3, direction: &Vec3, half_length: f64, radius: f64) -> Option<(f64, f64)> {
    let mut interval: Option<(f64, f64)> = None;
    let mut meets = |t: f64| {
        interval = Some(match interval {
            Some((first, last)) => (if t < first { t } else { first }, if t > last { t } else { last }),
            None => (t, t),
        });
    };
    // The wall: the line as seen along the axis, about its point of closest approach there.
    let across = direction.x * direction.x + direction.y * direction.y;
    if across > 0.0 {
        let nearest = -(origin.x * direction.x + origin.y * direction.y) / across;
        let (x, y) = (origin.x + nearest * direction.x, origin.y + nearest * direction.y);
        let inside = radius * radius - (x * x + y * y);
        if inside > 0.0 {
            let half = (inside / across).sqrt();
            for t in [nearest - half, nearest + half] {
                let z = origin.z + t * direction.z;
                if z >= -half_length && z <= half_length {
                    meets(t);
                }
            }
        }
    }
    for end in [-half_length, half_length] {
        let from = Vec3::new(origin.x, origin.y, origin.z - end);
        let s = -from.dot(direction);
        let point = from + direction * s;
        let inside = radius * radius - point.norm_squared();
        if inside > 0.0 {
            let half = inside.sqrt();
            for t in [s - half, s + half] {
                let z = origin.z + t * direction.z;
                // Only beyond the wall's end is the sphere the capsule's surface.
                if (end < 0.0 && z <= end) || (end >= 0.0 && z >= end) {
                    meets(t);
                }
            }
        }
    }
    interval
}

/// Ray parameter of the first crossing of the capsule beyond `t_min`, or `None`; from inside it is the exit.
/// Own frame; `direction` is a unit vector.
#[inline]
pub fn ray_capsule(
    origin: &Vec3,
    direction: &Vec3,
    half_length: f64,
    radius: f64,
    t_min: f64,
) -> Option<f64> {
    // Counted from the closest approach to the centre, so that an origin far away costs no accuracy.
    let (s, near) = closest_approach(origin, direction, half_length + radius);
    let (entry, exit) = ray_interval(&near, direction, half_length, radius)?;
    let (entry, exit) = (s + entry, s + exit);
    if entry > t_min { Some(entry) } else { (exit > t_min).then_some(exit) }
}

/// The smallest box around a capsule whose axis is the unit vector `axis`; World frame.
pub fn bounding_box(centre: &Vec3, axis: &Vec3, half_length: f64, radius: f64) -> Aabb {
    let end = axis * half_length;
    sphere::bounding_box(&(centre + end), radius).union(&sphere::bounding_box(&(centre - end), radius))
}

/// Principal moments of inertia of a solid capsule of uniform density, about its own axes (kg m^2).
///
/// # Source
/// Cylinder and two half balls: volumes `2 pi r^2 h` and `4/3 pi r^3`; a half ball's centre lies `3/8 r` beyond
/// the wall's end and its moment about a line across the axis through that centre is `83/320 m r^2`.
pub fn inertia(half_length: f64, radius: f64, mass: f64) -> [f64; 3] {
    let (h, r) = (half_length, radius);
    // Shares of the mass: the volumes without their common factor pi r^2.
    let (wall, balls) = (2.0 * h, 4.0 / 3.0 * r);
    let (wall, balls) = (mass * wall / (wall + balls), mass * balls / (wall + balls));
    let axial = 0.5 * wall * r * r + 0.4 * balls * r * r;
    let out = h + 0.375 * r;
    let across = wall * (0.25 * r * r + h * h / 3.0) + balls * (83.0 / 320.0 * r * r + out * out);
    [across, across, axial]
}

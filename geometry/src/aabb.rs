//! Axis-aligned bounding boxes.

use crate::Vec3;

/// A box with faces parallel to the axes: all points with `min <= p <= max` in each coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Corner with the smallest coordinates (m).
    pub min: Vec3,
    /// Corner with the largest coordinates (m).
    pub max: Vec3,
}

impl Aabb {
    /// The box that holds nothing: neutral for [`Aabb::union`].
    pub const EMPTY: Aabb = Aabb {
        min: Vec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        max: Vec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The smallest box that holds both.
    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb {
            min: self.min.zip_map(&other.min, |a, b| if b < a { b } else { a }),
            max: self.max.zip_map(&other.max, |a, b| if b > a { b } else { a }),
        }
    }

    /// Whether no point is inside.
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }

    /// Area of the six faces (m^2); 0 for an empty box.
    pub fn surface_area(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let size = self.max - self.min;
        2.0 * (size.x * size.y + size.y * size.z + size.z * size.x)
    }

    /// The middle of the box.
    pub fn centre(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Whether the two boxes share a point (touching counts).
    pub fn overlaps(&self, other: &Aabb) -> bool {
        (0..3).all(|i| self.min[i] <= other.max[i] && other.min[i] <= self.max[i])
    }

    /// The part of `[t_min, t_max]` in which the ray `origin + t * direction` is inside the box, or
    /// `None` if it misses. `inverse_direction` is `1 / direction` in each coordinate, infinite where
    /// the direction is 0.
    ///
    /// A ray that runs exactly within a face counts as inside. The bounds are rounded, not widened: who
    /// culls by them must leave a margin of a few `1e-16` of the largest coordinate.
    pub fn ray_interval(
        &self,
        origin: &Vec3,
        inverse_direction: &Vec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<(f64, f64)> {
        let (mut start, mut end) = (t_min, t_max);
        for i in 0..3 {
            let a = (self.min[i] - origin[i]) * inverse_direction[i];
            let b = (self.max[i] - origin[i]) * inverse_direction[i];
            // 0 * infinity is NaN, for an origin on a face of which the ray is parallel: both
            // comparisons with NaN are false, so that face sets no bound.
            let (near, far) = if inverse_direction[i] < 0.0 { (b, a) } else { (a, b) };
            if near > start {
                start = near;
            }
            if far < end {
                end = far;
            }
        }
        (start <= end).then_some((start, end))
    }
}

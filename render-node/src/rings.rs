//! Rings in their places.

use crate::colour::Wire;
use geometry::{Aabb, Circle, Vec3, rotation, torus};
use nalgebra::{Quaternion, UnitQuaternion};
use schemas::state::BodyState;

/// A ring's place in World, and its size.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct PlacedRing {
    pub centre: Vec3,
    pub normal: Vec3,
    pub major_radius: f64,
    pub minor_radius: f64,
}

/// Axes of a body's frame: the images of x, y and z.
#[inline]
pub(crate) fn axes(state: &BodyState) -> (Vec3, Vec3, Vec3) {
    let [x, y, z, w] = state.orientation;
    rotation::axes(&UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)))
}

impl PlacedRing {
    pub(crate) fn wire(&self, state: &BodyState) -> Wire {
        let PlacedRing { centre, major_radius: radius, minor_radius, .. } = *self;
        let (u, w, normal) = axes(state);
        let circle = Circle { centre, u, w, normal, radius };
        Wire { circle, minor_radius, bounds: torus::bounding_box(&circle, minor_radius) }
    }

    /// Outward unit normal at a point of the surface, and whether the tangent plane there has the whole ring on one side:
    /// it has on the outer half.
    #[inline]
    pub(crate) fn outward(&self, point: &Vec3) -> (Vec3, bool) {
        let from_centre = point - self.centre;
        let height = self.normal.dot(&from_centre);
        let across = from_centre - self.normal * height;
        let rho_squared = across.norm_squared();
        let rho = rho_squared.sqrt();
        // Away from the nearest point of the wire's centreline.
        let share = if rho > 0.0 { (rho - self.major_radius) / rho } else { 0.0 };
        let away = across * share + self.normal * height;
        let length = away.norm();
        let outward = if length > 0.0 { away / length } else { self.normal };
        (outward, rho_squared >= self.major_radius * self.major_radius)
    }

    #[inline]
    pub(crate) fn bounding_box(&self) -> Aabb {
        let half = self.normal.map(|n| {
            let squared = 1.0 - n * n;
            let reach = if squared > 0.0 { squared.sqrt() } else { 0.0 };
            // The square carries the normal's rounding, which counts where the ring stands across an axis.
            self.major_radius * (reach + 1e-7) + self.minor_radius
        });
        Aabb { min: self.centre - half, max: self.centre + half }
    }
}

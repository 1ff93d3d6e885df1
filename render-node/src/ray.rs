//! Where light travels: a ray, and the point of a surface where it turns.

use crate::bsdf::Bsdf;
use geometry::Vec3;

/// A half line. World frame.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it begins, in metres.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// The body or plane that the ray leaves and cannot meet again, as [`Hit::surface`](crate::Hit) numbers it.
    pub leaves: Option<u32>,
}

impl Ray {
    /// A ray that may meet anything.
    pub fn new(origin: Vec3, direction: Vec3) -> Ray {
        Ray { origin, direction, leaves: None }
    }
}

/// A point where a path is reflected.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex<'a> {
    pub point: Vec3,
    /// Unit normal on the side from which the path came.
    pub normal: Vec3,
    pub bsdf: &'a Bsdf,
    /// The surface, if a ray that leaves it cannot meet it again.
    pub leaves: Option<u32>,
}

impl Vertex<'_> {
    /// A ray from here.
    pub(crate) fn leave(&self, direction: Vec3) -> Ray {
        Ray { origin: self.point, direction, leaves: self.leaves }
    }
}

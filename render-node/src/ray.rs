//! Where light travels: a ray, and the point of a surface where it turns.

use crate::bsdf::Bsdf;
use geometry::Vec3;
use geometry::each_lane;
use geometry::lanes::{LANES, Row, Simd, SimdBase, Vectors, columns_of};

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

/// Up to sixteen rays side by side. Lanes beyond the last one are the first once more.
#[derive(Clone, Copy)]
pub(crate) struct RayLanes<S: Simd> {
    pub origin: Vectors<S>,
    pub direction: Vectors<S>,
    /// What each leaves; `u32::MAX` for nothing.
    pub leaves: [u32; LANES],
}

impl<S: Simd> RayLanes<S> {
    /// At least one ray.
    #[inline(always)]
    pub(crate) fn load(simd: S, rays: &[Ray]) -> RayLanes<S> {
        let last = rays.len() - 1;
        let rays: [&Ray; LANES] = each_lane!(lane => &rays[if lane <= last { lane } else { 0 }]);
        let first = columns_of(each_lane!(lane => {
            let Ray { origin: o, direction: d, .. } = rays[lane];
            Row::load_array(simd, [o.x, o.y, o.z, d.x])
        }));
        let second = columns_of(each_lane!(lane => {
            let d = &rays[lane].direction;
            Row::load_array(simd, [d.y, d.z, 0.0, 0.0])
        }));
        RayLanes {
            origin: Vectors([first[0], first[1], first[2]]),
            direction: Vectors([first[3], second[0], second[1]]),
            leaves: each_lane!(lane => rays[lane].leaves.unwrap_or(u32::MAX)),
        }
    }

    /// A bit for each ray that leaves this surface.
    #[inline(always)]
    pub(crate) fn that_leave(&self, surface: u32) -> u32 {
        equal(&self.leaves, surface)
    }
}

/// A bit for each lane that has this number.
#[inline(always)]
pub(crate) fn equal(numbers: &[u32; LANES], number: u32) -> u32 {
    let mut bits = 0;
    let mut lane = 0;
    while lane < LANES {
        bits |= u32::from(numbers[lane] == number) << lane;
        lane += 1;
    }
    bits
}

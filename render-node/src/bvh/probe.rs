//! Rays, prepared for the tree: in `f32`, from where they come near the bodies.

use super::trace::Reach;
use super::{Bvh, NONE};
use crate::flat::all_lanes;
use crate::ray::{Ray, RayLanes};
use geometry::lanes::{LANES, Lanes, Simd};

/// A ray, prepared for `f32`; it begins where it comes near the bodies.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Probe {
    /// Relative to the middle of the tree's bounds.
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    pub inverse: [f32; 3],
    /// Bit k is set where the ray runs down axis k: the upper bounds are the nearer ones.
    pub down: u32,
    /// No box that holds a hit that is asked for begins beyond this distance; below zero where nothing more is asked.
    pub limit: f32,
    /// The body that the ray cannot meet.
    pub leaves: u32,
}

impl Bvh {
    /// The probes of up to sixteen rays, and a bit for each that comes near the bodies.
    #[inline(always)]
    pub(super) fn probes<S: Simd>(
        &self,
        simd: S,
        rays: &[Ray],
        reaches: &mut [Reach],
        probes: &mut [Probe],
    ) -> u32 {
        let RayLanes { origin: ray_origin, direction: ray_direction, leaves } = RayLanes::load(simd, rays);
        // In f64 to where the ray comes within D of its point nearest to the middle: so far from all bodies that none
        // is met before, and so near that f32 can tell them apart.
        let half_diagonal = self.place.half_diagonal;
        let to_middle = all_lanes(simd, &self.place.middle).minus(&ray_origin);
        let nearest = to_middle.dot(&ray_direction);
        let passed = nearest.simd_lt(Lanes::splat(simd, -1.01 * half_diagonal));
        // The distance of that point from the middle is wrong by at most 5e-16 of the origin's, e say; and
        // (D + e)^2 is at most 1.01 D^2 + 101 e^2.
        let miss = ray_direction.times(nearest).minus(&to_middle);
        let reach_squared = 1.01 * half_diagonal * half_diagonal + 1e-28 * to_middle.dot(&to_middle);
        let near_bodies = !(passed | miss.dot(&miss).simd_gt(reach_squared)).to_bitmask();
        let far = nearest.simd_gt(Lanes::splat(simd, half_diagonal));
        let entry = far.select(nearest - half_diagonal, Lanes::splat(simd, 0.0));
        let place = ray_direction.times(entry).minus(&to_middle);
        let mut entries = [0.0; LANES];
        entry.store_array(&mut entries);
        let (mut origins, mut directions) = ([[0.0_f32; LANES]; 3], [[0.0_f32; LANES]; 3]);
        let mut inverses = [[0.0_f32; LANES]; 3];
        for (origin, place) in origins.iter_mut().zip(place.0) {
            narrow(place, origin);
        }
        let rows = directions.iter_mut().zip(&mut inverses).zip(ray_direction.0);
        for ((direction, inverse), wide) in rows {
            narrow(wide, direction);
            for (inverse, direction) in inverse.iter_mut().zip(direction) {
                *inverse = 1.0 / *direction;
            }
        }
        for (lane, (reach, probe)) in reaches.iter_mut().zip(probes).enumerate().take(LANES) {
            reach.entry = entries[lane];
            let inverse = [inverses[0][lane], inverses[1][lane], inverses[2][lane]];
            let down = [inverse[0] < 0.0, inverse[1] < 0.0, inverse[2] < 0.0];
            *probe = Probe {
                origin: [origins[0][lane], origins[1][lane], origins[2][lane]],
                direction: [directions[0][lane], directions[1][lane], directions[2][lane]],
                inverse,
                down: u32::from(down[0]) | u32::from(down[1]) << 1 | u32::from(down[2]) << 2,
                limit: self.limit(reach),
                leaves: leaves[lane],
            };
        }
        near_bodies
    }

    /// A ray's distance as a limit of boxes: no box that holds a hit up to it begins beyond.
    #[inline(always)]
    pub(super) fn limit(&self, reach: &Reach) -> f32 {
        let limit = ((reach.distance - reach.entry) * (1.0 + 1e-6) + self.place.margin) as f32;
        // Finite, so that a child that is missed, with its infinite entry, is always beyond.
        if limit < f32::MAX { limit } else { f32::MAX }
    }
}

#[inline(always)]
fn narrow<S: Simd>(wide: Lanes<S>, narrow: &mut [f32; LANES]) {
    let mut numbers = [0.0; LANES];
    wide.store_array(&mut numbers);
    for (narrow, number) in narrow.iter_mut().zip(numbers) {
        *narrow = number as f32;
    }
}

/// What a ray leaves is told in the same way in probes and columns.
const _: () = assert!(NONE == u32::MAX);

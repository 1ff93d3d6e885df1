//! Planes and lights, which no tree holds: rays ask each of them, sixteen side by side.

use crate::bvh::Reach;
use crate::ray::{Ray, RayLanes, equal};
use crate::world::{ShadowEnd, World};
use geometry::Vec3;
use geometry::lanes::{LANES, Lanes, Level, Mask, Simd, Vectors, dispatch};

/// Where rays meet a plane beyond `start`, as [`geometry::plane::ray_plane`] says; NaN where they do not.
#[inline(always)]
pub(crate) fn meet_plane<S: Simd>(
    simd: S,
    rays: &RayLanes<S>,
    normal: &Vec3,
    offset: f64,
    start: f64,
) -> Lanes<S> {
    let normal = all_lanes(simd, normal);
    let t = (offset - normal.dot(&rays.origin)) / normal.dot(&rays.direction);
    let met = t.simd_gt(Lanes::splat(simd, start)) & t.simd_lt(Lanes::splat(simd, f64::INFINITY));
    met.select(t, Lanes::splat(simd, f64::NAN))
}

#[inline(always)]
pub(crate) fn all_lanes<S: Simd>(simd: S, v: &Vec3) -> Vectors<S> {
    Vectors([Lanes::splat(simd, v.x), Lanes::splat(simd, v.y), Lanes::splat(simd, v.z)])
}

impl World<'_> {
    /// The nearest planes and lights that rays meet. Each as `World::closest_plane_or_light` says.
    pub(crate) fn closest_flat(&self, level: Level, rays: &[Ray], reaches: &mut Vec<Reach>) {
        reaches.clear();
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.closest_flat_with(simd, rays, reaches)
        ));
    }

    #[inline(always)]
    fn closest_flat_with<S: Simd>(&self, simd: S, rays: &[Ray], reaches: &mut Vec<Reach>) {
        let (mut distances, mut surfaces) = ([0.0; LANES], [0.0; LANES]);
        let start = self.bodies.ray_start();
        for rays in rays.chunks(LANES) {
            let lanes = RayLanes::load(simd, rays);
            let mut nearest = Lanes::splat(simd, f64::INFINITY);
            let mut surface = Lanes::splat(simd, f64::from(Reach::NOTHING));
            for (number, plane) in (self.bodies.count()..).zip(self.planes()) {
                let t = meet_plane(simd, &lanes, &plane.normal, plane.offset, start);
                let nearer = t.simd_lt(nearest) & Mask::from_bitmask(simd, !lanes.that_leave(number));
                nearest = nearer.select(t, nearest);
                surface = nearer.select(Lanes::splat(simd, f64::from(number)), surface);
            }
            for (number, light) in (self.first_light()..).zip(self.lights()) {
                let t = light.hit_each(simd, rays, &lanes, start);
                let nearer = t.simd_lt(nearest);
                nearest = nearer.select(t, nearest);
                surface = nearer.select(Lanes::splat(simd, f64::from(number)), surface);
            }
            nearest.store_array(&mut distances);
            surface.store_array(&mut surfaces);
            for (&distance, &surface) in distances.iter().zip(&surfaces).take(rays.len()) {
                reaches.push(Reach::at(distance, surface as u32));
            }
        }
    }

    /// Whether rays meet a plane or a light before their ends. Each as `World::any_plane_or_light` says.
    pub(crate) fn any_flat(&self, level: Level, rays: &[Ray], ends: &[ShadowEnd], reaches: &mut Vec<Reach>) {
        reaches.clear();
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.any_flat_with(simd, rays, ends, reaches)
        ));
    }

    #[inline(always)]
    fn any_flat_with<S: Simd>(&self, simd: S, rays: &[Ray], ends: &[ShadowEnd], reaches: &mut Vec<Reach>) {
        let (mut distances, mut targets) = ([0.0; LANES], [0; LANES]);
        let (start, first_light) = (self.bodies.ray_start(), self.first_light());
        for (rays, ends) in rays.chunks(LANES).zip(ends.chunks(LANES)) {
            let lanes = RayLanes::load(simd, rays);
            for (lane, end) in ends.iter().enumerate().take(LANES) {
                distances[lane] = end.distance;
                targets[lane] = match end.target {
                    Some(index) => first_light + index as u32,
                    None => Reach::NOTHING,
                };
            }
            let here = u32::MAX >> (32 - rays.len() as u32);
            let distance = Lanes::load_array_ref(simd, &distances);
            let mut blocked = 0;
            for (number, plane) in (self.bodies.count()..).zip(self.planes()) {
                let t = meet_plane(simd, &lanes, &plane.normal, plane.offset, start);
                blocked |= t.simd_lt(distance).to_bitmask() & !lanes.that_leave(number);
            }
            for (number, light) in (first_light..).zip(self.lights()) {
                let asked = here & !equal(&targets, number);
                if asked != 0 {
                    blocked |=
                        light.hit_each(simd, rays, &lanes, start).simd_lt(distance).to_bitmask() & asked;
                }
            }
            for (lane, &distance) in distances.iter().enumerate().take(rays.len()) {
                reaches.push(Reach::before(distance, blocked >> lane & 1 == 1));
            }
        }
    }
}

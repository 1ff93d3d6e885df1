//! The path tracer: what light comes back along a ray.

use crate::model::RenderModel;
use crate::ray::{Ray, Vertex};
use crate::sampler::Sampler;
use crate::warp;
use crate::world::{Surface, World};
use core::f64::consts::FRAC_1_PI;
use geometry::Vec3;

/// Pairs of random dimensions that a path of so many bounces uses.
pub(crate) fn dimension_pairs(bounces_max: u32) -> usize {
    1 + 2 * (bounces_max as usize + 1)
}

/// The picture's position within its pixel uses the first pair of dimensions.
pub(crate) const PIXEL_PAIR: usize = 0;

/// Traces paths in one posed scene.
pub(crate) struct PathTracer<'a> {
    pub model: &'a RenderModel,
    pub world: &'a World<'a>,
    /// Rays traced so far.
    pub rays: u64,
}

impl PathTracer<'_> {
    /// Radiance (red, green, blue) that arrives against a camera ray: one sample of it.
    ///
    /// All surfaces are Lambertian, so a bounce in a cosine-weighted direction multiplies the path's throughput
    /// by the albedo. At every vertex one area light is asked for its light by a shadow ray; light that a bounced
    /// ray meets is therefore not counted again. The sky is what a bounced ray sees when it meets nothing. After
    /// `bounces_max` bounces the last ray only asks whether the sky is there.
    pub(crate) fn radiance(&mut self, camera_ray: Ray, sampler: &Sampler) -> Vec3 {
        let bounces_max = self.model.render.bounces_max;
        let mut radiance = Vec3::zeros();
        let mut throughput = Vec3::new(1.0, 1.0, 1.0);
        let mut ray = camera_ray;
        for bounce in 0..=bounces_max {
            self.rays += 1;
            let Some(hit) = self.world.closest(&ray) else {
                return radiance + throughput.component_mul(&self.model.sky.radiance(&ray.direction));
            };
            let Surface::Reflecting(vertex) = self.world.surface(&ray, &hit) else {
                let seen_directly = bounce == 0;
                return if seen_directly { self.world.emitted(&ray, &hit) } else { radiance };
            };
            throughput.component_mul_assign(&vertex.albedo);
            if throughput == Vec3::zeros() {
                return radiance;
            }
            let dimensions = 1 + 2 * bounce as usize;
            if self.model.features.area_lights {
                radiance += throughput.component_mul(&self.light_from_one(&vertex, sampler.pair(dimensions)));
            }
            let local = warp::cosine_hemisphere(sampler.pair(dimensions + 1));
            ray = vertex.leave(warp::about(&vertex.normal, &local));
        }
        if self.model.features.sky {
            self.rays += 1;
            if !self.world.any(&ray, f64::INFINITY, None) {
                radiance += throughput.component_mul(&self.model.sky.radiance(&ray.direction));
            }
        }
        radiance
    }

    /// Radiance that a white Lambertian surface reflects from the area lights: one of them, chosen at random,
    /// stands for all.
    fn light_from_one(&mut self, vertex: &Vertex, (u, v): (f64, f64)) -> Vec3 {
        let count = self.model.lights.len();
        // The whole part of `count u` chooses; the rest is again uniform.
        let scaled = u * count as f64;
        let index = scaled as usize;
        let light = &self.model.lights[index];
        let Some(sample) = light.sample(&vertex.point, (scaled - index as f64, v)) else {
            return Vec3::zeros();
        };
        let cosine = sample.direction.dot(&vertex.normal);
        if !(cosine > 0.0) || !light.is_lit() {
            return Vec3::zeros();
        }
        self.rays += 1;
        if self.world.any(&vertex.leave(sample.direction), sample.distance, Some(index)) {
            return Vec3::zeros();
        }
        sample.weighted_radiance * (FRAC_1_PI * cosine * count as f64)
    }
}

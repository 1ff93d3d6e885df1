//! The path tracer: what light comes back along a ray.

use crate::film::luminance;
use crate::model::{RenderModel, Shining};
use crate::ray::{Ray, Vertex};
use crate::sampler::Sampler;
use crate::warp::Frame;
use crate::world::{Surface, World};
use geometry::Vec3;
use schemas::scene::render::{DirectLight, UNLIMITED};

/// Pairs of random dimensions that are not those of a bounce: where in the pixel, where in the lens.
pub(crate) const PIXEL_PAIR: usize = 0;
pub(crate) const LENS_PAIR: usize = 1;
/// Pairs of every bounce: which light and where on it, where to go on, whether to go on.
const LIGHT_PAIR: usize = 2;
const BSDF_PAIR: usize = 3;
const ROULETTE_PAIR: usize = 4;
const PAIRS_OF_A_BOUNCE: usize = 3;
/// With no limit of bounces a path ends with at least this probability at each, so that it ends among white walls, too.
const END_LEAST: f64 = 0.05;

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
    /// At every vertex one light is asked for its light by a shadow ray, and the path goes on in a direction that the
    /// surface chooses; where that meets a light by itself, the two ways to find its light are weighted against each other
    /// (multiple importance sampling). The sky, which is never asked, is what a bounced ray sees when it meets nothing. After `bounces_max`
    /// bounces the last ray only asks what shines on it. After `roulette_after` bounces a path goes on with the probability
    /// of its throughput, which is divided by it (Russian roulette), so the mean stays the same.
    pub(crate) fn radiance(&mut self, camera_ray: Ray, sampler: &mut Sampler) -> Vec3 {
        let settings = &self.model.render;
        let (bounces_max, roulette_after) = (settings.bounces_max, settings.roulette_after);
        let mut radiance = Vec3::zeros();
        let mut throughput = Vec3::repeat(1.0);
        let mut ray = camera_ray;
        // Density with which the surface chose the ray's direction; none where no other could have been chosen.
        let mut bsdf_pdf = None;
        for bounce in 0..=bounces_max {
            self.rays += 1;
            let Some(hit) = self.world.closest(&ray) else {
                let light = throughput.component_mul(&self.sky_met(&ray, bsdf_pdf));
                return radiance + self.cut(light, bounce);
            };
            let vertex = match self.world.surface(&ray, &hit) {
                Surface::Scattering(vertex) => vertex,
                Surface::Emitter(emitted) => {
                    return radiance + self.cut(throughput.component_mul(&emitted), bounce);
                }
                Surface::Light(light) => {
                    let emitted = self.light_met(light, &ray, hit.distance, bsdf_pdf);
                    return radiance + self.cut(throughput.component_mul(&emitted), bounce);
                }
            };
            let frame = Frame::about(&vertex.normal);
            let wo = -frame.local(&ray.direction);
            let dimensions = PAIRS_OF_A_BOUNCE * bounce as usize;
            if self.model.features.lights && !vertex.bsdf.is_mirror() {
                let light = self.light_asked(&vertex, &frame, &wo, sampler.pair(dimensions + LIGHT_PAIR));
                radiance += self.cut(throughput.component_mul(&light), bounce + 1);
            }
            let Some(sample) = vertex.bsdf.sample(&wo, sampler.pair(dimensions + BSDF_PAIR)) else {
                return radiance;
            };
            throughput.component_mul_assign(&sample.weight);
            if throughput == Vec3::zeros() {
                return radiance;
            }
            if bounce >= roulette_after {
                let most = if bounces_max == UNLIMITED { 1.0 - END_LEAST } else { 1.0 };
                let share = at_most(throughput.max(), most);
                if sampler.pair(dimensions + ROULETTE_PAIR).0 >= share {
                    return radiance;
                }
                throughput /= share;
            }
            bsdf_pdf = sample.pdf;
            ray = vertex.leave(frame.world(&sample.wi));
        }
        let light = throughput.component_mul(&self.last_light(&ray, bsdf_pdf));
        radiance + self.cut(light, bounces_max.saturating_add(1))
    }

    /// Light that comes after so many reflections, cut down to `indirect_max` after more than one.
    #[inline]
    fn cut(&self, light: Vec3, reflections: u32) -> Vec3 {
        match self.model.render.indirect_max {
            Some(most) if reflections > 1 => {
                let luminance = luminance(&light);
                // A number that is not finite goes on, to be counted and named.
                if luminance > most && luminance.is_finite() { light * (most / luminance) } else { light }
            }
            _ => light,
        }
    }

    /// Light that the surface at a vertex sends along `wo` from one light, chosen at random, that stands for all.
    fn light_asked(&mut self, vertex: &Vertex, frame: &Frame, wo: &Vec3, (u, v): (f64, f64)) -> Vec3 {
        if self.model.shining.is_empty() {
            return Vec3::zeros();
        }
        let count = self.model.shining.len() as f64;
        // The whole part of `count u` chooses; the rest is again uniform.
        let scaled = u * count;
        let chosen = scaled as usize;
        let square = (scaled - chosen as f64, v);
        let (sample, target) = match self.model.shining[chosen] {
            Shining::Area(index) => (self.model.lights[index].sample(&vertex.point, square), Some(index)),
            Shining::Sun(index) => (Some(self.model.suns[index].sample(square)), None),
            Shining::Environment => {
                (self.model.environment.as_ref().map(|environment| environment.sample(square)), None)
            }
        };
        let Some(sample) = sample else { return Vec3::zeros() };
        let wi = frame.local(&sample.direction);
        let bsdf = vertex.bsdf.eval(wo, &wi);
        if !(wi.z > 0.0) || bsdf == Vec3::zeros() {
            return Vec3::zeros();
        }
        let light_pdf = sample.pdf / count;
        let weight = match self.model.render.direct_light {
            DirectLight::Mis => mis_weight(light_pdf, vertex.bsdf.pdf(wo, &wi)),
            DirectLight::Lights => 1.0,
            DirectLight::Bsdf => return Vec3::zeros(),
        };
        self.rays += 1;
        if self.world.any(&vertex.leave(sample.direction), sample.distance, target) {
            return Vec3::zeros();
        }
        bsdf.component_mul(&sample.radiance) * (weight / light_pdf)
    }

    /// Light of a light that a ray from camera or surface meets by itself.
    fn light_met(&self, light: usize, ray: &Ray, distance: f64, bsdf_pdf: Option<f64>) -> Vec3 {
        let light = &self.model.lights[light];
        let emitted = light.emitted(&ray.direction);
        if emitted == Vec3::zeros() {
            return emitted;
        }
        emitted * self.weight_met(bsdf_pdf, || light.pdf(&ray.origin, &ray.direction, distance))
    }

    /// Light from infinitely far away, of a ray that meets nothing.
    #[inline]
    fn sky_met(&self, ray: &Ray, bsdf_pdf: Option<f64>) -> Vec3 {
        let mut light = match &self.model.environment {
            None => self.model.sky.radiance(&ray.direction),
            Some(environment) => {
                let (radiance, light_pdf) = environment.eval(&ray.direction);
                radiance * self.weight_met(bsdf_pdf, || light_pdf)
            }
        };
        for sun in &self.model.suns {
            if sun.stands_at(&ray.direction) {
                light += sun.radiance * self.weight_met(bsdf_pdf, || sun.pdf);
            }
        }
        light
    }

    /// The share of light that counts where a ray meets it by itself, by the density with which its direction was chosen
    /// and that with which a question to its light would have chosen it.
    fn weight_met(&self, bsdf_pdf: Option<f64>, light_pdf: impl FnOnce() -> f64) -> f64 {
        match (bsdf_pdf, self.model.render.direct_light) {
            (None, _) | (_, DirectLight::Bsdf) => 1.0,
            (_, DirectLight::Lights) => 0.0,
            (Some(bsdf_pdf), DirectLight::Mis) => {
                mis_weight(bsdf_pdf, light_pdf() / self.model.shining.len() as f64)
            }
        }
    }

    /// What shines along the last ray of a path: nothing, a light, a body that glows, or the sky.
    fn last_light(&mut self, ray: &Ray, bsdf_pdf: Option<f64>) -> Vec3 {
        if self.model.features.emitters {
            self.rays += 1;
            return match self.world.closest(ray) {
                None => self.sky_met(ray, bsdf_pdf),
                Some(hit) => match self.world.surface(ray, &hit) {
                    Surface::Scattering(_) => Vec3::zeros(),
                    Surface::Emitter(emitted) => emitted,
                    Surface::Light(light) => self.light_met(light, ray, hit.distance, bsdf_pdf),
                },
            };
        }
        // What it would see were there no bodies tells whether they have to be looked at.
        let (light, distance, target) = match self.world.closest_light(ray) {
            Some((index, distance)) => {
                (self.light_met(index, ray, distance, bsdf_pdf), distance, Some(index))
            }
            None if self.model.features.sky => (self.sky_met(ray, bsdf_pdf), f64::INFINITY, None),
            None => return Vec3::zeros(),
        };
        if light == Vec3::zeros() {
            return light;
        }
        self.rays += 1;
        if self.world.any(ray, distance, target) { Vec3::zeros() } else { light }
    }
}

/// The share of a way to find light against another one, by the densities with which they find it.
///
/// # Source
/// The power heuristic with exponent 2: Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo
/// Rendering", SIGGRAPH 1995, eq. 11. As a quotient, so that large densities do not overflow.
#[inline]
fn mis_weight(own: f64, other: f64) -> f64 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

#[inline]
fn at_most(value: f64, most: f64) -> f64 {
    if value < most { value } else { most }
}

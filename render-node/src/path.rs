//! The path tracer: what light comes back along a ray.

mod vertices;

use crate::bvh::Tracer;
use crate::film::luminance;
use crate::model::RenderModel;
use crate::ray::Ray;
use crate::sampler::{Points, SampleOf};
use crate::world::{Hit, ShadowEnd, Surface, World};
use geometry::Vec3;
use geometry::lanes::{LANES, Simd, dispatch};
use schemas::scene::render::{DirectLight, UNLIMITED};
use vertices::{Turned, Vertices, lanes_of};

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

/// Traces paths in one posed scene, many at a time.
pub(crate) struct PathTracer<'a> {
    pub model: &'a RenderModel,
    pub world: &'a World<'a>,
    /// Rays traced so far.
    pub rays: u64,
    pub tracer: Tracer,
    /// What the paths have seen so far, by their numbers.
    pub paths: Vec<Path>,
    /// Paths that go on, and their rays; and what these meet.
    going: Vec<u32>,
    going_rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    /// Shadow rays, and what comes along them to which path if nothing is in the way.
    shadow_rays: Vec<Ray>,
    shadow_ends: Vec<ShadowEnd>,
    shadow_light: Vec<(u32, Vec3)>,
    blocked: Vec<bool>,
}

/// A path on its way from the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    /// Light (red, green, blue) that was found along it: in the end one sample of the radiance that arrives against its
    /// camera ray.
    pub radiance: Vec3,
    throughput: Vec3,
    /// Whose random numbers it takes.
    of: SampleOf,
    /// Density with which the surface chose the direction of the path's ray; none where no other could have been chosen.
    bsdf_pdf: Option<f64>,
}

impl<'a> PathTracer<'a> {
    pub(crate) fn new(model: &'a RenderModel, world: &'a World<'a>) -> PathTracer<'a> {
        PathTracer {
            model,
            world,
            rays: 0,
            tracer: Tracer::default(),
            paths: Vec::new(),
            going: Vec::new(),
            going_rays: Vec::new(),
            hits: Vec::new(),
            shadow_rays: Vec::new(),
            shadow_ends: Vec::new(),
            shadow_light: Vec::new(),
            blocked: Vec::new(),
        }
    }

    /// Begins a path with a camera ray; its number is how many were begun before.
    #[inline]
    pub(crate) fn begin(&mut self, camera_ray: Ray, of: SampleOf) {
        self.going.push(self.paths.len() as u32);
        self.going_rays.push(camera_ray);
        let (radiance, throughput) = (Vec3::zeros(), Vec3::repeat(1.0));
        self.paths.push(Path { radiance, throughput, of, bsdf_pdf: None });
    }

    /// Follows the paths that were begun to their ends.
    ///
    /// All go from vertex to vertex together, since many rays are traced faster than one. What a path finds does not
    /// depend on the others.
    ///
    /// At every vertex one light is asked for its light by a shadow ray, and the path goes on in a direction that the
    /// surface chooses; where that meets a light by itself, the two ways to find its light are weighted against each other
    /// (multiple importance sampling). The sky, which is never asked, is what a bounced ray sees when it meets nothing. After `bounces_max`
    /// bounces the last ray only asks what shines on it. After `roulette_after` bounces a path goes on with the probability
    /// of its throughput, which is divided by it (Russian roulette), so the mean stays the same.
    pub(crate) fn follow(&mut self, points: &mut Points) {
        let bounces_max = self.model.render.bounces_max;
        for bounce in 0..=bounces_max {
            if self.going.is_empty() {
                return;
            }
            self.rays += self.going.len() as u64;
            self.world.closest_each(&mut self.tracer, &self.going_rays, &mut self.hits);
            self.turn(bounce, points);
            self.look_at_lights();
        }
        self.last_light(bounces_max.saturating_add(1));
    }

    /// What happens at the vertices of the paths, where their rays meet surfaces, or nothing: some end, for others a light is
    /// asked, and they go on.
    fn turn(&mut self, bounce: u32, points: &mut Points) {
        let world = self.world;
        let dimensions = PAIRS_OF_A_BOUNCE * bounce as usize;
        let lights = self.lights_asked();
        let mut vertices = Vertices::new();
        let mut still_going = 0;
        for place in 0..self.going.len() {
            let (number, ray, hit) = (self.going[place], self.going_rays[place], self.hits[place]);
            let path = &mut self.paths[number as usize];
            let ring = hit.and_then(|hit| world.bodies.ring_met(hit.surface).zip(Some(hit)));
            let bsdf = match ring {
                Some(((ring, bsdf), hit)) => {
                    vertices.put_on_ring(&ray, hit.distance, ring, hit.surface);
                    bsdf
                }
                None => match hit.map(|hit| (hit, world.surface(&ray, &hit))) {
                    Some((_, Surface::Scattering(vertex))) => {
                        vertices.put_vertex(&vertex);
                        vertex.bsdf
                    }
                    emitting => {
                        let (throughput, bsdf_pdf) = (path.throughput, path.bsdf_pdf);
                        let light = throughput.component_mul(&self.light_seen(&ray, emitting, bsdf_pdf));
                        let light = self.cut(light, bounce);
                        self.paths[number as usize].radiance += light;
                        continue;
                    }
                },
            };
            let asks = lights > 0 && !bsdf.is_mirror();
            if asks {
                points.put(path.of, dimensions + LIGHT_PAIR, vertices.count, &mut vertices.light_squares);
            }
            points.put(path.of, dimensions + BSDF_PAIR, vertices.count, &mut vertices.bsdf_squares);
            vertices.put_path((number, path), &ray.direction, bsdf, asks);
            if vertices.count == LANES {
                self.turn_each(&vertices, bounce, points, &mut still_going);
                vertices.clear();
            }
        }
        if vertices.count > 0 {
            self.turn_each(&vertices, bounce, points, &mut still_going);
        }
        self.going.truncate(still_going);
        self.going_rays.truncate(still_going);
    }

    /// How many lights there are to choose from at a vertex.
    fn lights_asked(&self) -> usize {
        match self.model.render.direct_light {
            DirectLight::Mis | DirectLight::Lights if self.model.features.lights => self.model.shining.len(),
            _ => 0,
        }
    }

    /// What happens at sixteen vertices, or at the last ones. Paths that go on take the places of those before.
    #[inline(never)]
    fn turn_each(
        &mut self,
        vertices: &Vertices<'a>,
        bounce: u32,
        points: &mut Points,
        still_going: &mut usize,
    ) {
        let model = self.model;
        let mut turned = Turned::new();
        dispatch!(self.tracer.level, simd => simd.vectorize(
            #[inline(always)]
            || vertices.turned(simd, model, &mut turned)
        ));
        for lane in lanes_of(turned.lit) {
            let (ray, distance, target, light) = turned.to_light(lane);
            self.shadow_rays.push(ray);
            self.shadow_ends.push(ShadowEnd { distance, target });
            self.shadow_light.push((vertices.numbers[lane], self.cut(light, bounce + 1)));
        }
        for lane in lanes_of(turned.going) {
            let number = vertices.numbers[lane];
            let (mut throughput, bsdf_pdf) = turned.next(lane);
            let path = &mut self.paths[number as usize];
            if bounce >= model.render.roulette_after {
                let most = if model.render.bounces_max == UNLIMITED { 1.0 - END_LEAST } else { 1.0 };
                let share = at_most(throughput.max(), most);
                let pair = PAIRS_OF_A_BOUNCE * bounce as usize + ROULETTE_PAIR;
                if points.pair(path.of, pair).0 >= share {
                    continue;
                }
                throughput /= share;
            }
            (path.throughput, path.bsdf_pdf) = (throughput, bsdf_pdf);
            (self.going[*still_going], self.going_rays[*still_going]) = (number, turned.onward(lane));
            *still_going += 1;
        }
    }

    /// Adds what comes along the shadow rays that nothing is in the way of.
    fn look_at_lights(&mut self) {
        if self.shadow_rays.is_empty() {
            return;
        }
        self.rays += self.shadow_rays.len() as u64;
        self.world.any_each(&mut self.tracer, &self.shadow_rays, &self.shadow_ends, &mut self.blocked);
        for (&(number, light), &blocked) in self.shadow_light.iter().zip(&self.blocked) {
            if !blocked {
                self.paths[number as usize].radiance += light;
            }
        }
        self.shadow_rays.clear();
        self.shadow_ends.clear();
        self.shadow_light.clear();
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

    /// Light that comes back along a ray from where it ends: nothing, a light, a body that glows, or the sky.
    fn light_seen(&self, ray: &Ray, end: Option<(Hit, Surface)>, bsdf_pdf: Option<f64>) -> Vec3 {
        match end {
            None => self.sky_met(ray, bsdf_pdf),
            Some((_, Surface::Scattering(_))) => Vec3::zeros(),
            Some((_, Surface::Emitter(emitted))) => emitted,
            Some((hit, Surface::Light(light))) => self.light_met(light, ray, hit.distance, bsdf_pdf),
        }
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
        if !self.model.features.sky {
            return Vec3::zeros();
        }
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

    /// Adds what shines along the last rays of the paths that have not ended.
    fn last_light(&mut self, reflections: u32) {
        let (world, features) = (self.world, &self.model.features);
        if features.emitters && !self.going.is_empty() {
            self.rays += self.going.len() as u64;
            world.closest_each(&mut self.tracer, &self.going_rays, &mut self.hits);
            for ((&number, ray), hit) in self.going.iter().zip(&self.going_rays).zip(&self.hits) {
                let Path { throughput, bsdf_pdf, .. } = self.paths[number as usize];
                let end = hit.map(|hit| (hit, world.surface(ray, &hit)));
                let light = throughput.component_mul(&self.light_seen(ray, end, bsdf_pdf));
                let light = self.cut(light, reflections);
                self.paths[number as usize].radiance += light;
            }
        } else if !features.emitters {
            // What a ray would see were there no bodies tells whether they have to be looked at.
            for (&number, ray) in self.going.iter().zip(&self.going_rays) {
                let Path { throughput, bsdf_pdf, .. } = self.paths[number as usize];
                let (light, distance, target) = match world.closest_light(ray) {
                    Some((index, distance)) => {
                        (self.light_met(index, ray, distance, bsdf_pdf), distance, Some(index))
                    }
                    None if features.sky => (self.sky_met(ray, bsdf_pdf), f64::INFINITY, None),
                    None => continue,
                };
                if light != Vec3::zeros() {
                    self.shadow_rays.push(*ray);
                    self.shadow_ends.push(ShadowEnd { distance, target });
                    let light = self.cut(throughput.component_mul(&light), reflections);
                    self.shadow_light.push((number, light));
                }
            }
            self.look_at_lights();
        }
        self.going.clear();
        self.going_rays.clear();
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

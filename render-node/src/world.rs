//! A posed scene: where all surfaces are in one frame, and what a ray meets there.
//!
//! A hit is a function of the ray and one surface alone; the first hit is that with the least distance, and
//! among equal ones that with the least number. So no order of traversal can change a bit.

use crate::bsdf::Bsdf;
use crate::bvh::{Bvh, Reach, Tracer};
use crate::colour;
use crate::light::AreaLight;
use crate::model::{PlaneShape, RenderModel};
use crate::ray::{Ray, Vertex};
use crate::rings::{PlacedRing, axes};
use crate::sieve::Outline;
use crate::solids::SolidFrame;
use geometry::lanes::{Level, RaysAndTori};
use geometry::{Aabb, Vec3, plane, sphere};
use schemas::scene::render::ColourBy;
use schemas::state::BodyState;

/// Where a ray first meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, in metres.
    pub distance: f64,
    /// Number of the surface: rings, spheres, capsules, boxes, polynomials, surfaces that are only looked at, planes and
    /// lights, in this order and each as in the scene.
    pub surface: u32,
}

impl Hit {
    /// The point of the hit.
    pub(crate) fn point(&self, ray: &Ray) -> Vec3 {
        ray.origin + ray.direction * self.distance
    }
}

/// What is at a hit.
pub(crate) enum Surface<'a> {
    /// It scatters light.
    Scattering(Vertex<'a>),
    /// A light, by its number.
    Light(usize),
    /// A body that glows, with the radiance that it emits.
    Emitter(Vec3),
}

/// A model with its bodies in the poses of one state.
#[derive(Debug)]
pub struct World<'a> {
    model: &'a RenderModel,
    pub(crate) bodies: Bodies<'a>,
    bvh: Bvh,
}

/// The boxes over the bodies of one state.
#[derive(Clone, Debug)]
pub struct Hierarchy(Bvh);

/// Bodies in their places.
#[derive(Debug)]
pub(crate) struct Bodies<'a> {
    model: &'a RenderModel,
    rings: Vec<PlacedRing>,
    sphere_centres: Vec<Vec3>,
    solids: Vec<SolidFrame>,
    /// Surfaces of the bodies, if their colours are not those of their looks.
    colours: Vec<Bsdf>,
    ray_start: f64,
}

/// Where a ray that asks for a light ends.
#[derive(Clone, Copy, Debug)]
pub struct ShadowEnd {
    /// How far away the light is (m); infinite for the sky.
    pub distance: f64,
    /// Number of the light that the ray is meant to reach, which does not count.
    pub target: Option<usize>,
}

/// A state that cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum PoseError {
    /// Not the state of this scene.
    #[error("the state has {found} bodies, but the scene has {expected}: state and scene must be of one run")]
    BodyCount {
        /// Bodies of the scene.
        expected: usize,
        /// Bodies of the state.
        found: usize,
    },
    /// The scene names an environment map that the model did not get.
    #[error(
        "the scene's environment map {file} was not given to the model: see RenderModel::with_environment"
    )]
    NoEnvironment {
        /// The file that the scene names.
        file: String,
    },
    /// A position or orientation that is NaN, infinite, or not a rotation.
    #[error(
        "body {body} has position {position_m:?} m and orientation {orientation:?}: finite numbers and a unit quaternion were expected"
    )]
    Pose {
        /// Number of the body in the state.
        body: usize,
        /// Its position.
        position_m: [f64; 3],
        /// Its orientation.
        orientation: [f64; 4],
    },
}

impl<'a> World<'a> {
    /// Puts the bodies of a state into their places.
    ///
    /// # Errors
    ///
    /// [`PoseError`] if the state is not one of the model's scene, or not a state at all.
    pub fn new(model: &'a RenderModel, states: &[BodyState]) -> Result<World<'a>, PoseError> {
        World::after(model, states, None)
    }

    /// The same in less time: with the hierarchy of an earlier state of the scene, whose boxes are made anew; or with another
    /// one, where the boxes would have grown too much. What rays meet does not depend on it.
    ///
    /// # Errors
    ///
    /// As [`World::new`].
    pub fn after(
        model: &'a RenderModel,
        states: &[BodyState],
        earlier: Option<Hierarchy>,
    ) -> Result<World<'a>, PoseError> {
        let (expected, found) = (model.body_count(), states.len());
        if expected != found {
            return Err(PoseError::BodyCount { expected, found });
        }
        if let (Some(environment), None) = (&model.render.environment, &model.environment) {
            return Err(PoseError::NoEnvironment { file: environment.file.clone() });
        }
        for (body, state) in states.iter().enumerate() {
            let BodyState { position_m, orientation, .. } = *state;
            let norm_squared: f64 = orientation.iter().map(|q| q * q).sum();
            let unit = (norm_squared - 1.0).abs() < 1e-6;
            if !unit || position_m.iter().any(|x| !x.is_finite()) {
                return Err(PoseError::Pose { body, position_m, orientation });
            }
        }
        let all = states;
        let (rings, others) = states.split_at(model.rings.len());
        let (spheres, solids) = others.split_at(model.spheres.len());
        let ring_states = rings;
        let rings = model.rings.iter().zip(rings).map(|(shape, state)| PlacedRing {
            centre: Vec3::from(state.position_m),
            normal: axes(state).2,
            major_radius: shape.major_radius,
            minor_radius: shape.minor_radius,
        });
        let rings: Vec<_> = rings.collect();
        let sphere_centres = spheres.iter().map(|state| Vec3::from(state.position_m)).collect();
        let ray_start = model.ray_start();
        let solids = solids.iter().map(SolidFrame::new).chain(model.sheets.iter().copied());
        let solids: Vec<_> = solids.collect();
        let among_solids =
            || solids.iter().zip(&model.solids).filter_map(|(frame, (shape, _))| frame.wire(shape));
        let of_rings = || rings.iter().zip(ring_states).map(|(ring, state)| ring.wire(state));
        let wires = || of_rings().chain(among_solids()).collect::<Vec<_>>();
        let colours = match model.render.colouring.by {
            ColourBy::Penetration => colour::surfaces(&model.render.colouring, all, &wires()),
            _ => colour::surfaces(&model.render.colouring, all, &[]),
        };
        let bodies = Bodies { model, rings, sphere_centres, solids, colours, ray_start };
        let bvh = match earlier {
            None => Bvh::new(&bodies),
            Some(Hierarchy(bvh)) => bvh.moved(&bodies),
        };
        Ok(World { model, bodies, bvh })
    }

    /// The hierarchy, for a later state of the scene.
    pub fn into_hierarchy(self) -> Hierarchy {
        Hierarchy(self.bvh)
    }

    /// Memory of the hierarchy and of the rings in their places, in bytes.
    pub fn hierarchy_bytes(&self) -> usize {
        self.bvh.bytes() + size_of_val(self.bodies.rings.as_slice())
    }

    /// The first surfaces that rays meet, in the order of the rays. The same bits as for each ray alone, in less time.
    pub fn closest_each(&self, tracer: &mut Tracer, rays: &[Ray], hits: &mut Vec<Option<Hit>>) {
        let mut reaches = core::mem::take(&mut tracer.reaches);
        self.closest_flat(tracer.level, rays, &mut reaches);
        if self.model.features.bodies {
            tracer.closest(&self.bvh, &self.bodies, rays, &mut reaches);
        }
        hits.clear();
        hits.extend(reaches.iter().map(Reach::hit));
        tracer.reaches = reaches;
    }

    /// Whether rays meet anything before their ends, in the order of the rays.
    ///
    /// # Panics
    ///
    /// If there are not as many ends as rays.
    pub fn any_each(&self, tracer: &mut Tracer, rays: &[Ray], ends: &[ShadowEnd], blocked: &mut Vec<bool>) {
        assert_eq!(rays.len(), ends.len(), "each ray has an end");
        let mut reaches = core::mem::take(&mut tracer.reaches);
        self.any_flat(tracer.level, rays, ends, &mut reaches);
        if self.model.features.bodies {
            tracer.any(&self.bvh, &self.bodies, rays, &mut reaches);
        }
        blocked.clear();
        blocked.extend(reaches.iter().map(|reach| reach.hit().is_some()));
        tracer.reaches = reaches;
    }

    /// The first surface that a ray meets.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut hits = Vec::new();
        self.closest_each(&mut Tracer::default(), core::slice::from_ref(ray), &mut hits);
        hits.pop().flatten()
    }

    /// The same by asking every body: the oracle of the tests.
    pub fn closest_of_all(&self, ray: &Ray) -> Option<Hit> {
        let best = self.closest_plane_or_light(ray);
        (0..self.bodies.count()).fold(best, |best, body| nearer(best, self.bodies.hit(body, ray), body))
    }

    /// Whether a ray meets anything before a distance; a light that it is meant to reach does not count.
    pub fn any(&self, ray: &Ray, distance: f64, target: Option<usize>) -> bool {
        let mut blocked = Vec::new();
        let ends = [ShadowEnd { distance, target }];
        self.any_each(&mut Tracer::default(), core::slice::from_ref(ray), &ends, &mut blocked);
        blocked == [true]
    }

    /// The same by asking every body: the oracle of the tests.
    pub fn any_of_all(&self, ray: &Ray, distance: f64, target: Option<usize>) -> bool {
        self.any_plane_or_light(ray, distance, target)
            || (0..self.bodies.count()).any(|body| self.bodies.hit(body, ray).is_some_and(|t| t < distance))
    }

    fn closest_plane_or_light(&self, ray: &Ray) -> Option<Hit> {
        let mut best = None;
        for (number, plane) in (self.bodies.count()..).zip(&self.model.planes) {
            best = nearer(best, self.hit_plane(plane, number, ray), number);
        }
        for (number, light) in (self.first_light()..).zip(&self.model.lights) {
            best = nearer(best, light.hit(ray, self.bodies.ray_start), number);
        }
        best
    }

    fn any_plane_or_light(&self, ray: &Ray, distance: f64, target: Option<usize>) -> bool {
        let blocks = |t: Option<f64>| t.is_some_and(|t| t < distance);
        let mut planes = (self.bodies.count()..).zip(&self.model.planes);
        if planes.any(|(number, plane)| blocks(self.hit_plane(plane, number, ray))) {
            return true;
        }
        let in_the_way = |(index, light): (usize, &AreaLight)| {
            target != Some(index) && blocks(light.hit(ray, self.bodies.ray_start))
        };
        self.model.lights.iter().enumerate().any(in_the_way)
    }

    pub(crate) fn planes(&self) -> &[PlaneShape] {
        &self.model.planes
    }

    pub(crate) fn lights(&self) -> &[AreaLight] {
        &self.model.lights
    }

    /// Number of the first light among the surfaces.
    pub(crate) fn first_light(&self) -> u32 {
        self.bodies.count() + self.model.planes.len() as u32
    }

    #[inline]
    fn hit_plane(&self, shape: &PlaneShape, number: u32, ray: &Ray) -> Option<f64> {
        if ray.leaves == Some(number) {
            return None;
        }
        plane::ray_plane(&ray.origin, &ray.direction, &shape.normal, shape.offset, self.bodies.ray_start)
    }

    /// The nearest light that a ray meets, and how far away it is, were there nothing else.
    pub(crate) fn closest_light(&self, ray: &Ray) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        for (index, light) in self.model.lights.iter().enumerate() {
            if let Some(distance) = light.hit(ray, self.bodies.ray_start)
                && best.is_none_or(|(_, least)| distance < least)
            {
                best = Some((index, distance));
            }
        }
        best
    }

    /// What is at a hit.
    pub(crate) fn surface(&self, ray: &Ray, hit: &Hit) -> Surface<'_> {
        let point = hit.point(ray);
        let Some(plane) = hit.surface.checked_sub(self.bodies.count()) else {
            return self.bodies.surface(hit.surface, point, ray);
        };
        let Some(shape) = self.model.planes.get(plane as usize) else {
            return Surface::Light((hit.surface - self.first_light()) as usize);
        };
        let look = &self.model.looks[shape.look as usize];
        if let Some(emitted) = look.emitted {
            return Surface::Emitter(emitted);
        }
        let odd = || (square(point.dot(&shape.axes[0])) ^ square(point.dot(&shape.axes[1]))) & 1 == 1;
        let bsdf = match &look.checker {
            Some(checker) if odd() => checker,
            _ => &look.bsdf,
        };
        let normal = plane::facing_normal(&shape.normal, &ray.direction);
        Surface::Scattering(Vertex { point, normal, bsdf, leaves: Some(hit.surface) })
    }
}

/// The nearer of two hits; of equally near ones that of the surface with the lower number.
#[inline]
pub(crate) fn nearer(best: Option<Hit>, distance: Option<f64>, surface: u32) -> Option<Hit> {
    match (best, distance) {
        (Some(best), Some(t)) if t < best.distance || (t == best.distance && surface < best.surface) => {
            Some(Hit { distance: t, surface })
        }
        (None, Some(t)) => Some(Hit { distance: t, surface }),
        _ => best,
    }
}

/// Number of the square of one metre that a coordinate lies in.
#[inline]
fn square(coordinate: f64) -> i64 {
    let towards_zero = coordinate as i64;
    towards_zero - i64::from((towards_zero as f64) > coordinate)
}

impl Bodies<'_> {
    /// All bodies but planes.
    pub(crate) fn count(&self) -> u32 {
        (self.rings.len() + self.sphere_centres.len() + self.solids.len()) as u32
    }

    /// Distance to the first hit of one body: a function of the ray and the body alone.
    #[inline]
    pub(crate) fn hit(&self, body: u32, ray: &Ray) -> Option<f64> {
        if ray.leaves == Some(body) {
            return None;
        }
        let body = body as usize;
        if let Some(ring) = self.rings.get(body) {
            let mut pairs = RaysAndTori::default();
            let radii = [ring.major_radius, ring.minor_radius];
            pairs.put(0, &(ray.origin - ring.centre), &ray.direction, &ring.normal, radii);
            let [distance, ..] = pairs.first_hits(Level::new(), self.ray_start);
            return (!distance.is_nan()).then_some(distance);
        }
        let sphere = body - self.rings.len();
        let Some(centre) = self.sphere_centres.get(sphere) else {
            let solid = sphere - self.sphere_centres.len();
            let shape = &self.model.solids[solid].0;
            return self.solids[solid].hit(shape, &ray.origin, &ray.direction, self.ray_start);
        };
        let radius = self.model.spheres[sphere].radius;
        sphere::ray_sphere(&ray.origin, &ray.direction, centre, radius, self.ray_start)
    }

    /// A ring by its number and how it scatters light; `None` if it is another body, or glows.
    #[inline]
    pub(crate) fn ring_met(&self, body: u32) -> Option<(&PlacedRing, &Bsdf)> {
        let ring = self.rings.get(body as usize)?;
        if let Some(coloured) = self.colours.get(body as usize) {
            return Some((ring, coloured));
        }
        let look = &self.model.looks[self.model.rings[body as usize].look as usize];
        look.emitted.is_none().then_some((ring, &look.bsdf))
    }

    fn surface(&self, body: u32, point: Vec3, ray: &Ray) -> Surface<'_> {
        let index = body as usize;
        let (outward, look, bulges) = if let Some(ring) = self.rings.get(index) {
            let (outward, beyond) = ring.outward(&point);
            (outward, self.model.rings[index].look, beyond)
        } else if let Some(centre) = self.sphere_centres.get(index - self.rings.len()) {
            let sphere = index - self.rings.len();
            (sphere::normal(&point, centre), self.model.spheres[sphere].look, true)
        } else {
            let solid = index - self.rings.len() - self.sphere_centres.len();
            let (shape, look) = &self.model.solids[solid];
            let (outward, bulges) = self.solids[solid].outward(shape, &point);
            (outward, *look, bulges)
        };
        let look = &self.model.looks[look as usize];
        let coloured = self.colours.get(index);
        if let (Some(emitted), None) = (look.emitted, coloured) {
            return Surface::Emitter(emitted);
        }
        let from_outside = outward.dot(&ray.direction) <= 0.0;
        Surface::Scattering(Vertex {
            point,
            normal: if from_outside { outward } else { -outward },
            bsdf: coloured.unwrap_or(&look.bsdf),
            leaves: (from_outside && bulges).then_some(body),
        })
    }

    /// Rings come first.
    pub(crate) fn ring_count(&self) -> u32 {
        self.rings.len() as u32
    }

    #[inline(always)]
    pub(crate) fn ring(&self, body: u32) -> &PlacedRing {
        &self.rings[body as usize]
    }

    /// A ray does not meet a body nearer to its origin than this (m).
    #[inline(always)]
    pub(crate) fn ray_start(&self) -> f64 {
        self.ray_start
    }

    /// Boxes around all bodies, by number.
    pub(crate) fn boxes(&self) -> Vec<Aabb> {
        let rings = self.rings.iter().map(PlacedRing::bounding_box);
        let spheres = self.sphere_centres.iter().zip(&self.model.spheres);
        let spheres = spheres.map(|(centre, shape)| sphere::bounding_box(centre, shape.radius));
        let solids = self.solids.iter().zip(&self.model.solids);
        let solids = solids.map(|(frame, (shape, _))| frame.bounding_box(shape));
        rings.chain(spheres).chain(solids).collect()
    }

    /// A body's outline for the sieve.
    #[inline(always)]
    pub(crate) fn outline(&self, body: u32) -> Outline {
        match self.rings.get(body as usize) {
            Some(ring) => Outline {
                centre: ring.centre,
                normal: ring.normal,
                outer_radius: ring.major_radius + ring.minor_radius,
                half_height: ring.minor_radius,
                hole_radius: ring.major_radius - ring.minor_radius,
            },
            None => self.outline_of_other(body),
        }
    }

    #[cold]
    fn outline_of_other(&self, body: u32) -> Outline {
        let sphere = body as usize - self.rings.len();
        let Some(centre) = self.sphere_centres.get(sphere) else {
            let solid = sphere - self.sphere_centres.len();
            return self.solids[solid].outline(&self.model.solids[solid].0);
        };
        Outline {
            centre: *centre,
            normal: Vec3::zeros(),
            outer_radius: self.model.spheres[sphere].radius,
            half_height: f64::INFINITY,
            hole_radius: -1.0,
        }
    }
}

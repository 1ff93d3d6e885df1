//! Vertices of paths, sixteen side by side: which light is asked for, and where the paths go on.
//!
//! The one thing to know: a lane is one path's vertex and has the bits that it would have alone. What is not a ring, a
//! Lambertian surface or a rectangle of light is asked one lane after the other.

use super::Path;
use crate::bsdf::Bsdf;
use crate::light::{LightSample, LightSamples};
use crate::model::{RenderModel, Shining};
use crate::ray::{Ray, Vertex, equal};
use crate::rings::PlacedRing;
use crate::sampler::Squares;
use crate::warp::{Frames, cosine_hemispheres};
use core::f64::consts::FRAC_1_PI;
use geometry::Vec3;
use geometry::lanes::{LANES, Lanes, Mask, Simd, Vectors};
use schemas::scene::render::DirectLight;

/// Rows of numbers: of the ray that arrives, or the vertex' point itself.
const ORIGIN: usize = 0;
const DIRECTION: usize = 3;
const DISTANCE: usize = 6;
/// Of the ring; for another surface the normal stands in place of the axis.
const CENTRE: usize = 7;
const AXIS: usize = 10;
const MAJOR_RADIUS: usize = 13;
const THROUGHPUT: usize = 14;
const ALBEDO: usize = 17;
const ROWS: usize = 20;

/// Vertices that wait until there are sixteen.
#[derive(Debug)]
pub(super) struct Vertices<'a> {
    rows: [[f64; LANES]; ROWS],
    /// The paths.
    pub(super) numbers: [u32; LANES],
    bsdfs: [Option<&'a Bsdf>; LANES],
    /// The surfaces, as far as a ray that leaves them cannot meet them again.
    leaves: [Option<u32>; LANES],
    /// Points of the unit square: for the choice of a light and a place there, and for the way on.
    pub(super) light_squares: Squares,
    pub(super) bsdf_squares: Squares,
    pub(super) count: usize,
    /// A bit for each lane: on a ring; Lambertian; asks a light.
    rings: u32,
    lambertian: u32,
    asking: u32,
}

/// What comes of vertices.
#[derive(Debug)]
pub(super) struct Turned {
    rows: [[f64; LANES]; TURNED_ROWS],
    leaves: [Option<u32>; LANES],
    /// A bit for each lane: some light comes if nothing is in the way; the path goes on; no other direction was possible.
    pub(super) lit: u32,
    pub(super) going: u32,
    single: u32,
    /// A bit for each lane whose light has no size: no ray meets it by itself.
    points: u32,
    targets: [Option<usize>; LANES],
}

const POINT: usize = 0;
const TO_LIGHT: usize = 3;
const LIGHT_DISTANCE: usize = 6;
const LIGHT: usize = 7;
const ONWARD: usize = 10;
const NEXT_THROUGHPUT: usize = 13;
const PDF: usize = 16;
const TURNED_ROWS: usize = 17;

/// Lanes whose bits are set, in order.
#[inline(always)]
pub(super) fn lanes_of(mut bits: u32) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}

#[inline(always)]
fn put(rows: &mut [[f64; LANES]], row: usize, lane: usize, vector: &Vec3) {
    rows[row][lane] = vector.x;
    rows[row + 1][lane] = vector.y;
    rows[row + 2][lane] = vector.z;
}

#[inline(always)]
fn vector(rows: &[[f64; LANES]], row: usize, lane: usize) -> Vec3 {
    Vec3::new(rows[row][lane], rows[row + 1][lane], rows[row + 2][lane])
}

#[inline(always)]
fn load<S: Simd>(simd: S, rows: &[[f64; LANES]], row: usize) -> Lanes<S> {
    Lanes::load_array_ref(simd, &rows[row])
}

#[inline(always)]
fn loaded<S: Simd>(simd: S, rows: &[[f64; LANES]], row: usize) -> Vectors<S> {
    Vectors([load(simd, rows, row), load(simd, rows, row + 1), load(simd, rows, row + 2)])
}

#[inline(always)]
fn store<S: Simd>(rows: &mut [[f64; LANES]], row: usize, vectors: &Vectors<S>) {
    let [x, y, z] = vectors.0;
    x.store_array(&mut rows[row]);
    y.store_array(&mut rows[row + 1]);
    z.store_array(&mut rows[row + 2]);
}

#[inline(always)]
fn selected<S: Simd>(mask: Mask<S>, yes: &Vectors<S>, no: &Vectors<S>) -> Vectors<S> {
    Vectors([mask.select(yes.0[0], no.0[0]), mask.select(yes.0[1], no.0[1]), mask.select(yes.0[2], no.0[2])])
}

/// Products of the components.
#[inline(always)]
fn by_component<S: Simd>(a: &Vectors<S>, b: &Vectors<S>) -> Vectors<S> {
    Vectors([a.0[0] * b.0[0], a.0[1] * b.0[1], a.0[2] * b.0[2]])
}

/// A bit for each lane where not all components are 0; a NaN is not 0.
#[inline(always)]
fn not_zero<S: Simd>(vectors: &Vectors<S>) -> u32 {
    let zero = Lanes::splat(vectors.0[0].simd(), 0.0);
    let [x, y, z] = vectors.0;
    let at_most = x.simd_le(zero) & y.simd_le(zero) & z.simd_le(zero);
    let at_least = x.simd_ge(zero) & y.simd_ge(zero) & z.simd_ge(zero);
    !(at_most & at_least).to_bitmask()
}

impl<'a> Vertices<'a> {
    pub(super) fn new() -> Vertices<'a> {
        Vertices {
            rows: [[0.0; LANES]; ROWS],
            numbers: [0; LANES],
            bsdfs: [None; LANES],
            leaves: [None; LANES],
            light_squares: Squares::default(),
            bsdf_squares: Squares::default(),
            count: 0,
            rings: 0,
            lambertian: 0,
            asking: 0,
        }
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        (self.count, self.rings, self.lambertian, self.asking) = (0, 0, 0, 0);
    }

    /// Puts the place where a ray meets a ring.
    #[inline(always)]
    pub(super) fn put_on_ring(&mut self, ray: &Ray, distance: f64, ring: &PlacedRing, body: u32) {
        let lane = self.count;
        put(&mut self.rows, ORIGIN, lane, &ray.origin);
        put(&mut self.rows, CENTRE, lane, &ring.centre);
        put(&mut self.rows, AXIS, lane, &ring.normal);
        self.rows[DISTANCE][lane] = distance;
        self.rows[MAJOR_RADIUS][lane] = ring.major_radius;
        self.leaves[lane] = Some(body);
        self.rings |= 1 << lane;
    }

    /// Puts a place on another surface.
    #[inline(always)]
    pub(super) fn put_vertex(&mut self, vertex: &Vertex) {
        let lane = self.count;
        put(&mut self.rows, ORIGIN, lane, &vertex.point);
        put(&mut self.rows, AXIS, lane, &vertex.normal);
        self.leaves[lane] = vertex.leaves;
    }

    /// Puts the path that came there, which may ask a light.
    #[inline(always)]
    pub(super) fn put_path(
        &mut self,
        (number, path): (u32, &Path),
        direction: &Vec3,
        bsdf: &'a Bsdf,
        asks: bool,
    ) {
        let lane = self.count;
        self.count += 1;
        self.numbers[lane] = number;
        self.bsdfs[lane] = Some(bsdf);
        put(&mut self.rows, DIRECTION, lane, direction);
        put(&mut self.rows, THROUGHPUT, lane, &path.throughput);
        if let Bsdf::Lambertian { albedo } = bsdf {
            put(&mut self.rows, ALBEDO, lane, albedo);
            self.lambertian |= 1 << lane;
        }
        self.asking |= u32::from(asks) << lane;
    }

    /// Points and normals on the side that the path comes from, and the lanes whose ring has its outer half there. As
    /// [`PlacedRing::outward`].
    #[inline(always)]
    fn surfaces<S: Simd>(&self, simd: S) -> (Vectors<S>, Vectors<S>, u32) {
        let rows = &self.rows;
        let rings = Mask::from_bitmask(simd, self.rings);
        let (origin, direction) = (loaded(simd, rows, ORIGIN), loaded(simd, rows, DIRECTION));
        let on_ray = origin.plus(&direction.times(load(simd, rows, DISTANCE)));
        let point = selected(rings, &on_ray, &origin);
        let (axis, radius) = (loaded(simd, rows, AXIS), load(simd, rows, MAJOR_RADIUS));
        let zero = Lanes::splat(simd, 0.0);
        let from_centre = point.minus(&loaded(simd, rows, CENTRE));
        let height = axis.dot(&from_centre);
        let along = axis.times(height);
        let across = from_centre.minus(&along);
        let rho_squared = across.dot(&across);
        let rho = rho_squared.sqrt();
        let share = rho.simd_gt(zero).select((rho - radius) / rho, zero);
        let away = across.times(share).plus(&along);
        let length = away.dot(&away).sqrt();
        let unit = Vectors([away.0[0] / length, away.0[1] / length, away.0[2] / length]);
        let outward = selected(rings & length.simd_gt(zero), &unit, &axis);
        let from_outside = outward.dot(&direction).simd_le(zero);
        let facing = Vectors([-outward.0[0], -outward.0[1], -outward.0[2]]);
        let normal = selected(from_outside, &outward, &facing);
        let beyond = from_outside & rho_squared.simd_ge(radius * radius);
        (point, normal, beyond.to_bitmask())
    }

    /// What comes of the vertices.
    #[inline(always)]
    pub(super) fn turned<S: Simd>(&self, simd: S, model: &RenderModel, turned: &mut Turned) {
        let rows = &self.rows;
        let (point, normal, beyond) = self.surfaces(simd);
        turned.leaves = self.leaves;
        for lane in lanes_of(self.rings & !beyond) {
            turned.leaves[lane] = None;
        }
        store(&mut turned.rows, POINT, &point);
        let frames = Frames::about(&normal);
        let came = frames.local(&loaded(simd, rows, DIRECTION));
        let out = Vectors([-came.0[0], -came.0[1], -came.0[2]]);
        let throughput = loaded(simd, rows, THROUGHPUT);
        turned.lit = 0;
        if self.asking != 0 {
            self.ask(simd, model, &point, &frames, &out, &throughput, turned);
        }
        let here = u32::MAX >> (32 - self.count as u32);
        let square = self.bsdf_squares.points();
        let mut local = cosine_hemispheres(load(simd, &square, 0), load(simd, &square, 1));
        let mut weight = loaded(simd, rows, ALBEDO);
        let mut pdf = FRAC_1_PI * local.0[2];
        (turned.going, turned.single) = (here, 0);
        let others = here & !self.lambertian;
        if others != 0 {
            let mut numbers = [[0.0; LANES]; 7];
            let mut views = [[0.0; LANES]; 3];
            store(&mut views, 0, &out);
            turned.going &= !self.sample_others(others, &square, &views, &mut numbers, &mut turned.single);
            let other = Mask::from_bitmask(simd, others);
            local = selected(other, &loaded(simd, &numbers, 0), &local);
            weight = selected(other, &loaded(simd, &numbers, 3), &weight);
            pdf = other.select(load(simd, &numbers, 6), pdf);
        }
        let next = by_component(&throughput, &weight);
        turned.going &= not_zero(&next);
        store(&mut turned.rows, NEXT_THROUGHPUT, &next);
        store(&mut turned.rows, ONWARD, &frames.world(&local));
        pdf.store_array(&mut turned.rows[PDF]);
    }

    /// Light that the surfaces send where the paths came from, each from the one light that is asked, that stands for all, if
    /// nothing is in between.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn ask<S: Simd>(
        &self,
        simd: S,
        model: &RenderModel,
        point: &Vectors<S>,
        frames: &Frames<S>,
        out: &Vectors<S>,
        throughput: &Vectors<S>,
        turned: &mut Turned,
    ) {
        let rows = &self.rows;
        let samples = self.samples(simd, model, point, turned);
        let local = frames.local(&samples.direction);
        let zero = Lanes::splat(simd, 0.0);
        let mut lit = samples.lit & local.0[2].simd_gt(zero).to_bitmask();
        let mut bsdf_pdf = FRAC_1_PI * local.0[2];
        let mut value = loaded(simd, rows, ALBEDO).times(bsdf_pdf);
        let others = lit & !self.lambertian;
        if others != 0 {
            let mut numbers = [[0.0; LANES]; 4];
            let mut directions = [[0.0; LANES]; 6];
            store(&mut directions, 0, out);
            store(&mut directions, 3, &local);
            self.eval_others(others, &directions, &mut numbers);
            let other = Mask::from_bitmask(simd, others);
            value = selected(other, &loaded(simd, &numbers, 0), &value);
            bsdf_pdf = other.select(load(simd, &numbers, 3), bsdf_pdf);
        }
        lit &= not_zero(&value);
        if turned.points != 0 {
            bsdf_pdf = Mask::from_bitmask(simd, turned.points).select(zero, bsdf_pdf);
        }
        let light_pdf = samples.pdf / model.shining.len() as f64;
        let one = Lanes::splat(simd, 1.0);
        let weight = match model.render.direct_light {
            DirectLight::Mis => {
                let ratio = bsdf_pdf / light_pdf;
                one / (1.0 + ratio * ratio)
            }
            DirectLight::Lights | DirectLight::Bsdf => one,
        };
        let light = by_component(&value, &samples.radiance).times(weight / light_pdf);
        turned.lit = lit;
        store(&mut turned.rows, LIGHT, &by_component(throughput, &light));
        store(&mut turned.rows, TO_LIGHT, &samples.direction);
        samples.distance.store_array(&mut turned.rows[LIGHT_DISTANCE]);
    }

    /// A direction from each vertex to the light that it asks.
    #[inline(always)]
    fn samples<S: Simd>(
        &self,
        simd: S,
        model: &RenderModel,
        point: &Vectors<S>,
        turned: &mut Turned,
    ) -> LightSamples<S> {
        let mut samples = LightSamples::none(simd);
        let mut square = self.light_squares.points();
        turned.points = 0;
        let mut asked = [0; LANES];
        for (asked, u) in asked.iter_mut().zip(&mut square[0]) {
            // The whole part of `count u` chooses; the rest is again uniform.
            let scaled = *u * model.shining.len() as f64;
            *asked = scaled as u32;
            *u = scaled - f64::from(*asked);
        }
        let squares = (load(simd, &square, 0), load(simd, &square, 1));
        let mut left = self.asking;
        while left != 0 {
            let which = asked[left.trailing_zeros() as usize & (LANES - 1)];
            let same = left & equal(&asked, which);
            left &= !same;
            let which = model.shining[which as usize];
            let (light, target) = match which {
                Shining::Area(index) => (model.lights[index].sample_each(simd, point, squares), Some(index)),
                Shining::Point(index) => {
                    turned.points |= same;
                    (Some(model.point_lights[index].sample_each(simd, point)), None)
                }
                Shining::Sun(_) | Shining::Environment => (None, None),
            };
            turned.targets_of(same, target);
            let light = light.unwrap_or_else(
                #[inline(always)]
                || {
                    let mut numbers = [[0.0; LANES]; 8];
                    let lit = sample_lights(model, which, same, (&turned.rows, &square), &mut numbers);
                    LightSamples {
                        direction: loaded(simd, &numbers, 0),
                        radiance: loaded(simd, &numbers, 3),
                        distance: load(simd, &numbers, 6),
                        pdf: load(simd, &numbers, 7),
                        lit,
                    }
                },
            );
            let here = Mask::from_bitmask(simd, same);
            samples = LightSamples {
                direction: selected(here, &light.direction, &samples.direction),
                radiance: selected(here, &light.radiance, &samples.radiance),
                distance: here.select(light.distance, samples.distance),
                pdf: here.select(light.pdf, samples.pdf),
                lit: samples.lit | same & light.lit,
            };
        }
        samples
    }

    /// `eval` and `pdf` one by one, for two directions.
    #[inline(never)]
    fn eval_others(&self, lanes: u32, directions: &[[f64; LANES]; 6], numbers: &mut [[f64; LANES]; 4]) {
        for lane in lanes_of(lanes) {
            let Some(bsdf) = self.bsdfs[lane] else { continue };
            let (wo, wi) = (vector(directions, 0, lane), vector(directions, 3, lane));
            put(numbers, 0, lane, &bsdf.eval(&wo, &wi));
            numbers[3][lane] = bsdf.pdf(&wo, &wi);
        }
    }

    /// `sample` one by one: direction, weight and density; and the lanes where light is thrown into the surface.
    #[inline(never)]
    fn sample_others(
        &self,
        lanes: u32,
        square: &[[f64; LANES]; 2],
        views: &[[f64; LANES]; 3],
        numbers: &mut [[f64; LANES]; 7],
        single: &mut u32,
    ) -> u32 {
        let mut ended = 0;
        for lane in lanes_of(lanes) {
            let square = (square[0][lane], square[1][lane]);
            let sample = self.bsdfs[lane].and_then(|bsdf| bsdf.sample(&vector(views, 0, lane), square));
            let Some(sample) = sample else {
                ended |= 1 << lane;
                continue;
            };
            put(numbers, 0, lane, &sample.wi);
            put(numbers, 3, lane, &sample.weight);
            numbers[6][lane] = sample.pdf.unwrap_or(0.0);
            *single |= u32::from(sample.pdf.is_none()) << lane;
        }
        ended
    }
}

/// A direction to a light from each of some vertices, one by one: direction, radiance, distance and density; and a bit for
/// each lane that may be lit.
#[inline(never)]
fn sample_lights(
    model: &RenderModel,
    which: Shining,
    lanes: u32,
    (turned, square): (&[[f64; LANES]; TURNED_ROWS], &[[f64; LANES]; 2]),
    numbers: &mut [[f64; LANES]; 8],
) -> u32 {
    let mut lit = 0;
    for lane in lanes_of(lanes) {
        let (point, square) = (vector(turned, POINT, lane), (square[0][lane], square[1][lane]));
        let sample = match which {
            Shining::Area(index) => model.lights[index].sample(&point, square),
            Shining::Sun(index) => Some(model.suns[index].sample(square)),
            Shining::Environment => model.environment.as_ref().map(|map| map.sample(square)),
            // All lanes at once.
            Shining::Point(_) => None,
        };
        if let Some(LightSample { direction, distance, radiance, pdf }) = sample {
            put(numbers, 0, lane, &direction);
            put(numbers, 3, lane, &radiance);
            (numbers[6][lane], numbers[7][lane]) = (distance, pdf);
            lit |= 1 << lane;
        }
    }
    lit
}

impl Turned {
    pub(super) fn new() -> Turned {
        Turned {
            rows: [[0.0; LANES]; TURNED_ROWS],
            leaves: [None; LANES],
            lit: 0,
            going: 0,
            single: 0,
            points: 0,
            targets: [None; LANES],
        }
    }

    #[inline(always)]
    fn targets_of(&mut self, lanes: u32, target: Option<usize>) {
        for lane in lanes_of(lanes) {
            self.targets[lane] = target;
        }
    }

    /// The ray to the light, how far away it is, its number if it has one, and what comes along.
    #[inline(always)]
    pub(super) fn to_light(&self, lane: usize) -> (Ray, f64, Option<usize>, Vec3) {
        let ray = Ray { direction: vector(&self.rows, TO_LIGHT, lane), ..self.onward(lane) };
        (ray, self.rows[LIGHT_DISTANCE][lane], self.targets[lane], vector(&self.rows, LIGHT, lane))
    }

    /// The ray on which the path goes on.
    #[inline(always)]
    pub(super) fn onward(&self, lane: usize) -> Ray {
        Ray {
            origin: vector(&self.rows, POINT, lane),
            direction: vector(&self.rows, ONWARD, lane),
            leaves: self.leaves[lane],
        }
    }

    /// The path's throughput, and the density of its direction if it has one.
    #[inline(always)]
    pub(super) fn next(&self, lane: usize) -> (Vec3, Option<f64>) {
        let pdf = (self.single >> lane & 1 == 0).then_some(self.rows[PDF][lane]);
        (vector(&self.rows, NEXT_THROUGHPUT, lane), pdf)
    }
}

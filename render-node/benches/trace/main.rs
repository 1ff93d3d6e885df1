//! Speed of tracing on sheets of 50, 10,000 and 100,000 rings, on one core.
//!
//! `cargo bench -p render-node --bench trace [-- 50 10000 100000 spp=4 batch=1024]`. European 4-in-1 of R = 1 and r = 0.18, pitch 1.2 within a row
//! and 1.3 from row to row, tilted by 35 degrees; a plane, a unit sphere, a square light, 640 x 360 pixels; primary rays, shadow
//! rays, one diffuse bounce and its shadow rays.
//!
//! Prints, by the number of rings: milliseconds for hierarchy and refit, bytes a ring, million rays a second of tracing alone (rays
//! in, hits out) by kind of ray and of a whole frame; and how many times that of a fixed scalar reference: a tree of two children a node
//! in `f64` and [`geometry::torus::ray_torus`], one ray after the other. The least of some passes counts, of this thread's core time.

mod reference;
mod tori;

use geometry::Vec3;
use reference::Reference;
use render_node::{Hit, Ray, RenderModel, ShadowEnd, Tracer, World, render, warp};
use rustix::time::{ClockId, clock_gettime};
use schemas::scene::{Ring, Scene};
use std::hint::black_box;
use std::num::NonZeroUsize;
use std::time::Instant;

const WIDTH: u32 = 640;
const HEIGHT: u32 = 360;
/// Pixels along a tile's side.
const TILE: u32 = 16;
const FIELD_OF_VIEW: f64 = 0.7;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let counts: Vec<usize> = arguments.iter().filter_map(|argument| argument.parse().ok()).collect();
    let counts = if counts.is_empty() { vec![50, 10_000, 100_000] } else { counts };
    let value = |key: &str, usual: usize| {
        let given =
            arguments.iter().find_map(|argument| argument.strip_prefix(key)?.strip_prefix('=')?.parse().ok());
        given.unwrap_or(usual)
    };
    tori::measure();
    for count in counts {
        let sheet = Sheet::new(count);
        measure(&sheet, value("spp", 4) as u32, value("batch", 1024));
    }
}

/// The scene, and what is needed of it to make rays.
struct Sheet {
    scene: Scene,
    eye: Vec3,
    corner: Vec3,
    right: Vec3,
    down: Vec3,
    light: [Vec3; 3],
}

impl Sheet {
    fn new(count: usize) -> Sheet {
        let (rows, columns) = match count {
            50 => (5, 10),
            _ => {
                let rows = (1..=count)
                    .take_while(|rows| rows * rows <= count)
                    .filter(|&rows| count.is_multiple_of(rows))
                    .last();
                let rows = rows.unwrap_or(1);
                (rows, count / rows)
            }
        };
        let (width, length) = (1.2 * columns as f64, 1.3 * rows as f64);
        let size = if width > length { width } else { length };
        let (edge, height) = (0.5 * size, 0.8 * size);
        let away = 0.62 * size / (libm::tan(0.5 * FIELD_OF_VIEW) * f64::from(WIDTH) / f64::from(HEIGHT));
        let eye = Vec3::new(0.0, -libm::cos(0.82), libm::sin(0.82)) * away;
        let text = format!(
            "
            time = {{ duration_s = 0.0, time_step_s = 0.001 }}
            material.steel = {{}}
            material.floor = {{}}
            sphere = [{{ radius_m = 1.0, mass_kg = 1.0, material = 'floor', position_m = [0, 0, -2.3] }}]
            plane = [{{ normal = [0, 0, 1], offset_m = -3.4, material = 'floor' }}]
            [render]
            width_px = {WIDTH}
            height_px = {HEIGHT}
            samples_per_pixel = 4
            bounces_max = 1
            sky = {{ zenith_radiance = [0, 0, 0], horizon_radiance = [0, 0, 0] }}
            camera = {{ position_m = [{:?}, {:?}, {:?}], look_at_m = [0, 0, 0], up = [0, 0, 1], vertical_field_of_view_rad = {FIELD_OF_VIEW} }}
            [[render.light]]
            shape = 'rectangle'
            corner_m = [{:?}, {:?}, {height:?}]
            edge_u_m = [0.0, {edge:?}, 0.0]
            edge_v_m = [{edge:?}, 0.0, 0.0]
            radiance = [16.0, 16.0, 16.0]
            ",
            eye.x, eye.y, eye.z, -0.5 * edge, -0.5 * edge,
        );
        let mut scene = Scene::parse(&text, &[]).expect("the scene is valid");
        for row in 0..rows {
            let (sine, cosine) = libm::sincos(0.5 * if row % 2 == 0 { 35.0 } else { -35.0_f64 }.to_radians());
            for column in 0..columns {
                let x = 1.2 * column as f64 + if row % 2 == 1 { 0.6 } else { 0.0 } - 0.5 * width;
                let y = 1.3 * row as f64 - 0.5 * length;
                scene.rings.push(Ring {
                    major_radius_m: 1.0,
                    minor_radius_m: 0.18,
                    mass_kg: 1.0,
                    material: "steel".to_owned(),
                    position_m: [x, y, 0.0],
                    orientation: [0.0, sine, 0.0, cosine],
                    linear_velocity_m_per_s: [0.0; 3],
                    angular_velocity_rad_per_s: [0.0; 3],
                    pinned: false,
                    drag: None,
                    motion: None,
                });
            }
        }
        let forward = -eye.normalize();
        let right = forward.cross(&Vec3::z()).normalize();
        let up = right.cross(&forward);
        let pixel = 2.0 * libm::tan(0.5 * FIELD_OF_VIEW) / f64::from(HEIGHT);
        let corner =
            forward + up * (0.5 * pixel * f64::from(HEIGHT)) - right * (0.5 * pixel * f64::from(WIDTH));
        let light = [Vec3::new(-0.5 * edge, -0.5 * edge, height), Vec3::y() * edge, Vec3::x() * edge];
        Sheet { scene, eye, corner, right: right * pixel, down: up * -pixel, light }
    }

    fn normal(&self, point: &Vec3, ray: &Ray, hit: &Hit) -> (Vec3, Option<u32>) {
        let (mut normal, mut leaves) = (Vec3::z(), Some(hit.surface));
        if let Some(ring) = self.scene.rings.get(hit.surface as usize) {
            let axis = axis(ring);
            let from_centre = point - Vec3::from(ring.position_m);
            let across = from_centre - axis * axis.dot(&from_centre);
            normal = (from_centre - across.normalize()).normalize();
            leaves = leaves.filter(|_| across.norm_squared() >= 1.0);
        } else if hit.surface as usize == self.scene.rings.len() {
            normal = (point - Vec3::new(0.0, 0.0, -2.3)).normalize();
        }
        (if normal.dot(&ray.direction) > 0.0 { -normal } else { normal }, leaves)
    }
}

fn axis(ring: &Ring) -> Vec3 {
    let [x, y, z, w] = ring.orientation;
    Vec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))
}

/// The rays of a picture by kind, tile by tile.
#[derive(Default)]
struct Rays {
    primary: Vec<Ray>,
    indirect: Vec<Ray>,
    shadow: [(Vec<Ray>, Vec<ShadowEnd>); 2],
}

fn rays(sheet: &Sheet, world: &World, spp: u32) -> Rays {
    let mut dice = Dice(1);
    let mut rays = Rays::default();
    for tile in 0..WIDTH.div_ceil(TILE) * HEIGHT.div_ceil(TILE) {
        let (left, top) = (tile % WIDTH.div_ceil(TILE) * TILE, tile / WIDTH.div_ceil(TILE) * TILE);
        for y in top..HEIGHT.min(top + TILE) {
            for x in left..WIDTH.min(left + TILE) {
                for _ in 0..spp {
                    let (x, y) = (f64::from(x) + dice.unit(), f64::from(y) + dice.unit());
                    let direction = (sheet.corner + sheet.right * x + sheet.down * y).normalize();
                    rays.primary.push(Ray::new(sheet.eye, direction));
                }
            }
        }
    }
    let mut tracer = Tracer::default();
    let mut hits = Vec::new();
    for kind in 0..2 {
        let from = if kind == 0 { &rays.primary } else { &rays.indirect };
        world.closest_each(&mut tracer, from, &mut hits);
        let lit = (sheet.scene.rings.len() + 2) as u32;
        let mut indirect = Vec::new();
        for (ray, hit) in from.iter().zip(&hits) {
            let Some(hit) = hit.filter(|hit| hit.surface < lit) else { continue };
            let point = ray.origin + ray.direction * hit.distance;
            let (normal, leaves) = sheet.normal(&point, ray, &hit);
            let [corner, u, v] = sheet.light;
            let to_light = corner + u * dice.unit() + v * dice.unit() - point;
            let distance = to_light.norm();
            let direction = to_light / distance;
            if normal.dot(&direction) > 0.0 {
                rays.shadow[kind].0.push(Ray { origin: point, direction, leaves });
                rays.shadow[kind].1.push(ShadowEnd { distance, target: Some(0) });
            }
            let local = warp::cosine_hemisphere((dice.unit(), dice.unit()));
            indirect.push(Ray {
                origin: point,
                direction: warp::Frame::about(&normal).world(&local),
                leaves,
            });
        }
        if kind == 0 {
            rays.indirect = indirect;
        }
    }
    rays
}

fn measure(sheet: &Sheet, spp: u32, batch_size: usize) {
    let (model, _) = RenderModel::compile(&sheet.scene);
    let states = sheet.scene.initial_bodies();
    let rings = sheet.scene.rings.len();
    let world = World::new(&model, &states).expect("the state is the scene's");
    let (mut build, mut refit) = (f64::INFINITY, f64::INFINITY);
    let mut hierarchy = None;
    for _ in 0..20 {
        for best in [&mut build, &mut refit] {
            let begin = wall_seconds();
            let world = World::after(&model, &states, hierarchy.take()).expect("the state is the scene's");
            let seconds = wall_seconds() - begin;
            *best = if seconds < *best { seconds } else { *best };
            hierarchy = Some(world.into_hierarchy());
        }
        hierarchy = None;
    }
    println!(
        "{rings} rings: poses and hierarchy {:.3} ms, refitted {:.3} ms, {:.0} bytes a ring",
        build * 1e3,
        refit * 1e3,
        world.hierarchy_bytes() as f64 / rings as f64
    );
    let rays = rays(sheet, &world, spp);
    let reference = Reference::new(&sheet.scene);
    let mut tracer = Tracer::default();
    let (mut all_rays, mut all_seconds, mut all_reference) = (0.0, 0.0, 0.0);
    let [(shadow, shadow_ends), (shadow_2, shadow_2_ends)] = &rays.shadow;
    let kinds = [
        ("primary", &rays.primary, None),
        ("shadow", shadow, Some(shadow_ends)),
        ("indirect", &rays.indirect, None),
        ("shadow 2", shadow_2, Some(shadow_2_ends)),
    ];
    for (name, rays, ends) in kinds {
        let (mut hits, mut blocked) = (Vec::new(), Vec::new());
        let (mut best, mut best_reference) = (f64::INFINITY, f64::INFINITY);
        let (mut met, mut other) = (0_usize, 0_usize);
        for pass in 0..5 {
            let mut sum = 0;
            let begin = core_seconds();
            for (batch, rays) in rays.chunks(batch_size).enumerate() {
                match ends {
                    None => {
                        world.closest_each(&mut tracer, rays, &mut hits);
                        sum += hits.iter().flatten().filter(|hit| (hit.surface as usize) < rings).count();
                    }
                    Some(ends) => {
                        let ends = &ends[batch * batch_size..][..rays.len()];
                        world.any_each(&mut tracer, rays, ends, &mut blocked);
                        sum += blocked.iter().filter(|&&blocked| blocked).count();
                    }
                }
            }
            let seconds = core_seconds() - begin;
            best = if seconds < best { seconds } else { best };
            met = black_box(sum);
            // One batch in sixteen is enough for the reference.
            if pass < 2 {
                let mut sum = 0;
                let begin = core_seconds();
                for (batch, rays) in rays.chunks(batch_size).enumerate().step_by(16) {
                    for (place, ray) in rays.iter().enumerate() {
                        let end =
                            ends.map_or(f64::INFINITY, |ends| ends[batch * batch_size + place].distance);
                        sum += usize::from(reference.closest(ray, end, ends.is_some()) < end);
                    }
                }
                black_box(sum);
                let traced = rays.chunks(batch_size).step_by(16).map(<[Ray]>::len).sum::<usize>();
                let seconds = (core_seconds() - begin) * rays.len() as f64 / traced as f64;
                best_reference = if seconds < best_reference { seconds } else { best_reference };
            }
        }
        for rays in rays.chunks(batch_size).step_by(16) {
            if ends.is_none() {
                world.closest_each(&mut tracer, rays, &mut hits);
                for (ray, hit) in rays.iter().zip(&hits) {
                    let ring = hit.filter(|hit| (hit.surface as usize) < rings);
                    let expected = reference.closest(ray, f64::INFINITY, false);
                    let far = hit.map_or(f64::INFINITY, |hit| hit.distance);
                    let same =
                        ring.map_or(expected >= far, |hit| (hit.distance - expected).abs() < 1e-9 * far);
                    other += usize::from(!same);
                }
            }
        }
        let count = rays.len() as f64;
        println!(
            "  {name:9} {:9} rays, {:4.2} met  {:6.2} M rays/s, {:4.1} x reference; {other} hits differ",
            rays.len(),
            met as f64 / count,
            count / best * 1e-6,
            best_reference / best,
        );
        (all_rays, all_seconds, all_reference) =
            (all_rays + count, all_seconds + best, all_reference + best_reference);
    }
    println!(
        "  all       {all_rays:9} rays             {:6.2} M rays/s, {:4.1} x reference",
        all_rays / all_seconds * 1e-6,
        all_reference / all_seconds
    );
    let everything = RenderModel::compile_with_everything(&sheet.scene);
    let (mut planned, mut forced, mut films) = (f64::INFINITY, f64::INFINITY, Vec::new());
    for _ in 0..3 {
        for (model, best) in [(&model, &mut planned), (&everything, &mut forced)] {
            let begin = core_seconds();
            films.push(render(model, &states, 0, 1, NonZeroUsize::MIN).expect("the state is the scene's"));
            let seconds = core_seconds() - begin;
            *best = if seconds < *best { seconds } else { *best };
        }
    }
    assert!(films.iter().all(|film| film.hash() == films[0].hash()), "what is left out changed the picture");
    println!(
        "  frame     {:9} rays             {:6.2} M rays/s, film {}; with nothing left out {:.2} x as long, same film",
        films[0].rays,
        films[0].rays as f64 / planned * 1e-6,
        films[0].hash().short(),
        forced / planned,
    );
}

/// Numbers from 0 to 1: splitmix64.
struct Dice(u64);

impl Dice {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Time since the program's begin.
fn wall_seconds() -> f64 {
    static BEGIN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    BEGIN.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// Time that this thread has had a core, so that other load does not count.
fn core_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

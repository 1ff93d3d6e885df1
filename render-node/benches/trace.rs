//! Speed of tracing on sheets of 50, 10,000 and 100,000 rings, on one core.
//!
//! `cargo bench -p render-node --bench trace [-- 50 10000 100000] [spp=2]`. European 4-in-1 of R = 1 and r = 0.18, pitch 1.2 within a row
//! and 1.3 from row to row, tilted by 35 degrees; a plane, a unit sphere, a square light, 640 x 360 pixels; primary rays, shadow
//! rays, one diffuse bounce and its shadow rays.
//!
//! Prints, by the number of rings: milliseconds for hierarchy and refit, bytes a ring, million rays a second of tracing alone (rays
//! in, hits out) by kind of ray and of a whole frame; and how many times that of a fixed scalar reference: a tree of two children a node
//! in `f64` and [`geometry::torus::ray_torus`], one ray after the other. Times are of the process' own core time.

use geometry::lanes::{LANES, Level, RaysAndTori};
use geometry::{Vec3, torus::ray_torus};
use render_node::{Hit, Ray, RenderModel, ShadowEnd, Tracer, World, render, warp};
use schemas::scene::{Ring, Scene};
use std::hint::black_box;
use std::num::NonZeroUsize;
use std::time::Instant;

const WIDTH: u32 = 640;
const HEIGHT: u32 = 360;
/// Pixels along a tile's side, and rays that are traced at once.
const TILE: u32 = 16;
const BATCH: usize = 1024;
const FIELD_OF_VIEW: f64 = 0.7;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let counts: Vec<usize> = arguments.iter().filter_map(|argument| argument.parse().ok()).collect();
    let counts = if counts.is_empty() { vec![50, 10_000, 100_000] } else { counts };
    let spp = arguments.iter().find_map(|argument| argument.strip_prefix("spp=")?.parse().ok()).unwrap_or(4);
    tori();
    for count in counts {
        let sheet = Sheet::new(count);
        measure(&sheet, spp);
    }
}

/// Nanoseconds of one ray-torus test, by outcome: sixteen side by side, and the scalar one.
fn tori() {
    let mut dice = Dice(7);
    let mut classes: [(&str, Vec<(Vec3, Vec3)>); 3] = [("missed", vec![]), ("hit", vec![]), ("mixed", vec![])];
    while classes.iter().any(|(_, rays)| rays.len() < 1 << 14) {
        let mut point = |size: f64| (Vec3::new(dice.unit(), dice.unit(), dice.unit()) * 2.0).add_scalar(-1.0) * size;
        let (target, from) = (point(1.2), point(1.0));
        let origin = from.normalize() * 8.0;
        let direction = (target - origin).normalize();
        let hit = ray_torus(&origin, &direction, 1.0, 0.18, 0.18e-6).is_some();
        for class in [usize::from(hit), 2] {
            if classes[class].1.len() < 1 << 14 {
                classes[class].1.push((origin, direction));
            }
        }
    }
    println!("ray-torus test, R = 1, r = 0.18, ns: sixteen side by side | scalar");
    for (name, rays) in &classes {
        let batches: Vec<_> = rays
            .chunks(LANES)
            .map(|rays| {
                let mut pairs = RaysAndTori::default();
                for (lane, (origin, direction)) in rays.iter().enumerate() {
                    pairs.put(lane, origin, direction, &Vec3::z(), [1.0, 0.18]);
                }
                pairs
            })
            .collect();
        let (mut lanes, mut scalar) = (f64::INFINITY, f64::INFINITY);
        let (mut met, mut worst) = (0, 0.0);
        for _ in 0..40 {
            let begin = core_seconds();
            for pairs in &batches {
                black_box(pairs.first_hits(Level::new(), 0.18e-6));
            }
            let middle = core_seconds();
            for (origin, direction) in rays {
                black_box(ray_torus(origin, direction, 1.0, 0.18, 0.18e-6));
            }
            let end = core_seconds();
            lanes = if middle - begin < lanes { middle - begin } else { lanes };
            scalar = if end - middle < scalar { end - middle } else { scalar };
        }
        for (pairs, rays) in batches.iter().zip(rays.chunks(LANES)) {
            for (t, (origin, direction)) in pairs.first_hits(Level::new(), 0.18e-6).iter().zip(rays) {
                let expected = ray_torus(origin, direction, 1.0, 0.18, 0.18e-6);
                assert_eq!(expected.is_some(), !t.is_nan());
                let error = expected.map_or(0.0, |expected| (t - expected).abs());
                met += usize::from(!t.is_nan());
                worst = if error > worst { error } else { worst };
            }
        }
        let each = 1e9 / rays.len() as f64;
        println!(
            "  {name:7} {:6.1} | {:6.1}   ({met} of {} hit, largest difference {worst:.1e})",
            lanes * each,
            scalar * each,
            rays.len()
        );
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
                let rows = (1..=count).take_while(|rows| rows * rows <= count).filter(|rows| count % rows == 0).last();
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
        let corner = forward + up * (0.5 * pixel * f64::from(HEIGHT)) - right * (0.5 * pixel * f64::from(WIDTH));
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
            indirect.push(Ray { origin: point, direction: warp::Frame::about(&normal).world(&local), leaves });
        }
        if kind == 0 {
            rays.indirect = indirect;
        }
    }
    rays
}

fn measure(sheet: &Sheet, spp: u32) {
    let (model, _) = RenderModel::compile(&sheet.scene);
    let states = sheet.scene.initial_bodies();
    let rings = sheet.scene.rings.len();
    let world = World::new(&model, &states).expect("the state is the scene's");
    let (mut build, mut refit) = (f64::INFINITY, f64::INFINITY);
    let mut hierarchy = None;
    for _ in 0..5 {
        for best in [&mut build, &mut refit] {
            let begin = core_seconds();
            let world = World::after(&model, &states, hierarchy.take()).expect("the state is the scene's");
            let seconds = core_seconds() - begin;
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
            for (batch, rays) in rays.chunks(BATCH).enumerate() {
                match ends {
                    None => {
                        world.closest_each(&mut tracer, rays, &mut hits);
                        sum += hits.iter().flatten().filter(|hit| (hit.surface as usize) < rings).count();
                    }
                    Some(ends) => {
                        let ends = &ends[batch * BATCH..][..rays.len()];
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
                for (batch, rays) in rays.chunks(BATCH).enumerate().step_by(16) {
                    for (place, ray) in rays.iter().enumerate() {
                        let end = ends.map_or(f64::INFINITY, |ends| ends[batch * BATCH + place].distance);
                        sum += usize::from(reference.closest(ray, end, ends.is_some()) < end);
                    }
                }
                black_box(sum);
                let traced = rays.chunks(BATCH).step_by(16).map(<[Ray]>::len).sum::<usize>();
                let seconds = (core_seconds() - begin) * rays.len() as f64 / traced as f64;
                best_reference = if seconds < best_reference { seconds } else { best_reference };
            }
        }
        for rays in rays.chunks(BATCH).step_by(16) {
            if ends.is_none() {
                world.closest_each(&mut tracer, rays, &mut hits);
                for (ray, hit) in rays.iter().zip(&hits) {
                    let ring = hit.filter(|hit| (hit.surface as usize) < rings);
                    let expected = reference.closest(ray, f64::INFINITY, false);
                    let far = hit.map_or(f64::INFINITY, |hit| hit.distance);
                    let same = ring.map_or(expected >= far, |hit| (hit.distance - expected).abs() < 1e-9 * far);
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
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let begin = core_seconds();
        let film = render(&model, &states, 0, 1, NonZeroUsize::MIN).expect("the state is the scene's");
        let seconds = core_seconds() - begin;
        best = if seconds < best { seconds } else { best };
        println!(
            "  frame     {:9} rays             {:6.2} M rays/s, film {}",
            film.rays,
            film.rays as f64 / best * 1e-6,
            film.hash().short()
        );
    }
}

/// The scalar reference: the first ring that a ray meets.
struct Reference {
    rings: Vec<(Vec3, [Vec3; 3])>,
    nodes: Vec<([Vec3; 2], usize, usize)>,
    order: Vec<usize>,
}

impl Reference {
    fn new(scene: &Scene) -> Reference {
        let rings = scene.rings.iter().map(|ring| {
            let z = axis(ring);
            let frame = warp::Frame::about(&z);
            (Vec3::from(ring.position_m), [frame.x, frame.y, z])
        });
        let rings: Vec<_> = rings.collect();
        let mut reference = Reference { order: (0..rings.len()).collect(), nodes: Vec::new(), rings };
        reference.build(0, reference.order.len());
        reference
    }

    /// Halves along the widest axis, down to two rings.
    fn build(&mut self, first: usize, count: usize) -> usize {
        let half = |axes: &[Vec3; 3]| axes[2].map(|n| (1.0 - n * n).abs().sqrt() + 0.18);
        let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        for &ring in &self.order[first..first + count] {
            let (centre, axes) = &self.rings[ring];
            low = low.zip_map(&(centre - half(axes)), |a, b| if b < a { b } else { a });
            high = high.zip_map(&(centre + half(axes)), |a, b| if b > a { b } else { a });
        }
        let index = self.nodes.len();
        self.nodes.push(([low, high], first, count));
        if count > 2 {
            let axis = (high - low).imax();
            let rings = &self.rings;
            self.order[first..first + count].sort_by(|&a, &b| rings[a].0[axis].total_cmp(&rings[b].0[axis]));
            self.build(first, count / 2);
            let right = self.build(first + count / 2, count - count / 2);
            self.nodes[index].1 = right;
            self.nodes[index].2 = 0;
        }
        index
    }

    fn closest(&self, ray: &Ray, end: f64, any: bool) -> f64 {
        let inverse = ray.direction.map(|x| 1.0 / x);
        let mut best = end;
        let (mut stack, mut height) = ([0; 64], 1);
        while height > 0 {
            height -= 1;
            let index = stack[height];
            let ([low, high], first, count) = &self.nodes[index];
            let (mut start, mut stop) = (0.0, best);
            for axis in 0..3 {
                let a = (low[axis] - ray.origin[axis]) * inverse[axis];
                let b = (high[axis] - ray.origin[axis]) * inverse[axis];
                let (a, b) = if a < b { (a, b) } else { (b, a) };
                start = if a > start { a } else { start };
                stop = if b < stop { b } else { stop };
            }
            if start > stop {
                continue;
            }
            if *count == 0 {
                let axis = (high - low).imax();
                let (near, far) = if ray.direction[axis] > 0.0 { (index + 1, *first) } else { (*first, index + 1) };
                (stack[height], stack[height + 1]) = (far, near);
                height += 2;
                continue;
            }
            for &ring in &self.order[*first..first + count] {
                if ray.leaves == Some(ring as u32) {
                    continue;
                }
                let (centre, [x, y, z]) = &self.rings[ring];
                let local = |v: &Vec3| Vec3::new(x.dot(v), y.dot(v), z.dot(v));
                let hit = ray_torus(&local(&(ray.origin - centre)), &local(&ray.direction), 1.0, 0.18, 0.18e-6);
                if let Some(t) = hit.filter(|&t| t < best) {
                    best = t;
                    if any {
                        return best;
                    }
                }
            }
        }
        best
    }
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

/// Time that this process has had a core, where the system tells (Linux): other load does not count. Else the time of day.
fn core_seconds() -> f64 {
    static BEGIN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    let begin = BEGIN.get_or_init(Instant::now);
    let schedule = std::fs::read_to_string("/proc/self/schedstat").ok();
    let nanoseconds = schedule.as_deref().and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| begin.elapsed().as_secs_f64(), |nanoseconds| nanoseconds * 1e-9)
}

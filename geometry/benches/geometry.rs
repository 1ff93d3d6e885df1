//! Nanoseconds per call and a hash of the result bits, by class of input.
//!
//! `cargo bench -p geometry`. The hash must not depend on the machine or the build; the time may.

use geometry::{Circle, Vec3, arc::circle_circle_arcs, arc::rule_for, closest_points, torus::ray_torus};
use nalgebra::UnitQuaternion;
use std::{hint::black_box, time::Instant};

struct Random(u64);

impl Random {
    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        low + (high - low) * (((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64)
    }

    fn direction(&mut self) -> Vec3 {
        loop {
            let v = Vec3::new(self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0));
            if v.norm_squared() > 1e-4 && v.norm_squared() < 1.0 {
                return v.normalize();
            }
        }
    }
}

/// Runs `call` on all inputs until half a second has passed; prints the best pass and the hash of the
/// results of one.
fn measure<T>(name: &str, inputs: &[T], call: impl Fn(&T) -> u64) {
    let mut best = f64::INFINITY;
    let mut hash = 0u64;
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < 0.5 {
        let pass = Instant::now();
        hash = 0xcbf2_9ce4_8422_2325;
        for input in inputs {
            hash = (hash ^ call(black_box(input))).wrapping_mul(0x0000_0100_0000_01b3);
        }
        let time = pass.elapsed().as_secs_f64() / inputs.len() as f64;
        if time < best {
            best = time;
        }
    }
    println!("{name:44} {:8.1} ns   {hash:016x}", best * 1e9);
}

type Pair = (Circle, Circle);

/// A weave of European 4-in-1 with every ring moved and turned a little: all pairs whose centres are near.
fn weave(disorder: f64) -> Vec<Pair> {
    let mut random = Random(1);
    let mut rings = Vec::new();
    for row in 0..24 {
        for column in 0..24 {
            let odd = row % 2 == 1;
            let centre = Vec3::new(
                1.25 * f64::from(column) + if odd { 0.625 } else { 0.0 },
                1.25 * f64::from(row),
                0.0,
            ) + random.direction() * disorder;
            let tilt = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), if odd { -0.6 } else { 0.6 });
            let turn = UnitQuaternion::from_scaled_axis(random.direction() * disorder);
            rings.push(Circle::from_pose(centre, &(turn * tilt), 1.0));
        }
    }
    let mut pairs = Vec::new();
    for (i, a) in rings.iter().enumerate() {
        for b in &rings[i + 1..] {
            if (a.centre - b.centre).norm_squared() < 2.36 * 2.36 {
                pairs.push((*a, *b));
            }
        }
    }
    pairs
}

fn arcs_hash(pair: &Pair, reach: f64) -> u64 {
    let arcs = circle_circle_arcs(&pair.0, &pair.1, reach);
    arcs.iter().fold(0, |hash, arc| hash ^ arc.half_tangent.to_bits() ^ arc.mid_cos.to_bits())
}

fn bench_arcs() {
    let reach = 0.36;
    let near = |pair: &&Pair| (closest_points(&pair.0, &pair.1).distance) < reach;
    let pairs = weave(0.12);
    let contacts: Vec<Pair> = pairs.iter().filter(near).copied().collect();
    let linked: Vec<Pair> =
        pairs.iter().filter(|p| geometry::linked(&p.0, &p.1) && !near(p)).copied().collect();
    let apart: Vec<Pair> =
        pairs.iter().filter(|p| !geometry::linked(&p.0, &p.1) && !near(p)).copied().collect();
    println!(
        "weave: {} candidate pairs, {} in contact, {} linked without contact, {} apart",
        pairs.len(),
        contacts.len(),
        linked.len(),
        apart.len()
    );
    measure("arcs: all candidates of the weave", &pairs, |p| arcs_hash(p, reach));
    measure("arcs: in contact", &contacts, |p| arcs_hash(p, reach));
    measure("arcs: linked, no contact", &linked, |p| arcs_hash(p, reach));
    measure("arcs: not linked, no contact", &apart, |p| arcs_hash(p, reach));
    measure("arcs and their points: in contact", &contacts, |p| {
        let mut sum = 0.0;
        for arc in circle_circle_arcs(&p.0, &p.1, reach).iter() {
            for node in arc.nodes(rule_for(arc.half_tangent, p.0.radius / reach)) {
                sum += node.weight * (node.cos + 2.0 * node.sin);
            }
        }
        sum.to_bits()
    });
    measure("closest_points: all candidates", &pairs, |p| closest_points(&p.0, &p.1).distance.to_bits());
    measure("linked: all candidates", &pairs, |p| u64::from(geometry::linked(&p.0, &p.1)));
}

struct Ray {
    origin: Vec3,
    direction: Vec3,
}

fn bench_rays() {
    let (major, minor) = (1.0, 0.18);
    let mut random = Random(2);
    let rays: Vec<Ray> = (0..40_000)
        .map(|_| {
            let target = random.direction() * random.uniform(0.0, 1.18);
            let origin = target + random.direction() * 5.0;
            Ray { origin, direction: (target - origin).normalize() }
        })
        .collect();
    let call = |ray: &Ray| ray_torus(&ray.origin, &ray.direction, major, minor, 0.0).map_or(0, f64::to_bits);
    measure("ray_torus: mixed", &rays, call);
    let (hits, misses): (Vec<Ray>, Vec<Ray>) = rays.into_iter().partition(|ray| call(ray) != 0);
    measure("ray_torus: hits", &hits, call);
    measure("ray_torus: misses", &misses, call);
    let mut outside = Vec::new();
    let mut shadow = Vec::new();
    for _ in 0..20_000 {
        let target = random.direction() * random.uniform(1.3, 3.0);
        let across = target.cross(&random.direction()).normalize();
        outside.push(Ray { origin: target - across * 5.0, direction: across });
        let mut angle = || random.uniform(0.0, core::f64::consts::TAU);
        let (a, b) = (angle(), angle());
        let n = Vec3::new(libm::cos(b) * libm::cos(a), libm::cos(b) * libm::sin(a), libm::sin(b));
        let origin = Vec3::new(libm::cos(a), libm::sin(a), 0.0) * major + n * minor;
        shadow.push(Ray { origin, direction: (n + random.direction()).normalize() });
    }
    measure("ray_torus: past the enclosing sphere", &outside, call);
    measure("ray_torus: from the surface, t_min 1e-7", &shadow, |ray| {
        ray_torus(&ray.origin, &ray.direction, major, minor, 1e-7).map_or(0, f64::to_bits)
    });
}

fn main() {
    bench_arcs();
    bench_rays();
}

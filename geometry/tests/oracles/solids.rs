//! Capsules and boxes against dense sampling.

use crate::double_double::Double;
use crate::random::Random;
use geometry::span::{Bend, least, negative_spans};
use geometry::{Vec3, capsule, cuboid};

const PI: f64 = core::f64::consts::PI;

/// A solid by its signed distance: (distance from the core less the radius).
struct Solid {
    capsule: Option<f64>,
    core: Vec3,
    radius: f64,
}

impl Solid {
    fn distance(&self, point: &Vec3) -> f64 {
        self.slope(point).1 - self.radius
    }

    fn slope(&self, point: &Vec3) -> (Vec3, f64) {
        match self.capsule {
            Some(half) => capsule::segment_distance(point, half),
            None => cuboid::core_distance(point, &self.core),
        }
    }

    fn ray(&self, origin: &Vec3, direction: &Vec3, t_min: f64) -> Option<f64> {
        match self.capsule {
            Some(half) => capsule::ray_capsule(origin, direction, half, self.radius, t_min),
            None => cuboid::ray_cuboid(origin, direction, &self.core, self.radius, t_min),
        }
    }

    fn inertia(&self) -> [f64; 3] {
        match self.capsule {
            Some(half) => capsule::inertia(half, self.radius, 1.0),
            None => cuboid::inertia(&self.core, self.radius, 1.0),
        }
    }
}

fn solids() -> Vec<Solid> {
    let core = Vec3::new(0.5, 0.3, 0.8);
    vec![
        Solid { capsule: Some(0.7), core, radius: 0.3 },
        Solid { capsule: Some(0.01), core, radius: 0.5 },
        Solid { capsule: None, core, radius: 0.1 },
        Solid { capsule: None, core, radius: 0.0 },
        Solid { capsule: None, core: Vec3::new(0.9, 0.02, 0.4), radius: 0.01 },
    ]
}

/// The distance from the core by looking at every point of it: a lattice of `count` points an axis.
fn sampled_distance(solid: &Solid, point: &Vec3, count: i32) -> f64 {
    let half = match solid.capsule {
        Some(half) => Vec3::new(0.0, 0.0, half),
        None => solid.core,
    };
    let mut nearest = f64::INFINITY;
    let at = |index: i32, half: f64| half * (2.0 * f64::from(index) / f64::from(count) - 1.0);
    let many = |half: f64| if half > 0.0 { 0..=count } else { 0..=0 };
    for i in many(half.x) {
        for j in many(half.y) {
            for k in many(half.z) {
                let apart = (point - Vec3::new(at(i, half.x), at(j, half.y), at(k, half.z))).norm();
                if apart < nearest {
                    nearest = apart;
                }
            }
        }
    }
    nearest
}

#[test]
fn distances_are_those_of_the_nearest_point() {
    let mut random = Random(61);
    for solid in solids() {
        for _ in 0..40 {
            let point = random.direction() * random.uniform(0.0, 2.0);
            let (normal, distance) = solid.slope(&point);
            assert!((normal.norm() - 1.0).abs() < 1e-15);
            if distance > 0.0 {
                let sampled = sampled_distance(&solid, &point, 64);
                // Half a diagonal of the lattice's cell at most, seen from the point: 0.016.
                assert!(sampled >= distance - 1e-12 && sampled - distance < 0.02, "{distance} {sampled}");
            }
            // The normal is the gradient: by a central difference.
            let step = 1e-6;
            for axis in 0..3 {
                let mut e = Vec3::zeros();
                e[axis] = step;
                let rise = (solid.slope(&(point + e)).1 - solid.slope(&(point - e)).1) / (2.0 * step);
                // Away from kinks 1e-9 of rounding and step^2 / distance^2 of bending.
                let near_kink = distance.abs() < 1e-2 || (solid.capsule.is_none() && distance < 0.0);
                assert!(near_kink || (rise - normal[axis]).abs() < 1e-7, "{rise} {normal:?}");
            }
        }
    }
}

#[test]
fn rays_cross_where_the_distance_changes_its_sign() {
    let mut random = Random(62);
    for (number, solid) in solids().iter().enumerate() {
        let (mut hits, mut worst) = (0, 0.0);
        for _ in 0..4000 {
            let origin = random.direction() * random.uniform(0.0, 3.0);
            let direction = (random.direction() * 0.7 - origin).normalize();
            let t_min = 1e-6;
            let found = solid.ray(&origin, &direction, t_min);
            // Marching by the distance never passes a surface.
            let mut t = t_min;
            let inside = solid.distance(&(origin + direction * t)) < 0.0;
            let marched = loop {
                let distance = solid.distance(&(origin + direction * t)).abs();
                if distance < 1e-11 {
                    break Some(t);
                }
                t += distance;
                if t > 8.0 {
                    break None;
                }
            };
            match (found, marched) {
                (Some(found), Some(marched)) => {
                    hits += 1;
                    let off = solid.distance(&(origin + direction * found)).abs();
                    if off > worst {
                        worst = off;
                    }
                    assert!(found >= marched - 1e-9, "{number}: {found} before {marched}");
                    // Marching creeps where a ray leaves at a shallow angle.
                    assert!(inside || found - marched < 1e-4, "{number}: {found} after {marched}");
                }
                (None, None) => {}
                // A ray that only touches.
                (found, marched) => {
                    let least = (0..8000)
                        .map(|step| solid.distance(&(origin + direction * (f64::from(step) * 1e-3))))
                        .fold(f64::INFINITY, |least, one| if one < least { one } else { least });
                    assert!(least > -1e-6, "{number}: {found:?} {marched:?} {least}");
                }
            }
        }
        println!("solid {number}: {hits} hits, surface met to {worst:e}, allowed 1e-14");
        assert!(hits > 500 && worst < 1e-14);
    }
}

/// From a million sizes away the crossing lies on the surface to half a unit in the last place of the ray parameter, in twice the
/// precision, and what rounding does near the solid.
#[test]
fn rays_from_far_away_meet_the_surface() {
    let mut random = Random(64);
    for (number, solid) in solids().iter().enumerate() {
        for away in [1e3, 1e6] {
            let (mut hits, mut worst) = (0, 0.0);
            for _ in 0..4000 {
                let direction = random.direction();
                let towards = random.direction() * random.uniform(0.0, 0.9);
                let origin = towards - direction * away;
                let Some(t) = solid.ray(&origin, &direction, 1e-6) else { continue };
                let at = |axis: usize| {
                    (Double::from(origin[axis]) + Double::from(t) * Double::from(direction[axis])).high
                };
                let off = solid.distance(&Vec3::new(at(0), at(1), at(2))).abs();
                worst = if off > worst { off } else { worst };
                hits += 1;
            }
            // The solids reach 1.1 about the origin, so half a unit in the last place of 1e6 or 1e3 is this.
            let half_unit = if away > 1e5 { 5.83e-11 } else { 5.7e-14 };
            let allowed = half_unit + 2e-14;
            println!("solid {number} from {away:e}: {hits} hits, off by {worst:.2e}, allowed {allowed:.2e}");
            assert!(hits > 1000 && worst < allowed, "solid {number} from {away:e}: {worst:e}");
        }
    }
}

#[test]
fn moments_of_inertia_are_those_of_a_lattice_of_points() {
    for (number, solid) in solids().iter().enumerate() {
        let mut count = 0.0;
        let mut sums = Vec3::zeros();
        let half = match solid.capsule {
            Some(half) => Vec3::new(0.0, 0.0, half),
            None => solid.core,
        };
        let size = half.add_scalar(solid.radius);
        let cells = 160;
        for i in 0..cells {
            for j in 0..cells {
                for k in 0..cells {
                    let at = |index: i32| f64::from(2 * index + 1) / f64::from(cells) - 1.0;
                    let point = Vec3::new(size.x * at(i), size.y * at(j), size.z * at(k));
                    if solid.distance(&point) < 0.0 {
                        count += 1.0;
                        sums += point.component_mul(&point);
                    }
                }
            }
        }
        let [x, y, z] = [sums.x / count, sums.y / count, sums.z / count];
        for (exact, sampled) in solid.inertia().iter().zip([y + z, z + x, x + y]) {
            let off = (sampled / exact - 1.0).abs();
            println!("solid {number}: inertia {exact}, sampled {sampled}, off {off:e}");
            // Cells at the surface, 1 of 160 of the half extents, are in or out by chance: far less than their size.
            assert!(off < 1e-3);
        }
    }
}

#[test]
fn spans_and_least_values_are_those_of_a_dense_scan() {
    let mut random = Random(63);
    for (number, solid) in solids().iter().enumerate() {
        let (mut contacts, mut evaluations, mut worst) = (0, 0.0, 0.0);
        for case in 0..400 {
            let radius = random.uniform(0.3, 1.5);
            let circle = random.circle(1.5, radius);
            let reach = solid.radius + random.uniform(0.02, 0.2);
            let calls = core::cell::Cell::new(0);
            let f = |t: f64| {
                calls.set(calls.get() + 1);
                let (sin, cos) = libm::sincos(t / circle.radius);
                let (normal, distance) = solid.slope(&circle.point(cos, sin));
                let tangent = circle.w * cos - circle.u * sin;
                (distance - reach, normal.dot(&tangent))
            };
            let half = PI * circle.radius;
            // A known bend, and none: the same answer.
            let bend = if case % 2 == 0 { Bend::AtLeast(1.0 / circle.radius) } else { Bend::Unknown };
            let spans = negative_spans(-half, half, bend, 1e-4 * circle.radius, f);
            if case % 2 == 0 {
                evaluations += f64::from(calls.get());
            }
            let inside = |t: f64| spans.as_slice().iter().any(|&(start, end)| t > start && t < end);
            let near_end = |t: f64| {
                spans
                    .as_slice()
                    .iter()
                    .any(|&(start, end)| (t - start).abs() < 1e-9 || (t - end).abs() < 1e-9)
            };
            let mut lowest = f64::INFINITY;
            for index in 0..2000 {
                let t = half * (2.0 * (f64::from(index) + 0.5) / 2000.0 - 1.0);
                let value = f(t).0;
                if value < lowest {
                    lowest = value;
                }
                assert!(
                    (value < 0.0) == inside(t) || value.abs() < 1e-7 || near_end(t),
                    "{number} {case} {t}"
                );
            }
            contacts += i32::from(!spans.as_slice().is_empty());
            let (bottom, place) = least(-half, half, bend, 1e-4 * circle.radius, 1e-10, f);
            assert!((f(place).0 - bottom).abs() < 1e-15);
            // The scan's steps are at most 4.7 mm: it misses a bottom that is a kink by half of that.
            let off = lowest - bottom;
            assert!(off > -1e-9 && off < 2.4e-3, "{number} {case}: {lowest} {bottom}");
            if off < 0.0 && -off > worst {
                worst = -off;
            }
        }
        println!(
            "solid {number}: {contacts} of 400 in contact, {:.0} evaluations a pair, least value off {worst:e}",
            evaluations / 200.0
        );
        assert!(contacts > 50);
    }
}

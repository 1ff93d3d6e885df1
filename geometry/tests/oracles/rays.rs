//! Rays to a torus in classes, and where twice the precision says that they meet it.
//!
//! The first eleven classes are those that ray-torus solvers are compared on: hits from all around, hits and misses mixed,
//! grazing hits, rays in the ring's plane and along its axis, thin wires, origins far away, origins on the surface.

use crate::{
    double_double::{Double, roots},
    random::Random,
};
use geometry::{Vec3, torus::normal};

/// The eleven classes, each with the largest errors of the ray parameter that are allowed, in units of the major radius: of
/// 99.9 % of the rays, and of the worst. They are about twice what is measured, and of two sources: a grazing ray's
/// crossing is as much less sharp as its angle is small, and a parameter has 53 bits (`far1e6`: half a unit in its last place).
pub const CLASSES: [(&str, f64, f64); 11] = [
    ("hits", 1.2e-13, 2.0e-12),
    ("mixed", 8.0e-15, 4.0e-14),
    ("grazing", 3.0e-10, 1.0e-9),
    ("plane", 8.9e-16, 8.9e-16),
    ("axis", 3.6e-15, 7.2e-15),
    ("thin1e-3", 1.8e-13, 2.0e-12),
    ("thin1e-4", 1.3e-13, 3.0e-12),
    ("far1e3", 1.2e-13, 1.2e-13),
    ("far1e6", 1.2e-10, 1.2e-10),
    ("shadow", 4.0e-15, 8.0e-15),
    ("shadow0", 4.0e-15, 8.0e-15),
];

/// A ray and its torus of major radius 1.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    pub minor_radius: f64,
    pub t_min: f64,
}

/// The ray parameters of all crossings beyond `t_min`, in order.
pub fn crossings(ray: &Ray, major_radius: f64) -> Vec<f64> {
    let s = Double::from(-ray.origin.dot(&ray.direction));
    let d = ray.direction.map(Double::from);
    let p = [0, 1, 2].map(|i| Double::from(ray.origin[i]) + s * d[i]);
    let dot = |a: &[Double; 3], b: &[Double; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let d = [d.x, d.y, d.z];
    let r = Double::from(ray.minor_radius);
    let major = Double::from(major_radius);
    let two = Double::from(2.0);
    let four = Double::from(4.0) * major * major;
    // X - R^2 - r^2 = x0 + x1 u + x2 u^2; f = (..)^2 + 4 R^2 (z^2 - r^2).
    let x = [dot(&p, &p) - major * major - r * r, two * dot(&p, &d), dot(&d, &d)];
    let z = [p[2], d[2]];
    let quartic = [
        x[0] * x[0] + four * (z[0] * z[0] - r * r),
        two * (x[0] * x[1] + four * z[0] * z[1]),
        two * x[0] * x[2] + x[1] * x[1] + four * z[1] * z[1],
        two * x[1] * x[2],
        x[2] * x[2],
    ];
    let bound = Double::from(3.0 * major_radius);
    let t_min = Double::from(ray.t_min) - s;
    roots(&quartic, -bound, bound).into_iter().filter(|&u| u > t_min).map(|u| (s + u).high).collect()
}

/// The ray parameter of the first crossing beyond `t_min`.
pub fn reference(ray: &Ray, major_radius: f64) -> Option<f64> {
    crossings(ray, major_radius).first().copied()
}

pub fn surface_point(random: &mut Random, minor: f64) -> Vec3 {
    let (a, b) = (random.uniform(0.0, core::f64::consts::TAU), random.uniform(0.0, core::f64::consts::TAU));
    let rho = 1.0 + minor * libm::cos(b);
    Vec3::new(rho * libm::cos(a), rho * libm::sin(a), minor * libm::sin(b))
}

/// A ray from `distance` away through a point.
fn towards(random: &mut Random, point: Vec3, distance: f64, minor_radius: f64) -> Ray {
    let origin = point + random.direction() * distance;
    Ray { origin, direction: (point - origin).normalize(), minor_radius, t_min: 0.0 }
}

/// A cosine-distributed direction about a unit vector.
pub fn cosine(random: &mut Random, about: &Vec3) -> Vec3 {
    (about + random.direction()).normalize()
}

/// A ray of a class, to a torus of major radius 1.
pub fn make(class: &str, random: &mut Random) -> Ray {
    match class {
        "hits" | "hits20" => {
            let point = surface_point(random, 0.18);
            let distance = if class == "hits" { 3.0 } else { random.uniform(3.0, 20.0) };
            towards(random, point, distance, 0.18)
        }
        "mixed" => {
            let point = random.direction() * random.uniform(0.0, 1.18);
            towards(random, point, 5.0, 0.18)
        }
        "grazing" => {
            // Tangent at a surface point, moved in or out so that the two crossings are about 1e-5 apart.
            let point = surface_point(random, 0.18);
            let n = normal(&point, 1.0);
            let direction = n.cross(&random.direction()).normalize();
            let shift = random.uniform(-1e-10, 1e-10);
            let origin = point + n * shift - direction * random.uniform(2.0, 5.0);
            Ray { origin, direction, minor_radius: 0.18, t_min: 0.0 }
        }
        "plane" | "rim" => {
            let reach = if class == "plane" { 0.3 } else { 1.3 };
            let angle = random.uniform(0.0, core::f64::consts::TAU);
            let target = Vec3::new(random.uniform(-reach, reach), random.uniform(-reach, reach), 0.0);
            let origin = Vec3::new(4.0 * libm::cos(angle), 4.0 * libm::sin(angle), 0.0);
            Ray { origin, direction: (target - origin).normalize(), minor_radius: 0.18, t_min: 0.0 }
        }
        "axis" => {
            let origin = Vec3::new(random.uniform(-1.3, 1.3), random.uniform(-1.3, 1.3), 3.0);
            Ray { origin, direction: -Vec3::z(), minor_radius: 0.18, t_min: 0.0 }
        }
        "thin1e-3" | "thin1e-4" => {
            let minor = if class == "thin1e-3" { 1e-3 } else { 1e-4 };
            let point = surface_point(random, minor);
            towards(random, point, 3.0, minor)
        }
        "far1e3" | "far1e6" => {
            let point = surface_point(random, 0.18);
            towards(random, point, if class == "far1e3" { 1e3 } else { 1e6 }, 0.18)
        }
        "shadow" | "shadow0" => {
            let origin = surface_point(random, 0.18);
            let direction = cosine(random, &normal(&origin, 1.0));
            let t_min = if class == "shadow" { 1e-6 } else { 1e-9 };
            Ray { origin, direction, minor_radius: 0.18, t_min }
        }
        "thin1e-6" | "fat" | "horn" => {
            let minor = [("thin1e-6", 1e-6), ("fat", 0.49), ("horn", 1.0)]
                .into_iter()
                .find(|(name, _)| *name == class)
                .map_or(f64::NAN, |(_, minor)| minor);
            let point = surface_point(random, minor);
            let distance = random.uniform(3.0, 20.0);
            towards(random, point, distance, minor)
        }
        "inside" => {
            let depth = random.uniform(0.0, 0.99);
            let point = surface_point(random, 0.18 * depth);
            Ray { origin: point, direction: random.direction(), minor_radius: 0.18, t_min: 0.0 }
        }
        "hole" => {
            let origin = random.direction() * random.uniform(0.0, 0.8);
            Ray { origin, direction: random.direction(), minor_radius: 0.18, t_min: 0.0 }
        }
        _ => panic!("no ray class {class}"),
    }
}

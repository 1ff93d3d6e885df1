//! The same bits in every build and on every machine: hashes of many results.
//!
//! A change of an algorithm may change them; the commit then says why. The failing test prints the new
//! values. A difference between builds or machines is a bug.

use crate::random::Random;
use geometry::{
    Vec3, arc::circle_circle_arcs, arc::rule_for, closest_points, rotation, sphere::ray_sphere,
    torus::ray_torus,
};

/// FNV-1a over 64-bit words.
struct Hash(u64);

impl Hash {
    fn add(&mut self, value: f64) {
        self.0 = (self.0 ^ value.to_bits()).wrapping_mul(0x0000_0100_0000_01b3);
    }

    fn add_all(&mut self, v: &Vec3) {
        v.iter().for_each(|&x| self.add(x));
    }
}

fn arcs() -> Hash {
    let (mut random, mut hash) = (Random(600), Hash(0));
    for _ in 0..5000 {
        let a = random.circle(2.0, 1.0);
        let b = random.circle(0.2, 1.1);
        for arc in circle_circle_arcs(&a, &b, 0.36).iter() {
            for node in arc.nodes(rule_for(arc.half_tangent, 2.8)) {
                hash.add(node.cos);
                hash.add(node.sin);
                hash.add(node.weight);
            }
        }
    }
    hash
}

fn closest() -> Hash {
    let (mut random, mut hash) = (Random(601), Hash(0));
    for _ in 0..2000 {
        let a = random.circle(2.0, 1.0);
        let b = random.circle(0.2, 1.1);
        let found = closest_points(&a, &b);
        hash.add(found.distance);
        hash.add_all(&found.point_a);
        hash.add_all(&found.point_b);
    }
    hash
}

fn rays() -> Hash {
    let (mut random, mut hash) = (Random(602), Hash(0));
    for i in 0..20_000 {
        let distance = if i % 10 == 0 { 1000.0 } else { 4.0 };
        let origin = random.direction() * distance;
        let target = random.direction() * 1.1;
        let direction = (target - origin).normalize();
        hash.add(ray_torus(&origin, &direction, 1.0, 0.18, 0.0).unwrap_or(-1.0));
        hash.add(ray_sphere(&origin, &direction, &Vec3::x(), 0.7, 0.0).unwrap_or(-1.0));
    }
    hash
}

fn rotations() -> Hash {
    let (mut random, mut hash) = (Random(603), Hash(0));
    for _ in 0..5000 {
        let q = rotation::exp(random.direction() * random.log_uniform(1e-9, 4.0));
        let (u, w, n) = rotation::axes(&q);
        [u, w, n].iter().for_each(|axis| hash.add_all(axis));
    }
    hash
}

#[test]
fn results_have_the_recorded_bits() {
    let found = [arcs(), closest(), rays(), rotations()].map(|hash| format!("{:016x}", hash.0));
    let recorded = ["4897ea1b1ed461ed", "a5262c4532d0cf8a", "35acd435d23ee3b5", "9b58ef7ad1210cb2"];
    assert_eq!(found, recorded, "arcs, closest points, rays, rotations");
}

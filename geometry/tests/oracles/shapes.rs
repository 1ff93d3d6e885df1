//! Spheres, planes, boxes, rotations and quadrature tables.

use crate::random::Random;
use geometry::{
    Aabb, Circle, GaussRule, Vec3, plane, rotation, sphere,
    torus::{bounding_box, closest_point, gradient, normal, value},
};

#[test]
fn gauss_rules_are_the_roots_of_the_legendre_polynomials() {
    for rule in [GaussRule::Two, GaussRule::Three, GaussRule::Four, GaussRule::Six, GaussRule::Eight] {
        let nodes = rule.nodes();
        let n = nodes.len();
        for &(x, weight) in nodes {
            let (mut before, mut p) = (1.0, x);
            for k in 2..=n {
                let k = k as f64;
                (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
            }
            let slope = n as f64 * (before - x * p) / (1.0 - x * x);
            assert!(libm::fabs(p / slope) < 2e-16, "{rule:?}: {x} is {} off", p / slope);
            let expected = 2.0 / ((1.0 - x * x) * slope * slope);
            assert!(libm::fabs(weight - expected) < 3e-15, "{rule:?}: weight {weight}, expected {expected}");
        }
        for degree in 0..2 * n {
            let sum: f64 = nodes.iter().map(|&(x, w)| w * libm::pow(x, degree as f64)).sum();
            let exact = if degree % 2 == 0 { 2.0 / (degree as f64 + 1.0) } else { 0.0 };
            assert!(libm::fabs(sum - exact) < 5e-16, "{rule:?}, degree {degree}: {sum}, exact {exact}");
        }
    }
}

#[test]
fn exp_turns_by_the_length_of_its_vector() {
    let mut random = Random(9);
    let (mut worst, mut worst_norm) = (0.0, 0.0);
    for _ in 0..20_000 {
        let angle = random.log_uniform(1e-12, 7.0);
        let axis = random.direction();
        let q = rotation::exp(axis * angle);
        let half = 0.5 * angle;
        let expected = (libm::cos(half), axis * libm::sin(half));
        let error = libm::fabs(q.w - expected.0) + (q.imag() - expected.1).norm();
        let norm = libm::fabs(q.norm() - 1.0);
        worst = if error > worst { error } else { worst };
        worst_norm = if norm > worst_norm { norm } else { worst_norm };
    }
    println!("exp: error {worst:.1e} (tolerance 3e-15), length off by {worst_norm:.1e} (tolerance 1e-15)");
    assert!(worst < 3e-15 && worst_norm < 1e-15);
    assert_eq!(rotation::exp(Vec3::zeros()).w, 1.0);
    // A quarter turn about z takes x to y.
    let (u, w, n) = rotation::axes(&rotation::exp(Vec3::new(0.0, 0.0, core::f64::consts::FRAC_PI_2)));
    assert!(
        (u - Vec3::y()).norm() < 1e-15 && (w + Vec3::x()).norm() < 1e-15 && (n - Vec3::z()).norm() < 1e-15
    );
}

#[test]
fn axes_are_the_images_of_the_unit_vectors() {
    let mut random = Random(10);
    for _ in 0..1000 {
        let q = random.orientation();
        let (u, w, n) = rotation::axes(&q);
        for (axis, unit) in [(u, Vec3::x()), (w, Vec3::y()), (n, Vec3::z())] {
            assert!((axis - q * unit).norm() < 1e-15);
        }
        assert!((u.cross(&w) - n).norm() < 2e-15);
    }
}

#[test]
fn sphere_hits_lie_on_the_sphere_and_surface_origins_do_not_hit_themselves() {
    let mut random = Random(11);
    let mut worst = 0.0;
    let mut hits = 0;
    for i in 0..100_000 {
        let centre = random.direction() * random.uniform(0.0, 5.0);
        let radius = random.log_uniform(1e-3, 10.0);
        let outward = random.direction();
        let surface = centre + outward * radius;
        if i % 2 == 0 {
            let direction = random.direction();
            let direction = if direction.dot(&outward) < 0.0 { -direction } else { direction };
            let t = sphere::ray_sphere(&surface, &direction, &centre, radius, 1e-9 * radius + 1e-14);
            assert_eq!(t, None, "self-hit {surface:?} {direction:?} {centre:?} {radius}");
        } else {
            let far = random.log_uniform(1.0, 1e6);
            let origin = surface + random.direction() * far;
            let direction = (surface - origin).normalize();
            if let Some(t) = sphere::ray_sphere(&origin, &direction, &centre, radius, 0.0) {
                hits += 1;
                let off = libm::fabs(sphere::distance(&(origin + direction * t), &centre, radius));
                let off = off / (far + radius + 5.0);
                worst = if off > worst { off } else { worst };
            }
        }
    }
    println!("{hits} sphere hits, off the sphere by {worst:.1e} of the distance (tolerance 1e-15)");
    assert!(worst < 1e-15 && hits > 40_000);
    // From the centre, the exit; behind, nothing.
    let exit = sphere::ray_sphere(&Vec3::zeros(), &Vec3::x(), &Vec3::zeros(), 2.0, 0.0);
    assert_eq!(exit, Some(2.0));
    assert_eq!(sphere::ray_sphere(&Vec3::new(5.0, 0.0, 0.0), &Vec3::x(), &Vec3::zeros(), 2.0, 0.0), None);
    assert_eq!(sphere::normal(&Vec3::new(0.0, 3.0, 0.0), &Vec3::zeros()), Vec3::y());
    let around = sphere::bounding_box(&Vec3::x(), 2.0);
    assert_eq!((around.min.x, around.max.x, around.max.z), (-1.0, 3.0, 2.0));
}

#[test]
fn plane_hits_from_both_sides() {
    let up = Vec3::z();
    let origin = Vec3::new(0.0, 0.0, 3.0);
    assert_eq!(plane::ray_plane(&origin, &-up, &up, 1.0, 0.0), Some(2.0));
    assert_eq!(plane::ray_plane(&origin, &up, &up, 1.0, 0.0), None);
    assert_eq!(plane::ray_plane(&-origin, &up, &up, 1.0, 0.0), Some(4.0));
    assert_eq!(plane::ray_plane(&origin, &Vec3::x(), &up, 1.0, 0.0), None);
    assert_eq!(plane::ray_plane(&Vec3::z(), &Vec3::x(), &up, 1.0, 0.0), None);
    assert_eq!(plane::distance(&origin, &up, 1.0), 2.0);
    assert_eq!(plane::facing_normal(&up, &-up), up);
    assert_eq!(plane::facing_normal(&up, &up), -up);
}

#[test]
fn boxes() {
    let unit = Aabb { min: Vec3::zeros(), max: Vec3::new(1.0, 1.0, 1.0) };
    assert_eq!(Aabb::EMPTY.union(&unit), unit);
    assert!(Aabb::EMPTY.is_empty() && !unit.is_empty());
    assert_eq!(Aabb::EMPTY.surface_area(), 0.0);
    assert_eq!(unit.surface_area(), 6.0);
    assert_eq!(unit.centre(), Vec3::new(0.5, 0.5, 0.5));
    let right = Aabb { min: Vec3::new(1.0, 0.0, 0.0), max: Vec3::new(2.0, 1.0, 1.0) };
    assert!(unit.overlaps(&right) && !unit.overlaps(&Aabb { min: right.min * 1.5, ..right }));
    let inverse = |d: Vec3| d.map(|x| 1.0 / x);
    let origin = Vec3::new(-1.0, 0.5, 0.5);
    assert_eq!(unit.ray_interval(&origin, &inverse(Vec3::x()), 0.0, 10.0), Some((1.0, 2.0)));
    assert_eq!(unit.ray_interval(&origin, &inverse(-Vec3::x()), 0.0, 10.0), None);
    assert_eq!(unit.ray_interval(&origin, &inverse(Vec3::x()), 0.0, 0.5), None);
    // Within a face, along it.
    let in_face = Vec3::new(-1.0, 0.0, 1.0);
    assert_eq!(unit.ray_interval(&in_face, &inverse(Vec3::x()), 0.0, 10.0), Some((1.0, 2.0)));
}

#[test]
fn torus_value_gradient_normal_and_closest_point_agree() {
    let mut random = Random(12);
    let (major, minor) = (1.3, 0.2);
    let step = 1e-5;
    let mut worst = 0.0;
    for _ in 0..10_000 {
        let p = random.direction() * random.uniform(0.1, 3.0);
        if libm::hypot(p.x, p.y) < 0.2 {
            continue; // The gradient has a kink on the axis.
        }
        let g = gradient(&p, major);
        for i in 0..3 {
            let mut ahead = p;
            let mut behind = p;
            ahead[i] += step;
            behind[i] -= step;
            let slope = (value(&ahead, major, minor) - value(&behind, major, minor)) / (2.0 * step);
            let error = libm::fabs(slope - g[i]);
            worst = if error > worst { error } else { worst };
        }
        let c = closest_point(&p, major, minor);
        assert!(libm::fabs(value(&c, major, minor)) < 1e-14);
        // The way there is along the normal, and back.
        let way = p - c;
        assert!(way.cross(&normal(&c, major)).norm() < 1e-13, "{p:?}");
        assert!(libm::fabs(normal(&p, major).norm() - 1.0) < 1e-15);
    }
    println!("gradient against central differences: {worst:.1e} (tolerance 1e-7)");
    assert!(worst < 1e-7);
    assert_eq!(normal(&Vec3::new(major, 0.0, 0.0), major), Vec3::z());
}

#[test]
fn the_bounding_box_holds_the_ring_and_is_tight() {
    let mut random = Random(13);
    for _ in 0..200 {
        let circle: Circle = random.circle(3.0, 1.2);
        let around = bounding_box(&circle, 0.25);
        let mut sampled = Aabb::EMPTY;
        for (cos, sin) in crate::random::angles(2000, 0.0) {
            let p = circle.point(cos, sin);
            sampled = sampled.union(&sphere::bounding_box(&p, 0.25));
        }
        for i in 0..3 {
            let (low, high) = (sampled.min[i] - around.min[i], around.max[i] - sampled.max[i]);
            assert!(low > -1e-14 && low < 1e-5 && high > -1e-14 && high < 1e-5, "{low} {high}");
        }
    }
}

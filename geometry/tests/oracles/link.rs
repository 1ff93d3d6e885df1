//! `linked` against Gauss' linking integral.

use crate::random::{Random, angles};
use geometry::{Circle, Vec3, circle::linked, closest_points};
use nalgebra::UnitQuaternion;

/// Gauss' linking integral of two circles by the trapezoidal rule with `count` points on each.
fn linking_number(a: &Circle, b: &Circle, table: &[(f64, f64)]) -> f64 {
    let sample = |circle: &Circle| {
        table
            .iter()
            .map(|&(c, s)| (circle.point(c, s), (circle.w * c - circle.u * s) * circle.radius))
            .collect::<Vec<_>>()
    };
    let (points_a, points_b) = (sample(a), sample(b));
    let mut sum = 0.0;
    for (p, p_1) in &points_a {
        for (q, q_1) in &points_b {
            let d = p - q;
            let squared = d.norm_squared();
            sum += d.dot(&p_1.cross(q_1)) / (squared * squared.sqrt());
        }
    }
    let step = core::f64::consts::TAU / table.len() as f64;
    sum * step * step / (4.0 * core::f64::consts::PI)
}

#[test]
fn linked_agrees_with_the_linking_integral_on_random_pairs() {
    let mut random = Random(1);
    let (coarse, fine) = (angles(64, 0.0), angles(256, 0.0));
    let (mut tested, mut links, mut too_close, mut worst) = (0, 0, 0, 0.0);
    while tested < 10_000 {
        let radius = random.uniform(0.3, 1.5);
        let a = random.circle(1.8, radius);
        let b = random.circle(0.5, 1.0);
        let distance = closest_points(&a, &b).distance;
        // The rule's error falls as exp(-count * distance); closer pairs would need more points.
        if distance < 0.06 {
            too_close += 1;
            continue;
        }
        let number = linking_number(&a, &b, if distance < 0.3 { &fine } else { &coarse });
        let expected = if libm::fabs(number) > 0.5 { 1.0 } else { 0.0 };
        let error = libm::fabs(libm::fabs(number) - expected);
        if error > worst {
            worst = error;
        }
        assert_eq!(linked(&a, &b), expected == 1.0, "linking number {number}\n{a:?}\n{b:?}");
        assert_eq!(linked(&a, &b), linked(&b, &a), "order matters\n{a:?}\n{b:?}");
        tested += 1;
        links += u32::from(expected == 1.0);
    }
    println!("{tested} pairs, {links} linked, {too_close} skipped as too close, 0 disagreements");
    println!("linking integral from its integer: {worst:.1e} (tolerance 0.01)");
    assert!(worst < 0.01, "the oracle itself is too coarse: {worst}");
    assert!(links > 1000, "too few linked pairs to mean anything: {links}");
}

#[test]
fn linked_on_special_poses() {
    let flat = UnitQuaternion::identity();
    let upright = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), core::f64::consts::FRAC_PI_2);
    let ring = |x: f64, z: f64, q: &UnitQuaternion<f64>| Circle::from_pose(Vec3::new(x, 0.0, z), q, 1.0);
    let b = ring(0.0, 0.0, &flat);
    for (name, a, expected) in [
        ("identical", b, false),
        ("coplanar crossing", ring(1.5, 0.0, &flat), false),
        ("coaxial", ring(0.0, 0.3, &flat), false),
        ("parallel, over each other", ring(0.7, 0.3, &flat), false),
        ("upright through the hole", ring(1.0, 0.0, &upright), true),
        ("upright, high, through the hole", ring(1.0, 0.9, &upright), true),
        ("upright, too high", ring(1.0, 1.1, &upright), false),
        ("upright, outside", ring(2.1, 0.0, &upright), false),
        ("upright around the rim's other side", ring(-1.0, 0.0, &upright), true),
    ] {
        assert_eq!(linked(&a, &b), expected, "{name}");
        assert_eq!(linked(&b, &a), expected, "{name}, exchanged");
    }
}

#[test]
fn european_four_in_one_has_exactly_its_links() {
    // Pitch 1.25 R, axes tilted by +-0.6 rad row by row: each inner ring is linked to four others.
    let ring = |row: i32, column: i32| {
        let odd = row.rem_euclid(2) == 1;
        let shift = if odd { 0.625 } else { 0.0 };
        let tilt = if odd { -0.6 } else { 0.6 };
        Circle::from_pose(
            Vec3::new(1.25 * f64::from(column) + shift, 1.25 * f64::from(row), 0.0),
            &UnitQuaternion::from_axis_angle(&Vec3::y_axis(), tilt),
            1.0,
        )
    };
    let (rows, columns) = (8, 9);
    let places: Vec<_> = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))).collect();
    let mut links = 0;
    let mut smallest = f64::INFINITY;
    for (n, &(i, j)) in places.iter().enumerate() {
        for &(k, l) in &places[n + 1..] {
            let (a, b) = (ring(i, j), ring(k, l));
            let neighbour = k == i + 1 && (l == j || l == if i % 2 == 0 { j - 1 } else { j + 1 });
            assert_eq!(linked(&a, &b), neighbour, "({i}, {j}) and ({k}, {l})");
            links += i32::from(neighbour);
            let distance = closest_points(&a, &b).distance;
            if distance < smallest {
                smallest = distance;
            }
        }
    }
    assert_eq!(links, (rows - 1) * (2 * columns - 1));
    println!("smallest distance of two centrelines {smallest:.6} (expected 0.5000)");
    assert!(libm::fabs(smallest - 0.5) < 5e-4);
}

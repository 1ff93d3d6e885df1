//! `closest_points` against dense sampling with local refinement.

use crate::random::{Random, angles, degenerate_pairs};
use geometry::{Circle, Vec3, circle::point_circle_distance, closest_points};

/// Distance from the point of `a` at angle `t` to circle `b`.
fn distance_at(a: &Circle, b: &Circle, t: f64) -> f64 {
    point_circle_distance(&a.point(libm::cos(t), libm::sin(t)), b)
}

/// The smallest distance by sampling, then ternary search about every local minimum of the samples that
/// could still win.
fn brute_force(a: &Circle, b: &Circle, table: &[(f64, f64)]) -> f64 {
    let samples: Vec<f64> = table.iter().map(|&(c, s)| point_circle_distance(&a.point(c, s), b)).collect();
    let n = samples.len();
    let step = core::f64::consts::TAU / n as f64;
    let mut best = samples.iter().fold(f64::INFINITY, |m, &d| if d < m { d } else { m });
    // The distance changes by at most the arc length.
    let bound = best + a.radius * step;
    for i in 0..n {
        let (before, after) = (samples[(i + n - 1) % n], samples[(i + 1) % n]);
        if samples[i] > bound || samples[i] > before || samples[i] > after {
            continue;
        }
        let (mut low, mut high) = ((i as f64 - 1.0) * step, (i as f64 + 1.0) * step);
        for _ in 0..60 {
            let (one, two) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if distance_at(a, b, one) < distance_at(a, b, two) { high = two } else { low = one }
        }
        let refined = distance_at(a, b, 0.5 * (low + high));
        if refined < best {
            best = refined;
        }
    }
    best
}

/// Largest error of the distance found, and the largest inconsistency of the points returned.
fn check(a: &Circle, b: &Circle, table: &[(f64, f64)]) -> (f64, f64) {
    let found = closest_points(a, b);
    let expected = brute_force(a, b, table);
    let off = [
        libm::fabs((found.point_a - found.point_b).norm() - found.distance),
        point_circle_distance(&found.point_a, a),
        point_circle_distance(&found.point_b, b),
    ];
    (found.distance - expected, off.into_iter().fold(0.0, |m, x| if x > m { x } else { m }))
}

#[test]
fn closest_points_are_globally_closest_on_random_pairs() {
    let mut random = Random(2);
    let table = angles(2000, 0.0);
    let (mut worst_over, mut worst_under, mut worst_off, mut worst_swap) = (0.0, 0.0, 0.0, 0.0);
    let keep = |worst: &mut f64, value: f64| {
        if value > *worst {
            *worst = value;
        }
    };
    for i in 0..10_000 {
        let radius = if i % 2 == 0 { 1.0 } else { random.log_uniform(0.1, 10.0) };
        let distance = random.uniform(0.0, 2.5 * (1.0 + radius));
        let a = random.circle(distance, radius);
        let b = random.circle(0.3, 1.0);
        let (error, off) = check(&a, &b, &table);
        let scale = 1.0 + radius;
        keep(&mut worst_over, error / scale);
        keep(&mut worst_under, -error / scale);
        keep(&mut worst_off, off / scale);
        let swapped = closest_points(&b, &a).distance - closest_points(&a, &b).distance;
        keep(&mut worst_swap, libm::fabs(swapped) / scale);
        assert!(error < 1e-12 * scale, "missed the global minimum by {error:.3e}\n{a:?}\n{b:?}");
    }
    println!("in units of R_A + R_B, 10,000 random pairs:");
    println!("distance over the brute-force minimum  {worst_over:.1e} (tolerance 1e-12)");
    println!("distance under the brute-force minimum {worst_under:.1e} (tolerance 1e-12: the search's own)");
    println!("points off their circles or apart      {worst_off:.1e} (tolerance 1e-14)");
    println!("circles exchanged                      {worst_swap:.1e} (tolerance 1e-13)");
    assert!(worst_under < 1e-12 && worst_off < 1e-14 && worst_swap < 1e-13);
}

#[test]
fn closest_points_in_all_degenerate_poses() {
    let table = angles(4000, 0.0);
    for radius in [1.0, 0.5, 1.7] {
        for (name, a, b) in degenerate_pairs(radius) {
            for (order, first, second) in [("", a, b), (", exchanged", b, a)] {
                let (error, off) = check(&first, &second, &table);
                println!("{name}{order}, radius {radius}: over {error:.1e} (tolerance 1e-12), off {off:.1e}");
                assert!(libm::fabs(error) < 1e-12 && off < 1e-14, "{name}{order}, radius {radius}");
            }
        }
    }
}

#[test]
fn closest_points_closed_forms() {
    for (name, a, b) in degenerate_pairs(1.0) {
        let expected = match name {
            "coaxial 0.36" => 0.36,
            "coplanar apart" => 0.2,
            "coplanar inside" => 0.0,
            "concentric orthogonal" => 0.0,
            "orthogonal, linked" => 1.0,
            "orthogonal through the centre of B" => 1.0,
            _ => continue,
        };
        let found = closest_points(&a, &b).distance;
        assert!(libm::fabs(found - expected) < 1e-13, "{name}: {found}, expected {expected}");
    }
}

#[test]
fn scaling_by_a_power_of_two_is_exact_and_rotation_changes_nothing() {
    let mut random = Random(3);
    let mut worst = 0.0;
    for _ in 0..2000 {
        let a = random.circle(2.0, 1.3);
        let b = random.circle(0.5, 1.0);
        let found = closest_points(&a, &b);
        for scale in [1024.0, 1.0 / 1048576.0] {
            let scaled = |c: &Circle| Circle { centre: c.centre * scale, radius: c.radius * scale, ..*c };
            let other = closest_points(&scaled(&a), &scaled(&b));
            assert_eq!(other.distance.to_bits(), (found.distance * scale).to_bits(), "{a:?} {b:?}");
            assert_eq!(other.point_a, found.point_a * scale);
        }
        let (q, shift) = (random.orientation(), Vec3::new(0.3, -0.2, 0.7));
        let moved = |c: &Circle| Circle {
            centre: q * c.centre + shift,
            u: q * c.u,
            w: q * c.w,
            normal: q * c.normal,
            radius: c.radius,
        };
        let change = libm::fabs(closest_points(&moved(&a), &moved(&b)).distance - found.distance);
        if change > worst {
            worst = change;
        }
    }
    println!("rotated and shifted: distance changes by {worst:.1e} (tolerance 1e-13)");
    assert!(worst < 1e-13);
}

#[test]
fn closest_points_at_extreme_sizes_and_distances() {
    let mut random = Random(15);
    let table = angles(4000, 0.0);
    let mut worst = 0.0;
    for (radius, distance) in
        [(1e-3, 1.1), (1e3, 1e3), (1.0, 1e6), (1e3, 1e6), (1.0, 1e-9), (1.0 + 1e-9, 1e-9), (1e-3, 1e-3)]
    {
        for _ in 0..100 {
            let a = random.circle(distance, radius);
            let b = random.circle(distance * 1e-3, 1.0);
            for (first, second) in [(a, b), (b, a)] {
                let (error, _) = check(&first, &second, &table);
                let error = error / (1.0 + radius + distance);
                worst = if error > worst { error } else { worst };
                assert!(error < 1e-12, "radius {radius}, distance {distance}: {error:.1e}\n{a:?}\n{b:?}");
            }
        }
    }
    println!("over the brute-force minimum by {worst:.1e} of sizes and distance (tolerance 1e-12)");
}

#[test]
fn not_a_number_ends_without_a_contact() {
    let nan = Circle::from_pose(Vec3::new(f64::NAN, 0.0, 0.0), &nalgebra::UnitQuaternion::identity(), 1.0);
    let good = Circle::from_pose(Vec3::zeros(), &nalgebra::UnitQuaternion::identity(), 1.0);
    for (a, b) in [(&nan, &good), (&good, &nan)] {
        assert!(closest_points(a, b).distance.is_nan());
        assert!(geometry::arc::circle_circle_arcs(a, b, 0.36).is_empty());
        assert!(!geometry::linked(a, b));
    }
}

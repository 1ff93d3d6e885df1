//! Contact arcs against dense sampling, and their quadrature.

use crate::random::{Random, angles, degenerate_pairs};
use geometry::{
    Arc, Arcs, Circle, Vec3,
    arc::{circle_circle_arcs, circle_plane_arcs, circle_point_arcs},
    circle::point_circle_distance,
    closest_points,
};

const POINTS: usize = 20_000;

/// Whether the angle lies on one of the arcs.
fn on_arcs(arcs: &Arcs, cos: f64, sin: f64) -> bool {
    arcs.iter().any(|arc| {
        let square = arc.half_tangent * arc.half_tangent;
        cos * arc.mid_cos + sin * arc.mid_sin > (1.0 - square) / (1.0 + square)
    })
}

/// What must hold of any result: bounds of the pieces, unit mid points, pieces of one connected arc end
/// to end, no overlap.
fn check_form(arcs: &Arcs) {
    let end = |arc: &Arc, sign: f64| {
        let square = arc.half_tangent * arc.half_tangent;
        let (c, s) = ((1.0 - square) / (1.0 + square), sign * 2.0 * arc.half_tangent / (1.0 + square));
        (arc.mid_cos * c - arc.mid_sin * s, arc.mid_sin * c + arc.mid_cos * s)
    };
    let pieces = arcs.as_slice();
    assert!(pieces.len() <= Arcs::CAPACITY);
    assert!(pieces.windows(2).all(|pair| pair[0].connected <= pair[1].connected), "{pieces:?}");
    for (i, arc) in pieces.iter().enumerate() {
        assert!(arc.half_tangent >= 0.0 && arc.half_tangent <= 0.4143, "{arc:?}");
        assert!(libm::fabs(arc.mid_cos * arc.mid_cos + arc.mid_sin * arc.mid_sin - 1.0) < 2e-15, "{arc:?}");
        assert!(arc.connected <= 1, "{arc:?}");
        let (cos, sin) = end(arc, 1.0);
        let touching = pieces.iter().enumerate().any(|(j, other)| {
            let (c, s) = end(other, -1.0);
            j != i && other.connected == arc.connected && libm::hypot(c - cos, s - sin) < 1e-12
        });
        let pieces_of_it = pieces.iter().filter(|other| other.connected == arc.connected).count();
        let is_last = !touching;
        if is_last {
            let lasts = pieces
                .iter()
                .filter(|other| other.connected == arc.connected && end(other, 1.0) != (cos, sin))
                .count();
            assert_eq!(lasts, pieces_of_it - 1, "pieces of one arc do not touch: {pieces:?}");
        }
    }
}

/// Checks the arcs against samples of `depth` (positive inside); returns the largest |depth| at which
/// both disagree.
fn compare(arcs: &Arcs, table: &[(f64, f64)], depth: impl Fn(f64, f64) -> f64) -> f64 {
    check_form(arcs);
    let mut worst = 0.0;
    for &(cos, sin) in table {
        let depth = depth(cos, sin);
        if (depth > 0.0) != on_arcs(arcs, cos, sin) && libm::fabs(depth) > worst {
            worst = libm::fabs(depth);
        }
    }
    worst
}

fn compare_pair(a: &Circle, b: &Circle, reach: f64, table: &[(f64, f64)]) -> f64 {
    let arcs = circle_circle_arcs(a, b, reach);
    compare(&arcs, table, |cos, sin| reach - point_circle_distance(&a.point(cos, sin), b))
}

#[test]
fn arcs_agree_with_dense_sampling_on_random_pairs() {
    let mut random = Random(4);
    let table = angles(POINTS, 0.37);
    let mut worst = 0.0;
    let mut connected = [0; 3];
    for i in 0..10_000 {
        let radius = if i % 2 == 0 { 1.0 } else { random.log_uniform(0.2, 5.0) };
        let distance = random.uniform(0.0, 1.0 + radius);
        let a = random.circle(distance, radius);
        let b = random.circle(0.3, 1.0);
        let reach = match i % 5 {
            0 => 0.36,
            1 => random.log_uniform(1e-4, 1.0),
            2 => random.uniform(0.5, 3.0),
            // Shallow contacts: the wires overlap by a small part of the reach.
            _ => closest_points(&a, &b).distance * (1.0 + random.log_uniform(1e-12, 1e-1)),
        };
        let disagreement = compare_pair(&a, &b, reach, &table) / (1.0 + radius);
        assert!(disagreement < 2e-15, "{disagreement:.2e} {reach}\n{a:?}\n{b:?}");
        if disagreement > worst {
            worst = disagreement;
        }
        let arcs = circle_circle_arcs(&a, &b, reach);
        connected[arcs.connected_count()] += 1;
    }
    println!("10,000 random pairs x {POINTS} points: 0, 1, 2 connected arcs: {connected:?}");
    println!("largest |reach - distance| / (R_A + R_B) in disagreement {worst:.1e} (tolerance 2e-15)");
    assert!(connected.iter().all(|&n| n > 500), "one case is hardly tested: {connected:?}");
}

#[test]
fn shallow_arcs_agree_with_sampling_within_the_arc() {
    // Contacts from 1e-13 to 1e-3 deep: 2,000 samples over three times the arc's length.
    let mut random = Random(14);
    let mut worst = 0.0;
    let mut deep = 0;
    for _ in 0..5000 {
        let radius = random.log_uniform(0.5, 2.0);
        let distance = random.uniform(0.0, 1.0 + radius);
        let a = random.circle(distance, radius);
        let b = random.circle(0.3, 1.0);
        let closest = closest_points(&a, &b).distance;
        let depth = random.log_uniform(1e-13, 1e-3);
        let reach = closest + depth;
        let arcs = circle_circle_arcs(&a, &b, reach);
        assert!(!arcs.is_empty(), "depth {depth:.1e} missed\n{a:?}\n{b:?}");
        let centre = arcs.as_slice()[0];
        let samples: Vec<(f64, f64)> = (0..2000)
            .map(|i| {
                let angle = centre.half_angle() * 3.0 * (i as f64 - 999.5) / 1000.0;
                let (c, s) = (libm::cos(angle), libm::sin(angle));
                let (cos, sin) = (centre.mid_cos, centre.mid_sin);
                (cos * c - sin * s, sin * c + cos * s)
            })
            .collect();
        // The quartic's rounding is a part of its largest value, which is of order 1 for any reach.
        let tolerance = 2e-15 + 2e-15 / reach;
        let disagreement = compare_pair(&a, &b, reach, &samples) / (1.0 + radius);
        if disagreement / tolerance > worst {
            worst = disagreement / tolerance;
        }
        deep += u32::from(depth > 1e-8);
    }
    println!(
        "5,000 shallow contacts ({deep} deeper than 1e-8): largest depth in disagreement is {worst:.2} of \
         2e-15 + 2e-15 / reach (tolerance 1)"
    );
    assert!(worst < 1.0);
}

#[test]
fn arcs_in_all_degenerate_poses() {
    let table = angles(POINTS, 0.37);
    for radius in [1.0, 0.5, 1.7] {
        for (name, a, b) in degenerate_pairs(radius) {
            let touching = closest_points(&a, &b).distance;
            for reach in [0.36, 0.999_999 * touching, 1.000_001 * touching, 1e-3, 0.9, 1.1, 2.5] {
                if reach <= 0.0 {
                    continue;
                }
                for (first, second) in [(a, b), (b, a)] {
                    let disagreement = compare_pair(&first, &second, reach, &table);
                    assert!(disagreement < 3e-15, "{name} {radius} {reach}: {disagreement:.2e}");
                }
            }
        }
    }
}

#[test]
fn coaxial_rings_touch_all_around() {
    for (name, a, b) in degenerate_pairs(1.0) {
        if !name.starts_with("coaxial 0.36") {
            continue;
        }
        assert!(circle_circle_arcs(&a, &b, 0.359_999).is_empty(), "{name}");
        let arcs = circle_circle_arcs(&a, &b, 0.360_001);
        let length: f64 = arcs.iter().map(|arc| 2.0 * arc.half_angle()).sum();
        assert!(libm::fabs(length - core::f64::consts::TAU) < 1e-14, "{name}: {length}");
        assert!(arcs.iter().all(|arc| arc.connected == 0), "{name}");
    }
}

#[test]
fn shallow_contacts_keep_their_length() {
    // Two upright circles at distance D with a reach of D + p: near the deepest point the depth is
    // p - k t^2 / 2, so the arc's half angle is sqrt(2 p / k) (1 + O(p)).
    let quarter = nalgebra::UnitQuaternion::from_axis_angle(&Vec3::x_axis(), core::f64::consts::FRAC_PI_2);
    let b = Circle::from_pose(Vec3::zeros(), &nalgebra::UnitQuaternion::identity(), 1.0);
    let a = Circle::from_pose(Vec3::new(1.64, 0.0, 0.0), &quarter, 1.0);
    let distance = 0.36;
    // Point of A at angle pi + t: (1.64 - cos t, 0, sin t): D^2 = (0.64 - cos t)^2 + sin(t)^2, hence
    // D D'' = 0.64 at t = 0.
    let curvature = 0.64 / distance;
    let mut last = f64::INFINITY;
    for exponent in [2, 4, 6, 8, 10] {
        let depth = libm::pow(10.0, -f64::from(exponent));
        let arcs = circle_circle_arcs(&a, &b, distance + depth);
        assert_eq!(arcs.as_slice().len(), 1);
        let ratio = arcs.as_slice()[0].half_angle() / libm::sqrt(2.0 * depth / curvature);
        let error = libm::fabs(ratio - 1.0);
        let tolerance = 5.0 * depth + 2e-15 / depth;
        println!(
            "depth {depth:.0e}: relative error of the arc's length {error:.1e} (tolerance {tolerance:.1e})"
        );
        assert!(error < tolerance && ratio > 0.0);
        assert!(arcs.as_slice()[0].half_tangent < last);
        last = arcs.as_slice()[0].half_tangent;
    }
}

#[test]
fn plane_and_point_arcs_agree_with_dense_sampling() {
    let mut random = Random(5);
    let table = angles(POINTS, 0.37);
    let mut worst = 0.0;
    for i in 0..2000 {
        let radius = random.log_uniform(0.1, 3.0);
        let a = random.circle(1.5, radius);
        let (normal, offset) = if i % 10 == 0 {
            (a.normal, random.uniform(-1.0, 1.0))
        } else {
            (random.direction(), random.uniform(-2.0, 2.0))
        };
        let reach = random.log_uniform(1e-3, 1.0);
        let arcs = circle_plane_arcs(&a, &normal, offset, reach);
        let plane = compare(&arcs, &table, |c, s| reach - (normal.dot(&a.point(c, s)) - offset));
        let point = if i % 10 == 0 { a.centre + a.normal * 0.4 } else { random.direction() * 1.2 };
        let reach = random.log_uniform(0.1, 3.0);
        let arcs = circle_point_arcs(&a, &point, reach);
        let ball = compare(&arcs, &table, |c, s| reach - (point - a.point(c, s)).norm());
        for disagreement in [plane, ball] {
            if disagreement > worst {
                worst = disagreement;
            }
        }
    }
    println!("plane and sphere, 2,000 each: largest depth in disagreement {worst:.1e} (tolerance 2e-14)");
    assert!(worst < 2e-14);
}

#[test]
fn arcs_scale_exactly_and_do_not_depend_on_the_frame() {
    let mut random = Random(6);
    for _ in 0..2000 {
        let a = random.circle(1.6, 1.0);
        let b = random.circle(0.2, 1.1);
        let arcs = circle_circle_arcs(&a, &b, 0.4);
        for scale in [4096.0, 1.0 / 1048576.0] {
            let scaled = |c: &Circle| Circle { centre: c.centre * scale, radius: c.radius * scale, ..*c };
            let other = circle_circle_arcs(&scaled(&a), &scaled(&b), 0.4 * scale);
            assert_eq!(arcs.as_slice(), other.as_slice());
        }
        // Another zero of the angle: the same arcs, turned.
        let (cos, sin) = (0.6, 0.8);
        let turned = Circle { u: a.u * cos + a.w * sin, w: a.w * cos - a.u * sin, ..a };
        let other = circle_circle_arcs(&turned, &b, 0.4);
        let length = |arcs: &Arcs| arcs.iter().map(Arc::half_angle).sum::<f64>();
        assert!(libm::fabs(length(&arcs) - length(&other)) < 1e-7, "{a:?}\n{b:?}");
    }
}

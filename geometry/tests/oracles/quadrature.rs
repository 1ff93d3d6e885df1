//! The error of the quadrature rule chosen for each contact arc, against one sixteen times finer.

use crate::random::Random;
use geometry::{
    Arc, Circle, GaussRule, Vec3,
    arc::{circle_circle_arcs, rule_for},
    circle::point_circle_distance,
    closest_points,
};

/// Integral of the depth over the angle.
fn depth_integral(a: &Circle, b: &Circle, reach: f64, arc: &Arc, rule: GaussRule) -> f64 {
    arc.nodes(rule)
        .map(|node| node.weight * (reach - point_circle_distance(&a.point(node.cos, node.sin), b)))
        .sum()
}

/// The same by eight points on each of sixteen equal pieces.
fn fine_integral(a: &Circle, b: &Circle, reach: f64, arc: &Arc) -> f64 {
    let half_angle = arc.half_angle();
    let mid = libm::atan2(arc.mid_sin, arc.mid_cos);
    (0..16)
        .map(|i| {
            let t = mid + half_angle * (f64::from(2 * i + 1) / 16.0 - 1.0);
            let half_tangent = libm::tan(half_angle / 32.0);
            let piece = Arc { mid_cos: libm::cos(t), mid_sin: libm::sin(t), half_tangent, connected: 0 };
            depth_integral(a, b, reach, &piece, GaussRule::Eight)
        })
        .sum()
}

/// Random pairs in contact, `depth` times the reach deep at the first place of contact.
fn contact(random: &mut Random, reach: f64, depth: f64) -> (Circle, Circle) {
    loop {
        let a = random.circle(2.0 + reach, 1.0);
        let b = Circle::from_pose(Vec3::zeros(), &random.orientation(), 1.0);
        let closest = closest_points(&a, &b);
        if closest.distance < 1e-3 {
            continue;
        }
        let way = (closest.point_a - closest.point_b) / closest.distance;
        let a = Circle { centre: a.centre + way * ((1.0 - depth) * reach - closest.distance), ..a };
        let penetration = reach - closest_points(&a, &b).distance;
        if penetration < 2.0 * depth * reach {
            return (a, b);
        }
    }
}

#[test]
fn the_chosen_rule_is_as_accurate_as_stated() {
    // Bounds of q, and the tolerance of the 99th percentile, as the documentation of `rule_for` states.
    const CLASSES: [(f64, f64, f64); 5] =
        [(0.0, 0.1, 1e-6), (0.1, 0.2, 1e-6), (0.2, 0.5, 1e-6), (0.5, 0.8, 1e-5), (0.8, f64::INFINITY, 1e-4)];
    for reach in [0.36, 0.1, 0.01] {
        let mut random = Random(500);
        let mut errors = [const { Vec::new() }; 5];
        for _ in 0..5000 {
            let depth = random.log_uniform(1e-4, 0.5);
            let (a, b) = contact(&mut random, reach, depth);
            for arc in circle_circle_arcs(&a, &b, reach).iter() {
                let exact = fine_integral(&a, &b, reach, arc);
                let rule = rule_for(arc.half_tangent, 1.0 / reach);
                let error = libm::fabs(depth_integral(&a, &b, reach, arc, rule) / exact - 1.0);
                let length = 2.0 * arc.half_tangent / reach;
                let class = CLASSES.iter().position(|&(_, end, _)| length < end).unwrap();
                errors[class].push(error);
            }
        }
        for (errors, (start, end, tolerance)) in errors.iter_mut().zip(CLASSES) {
            errors.sort_by(f64::total_cmp);
            let at = |part: f64| errors[((errors.len() - 1) as f64 * part) as usize];
            let (median, most) = (at(0.5), at(0.99));
            println!(
                "reach {reach}, q {start} to {end}: {} arcs, error of the force {median:.1e} median, \
                 {most:.1e} 99th percentile (tolerance {tolerance:.0e})",
                errors.len()
            );
            assert!(most < tolerance, "reach {reach}, q {start} to {end}: {most:.2e}");
        }
    }
}

#[test]
fn weights_sum_to_the_arc() {
    for half_tangent in [1e-9, 0.01, 0.2, 0.414] {
        let arc = Arc { mid_cos: 0.6, mid_sin: 0.8, half_tangent, connected: 0 };
        let nodes: Vec<_> = arc.nodes(GaussRule::Eight).collect();
        let sum: f64 = nodes.iter().map(|node| node.weight).sum();
        let error = libm::fabs(sum / (2.0 * arc.half_angle()) - 1.0);
        assert!(error < 2e-11, "{half_tangent}: {error:.1e}");
        for node in &nodes {
            assert!(libm::fabs(node.cos * node.cos + node.sin * node.sin - 1.0) < 1e-15);
        }
        assert!(nodes.windows(2).all(|pair| {
            let turn = pair[0].cos * pair[1].sin - pair[0].sin * pair[1].cos;
            turn > 0.0
        }));
    }
}

//! What must hold for any input, tried on random ones (a failure prints the smallest input found).

use geometry::{
    Arcs, Circle, Vec3,
    arc::circle_circle_arcs,
    closest_points, linked, rotation,
    torus::{ray_torus, value},
};
use proptest::{prelude::*, test_runner::RngSeed};

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 2000,
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..Default::default()
    }
}

prop_compose! {
    fn vector(limit: f64)(x in -limit..limit, y in -limit..limit, z in -limit..limit) -> Vec3 {
        Vec3::new(x, y, z)
    }
}

prop_compose! {
    fn circle(limit: f64)(centre in vector(limit), turn in vector(3.0), radius in 0.3..2.0) -> Circle {
        Circle::from_pose(centre, &rotation::exp(turn), radius)
    }
}

prop_compose! {
    fn direction()(turn in vector(3.0)) -> Vec3 {
        rotation::axes(&rotation::exp(turn)).2
    }
}

/// The same circle run through backwards.
fn reversed(circle: &Circle) -> Circle {
    Circle { w: -circle.w, normal: -circle.normal, ..*circle }
}

fn length(arcs: &Arcs) -> f64 {
    arcs.iter().map(|arc| arc.half_angle()).sum::<f64>() * 2.0
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn arcs_exist_exactly_when_the_circles_are_closer_than_the_reach(
        a in circle(1.5), b in circle(0.2), reach in 0.01..1.5,
    ) {
        let margin = 1e-12;
        let distance = closest_points(&a, &b).distance;
        prop_assume!(libm::fabs(distance - reach) > margin);
        prop_assert_eq!(circle_circle_arcs(&a, &b, reach).is_empty(), distance > reach);
        prop_assert_eq!(circle_circle_arcs(&b, &a, reach).is_empty(), distance > reach);
    }

    #[test]
    fn arcs_grow_with_the_reach(a in circle(1.5), b in circle(0.2), reach in 0.01..1.5, more in 0.0..0.2) {
        let (small, large) = (circle_circle_arcs(&a, &b, reach), circle_circle_arcs(&a, &b, reach + more));
        // The tolerance is the rounding of an arc about to vanish: the square root of 1e-15 / reach.
        prop_assert!(length(&small) <= length(&large) + 1e-6);
    }

    #[test]
    fn running_backwards_mirrors_the_arcs(a in circle(1.5), b in circle(0.2), reach in 0.05..0.9) {
        let (forward, backward) =
            (circle_circle_arcs(&a, &b, reach), circle_circle_arcs(&reversed(&a), &b, reach));
        prop_assert!(libm::fabs(length(&forward) - length(&backward)) < 1e-6);
        let other_side = circle_circle_arcs(&a, &reversed(&b), reach);
        prop_assert!(libm::fabs(length(&forward) - length(&other_side)) < 1e-6);
    }

    #[test]
    fn the_distance_is_below_that_of_any_two_points(
        a in circle(2.0), b in circle(0.5), s in 0.0..6.3, t in 0.0..6.3,
    ) {
        let p = a.point(libm::cos(s), libm::sin(s));
        let q = b.point(libm::cos(t), libm::sin(t));
        prop_assert!(closest_points(&a, &b).distance <= (p - q).norm() + 1e-14);
    }

    #[test]
    fn linking_does_not_depend_on_order_direction_or_frame(
        a in circle(1.5), b in circle(0.5), turn in vector(3.0), shift in vector(5.0),
    ) {
        prop_assume!(closest_points(&a, &b).distance > 1e-9);
        let q = rotation::exp(turn);
        let moved = |c: &Circle| Circle {
            centre: q * c.centre + shift, u: q * c.u, w: q * c.w, normal: q * c.normal, ..*c
        };
        let expected = linked(&a, &b);
        prop_assert_eq!(linked(&b, &a), expected);
        prop_assert_eq!(linked(&reversed(&a), &b), expected);
        prop_assert_eq!(linked(&moved(&a), &moved(&b)), expected);
    }

    #[test]
    fn hits_lie_on_the_torus_and_the_way_there_does_not_cross_it(
        origin in vector(3.0), direction in direction(), minor in 0.01..1.0,
    ) {
        let inside = value(&origin, 1.0, minor) < 0.0;
        let at = |t: f64| value(&(origin + direction * t), 1.0, minor);
        let hit = ray_torus(&origin, &direction, 1.0, minor, 0.0);
        if let Some(t) = hit {
            prop_assert!(libm::fabs(at(t)) < 1e-11, "off the surface by {:.1e} at {t}", at(t));
        }
        prop_assert!(!inside || hit.is_some(), "no way out");
        let end = hit.unwrap_or(10.0);
        for i in 1..100 {
            let between = at(end * f64::from(i) / 100.0);
            prop_assert!((between < 0.0) == inside || libm::fabs(between) < 1e-9, "crossed before {end}");
        }
    }

    #[test]
    fn hits_after_a_hit_are_further_on(origin in vector(3.0), direction in direction(), minor in 0.05..0.9) {
        let mut t = 0.0;
        let mut count = 0;
        while let Some(next) = ray_torus(&origin, &direction, 1.0, minor, t) {
            prop_assert!(next > t);
            t = next + 1e-6;
            count += 1;
            prop_assert!(count <= 4, "a line crosses a torus at most four times");
        }
    }
}

//! Polynomial bodies against closed forms and dense sampling.

use crate::double_double::{Double, roots};
use crate::random::Random;
use geometry::polynomial::{Bounds, Polynomial, Solid, Surface, SurfaceError};
use geometry::{RootFinder, Vec3, torus};

/// A torus with R = 2, r = 1, in the formula's units.
const TORUS: &str = "(x^2 + y^2 + z^2 + 3)^2 - 16*(x^2 + y^2)";
/// A heart (Taubin 1994).
const HEART: &str = "(x^2 + 2.25*y^2 + z^2 - 1)^3 - x^2*z^3 - 0.1125*y^2*z^3";
/// A figure of eight, thickened: two holes.
const PRETZEL: &str = "(x^2*(1 - x^2) - y^2)^2 + 0.5*z^2 - 0.025";
/// A rounded cube with eight dents.
const TANGLE: &str = "x^4 - 5*x^2 + y^4 - 5*y^2 + z^4 - 5*z^2 + 11.8";

#[test]
fn formulas_are_read_and_refused() {
    let at = Vec3::new(0.7, -1.3, 2.1);
    let (x, y, z) = (at.x, at.y, at.z);
    for (formula, expected) in [
        ("x", x),
        (" - x^2 ", -x * x),
        ("(-x)^2 - -y", x * x + y),
        ("2*x*y*z - 1.5e1*(x + .5)^3 + 2.", 2.0 * x * y * z - 15.0 * (x + 0.5) * (x + 0.5) * (x + 0.5) + 2.0),
        ("(x+y)*(x-y)", x * x - y * y),
        ("x^0", 1.0),
        ("((((z))))", z),
    ] {
        let value = Polynomial::parse(formula).unwrap_or_else(|error| panic!("{error}")).value(&at);
        assert!((value - expected).abs() < 1e-13 * (1.0 + expected.abs()), "{formula}: {value} {expected}");
    }
    let deep = "(".repeat(100) + "x" + &")".repeat(100);
    let long = "x + ".repeat(2000) + "x";
    let wide = "(1+x+y+z)^16 * x".to_owned();
    let work = (0..400).map(|_| "(1+x+y+z)^8*(1+x+y+z)^8").collect::<Vec<_>>().join("+");
    for (formula, message) in [
        (
            "x^2 + w",
            "a number, x, y, z or ( was expected, not 'w', at character 7 of the formula: x^2 + >>>w",
        ),
        (
            "x^2 +",
            "a number, x, y, z or ( was expected, not the end, at character 6 of the formula: x^2 +>>>",
        ),
        ("2x", "an operator (+ - * ^) was expected, not 'x', at character 2 of the formula: 2>>>x"),
        ("(x", "a closing parenthesis was expected, at character 3 of the formula: (x>>>"),
        ("x^17", "a whole power from 0 to 16 was expected, at character 3 of the formula: x^>>>17"),
        ("x^-2", "a whole power from 0 to 16 was expected"),
        ("x^2.5", "an operator (+ - * ^) was expected, not '.'"),
        ("x^10*y^7", "a degree of at most 16 was expected, at character 5 of the formula: x^10>>>*y^7"),
        ("1.2.3", "a decimal number was expected, not '1.2.3'"),
        ("1e999", "a decimal number was expected, not '1e999'"),
        ("1e308*10*x", "a coefficient is too large for a number"),
        ("\u{3c0}", "not a foreign character"),
        ("", "not the end"),
        (&deep, "at most 64 parentheses and signs"),
        (&long, "a formula of at most 4096 bytes"),
        (&wide, "a degree of at most 16 was expected"),
        (&work, "was expected"),
    ] {
        let error = Polynomial::parse(formula).expect_err(formula).to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    let mut random = Random(71);
    for formula in [TORUS, HEART, TANGLE, "x*y^5*z^2 - 3*z^7 + 2"] {
        let f = Polynomial::parse(formula).unwrap();
        for _ in 0..50 {
            let p = random.direction() * random.uniform(0.0, 2.0);
            let jet = f.jet(&p);
            assert!((jet.value - f.value(&p)).abs() < 1e-11);
            let step = 1e-5;
            for axis in 0..3 {
                let mut e = Vec3::zeros();
                e[axis] = step;
                let (up, down) = (f.jet(&(p + e)), f.jet(&(p - e)));
                let slope = (up.value - down.value) / (2.0 * step);
                // Third derivatives are of some hundreds: step^2 times them, and rounding over the step.
                let size = 1.0 + jet.gradient.norm() + jet.second.iter().map(|s| s.abs()).sum::<f64>();
                assert!((slope - jet.gradient[axis]).abs() < 1e-7 * size, "{formula}");
                let bend = (up.gradient - down.gradient) / (2.0 * step);
                assert!((bend - jet.second_times(&(e / step))).norm() < 1e-6 * size, "{formula}");
            }
        }
    }
}

#[test]
fn rays_meet_the_torus_where_the_torus_says() {
    let solid = Solid::new(TORUS, 0.5, 1.6).unwrap();
    let mut random = Random(72);
    let (mut hits, mut worst, mut border) = (0, 0.0, 0);
    for _ in 0..20_000 {
        let origin = random.direction() * random.uniform(0.0, 6.0);
        let direction = (random.direction() * 1.2 - origin).normalize();
        let ours = solid.ray(&origin, &direction, 1e-6);
        let exact = torus::ray_torus(&origin, &direction, 1.0, 0.5, 1e-6);
        match (ours, exact) {
            (Some(ours), Some(exact)) if (ours - exact).abs() < 1e-3 => {
                hits += 1;
                let slope = solid.normal(&(origin + direction * exact)).dot(&direction).abs();
                let off = (ours - exact).abs() * slope;
                worst = if off > worst { off } else { worst };
            }
            (None, None) => {}
            // One of them misses a ray that only grazes.
            _ => border += 1,
        }
    }
    println!("{hits} hits, {border} grazing; across the surface at most {worst:e} m apart, allowed 1e-13");
    assert!(hits > 8000 && border <= 2 && worst < 1e-13);
}

#[test]
fn mass_properties_are_those_of_closed_forms() {
    const PI: f64 = core::f64::consts::PI;
    // An ellipsoid with the half axes 1, 0.8, 0.5, off the origin and turned about z by atan(3/4).
    let ellipsoid = "(0.8*x + 0.6*y - 0.3)^2 + 1.5625*(0.8*y - 0.6*x)^2 + 4*(z - 0.1)^2 - 1";
    let (a, b, c) = (1.0, 0.64, 0.25);
    let torus = [(5.0 / 8.0 + 2.0), (5.0 / 8.0 + 2.0), (0.75 + 4.0)];
    for (name, formula, scale, radius, volume, inertia) in [
        ("sphere", "x^2 + y^2 + z^2 - 1", 0.1, 0.11, 4e-3 / 3.0 * PI, [0.004; 3]),
        ("ellipsoid", ellipsoid, 1.0, 1.5, 4.0 / 3.0 * PI * 0.4, [b + c, c + a, a + b].map(|i| i / 5.0)),
        ("torus", TORUS, 1.0, 3.1, 4.0 * PI * PI, torus),
    ] {
        let solid = Solid::new(formula, scale, radius).unwrap();
        let off = (solid.volume_m3() / volume - 1.0).abs();
        let mut found = solid.inertia(1.0);
        let mut expected = inertia;
        found.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        let inertia_off = (0..3)
            .map(|i| (found[i] / expected[i] - 1.0).abs())
            .fold(0.0, |a: f64, b| if b > a { b } else { a });
        println!("{name}: volume off {off:e}, inertia off {inertia_off:e}, allowed 1e-4");
        // (1/256)^2 of the width times the outline's length over the area, a few.
        assert!(off < 1e-4 && inertia_off < 1e-4);
    }
    let (centre, rotation) = Solid::new(ellipsoid, 1.0, 1.5).unwrap().place();
    let expected = Vec3::new(0.24, 0.18, 0.1);
    println!("centre off {:e}", (centre - expected).norm());
    assert!((centre - expected).norm() < 1e-4);
    // The long axis is (0.8, 0.6, 0).
    let along = [Vec3::x(), Vec3::y(), Vec3::z()]
        .map(|axis| (rotation * axis).dot(&Vec3::new(0.8, 0.6, 0.0)).abs())
        .into_iter()
        .fold(0.0, |a: f64, b| if b > a { b } else { a });
    assert!(1.0 - along < 1e-7, "{along}");
    // A body with the symmetry of its axes keeps them, to the last bit.
    let (centre, rotation) = Solid::new(TORUS, 1.0, 3.1).unwrap().place();
    assert_eq!((centre, rotation), (Vec3::zeros(), nalgebra::UnitQuaternion::identity()));
}

#[test]
fn closest_points_of_a_torus_are_those_of_the_closed_form() {
    let solid = Solid::new(TORUS, 0.5, 1.6).unwrap();
    let mut random = Random(73);
    let (mut worst, mut failed, mut farther) = (0.0, 0, 0);
    for _ in 0..20_000 {
        let point = random.direction() * random.uniform(0.0, 2.5);
        let exact = torus::value(&point, 1.0, 0.0).sqrt() - 0.5;
        let (normal, distance) = solid.distance(&point);
        assert_eq!(distance < 0.0, solid.contains(&point));
        failed += i32::from(!solid.closest_point(&point).1);
        let off = (distance - exact).abs();
        if off > 1e-6 {
            farther += 1;
            continue;
        }
        worst = if off > worst { off } else { worst };
        let exact_normal = torus::normal(&point, 1.0);
        assert!((normal - exact_normal).norm() < 1e-6, "{normal:?} {exact_normal:?} at {point:?}");
    }
    println!("20000 points: {farther} at a farther sheet, {failed} not converged, distance off {worst:e} m");
    assert!(failed <= 20 && farther <= 20 && worst < 1e-11);
}

/// Points of a surface, dense: where rays from outside and from within cross it.
fn cloud(solid: &Solid, count: usize, random: &mut Random) -> Vec<Vec3> {
    let radius = solid.bounding_radius_m();
    let mut points = Vec::new();
    while points.len() < count {
        let mut from = random.direction() * (1.01 * radius);
        let direction = (random.direction() * radius - from).normalize();
        let mut start = 0.0;
        while let Some(t) = solid.ray(&from, &direction, start) {
            from += direction * t;
            points.push(from);
            start = 1e-7 * radius;
        }
    }
    points
}

#[test]
fn closest_points_are_nearer_than_any_of_a_dense_cloud() {
    // Shares of the queries that may find a farther sheet, and that may not converge. The heart has double points all
    // along an ellipse and at two cusps: there the conditions cannot be met.
    for (name, formula, scale, radius, farther_max, failed_max) in [
        ("tangle", TANGLE, 0.2, 0.7, 0.0, 0.0),
        ("torus", TORUS, 0.5, 1.6, 0.002, 0.002),
        ("pretzel", PRETZEL, 1.0, 1.5, 0.002, 0.002),
        ("heart", HEART, 0.5, 0.75, 0.02, 0.04),
    ] {
        let solid = Solid::new(formula, scale, radius).unwrap();
        let mut random = Random(74);
        let points = cloud(&solid, 60_000, &mut random);
        let (mut farther, mut failed, mut worst) = (0, 0, 0.0);
        let queries = 1500;
        for _ in 0..queries {
            let point = random.direction() * random.uniform(0.0, 1.3 * radius);
            let (_, distance) = solid.distance(&point);
            let (q, converged) = solid.closest_point(&point);
            failed += i32::from(!converged);
            assert!(((q - point).norm() - distance.abs()).abs() < 1e-12);
            let nearest = points
                .iter()
                .map(|other| (other - point).norm_squared())
                .fold(f64::INFINITY, |a, b| if b < a { b } else { a })
                .sqrt();
            // A point of the cloud is never nearer than the nearest one.
            let excess = distance.abs() - nearest;
            if excess > 1e-9 * radius {
                farther += 1;
                worst = if excess > worst { excess } else { worst };
            }
        }
        println!(
            "{name}: of {queries} points {farther} have a nearer one in the cloud, by at most {worst:e} m; {failed} \
             did not converge"
        );
        let share = |count: i32| f64::from(count) / f64::from(queries);
        assert!(share(farther) <= farther_max && share(failed) <= failed_max);
    }
}

#[test]
fn bodies_that_are_none_are_refused() {
    let refuse = |formula: &str, radius: f64| Solid::new(formula, 1.0, radius).unwrap_err().to_string();
    assert!(refuse("x^2 + y^2 + z^2 + 1", 1.0).starts_with("no point with F < 0 was found within"));
    assert!(refuse("x^2 + y^2 + z^2 - 1", 0.9).contains("it must be positive on all of it"));
    assert!(refuse("1 - x^2 - y^2 - z^2", 2.0).contains("turn the formula's sign round"));
    assert!(refuse("x +* y", 2.0).contains("at character 4"));
    assert!(refuse("3", 2.0).starts_with("no point with F < 0"));
}

/// Chebyshev polynomials of degree 12 and 16: as wild as a polynomial of its degree can be between -1 and 1.
const CHEBYSHEV: [(usize, &[i64]); 2] = [
    (12, &[1, -72, 840, -3584, 6912, -6144, 2048]),
    (16, &[1, -128, 2688, -21504, 84480, -180224, 212992, -131072, 32768]),
];

/// The sum of two polynomials, the longer one first.
fn sum(mut a: Vec<Double>, b: &[Double]) -> Vec<Double> {
    for (a, b) in a.iter_mut().zip(b) {
        *a = *a + *b;
    }
    a
}

fn product(a: &[Double], b: &[Double]) -> Vec<Double> {
    let mut product = vec![Double::from(0.0); a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            product[i + j] = product[i + j] + *x * *y;
        }
    }
    product
}

/// Chmutov's surfaces `T(x) + T(y) + T(z) = 0.3` of degree 12 and 16, whose rays have up to as many roots: each by both
/// finders against bisection in twice the precision.
#[test]
fn surfaces_of_degree_twelve_and_sixteen_agree_with_twice_the_precision() {
    for (degree, even) in CHEBYSHEV {
        let of = |axis: &str| {
            let terms = even.iter().enumerate().rev().map(|(half, c)| format!("{c}*{axis}^{}", 2 * half));
            terms.collect::<Vec<_>>().join(" + ").replace("+ -", "- ")
        };
        let formula = format!("{} + {} + {} - 0.3", of("x"), of("y"), of("z"));
        let surface = Surface::new(&formula, 1.0, Bounds::Ball(1.0)).unwrap();
        let mut random = Random(75);
        let (mut hits, mut misses, mut roots_of_all) = (0, 0, 0);
        let (mut worst, mut wrong) = ([0.0_f64; 2], [0; 2]);
        for _ in 0..250 {
            let origin = random.direction() * random.uniform(1.5, 3.0);
            let direction = (random.direction() * random.uniform(0.0, 1.0) - origin).normalize();
            let mut along = vec![Double::from(0.0); degree + 1];
            along[0] = Double::from(-0.3);
            // About the middle of the chord, exactly.
            let s = -origin.dot(&direction);
            for axis in 0..3 {
                let line = [
                    Double::from(origin[axis]) + Double::from(s) * Double::from(direction[axis]),
                    Double::from(direction[axis]),
                ];
                let square = product(&line, &line);
                let mut value = vec![Double::from(0.0)];
                for &c in even.iter().rev() {
                    value = product(&value, &square);
                    value[0] = value[0] + Double::from(c as f64);
                }
                along = sum(along, &value[..=degree]);
            }
            let near = origin + direction * s;
            let half = (1.0 - near.norm_squared()).sqrt();
            let all = roots(&along, Double::from(-half), Double::from(half));
            roots_of_all += all.len();
            let expected = all.first().map(|u| (Double::from(s) + *u).high);
            for (index, finder) in [RootFinder::Bernstein, RootFinder::Companion].into_iter().enumerate() {
                match (surface.ray(&origin, &direction, 0.0, finder), expected) {
                    (Some(t), Some(expected)) if (t - expected).abs() < 1e-3 => {
                        let slope = surface.normal(&(origin + direction * expected)).dot(&direction).abs();
                        let off = (t - expected).abs() * slope;
                        worst[index] = if off > worst[index] { off } else { worst[index] };
                    }
                    (None, None) => {}
                    _ => wrong[index] += 1,
                }
            }
            hits += i32::from(expected.is_some());
            misses += i32::from(expected.is_none());
        }
        // A value is wrong by some roundings of the sum of its terms' absolute values, three times those of the coefficients;
        // the slope is of some tens.
        let coefficients: f64 = even.iter().map(|&c| (c as f64).abs()).sum();
        let tolerance = 1e-17 * coefficients;
        println!(
            "degree {degree}: {hits} hits, {misses} misses, {roots_of_all} roots; bernstein {} wrong, {:.1e} off; companion \
             {} wrong, {:.1e} off; allowed 0, {tolerance:.1e}",
            wrong[0], worst[0], wrong[1], worst[1]
        );
        assert!(hits > 100 && wrong[0] == 0 && worst[0] < tolerance);
    }
}

/// Rays that touch a double sheet, and rays through it, on bodies whose formula has a square factor.
#[test]
fn double_roots_are_no_crossings_whatever_rounding_makes_of_them() {
    let mut random = Random(76);
    // Squares of forms with coefficients that are not exact; and the square times something that is crossed.
    for (formula, crossed) in [
        ("(0.3*x + 0.7*y - 0.1*z)^2*(x^2 + y^2 + z^2 + 0.2)", false),
        ("(x^2 + 1.1*y^2 + 0.7*z^2 - 0.37)^4", false),
        ("(x^2 + y^2 + z^2 - 0.37)^2*(x^2 + y^2 + z^2 - 0.81)", true),
    ] {
        let found = Surface::new(formula, 1.0, Bounds::Ball(1.0));
        let (mut rays, mut crossings) = (0, 0);
        match &found {
            Ok(surface) => {
                for _ in 0..20_000 {
                    let origin = random.direction() * 3.0;
                    let direction = (random.direction() * random.uniform(0.0, 0.85) - origin).normalize();
                    let t = surface.ray(&origin, &direction, 0.0, RootFinder::Bernstein);
                    let t = t.unwrap_or_else(|| panic!("{formula}: {origin:?} {direction:?}"));
                    rays += 1;
                    crossings += i32::from(((origin + direction * t).norm() - 0.9).abs() > 1e-9);
                    // From the outer sphere on: through the inner one to the other side.
                    let on = surface.ray(&origin, &direction, t + 1e-6, RootFinder::Bernstein);
                    let on = on.unwrap_or_else(|| panic!("{formula}: {origin:?} {direction:?} from {t:?}"));
                    crossings += i32::from(((origin + direction * on).norm() - 0.9).abs() > 1e-9);
                }
            }
            Err(error) => assert_eq!(*error, SurfaceError::Nothing),
        }
        println!("{formula}: {rays} rays, {crossings} crossings of the double sheet, allowed 0");
        assert_eq!((found.is_ok(), crossings), (crossed, 0));
    }
}

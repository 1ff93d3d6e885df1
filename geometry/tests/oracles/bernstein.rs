//! Root isolation on polynomials with known roots.

use crate::random::Random;
use geometry::bernstein::{find_root, from_power, parts, sign_changes, to_power, value};

fn roots<const N: usize>(coefficients: &[f64; N]) -> Vec<f64> {
    let mut found = Vec::new();
    assert_eq!(
        find_root(coefficients, |x| {
            found.push(x);
            false
        }),
        None
    );
    found
}

/// Coefficients in powers of x of the product of (x - root).
fn with_roots<const N: usize>(known: &[f64]) -> [f64; N] {
    let mut power = [0.0; N];
    power[0] = 1.0;
    for &root in known {
        for i in (0..N).rev() {
            power[i] = if i > 0 { power[i - 1] } else { 0.0 } - root * power[i];
        }
    }
    power
}

fn check<const N: usize>(name: &str, known: &[f64], tolerance: f64) {
    let found = roots(&from_power(&with_roots::<N>(known), 0.0, 1.0));
    let expected: Vec<f64> = known.iter().copied().filter(|&x| x > 0.0 && x < 1.0).collect();
    assert_eq!(found.len(), expected.len(), "{name}: {found:?}, expected {expected:?}");
    let worst = found
        .iter()
        .zip(&expected)
        .map(|(a, b)| libm::fabs(a - b))
        .fold(0.0, |m, x| if x > m { x } else { m });
    println!("{name}: largest error {worst:.1e} (tolerance {tolerance:.0e})");
    assert!(worst < tolerance, "{name}: {found:?}");
}

#[test]
fn known_roots_are_found_in_order() {
    check::<3>("quadratic", &[0.25, 0.75], 1e-15);
    check::<3>("quadratic, one root outside", &[-0.5, 0.3], 1e-15);
    check::<5>("quartic", &[0.1, 0.35, 0.6, 0.9], 1e-14);
    check::<5>("roots on the cuts", &[0.25, 0.5, 0.625, 0.75], 1e-14);
    check::<5>("quartic, close pair", &[-1.0, 0.5, 0.500_001, 2.0], 1e-8);
    check::<13>("degree 12", &[-1.5, -0.7, 0.05, 0.2, 0.3, 0.45, 0.6, 0.7, 0.85, 0.95, 1.2, 2.0], 1e-8);
    check::<5>("none inside", &[-3.0, -2.0, 1.5, 4.0], 1e-15);
}

#[test]
fn double_roots_and_flat_polynomials_are_no_roots() {
    // (x - 1/4)^2 (x + 1)^2 is exact in Bernstein form on the cut, (x - 0.3)^2 is decided by rounding,
    // and a positive bump of any size above rounding is certainly none.
    assert_eq!(roots(&from_power(&with_roots::<5>(&[0.25, 0.25, -1.0, -1.0]), 0.0, 1.0)), []);
    assert_eq!(roots(&[1.0, -0.999_999_9, 1.0]), []);
    assert_eq!(roots(&[1.0, -1.0, 1.0]), []);
    assert_eq!(roots(&[0.0; 5]), []);
    assert_eq!(roots(&[f64::NAN; 5]), []);
    assert_eq!(roots(&[1.0, -1.000_000_1, 1.0]).len(), 2);
    // A triple root changes the sign: one root.
    let triple = roots(&from_power(&with_roots::<5>(&[0.3, 0.3, 0.3, 2.0]), 0.0, 1.0));
    assert!(triple.len() % 2 == 1 && libm::fabs(triple[0] - 0.3) < 2e-5, "{triple:?}");
}

#[test]
fn the_first_accepted_root_is_returned() {
    let quartic = from_power(&with_roots::<5>(&[0.1, 0.35, 0.6, 0.9]), 0.0, 1.0);
    assert!(libm::fabs(find_root(&quartic, |_| true).unwrap() - 0.1) < 1e-14);
    assert!(libm::fabs(find_root(&quartic, |x| x > 0.5).unwrap() - 0.6) < 1e-14);
}

#[test]
fn conversions_and_parts_agree_with_values() {
    let mut random = Random(7);
    let mut worst = 0.0;
    for _ in 0..2000 {
        let power: [f64; 5] = core::array::from_fn(|_| random.uniform(-1.0, 1.0));
        let (start, length) = (random.uniform(-1.0, 1.0), random.uniform(0.1, 1.0));
        let bernstein = from_power(&power, start, start + length);
        let cut = random.uniform(0.05, 0.95);
        let (left, right) = parts(&bernstein, cut);
        let back = to_power(&bernstein);
        let x = random.uniform(0.0, 1.0);
        let horner = |c: &[f64; 5], x: f64| c.iter().rev().fold(0.0, |sum, &c| sum * x + c);
        let expected = horner(&power, start + length * x);
        let part = if x < cut { value(&left, x / cut) } else { value(&right, (x - cut) / (1.0 - cut)) };
        for found in [value(&bernstein, x), horner(&back, x), part] {
            let error = libm::fabs(found - expected);
            if error > worst {
                worst = error;
            }
        }
        assert!(sign_changes(&left) + sign_changes(&right) <= sign_changes(&bernstein));
    }
    println!("values by four ways differ by {worst:.1e} (tolerance 1e-13)");
    assert!(worst < 1e-13);
}

#[test]
fn random_quartics_lose_no_root() {
    // Signs on a fine grid: every change of sign between neighbours must be a root between them.
    let mut random = Random(8);
    let (mut count, mut unseen) = (0, 0);
    for _ in 0..20_000 {
        let quartic: [f64; 5] = core::array::from_fn(|_| random.uniform(-1.0, 1.0));
        let found = roots(&quartic);
        assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{found:?}");
        let mut seen = 0;
        let mut before = value(&quartic, 0.0);
        for i in 1..=200 {
            let x = f64::from(i) / 200.0;
            let after = value(&quartic, x);
            if before * after < 0.0 {
                seen += 1;
                assert!(
                    found.iter().any(|&root| root > x - 0.005 - 1e-12 && root < x + 1e-12),
                    "{quartic:?} has a root near {x}; found {found:?}"
                );
            }
            before = after;
        }
        count += found.len();
        unseen += found.len() - seen;
    }
    println!("{count} roots; {unseen} of them in pairs closer than the grid");
    assert!(unseen % 2 == 0);
}

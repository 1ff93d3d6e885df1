//! The quartics on which solvers of quartics are compared, on the intervals that a ray would ask about.
//!
//! The sets of roots are those of A. G. Orellana and C. De Michele, "Algorithm 1010: Boosting Efficiency in Solving Quartic
//! Equations with No Compromise in Accuracy", ACM TOMS 46 (2020), which holds those of Strobach and Flocke. A ray has an
//! interval and coefficients on it; so each quartic is multiplied out in whole numbers, taken to Bernstein form on
//! intervals around each of its roots exactly, and rounded once. What is found must then be as many roots as Sturm's theorem
//! counts in the rounded coefficients, and near those of the set.

use crate::sturm::Tally;
use geometry::bernstein::for_each_root;
use num_bigint::BigInt;
use num_traits::{One, Signed, ToPrimitive, Zero};

/// Coefficients, lowest first.
type Whole = Vec<BigInt>;

/// A fraction of whole numbers.
type Fraction = (BigInt, BigInt);

/// A set: real roots and pairs of complex ones (real part, imaginary part).
type Set = (u32, &'static [&'static str], &'static [(&'static str, &'static str)]);

const SETS: [Set; 22] = [
    (1, &["1e9", "1e6", "1e3", "1"], &[]),
    (2, &["2.003", "2.002", "2.001", "2"], &[]),
    (3, &["1e53", "1e50", "1e49", "1e47"], &[]),
    (4, &["1e14", "2", "1", "-1"], &[]),
    (5, &["-2e7", "1e7", "1", "-1"], &[]),
    (6, &["1e7", "-1e6"], &[("1", "1")]),
    (7, &["-7", "-4"], &[("-1e6", "1e5")]),
    (8, &["1e8", "11"], &[("1e3", "1")]),
    (9, &[], &[("1e7", "1e6"), ("1", "2")]),
    (10, &[], &[("1e4", "3"), ("-7", "1e3")]),
    (11, &[], &[("1.001", "4.998"), ("1.000", "5.001")]),
    (12, &[], &[("1e3", "3"), ("1e3", "1")]),
    (13, &[], &[("2", "1e4"), ("1", "1e3")]),
    (14, &["1e3", "1e3", "1e3", "1e3"], &[]),
    (15, &["1e3", "1e3", "1e3", "2^-48"], &[]),
    (16, &[], &[("1e16", "1e7"), ("1", "0.1")]),
    (17, &["10000", "10001", "10010", "10100"], &[]),
    (18, &[], &[("4e5", "3e2"), ("3e4", "7e3")]),
    (19, &["1e44", "1e30", "1e30", "1"], &[]),
    (20, &["1e14", "1e7", "1e7", "1"], &[]),
    (21, &["1e15", "1e7", "1e7", "1"], &[]),
    (22, &["1e154", "1e152", "10", "1"], &[]),
];

/// A decimal number, or a power of two, as a fraction.
fn fraction(text: &str) -> Fraction {
    if let Some(exponent) = text.strip_prefix("2^-") {
        return (BigInt::one(), BigInt::one() << exponent.parse::<u32>().expect("an exponent"));
    }
    let (mantissa, exponent) = text.split_once('e').unwrap_or((text, "0"));
    let (before, after) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let ten = |power: usize| BigInt::from(10).pow(power as u32);
    let digits: BigInt = format!("{before}{after}").parse().expect("digits");
    (digits * ten(exponent.parse().expect("an exponent")), ten(after.len()))
}

fn product(a: &Whole, b: &Whole) -> Whole {
    let mut product = vec![BigInt::zero(); a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            product[i + j] += x * y;
        }
    }
    product
}

/// The quartic with these roots, times a whole number.
fn quartic(reals: &[Fraction], pairs: &[(&str, &str)]) -> Whole {
    let mut quartic = vec![BigInt::one()];
    for (numerator, denominator) in reals {
        quartic = product(&quartic, &vec![-numerator.clone(), denominator.clone()]);
    }
    for (real, imaginary) in pairs {
        let ((a, d), (b, e)) = (fraction(real), fraction(imaginary));
        // (x - a/d)^2 + (b/e)^2, times (d e)^2.
        let (a, b, d) = (a * &e, b * &d, d * e);
        quartic = product(&quartic, &vec![&a * &a + &b * &b, -(&a * &d) * 2, &d * &d]);
    }
    quartic
}

/// Bernstein coefficients on `[start, end]`, both over one denominator, rounded to `f64` and scaled by a power of two.
fn on_interval(quartic: &Whole, start: &BigInt, end: &BigInt, denominator: &BigInt) -> [f64; 5] {
    // In powers of s, with x = (start + (end - start) s) / denominator, by Horner's rule.
    let line = vec![start.clone(), end - start];
    let mut power: Whole = vec![BigInt::zero()];
    let mut lifted = BigInt::one();
    for c in quartic.iter().rev() {
        power = product(&power, &line);
        power[0] += c * &lifted;
        lifted *= denominator;
    }
    // Times 12, the least common multiple of the binomials 1, 4, 6, 4, 1.
    let exact: Vec<BigInt> = (0..5_u32)
        .map(|i| {
            let choose = |n: u32, k: u32| (0..k).fold(1, |product, j| product * (n - j) / (j + 1));
            (0..=i).map(|j| &power[j as usize] * (12 * choose(i, j) / choose(4, j))).sum()
        })
        .collect();
    let bits = exact.iter().map(BigInt::bits).max().expect("coefficients") as i64;
    std::array::from_fn(|i| {
        // The leading 64 bits; what is dropped below them is less than a rounding of the rounding.
        let drop = (exact[i].bits() as i64 - 64).max(0);
        let leading = (&exact[i] >> drop).to_f64().expect("64 bits");
        libm::scalbn(leading, (drop - bits) as i32)
    })
}

/// The quotient to `f64`'s precision, whatever the size of the two.
fn ratio(numerator: &BigInt, denominator: &BigInt) -> f64 {
    let shift = 128 + denominator.bits() as i64 - numerator.bits() as i64;
    let quotient: BigInt =
        if shift > 0 { (numerator << shift) / denominator } else { numerator / (denominator << -shift) };
    libm::scalbn(quotient.to_f64().expect("about 128 bits"), -(shift as i32))
}

/// Half widths of the intervals around a root, in parts of the root.
const WIDTHS: [(u32, u32); 4] = [(4, 1), (1, 2), (1, 16), (1, 1024)];

#[test]
fn the_sets_of_algorithm_1010_have_as_many_roots_as_counted_exactly() {
    println!(
        "set  intervals  roots  of rounding  largest error of a root on a narrow interval, over its distance from the next"
    );
    for (number, reals, pairs) in SETS {
        let reals: Vec<Fraction> = reals.iter().map(|text| fraction(text)).collect();
        let quartic = quartic(&reals, pairs);
        let mut tally = Tally::default();
        let (mut worst, mut intervals) = (0.0, 0);
        let one = (BigInt::one(), BigInt::one());
        for (root, denominator) in reals.iter().chain((reals.is_empty()).then_some(&one)) {
            for (width, part) in WIDTHS {
                // Not in the middle, where the first cut would be.
                let unit: BigInt = root.abs() * width;
                let scale = BigInt::from(7 * part);
                let middle = root * &scale;
                let (start, end) = (&middle - &unit * 5, &middle + &unit * 6);
                let denominator = denominator * &scale;
                let coefficients = on_interval(&quartic, &start, &end, &denominator);
                tally.check::<5>(&coefficients);
                intervals += 1;
                let error = error_of(&coefficients, &reals, (&start, &end, &denominator));
                // The rounding of the coefficients is of the interval's largest, so a root among others far away is as sharp
                // as the interval is narrow.
                if part >= 16 && error > worst {
                    worst = error;
                }
            }
        }
        println!(
            "{number:3}  {intervals:9}  {:5}  {:11}  {worst:.1e}",
            tally.root_count(),
            tally.decided_by_rounding()
        );
        let simple = reals.iter().all(|a| reals.iter().filter(|b| *b == a).count() == 1);
        assert!(!simple || tally.decided_by_rounding() == 0, "set {number}");
        assert!(worst < 1e-9, "set {number}: {worst:e}");
    }
}

/// The largest distance of a found root from the nearest one of the set, over that one's distance from the next other
/// one or the interval's width, whichever is less. Of simple roots alone.
fn error_of(
    coefficients: &[f64; 5],
    reals: &[Fraction],
    (start, end, denominator): (&BigInt, &BigInt, &BigInt),
) -> f64 {
    // Places of the roots on the interval, from 0 to 1.
    let place = |(numerator, own): &Fraction| {
        let offset = numerator * denominator - start * own;
        ratio(&offset, &((end - start) * own))
    };
    let places: Vec<f64> = reals.iter().map(place).collect();
    let mut worst = 0.0;
    for_each_root(coefficients, |x| {
        let nearest = (0..places.len())
            .reduce(|a, b| if (places[b] - x).abs() < (places[a] - x).abs() { b } else { a })
            .expect("a root where there is none");
        let others = places.iter().enumerate().filter(|(index, _)| *index != nearest);
        let gap = others
            .map(|(_, other)| (other - places[nearest]).abs())
            .fold(1.0, |least, gap| if gap < least { gap } else { least });
        let error = (x - places[nearest]).abs() / gap;
        if gap > 0.0 && error > worst {
            worst = error;
        }
    });
    worst
}

/// The two sets that are given by their coefficients.
#[test]
fn the_sets_given_by_coefficients_have_as_many_roots_as_counted_exactly() {
    let whole = |numbers: [i64; 5]| numbers.map(BigInt::from).to_vec();
    let s = BigInt::from(10).pow(30);
    let with_s = [&s, &-s.clone(), &BigInt::one()]
        .into_iter()
        .fold(vec![-BigInt::one(), s.clone()], |all, root| product(&all, &vec![-root, BigInt::one()]));
    // x^4 + x^3 + x^2 + 3/8 x + 1/1000, times 8000; and the roots 1e30, -1e30, 1, 1e-30.
    for (number, quartic, ends) in
        [(23, whole([8, 3000, 8000, 8000, 8000]), ["1", "10"]), (24, with_s, ["3", "7e30"])]
    {
        let mut tally = Tally::default();
        for end in ends {
            let (end, _) = fraction(end);
            let start = BigInt::from(-2) * &end;
            tally.check::<5>(&on_interval(&quartic, &start, &end, &BigInt::from(3)));
            tally.check::<5>(&on_interval(&quartic, &-BigInt::from(1), &end, &BigInt::from(3)));
        }
        println!(
            "set {number}: {} roots on four intervals, {} of the counts decided by rounding",
            tally.root_count(),
            tally.decided_by_rounding()
        );
        assert!(tally.root_count() >= 2);
    }
}

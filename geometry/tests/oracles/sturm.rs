//! Root isolation against exact counting: Sturm's theorem in whole numbers of any size.
//!
//! Every `f64` is a whole number times a power of two, so the polynomial that the coefficients mean is known
//! exactly, and so is the number of its roots in any interval: no tolerance enters.

use crate::random::Random;
use geometry::bernstein::{for_each_root, from_power};
use num_bigint::BigInt;
use num_traits::{Signed, ToPrimitive, Zero};

/// A polynomial in powers of x with whole coefficients, lowest first.
type Whole = Vec<BigInt>;

/// Mantissa and exponent: the value is `mantissa * 2^exponent`, exactly.
fn split(value: f64) -> (BigInt, i32) {
    let bits = value.to_bits();
    let exponent = ((bits >> 52) & 0x7ff) as i32;
    let fraction = bits & ((1 << 52) - 1);
    let (mantissa, exponent) =
        if exponent == 0 { (fraction, -1074) } else { (fraction | 1 << 52, exponent - 1075) };
    (if value < 0.0 { -BigInt::from(mantissa) } else { BigInt::from(mantissa) }, exponent)
}

/// All values in one unit, a power of two.
fn whole(values: &[f64]) -> Vec<BigInt> {
    let split: Vec<_> = values.iter().map(|&value| split(value)).collect();
    let unit = split.iter().filter(|(mantissa, _)| !mantissa.is_zero()).map(|(_, e)| *e).min().unwrap_or(0);
    split
        .into_iter()
        .map(|(mantissa, e)| if mantissa.is_zero() { mantissa } else { mantissa << (e - unit) })
        .collect()
}

/// The polynomial of Bernstein coefficients on `[0, 1]` in powers of x, times a power of two.
fn exactly(coefficients: &[f64]) -> Whole {
    let n = coefficients.len() - 1;
    let coefficients = whole(coefficients);
    let mut sum = vec![BigInt::zero(); n + 1];
    let mut binomial = BigInt::from(1);
    for (i, c) in coefficients.iter().enumerate() {
        // c C(n, i) x^i (1 - x)^(n - i)
        let mut term = &binomial * c;
        for k in 0..=n - i {
            sum[i + k] += &term;
            term = -term * (n - i - k) / (k + 1);
        }
        binomial = binomial * (n - i) / (i + 1);
    }
    sum
}

fn trim(polynomial: &mut Whole) {
    while polynomial.last().is_some_and(Zero::is_zero) {
        polynomial.pop();
    }
}

/// Sturm's chain: the polynomial, its derivative, and remainders with changed signs. Each remainder is scaled
/// by a positive number, which changes no sign.
fn chain(polynomial: &Whole) -> Vec<Whole> {
    let mut first = polynomial.clone();
    trim(&mut first);
    let mut second: Whole = first.iter().enumerate().skip(1).map(|(i, c)| c * i).collect();
    trim(&mut second);
    let mut chain = vec![first, second];
    while let [.., a, b] = &chain[..]
        && b.len() > 1
    {
        let mut rest = a.clone();
        let lead = &b[b.len() - 1];
        while rest.len() >= b.len() {
            let factor = rest[rest.len() - 1].clone() * lead.signum();
            let shift = rest.len() - b.len();
            rest.iter_mut().for_each(|c| *c *= lead.abs());
            b.iter().enumerate().for_each(|(i, c)| rest[shift + i] -= &factor * c);
            rest.pop();
            trim(&mut rest);
        }
        if rest.is_empty() {
            break;
        }
        chain.push(rest.into_iter().map(|c| -c).collect());
    }
    chain.retain(|polynomial| !polynomial.is_empty());
    chain
}

/// The polynomial at `numerator / 2^power`, times a positive number.
fn at(polynomial: &Whole, numerator: &BigInt, power: usize) -> BigInt {
    let mut sum = BigInt::zero();
    for (i, c) in polynomial.iter().rev().enumerate() {
        sum = sum * numerator + (c << (i * power));
    }
    sum
}

fn variations(chain: &[Whole], numerator: &BigInt, power: usize) -> usize {
    let mut changes = 0;
    let mut last = BigInt::zero();
    for polynomial in chain {
        let sign = at(polynomial, numerator, power).signum();
        if sign.is_zero() {
            continue;
        }
        if &sign * &last < BigInt::zero() {
            changes += 1;
        }
        last = sign;
    }
    changes
}

/// Distinct roots in the open interval (0, 1).
fn exact_count(polynomial: &Whole) -> usize {
    let (zero, one) = (BigInt::zero(), BigInt::from(1));
    let chain = chain(polynomial);
    let up_to_one = variations(&chain, &zero, 0) - variations(&chain, &one, 0);
    up_to_one - usize::from(at(polynomial, &one, 0).is_zero())
}

/// The polynomial's exact value at `x`, between 0 and 1, over the largest coefficient.
fn residual(coefficients: &[f64], polynomial: &Whole, x: f64) -> f64 {
    let (numerator, exponent) = split(x);
    let power = exponent.unsigned_abs() as usize;
    let value = at(polynomial, &numerator, power);
    let largest = whole(coefficients).iter().map(BigInt::abs).max().expect("coefficients");
    // 2^-80 of the largest coefficient is far below rounding, and the quotient of small numbers is a float.
    let share: BigInt = (value << 80) / (largest << (power * (polynomial.len() - 1)));
    share.to_f64().expect("a small number") / (1u128 << 80) as f64
}

/// Counts, and what was found.
#[derive(Default)]
pub struct Tally {
    polynomials: usize,
    roots: usize,
    /// Counts that differ, all of them where a change in the last bits changes the exact count, too.
    decided_by_rounding: usize,
    worst_residual: f64,
}

impl Tally {
    /// Roots in all, counted exactly.
    pub fn root_count(&self) -> usize {
        self.roots
    }

    pub fn decided_by_rounding(&self) -> usize {
        self.decided_by_rounding
    }

    pub fn check<const N: usize>(&mut self, coefficients: &[f64; N]) {
        let mut found = Vec::new();
        for_each_root(coefficients, |x| found.push(x));
        let polynomial = exactly(coefficients);
        let exact = exact_count(&polynomial);
        self.polynomials += 1;
        self.roots += exact;
        for &x in &found {
            let residual = residual(coefficients, &polynomial, x).abs();
            if residual > self.worst_residual {
                self.worst_residual = residual;
            }
        }
        assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{coefficients:?}: {found:?}");
        if found.len() == exact {
            return;
        }
        // Only a polynomial whose number of roots hangs on the last bits of its coefficients may be
        // miscounted: one that 2^-49 of the largest coefficient lifts off zero or presses onto it.
        let largest = coefficients.iter().fold(0.0, |m: f64, c| if c.abs() > m { c.abs() } else { m });
        let shift = largest / (1u64 << 49) as f64;
        let [above, below] =
            [shift, -shift].map(|shift| exact_count(&exactly(&coefficients.map(|c| c + shift))));
        assert!(
            above != exact || below != exact,
            "{coefficients:?}: {found:?}, but there are exactly {exact} roots, {above} above, {below} below"
        );
        self.decided_by_rounding += 1;
    }
}

/// A product of `(x - root)` in Bernstein form on `[0, 1]`, as rounded as it comes.
fn with_roots<const N: usize>(roots: &[f64]) -> [f64; N] {
    let mut power = [0.0; N];
    power[0] = 1.0;
    for &root in roots {
        for i in (0..N).rev() {
            power[i] = if i > 0 { power[i - 1] } else { 0.0 } - root * power[i];
        }
    }
    from_power(&power, 0.0, 1.0)
}

/// Counts `N` coefficients' roots for some random polynomials of one degree.
fn random_of_degree<const N: usize>(count: usize) {
    let mut random = Random(N as u64);
    let mut tally = Tally::default();
    for _ in 0..count {
        tally.check::<N>(&std::array::from_fn(|_| random.uniform(-1.0, 1.0)));
    }
    // Roots are refined in powers of x, whose coefficients sum to at most 3^n times the largest Bernstein
    // coefficient: as much is the rounding of one evaluation, and a few of them are made.
    let tolerance = 4.0 * f64::EPSILON * (0..N - 1).fold(1.0, |product, _| 3.0 * product);
    let Tally { polynomials, roots, decided_by_rounding, worst_residual } = tally;
    println!(
        "degree {}: {polynomials} polynomials, {roots} roots, {decided_by_rounding} decided by rounding (allowed \
         0), largest exact residual {worst_residual:.1e} of the largest coefficient (tolerance {tolerance:.1e})",
        N - 1
    );
    assert_eq!(decided_by_rounding, 0);
    assert!(worst_residual < tolerance);
}

#[test]
fn random_polynomials_have_exactly_the_counted_roots() {
    random_of_degree::<5>(10_000);
    random_of_degree::<9>(100);
    random_of_degree::<13>(20);
}

#[test]
fn close_pairs_of_roots_are_counted_exactly_down_to_rounding() {
    let mut random = Random(2);
    for (exponent, separation) in (1..).zip([1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]) {
        let mut tally = Tally::default();
        for _ in 0..1000 {
            let middle = random.uniform(0.05, 0.95);
            let apart = 0.5 * separation * random.uniform(0.5, 1.0);
            let far = [random.uniform(-2.0, 3.0), random.uniform(-2.0, 3.0)];
            tally.check::<5>(&with_roots(&[middle - apart, middle + apart, far[0], far[1]]));
            // The same without its pair of roots: the parabola stands just above zero.
            let mut lifted = with_roots::<5>(&[middle, middle, far[0], far[1]]);
            lifted.iter_mut().for_each(|c| *c += apart * apart);
            tally.check::<5>(&lifted);
        }
        println!(
            "pairs {separation:e} apart: {} roots, {} of {} counts decided by rounding",
            tally.roots, tally.decided_by_rounding, tally.polynomials
        );
        // Two roots s apart are a dip of depth s^2 / 4 times the slope of the other factors: far above
        // rounding (1e-16) down to s = 1e-5, unless those factors are as small there as 1e-5, too.
        assert!(exponent > 5 || tally.decided_by_rounding == 0);
    }
}

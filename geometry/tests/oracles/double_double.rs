//! Numbers of twice the precision (pairs of `f64`), for references only.

use core::ops::{Add, Mul, Neg, Sub};

/// The unevaluated sum of two `f64`, `high + low`, `low` below half a unit in the last place of `high`.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Double {
    pub high: f64,
    pub low: f64,
}

/// Exact sum (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

/// Exact product (Dekker, Veltkamp).
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let split = |a: f64| {
        let scaled = 134_217_729.0 * a;
        let high = scaled - (scaled - a);
        (high, a - high)
    };
    let product = a * b;
    let ((a_high, a_low), (b_high, b_low)) = (split(a), split(b));
    let error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    (product, error)
}

impl From<f64> for Double {
    fn from(high: f64) -> Double {
        Double { high, low: 0.0 }
    }
}

impl Add for Double {
    type Output = Double;
    fn add(self, other: Double) -> Double {
        let (sum, error) = two_sum(self.high, other.high);
        let (low, low_error) = two_sum(self.low, other.low);
        let (sum, error) = two_sum(sum, error + low);
        let (high, low) = two_sum(sum, error + low_error);
        Double { high, low }
    }
}

impl Neg for Double {
    type Output = Double;
    fn neg(self) -> Double {
        Double { high: -self.high, low: -self.low }
    }
}

impl Sub for Double {
    type Output = Double;
    fn sub(self, other: Double) -> Double {
        self + -other
    }
}

impl Mul for Double {
    type Output = Double;
    fn mul(self, other: Double) -> Double {
        let (product, error) = two_product(self.high, other.high);
        let (high, low) = two_sum(product, error + (self.high * other.low + self.low * other.high));
        Double { high, low }
    }
}

/// All roots in `(start, end)` where the polynomial (coefficients lowest first) changes its sign, in
/// ascending order: bisection between the roots of the derivative, in double-double.
pub fn roots(coefficients: &[Double], start: Double, end: Double) -> Vec<Double> {
    let degree = coefficients.len() - 1;
    if degree == 0 {
        return Vec::new();
    }
    let derivative: Vec<Double> = (1..=degree).map(|i| coefficients[i] * Double::from(i as f64)).collect();
    let mut bounds = vec![start];
    bounds.extend(roots(&derivative, start, end));
    bounds.push(end);
    let zero = Double::from(0.0);
    let value = |x: Double| coefficients.iter().rev().fold(zero, |sum, &c| sum * x + c);
    let mut found = Vec::new();
    for pair in bounds.windows(2) {
        let (mut low, mut high) = (pair[0], pair[1]);
        let (at_low, at_high) = (value(low), value(high));
        if !((at_low < zero && at_high > zero) || (at_low > zero && at_high < zero)) {
            continue;
        }
        let rising = at_low < zero;
        for _ in 0..100 {
            let middle = (low + high) * Double::from(0.5);
            if (value(middle) < zero) == rising { low = middle } else { high = middle }
        }
        found.push((low + high) * Double::from(0.5));
    }
    found
}

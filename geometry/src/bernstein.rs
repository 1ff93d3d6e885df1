//! Certified isolation of the real roots of a polynomial on an interval.
//!
//! A polynomial of degree `n` is held by its `n + 1` Bernstein coefficients on the interval, mapped to
//! `[0, 1]`. The number of sign changes in that list is at least the number of roots inside and equal
//! to it modulo two (Descartes). So no sign change proves that there is no root, one proves that there
//! is exactly one, and more means: halve the interval (de Casteljau) and ask again. An isolated root is
//! then found by Newton's method, which is never allowed to leave its bracket.
//!
//! # What counts as a root
//! A root is a place where the sign changes. A double root (a curve that touches zero and turns back)
//! is none. Subdivision stops at a width of `2^-`[`DEPTH_MAX`]: two roots closer than that, and a dip
//! below zero narrower than that, are taken as no root; an odd number of sign changes there still
//! gives one root. Rounding moves a coefficient by about `1e-16` of the largest one, so dips and bumps
//! below that size are decided by rounding: always in the same way, but not meaningfully.
//!
//! # Source
//! Descartes' rule in Bernstein form with subdivision: Lane and Riesenfeld, "Bounds on a polynomial",
//! BIT 21 (1981). Deviation: the bracketed Newton iteration replaces further subdivision as soon as
//! one sign change is left.

/// Largest number of halvings of the interval. Simple roots are isolated long before (their distance
/// must be below `2^-30` of the interval to get here); a smaller limit would lose shallow contacts, a
/// larger one would only resolve rounding noise, since a dip of width `2^-30` has depth of order
/// `2^-60`.
pub const DEPTH_MAX: u32 = 30;

/// Newton's iteration stops when a step is below this part of the isolating interval. The iteration
/// doubles its digits each step, so the error left is of the order of the square of this.
const STEP_MIN: f64 = 1.0 / (1u64 << 30) as f64;

/// The iteration starts at least this far from the ends; see [`isolated_root`].
const START_MIN: f64 = 1.0 / 16.0;

/// Enough for bisection alone to reach the last bit, so the limit never decides a result.
const NEWTON_STEPS_MAX: u32 = 64;

/// Number of sign changes in the list of coefficients; zeros (and NaN) are passed over.
#[inline]
pub fn sign_changes<const N: usize>(coefficients: &[f64; N]) -> u32 {
    let mut negative = 0u32;
    let mut positive = 0u32;
    for (i, &c) in coefficients.iter().enumerate() {
        negative |= u32::from(c < 0.0) << i;
        positive |= u32::from(c > 0.0) << i;
    }
    if negative == 0 || positive == 0 {
        return 0;
    }
    if (negative | positive) + 1 == 1 << N {
        return ((negative ^ (negative >> 1)) & ((1 << (N - 1)) - 1)).count_ones();
    }
    sign_changes_with_zeros(coefficients)
}

#[cold]
fn sign_changes_with_zeros<const N: usize>(coefficients: &[f64; N]) -> u32 {
    let mut changes = 0;
    let mut last = 0.0;
    for &c in coefficients {
        if (c < 0.0 && last > 0.0) || (c > 0.0 && last < 0.0) {
            changes += 1;
        }
        if c != 0.0 {
            last = c;
        }
    }
    changes
}

/// Sign of the polynomial just right of 0: that of the first coefficient that is not zero; 0 if there
/// is none.
#[inline]
pub fn sign_at_start<const N: usize>(coefficients: &[f64; N]) -> f64 {
    first_sign(coefficients.iter())
}

/// Sign of the polynomial just left of 1, as [`sign_at_start`].
#[inline]
pub fn sign_at_end<const N: usize>(coefficients: &[f64; N]) -> f64 {
    first_sign(coefficients.iter().rev())
}

#[inline]
fn first_sign<'a>(coefficients: impl Iterator<Item = &'a f64>) -> f64 {
    for &c in coefficients {
        if c > 0.0 {
            return 1.0;
        }
        if c < 0.0 {
            return -1.0;
        }
    }
    0.0
}

/// The two halves of the polynomial, on `[0, 1/2]` and on `[1/2, 1]` (de Casteljau).
#[inline]
pub fn halves<const N: usize>(coefficients: &[f64; N]) -> ([f64; N], [f64; N]) {
    let mut left = [0.0; N];
    let mut right = *coefficients;
    for (i, first) in left.iter_mut().enumerate() {
        *first = right[0];
        for j in 0..N - 1 - i {
            right[j] = 0.5 * (right[j] + right[j + 1]);
        }
    }
    (left, right)
}

/// Coefficients of the same polynomial in powers of `x` on `[0, 1]`, lowest first.
#[inline]
pub fn to_power<const N: usize>(coefficients: &[f64; N]) -> [f64; N] {
    let mut power = *coefficients;
    // After pass i, power[j] for j > i holds the (i + 1)-th difference.
    for i in 0..N - 1 {
        for j in (i + 1..N).rev() {
            power[j] -= power[j - 1];
        }
    }
    let mut binomial = 1.0;
    for (i, c) in power.iter_mut().enumerate().skip(1) {
        binomial = binomial * (N - i) as f64 / i as f64;
        *c *= binomial;
    }
    power
}

/// Bernstein coefficients on `[start, end]` of the polynomial with coefficients `power` in powers of
/// `x`, lowest first.
///
/// The conversion loses digits when the interval is short compared with its distance from 0: shift the
/// origin of `x` near the interval first.
pub fn from_power<const N: usize>(power: &[f64; N], start: f64, end: f64) -> [f64; N] {
    // Taylor shift to `start`, scale to unit length, then divide out the binomials and sum up.
    let mut c = *power;
    for i in 0..N - 1 {
        for j in (i..N - 1).rev() {
            c[j] += start * c[j + 1];
        }
    }
    let mut scale = 1.0;
    for (i, value) in c.iter_mut().enumerate().skip(1) {
        scale = scale * (end - start) * i as f64 / (N - i) as f64;
        *value *= scale;
    }
    for i in (0..N - 1).rev() {
        for j in i + 1..N {
            c[j] += c[j - 1];
        }
    }
    c
}

/// Value of the polynomial at `x` in `[0, 1]` (de Casteljau: no cancellation beyond that of the data).
pub fn value<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    let mut c = *coefficients;
    for i in (0..N - 1).rev() {
        for j in 0..=i {
            c[j] = (1.0 - x) * c[j] + x * c[j + 1];
        }
    }
    c[0]
}

/// Passes the roots in the open interval `(0, 1)` to `accept` in ascending order and returns the first
/// one for which it says true.
///
/// A root is a change of sign: see the module's page for double roots and the depth limit. With all
/// coefficients zero, or NaN, there is no root.
#[inline]
pub fn find_root<const N: usize>(
    coefficients: &[f64; N],
    mut accept: impl FnMut(f64) -> bool,
) -> Option<f64> {
    visit(coefficients, 0.0, 1.0, DEPTH_MAX, &mut accept)
}

#[inline]
fn visit<const N: usize>(
    coefficients: &[f64; N],
    start: f64,
    width: f64,
    depth: u32,
    accept: &mut impl FnMut(f64) -> bool,
) -> Option<f64> {
    let changes = sign_changes(coefficients);
    if changes == 0 {
        return None;
    }
    if changes == 1 || (depth == 0 && changes % 2 == 1) {
        return Some(start + width * isolated_root(coefficients)).filter(|&x| accept(x));
    }
    if depth == 0 { None } else { descend(coefficients, start, width, depth, accept) }
}

fn descend<const N: usize>(
    coefficients: &[f64; N],
    start: f64,
    width: f64,
    depth: u32,
    accept: &mut impl FnMut(f64) -> bool,
) -> Option<f64> {
    let (left, right) = halves(coefficients);
    let half = 0.5 * width;
    let middle = start + half;
    if let Some(root) = visit(&left, start, half, depth - 1, accept) {
        return Some(root);
    }
    // A root exactly on the cut belongs to neither open half.
    if right[0] == 0.0 && sign_at_end(&left) * sign_at_start(&right) < 0.0 && accept(middle) {
        return Some(middle);
    }
    visit(&right, middle, half, depth - 1, accept)
}

/// The root in `(0, 1)` of a polynomial whose signs just inside the two ends differ, by Newton's method
/// inside a bracket that shrinks with every evaluation; a step that would leave it is replaced by its
/// middle. With several roots (an odd number) it finds one of them.
#[inline]
pub fn isolated_root<const N: usize>(coefficients: &[f64; N]) -> f64 {
    let c = to_power(coefficients);
    let sign = sign_at_start(coefficients);
    let (mut low, mut high) = (0.0, 1.0);
    // The chord's zero, but not at an end: another root may lie on that end (a cut), so close that the
    // value there is rounding noise, and the iteration would stop at it.
    let mut x = coefficients[0] / (coefficients[0] - coefficients[N - 1]);
    if !(x > START_MIN) {
        x = START_MIN;
    } else if x > 1.0 - START_MIN {
        x = 1.0 - START_MIN;
    }
    for _ in 0..NEWTON_STEPS_MAX {
        let mut value = c[N - 1];
        let mut slope = 0.0;
        for &coefficient in c[..N - 1].iter().rev() {
            slope = slope * x + value;
            value = value * x + coefficient;
        }
        let signed = value * sign;
        if signed > 0.0 {
            low = x;
        } else if signed < 0.0 {
            high = x;
        } else {
            return x;
        }
        let mut next = x - value / slope;
        if !(next > low && next < high) {
            next = 0.5 * (low + high);
        }
        let step = next - x;
        x = next;
        if step < STEP_MIN && step > -STEP_MIN {
            break;
        }
    }
    x
}

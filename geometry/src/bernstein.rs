//! Certified isolation of the real roots of a polynomial on an interval.
//!
//! A polynomial of degree `n` is held by its `n + 1` Bernstein coefficients on the interval, mapped to
//! `[0, 1]`. The number of sign changes in that list is at least the number of roots inside and equal
//! to it modulo two (Descartes). So no sign change proves that there is no root, one proves that there
//! is exactly one, and more means: cut the interval in two (de Casteljau) and ask again. An isolated root is
//! then found by Halley's method, which is never allowed to leave its bracket.
//!
//! # What counts as a root
//! A root is a place where the sign changes. A double root (a curve that touches zero and turns back)
//! is none. Subdivision stops below a width of [`WIDTH_MIN`]: two roots closer than that, and a dip
//! below zero narrower than that, are taken as no root; an odd number of sign changes there still
//! gives one root. Rounding moves a coefficient by about `1e-16` of the largest one, so dips and bumps
//! below that size are decided by rounding: always in the same way, but not meaningfully.
//!
//! # Source
//! Descartes' rule in Bernstein form with subdivision: Lane and Riesenfeld, "Bounds on a polynomial",
//! BIT 21 (1981). Deviation: a bracketed iteration replaces further subdivision as soon as
//! one sign change is left.

/// Smallest width of an interval that is still cut. Simple roots are isolated long before; a larger limit
/// would lose shallow contacts, a smaller one would only resolve rounding noise, since a dip of width
/// `2^-30` has depth of order `2^-60`.
pub const WIDTH_MIN: f64 = 1.0 / (1u64 << 30) as f64;

/// The iteration stops when a step is below this part of the isolating interval and the error it leaves
/// is, by the estimate of the next constant, too.
const STEP_MIN: f64 = 1.0 / (1u64 << 16) as f64;

/// Halley's step from a simple root with a neighbour at a distance `d` leaves an error of about
/// `step^3 / (2 d)^2`, and `value * half_curvature / slope^2` is about `step / (2 d)`: the iteration goes on
/// until this estimate of the error is below this part of the interval.
const ERROR_MAX: f64 = 1.0 / (1u64 << 46) as f64;

/// The iteration starts at least this far from the ends; see [`isolated_root`].
const START_MIN: f64 = 1.0 / 16.0;

/// Enough for bisection alone to reach the last bit.
const STEPS_MAX: u32 = 64;

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

/// The two parts of the polynomial, on `[0, x]` and on `[x, 1]`, each mapped to `[0, 1]` (de Casteljau).
#[inline]
pub fn parts<const N: usize>(coefficients: &[f64; N], x: f64) -> ([f64; N], [f64; N]) {
    let mut left = [0.0; N];
    let mut right = *coefficients;
    let rest = 1.0 - x;
    for (i, first) in left.iter_mut().enumerate() {
        *first = right[0];
        for j in 0..N - 1 - i {
            right[j] = rest * right[j] + x * right[j + 1];
        }
    }
    (left, right)
}

/// Value at 1/2.
#[inline]
fn middle_value<const N: usize>(coefficients: &[f64; N]) -> f64 {
    let mut binomial = 1.0;
    let mut scale = 1.0;
    let mut sum = coefficients[0];
    for (i, &c) in coefficients.iter().enumerate().skip(1) {
        binomial = binomial * (N - i) as f64 / i as f64;
        scale *= 0.5;
        sum += binomial * c;
    }
    sum * scale
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
    visit::<N, false>(coefficients, 0.0, 1.0, true, &mut accept)
}

/// Passes all roots in the open interval `(0, 1)` to `take`, in ascending order. The same roots with the
/// same bits as from [`find_root`], in less time when there are two: they are computed side by side.
#[inline]
pub fn for_each_root<const N: usize>(coefficients: &[f64; N], mut take: impl FnMut(f64)) {
    let mut accept = |x| {
        take(x);
        false
    };
    visit::<N, true>(coefficients, 0.0, 1.0, true, &mut accept);
}

#[inline]
fn visit<const N: usize, const ALL: bool>(
    coefficients: &[f64; N],
    start: f64,
    width: f64,
    aim: bool,
    accept: &mut impl FnMut(f64) -> bool,
) -> Option<f64> {
    let changes = sign_changes(coefficients);
    if changes == 0 {
        return None;
    }
    if changes == 1 || (width < WIDTH_MIN && changes % 2 == 1) {
        return Some(start + width * isolated_root(coefficients)).filter(|&x| accept(x));
    }
    if width < WIDTH_MIN {
        return None;
    }
    // Two changes: two roots or a bump. Cutting near the extremum in between parts the two roots at once,
    // or shows at once that there are none. Every other cut is in the middle, which bounds their number.
    let cut = if aim && changes == 2 { extremum(coefficients) } else { 0.5 };
    descend::<N, ALL>(coefficients, start, width, cut, !aim, accept)
}

fn descend<const N: usize, const ALL: bool>(
    coefficients: &[f64; N],
    start: f64,
    width: f64,
    cut: f64,
    aim: bool,
    accept: &mut impl FnMut(f64) -> bool,
) -> Option<f64> {
    let (left, right) = parts(coefficients, cut);
    let middle = start + width * cut;
    let (left_width, right_width) = (width * cut, width * (1.0 - cut));
    if ALL && sign_changes(&left) == 1 && sign_changes(&right) == 1 && right[0] != 0.0 {
        let [first, second] = isolated_roots([&left, &right]);
        let both = [start + left_width * first, middle + right_width * second];
        return both.into_iter().find(|&x| accept(x));
    }
    if let Some(root) = visit::<N, ALL>(&left, start, left_width, aim, accept) {
        return Some(root);
    }
    // A root exactly on the cut belongs to neither open part.
    if right[0] == 0.0 && sign_at_end(&left) * sign_at_start(&right) < 0.0 && accept(middle) {
        return Some(middle);
    }
    visit::<N, ALL>(&right, middle, right_width, aim, accept)
}

/// Adding and subtracting this rounds a number near 1 to a multiple of 1/256.
const ROUND: f64 = 1.5 * (1u64 << 44) as f64;

/// About where the polynomial has its extremum: that of the parabola through its values at 0, 1/2 and 1,
/// kept between 1/8 and 7/8.
#[inline]
fn extremum<const N: usize>(coefficients: &[f64; N]) -> f64 {
    let (first, last) = (coefficients[0], coefficients[N - 1]);
    let x = 0.5 + 0.25 * (first - last) / (first - 2.0 * middle_value(coefficients) + last);
    if !(x > 0.125) {
        0.125
    } else if x > 0.875 {
        0.875
    } else {
        // A multiple of 1/256, so that the cut's position, `1 - x` and the parts' widths are exact.
        (x + ROUND) - ROUND
    }
}

/// The root in `(0, 1)` of a polynomial whose signs just inside the two ends differ, by Halley's method
/// (Newton's with the curvature) inside a bracket that shrinks with every evaluation; a step that would
/// leave it is replaced by its middle. With several roots (an odd number) it finds one of them.
#[inline]
pub fn isolated_root<const N: usize>(coefficients: &[f64; N]) -> f64 {
    isolated_roots([coefficients])[0]
}

/// [`isolated_root`] of several polynomials side by side, with the same bits: each lane runs the same
/// operations and stands still once it has stopped.
fn isolated_roots<const N: usize, const LANES: usize>(coefficients: [&[f64; N]; LANES]) -> [f64; LANES] {
    let mut power = [[0.0; LANES]; N];
    let (mut x, mut sign) = ([0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        let lane = to_power(coefficients[l]);
        for i in 0..N {
            power[i][l] = lane[i];
        }
        sign[l] = sign_at_start(coefficients[l]);
        x[l] = parabola_root(coefficients[l]);
    }
    let (mut low, mut high) = ([0.0; LANES], [1.0; LANES]);
    let mut done = [false; LANES];
    for _ in 0..STEPS_MAX {
        let (value, slope, half_curvature) = values_and_derivatives(&power, &x);
        for l in 0..LANES {
            let before = value[l] * sign[l] > 0.0;
            low[l] = if before { x[l] } else { low[l] };
            high[l] = if before { high[l] } else { x[l] };
            let slope_squared = slope[l] * slope[l];
            let bend = value[l] * half_curvature[l];
            let halley = x[l] - value[l] * slope[l] / (slope_squared - bend);
            // False for NaN, too.
            let inside = halley >= low[l] && halley <= high[l];
            let next = if inside { halley } else { 0.5 * (low[l] + high[l]) };
            let step = next - x[l];
            let step = if step < 0.0 { -step } else { step };
            x[l] = if done[l] { x[l] } else { next };
            done[l] |=
                (step < STEP_MIN) & (step * (bend * bend) <= ERROR_MAX * (slope_squared * slope_squared));
        }
        if done.iter().all(|&lane| lane) {
            break;
        }
    }
    x
}

/// The root of the parabola through the values at 0, 1/2 and 1, whose outer two differ in sign.
///
/// Not at an end: another root may lie on that end (a cut), so close that the value there is rounding
/// noise, and the iteration would stop at it.
#[inline]
fn parabola_root<const N: usize>(coefficients: &[f64; N]) -> f64 {
    let (first, last) = (coefficients[0], coefficients[N - 1]);
    let control = 2.0 * middle_value(coefficients) - 0.5 * (first + last);
    let root = (control * control - first * last).sqrt();
    let x = first / (first - control + if first < 0.0 { -root } else { root });
    if !(x > START_MIN) {
        START_MIN
    } else if x > 1.0 - START_MIN {
        1.0 - START_MIN
    } else {
        x
    }
}

/// Value, derivative and half the second derivative of polynomials in powers of `x`, `power[i]` the
/// coefficients of `x^i` in all lanes: even and odd powers apart, so that the two halves are evaluated side
/// by side.
#[inline]
fn values_and_derivatives<const N: usize, const LANES: usize>(
    power: &[[f64; LANES]; N],
    x: &[f64; LANES],
) -> ([f64; LANES], [f64; LANES], [f64; LANES]) {
    // e(s) and o(s) at s = x^2, p(x) = e + x o; with the first and half the second derivative by s.
    let (mut even, mut odd) = ([[0.0; 3]; LANES], [[0.0; 3]; LANES]);
    for i in (0..N).rev() {
        let sums = if i % 2 == 0 { &mut even } else { &mut odd };
        for l in 0..LANES {
            let square = x[l] * x[l];
            let [e, e_1, e_2] = sums[l];
            sums[l] = [e * square + power[i][l], e_1 * square + e, e_2 * square + e_1];
        }
    }
    let mut result = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        let ([e, e_1, e_2], [o, o_1, o_2]) = (even[l], odd[l]);
        let x = x[l];
        result.0[l] = e + x * o;
        result.1[l] = o + 2.0 * x * (e_1 + x * o_1);
        result.2[l] = e_1 + 3.0 * x * o_1 + 4.0 * x * x * (e_2 + x * o_2);
    }
    result
}

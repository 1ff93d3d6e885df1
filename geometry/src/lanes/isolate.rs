//! The two ends of a contact arc: the quartic's minimum, and from there its roots on both sides.
//!
//! # Certificate
//! The quartic is positive at both ends of the chart, and two sign changes of its Bernstein coefficients say
//! that it has two roots or none. Where its value at the minimum `m` is negative, each side of `m` holds an odd
//! number of roots, so exactly one. Where it is positive, the parts on both sides of `m` must show no sign
//! change. Everything else (more sign changes, an end inside a contact, a minimum that rounding decides, an
//! arc longer than a quarter turn, an iteration that has not converged) is irregular.
//!
//! # Accuracy
//! Halley's method has the error `step^3 / (2 d)^2` after a step, with `d` the distance to the other root,
//! here about the arc's length `2 w`. With a last step below `w / 4096` that is less than `1e-12 w`. The depth
//! vanishes at the ends, so the force of an arc changes by the square of that.

use super::chart::{Chart, bernstein};
use super::{LANES, LaneArc, Lanes, Mask, Simd, columns, larger, smaller, transposed};
use crate::arc::HALF_TANGENT_MAX;
use fearless_simd::prelude::*;

/// Newton steps to the minimum.
const MINIMUM_STEPS: usize = 2;
/// Halley steps to the roots.
const ROOT_STEPS: usize = 3;
/// The last step, in half widths of the arc.
const STEP_MAX: f64 = 1.0 / 4096.0;
/// The search for the minimum stays this far from the ends.
const INNER: f64 = 1.0 - 1.0 / 64.0;

/// Appends the arcs of the charts, in order; the numbers of pairs with a chart outside the common case go to
/// `irregular`.
#[inline(always)]
pub(super) fn isolate<S: Simd>(simd: S, charts: &[Chart], arcs: &mut Vec<LaneArc>, irregular: &mut Vec<u32>) {
    arcs.resize(charts.len() + LANES, LaneArc::default());
    let mut count = 0;
    for group in charts.chunks(LANES) {
        let chart = |lane: usize| if lane < group.len() { &group[lane] } else { &group[0] };
        let four = [chart(0), chart(1), chart(2), chart(3)];
        let here = (1u64 << group.len()) - 1;
        let found = ends(simd, four);
        let odd = found.irregular & here;
        if odd != 0 {
            for (lane, chart) in group.iter().enumerate() {
                if odd >> lane & 1 == 1 {
                    irregular.push(chart.pair);
                }
            }
        }
        let keep = found.touching & here & !odd;
        for (lane, (row, chart)) in found.arcs.iter().zip(four).enumerate() {
            let [mid_cos, mid_sin, half_tangent, _] = *row.as_array();
            arcs[count] = LaneArc { mid_cos, mid_sin, half_tangent, pair: f64::from(chart.pair) };
            count += (keep >> lane & 1) as usize;
        }
    }
    arcs.truncate(count);
}

struct Found<S: Simd> {
    /// Rows of arcs.
    arcs: [Lanes<S>; LANES],
    touching: u64,
    irregular: u64,
}

#[inline(always)]
fn ends<S: Simd>(simd: S, charts: [&Chart; LANES]) -> Found<S> {
    let [c_0, c_1, c_2, c_3] = columns(
        simd,
        charts.map(
            #[inline(always)]
            |chart| &chart.low,
        ),
    );
    let [c_4, half_tangent, mid_cos, mid_sin] = columns(
        simd,
        charts.map(
            #[inline(always)]
            |chart| &chart.rest,
        ),
    );
    let c = [c_0, c_1, c_2, c_3, c_4];
    let zero = Lanes::splat(simd, 0.0);
    let one = Lanes::splat(simd, 1.0);
    let b = bernstein(&c);
    let ends_outside = b[0].simd_gt(zero) & b[4].simd_gt(zero);
    // With both ends positive the only list with four changes is + - + - +.
    let four_changes = b[1].simd_lt(zero) & b[3].simd_lt(zero) & b[2].simd_gt(zero);
    let simple = ends_outside & !four_changes;

    let inner = Lanes::splat(simd, INNER);
    let mut m = within(-0.5 * (c_1 + c_3) / (c_2 + c_4), inner);
    for _ in 0..MINIMUM_STEPS {
        let slope = c_1 + m * (2.0 * c_2 + m * (3.0 * c_3 + m * (4.0 * c_4)));
        let bend = 2.0 * c_2 + m * (6.0 * c_3 + m * (12.0 * c_4));
        m = within(m - slope / bend, inner);
    }
    let (lowest, _, half_bend) = taylor(&c, m);
    let negative = lowest.simd_lt(zero);
    let positive = simple & no_root(&b, m, zero);

    // A parabola's roots to start with, each in its bracket.
    let width = (-lowest / half_bend).sqrt();
    let mut low = larger(m - width, 0.5 * (m - one));
    let mut high = smaller(m + width, 0.5 * (m + one));
    let (mut low_step, mut high_step) = (zero, zero);
    for _ in 0..ROOT_STEPS {
        low_step = halley(&c, low);
        high_step = halley(&c, high);
        low -= low_step;
        high -= high_step;
    }
    let small = (high - low) * (0.5 * STEP_MAX);
    let converged = low_step.abs().simd_lt(small) & high_step.abs().simd_lt(small);
    let bracketed: Mask<S> = (low.simd_ge(-one) & low.simd_le(m)) & (high.simd_ge(m) & high.simd_le(one));

    // The arc from `start` to `end` as in `Arc::between`.
    let (start, end) = (half_tangent * low, half_tangent * high);
    let norm = ((1.0 + start * start) * (1.0 + end * end)).sqrt();
    let inverse = 1.0 / norm;
    let (cos, sin) = ((1.0 - start * end) * inverse, (start + end) * inverse);
    // On the mirrored side tau runs against e2.
    let turn = mid_sin.simd_lt(zero).select(-sin, sin);
    let arc_cos = mid_cos * cos - mid_sin * turn;
    let arc_sin = mid_sin * cos + mid_cos * turn;
    let arc_tangent = (end - start) / (norm + (1.0 + start * end));
    let short = arc_tangent.simd_le(Lanes::splat(simd, HALF_TANGENT_MAX));

    let touching = (simple & negative) & (converged & bracketed) & short;
    let known = touching | positive;
    Found {
        arcs: transposed([arc_cos, arc_sin, arc_tangent, zero]),
        touching: touching.to_bitmask(),
        irregular: !known.to_bitmask(),
    }
}

/// The number, brought between `-limit` and `limit`.
#[inline(always)]
fn within<S: Simd>(x: Lanes<S>, limit: Lanes<S>) -> Lanes<S> {
    larger(smaller(x, limit), -limit)
}

/// Value, slope and half the second derivative.
#[inline(always)]
fn taylor<S: Simd>(c: &[Lanes<S>; 5], u: Lanes<S>) -> (Lanes<S>, Lanes<S>, Lanes<S>) {
    // Horner's scheme three times over.
    let v_3 = c[3] + u * c[4];
    let v_2 = c[2] + u * v_3;
    let v_1 = c[1] + u * v_2;
    let w_3 = v_3 + u * c[4];
    let w_2 = v_2 + u * w_3;
    let half_bend = w_2 + u * (w_3 + u * c[4]);
    (c[0] + u * v_1, v_1 + u * w_2, half_bend)
}

/// Halley's step (to be subtracted).
#[inline(always)]
fn halley<S: Simd>(c: &[Lanes<S>; 5], u: Lanes<S>) -> Lanes<S> {
    let (value, slope, half_bend) = taylor(c, u);
    value * slope / (slope * slope - value * half_bend)
}

/// Whether the parts left and right of `m` have no negative Bernstein coefficient (de Casteljau).
#[inline(always)]
fn no_root<S: Simd>(b: &[Lanes<S>; 5], m: Lanes<S>, zero: Lanes<S>) -> Mask<S> {
    let x = 0.5 + 0.5 * m;
    let y = 0.5 - 0.5 * m;
    let mut c = *b;
    let mut least = smaller(c[0], c[4]);
    for last in [4, 3, 2, 1] {
        for i in 0..last {
            c[i] = y * c[i] + x * c[i + 1];
        }
        least = smaller(least, smaller(c[0], c[last - 1]));
    }
    least.simd_gt(zero)
}

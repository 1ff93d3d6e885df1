//! The stretches of A between the strip's edges `|h| = reach`, and the quartic on each.
//!
//! At the strip's edges the quartic is `y^2 (1 + tau^2)^2`, which is not negative, so that a contact shows as
//! a dip between two positive ends.

use super::{Frames, LANES, Lanes, Line, PairLanes, Simd, larger, smaller, transposed};
use fearless_simd::prelude::*;

/// Planes nearer to parallel than this sine squared are irregular: there the frame loses digits, and arcs are
/// long. About 6 degrees.
const SIN_SQUARED_MIN: f64 = 0.01;

/// A stretch of A on which there may be a contact.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub(super) struct Chart {
    /// The quartic's coefficients of `u^0` to `u^3`; `u` runs from -1 to 1, `tau = half_tangent u`.
    pub low: [f64; 4],
    /// The coefficient of `u^4`, the half tangent, cosine and sine of the middle.
    pub rest: [f64; 4],
    /// Number of its pair.
    pub pair: u32,
}

/// Writes the charts of the pairs `near`, in order, and returns how many; pairs outside the common case go to
/// `irregular`.
#[inline(always)]
pub(super) fn charts<S: Simd>(
    simd: S,
    lines: &[Line],
    pairs: &[(u32, u32)],
    near: &[u32],
    charts: &mut Vec<Chart>,
    irregular: &mut Vec<u32>,
) -> usize {
    let most = 2 * (near.len() + LANES);
    if charts.len() < most {
        charts.resize(most, Chart::default());
    }
    let charts = charts.as_mut_slice();
    let mut count = 0;
    for group in near.chunks(LANES) {
        let number = |lane: usize| if lane < group.len() { group[lane] } else { group[0] };
        let numbers = [number(0), number(1), number(2), number(3)];
        let four = numbers.map(
            #[inline(always)]
            |number| pairs[number as usize],
        );
        let sides = sides(simd, &PairLanes::load(simd, lines, four));
        let here = (1u64 << group.len()) - 1;
        if sides.irregular & here != 0 {
            let odd = |lane: &usize| (sides.irregular >> lane) & 1 == 1;
            irregular.extend((0..group.len()).filter(odd).map(|lane| numbers[lane]));
        }
        let keep = [sides.keep[0] & here & !sides.irregular, sides.keep[1] & here & !sides.irregular];
        if keep[0] | keep[1] == 0 {
            continue;
        }
        for (lane, &pair) in numbers.iter().enumerate() {
            for (side, keep) in keep.iter().enumerate() {
                let chart = &mut charts[count];
                sides.low[side][lane].store_array(&mut chart.low);
                sides.rest[side][lane].store_array(&mut chart.rest);
                chart.pair = pair;
                count += ((keep >> lane) & 1) as usize;
            }
        }
    }
    count
}

/// Both sides of four pairs: rows of charts, and bits of those that may touch.
struct Sides<S: Simd> {
    low: [[Lanes<S>; LANES]; 2],
    rest: [[Lanes<S>; LANES]; 2],
    keep: [u64; 2],
    irregular: u64,
}

#[inline(always)]
fn sides<S: Simd>(simd: S, pairs: &PairLanes<S>) -> Sides<S> {
    let reach = pairs.reach;
    let frame = Frames::of(pairs);
    let [along_e2, _, h_0] = frame.centre;
    let d = &pairs.from_b;
    let over_a = d.dot(&pairs.normal_a);
    let along_e1 = (h_0 - frame.cos * over_a) / frame.sin;
    // The strip's edges as half angles, as in `ellipse`: t_1 where h = reach, t_2 where h = -reach; at the
    // circle's own highest and lowest points where it does not cross them.
    let amplitude = pairs.radius_a * frame.sin;
    let half = 0.5 / amplitude;
    let (top, bottom) = (amplitude - h_0, amplitude + h_0);
    let (cos_1, sin_1) = (share(simd, (top + reach) * half), share(simd, (bottom - reach) * half));
    let (cos_2, sin_2) = (share(simd, (top - reach) * half), share(simd, (bottom + reach) * half));
    let (mid_cos, mid_sin) = (cos_1 * cos_2 - sin_1 * sin_2, sin_1 * cos_2 + cos_1 * sin_2);
    let half_tangent = (sin_2 * cos_1 - cos_2 * sin_1) / (1.0 + (cos_1 * cos_2 + sin_1 * sin_2));
    let square = half_tangent * half_tangent;
    // y = y_0 + y_1 cos + y_2 sin.
    let scale = 0.5 / pairs.radius_b;
    let squared = d.dot(d);
    let a_squared = pairs.radius_a * pairs.radius_a;
    let y_0 = (squared + a_squared - pairs.radius_b * pairs.radius_b - reach * reach) * scale;
    let ratio = 2.0 * pairs.radius_a * scale;
    let (y_1, y_2) = (ratio * along_e1, ratio * along_e2);
    let h = [
        h_0 + amplitude * mid_cos,
        -(2.0 * half_tangent * (amplitude * mid_sin)),
        square * (h_0 - amplitude * mid_cos),
    ];
    let sin_squared = frame.sin * frame.sin;
    let regular = sin_squared.simd_gt(Lanes::splat(simd, SIN_SQUARED_MIN));
    let y_mean = [y_0 + y_1 * mid_cos, square * (y_0 - y_1 * mid_cos)];
    let slope = 2.0 * half_tangent * (y_2 * mid_cos);
    let slope_mean = 2.0 * half_tangent * (y_1 * mid_sin);
    let across = y_2 * mid_sin;
    let side = Side { reach, square, h };
    let (plus, plus_keep) =
        side.quartic(simd, [y_mean[0] + across, slope - slope_mean, y_mean[1] - square * across]);
    // The other side, mirrored: y_2 and the middle's sine change their signs, and tau runs backwards.
    let (minus, minus_keep) =
        side.quartic(simd, [y_mean[0] - across, -slope - slope_mean, y_mean[1] + square * across]);
    let (plus_low, plus_rest) = rows(&plus, half_tangent, mid_cos, mid_sin);
    let (minus_low, minus_rest) = rows(&minus, half_tangent, mid_cos, -mid_sin);
    Sides {
        low: [plus_low, minus_low],
        rest: [plus_rest, minus_rest],
        keep: [plus_keep, minus_keep],
        irregular: !regular.to_bitmask() & ((1 << LANES) - 1),
    }
}

/// The root of a squared sine or cosine, which rounding, or a strip's edge off the circle, may have put out
/// of its range.
#[inline(always)]
fn share<S: Simd>(simd: S, squared: Lanes<S>) -> Lanes<S> {
    smaller(larger(squared, Lanes::splat(simd, 0.0)), Lanes::splat(simd, 1.0)).sqrt()
}

/// A chart for each lane.
#[inline(always)]
fn rows<S: Simd>(
    c: &[Lanes<S>; 5],
    half_tangent: Lanes<S>,
    mid_cos: Lanes<S>,
    mid_sin: Lanes<S>,
) -> ([Lanes<S>; LANES], [Lanes<S>; LANES]) {
    (transposed([c[0], c[1], c[2], c[3]]), transposed([c[4], half_tangent, mid_cos, mid_sin]))
}

struct Side<S: Simd> {
    reach: Lanes<S>,
    square: Lanes<S>,
    h: [Lanes<S>; 3],
}

impl<S: Simd> Side<S> {
    /// The quartic `y^2 + h^2 - reach^2`, times `(1 + tau^2)^2`, in powers of `u`, from `y` in powers of `u`;
    /// and the bits of the lanes in which it may be negative.
    #[inline(always)]
    fn quartic(&self, simd: S, y: [Lanes<S>; 3]) -> ([Lanes<S>; 5], u64) {
        let (h, square, reach) = (&self.h, self.square, self.reach);
        let reach_squared = reach * reach;
        let edge = square * reach_squared;
        let c = [
            y[0] * y[0] + h[0] * h[0] - reach_squared,
            2.0 * (y[0] * y[1] + h[0] * h[1]),
            (y[1] * y[1] + h[1] * h[1]) + 2.0 * ((y[0] * y[2] + h[0] * h[2]) - edge),
            2.0 * (y[1] * y[2] + h[1] * h[2]),
            y[2] * y[2] + h[2] * h[2] - square * edge,
        ];
        let zero = Lanes::splat(simd, 0.0);
        let [b_0, b_1, b_2, b_3, b_4] = bernstein(&c);
        let positive = (b_0.simd_gt(zero) & b_4.simd_gt(zero))
            & (b_1.simd_ge(zero) & b_3.simd_ge(zero))
            & b_2.simd_ge(zero);
        // y alone: all its Bernstein coefficients outside those of the reach.
        let (rim, middle) = (reach + reach * square, reach - reach * square);
        let (y_first, y_middle, y_last) = (y[0] + y[2] - y[1], y[0] - y[2], y[0] + y[2] + y[1]);
        let above = y_first.simd_gt(rim) & y_middle.simd_gt(middle) & y_last.simd_gt(rim);
        let below = (-y_first).simd_gt(rim) & (-y_middle).simd_gt(middle) & (-y_last).simd_gt(rim);
        (c, !(positive | above | below).to_bitmask())
    }
}

/// Bernstein coefficients on -1 <= u <= 1 of a quartic in powers of `u`.
#[inline(always)]
pub(super) fn bernstein<S: Simd>(c: &[Lanes<S>; 5]) -> [Lanes<S>; 5] {
    const THIRD: f64 = 1.0 / 3.0;
    let (even, odd) = (c[0] + c[2] + c[4], c[1] + c[3]);
    let (inner_even, inner_odd) = (c[0] - c[4], 0.5 * (c[1] - c[3]));
    [even - odd, inner_even - inner_odd, (c[0] + c[4]) - THIRD * c[2], inner_even + inner_odd, even + odd]
}

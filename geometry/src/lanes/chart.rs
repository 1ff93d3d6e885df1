//! The stretches of A between a strip's edges `|h| = reach`, or `|y| = reach`, and the quartic on each.
//!
//! At the edges of `h`'s strip the quartic is `y^2 (1 + tau^2)^2`, at those of `y`'s it is
//! `h^2 (1 + tau^2)^2`. Neither is negative, so that a contact shows as a dip between two positive ends.

use super::{Frames, LANES, Lanes, Line, PairLanes, Row, Simd, larger, rows_of, smaller};
use crate::each_lane;
use fearless_simd::prelude::*;

/// Planes nearer to parallel than this sine squared are irregular: there the frame loses digits, and arcs are
/// long. About 6 degrees.
const SIN_SQUARED_MIN: f64 = 0.01;

/// In which sense `u` runs on the two sides.
const SENSES: [f64; 2] = [1.0, -1.0];

/// A stretch of A on which there may be a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Chart {
    /// The quartic's coefficients of `u^0` to `u^3`; `u` runs from -1 to 1.
    pub low: [f64; 4],
    /// The coefficient of `u^4`, the scale, cosine and sine of the origin from `e1`.
    pub rest: [f64; 4],
    /// `tau = offset + scale u` is the tangent of half the angle from the origin.
    pub offset: f64,
    /// -1 where `u` runs against the angle, else 1.
    pub sense: f64,
    /// Number of its pair.
    pub pair: u32,
    /// How often it was cut.
    pub cuts: u32,
}

impl Chart {
    /// The parts with `u` below and above a place.
    pub(super) fn cut(&self, place: f64) -> [Chart; 2] {
        [(0.5 * (place - 1.0), 0.5 * (place + 1.0)), (0.5 * (place + 1.0), 0.5 * (1.0 - place))]
            .map(|(middle, half)| self.part(middle, half))
    }

    /// The part about a middle: Horner's scheme, again and again, gives Taylor's coefficients there.
    fn part(&self, middle: f64, half: f64) -> Chart {
        let [c_0, c_1, c_2, c_3] = self.low;
        let [c_4, scale, ..] = self.rest;
        let mut c = [c_0, c_1, c_2, c_3, c_4];
        for first in 0..4 {
            for i in (first..4).rev() {
                c[i] += middle * c[i + 1];
            }
        }
        let mut power = 1.0;
        for value in &mut c[1..] {
            power *= half;
            *value *= power;
        }
        let [c_0, c_1, c_2, c_3, c_4] = c;
        Chart {
            low: [c_0, c_1, c_2, c_3],
            rest: [c_4, scale * half, self.rest[2], self.rest[3]],
            offset: self.offset + scale * middle,
            cuts: self.cuts + 1,
            ..*self
        }
    }
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
        let numbers: [u32; LANES] = each_lane!(lane => number(lane));
        let eight = each_lane!(lane => pairs[numbers[lane] as usize]);
        let sides = sides(simd, &PairLanes::load(simd, lines, eight));
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
                (chart.offset, chart.sense) = (0.0, SENSES[side]);
                (chart.pair, chart.cuts) = (pair, 0);
                count += ((keep >> lane) & 1) as usize;
            }
        }
    }
    count
}

/// Both sides of the pairs: rows of charts, and bits of those that may touch.
struct Sides<S: Simd> {
    low: [[Row<S>; LANES]; 2],
    rest: [[Row<S>; LANES]; 2],
    keep: [u64; 2],
    irregular: u64,
}

#[inline(always)]
fn sides<S: Simd>(simd: S, pairs: &PairLanes<S>) -> Sides<S> {
    let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
    let reach = pairs.reach;
    let frame = Frames::of(pairs);
    let [along_e2, _, h_0] = frame.centre;
    let d = &pairs.from_b;
    let along_e1 = (h_0 - frame.cos * d.dot(&pairs.normal_a)) / frame.sin;
    let h_1 = pairs.radius_a * frame.sin;
    // y = y_0 + y_1 cos(t) + y_2 sin(t); h = h_0 + h_1 cos(t).
    let scale = 0.5 / pairs.radius_b;
    let a_squared = pairs.radius_a * pairs.radius_a;
    let y_0 = (d.dot(d) + a_squared - pairs.radius_b * pairs.radius_b - reach * reach) * scale;
    let ratio = 2.0 * pairs.radius_a * scale;
    let (y_1, y_2) = (ratio * along_e1, ratio * along_e2);
    // The quartic does not tell y from h. The strip is of the one that is not slower anywhere in its strip than
    // the other is somewhere in its own: that makes short charts whose ends are not in a contact. Angles are
    // counted from where that one is largest.
    let squared = y_1 * y_1 + y_2 * y_2;
    let (y_edge, h_edge) = (y_0.abs() + reach, h_0.abs() + reach);
    let by_y = (squared - y_edge * y_edge).simd_gt(h_1 * h_1 - h_edge * h_edge);
    let y_amplitude = squared.sqrt();
    let turn_cos = by_y.select(y_1 / y_amplitude, one);
    let turn_sin = by_y.select(y_2 / y_amplitude, zero);
    let (strip, amplitude) = (by_y.select(y_0, h_0), by_y.select(y_amplitude, h_1));
    let other =
        [by_y.select(h_0, y_0), by_y.select(h_1 * turn_cos, y_1), by_y.select(-(h_1 * turn_sin), y_2)];
    // The strip's edges as half angles, as in `ellipse`: t_1 where the wave is the reach, t_2 where it is minus
    // the reach; its own highest and lowest points where it does not get there.
    let half = 0.5 / amplitude;
    let (top, bottom) = (amplitude - strip, amplitude + strip);
    let (cos_1, sin_1) = (share(simd, (top + reach) * half), share(simd, (bottom - reach) * half));
    let (cos_2, sin_2) = (share(simd, (top - reach) * half), share(simd, (bottom + reach) * half));
    let (mid_cos, mid_sin) = (cos_1 * cos_2 - sin_1 * sin_2, sin_1 * cos_2 + cos_1 * sin_2);
    let half_tangent = (sin_2 * cos_1 - cos_2 * sin_1) / (1.0 + (cos_1 * cos_2 + sin_1 * sin_2));
    let square = half_tangent * half_tangent;
    let double = half_tangent + half_tangent;
    let strip = [
        strip + amplitude * mid_cos,
        -(double * (amplitude * mid_sin)),
        square * (strip - amplitude * mid_cos),
    ];
    // The other side is mirrored: the sine's part and the middle's sine change their signs, and tau runs
    // backwards.
    let mean = [other[0] + other[1] * mid_cos, square * (other[0] - other[1] * mid_cos)];
    let (slope, slope_mean) = (double * (other[2] * mid_cos), double * (other[1] * mid_sin));
    let across = other[2] * mid_sin;
    let side = Side { reach, square, strip };
    let (plus, plus_keep) =
        side.quartic(simd, [mean[0] + across, slope - slope_mean, mean[1] - square * across]);
    let (minus, minus_keep) =
        side.quartic(simd, [mean[0] - across, -slope - slope_mean, mean[1] + square * across]);
    let regular = (frame.sin * frame.sin).simd_gt(Lanes::splat(simd, SIN_SQUARED_MIN));
    // The middles from e1 again.
    let (x, y) = (mid_cos * turn_cos, mid_sin * turn_sin);
    let (z, w) = (mid_sin * turn_cos, mid_cos * turn_sin);
    let (plus_low, plus_rest) = rows(&plus, half_tangent, x - y, z + w);
    let (minus_low, minus_rest) = rows(&minus, half_tangent, x + y, w - z);
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
) -> ([Row<S>; LANES], [Row<S>; LANES]) {
    (rows_of([c[0], c[1], c[2], c[3]]), rows_of([c[4], half_tangent, mid_cos, mid_sin]))
}

struct Side<S: Simd> {
    reach: Lanes<S>,
    square: Lanes<S>,
    strip: [Lanes<S>; 3],
}

impl<S: Simd> Side<S> {
    /// The quartic `y^2 + h^2 - reach^2`, times `(1 + tau^2)^2`, in powers of `u`, from `y` in powers of `u`,
    /// where `h` is the wave with the strip and `y` the other one; and the bits of the lanes in which it may be
    /// negative.
    #[inline(always)]
    fn quartic(&self, simd: S, y: [Lanes<S>; 3]) -> ([Lanes<S>; 5], u64) {
        let (h, square, reach) = (&self.strip, self.square, self.reach);
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

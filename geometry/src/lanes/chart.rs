//! The stretches of A between a strip's edges `|h| = reach`, or `|y| = reach`, and the quartic on each.
//!
//! At the edges of `h`'s strip the quartic is `y^2 (1 + tau^2)^2`, at those of `y`'s it is
//! `h^2 (1 + tau^2)^2`. Neither is negative, so that a contact shows as a dip between two positive ends.

use super::store::{Charts, numbers_of};
use super::{Frames, LANES, Lanes, Line, Mask, PairLanes, Simd, larger, smaller};
use crate::each_lane;

/// Planes nearer to parallel than this sine squared are irregular: there the frame loses digits, and arcs are
/// long. About 6 degrees.
const SIN_SQUARED_MIN: f64 = 0.01;

/// The charts of some pairs, in two lists, each in the order of the pairs.
#[derive(Debug, Default)]
pub(super) struct ChartLists {
    /// Those with two sign changes of their Bernstein coefficients.
    pub simple: Charts,
    /// Those with four, whole or in parts.
    pub parts: Charts,
    suspects: Charts,
}

/// Finds the charts of pairs; the numbers of pairs outside the common case go to `irregular`.
#[inline(always)]
pub(super) fn charts<S: Simd>(
    simd: S,
    lines: &[Line],
    pairs: &[(u32, u32)],
    lists: &mut ChartLists,
    irregular: &mut Vec<u32>,
) {
    let ChartLists { simple, parts, suspects } = lists;
    for list in [&mut *simple, &mut *suspects] {
        list.clear();
        list.reserve(2 * (pairs.len() + LANES));
    }
    let mut numbers = [[[0.0; LANES]; 9]; 2];
    for (index, group) in pairs.chunks(LANES).enumerate() {
        let first = index * LANES;
        let pair = |lane: usize| if lane < group.len() { group[lane] } else { group[0] };
        let sides = sides(simd, &PairLanes::load(simd, lines, each_lane!(lane => pair(lane))));
        let here = (1u32 << group.len()) - 1;
        let odd = sides.irregular & here;
        if odd != 0 {
            irregular
                .extend((0..group.len()).filter(|lane| (odd >> lane) & 1 == 1).map(|n| (first + n) as u32));
        }
        let here = here & !odd;
        let keep = [sides.sides[0].keep & here, sides.sides[1].keep & here];
        if keep[0] | keep[1] == 0 {
            continue;
        }
        sides.sides[0].store(&sides, &mut numbers[0]);
        sides.sides[1].store(&sides, &mut numbers[1]);
        let four = [sides.sides[0].four_changes, sides.sides[1].four_changes];
        simple.put_sides(&numbers, [keep[0] & !four[0], keep[1] & !four[1]], first);
        suspects.put_sides(&numbers, [keep[0] & four[0], keep[1] & four[1]], first);
    }
    cut_all(simd, suspects, parts);
}

/// Numbers of one side of a group: all that a chart has, but offset and pair.
type SideNumbers = [[f64; LANES]; 9];

impl Charts {
    /// Puts charts of both sides of the pairs from `first` on.
    #[inline(always)]
    fn put_sides(&mut self, numbers: &[SideNumbers; 2], keep: [u32; 2], first: usize) {
        let mut keep = spread(keep[0]) | (spread(keep[1]) << 1);
        while keep != 0 {
            let slot = keep.trailing_zeros() as usize;
            keep &= keep - 1;
            let (lane, of) = ((slot / 2) % LANES, &numbers[slot % 2]);
            self.put([
                of[0][lane],
                of[1][lane],
                of[2][lane],
                of[3][lane],
                of[4][lane],
                of[5][lane],
                0.0,
                of[6][lane],
                of[7][lane],
                (first + lane) as f64,
                of[8][lane],
            ]);
        }
    }
}

/// Cuts the charts that rise above 0 between two minima and drops parts that cannot be negative.
#[inline(always)]
fn cut_all<S: Simd>(simd: S, suspects: &Charts, parts: &mut Charts) {
    parts.clear();
    parts.reserve(2 * suspects.len() + LANES);
    let mut halves = [[[0.0; LANES]; 7]; 2];
    for (block, filled) in suspects.blocks() {
        let c = [
            Lanes::load_array_ref(simd, &block[0]),
            Lanes::load_array_ref(simd, &block[1]),
            Lanes::load_array_ref(simd, &block[2]),
            Lanes::load_array_ref(simd, &block[3]),
            Lanes::load_array_ref(simd, &block[4]),
        ];
        let scale = Lanes::load_array_ref(simd, &block[5]);
        let (cut, place) = cuts(simd, &c);
        let cut = cut.to_bitmask();
        let (middle, half) = (0.5 * (place - 1.0), 0.5 * (place + 1.0));
        let lower = part(simd, &c, middle, half);
        store(&mut halves[0], &lower.0, scale * half, scale * middle);
        let (middle, half) = (0.5 * (place + 1.0), 0.5 * (1.0 - place));
        let upper = part(simd, &c, middle, half);
        store(&mut halves[1], &upper.0, scale * half, scale * middle);
        let here = (1u32 << filled) - 1;
        let mut keep = spread(!cut & here | lower.1 & here) | (spread(cut & upper.1 & here) << 1);
        while keep != 0 {
            let slot = keep.trailing_zeros() as usize;
            keep &= keep - 1;
            let (lane, half) = ((slot / 2) % LANES, &halves[slot % 2]);
            let mut numbers = numbers_of(block, lane);
            if (cut >> lane) & 1 == 1 {
                for (number, half) in numbers.iter_mut().zip(half) {
                    *number = half[lane];
                }
            }
            parts.put(numbers);
        }
    }
}

/// Appends the pairs that have a chart, with wires that are thicker by the margin, or that are irregular.
#[inline(always)]
pub(super) fn touchable<S: Simd>(
    simd: S,
    lines: &[Line],
    pairs: &[(u32, u32)],
    margin: f64,
    near: &mut Vec<(u32, u32)>,
) {
    for group in pairs.chunks(LANES) {
        let pair = |lane: usize| if lane < group.len() { group[lane] } else { group[0] };
        let mut loaded = PairLanes::load(simd, lines, each_lane!(lane => pair(lane)));
        loaded.reach += margin;
        // With wires thicker than B's hole the quartic is positive in the middle of the contact, too.
        let thick = (!loaded.reach.simd_lt(loaded.radius_b)).to_bitmask();
        let sides = sides(simd, &loaded);
        let keep = sides.sides[0].keep | sides.sides[1].keep | sides.irregular | thick;
        near.extend((0..group.len()).filter(|lane| (keep >> lane) & 1 == 1).map(|lane| group[lane]));
    }
}

/// Sixteen bits, each the lowest of two.
#[inline(always)]
fn spread(bits: u32) -> u32 {
    let bits = (bits | (bits << 8)) & 0x00FF_00FF;
    let bits = (bits | (bits << 4)) & 0x0F0F_0F0F;
    let bits = (bits | (bits << 2)) & 0x3333_3333;
    (bits | (bits << 1)) & 0x5555_5555
}

/// Both sides of the pairs.
struct Sides<S: Simd> {
    sides: [Side<S>; 2],
    half_tangent: Lanes<S>,
    radius_over_reach: Lanes<S>,
    irregular: u32,
}

/// One side of the pairs: the quartic, whether it may be negative and has four sign changes, and where it is counted
/// from.
struct Side<S: Simd> {
    c: [Lanes<S>; 5],
    keep: u32,
    four_changes: u32,
    origin: [Lanes<S>; 2],
}

impl<S: Simd> Side<S> {
    #[inline(always)]
    fn store(&self, of: &Sides<S>, numbers: &mut SideNumbers) {
        self.c[0].store_array(&mut numbers[0]);
        self.c[1].store_array(&mut numbers[1]);
        self.c[2].store_array(&mut numbers[2]);
        self.c[3].store_array(&mut numbers[3]);
        self.c[4].store_array(&mut numbers[4]);
        of.half_tangent.store_array(&mut numbers[5]);
        self.origin[0].store_array(&mut numbers[6]);
        self.origin[1].store_array(&mut numbers[7]);
        of.radius_over_reach.store_array(&mut numbers[8]);
    }
}

#[inline(always)]
fn store<S: Simd>(numbers: &mut [[f64; LANES]; 7], c: &[Lanes<S>; 5], scale: Lanes<S>, offset: Lanes<S>) {
    c[0].store_array(&mut numbers[0]);
    c[1].store_array(&mut numbers[1]);
    c[2].store_array(&mut numbers[2]);
    c[3].store_array(&mut numbers[3]);
    c[4].store_array(&mut numbers[4]);
    scale.store_array(&mut numbers[5]);
    offset.store_array(&mut numbers[6]);
}

/// Which charts are to be cut, and where: positive between two minima, as four sign changes of the Bernstein
/// coefficients let one suspect.
#[inline(always)]
fn cuts<S: Simd>(simd: S, c: &[Lanes<S>; 5]) -> (Mask<S>, Lanes<S>) {
    let (zero, half) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 0.5));
    let b = bernstein(c);
    let ends = b[0].simd_gt(zero) & b[4].simd_gt(zero);
    let four_changes = ends & b[1].simd_lt(zero) & b[3].simd_lt(zero) & b[2].simd_gt(zero);
    // Where the quartic bends upwards least; if it bends downwards there, it has a maximum near it.
    let centre = within(-0.25 * c[3] / c[4], half);
    let (step, bend) = newton(c, centre);
    let top = within(centre - step, half);
    let on_top = bend.simd_lt(zero) & value(c, top).simd_gt(zero);
    let place = on_top.select(top, centre);
    (four_changes & (on_top | value(c, centre).simd_gt(zero)), place)
}

#[inline(always)]
fn value<S: Simd>(c: &[Lanes<S>; 5], u: Lanes<S>) -> Lanes<S> {
    c[0] + u * (c[1] + u * (c[2] + u * (c[3] + u * c[4])))
}

/// A part of charts, as [`Chart::part`] has it; and the bits of the lanes in which it may be negative.
#[inline(always)]
fn part<S: Simd>(simd: S, c: &[Lanes<S>; 5], middle: Lanes<S>, half: Lanes<S>) -> ([Lanes<S>; 5], u32) {
    let c_3 = c[3] + middle * c[4];
    let c_2 = c[2] + middle * c_3;
    let c_1 = c[1] + middle * c_2;
    let c_0 = c[0] + middle * c_1;
    let d_3 = c_3 + middle * c[4];
    let d_2 = c_2 + middle * d_3;
    let d_1 = c_1 + middle * d_2;
    let e_3 = d_3 + middle * c[4];
    let e_2 = d_2 + middle * e_3;
    let f_3 = e_3 + middle * c[4];
    let squared = half * half;
    let cubed = squared * half;
    let part = [c_0, d_1 * half, e_2 * squared, f_3 * cubed, c[4] * (cubed * half)];
    let b = bernstein(&part);
    let least = smaller(smaller(smaller(b[0], b[1]), smaller(b[3], b[4])), b[2]);
    (part, (!least.simd_ge(Lanes::splat(simd, 0.0))).to_bitmask())
}

/// Newton's step towards a zero of the slope (to be subtracted), and the second derivative.
#[inline(always)]
pub(super) fn newton<S: Simd>(c: &[Lanes<S>; 5], u: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
    let slope = c[1] + u * (2.0 * c[2] + u * (3.0 * c[3] + u * (4.0 * c[4])));
    let bend = 2.0 * c[2] + u * (6.0 * c[3] + u * (12.0 * c[4]));
    (slope / bend, bend)
}

/// The number, brought between `-limit` and `limit`.
#[inline(always)]
pub(super) fn within<S: Simd>(x: Lanes<S>, limit: Lanes<S>) -> Lanes<S> {
    larger(smaller(x, limit), -limit)
}

#[inline(always)]
fn sides<S: Simd>(simd: S, pairs: &PairLanes<S>) -> Sides<S> {
    let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
    let reach = pairs.reach;
    let frame = Frames::of(pairs);
    let [along_e2, _, h_0] = frame.centre;
    let d = &pairs.from_b;
    let along_e1 = (h_0 - frame.cos * d.dot(&pairs.normal_a)) * frame.inverse_sin;
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
    let (strip, amplitude) = (by_y.select(y_0, h_0), by_y.select(y_amplitude, h_1));
    let inverse = 1.0 / amplitude;
    let turn_cos = by_y.select(y_1 * inverse, one);
    let turn_sin = by_y.select(y_2 * inverse, zero);
    let other =
        [by_y.select(h_0, y_0), by_y.select(h_1 * turn_cos, y_1), by_y.select(-(h_1 * turn_sin), y_2)];
    // The strip's edges as half angles, as in `ellipse`: t_1 where the wave is the reach, t_2 where it is minus
    // the reach; its own highest and lowest points where it does not get there.
    let half = 0.5 * inverse;
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
    let quartic = Quartic { reach, square, strip };
    let plus = quartic.along(simd, [mean[0] + across, slope - slope_mean, mean[1] - square * across]);
    let minus = quartic.along(simd, [mean[0] - across, -slope - slope_mean, mean[1] + square * across]);
    let regular = (frame.sin * frame.sin).simd_gt(Lanes::splat(simd, SIN_SQUARED_MIN));
    // The middles from e1 again.
    let (x, y) = (mid_cos * turn_cos, mid_sin * turn_sin);
    let (z, w) = (mid_sin * turn_cos, mid_cos * turn_sin);
    // On the mirrored side u runs against the angle, unless it changes its sign.
    let [c_0, c_1, c_2, c_3, c_4] = minus.c;
    Sides {
        sides: [
            Side { c: plus.c, keep: plus.keep, four_changes: plus.four_changes, origin: [x - y, z + w] },
            Side {
                c: [c_0, -c_1, c_2, -c_3, c_4],
                keep: minus.keep,
                four_changes: minus.four_changes,
                origin: [x + y, w - z],
            },
        ],
        half_tangent,
        radius_over_reach: pairs.radius_a / reach,
        irregular: (!regular).to_bitmask(),
    }
}

/// The root of a squared sine or cosine, which rounding, or a strip's edge off the circle, may have put out
/// of its range.
#[inline(always)]
fn share<S: Simd>(simd: S, squared: Lanes<S>) -> Lanes<S> {
    smaller(larger(squared, Lanes::splat(simd, 0.0)), Lanes::splat(simd, 1.0)).sqrt()
}

/// What the quartics of both sides share.
struct Quartic<S: Simd> {
    reach: Lanes<S>,
    square: Lanes<S>,
    strip: [Lanes<S>; 3],
}

/// A side's quartic.
struct Along<S: Simd> {
    c: [Lanes<S>; 5],
    keep: u32,
    four_changes: u32,
}

impl<S: Simd> Quartic<S> {
    /// The quartic `y^2 + h^2 - reach^2`, times `(1 + tau^2)^2`, in powers of `u`, from `y` in powers of `u`,
    /// where `h` is the wave with the strip and `y` the other one; and the bits of the lanes in which it may be
    /// negative, and has four sign changes of its Bernstein coefficients.
    #[inline(always)]
    fn along(&self, simd: S, y: [Lanes<S>; 3]) -> Along<S> {
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
        let four_changes = b_1.simd_lt(zero) & b_3.simd_lt(zero) & b_2.simd_gt(zero);
        Along { c, keep: (!(positive | above | below)).to_bitmask(), four_changes: four_changes.to_bitmask() }
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

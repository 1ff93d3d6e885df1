//! The stretches of A between a strip's edges `|h| = reach`, or `|y| = reach`, and the quartic on each.
//!
//! At the edges of `h`'s strip the quartic is `y^2 (1 + tau^2)^2`, at those of `y`'s it is
//! `h^2 (1 + tau^2)^2`. Neither is negative, so that a contact shows as a dip between two positive ends.

use super::{Frames, LANES, Lanes, Line, Mask, PairLanes, Simd, larger, smaller};
use crate::each_lane;

/// Planes nearer to parallel than this sine squared are irregular: there the frame loses digits, and arcs are
/// long. About 6 degrees.
const SIN_SQUARED_MIN: f64 = 0.01;

/// In which sense `u` runs on the two sides.
const SENSES: [f64; 2] = [1.0, -1.0];

/// A stretch of A on which there may be a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chart {
    /// The quartic's coefficients of `u^0` to `u^4`; `u` runs from -1 to 1.
    pub c: [f64; 5],
    /// `tau = offset + scale u` is the tangent of half the angle from the origin.
    pub scale: f64,
    pub offset: f64,
    /// Cosine and sine of the origin from `e1`.
    pub mid_cos: f64,
    pub mid_sin: f64,
    /// -1 where `u` runs against the angle, else 1.
    pub sense: f64,
    /// Number of its pair.
    pub pair: f64,
    /// How often it was cut.
    pub cuts: f64,
}

impl Chart {
    /// The parts with `u` below and above a place.
    pub(super) fn cut(&self, place: f64) -> [Chart; 2] {
        [(0.5 * (place - 1.0), 0.5 * (place + 1.0)), (0.5 * (place + 1.0), 0.5 * (1.0 - place))]
            .map(|(middle, half)| self.part(middle, half))
    }

    /// The part about a middle: Horner's scheme, again and again, gives Taylor's coefficients there.
    fn part(&self, middle: f64, half: f64) -> Chart {
        let mut c = self.c;
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
        Chart {
            c,
            scale: self.scale * half,
            offset: self.offset + self.scale * middle,
            cuts: self.cuts + 1.0,
            ..*self
        }
    }
}

/// Numbers of a chart as they lie in a block.
const NUMBERS: usize = 12;

/// Charts side by side, number by number.
pub(super) type Block = [[f64; LANES]; NUMBERS];

/// Charts side by side, in blocks. The last block's rest has numbers without meaning.
#[derive(Debug, Default)]
pub(super) struct Charts {
    blocks: Vec<Block>,
    count: usize,
}

impl Charts {
    #[inline]
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    #[inline]
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// The blocks, each with how many charts it has.
    #[inline(always)]
    pub(super) fn blocks(&self) -> impl Iterator<Item = (&Block, usize)> {
        let count = self.count;
        let fill = move |first: usize| if count - first < LANES { count - first } else { LANES };
        self.blocks[..count.div_ceil(LANES)]
            .iter()
            .enumerate()
            .map(move |(index, block)| (block, fill(index * LANES)))
    }

    /// Makes room for that many more charts.
    #[inline(always)]
    fn reserve(&mut self, more: usize) {
        let blocks = (self.count + more).div_ceil(LANES);
        if self.blocks.len() < blocks {
            self.blocks.resize(blocks, [[0.0; LANES]; NUMBERS]);
        }
    }

    #[inline(always)]
    fn put(&mut self, numbers: [f64; NUMBERS]) {
        let block = &mut self.blocks[self.count / LANES];
        let lane = self.count % LANES;
        for (column, number) in block.iter_mut().zip(numbers) {
            column[lane] = number;
        }
        self.count += 1;
    }

    #[inline(always)]
    fn put_block(&mut self, block: &Block, filled: usize) {
        if self.count.is_multiple_of(LANES) {
            self.blocks[self.count / LANES] = *block;
            self.count += filled;
            return;
        }
        for lane in 0..filled {
            self.put(numbers_of(block, lane));
        }
    }

    /// Puts the sides that may touch of the pairs from `first` on that are `here`.
    #[inline(always)]
    fn put_sides<S: Simd>(&mut self, sides: &Sides<S>, first: usize, here: u32) {
        let [one, other] = &sides.sides;
        let mut keep = spread(one.keep & here) | (spread(other.keep & here) << 1);
        if keep == 0 {
            return;
        }
        let mut numbers = [[[0.0; LANES]; 8]; 2];
        for (numbers, side) in numbers.iter_mut().zip(&sides.sides) {
            side.c[0].store_array(&mut numbers[0]);
            side.c[1].store_array(&mut numbers[1]);
            side.c[2].store_array(&mut numbers[2]);
            side.c[3].store_array(&mut numbers[3]);
            side.c[4].store_array(&mut numbers[4]);
            side.half_tangent.store_array(&mut numbers[5]);
            side.origin[0].store_array(&mut numbers[6]);
            side.origin[1].store_array(&mut numbers[7]);
        }
        while keep != 0 {
            let slot = keep.trailing_zeros() as usize;
            keep &= keep - 1;
            let (lane, side) = ((slot / 2) % LANES, slot % 2);
            let of = &numbers[side];
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
                SENSES[side],
                (first + lane) as f64,
                0.0,
            ]);
        }
    }

    pub(super) fn push(&mut self, chart: &Chart) {
        let Chart { c: [c_0, c_1, c_2, c_3, c_4], scale, offset, mid_cos, mid_sin, sense, pair, cuts } = *chart;
        self.reserve(1);
        self.put([c_0, c_1, c_2, c_3, c_4, scale, offset, mid_cos, mid_sin, sense, pair, cuts]);
    }
}

/// A chart of a block.
pub(super) fn chart_of(block: &Block, lane: usize) -> Chart {
    let [c_0, c_1, c_2, c_3, c_4, scale, offset, mid_cos, mid_sin, sense, pair, cuts] = numbers_of(block, lane);
    Chart { c: [c_0, c_1, c_2, c_3, c_4], scale, offset, mid_cos, mid_sin, sense, pair, cuts }
}

#[inline(always)]
fn numbers_of(block: &Block, lane: usize) -> [f64; NUMBERS] {
    let mut numbers = [0.0; NUMBERS];
    for (number, column) in numbers.iter_mut().zip(block) {
        *number = column[lane];
    }
    numbers
}

/// Writes the charts of pairs, in order; the numbers of pairs outside the common case go to `irregular`. `whole` is
/// memory.
#[inline(always)]
pub(super) fn charts<S: Simd>(
    simd: S,
    lines: &[Line],
    pairs: &[(u32, u32)],
    whole: &mut Charts,
    charts: &mut Charts,
    irregular: &mut Vec<u32>,
) {
    whole.clear();
    whole.reserve(2 * (pairs.len() + LANES));
    for (index, group) in pairs.chunks(LANES).enumerate() {
        let first = index * LANES;
        let pair = |lane: usize| if lane < group.len() { group[lane] } else { group[0] };
        let here = (1u32 << group.len()) - 1;
        let sides = sides(simd, &PairLanes::load(simd, lines, each_lane!(lane => pair(lane))));
        let odd = sides.irregular & here;
        if odd != 0 {
            irregular.extend((0..group.len()).filter(|lane| (odd >> lane) & 1 == 1).map(|n| (first + n) as u32));
        }
        let here = here & !odd;
        whole.put_sides(&sides, first, here);
    }
    cut_all(simd, whole, charts);
}

/// Cuts the charts that rise above 0 between two minima and drops parts that cannot be negative.
#[inline(always)]
fn cut_all<S: Simd>(simd: S, whole: &Charts, charts: &mut Charts) {
    charts.clear();
    charts.reserve(2 * whole.len() + LANES);
    for (block, filled) in whole.blocks() {
        let here = (1u32 << filled) - 1;
        let c = [
            Lanes::load_array_ref(simd, &block[0]),
            Lanes::load_array_ref(simd, &block[1]),
            Lanes::load_array_ref(simd, &block[2]),
            Lanes::load_array_ref(simd, &block[3]),
            Lanes::load_array_ref(simd, &block[4]),
        ];
        let (cut, place) = cuts(simd, &c);
        let cut = cut.to_bitmask() & here;
        if cut == 0 {
            charts.put_block(block, filled);
            continue;
        }
        let scale = Lanes::load_array_ref(simd, &block[5]);
        let mut parts = [[[0.0; LANES]; 7]; 2];
        let ends = [(0.5 * (place - 1.0), 0.5 * (place + 1.0)), (0.5 * (place + 1.0), 0.5 * (1.0 - place))];
        let mut keep = [0; 2];
        for ((numbers, keep), (middle, half)) in parts.iter_mut().zip(&mut keep).zip(ends) {
            let (part, bits) = part(simd, &c, middle, half);
            store(numbers, &part, scale * half, scale * middle);
            *keep = bits;
        }
        for lane in 0..filled {
            let numbers = numbers_of(block, lane);
            if (cut >> lane) & 1 == 0 {
                charts.put(numbers);
                continue;
            }
            for (part, keep) in parts.iter().zip(keep) {
                if (keep >> lane) & 1 == 1 {
                    let [.., mid_cos, mid_sin, sense, pair, _] = numbers;
                    charts.put([
                        part[0][lane],
                        part[1][lane],
                        part[2][lane],
                        part[3][lane],
                        part[4][lane],
                        part[5][lane],
                        part[6][lane],
                        mid_cos,
                        mid_sin,
                        sense,
                        pair,
                        1.0,
                    ]);
                }
            }
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
    irregular: u32,
}

/// One side of the pairs: the quartic, whether it may be negative, and where it is counted from.
struct Side<S: Simd> {
    c: [Lanes<S>; 5],
    keep: u32,
    half_tangent: Lanes<S>,
    origin: [Lanes<S>; 2],
}

#[inline(always)]
fn store<S: Simd>(
    numbers: &mut [[f64; LANES]; 7],
    c: &[Lanes<S>; 5],
    scale: Lanes<S>,
    offset: Lanes<S>,
) {
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
    let (plus, plus_keep) =
        quartic.along(simd, [mean[0] + across, slope - slope_mean, mean[1] - square * across]);
    let (minus, minus_keep) =
        quartic.along(simd, [mean[0] - across, -slope - slope_mean, mean[1] + square * across]);
    let regular = (frame.sin * frame.sin).simd_gt(Lanes::splat(simd, SIN_SQUARED_MIN));
    // The middles from e1 again.
    let (x, y) = (mid_cos * turn_cos, mid_sin * turn_sin);
    let (z, w) = (mid_sin * turn_cos, mid_cos * turn_sin);
    Sides {
        sides: [
            Side { c: plus, keep: plus_keep, half_tangent, origin: [x - y, z + w] },
            Side { c: minus, keep: minus_keep, half_tangent, origin: [x + y, w - z] },
        ],
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

impl<S: Simd> Quartic<S> {
    /// The quartic `y^2 + h^2 - reach^2`, times `(1 + tau^2)^2`, in powers of `u`, from `y` in powers of `u`,
    /// where `h` is the wave with the strip and `y` the other one; and the bits of the lanes in which it may be
    /// negative.
    #[inline(always)]
    fn along(&self, simd: S, y: [Lanes<S>; 3]) -> ([Lanes<S>; 5], u32) {
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
        (c, (!(positive | above | below)).to_bitmask())
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

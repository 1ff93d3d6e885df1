//! The two ends of a contact arc: the quartic's minimum, and from there its roots on both sides.
//!
//! # Certificate
//! The quartic is positive at both ends of a chart. With two sign changes of its Bernstein coefficients it has
//! two roots or none. Where its value at the minimum `m` is negative, each side of `m` holds an odd number of
//! roots, so exactly one. Where it is positive, no sign change in the parts on both sides of `m` proves that
//! there is none. Four sign changes are common too: where A bends away from B's wire as fast as it runs across
//! it, the depth is flat and may have two maxima. There `m` is chosen between them; one sign change on each side
//! proves one root on each. So does a quartic that is negative wherever it bends downwards: outside that piece it bends
//! upwards on both sides, from a positive end to a negative one ([`in_one_piece`]).
//!
//! A chart that is positive at `m` and not proved empty is cut there, and its parts are looked at again.
//! Everything else (an end inside a contact, an arc longer than a quarter turn, an iteration that has not
//! converged, too many cuts) is irregular.
//!
//! # Accuracy
//! Halley's method has the error `step^3 / (2 d)^2` after a step, with `d` the distance to the other root,
//! here about the arc's length `2 w`. With a last step below `w / 1024` that is `6e-11 w`. The depth vanishes at
//! the ends, so the force of an arc changes by the square of that: less than rounding.

use super::chart::{ChartLists, bernstein, newton, within};
use super::store::{Block, Charts, chart_of};
use super::{LANES, LaneArc, Lanes, Mask, Row, Simd, larger, rows_of, smaller};
use crate::arc::{HALF_TANGENT_MAX, RULE_LENGTHS};
use fearless_simd::prelude::*;

/// Newton steps to the minimum from the lowest of some places.
const MINIMUM_STEPS: usize = 1;
/// A chart that was cut so often is left alone.
const CUTS_MAX: usize = 5;
/// Halley steps to the roots without a look, and at most.
const ROOT_STEPS: [usize; 2] = [3, 24];
/// The last step, in half widths of the arc.
const STEP_MAX: f64 = 1.0 / 1024.0;
/// Value times half the second derivative, over the slope squared: about the distance to the root over twice that
/// to the next one. Above this a step says nothing.
const STEEP: f64 = 1.0 / 64.0;
/// The search for the minimum stays this far from the ends.
const INNER: f64 = 1.0 - 1.0 / 16.0;

/// With two maxima of the depth the place between them is at most this far from the middle.
const CENTRE: f64 = 0.5;
/// More than what rounding does to a product of a few factors.
const ROUNDING: f64 = 1e-9;

/// Finds the arcs of the charts, each list in the order of its pairs; the numbers of pairs with a chart outside the
/// common case go to `irregular`. `cuts` is memory.
#[inline(always)]
pub(super) fn isolate<S: Simd>(
    simd: S,
    charts: &ChartLists,
    cuts: &mut [Charts; 2],
    arcs: &mut [Vec<LaneArc>; 4],
    irregular: &mut Vec<u32>,
) {
    let [parts, next] = cuts;
    let [simple, of_parts, late, found] = arcs;
    parts.clear();
    isolate_all(simd, &charts.simple, parts, simple, irregular);
    isolate_all(simd, &charts.parts, parts, of_parts, irregular);
    late.clear();
    for _ in 0..CUTS_MAX {
        if parts.is_empty() {
            return;
        }
        next.clear();
        isolate_all(simd, parts, next, found, irregular);
        late.append(found);
        core::mem::swap(parts, next);
    }
    for (block, filled) in parts.blocks() {
        irregular.extend((0..filled).map(|lane| chart_of(block, lane).pair as u32));
    }
}

#[inline(always)]
fn isolate_all<S: Simd>(
    simd: S,
    charts: &Charts,
    parts: &mut Charts,
    arcs: &mut Vec<LaneArc>,
    irregular: &mut Vec<u32>,
) {
    let mut count = 0;
    if arcs.len() < charts.len() + LANES {
        arcs.resize(charts.len() + LANES, LaneArc::default());
    }
    let room = arcs.as_mut_slice();
    let mut places = [0.0; LANES];
    for (block, filled) in charts.blocks() {
        let here = (1u32 << filled) - 1;
        let found = ends(simd, block, here);
        let odd = !(found.touching | found.empty) & here;
        if odd != 0 {
            found.place.store_array(&mut places);
            for (lane, place) in places.iter().enumerate().filter(|(lane, _)| (odd >> lane) & 1 == 1) {
                let chart = chart_of(block, lane);
                if (found.open >> lane) & 1 == 1 {
                    chart.cut(*place).iter().for_each(|part| parts.push(part));
                } else {
                    irregular.push(chart.pair as u32);
                }
            }
        }
        let keep = found.touching & here;
        for (lane, row) in found.arcs.iter().enumerate() {
            row.store_array(&mut room[count].numbers);
            count += ((keep >> lane) & 1) as usize;
        }
    }
    arcs.truncate(count);
}

struct Found<S: Simd> {
    /// Rows of arcs.
    arcs: [Row<S>; LANES],
    touching: u32,
    empty: u32,
    /// Positive at both ends and at `place`: may be cut there.
    open: u32,
    place: Lanes<S>,
}

#[inline(always)]
fn ends<S: Simd>(simd: S, block: &Block, here: u32) -> Found<S> {
    let c = [
        number(simd, block, 0),
        number(simd, block, 1),
        number(simd, block, 2),
        number(simd, block, 3),
        number(simd, block, 4),
    ];
    let zero = Lanes::splat(simd, 0.0);
    let one = Lanes::splat(simd, 1.0);
    let b = bernstein(&c);
    let ends_outside = b[0].simd_gt(zero) & b[4].simd_gt(zero);
    // With both ends positive the only list with four changes is + - + - +.
    let four_changes = b[1].simd_lt(zero) & b[3].simd_lt(zero) & b[2].simd_gt(zero);

    let m = middle(simd, &c, four_changes);
    let (lowest, slope, half_bend) = taylor(&c, m);
    let negative = lowest.simd_lt(zero);
    let (no_root, one_root) = certify(&b, m, zero);
    let whole = in_one_piece(simd, m, [lowest, slope, half_bend], c[4]);
    let certain = ends_outside & negative & (!four_changes | one_root | whole);

    // To start with, the roots of the quartic less its odd part about its minimum.
    let shift = four_changes.select(zero, 0.5 * slope / half_bend);
    let depth = lowest - 0.5 * slope * shift;
    let root = larger(half_bend * half_bend - 4.0 * (c[4] * depth), zero).sqrt();
    let width = larger(-2.0 * depth / (half_bend + root), zero).sqrt();
    let low = Bracket { from: -one, to: m, x: m - shift - width, done: !certain };
    let high = Bracket { from: one, to: m, x: m - shift + width, done: !certain };
    let [low, high] = roots(simd, &c, [low, high], here);
    let converged = low.done & high.done;
    let (low, high) = (low.x, high.x);

    // The arc from `start` to `end` as in `Arc::between`.
    let (scale, offset) = (number(simd, block, 5), number(simd, block, 6));
    let (mid_cos, mid_sin) = (number(simd, block, 7), number(simd, block, 8));
    let (start, end) = (offset + scale * low, offset + scale * high);
    let norm = ((1.0 + start * start) * (1.0 + end * end)).sqrt();
    let apart = norm + (1.0 + start * end);
    // One division for both `norm` and `apart`.
    let inverse = 1.0 / (norm * apart);
    let (cos, sin) = ((1.0 - start * end) * (apart * inverse), (start + end) * (apart * inverse));
    let arc_cos = mid_cos * cos - mid_sin * sin;
    let arc_sin = mid_sin * cos + mid_cos * sin;
    let arc_tangent = (end - start) * (norm * inverse);
    let short = arc_tangent.simd_le(Lanes::splat(simd, HALF_TANGENT_MAX));

    let length = 2.0 * arc_tangent * number(simd, block, 10);
    // As in `arc::rule_for`.
    let [four, six, eight] = RULE_LENGTHS;
    let rule = (length.simd_lt(Lanes::splat(simd, four)).select(zero, one)
        + length.simd_lt(Lanes::splat(simd, six)).select(zero, one))
        + length.simd_lt(Lanes::splat(simd, eight)).select(zero, one);
    let positive = ends_outside & lowest.simd_gt(zero);
    Found {
        arcs: rows_of([arc_cos, arc_sin, arc_tangent, 4.0 * number(simd, block, 9) + rule]),
        touching: (certain & converged & short).to_bitmask(),
        empty: (positive & no_root).to_bitmask(),
        open: positive.to_bitmask(),
        place: m,
    }
}

/// One number of all charts of a block.
#[inline(always)]
fn number<S: Simd>(simd: S, block: &Block, number: usize) -> Lanes<S> {
    Lanes::load_array_ref(simd, &block[number])
}

/// The minimum; or, where four sign changes tell that there may be two, a place between them.
#[inline(always)]
fn middle<S: Simd>(simd: S, c: &[Lanes<S>; 5], four_changes: Mask<S>) -> Lanes<S> {
    let zero = Lanes::splat(simd, 0.0);
    let inner = Lanes::splat(simd, INNER);
    // The lowest of seven places is near enough for Newton's method.
    let (mut lowest, mut place) = (c[0], zero);
    for u in [0.25, 0.5, 0.75] {
        let (even, odd) = (c[0] + (u * u) * (c[2] + (u * u) * c[4]), u * (c[1] + (u * u) * c[3]));
        let value = even - odd.abs();
        let side = odd.simd_gt(zero).select(Lanes::splat(simd, -u), Lanes::splat(simd, u));
        let lower = value.simd_lt(lowest);
        place = lower.select(side, place);
        lowest = lower.select(value, lowest);
    }
    for _ in 0..MINIMUM_STEPS {
        let (step, bend) = newton(c, place);
        place = bend.simd_gt(zero).select(within(place - step, inner), place);
    }
    // Where the quartic bends upwards least.
    let centre = within(-0.25 * c[3] / c[4], Lanes::splat(simd, CENTRE));
    four_changes.select(centre, place)
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

/// A root between `from`, where the quartic is positive, and `to`, where it is negative.
#[derive(Clone, Copy)]
struct Bracket<S: Simd> {
    from: Lanes<S>,
    to: Lanes<S>,
    x: Lanes<S>,
    /// Found, or not looked for.
    done: Mask<S>,
}

/// Halley's method for both roots side by side. A lane stands still when it is done, so that it does not
/// matter which others it runs with.
#[inline(always)]
fn roots<S: Simd>(simd: S, c: &[Lanes<S>; 5], mut brackets: [Bracket<S>; 2], here: u32) -> [Bracket<S>; 2] {
    for bracket in &mut brackets {
        bracket.x = bracket.inside(bracket.x);
    }
    // A few steps do for most: no look at them, so that blocks can overlap.
    for _ in 0..ROOT_STEPS[0] {
        brackets = both_stepped(simd, c, brackets);
    }
    for _ in ROOT_STEPS[0]..ROOT_STEPS[1] {
        if !(brackets[0].done & brackets[1].done).to_bitmask() & here == 0 {
            break;
        }
        brackets = both_stepped(simd, c, brackets);
    }
    brackets
}

/// A step of Halley's method on both sides.
#[inline(always)]
fn both_stepped<S: Simd>(simd: S, c: &[Lanes<S>; 5], brackets: [Bracket<S>; 2]) -> [Bracket<S>; 2] {
    let [mut low, mut high] = brackets;
    let small = (high.x - low.x).abs() * (0.5 * STEP_MAX);
    let (below, above) = (Look::at(c, low.x), Look::at(c, high.x));
    // One division for both.
    let inverse = 1.0 / (below.denominator * above.denominator);
    low.step(simd, &below, below.numerator * (above.denominator * inverse), small);
    high.step(simd, &above, above.numerator * (below.denominator * inverse), small);
    [low, high]
}

/// The quartic at a place, and Halley's step from there: numerator over denominator, to be subtracted.
struct Look<S: Simd> {
    value: Lanes<S>,
    /// Value times half the second derivative, and the slope squared.
    bend: Lanes<S>,
    squared: Lanes<S>,
    numerator: Lanes<S>,
    denominator: Lanes<S>,
}

impl<S: Simd> Look<S> {
    #[inline(always)]
    fn at(c: &[Lanes<S>; 5], x: Lanes<S>) -> Look<S> {
        let (value, slope, half_bend) = taylor(c, x);
        let (bend, squared) = (value * half_bend, slope * slope);
        Look { value, bend, squared, numerator: value * slope, denominator: squared - bend }
    }
}

impl<S: Simd> Bracket<S> {
    /// The place if it is in the bracket, else the bracket's middle.
    #[inline(always)]
    fn inside(&self, x: Lanes<S>) -> Lanes<S> {
        let inside = ((x - self.from) * (x - self.to)).simd_le(Lanes::splat(x.simd(), 0.0));
        inside.select(x, 0.5 * (self.from + self.to))
    }

    #[inline(always)]
    fn step(&mut self, simd: S, look: &Look<S>, step: Lanes<S>, small: Lanes<S>) {
        let positive = look.value.simd_gt(Lanes::splat(simd, 0.0));
        self.from = positive.select(self.x, self.from);
        self.to = positive.select(self.to, self.x);
        let x = self.done.select(self.x, self.inside(self.x - step));
        // Near a flat place steps are small too, far from the root.
        let steep = look.bend.abs().simd_lt(look.squared * STEEP);
        self.done |= steep & (x - self.x).abs().simd_lt(small);
        self.x = x;
    }
}

/// Whether the parts left and right of `m` both have no negative Bernstein coefficient (de Casteljau), and
/// whether both have one sign change where the ends are positive and `m` is negative.
#[inline(always)]
fn certify<S: Simd>(b: &[Lanes<S>; 5], m: Lanes<S>, zero: Lanes<S>) -> (Mask<S>, Mask<S>) {
    let (x, y) = (0.5 + 0.5 * m, 0.5 - 0.5 * m);
    let [b_0, b_1, b_2, b_3, b_4] = *b;
    let (c_0, c_1, c_2, c_3) = (y * b_0 + x * b_1, y * b_1 + x * b_2, y * b_2 + x * b_3, y * b_3 + x * b_4);
    let (d_0, d_1, d_2) = (y * c_0 + x * c_1, y * c_1 + x * c_2, y * c_2 + x * c_3);
    let (e_0, e_1) = (y * d_0 + x * d_1, y * d_1 + x * d_2);
    // From the ends inwards: b_0 c_0 d_0 e_0 f(m), and b_4 c_3 d_2 e_1 f(m).
    let least = smaller(smaller(smaller(c_0, d_0), smaller(c_3, d_2)), smaller(e_0, e_1));
    (least.simd_gt(zero), falls(c_0, d_0, e_0, zero) & falls(c_3, d_2, e_1, zero))
}

/// Whether the quartic is negative on one piece, given its value, slope and half second derivative at `m`, between two
/// maxima of the depth.
///
/// The second derivative is `2 (half_bend + 6 c_4 (u - m)^2)`, as long as `m` is not on the border of where it is looked
/// for. Where that is not negative the quartic bends upwards all along. Else it bends downwards within
/// `s = sqrt(-half_bend / (6 c_4))` of `m`, where it is below its tangent: at most `lowest + |slope| s`.
#[inline(always)]
fn in_one_piece<S: Simd>(
    simd: S,
    m: Lanes<S>,
    [lowest, slope, half_bend]: [Lanes<S>; 3],
    c_4: Lanes<S>,
) -> Mask<S> {
    let least = m.abs().simd_lt(Lanes::splat(simd, CENTRE));
    let upwards = half_bend.simd_ge(Lanes::splat(simd, 0.0));
    let rise = -half_bend * (slope * slope);
    let below = rise.simd_lt((lowest * lowest) * (c_4 * (6.0 * (1.0 - ROUNDING))));
    least & (upwards | below)
}

/// Whether no negative number is before a positive one.
#[inline(always)]
fn falls<S: Simd>(first: Lanes<S>, second: Lanes<S>, third: Lanes<S>, zero: Lanes<S>) -> Mask<S> {
    let rises = (first.simd_lt(zero) & (second.simd_gt(zero) | third.simd_gt(zero)))
        | (second.simd_lt(zero) & third.simd_gt(zero));
    !rises
}

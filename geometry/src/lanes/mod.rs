//! Contact arcs of many pairs of rings, sixteen pairs side by side in vector instructions.
//!
//! The one thing to know: this is [`circle_circle_arcs`](crate::arc::circle_circle_arcs) for the common case.
//! A pair is either answered in full, with arcs certified by the same sign changes, or handed back as
//! *irregular*, for the scalar code to answer. Which of the two is a function of the pair alone: each lane
//! runs the same IEEE operations whatever the instruction set, so the bits are the same on every machine.
//!
//! # Stages
//! Each stage reads and writes plain buffers.
//! 1. `chart`: the strip `|h| < reach` or `|y| < reach` cuts A into two stretches; on each the quartic of
//!    `ellipse.rs` in Bernstein form. No sign change proves that there is no contact. A stretch on which the
//!    quartic rises above 0 between two minima is cut there.
//! 2. `isolate`: the quartic's minimum and its two roots.
//!
//! [`NearSearch`] answers for many pairs at once which of them may touch before they have come closer by
//! some margin: slabs first (`cull`), then charts made for wires that are thicker by the margin.
//!
//! # The common frame
//! With the angle between the planes well away from 0, A's angle is counted from its highest point over B's
//! plane: `e1 = (n_B - c n_A) / sin`, `e2 = n_A x n_B / sin`, `c = n_A . n_B`. Then
//! `h = h_0 + R_A sin cos(t)`, and no axes of the bodies but their normals are needed. With
//! `g = (n_A - c n_B) / sin` the vectors `(e2, g, n_B)` are right-handed and a point of A lies at
//! `(d.e2 + R_A sin(t), d.g - R_A c cos(t), h)` from B's centre.

use crate::arc::{Arc, Arcs};
use crate::{Circle, Vec3};
use fearless_simd::f64x4;

pub use fearless_simd::prelude::{Select, SimdBase, SimdCombine, SimdFloat, SimdMask, SimdSplit};
pub use fearless_simd::{Level, Simd, dispatch};

mod chart;
mod cull;
mod isolate;
mod settle;
mod store;
mod torus;
mod wide;

pub use settle::Touching;
pub use torus::RaysAndTori;
pub use wide::{LANES, Lanes, Mask};

/// Four numbers of one lane.
pub type Row<S> = f64x4<S>;

/// Eight numbers side by side.
pub type Eight<S> = fearless_simd::f64x8<S>;

/// An array with a place for each lane. Written out: `map` and `from_fn` are not inlined into code for other
/// instruction sets than their own.
#[macro_export]
macro_rules! each_lane {
    ($lane:ident => $value:expr) => {
        [
            {
                let $lane = 0;
                $value
            },
            {
                let $lane = 1;
                $value
            },
            {
                let $lane = 2;
                $value
            },
            {
                let $lane = 3;
                $value
            },
            {
                let $lane = 4;
                $value
            },
            {
                let $lane = 5;
                $value
            },
            {
                let $lane = 6;
                $value
            },
            {
                let $lane = 7;
                $value
            },
            {
                let $lane = 8;
                $value
            },
            {
                let $lane = 9;
                $value
            },
            {
                let $lane = 10;
                $value
            },
            {
                let $lane = 11;
                $value
            },
            {
                let $lane = 12;
                $value
            },
            {
                let $lane = 13;
                $value
            },
            {
                let $lane = 14;
                $value
            },
            {
                let $lane = 15;
                $value
            },
        ]
    };
}

/// A ring as the lanes read it: one cache line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Line {
    /// Centre (m, World), and the minor radius (m).
    pub centre: [f64; 4],
    /// Unit normal (World), and the major radius (m).
    pub normal: [f64; 4],
}

impl Line {
    /// Takes over a circle's centre and normal.
    #[inline(always)]
    pub fn take(&mut self, circle: &Circle) {
        let (c, n) = (&circle.centre, &circle.normal);
        [self.centre[0], self.centre[1], self.centre[2]] = [c.x, c.y, c.z];
        [self.normal[0], self.normal[1], self.normal[2]] = [n.x, n.y, n.z];
    }
}

/// A contact arc in the common frame: of at most a quarter turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct LaneArc {
    /// Cosine and sine of the middle from `e1` towards `e2`, `tan(phi / 2)` with `phi` half the arc's angle, and
    /// four times the number of the pair among those searched plus the number of the rule.
    pub numbers: [f64; 4],
}

impl LaneArc {
    /// `cos(mid)`, from `e1`.
    #[inline(always)]
    pub fn mid_cos(&self) -> f64 {
        self.numbers[0]
    }

    /// `sin(mid)`, towards `e2`.
    #[inline(always)]
    pub fn mid_sin(&self) -> f64 {
        self.numbers[1]
    }

    /// `tan(phi / 2)` with `phi` half the arc's angle.
    #[inline(always)]
    pub fn half_tangent(&self) -> f64 {
        self.numbers[2]
    }

    /// Number of the pair among those searched.
    #[inline(always)]
    pub fn pair(&self) -> usize {
        (self.pair_and_rule() >> 2) as usize
    }

    /// Number of the rule that its length needs, in the order of [`RULES`](crate::arc::RULES).
    #[inline(always)]
    pub fn rule(&self) -> usize {
        (self.pair_and_rule() & 3) as usize
    }

    /// Above 2^52 the bits of a number's fraction count its ones: the quickest way from a small whole number to an integer.
    #[inline(always)]
    fn pair_and_rule(&self) -> u64 {
        const TWO_TO_52: f64 = 4_503_599_627_370_496.0;
        (self.numbers[3] + TWO_TO_52).to_bits() & ((1 << 52) - 1)
    }
}

/// A search for contact arcs, and its memory.
#[derive(Debug, Default)]
pub struct ArcSearch {
    charts: chart::ChartLists,
    cuts: [store::Charts; 2],
    /// Of simple charts, of parts, of parts that were cut again, and of one round of these.
    found: [Vec<LaneArc>; 4],
    /// The arcs found, in the order of the pairs. A pair has at most two.
    pub arcs: Vec<LaneArc>,
    /// The pairs that were not answered, in order.
    pub irregular: Vec<u32>,
}

impl ArcSearch {
    /// Finds the contact arcs of A's centreline along B's, for pairs (A, B) of rings, given by their places
    /// in `lines`, whose minor radii sum to less than B's major radius.
    pub fn find(&mut self, level: Level, lines: &[Line], pairs: &[(u32, u32)]) {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.find_with(simd, lines, pairs),
        ));
        self.settle();
    }

    #[inline(always)]
    fn find_with<S: Simd>(&mut self, simd: S, lines: &[Line], pairs: &[(u32, u32)]) {
        self.irregular.clear();
        chart::charts(simd, lines, pairs, &mut self.charts, &mut self.irregular);
        isolate::isolate(simd, &self.charts, &mut self.cuts, &mut self.found, &mut self.irregular);
    }
}

/// A pair's arcs by the angle on circle A, as [`circle_circle_arcs`](crate::arc::circle_circle_arcs) gives them: each is a
/// connected arc.
pub fn arcs_on(a: &Circle, b: &Circle, arcs: &[LaneArc]) -> Arcs {
    let cross = a.normal.cross(&b.normal);
    let inverse = 1.0 / cross.norm_squared().sqrt();
    let e1 = (b.normal - a.normal * a.normal.dot(&b.normal)) * inverse;
    let mut found = Arcs::NONE;
    for (arc, connected) in arcs.iter().zip(0..) {
        let middle: Vec3 = e1 * arc.mid_cos() + cross * (arc.mid_sin() * inverse);
        let (mid_cos, mid_sin) = (middle.dot(&a.u), middle.dot(&a.w));
        found.push(Arc { mid_cos, mid_sin, half_tangent: arc.half_tangent(), connected });
    }
    found
}

/// A search for the pairs that are near contact, and its memory.
#[derive(Debug, Default)]
pub struct NearSearch {
    /// Numbers of the pairs that `cull` left, and those pairs.
    numbers: Vec<u32>,
    left: Vec<(u32, u32)>,
}

impl NearSearch {
    /// Appends the pairs whose wires are less than `margin` (m) apart, in order, to `near`, and some that are not:
    /// all others are farther apart than that. The same kind of pairs as for [`ArcSearch::find`].
    pub fn find(
        &mut self,
        level: Level,
        lines: &[Line],
        pairs: &[(u32, u32)],
        margin: f64,
        near: &mut Vec<(u32, u32)>,
    ) {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let count = cull::cull(simd, lines, pairs, margin, &mut self.numbers);
                self.left.clear();
                self.left.extend(self.numbers[..count].iter().map(|&number| pairs[number as usize]));
                chart::touchable(simd, lines, &self.left, margin, near);
            },
        ));
    }
}

/// Vectors in space, one a lane.
#[derive(Clone, Copy)]
pub struct Vectors<S: Simd>(pub [Lanes<S>; 3]);

impl<S: Simd> Vectors<S> {
    /// Products `a . b`.
    #[inline(always)]
    pub fn dot(&self, other: &Vectors<S>) -> Lanes<S> {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        a * x + b * y + c * z
    }

    /// Products `a x b`.
    #[inline(always)]
    pub fn cross(&self, other: &Vectors<S>) -> Vectors<S> {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Vectors([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// Differences.
    #[inline(always)]
    pub fn minus(&self, other: &Vectors<S>) -> Vectors<S> {
        Vectors([self.0[0] - other.0[0], self.0[1] - other.0[1], self.0[2] - other.0[2]])
    }

    /// Sums.
    #[inline(always)]
    pub fn plus(&self, other: &Vectors<S>) -> Vectors<S> {
        Vectors([self.0[0] + other.0[0], self.0[1] + other.0[1], self.0[2] + other.0[2]])
    }

    /// Multiples.
    #[inline(always)]
    pub fn times(&self, factor: Lanes<S>) -> Vectors<S> {
        Vectors([self.0[0] * factor, self.0[1] * factor, self.0[2] * factor])
    }
}

/// Rows become columns.
#[inline(always)]
fn transposed<S: Simd>(rows: [Row<S>; 4]) -> [Row<S>; 4] {
    let [a, b, c, d] = rows;
    let (ac, bd) = (a.zip_low(c), b.zip_low(d));
    let (ac_high, bd_high) = (a.zip_high(c), b.zip_high(d));
    [ac.zip_low(bd), ac.zip_high(bd), ac_high.zip_low(bd_high), ac_high.zip_high(bd_high)]
}

/// A row of four numbers for each lane, as columns.
#[inline(always)]
pub fn columns<S: Simd>(simd: S, rows: [&[f64; 4]; LANES]) -> [Lanes<S>; 4] {
    columns_of(each_lane!(lane => Row::load_array_ref(simd, rows[lane])))
}

/// The same for rows that are loaded.
#[inline(always)]
pub fn columns_of<S: Simd>(rows: [Row<S>; LANES]) -> [Lanes<S>; 4] {
    let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = rows;
    let quarters = [
        transposed([a, b, c, d]),
        transposed([e, f, g, h]),
        transposed([i, j, k, l]),
        transposed([m, n, o, p]),
    ];
    let column =
        |of: usize| Lanes::of_quarters([quarters[0][of], quarters[1][of], quarters[2][of], quarters[3][of]]);
    [column(0), column(1), column(2), column(3)]
}

/// Columns become a row for each lane.
#[inline(always)]
pub fn rows_of<S: Simd>(columns: [Lanes<S>; 4]) -> [Row<S>; LANES] {
    let [x, y, z, w] =
        [columns[0].quarters(), columns[1].quarters(), columns[2].quarters(), columns[3].quarters()];
    let [a, b, c, d] = transposed([x[0], y[0], z[0], w[0]]);
    let [e, f, g, h] = transposed([x[1], y[1], z[1], w[1]]);
    let [i, j, k, l] = transposed([x[2], y[2], z[2], w[2]]);
    let [m, n, o, p] = transposed([x[3], y[3], z[3], w[3]]);
    [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p]
}

/// The larger of each two numbers; the second where one is NaN.
#[inline(always)]
pub fn larger<S: Simd>(a: Lanes<S>, b: Lanes<S>) -> Lanes<S> {
    a.simd_gt(b).select(a, b)
}

/// The smaller of each two numbers; the second where one is NaN.
#[inline(always)]
pub fn smaller<S: Simd>(a: Lanes<S>, b: Lanes<S>) -> Lanes<S> {
    a.simd_lt(b).select(a, b)
}

/// Pairs of rings, one a lane.
#[derive(Clone, Copy)]
pub struct PairLanes<S: Simd> {
    /// Centre of A less centre of B.
    pub from_b: Vectors<S>,
    /// Normals.
    pub normal_a: Vectors<S>,
    /// Normals.
    pub normal_b: Vectors<S>,
    /// Major radius of A.
    pub radius_a: Lanes<S>,
    /// Major radius of B.
    pub radius_b: Lanes<S>,
    /// Sum of the minor radii.
    pub reach: Lanes<S>,
}

impl<S: Simd> PairLanes<S> {
    /// Loads pairs.
    #[inline(always)]
    pub fn load(simd: S, lines: &[Line], pairs: [(u32, u32); LANES]) -> PairLanes<S> {
        let a: [&Line; LANES] = each_lane!(lane => &lines[pairs[lane].0 as usize]);
        let b: [&Line; LANES] = each_lane!(lane => &lines[pairs[lane].1 as usize]);
        // Differences and sums first: they need one change of rows and columns less.
        let [x, y, z, _] = columns_of(each_lane!(lane =>
            Row::load_array_ref(simd, &a[lane].centre) - Row::load_array_ref(simd, &b[lane].centre)
        ));
        let [ax, ay, az, radius_a] = columns(simd, each_lane!(lane => &a[lane].normal));
        let [bx, by, bz, radius_b] = columns(simd, each_lane!(lane => &b[lane].normal));
        let reach = each_lane!(lane => a[lane].centre[3] + b[lane].centre[3]);
        PairLanes {
            from_b: Vectors([x, y, z]),
            normal_a: Vectors([ax, ay, az]),
            normal_b: Vectors([bx, by, bz]),
            radius_a,
            radius_b,
            reach: Lanes::load_array(simd, reach),
        }
    }
}

/// Pairs in their common frames (see the module's page).
#[derive(Clone, Copy)]
pub struct Frames<S: Simd> {
    /// `e2`, `g` and the normal of B, World.
    pub e2: Vectors<S>,
    /// The direction in B's plane towards the normal of A.
    pub g: Vectors<S>,
    /// Cosine of the angle between the planes.
    pub cos: Lanes<S>,
    /// Its sine, not negative.
    pub sin: Lanes<S>,
    /// One over the sine.
    pub inverse_sin: Lanes<S>,
    /// A's centre from B's along `e2`, `g` and B's normal.
    pub centre: [Lanes<S>; 3],
}

impl<S: Simd> Frames<S> {
    /// The frames of pairs; numbers without meaning where the planes are parallel.
    #[inline(always)]
    pub fn of(pairs: &PairLanes<S>) -> Frames<S> {
        let cross = pairs.normal_a.cross(&pairs.normal_b);
        let cos = pairs.normal_a.dot(&pairs.normal_b);
        let squared = cross.dot(&cross);
        let sin = squared.sqrt();
        let inverse = 1.0 / sin;
        let e2 = cross.times(inverse);
        let g = pairs.normal_a.minus(&pairs.normal_b.times(cos)).times(inverse);
        let d = &pairs.from_b;
        Frames {
            e2,
            g,
            cos,
            sin,
            inverse_sin: inverse,
            centre: [d.dot(&e2), d.dot(&g), d.dot(&pairs.normal_b)],
        }
    }
}

//! Pairs of bodies that are near each other, by any of the methods, all with the same answer.

use super::grid::Grid;
use super::levels;
use super::range_tree::RangeTree;
use super::sweep;
use geometry::Vec3;

/// A way to find near pairs. All find the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Cells as wide as the longest reach, in one sorted list: `O(n)` where the bodies fill space evenly.
    Grid,
    /// A [`RangeTree`]: `O(n log^2 n)` whatever the layout.
    RangeTree,
    /// Intervals along the axis of the widest spread, in order: `O(n log n)` and the pairs that overlap
    /// along that axis.
    SweepAndPrune,
    /// Every pair is looked at.
    Brute,
}

/// Working memory of [`find_pairs`]; nothing in it changes a result.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(super) grid: Grid,
    pub(super) tree: RangeTree,
    pub(super) packed: Packed,
    pub(super) levels: levels::Levels,
    pub(super) sweep: sweep::Sweep,
    pub(super) numbers: Vec<u32>,
    starts: Vec<u32>,
    seconds: Vec<u32>,
}

/// The pairs `(a, b)` with `a < b` and `|centre_a - centre_b| < radius_a + radius_b + skin`, in order. Bodies
/// whose centre is not finite are near none.
///
/// # Panics
/// If there are not as many radii as centres.
pub fn find_pairs(
    method: Method,
    centres: &[Vec3],
    radii: &[f64],
    skin: f64,
    workspace: &mut Workspace,
    pairs: &mut Vec<(u32, u32)>,
) {
    gather(method, &Bodies { centres, radii, skin }, workspace, pairs);
    workspace.sort(centres.len(), pairs);
}

/// The same pairs in any order.
pub(super) fn gather(
    method: Method,
    bodies: &Bodies,
    workspace: &mut Workspace,
    pairs: &mut Vec<(u32, u32)>,
) {
    assert_eq!(bodies.centres.len(), bodies.radii.len(), "centres and radii");
    let finite = |&number: &u32| bodies.centres[number as usize].iter().all(|value| value.is_finite());
    workspace.numbers.clear();
    workspace.numbers.extend((0..bodies.centres.len() as u32).filter(finite));
    let mut found = Found::new(std::mem::take(pairs));
    match method {
        Method::Grid | Method::RangeTree => levels::gather(method, bodies, workspace, &mut found),
        Method::SweepAndPrune => sweep::gather(bodies, workspace, &mut found),
        Method::Brute => {
            let packed = &mut workspace.packed;
            packed.fill(bodies, workspace.numbers.iter().copied());
            let count = packed.points.len();
            (0..count).for_each(|place| packed.meet(place, place + 1..count, bodies.skin, &mut found));
        }
    }
    *pairs = found.finish();
}

/// What the methods work on.
pub(super) struct Bodies<'a> {
    pub centres: &'a [Vec3],
    pub radii: &'a [f64],
    pub skin: f64,
}

impl Bodies<'_> {
    /// Centre and radius of a body.
    #[inline]
    pub(super) fn point(&self, number: u32) -> [f64; 4] {
        let centre = &self.centres[number as usize];
        [centre.x, centre.y, centre.z, self.radii[number as usize]]
    }
}

/// Whether two bodies are near: the one place where that is decided, so that all methods agree.
#[inline]
pub(super) fn near(a: &[f64; 4], b: &[f64; 4], skin: f64) -> bool {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let reach = a[3] + b[3] + skin;
    x * x + y * y + z * z < reach * reach
}

/// A length with room for what rounding may add to it in [`near`].
pub(super) fn widened(length: f64) -> f64 {
    length * (1.0 + 1e-12)
}

/// Centres and radii of bodies beside each other in memory, in an order that suits the method.
#[derive(Debug, Default)]
pub(super) struct Packed {
    pub points: Vec<[f64; 4]>,
    pub numbers: Vec<u32>,
}

impl Packed {
    pub(super) fn fill(&mut self, bodies: &Bodies, numbers: impl Iterator<Item = u32>) {
        self.numbers.clear();
        self.numbers.extend(numbers);
        self.points.clear();
        self.points.extend(self.numbers.iter().map(|&number| bodies.point(number)));
    }

    /// Meets one body with a range of others.
    #[inline]
    pub(super) fn meet(&self, place: usize, others: std::ops::Range<usize>, skin: f64, found: &mut Found) {
        let (point, number) = (&self.points[place], self.numbers[place]);
        let room = found.room(others.len());
        let mut count = 0;
        for (other, &second) in self.points[others.clone()].iter().zip(&self.numbers[others]) {
            // Written without a branch: about every third one is near, which nobody can predict.
            room[count] = if number < second { (number, second) } else { (second, number) };
            count += usize::from(near(point, other, skin));
        }
        found.count += count;
    }
}

/// The pairs found so far: a list with room behind them.
#[derive(Debug, Default)]
pub(super) struct Found {
    pairs: Vec<(u32, u32)>,
    count: usize,
}

impl Found {
    fn new(pairs: Vec<(u32, u32)>) -> Found {
        Found { pairs, count: 0 }
    }

    /// Room for so many more pairs, and one that is written and not counted.
    #[inline]
    fn room(&mut self, more: usize) -> &mut [(u32, u32)] {
        let needed = self.count + more + 1;
        if self.pairs.len() < needed {
            self.pairs.resize(2 * needed, (0, 0));
        }
        &mut self.pairs[self.count..needed]
    }

    /// Adds a pair if it is near.
    #[inline]
    pub(super) fn offer(&mut self, bodies: &Bodies, a: u32, b: u32) {
        if near(&bodies.point(a), &bodies.point(b), bodies.skin) {
            self.room(1)[0] = if a < b { (a, b) } else { (b, a) };
            self.count += 1;
        }
    }

    fn finish(mut self) -> Vec<(u32, u32)> {
        self.pairs.truncate(self.count);
        self.pairs
    }
}

impl Workspace {
    /// Puts pairs in order: dealt out by their first number, which must be less than `count`, then each of
    /// these small lots is sorted.
    pub(super) fn sort(&mut self, count: usize, pairs: &mut [(u32, u32)]) {
        let Workspace { starts, seconds, .. } = self;
        starts.clear();
        starts.resize(count + 1, 0);
        pairs.iter().for_each(|&(first, _)| starts[first as usize + 1] += 1);
        for first in 0..count {
            starts[first + 1] += starts[first];
        }
        seconds.clear();
        seconds.resize(pairs.len(), 0);
        for &(first, second) in pairs.iter() {
            let place = &mut starts[first as usize];
            seconds[*place as usize] = second;
            *place += 1;
        }
        // Each start has become the end of its lot.
        let mut start = 0;
        for (first, &end) in starts[..count].iter().enumerate() {
            let lot = start as usize..end as usize;
            seconds[lot.clone()].sort_unstable();
            pairs[lot.clone()]
                .iter_mut()
                .zip(&seconds[lot])
                .for_each(|(pair, &second)| *pair = (first as u32, second));
            start = end;
        }
    }
}

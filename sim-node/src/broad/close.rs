//! Which neighbouring rings are nearly in contact, and how long that is known.
//!
//! The one thing to know: a pair is left out only as long as its wires are apart for certain, so what is left
//! out reaches no bit.
//!
//! Neighbours are taken by patches, some hundred pairs in a row; in a weave those lie together. When a patch is
//! looked at, pairs that are apart by more than a margin are dropped, and the poses of its rings are noted. A point
//! of a ring whose centre has moved by `dc` and whose normal by `dn` is within `R |dn|` of a point of the old
//! circle moved by `dc`: that is the chord of the smallest turn that brings the one normal to the other. So two
//! circles come closer by no more than the difference of their `dc`, which lies in the box of all of them, and
//! `R |dn|` of each. While that is below the margin, the patch need not be looked at again.

use geometry::lanes::{Level, Line, NearSearch, Row, Select, Simd, SimdBase, dispatch};

/// Pairs in a patch. Part of nothing: any value gives the same bits.
const PATCH_PAIRS: usize = 128;

/// Share of the margin that is given up to rounding.
const ROUNDING: f64 = 1e-6;

/// The close pairs of a part of the neighbours.
#[derive(Debug, Default)]
pub(crate) struct CloseList {
    /// In the order of the neighbours.
    pub pairs: Vec<(u32, u32)>,
    /// The number of the list of neighbours that the patches were made of.
    list: u64,
    patches: Vec<Patch>,
    search: NearSearch,
    bodies: Vec<u32>,
}

#[derive(Debug, Default)]
struct Patch {
    pairs: Vec<(u32, u32)>,
    /// Its bodies, and their poses when it was looked at; none before that.
    bodies: Vec<u32>,
    anchors: Vec<Line>,
    /// Whether it need not be looked at again.
    holds: bool,
}

impl CloseList {
    /// Brings the list up to date for rings at `lines`. `list` is the number of the list of neighbours, `margin` how
    /// far apart wires may be to be called close (m): more makes a longer list that holds longer.
    pub(crate) fn update(
        &mut self,
        level: Level,
        lines: &[Line],
        list: u64,
        neighbours: &[(u32, u32)],
        margin: f64,
    ) {
        if self.list != list {
            self.list = list;
            self.cut_up(neighbours);
        }
        let patches = &mut self.patches;
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || for patch in patches.iter_mut() {
                patch.holds = patch.holds(simd, lines, margin);
            },
        ));
        if self.patches.iter().all(|patch| patch.holds) {
            return;
        }
        for (patch, neighbours) in self.patches.iter_mut().zip(neighbours.chunks(PATCH_PAIRS)) {
            if !patch.holds {
                patch.note(lines);
                patch.pairs.clear();
                self.search.find(level, lines, neighbours, margin, &mut patch.pairs);
            }
        }
        self.pairs.clear();
        self.patches.iter().for_each(|patch| self.pairs.extend_from_slice(&patch.pairs));
    }

    fn cut_up(&mut self, neighbours: &[(u32, u32)]) {
        self.patches.resize_with(neighbours.len().div_ceil(PATCH_PAIRS), Patch::default);
        for (patch, pairs) in self.patches.iter_mut().zip(neighbours.chunks(PATCH_PAIRS)) {
            self.bodies.clear();
            self.bodies.extend(pairs.iter().flat_map(|&(a, b)| [a, b]));
            self.bodies.sort_unstable();
            self.bodies.dedup();
            patch.bodies.clone_from(&self.bodies);
            patch.anchors.clear();
        }
        self.pairs.clear();
    }
}

impl Patch {
    fn note(&mut self, lines: &[Line]) {
        self.anchors.clear();
        self.anchors.extend(self.bodies.iter().map(|&body| lines[body as usize]));
    }

    /// Whether no two of the circles can have come closer by the margin.
    #[inline(always)]
    fn holds<S: Simd>(&self, simd: S, lines: &[Line], margin: f64) -> bool {
        if self.anchors.is_empty() {
            return false;
        }
        let mut low = Row::splat(simd, f64::INFINITY);
        let mut high = Row::splat(simd, f64::NEG_INFINITY);
        let (mut turn, mut sum) = (Row::splat(simd, 0.0), Row::splat(simd, 0.0));
        for (&body, anchor) in self.bodies.iter().zip(&self.anchors) {
            let line = &lines[body as usize];
            // The radii in the last places cancel.
            let moved = Row::load_array_ref(simd, &line.centre) - Row::load_array_ref(simd, &anchor.centre);
            let turned = Row::load_array_ref(simd, &line.normal) - Row::load_array_ref(simd, &anchor.normal);
            let turned = turned.abs() * line.normal[3];
            low = moved.simd_lt(low).select(moved, low);
            high = moved.simd_gt(high).select(moved, high);
            turn = turned.simd_gt(turn).select(turned, turn);
            sum += moved + turned;
        }
        let extent = high - low;
        let length = |row: Row<S>| {
            let [x, y, z, _] = (row * row).to_array();
            (x + y + z).sqrt()
        };
        // A NaN is in no box, but in the sum.
        let [x, y, z, _] = sum.to_array();
        length(extent) + 2.0 * length(turn) <= margin * (1.0 - ROUNDING) && (x + y + z).is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::CloseList;
    use geometry::lanes::{Level, Line};

    /// Two rows of rings side by side, one unit apart, in the planes y = 0 and y = 0.5.
    fn rows(count: usize) -> (Vec<Line>, Vec<(u32, u32)>) {
        let line = |index: usize| Line {
            centre: [3.0 * (index / 2) as f64, 0.5 * (index % 2) as f64, 0.0, 0.1],
            normal: [0.0, 1.0, 0.0, 1.0],
        };
        let pairs = (0..count as u32).map(|index| (2 * index, 2 * index + 1)).collect();
        ((0..2 * count).map(line).collect(), pairs)
    }

    fn close(list: &mut CloseList, lines: &[Line], pairs: &[(u32, u32)]) -> Vec<(u32, u32)> {
        list.update(Level::new(), lines, 1, pairs, 0.1);
        list.pairs.clone()
    }

    #[test]
    fn a_ring_that_comes_near_is_on_the_list_before_it_touches() {
        let (mut lines, pairs) = rows(400);
        let mut list = CloseList::default();
        // All are parallel, which the lanes cannot tell apart from touching but for the slabs.
        assert!(close(&mut list, &lines, &pairs).is_empty(), "0.3 m apart");
        for step in 0..60 {
            // Ring 401 sinks towards ring 400, turning a little; all move along together.
            lines[401].centre[1] -= 0.005;
            let (sin, cos) = (libm::sin(0.01 * f64::from(step)), libm::cos(0.01 * f64::from(step)));
            lines[401].normal = [sin, cos, 0.0, 1.0];
            lines.iter_mut().for_each(|line| line.centre[2] += 1.0);
            // The nearest points are one end of a diameter and the ring below.
            let gap = lines[401].centre[1] - sin - 0.2;
            let listed = close(&mut list, &lines, &pairs);
            assert!(gap > 0.0 || listed == [(400, 401)], "step {step}: gap {gap}, {listed:?}");
        }
        assert_eq!(close(&mut list, &lines, &pairs), [(400, 401)]);
    }

    #[test]
    fn what_is_not_a_number_is_looked_at() {
        let (mut lines, pairs) = rows(10);
        let mut list = CloseList::default();
        close(&mut list, &lines, &pairs);
        lines[3].centre[0] = f64::NAN;
        assert_eq!(close(&mut list, &lines, &pairs), [(2, 3)]);
    }
}

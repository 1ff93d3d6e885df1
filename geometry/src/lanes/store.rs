//! Where charts are kept: each number of sixteen charts side by side, so that lanes load them as they are.
//!
//! The one thing to know: charts are put one at a time, in order, and read a block at a time.

use super::LANES;

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
    /// Number of its pair.
    pub pair: f64,
    /// A's major radius over the reach.
    pub radius_over_reach: f64,
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
        Chart { c, scale: self.scale * half, offset: self.offset + self.scale * middle, ..*self }
    }
}

/// Numbers of a chart as they lie in a block.
pub(super) const NUMBERS: usize = 11;

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
    pub(super) fn reserve(&mut self, more: usize) {
        let blocks = (self.count + more).div_ceil(LANES);
        if self.blocks.len() < blocks {
            self.blocks.resize(blocks, [[0.0; LANES]; NUMBERS]);
        }
    }

    #[inline(always)]
    pub(super) fn put(&mut self, numbers: [f64; NUMBERS]) {
        let block = &mut self.blocks[self.count / LANES];
        let lane = self.count % LANES;
        for (column, number) in block.iter_mut().zip(numbers) {
            column[lane] = number;
        }
        self.count += 1;
    }

    pub(super) fn push(&mut self, chart: &Chart) {
        let Chart { c: [c_0, c_1, c_2, c_3, c_4], scale, offset, mid_cos, mid_sin, pair, radius_over_reach } =
            *chart;
        self.reserve(1);
        self.put([c_0, c_1, c_2, c_3, c_4, scale, offset, mid_cos, mid_sin, pair, radius_over_reach]);
    }
}

/// A chart of a block.
pub(super) fn chart_of(block: &Block, lane: usize) -> Chart {
    let [c_0, c_1, c_2, c_3, c_4, scale, offset, mid_cos, mid_sin, pair, radius_over_reach] =
        numbers_of(block, lane);
    Chart { c: [c_0, c_1, c_2, c_3, c_4], scale, offset, mid_cos, mid_sin, pair, radius_over_reach }
}

#[inline(always)]
pub(super) fn numbers_of(block: &Block, lane: usize) -> [f64; NUMBERS] {
    let mut numbers = [0.0; NUMBERS];
    for (number, column) in numbers.iter_mut().zip(block) {
        *number = column[lane];
    }
    numbers
}

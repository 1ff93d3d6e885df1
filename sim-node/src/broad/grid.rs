//! A grid of cells as wide as the longest reach: two bodies are near only if their cells touch.
//!
//! No cell is stored. Each body gets the number of its cell, the list of bodies is sorted by it, and cells,
//! rows of cells and their neighbours are runs of that list. So memory is `O(n)` however far apart the
//! bodies lie.

use super::pairs::{Bodies, Found, Packed};

/// Most cells along an axis: 2^20, so that rounding moves a wall between cells by less than [`ROOM`] of its
/// width, and three numbers of cells fit one key.
const CELLS_MAX: f64 = 1_048_576.0;
/// The part of a cell's width that is left for rounding.
const ROOM: f64 = 1e-6;
/// Bits of a key that one pass of the sort looks at.
const DIGIT: u32 = 11;

/// Bodies in order of their cells.
#[derive(Debug, Default)]
pub(super) struct Grid {
    keys: Vec<(u64, u32)>,
    buffer: Vec<(u64, u32)>,
    packed: Packed,
    low: [f64; 3],
    width: f64,
    /// Cells along each axis, with an empty one before the first and after the last.
    sizes: [u64; 3],
}

impl Grid {
    /// Takes the bodies of a level. `false`, and nothing is done, if they lie too far apart for their reach.
    pub(super) fn build(&mut self, bodies: &Bodies, numbers: &[u32], reach: f64) -> bool {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &number in numbers {
            for (axis, &value) in bodies.centres[number as usize].iter().enumerate() {
                low[axis] = if value < low[axis] { value } else { low[axis] };
                high[axis] = if value > high[axis] { value } else { high[axis] };
            }
        }
        let width = reach * (1.0 + ROOM);
        if (0..3).any(|axis| !((high[axis] - low[axis]) / width < CELLS_MAX)) {
            return false;
        }
        (self.low, self.width) = (low, width);
        self.sizes = [0, 1, 2].map(|axis| self.cell(axis, high[axis]) + 2);
        self.keys.clear();
        for &number in numbers {
            let centre = &bodies.centres[number as usize];
            let key = self.key([0, 1, 2].map(|axis| self.cell(axis, centre[axis])));
            self.keys.push((key, number));
        }
        self.sort();
        self.packed.fill(bodies, self.keys.iter().map(|&(_, number)| number));
        true
    }

    /// The cell of a coordinate that is not below the lowest: from 1.
    fn cell(&self, axis: usize, value: f64) -> u64 {
        (((value - self.low[axis]) / self.width) as u64).saturating_add(1)
    }

    fn key(&self, [x, y, z]: [u64; 3]) -> u64 {
        (x * self.sizes[1] + y) * self.sizes[2] + z
    }

    /// Sorts by key, digit by digit; equal keys stay in order of their numbers.
    fn sort(&mut self) {
        let largest = self.key(self.sizes);
        self.buffer.clear();
        self.buffer.resize(self.keys.len(), (0, 0));
        let mut shift = 0;
        while shift < 64 && largest >> shift > 0 {
            let digit = |key: u64| (key >> shift) as usize & ((1 << DIGIT) - 1);
            let mut starts = [0_u32; 1 << DIGIT];
            self.keys.iter().for_each(|&(key, _)| starts[digit(key)] += 1);
            let mut sum = 0;
            for start in &mut starts {
                (*start, sum) = (sum, sum + *start);
            }
            for &(key, number) in &self.keys {
                let place = &mut starts[digit(key)];
                self.buffer[*place as usize] = (key, number);
                *place += 1;
            }
            std::mem::swap(&mut self.keys, &mut self.buffer);
            shift += DIGIT;
        }
    }

    /// All near pairs.
    pub(super) fn pairs(&self, skin: f64, found: &mut Found) {
        let keys = &self.keys;
        let [row, slice] = [self.sizes[2], self.sizes[1] * self.sizes[2]];
        // With the rest of the own row, these rows of three cells are half of the 26 around a cell.
        let offsets = [row, slice - row, slice, slice + row];
        let mut rows = [(0, 0); 4];
        let mut start = 0;
        while start < keys.len() {
            let key = keys[start].0;
            let run = |from: usize, last: u64| {
                let mut end = from;
                while end < keys.len() && keys[end].0 <= last {
                    end += 1;
                }
                end
            };
            let end = run(start, key);
            let next = run(end, key + 1);
            for ((from, to), offset) in rows.iter_mut().zip(offsets) {
                // Both only move on, since keys do.
                *from = run(*from, key + offset - 2);
                *to = run(if *to > *from { *to } else { *from }, key + offset + 1);
            }
            for place in start..end {
                self.packed.meet(place, place + 1..next, skin, found);
                for &(from, to) in &rows {
                    self.packed.meet(place, from..to, skin, found);
                }
            }
            start = end;
        }
    }

    /// Appends all bodies whose centres lie in a box, and some around it.
    pub(super) fn query(&self, low: [f64; 3], high: [f64; 3], around: &mut Vec<u32>) {
        let (mut first, mut last) = ([0; 3], [0; 3]);
        for axis in 0..3 {
            // A cast takes what is below 0 as 0.
            if high[axis] < self.low[axis] || self.cell(axis, low[axis]) > self.sizes[axis] {
                return;
            }
            // One cell more on each side makes up for rounding.
            let below = self.cell(axis, low[axis]) - 1;
            let above = self.cell(axis, high[axis]).saturating_add(1);
            first[axis] = if below > 1 { below } else { 1 };
            last[axis] = if above < self.sizes[axis] - 1 { above } else { self.sizes[axis] - 2 };
        }
        let rows = (last[0].saturating_sub(first[0]) + 1) * (last[1].saturating_sub(first[1]) + 1);
        if rows > self.keys.len() as u64 / 16 {
            around.extend(self.keys.iter().map(|&(_, number)| number));
            return;
        }
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                let (from, to) = (self.key([x, y, first[2]]), self.key([x, y, last[2]]));
                let start = self.keys.partition_point(|&(key, _)| key < from);
                let rest = self.keys[start..].iter().take_while(|&&(key, _)| key <= to);
                around.extend(rest.map(|&(_, number)| number));
            }
        }
    }
}

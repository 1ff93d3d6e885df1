//! Evenly spread points of the unit square, shuffled and scrambled.
//!
//! # Source
//! Shuffled, nested-scrambled Sobol points: Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020.
//! The hash is Laine and Karras' with Vegdahl's constants ("Building a better LK hash", 2021). Deviation:
//! keys from ChaCha8 rather than a hash, pairs of dimensions rather than sets of four.

use crate::stream::{Stream, unit};

/// A point set: the first two dimensions of the Sobol sequence under three keys. Each aligned block of 2^k
/// points fills the square evenly.
#[derive(Clone, Copy, Debug, Default)]
pub struct Scrambled {
    shuffle: u32,
    first: u32,
    second: u32,
}

impl Scrambled {
    /// The point set of the next three words of a stream.
    pub fn from_stream(stream: &mut Stream) -> Scrambled {
        Scrambled { shuffle: stream.word(), first: stream.word(), second: stream.word() }
    }

    /// The point set of three such words.
    #[inline(always)]
    pub fn from_words([shuffle, first, second]: [u32; 3]) -> Scrambled {
        Scrambled { shuffle, first, second }
    }

    /// A point in the open unit square.
    #[inline]
    pub fn point(&self, index: u32) -> (f64, f64) {
        let digits = self.digits(index);
        (unit(self.first(digits)), unit(self.second(digits)))
    }

    /// The digits of a point, for [`Scrambled::first`] and [`Scrambled::second`].
    #[inline(always)]
    pub fn digits(&self, index: u32) -> u32 {
        // Aligned blocks of 2^k points stay aligned blocks, so each of them remains evenly spread.
        scramble(index.reverse_bits(), self.shuffle).reverse_bits()
    }

    /// 2^32 times a point's first coordinate, rounded down.
    #[inline(always)]
    pub fn first(&self, digits: u32) -> u32 {
        scramble(digits, self.first).reverse_bits()
    }

    /// 2^32 times its second coordinate, rounded down.
    #[inline(always)]
    pub fn second(&self, digits: u32) -> u32 {
        scramble(pascal(digits), self.second).reverse_bits()
    }
}

/// A point of each of some sets, to be made at once.
#[derive(Clone, Copy, Debug)]
pub struct ScrambledColumns<const N: usize> {
    index: [u32; N],
    shuffle: [u32; N],
    first: [u32; N],
    second: [u32; N],
}

impl<const N: usize> Default for ScrambledColumns<N> {
    fn default() -> Self {
        ScrambledColumns { index: [0; N], shuffle: [0; N], first: [0; N], second: [0; N] }
    }
}

impl<const N: usize> ScrambledColumns<N> {
    /// Asks for a set's point with an index.
    #[inline(always)]
    pub fn put(&mut self, column: usize, set: &Scrambled, index: u32) {
        self.index[column] = index;
        (self.shuffle[column], self.first[column], self.second[column]) =
            (set.shuffle, set.first, set.second);
    }

    /// First and second coordinates of the points, each as [`Scrambled::point`] has it. Loops without branches, for vector
    /// instructions.
    #[inline(always)]
    pub fn points(&self) -> [[f64; N]; 2] {
        let (mut digits, mut words) = ([0; N], [[0; N]; 2]);
        for (column, digits) in digits.iter_mut().enumerate() {
            *digits = scramble(self.index[column].reverse_bits(), self.shuffle[column]).reverse_bits();
        }
        for (column, digits) in digits.iter().enumerate() {
            words[0][column] = scramble(*digits, self.first[column]).reverse_bits();
            words[1][column] = scramble(pascal(*digits), self.second[column]).reverse_bits();
        }
        let mut points = [[0.0; N]; 2];
        for (points, words) in points.iter_mut().zip(&words) {
            for (point, word) in points.iter_mut().zip(words) {
                *point = unit(*word);
            }
        }
        points
    }
}

/// The digits of the second Sobol dimension from those of the first: Pascal's triangle modulo 2. The lowest bit
/// is the first digit.
#[inline(always)]
fn pascal(mut digits: u32) -> u32 {
    digits ^= (digits >> 1) & 0x5555_5555;
    digits ^= (digits >> 2) & 0x3333_3333;
    digits ^= (digits >> 4) & 0x0f0f_0f0f;
    digits ^= (digits >> 8) & 0x00ff_00ff;
    digits ^ (digits >> 16)
}

/// A nested permutation: bit k of the result depends on bits 0 to k alone.
#[inline(always)]
fn scramble(mut digits: u32, key: u32) -> u32 {
    digits ^= digits.wrapping_mul(0x3d20_adea);
    digits = digits.wrapping_add(key);
    digits = digits.wrapping_mul((key >> 16) | 1);
    digits ^= digits.wrapping_mul(0x0552_6c56);
    digits ^ digits.wrapping_mul(0x53a2_2864)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_points_fill_every_elementary_box() {
        let mut stream = Stream::new(1, 2, b"sixteen points..");
        for number in 0..20 {
            stream.go_to(number);
            let points = Scrambled::from_stream(&mut stream);
            for (columns, rows) in [(16, 1), (8, 2), (4, 4), (2, 8), (1, 16)] {
                let mut filled = [false; 16];
                for index in 48..64 {
                    let (x, y) = points.point(index);
                    filled[(x * columns as f64) as usize * rows + (y * rows as f64) as usize] = true;
                }
                assert_eq!(filled, [true; 16], "stream {number}, {columns} x {rows} boxes");
            }
        }
    }

    #[test]
    fn columns_have_the_points_of_each_set() {
        let mut stream = Stream::new(5, 6, b"columns' points.");
        let mut columns = ScrambledColumns::<16>::default();
        for number in 0..50 {
            stream.go_to(number);
            let sets: Vec<_> = (0..16).map(|_| Scrambled::from_stream(&mut stream)).collect();
            let index = |column: usize| number as u32 * 7 + column as u32 * 1_000_003;
            sets.iter().enumerate().for_each(|(column, set)| columns.put(column, set, index(column)));
            let [first, second] = columns.points();
            for (column, set) in sets.iter().enumerate() {
                assert_eq!((first[column], second[column]), set.point(index(column)), "column {column}");
            }
        }
    }
}

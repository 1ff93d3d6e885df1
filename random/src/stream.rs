//! ChaCha8 as a function of keys.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Streams of random words: one for each stream number, all of one (seed, counter, purpose).
#[derive(Clone, Debug)]
pub struct Stream(ChaCha8Rng, [u32; 8]);

impl Stream {
    /// The streams of a seed and a counter (a frame, a step). The purpose separates them from those that
    /// other parts draw from the same seed.
    pub fn new(seed: u64, counter: u64, purpose: &[u8; 16]) -> Stream {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&counter.to_le_bytes());
        key[16..].copy_from_slice(purpose);
        let mut words = [0; 8];
        for (word, bytes) in words.iter_mut().zip(key.as_chunks().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        Stream(ChaCha8Rng::from_seed(key), words)
    }

    /// Goes to the first word of a stream.
    pub fn go_to(&mut self, stream: u64) {
        self.0.set_word_pos(0);
        self.0.set_stream(stream);
    }

    /// Goes to the first word of one of the 2^32 parts of a stream, each of 2^33 words.
    pub fn go_to_part(&mut self, stream: u64, part: u32) {
        // The position first: a new stream number keeps it.
        self.0.set_word_pos(u128::from(part) << 33);
        self.0.set_stream(stream);
    }

    /// A block of words of each of some streams, which are told by their numbers, at once: row k has word `16 block + k` of
    /// each stream. Where this stream is does not matter and does not change. Loops without branches, for vector instructions.
    ///
    /// # Source
    /// ChaCha8 with a counter and a stream number of 64 bits each, as rand_chacha has it: Bernstein, "ChaCha, a variant of
    /// Salsa20", 2008.
    #[inline(always)]
    pub fn blocks<const N: usize>(&self, numbers: &[u64; N], block: u32) -> [[u32; N]; 16] {
        const CONSTANTS: [u32; 4] = [0x6170_7865, 0x3320_646e, 0x7962_2d32, 0x6b20_6574];
        let mut first = [[0; N]; 16];
        for (row, word) in first.iter_mut().zip(CONSTANTS) {
            *row = [word; N];
        }
        for (row, word) in first[4..].iter_mut().zip(self.1) {
            *row = [word; N];
        }
        first[12] = [block; N];
        for (column, number) in numbers.iter().enumerate() {
            first[14][column] = *number as u32;
            first[15][column] = (*number >> 32) as u32;
        }
        let mut rows = first;
        for _ in 0..4 {
            for column in 0..4 {
                quarter_round(&mut rows, column, column + 4, column + 8, column + 12);
            }
            for column in 0..4 {
                let next = |step: usize| (column + step) % 4;
                quarter_round(&mut rows, column, next(1) + 4, next(2) + 8, next(3) + 12);
            }
        }
        for (row, first) in rows.iter_mut().zip(&first) {
            for (word, first) in row.iter_mut().zip(first) {
                *word = word.wrapping_add(*first);
            }
        }
        rows
    }

    /// The number of the stream that words come from; 0 at first.
    pub fn number(&self) -> u64 {
        self.0.get_stream()
    }

    /// The next word.
    #[inline]
    pub fn word(&mut self) -> u32 {
        self.0.next_u32()
    }
}

#[inline(always)]
fn quarter_round<const N: usize>(rows: &mut [[u32; N]; 16], a: usize, b: usize, c: usize, d: usize) {
    let mut column = 0;
    while column < N {
        let [mut w, mut x, mut y, mut z] =
            [rows[a][column], rows[b][column], rows[c][column], rows[d][column]];
        w = w.wrapping_add(x);
        z = (z ^ w).rotate_left(16);
        y = y.wrapping_add(z);
        x = (x ^ y).rotate_left(12);
        w = w.wrapping_add(x);
        z = (z ^ w).rotate_left(8);
        y = y.wrapping_add(z);
        x = (x ^ y).rotate_left(7);
        (rows[a][column], rows[b][column], rows[c][column], rows[d][column]) = (w, x, y, z);
        column += 1;
    }
}

/// The number in (0, 1) in the middle of a word's share of the unit interval.
#[inline(always)]
pub fn unit(word: u32) -> f64 {
    (f64::from(word) + 0.5) * (1.0 / 4_294_967_296.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream's words depend on all of its four keys and on nothing that was drawn before.
    #[test]
    fn words_are_a_function_of_the_keys() {
        let words = |seed, counter, purpose: &[u8; 16], number| {
            let mut stream = Stream::new(seed, counter, purpose);
            stream.go_to(9);
            stream.word();
            stream.go_to(number);
            [stream.word(), stream.word(), stream.word()]
        };
        let first = words(1, 2, b"0123456789abcdef", 3);
        assert_eq!(first, words(1, 2, b"0123456789abcdef", 3));
        for other in [
            words(4, 2, b"0123456789abcdef", 3),
            words(1, 4, b"0123456789abcdef", 3),
            words(1, 2, b"0123456789abcdeX", 3),
            words(1, 2, b"0123456789abcdef", 4),
        ] {
            assert_ne!(first, other);
        }
    }

    /// Parts differ from each other, do not depend on what was drawn before, and the first is the stream's begin.
    #[test]
    fn parts_are_a_function_of_their_number() {
        let mut stream = Stream::new(1, 2, b"0123456789abcdef");
        let mut words = |number, part| {
            stream.go_to_part(number, part);
            [stream.word(), stream.word()]
        };
        let first = words(3, 5);
        assert_ne!(first, words(3, 6));
        assert_ne!(first, words(4, 5));
        assert_ne!(words(3, u32::MAX), words(3, u32::MAX - 1));
        assert_eq!(first, words(3, 5));
        let begin = words(3, 0);
        stream.go_to(3);
        assert_eq!(begin, [stream.word(), stream.word()]);
    }

    /// Blocks of many streams have the words of each stream, for large numbers, too.
    #[test]
    fn blocks_are_those_of_each_stream() {
        let mut stream = Stream::new(0x0123_4567_89ab_cdef, 42, b"0123456789abcdef");
        let numbers: [u64; 8] = [0, 1, 2, 77, 1 << 31, u64::from(u32::MAX), 1 << 32, u64::MAX - 5];
        let blocks: Vec<_> = (0..5).map(|block| stream.blocks(&numbers, block)).collect();
        for (column, &number) in numbers.iter().enumerate() {
            stream.go_to(number);
            for (place, row) in blocks.iter().flatten().enumerate() {
                assert_eq!(row[column], stream.word(), "word {place} of stream {number}");
            }
        }
    }

    #[test]
    fn units_lie_inside_the_open_interval() {
        assert!(unit(0) > 0.0 && unit(u32::MAX) < 1.0);
    }
}

//! ChaCha8 as a function of keys.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Streams of random words: one for each stream number, all of one (seed, counter, purpose).
#[derive(Clone, Debug)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The streams of a seed and a counter (a frame, a step). The purpose separates them from those that
    /// other parts draw from the same seed.
    pub fn new(seed: u64, counter: u64, purpose: &[u8; 16]) -> Stream {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&counter.to_le_bytes());
        key[16..].copy_from_slice(purpose);
        Stream(ChaCha8Rng::from_seed(key))
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

/// The number in (0, 1) in the middle of a word's share of the unit interval.
#[inline]
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

    #[test]
    fn units_lie_inside_the_open_interval() {
        assert!(unit(0) > 0.0 && unit(u32::MAX) < 1.0);
    }
}

//! Independent numbers by index.

use crate::stream::Stream;

/// Independent uniform words by index, from a key of 64 bits: cheaper than a stream where only few of many are needed.
///
/// # Source
/// SplitMix64: Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
#[derive(Clone, Copy, Debug)]
pub struct Hashed {
    key: u64,
}

impl Hashed {
    /// The numbers of the next two words of a stream.
    pub fn from_stream(stream: &mut Stream) -> Hashed {
        Hashed { key: u64::from(stream.word()) << 32 | u64::from(stream.word()) }
    }

    /// Two words.
    #[inline]
    pub fn words(&self, index: u32) -> (u32, u32) {
        let mut z = self.key.wrapping_add((u64::from(index) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        ((z >> 32) as u32, z as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chi-squared over 16 x 16 cells of both words, for 256,000 numbers: 255 degrees of freedom, so mean 255 and
    /// deviation 22.6; the limit of 375 lies 5.3 deviations above the mean.
    #[test]
    fn words_are_uniform_and_independent_of_each_other() {
        let mut stream = Stream::new(3, 4, b"chi-squared test");
        let mut worst = 0.0;
        for number in 0..8 {
            stream.go_to(number);
            let hashed = Hashed::from_stream(&mut stream);
            let mut counts = [[0_u32; 256]; 2];
            for index in 0..256_000 {
                let (first, second) = hashed.words(index);
                counts[0][(first >> 28 << 4 | second >> 28) as usize] += 1;
                let (next, _) = hashed.words(index + 1);
                counts[1][(first >> 28 << 4 | next >> 28) as usize] += 1;
            }
            for counts in counts {
                let sum: f64 =
                    counts.iter().map(|&n| (f64::from(n) - 1000.0) * (f64::from(n) - 1000.0) / 1000.0).sum();
                worst = if sum > worst { sum } else { worst };
            }
        }
        println!("largest chi-squared {worst:.1}, limit 375");
        assert!(worst < 375.0);
    }
}

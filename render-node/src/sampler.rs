//! Random numbers as a pure function of (seed, frame, pixel, sample, dimension).
//!
//! Every pair of dimensions of a pixel is a point set of its own: the first two dimensions of the Sobol
//! sequence, whose points fill the unit square evenly, shuffled and scrambled by three keys. The keys come
//! from ChaCha8 (key: seed and frame, stream: pixel), so points of different pixels and pairs are independent,
//! and each single point is uniform. Nothing is carried from pixel to pixel.
//!
//! The points are made by the crate `random`, which names their source.

use random::{Scrambled, Stream};

/// Separates these random numbers from those that other parts draw from the same seed.
const PURPOSE: &[u8; 16] = b"chainmail render";

/// The random numbers of one pixel at a time.
#[derive(Clone, Debug)]
pub struct Sampler {
    stream: Stream,
    pairs: Vec<Scrambled>,
    sample: u32,
}

impl Sampler {
    /// A sampler of `pairs` pairs of dimensions.
    pub fn new(seed: u64, frame: u64, pairs: usize) -> Sampler {
        let stream = Stream::new(seed, frame, PURPOSE);
        Sampler { stream, pairs: vec![Scrambled::default(); pairs], sample: 0 }
    }

    /// Goes to a sample of a pixel; pixels are numbered row by row from the top left.
    pub fn start(&mut self, pixel: u64, sample: u32) {
        if sample == 0 || self.stream.number() != pixel {
            self.stream.go_to(pixel);
            for points in &mut self.pairs {
                *points = Scrambled::from_stream(&mut self.stream);
            }
        }
        self.sample = sample;
    }

    /// A point in the open unit square: the current sample's values of a pair of dimensions.
    ///
    /// # Panics
    ///
    /// If the sampler was made for fewer pairs.
    #[inline]
    pub fn pair(&self, pair: usize) -> (f64, f64) {
        self.pairs[pair].point(self.sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_samples_fill_every_elementary_box() {
        let mut sampler = Sampler::new(1, 2, 3);
        for pixel in 0..20 {
            for (columns, rows) in [(16, 1), (8, 2), (4, 4), (2, 8), (1, 16)] {
                let mut filled = [false; 16];
                for sample in 0..16 {
                    sampler.start(pixel, sample);
                    let (x, y) = sampler.pair(2);
                    filled[(x * columns as f64) as usize * rows + (y * rows as f64) as usize] = true;
                }
                assert_eq!(filled, [true; 16], "pixel {pixel}, {columns} x {rows} boxes");
            }
        }
    }

    #[test]
    fn a_sample_does_not_depend_on_those_before_it() {
        let mut forward = Sampler::new(9, 0, 2);
        let mut direct = Sampler::new(9, 0, 2);
        for sample in 0..7 {
            forward.start(5, sample);
        }
        direct.start(5, 6);
        assert_eq!(forward.pair(1), direct.pair(1));
        assert_ne!(forward.pair(0), direct.pair(1));
        direct.start(4, 6);
        assert_ne!(forward.pair(1), direct.pair(1));
    }

    /// Chi-squared test that single samples are uniform over pixels, jointly in both dimensions and against
    /// the sample of another pair: 256 cells, so 255 degrees of freedom (mean 255, deviation 22.6); the limit
    /// of 375 lies 5.3 deviations above the mean.
    #[test]
    fn every_sample_is_uniform_over_pixels() {
        let mut worst: f64 = 0.0;
        for sample in [0, 1, 5, 31] {
            let mut sampler = Sampler::new(77, 3, 2);
            let mut counts = [[0_u32; 256]; 3];
            for pixel in 0..25_600 {
                sampler.start(pixel, sample);
                let ((a, b), (c, d)) = (sampler.pair(0), sampler.pair(1));
                let cell = |x: f64, y: f64| (x * 16.0) as usize * 16 + (y * 16.0) as usize;
                counts[0][cell(a, b)] += 1;
                counts[1][cell(a, c)] += 1;
                counts[2][cell(b, d)] += 1;
            }
            for counts in counts {
                let chi_squared: f64 = counts.iter().map(|&n| square(f64::from(n) - 100.0) / 100.0).sum();
                worst = if chi_squared > worst { chi_squared } else { worst };
            }
        }
        println!("largest chi-squared {worst:.1}, limit 375");
        assert!(worst < 375.0, "{worst}");
    }

    fn square(x: f64) -> f64 {
        x * x
    }
}

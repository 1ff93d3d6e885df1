//! Random numbers as a pure function of (seed, frame, pixel, sample, dimension).
//!
//! The one thing to know: nothing is carried from pixel to pixel or from sample to sample, so a crop, a range of
//! samples and any sharing out of the work use the very numbers of the whole picture.
//!
//! `sobol`: every pair of dimensions of a pixel is a point set of its own: the first two dimensions of the Sobol
//! sequence, whose points fill the unit square evenly, shuffled and scrambled by three keys. The keys come from ChaCha8
//! (key: seed and frame, stream: pixel), so points of different pixels and pairs are independent, and each single point is
//! uniform. `independent`: two ChaCha8 numbers for each sample and pair. Both are made by the crate `random`, which names
//! their sources.

use core::ops::Range;
use geometry::lanes::{LANES, Level, Simd, dispatch};
use random::{Scrambled, ScrambledColumns, Stream, unit};
use schemas::scene::render;

/// Separates these random numbers from those that other parts draw from the same seed.
const PURPOSE: &[u8; 16] = b"chainmail render";
/// The same for independent numbers.
const PURPOSE_INDEPENDENT: &[u8; 16] = b"chainmail indep.";

/// No more point sets than this are made before they are asked for: those of four bounces.
const USUAL_MAX: usize = 16;

/// The random numbers of one sample of one pixel at a time.
#[derive(Clone, Debug)]
pub struct Sampler {
    points: Points,
}

impl Sampler {
    /// The random numbers of a frame.
    pub fn new(seed: u64, frame: u64, kind: render::Sampler) -> Sampler {
        Sampler { points: Points::new(seed, frame, kind) }
    }

    /// Goes to a sample of a pixel; pixels are numbered row by row from the top left.
    pub fn start(&mut self, pixel: u64, sample: u32) {
        self.points.start(Level::new(), &[pixel], sample..sample + 1);
    }

    /// A point in the open unit square: the current sample's values of a pair of dimensions.
    pub fn pair(&mut self, pair: usize) -> (f64, f64) {
        self.points.pair(self.points.of(0, 0), pair)
    }
}

/// A sample of one of the pixels that [`Points`] is at.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SampleOf {
    /// Which of the pixels.
    place: u32,
    /// Number of the sample within the pixel.
    sample: u32,
}

/// The random numbers of some samples of many pixels.
#[derive(Clone, Debug)]
pub(crate) struct Points {
    stream: Stream,
    kind: render::Sampler,
    pixels: Vec<u64>,
    first_sample: u32,
    samples: u32,
    /// The point sets of each pixel's first pairs of dimensions.
    sets: Vec<Scrambled>,
    /// How many of a pixel there are.
    made: usize,
    /// The point sets of all pairs of a pixel that needed more.
    more: Vec<Vec<Scrambled>>,
    /// How many are made at once: as many as some pixel before it needed. No number depends on it.
    usual: usize,
    /// The independent points of each sample's pairs of dimensions, as far as they were asked for.
    points: Vec<Vec<(f64, f64)>>,
}

impl Points {
    pub(crate) fn new(seed: u64, frame: u64, kind: render::Sampler) -> Points {
        let purpose = match kind {
            render::Sampler::Sobol => PURPOSE,
            render::Sampler::Independent => PURPOSE_INDEPENDENT,
        };
        Points {
            stream: Stream::new(seed, frame, purpose),
            kind,
            pixels: Vec::new(),
            first_sample: 0,
            samples: 0,
            sets: Vec::new(),
            made: 0,
            more: Vec::new(),
            usual: 1,
            points: Vec::new(),
        }
    }

    /// Goes to some samples of some pixels. No bit depends on `level`.
    pub(crate) fn start(&mut self, level: Level, pixels: &[u64], samples: Range<u32>) {
        (self.first_sample, self.samples) = (samples.start, samples.end - samples.start);
        // Point sets are those of all samples of a pixel.
        let same = self.pixels == pixels;
        self.pixels.clear();
        self.pixels.extend_from_slice(pixels);
        match self.kind {
            render::Sampler::Sobol if same => {}
            render::Sampler::Sobol => {
                self.more.iter_mut().for_each(Vec::clear);
                self.more.resize_with(pixels.len(), Vec::new);
                dispatch!(level, simd => simd.vectorize(
                    #[inline(always)]
                    || self.make_sets()
                ));
            }
            render::Sampler::Independent => {
                self.points.iter_mut().for_each(Vec::clear);
                self.points.resize_with(pixels.len() * self.samples as usize, Vec::new);
            }
        }
    }

    /// The first point sets of all pixels: three words each, in the order of pairs.
    #[inline(always)]
    fn make_sets(&mut self) {
        self.made = self.usual;
        self.sets.clear();
        self.sets.resize(self.pixels.len() * self.made, Scrambled::default());
        let mut words = [[[0; LANES]; 16]; (3 * USUAL_MAX).div_ceil(16)];
        let sets = self.sets.chunks_mut(self.made * LANES);
        for (pixels, sets) in self.pixels.chunks(LANES).zip(sets) {
            let mut numbers = [0; LANES];
            numbers[..pixels.len()].copy_from_slice(pixels);
            for (block, words) in words.iter_mut().enumerate().take((3 * self.made).div_ceil(16)) {
                *words = self.stream.blocks(&numbers, block as u32);
            }
            let words = words.as_flattened();
            for (lane, sets) in sets.chunks_exact_mut(self.made).enumerate() {
                for (pair, set) in sets.iter_mut().enumerate() {
                    let word = [words[3 * pair][lane], words[3 * pair + 1][lane], words[3 * pair + 2][lane]];
                    *set = Scrambled::from_words(word);
                }
            }
        }
    }

    /// Sample k of pixel p of those that this is at.
    #[inline(always)]
    pub(crate) fn of(&self, place: u32, k: u32) -> SampleOf {
        SampleOf { place, sample: self.first_sample + k }
    }

    /// A point in the open unit square: a sample's values of a pair of dimensions.
    #[inline]
    pub(crate) fn pair(&mut self, of: SampleOf, pair: usize) -> (f64, f64) {
        match self.kind {
            render::Sampler::Sobol => self.set(of, pair).point(of.sample),
            render::Sampler::Independent => self.independent(of, pair),
        }
    }

    /// The same, to be made later together with those of other lanes.
    #[inline(always)]
    pub(crate) fn put(&mut self, of: SampleOf, pair: usize, lane: usize, squares: &mut Squares) {
        if self.kind == render::Sampler::Sobol {
            squares.sets.put(lane, &self.set(of, pair), of.sample);
        } else {
            let point = self.independent(of, pair);
            (squares.given[0][lane], squares.given[1][lane]) = point;
            squares.are_given = true;
        }
    }

    #[inline(always)]
    fn set(&mut self, of: SampleOf, pair: usize) -> Scrambled {
        if pair < self.made {
            return self.sets[of.place as usize * self.made + pair];
        }
        self.later_set(of, pair)
    }

    #[inline(never)]
    fn later_set(&mut self, SampleOf { place, .. }: SampleOf, pair: usize) -> Scrambled {
        if self.usual <= pair && pair < USUAL_MAX {
            self.usual = pair + 1;
        }
        let place = place as usize;
        let sets = &mut self.more[place];
        if sets.len() <= pair {
            // Twice as many as before, so that starting anew costs no more than going on. Words are drawn in the order of
            // pairs, whichever is asked for first.
            let count = (2 * sets.len()).max(pair + 1);
            sets.clear();
            self.stream.go_to(self.pixels[place]);
            sets.extend((0..count).map(|_| Scrambled::from_stream(&mut self.stream)));
        }
        sets[pair]
    }

    #[inline(never)]
    fn independent(&mut self, SampleOf { place, sample }: SampleOf, pair: usize) -> (f64, f64) {
        let points = &mut self.points[(place * self.samples + (sample - self.first_sample)) as usize];
        if points.len() <= pair {
            let count = (2 * points.len()).max(self.usual).max(pair + 1);
            points.clear();
            self.stream.go_to_part(self.pixels[place as usize], sample);
            let stream = &mut self.stream;
            points.extend((0..count).map(|_| (unit(stream.word()), unit(stream.word()))));
        }
        points[pair]
    }
}

/// A point of the unit square for each of sixteen lanes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Squares {
    /// Whose points they are.
    sets: ScrambledColumns<LANES>,
    /// The points themselves.
    given: [[f64; LANES]; 2],
    are_given: bool,
}

impl Squares {
    /// First and second coordinates.
    #[inline(always)]
    pub(crate) fn points(&self) -> [[f64; LANES]; 2] {
        if self.are_given { self.given } else { self.sets.points() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use render::Sampler::{Independent, Sobol};

    #[test]
    fn sixteen_samples_fill_every_elementary_box() {
        let mut sampler = Sampler::new(1, 2, Sobol);
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
        for kind in [Sobol, Independent] {
            let mut forward = Sampler::new(9, 0, kind);
            let mut direct = Sampler::new(9, 0, kind);
            for sample in 0..7 {
                forward.start(5, sample);
                forward.pair(sample as usize);
            }
            direct.start(5, 6);
            // Neither does a pair on which was asked for first.
            let last = direct.pair(40);
            assert_eq!(forward.pair(1), direct.pair(1));
            assert_eq!(forward.pair(40), last);
            assert_ne!(forward.pair(0), direct.pair(1));
            direct.start(4, 6);
            assert_ne!(forward.pair(1), direct.pair(1));
        }
    }

    /// Chi-squared test that single samples are uniform over pixels, jointly in both dimensions and against
    /// the sample of another pair: 256 cells, so 255 degrees of freedom (mean 255, deviation 22.6); the limit
    /// of 375 lies 5.3 deviations above the mean.
    #[test]
    fn every_sample_is_uniform_over_pixels() {
        let mut worst: f64 = 0.0;
        for (kind, sample) in
            [(Sobol, 0), (Sobol, 1), (Sobol, 5), (Sobol, 31), (Independent, 0), (Independent, 31)]
        {
            let mut sampler = Sampler::new(77, 3, kind);
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

    /// The same for the samples of one pixel, which are independent of each other only with the one sampler.
    #[test]
    fn independent_samples_of_a_pixel_are_uniform_and_independent() {
        let mut sampler = Sampler::new(78, 3, Independent);
        let mut counts = [0_u32; 256];
        let mut last = 0.5;
        for sample in 0..25_600 {
            sampler.start(123, sample);
            let (x, _) = sampler.pair(3);
            counts[(x * 16.0) as usize * 16 + (last * 16.0) as usize] += 1;
            last = x;
        }
        let chi_squared: f64 = counts.iter().map(|&n| square(f64::from(n) - 100.0) / 100.0).sum();
        println!("chi-squared {chi_squared:.1}, limit 375");
        assert!(chi_squared < 375.0, "{chi_squared}");
    }

    fn square(x: f64) -> f64 {
        x * x
    }
}

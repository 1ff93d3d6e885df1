//! The film: linear radiance of every pixel.

use geometry::Vec3;
use schemas::Hash;

/// A rendered frame before it becomes a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Width in pixels.
    pub width_px: u32,
    /// Height in pixels.
    pub height_px: u32,
    /// Mean radiance (red, green, blue) of every pixel, row by row from the top left.
    pub rgb: Vec<[f64; 3]>,
    /// What the means were made of, in the same order; more samples are added to it.
    pub sums: Vec<PixelSums>,
    /// Rays traced: camera, bounce and shadow rays.
    pub rays: u64,
    /// Samples that came out as NaN or infinite; they are counted here and left out of the mean.
    pub non_finite_samples: u64,
    /// The first of those samples, in the order of pixels and samples.
    pub first_non_finite: Option<SamplePlace>,
}

/// Sums over the finite samples of a pixel, in the order of the samples.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PixelSums {
    /// Radiance.
    pub radiance: Vec3,
    /// Squares of the luminance.
    pub luminance_squared: f64,
    /// How many samples there are.
    pub count: u32,
}

impl PixelSums {
    /// Adds a sample.
    pub fn add(&mut self, radiance: &Vec3) {
        let luminance = luminance(radiance);
        self.radiance += radiance;
        self.luminance_squared += luminance * luminance;
        self.count += 1;
    }

    /// The mean radiance; zero where there is no sample.
    pub fn mean(&self) -> Vec3 {
        if self.count > 0 { self.radiance / f64::from(self.count) } else { self.radiance }
    }

    /// The variance of the luminance of the mean, estimated from the spread of the samples; zero below two samples. With the
    /// `sobol` sampler, whose samples keep apart from each other, the mean is better than this.
    pub fn variance(&self) -> f64 {
        if self.count < 2 {
            return 0.0;
        }
        let count = f64::from(self.count);
        let mean = luminance(&self.radiance) / count;
        let spread = (self.luminance_squared / count - mean * mean) / (count - 1.0);
        if spread > 0.0 { spread } else { 0.0 }
    }
}

/// The luminance of linear sRGB.
///
/// # Source
/// ITU-R BT.709, table 3.
pub fn luminance(rgb: &Vec3) -> f64 {
    0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z
}

/// A sample of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SamplePlace {
    /// Row of the whole picture, from 0 at the top.
    pub y_px: u32,
    /// Column, from 0 at the left.
    pub x_px: u32,
    /// Number of the sample within the pixel, from 0.
    pub sample: u32,
}

impl Film {
    /// A film on which no light has fallen.
    pub fn black(width_px: u32, height_px: u32) -> Film {
        let pixels = width_px as usize * height_px as usize;
        Film {
            width_px,
            height_px,
            rgb: vec![[0.0; 3]; pixels],
            sums: vec![PixelSums::default(); pixels],
            rays: 0,
            non_finite_samples: 0,
            first_non_finite: None,
        }
    }

    /// The hash of the pixels: BLAKE3 of width and height as `u32`, then red, green and blue as `f64`, row by
    /// row from the top, all little-endian.
    pub fn hash(&self) -> Hash {
        let mut bytes = Vec::with_capacity(8 + 24 * self.rgb.len());
        bytes.extend_from_slice(&self.width_px.to_le_bytes());
        bytes.extend_from_slice(&self.height_px.to_le_bytes());
        for channel in self.rgb.iter().flatten() {
            bytes.extend_from_slice(&channel.to_le_bytes());
        }
        Hash::of(&bytes)
    }

    /// Samples of all pixels together, those that are not finite left out.
    pub fn samples(&self) -> u64 {
        self.sums.iter().map(|sums| u64::from(sums.count)).sum()
    }
}

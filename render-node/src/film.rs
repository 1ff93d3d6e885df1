//! The film: linear radiance of every pixel.

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
    /// Rays traced: camera, bounce and shadow rays.
    pub rays: u64,
    /// Samples that came out as NaN or infinite; they are counted here and left out of the mean.
    pub non_finite_samples: u64,
    /// The first of those samples, in the order of pixels and samples.
    pub first_non_finite: Option<SamplePlace>,
}

/// A sample of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SamplePlace {
    /// Row, from 0 at the top.
    pub y_px: u32,
    /// Column, from 0 at the left.
    pub x_px: u32,
    /// Number of the sample within the pixel, from 0.
    pub sample: u32,
}

impl Film {
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
}

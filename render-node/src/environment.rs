//! Environment maps: light from all around, by direction, and its sampling by importance.
//!
//! The one thing to know: the map is constant over each of its texels, in light as in density, so directions are chosen
//! exactly in proportion to the luminance that comes from them.

use crate::film::luminance;
use core::f64::consts::{PI, TAU};
use geometry::Vec3;

/// A map of the whole sphere of directions: columns of equal turns, rows of equal angles from the zenith (equirectangular).
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    width: usize,
    height: usize,
    /// Radiance (red, green, blue), row by row from the zenith.
    radiance: Vec<Vec3>,
    /// Cosines of the angles from the zenith at which rows begin, and -1.
    row_borders: Vec<f64>,
    /// For each row, and for each texel within its row, the share of the luminance up to its end.
    row_shares: Vec<f64>,
    texel_shares: Vec<f64>,
}

/// Why bytes are no environment map.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// Neither of the formats that are read.
    #[error("it is neither OpenEXR nor Radiance HDR (.exr, .hdr): convert it to one of them")]
    Format,
    /// The OpenEXR reader's reason.
    #[error("it cannot be read as OpenEXR: {0}")]
    OpenExr(String),
    /// What is wrong with a Radiance file.
    #[error("it cannot be read as Radiance HDR: {0}")]
    Radiance(&'static str),
    /// A radiance that is negative, NaN or infinite, or no texel at all.
    #[error(
        "texel {x}, {y} of {width} x {height} has the radiance {radiance:?}: finite numbers from 0 were expected"
    )]
    Texel {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// Columns of the map.
        width: usize,
        /// Rows of the map.
        height: usize,
        /// What is there.
        radiance: [f32; 3],
    },
    /// A map without light cannot be sampled.
    #[error(
        "all of its {width} x {height} texels are black: leave out render.environment and set render.sky"
    )]
    Black {
        /// Columns of the map.
        width: usize,
        /// Rows of the map.
        height: usize,
    },
}

/// One direction chosen from a map, in its own frame.
#[derive(Clone, Copy, Debug)]
pub struct MapSample {
    /// The direction; z is the zenith, x lies in the middle of the map's columns.
    pub direction: Vec3,
    /// Radiance that comes from there.
    pub radiance: Vec3,
    /// Density per solid angle.
    pub pdf: f64,
}

impl EnvironmentMap {
    /// Reads OpenEXR or Radiance HDR, whichever the bytes are.
    ///
    /// # Errors
    ///
    /// [`MapError`] if they are neither, or damaged, or hold no light.
    pub fn decode(bytes: &[u8]) -> Result<EnvironmentMap, MapError> {
        let (width, height, texels) = if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            crate::exr_file::decode(bytes).map_err(MapError::OpenExr)?
        } else if bytes.starts_with(b"#?") {
            crate::radiance_file::decode(bytes).map_err(MapError::Radiance)?
        } else {
            return Err(MapError::Format);
        };
        EnvironmentMap::new(width, height, &texels)
    }

    /// A map of texels, row by row from the zenith.
    ///
    /// # Errors
    ///
    /// [`MapError::Texel`] and [`MapError::Black`].
    ///
    /// # Panics
    ///
    /// If there are not as many texels as width and height say.
    pub fn new(width: usize, height: usize, texels: &[[f32; 3]]) -> Result<EnvironmentMap, MapError> {
        assert_eq!(texels.len(), width * height, "a map of {width} x {height} texels");
        let wrong = |texel: &[f32; 3]| !texel.iter().all(|channel| channel.is_finite() && *channel >= 0.0);
        if let Some(index) = texels.iter().position(wrong) {
            let (x, y) = (index % width, index / width);
            return Err(MapError::Texel { x, y, width, height, radiance: texels[index] });
        }
        let radiance: Vec<Vec3> = texels.iter().map(|texel| Vec3::from(texel.map(f64::from))).collect();
        let border = |row: usize| match row {
            0 => 1.0,
            row if row == height => -1.0,
            row => libm::cos(PI * row as f64 / height as f64),
        };
        let row_borders: Vec<f64> = (0..=height).map(border).collect();
        let mut row_shares = Vec::with_capacity(height);
        let mut texel_shares = Vec::with_capacity(radiance.len());
        let mut all = 0.0;
        for (row, texels) in radiance.chunks_exact(width.max(1)).enumerate() {
            let start = texel_shares.len();
            let mut sum = 0.0;
            for texel in texels {
                sum += luminance(texel);
                texel_shares.push(sum);
            }
            if sum > 0.0 {
                texel_shares[start..].iter_mut().for_each(|share| *share /= sum);
            }
            // Texels of a row are equally large.
            all += sum * (row_borders[row] - row_borders[row + 1]);
            row_shares.push(all);
        }
        if !(all > 0.0) {
            return Err(MapError::Black { width, height });
        }
        row_shares.iter_mut().for_each(|share| *share /= all);
        Ok(EnvironmentMap { width, height, radiance, row_borders, row_shares, texel_shares })
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The texel of a direction in the map's frame.
    fn texel(&self, direction: &Vec3) -> (usize, usize) {
        let turn = libm::atan2(direction.y, direction.x) / TAU + 0.5;
        let column = ((turn * self.width as f64) as usize).min(self.width - 1);
        // Rows by their borders, from the zenith down.
        let row = self.row_borders[1..].partition_point(|&border| border > direction.z).min(self.height - 1);
        (column, row)
    }

    /// Radiance from a direction, and the density with which `sample` chooses it.
    pub fn eval(&self, direction: &Vec3) -> (Vec3, f64) {
        let (column, row) = self.texel(direction);
        (self.radiance[row * self.width + column], self.density(column, row))
    }

    /// Chooses a direction with a density in proportion to the luminance from there.
    pub fn sample(&self, (u, v): (f64, f64)) -> MapSample {
        let (row, height) = choose(&self.row_shares, u);
        let texels = row * self.width..(row + 1) * self.width;
        let (column, turn) = choose(&self.texel_shares[texels], v);
        let z = self.row_borders[row] + (self.row_borders[row + 1] - self.row_borders[row]) * height;
        let (cosine, sine) = crate::warp::circle_point((column as f64 + turn) / self.width as f64);
        let squared = 1.0 - z * z;
        let radius = if squared > 0.0 { squared.sqrt() } else { 0.0 };
        MapSample {
            // Columns begin behind: x lies in their middle.
            direction: Vec3::new(-radius * cosine, -radius * sine, z),
            radiance: self.radiance[row * self.width + column],
            pdf: self.density(column, row),
        }
    }

    /// The share of the luminance from a texel, over its solid angle.
    fn density(&self, column: usize, row: usize) -> f64 {
        let row_share = share(&self.row_shares, row);
        let start = row * self.width;
        let texel_share = share(&self.texel_shares[start..start + self.width], column);
        let solid_angle = (self.row_borders[row] - self.row_borders[row + 1]) * TAU / self.width as f64;
        row_share * texel_share / solid_angle
    }
}

/// The share of an entry in a list of running sums.
fn share(sums: &[f64], index: usize) -> f64 {
    sums[index] - if index > 0 { sums[index - 1] } else { 0.0 }
}

/// The first entry whose running sum lies above `u`, and how far `u` is through its share.
fn choose(sums: &[f64], u: f64) -> (usize, f64) {
    let mut index = sums.partition_point(|&sum| sum <= u).min(sums.len() - 1);
    // Rounding may leave the last sum below 1; entries without a share are never chosen.
    while index > 0 && share(sums, index) == 0.0 {
        index -= 1;
    }
    let before = if index > 0 { sums[index - 1] } else { 0.0 };
    let through = (u - before) / share(sums, index);
    (index, if through < 1.0 { through } else { 1.0 })
}

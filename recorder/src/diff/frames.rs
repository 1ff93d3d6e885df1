//! Differences of rendered frames.

use super::Side;
use crate::message::Kind;
use prost::Message as _;
use schemas::frame::{CompressedImage, FrameInfo};
use serde::Serialize;

/// How the frames of two logs differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrameDifference {
    /// Frames of each log.
    pub counts: [usize; 2],
    /// Frames that both have.
    pub compared: usize,
    /// How many of them differ, in the hash of the linear film or in the picture's bytes.
    pub differing: usize,
    /// The first that differs.
    pub first: Option<FirstFrame>,
    /// Error of the pictures over all compared frames; `None` if none differs, or sizes do.
    pub error: Option<PixelError>,
    /// Sizes in pixels, if they differ.
    pub sizes: Option<[[u32; 2]; 2]>,
}

/// The first differing frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FirstFrame {
    /// Its number, from 0.
    pub frame: usize,
    /// The steps that it shows.
    pub steps: [Option<u64>; 2],
    /// Hashes of the linear films.
    pub film_hashes: [Option<String>; 2],
    /// Whether the pictures have the same bytes all the same: then the difference is lost in 8 bits.
    pub picture_is_same: bool,
}

/// Error of pictures, in levels of 0 to 255 of one colour of one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PixelError {
    /// Mean of the absolute differences.
    pub mean: f64,
    /// Largest absolute difference.
    pub max: u8,
}

impl FrameDifference {
    /// Whether there is any difference.
    pub fn differs(&self) -> bool {
        self.counts[0] != self.counts[1] || self.differing > 0
    }
}

pub(super) fn compare(sides: &[Side; 2]) -> Option<FrameDifference> {
    let counts = [0, 1].map(|side| sides[side].count(Kind::Frame).min(sides[side].count(Kind::FrameInfo)));
    if counts == [0, 0] {
        return None;
    }
    let compared = counts[0].min(counts[1]);
    let mut difference =
        FrameDifference { counts, compared, differing: 0, first: None, error: None, sizes: None };
    let mut sums = Sums::default();
    for frame in 0..compared {
        let [image_a, image_b] =
            [0, 1].map(|side| sides[side].message(Kind::Frame, frame).map(|message| message.bytes));
        let [info_a, info_b] =
            [0, 1].map(|side| sides[side].message(Kind::FrameInfo, frame).map(|message| message.bytes));
        if info_a == info_b && image_a == image_b {
            sums.same += 1;
            continue;
        }
        let infos = [0, 1].map(|side| sides[side].json::<FrameInfo>(Kind::FrameInfo, frame));
        let films = infos.each_ref().map(|info| info.as_ref().map(|info| info.film_hash));
        if films[0] == films[1] && image_a == image_b {
            // Only how it was made differs: the scene's keys and the plan tell that.
            sums.same += 1;
            continue;
        }
        difference.differing += 1;
        if difference.first.is_none() {
            difference.first = Some(FirstFrame {
                frame,
                steps: infos.each_ref().map(|info| info.as_ref().map(|info| info.step)),
                film_hashes: films.map(|film| film.map(|hash| hash.to_string())),
                picture_is_same: image_a == image_b,
            });
        }
        let pictures =
            [(0, image_a), (1, image_b)].map(|(side, bytes)| picture(&sides[side], frame, bytes.as_deref()));
        if let [Some(a), Some(b)] = pictures {
            if a.size == b.size {
                sums.add(&a, &b);
            } else if difference.sizes.is_none() {
                difference.sizes = Some([a.size, b.size]);
            }
        }
    }
    difference.error = sums.error().filter(|_| difference.differing > 0 && difference.sizes.is_none());
    Some(difference)
}

/// A decoded picture: 8 bits a colour.
struct Picture {
    size: [u32; 2],
    levels: Vec<u8>,
}

fn picture(side: &Side, frame: usize, bytes: Option<&[u8]>) -> Option<Picture> {
    let refuse = |reason: &dyn std::fmt::Display| {
        side.note(format!("{}: the picture of frame {frame} cannot be read: {reason}", side.log.file()));
    };
    let image = CompressedImage::decode(bytes?).map_err(|error| refuse(&error)).ok()?;
    decode(&image.data).map_err(|error| refuse(&error)).ok()
}

/// The most a picture may take once decoded, in bytes: no claim in a header costs more.
const PICTURE_BYTES_MAX: usize = 4 << 30;

fn decode(bytes: &[u8]) -> Result<Picture, png::DecodingError> {
    let limits = png::Limits { bytes: PICTURE_BYTES_MAX };
    let mut reader = png::Decoder::new_with_limits(std::io::Cursor::new(bytes), limits).read_info()?;
    let too_large = || png::DecodingError::LimitsExceeded;
    let size = reader.output_buffer_size().filter(|&size| size <= PICTURE_BYTES_MAX).ok_or_else(too_large)?;
    let mut levels = vec![0; size];
    let info = reader.next_frame(&mut levels)?;
    levels.truncate(info.buffer_size());
    Ok(Picture { size: [info.width, info.height], levels })
}

/// What the error is made of; whole numbers, so that no order of adding matters.
#[derive(Default)]
struct Sums {
    /// Frames that are the same; they count as so many levels without error.
    same: u64,
    differing: u64,
    levels: u64,
    sum: u64,
    max: u8,
}

impl Sums {
    fn add(&mut self, a: &Picture, b: &Picture) {
        self.differing += 1;
        self.levels += a.levels.len() as u64;
        for (&a, &b) in a.levels.iter().zip(&b.levels) {
            let error = a.abs_diff(b);
            self.sum += u64::from(error);
            self.max = if error > self.max { error } else { self.max };
        }
    }

    fn error(&self) -> Option<PixelError> {
        if self.levels == 0 {
            return None;
        }
        let levels_per_frame = self.levels as f64 / self.differing as f64;
        let levels = levels_per_frame * (self.same + self.differing) as f64;
        Some(PixelError { mean: self.sum as f64 / levels, max: self.max })
    }
}

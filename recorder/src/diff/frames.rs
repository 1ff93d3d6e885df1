//! Differences of rendered frames.

use super::Side;
use super::chunks::{Chunks, Depth};
use crate::message::Kind;
use crate::reader::Log;
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
    /// Error of each differing frame, in order, by its number from 0.
    pub errors: Vec<PixelErrorOfFrame>,
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

/// Error of one frame's picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PixelErrorOfFrame {
    /// The frame, from 0.
    pub frame: usize,
    /// Its error; `None` if the pictures cannot be read or have different sizes.
    pub error: Option<PixelError>,
}

impl FrameDifference {
    /// Whether there is any difference.
    pub fn differs(&self) -> bool {
        self.counts[0] != self.counts[1] || self.differing > 0
    }
}

pub(super) fn compare(sides: &[Side; 2], chunks: &Chunks) -> Option<FrameDifference> {
    let counts = [0, 1].map(|side| sides[side].count(Kind::Frame).min(sides[side].count(Kind::FrameInfo)));
    if counts == [0, 0] {
        return None;
    }
    let compared = counts[0].min(counts[1]);
    let mut difference = FrameDifference {
        counts,
        compared,
        differing: 0,
        first: None,
        error: None,
        errors: Vec::new(),
        sizes: None,
    };
    let mut sums = Sums::default();
    for frame in 0..compared {
        if is_same(sides, chunks, frame) {
            sums.same += 1;
            continue;
        }
        let images = [0, 1].map(|side| sides[side].message(Kind::Frame, frame).map(|message| message.bytes));
        let infos = [0, 1].map(|side| sides[side].json::<FrameInfo>(Kind::FrameInfo, frame));
        let films = infos.each_ref().map(|info| info.as_ref().map(|info| info.film_hash));
        if films[0] == films[1] && images[0] == images[1] {
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
                picture_is_same: images[0] == images[1],
            });
        }
        let pictures = [0, 1].map(|side| noted(&sides[side], frame, picture(images[side].as_deref(), frame)));
        let mut error = None;
        if let [Some(a), Some(b)] = pictures {
            if a.size == b.size {
                error = Some(sums.add(&a, &b));
            } else if difference.sizes.is_none() {
                difference.sizes = Some([a.size, b.size]);
            }
        }
        difference.errors.push(PixelErrorOfFrame { frame, error });
    }
    difference.error = sums.error().filter(|_| difference.differing > 0 && difference.sizes.is_none());
    Some(difference)
}

/// Whether a frame is seen to be the same without reading its picture, or, byte for byte, with it.
fn is_same(sides: &[Side; 2], chunks: &Chunks, frame: usize) -> bool {
    if [Kind::Frame, Kind::FrameInfo].iter().all(|&kind| chunks.hold_the_same(kind, [frame, frame])) {
        return true;
    }
    match chunks.depth() {
        // The film's hash is that of every number of the picture before it was rounded to 8 bits.
        Depth::Claims => {
            let info = |side: &Side| {
                let message = side.log.nth_unchecked(Kind::FrameInfo, frame).ok()?;
                serde_json::from_slice::<FrameInfo>(&message.bytes).ok()
            };
            let [a, b] = [info(&sides[0]), info(&sides[1])];
            a.zip(b).is_some_and(|(a, b)| a.film_hash == b.film_hash && a.render == b.render)
        }
        Depth::Bytes => [Kind::Frame, Kind::FrameInfo].iter().all(|&kind| {
            let [a, b] = [0, 1].map(|side| sides[side].message(kind, frame).map(|message| message.bytes));
            a == b
        }),
    }
}

fn noted(side: &Side, frame: usize, picture: Result<Picture, String>) -> Option<Picture> {
    picture
        .map_err(|reason| {
            side.note(format!("{}: the picture of frame {frame} cannot be read: {reason}", side.log.file()));
        })
        .ok()
}

/// Two pictures of a frame and their difference, side by side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DifferencePicture {
    /// A PNG: the first log's picture, the second's, and the absolute difference of each colour times `gain`.
    pub png: Vec<u8>,
    /// By how much differences are multiplied so that the largest is as bright as can be; 1 if there is none.
    pub gain: u8,
}

/// Shows how a frame of two logs differs.
///
/// # Errors
///
/// Why there is no such picture: a frame is not there, cannot be read, or the two have different sizes.
pub fn difference_picture(a: &Log, b: &Log, frame: usize) -> Result<DifferencePicture, String> {
    let read = |log: &Log| {
        let message = log.nth(Kind::Frame, frame).map_err(|error| error.to_string())?;
        picture(Some(&message.bytes), frame).map_err(|reason| format!("{}: {reason}", log.file()))
    };
    let (a, b) = (read(a)?, read(b)?);
    if a.size != b.size {
        let ([width_a, height_a], [width_b, height_b]) = (a.size, b.size);
        return Err(format!("frame {frame} is {width_a} x {height_a} and {width_b} x {height_b} pixels"));
    }
    let max = a.levels.iter().zip(&b.levels).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
    let gain = u8::MAX.checked_div(max).unwrap_or(1);
    let difference: Vec<u8> = a.levels.iter().zip(&b.levels).map(|(a, b)| a.abs_diff(*b) * gain).collect();
    let [width, height] = a.size;
    let row = 3 * width as usize;
    let mut levels = Vec::with_capacity(3 * a.levels.len());
    if row > 0 {
        for ((a, b), d) in
            a.levels.chunks_exact(row).zip(b.levels.chunks_exact(row)).zip(difference.chunks_exact(row))
        {
            levels.extend_from_slice(a);
            levels.extend_from_slice(b);
            levels.extend_from_slice(d);
        }
    }
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, 3 * width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&levels));
    written.map_err(|error| error.to_string())?;
    Ok(DifferencePicture { png, gain })
}

/// A decoded picture: 8 bits a colour.
struct Picture {
    size: [u32; 2],
    levels: Vec<u8>,
}

fn picture(bytes: Option<&[u8]>, frame: usize) -> Result<Picture, String> {
    let bytes = bytes.ok_or_else(|| format!("frame {frame} is not there"))?;
    let image = CompressedImage::decode(bytes).map_err(|error| error.to_string())?;
    decode(&image.data)
}

/// The most a picture may take once decoded, in bytes: no claim in a header costs more.
const PICTURE_BYTES_MAX: usize = 4 << 30;

fn decode(bytes: &[u8]) -> Result<Picture, String> {
    let limits = png::Limits { bytes: PICTURE_BYTES_MAX };
    let refuse = |error: png::DecodingError| error.to_string();
    let decoder = png::Decoder::new_with_limits(std::io::Cursor::new(bytes), limits);
    let mut reader = decoder.read_info().map_err(refuse)?;
    let size = reader.output_buffer_size().filter(|&size| size <= PICTURE_BYTES_MAX);
    let mut levels = vec![0; size.ok_or_else(|| refuse(png::DecodingError::LimitsExceeded))?];
    let info = reader.next_frame(&mut levels).map_err(refuse)?;
    levels.truncate(info.buffer_size());
    if (info.color_type, info.bit_depth) != (png::ColorType::Rgb, png::BitDepth::Eight) {
        return Err("it is not of 8 bits of red, green and blue".to_owned());
    }
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
    /// Adds a frame; returns its own error.
    fn add(&mut self, a: &Picture, b: &Picture) -> PixelError {
        let errors = || a.levels.iter().zip(&b.levels).map(|(&a, &b)| a.abs_diff(b));
        let (sum, max) = (errors().map(u64::from).sum::<u64>(), errors().max().unwrap_or(0));
        self.differing += 1;
        self.levels += a.levels.len() as u64;
        self.sum += sum;
        self.max = self.max.max(max);
        PixelError { mean: if sum == 0 { 0.0 } else { sum as f64 / a.levels.len() as f64 }, max }
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

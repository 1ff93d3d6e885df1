//! `sheet`: a contact sheet, one picture of several frames.

use crate::failure::{Exit, Failure, Outcome};
use crate::log_file;
use crate::movie::Picture;
use clap::Args;
use recorder::{Kind, Log};
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Example:\n  chainmail sheet out/drop/log.mcap --out drop.png --count 12")]
pub struct Arguments {
    /// The log
    log: PathBuf,
    /// The picture to write
    #[arg(long, value_name = "PNG")]
    out: PathBuf,
    /// Frames to show, evenly spaced from the first to the last
    #[arg(long, value_name = "N", default_value_t = 12)]
    count: usize,
    /// Width of one frame on the sheet, in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 320)]
    width: usize,
    /// Replace a picture that exists
    #[arg(long)]
    force: bool,
}

/// Width of the frames on a sheet that a verb makes by the way.
pub const WIDTH_PX: usize = 320;
/// Space around each frame, in pixels.
const MARGIN_PX: usize = 4;

pub fn run(arguments: &Arguments) -> Outcome {
    let log = log_file::open(&arguments.log)?;
    if arguments.out.exists() && !arguments.force {
        return Err(Failure::input(format!(
            "{} exists; name another with --out, or add --force to replace it",
            arguments.out.display()
        )));
    }
    if arguments.count == 0 || arguments.width == 0 {
        return Err(Failure::input("--count and --width: expected 1 or more"));
    }
    let count = log.count(Kind::Frame);
    if count == 0 {
        return Err(Failure::input(format!(
            "{}: it has no frames; `chainmail rerender` makes a log with frames from it",
            log.file()
        )));
    }
    let frames =
        chosen(count, arguments.count).map(|index| frame(&log, index)).collect::<Result<Vec<_>, _>>()?;
    write(&arguments.out, &frames, arguments.width)?;
    log_file::refuse_damage(&log)?;
    Ok(Exit::Done)
}

fn frame(log: &Log, index: usize) -> Result<Vec<u8>, Failure> {
    Ok(log.frame(index).map_err(log_file::failure)?.data)
}

/// So many of `count` things, evenly spaced from the first to the last.
pub fn chosen(count: usize, wanted: usize) -> impl Iterator<Item = usize> {
    let wanted = wanted.min(count);
    (0..wanted).map(move |k| if wanted > 1 { k * (count - 1) / (wanted - 1) } else { 0 })
}

/// Writes a sheet of PNG pictures, in rows about as wide as high.
pub fn write(path: &Path, pngs: &[Vec<u8>], width: usize) -> Result<(), Failure> {
    let frames = pngs.iter().map(|png| Ok(smaller(&Picture::from_png(png)?, width)));
    let frames = frames.collect::<Result<Vec<_>, String>>().map_err(Failure::lost)?;
    let sheet = arranged(&frames);
    let bytes = encode(&sheet).map_err(Failure::lost)?;
    fs::write(path, bytes).map_err(|error| Failure::lost(format!("cannot write {}: {error}", path.display())))
}

/// A picture of this width at most: each pixel is the mean of those that it covers.
fn smaller(picture: &Picture, width: usize) -> Picture {
    let width = width.min(picture.width);
    let height = (picture.height * width / picture.width).max(1);
    let mut rgb = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        let rows = y * picture.height / height..((y + 1) * picture.height).div_ceil(height);
        for x in 0..width {
            let columns = x * picture.width / width..((x + 1) * picture.width).div_ceil(width);
            let count = rows.len() * columns.len();
            for channel in 0..3 {
                let row = |y: usize| columns.clone().map(move |x| 3 * (y * picture.width + x) + channel);
                let sum: usize =
                    rows.clone().flat_map(row).map(|index| usize::from(picture.rgb[index])).sum();
                rgb.push(((sum + count / 2) / count) as u8);
            }
        }
    }
    Picture { width, height, rgb }
}

/// The pictures in rows, on black.
fn arranged(frames: &[Picture]) -> Picture {
    let cell = |side: fn(&Picture) -> usize| frames.iter().map(side).max().unwrap_or(0) + MARGIN_PX;
    let (cell_width, cell_height) = (cell(|frame| frame.width), cell(|frame| frame.height));
    let in_width =
        |columns: usize| columns * cell_width < frames.len().div_ceil(columns) * cell_height * 4 / 3;
    let columns = (1..=frames.len()).take_while(|&columns| columns == 1 || in_width(columns)).count();
    let (width, height) =
        (columns * cell_width + MARGIN_PX, frames.len().div_ceil(columns) * cell_height + MARGIN_PX);
    let mut rgb = vec![0; 3 * width * height];
    for (index, frame) in frames.iter().enumerate() {
        let (left, top) =
            (index % columns * cell_width + MARGIN_PX, index / columns * cell_height + MARGIN_PX);
        for (y, row) in frame.rgb.chunks_exact(3 * frame.width).enumerate() {
            let start = 3 * ((top + y) * width + left);
            rgb[start..start + row.len()].copy_from_slice(row);
        }
    }
    Picture { width, height, rgb }
}

fn encode(picture: &Picture) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width as u32, picture.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&picture.rgb)?;
    writer.finish()?;
    Ok(bytes)
}

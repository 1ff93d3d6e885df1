//! Short words for the keys of `render.*` that one changes most.

use crate::failure::Failure;
use clap::Args;
use schemas::scene::render::Render;
use std::io::IsTerminal;
use std::ops::RangeInclusive;

/// Set in the environment of a terminal whose pictures shall be previews.
const PREVIEW_VARIABLE: &str = "CHAINMAIL_PREVIEW";

#[derive(Args)]
pub struct Shorthands {
    /// Samples a pixel: short for --set render.samples_per_pixel=N
    #[arg(long, value_name = "N")]
    spp: Option<u32>,
    /// Width and height in pixels, as in 1920x1080
    #[arg(long, value_name = "WxH")]
    size: Option<String>,
    /// Where the camera stands, and what it looks at if that follows: X,Y,Z or X,Y,Z:X,Y,Z in metres
    #[arg(long, value_name = "POINT[:POINT]", allow_hyphen_values = true)]
    camera: Option<String>,
    /// The part of the picture to render, in pixels
    #[arg(long, value_name = "LEFT,TOP,WIDTH,HEIGHT")]
    crop: Option<String>,
    /// Half the width and height, a quarter of the samples; CHAINMAIL_PREVIEW=1 asks for it on a terminal
    #[arg(long)]
    preview: bool,
}

impl Shorthands {
    /// The same as overrides of the keys of a scene's second half.
    pub fn overrides(&self, render: &Render) -> Result<Vec<String>, Failure> {
        let mut set = Vec::new();
        let (mut width, mut height) = (render.width_px, render.height_px);
        if let Some(size) = &self.size {
            let pixels = |text: &str| text.trim().parse::<u32>().ok();
            let sides = size.split_once(['x', 'X']).and_then(|(w, h)| pixels(w).zip(pixels(h)));
            (width, height) = sides.ok_or_else(|| {
                Failure::input(format!("--size {size}: expected width and height in pixels, as in 1920x1080"))
            })?;
        }
        let mut samples = self.spp.unwrap_or(render.samples_per_pixel);
        if self.is_preview() {
            samples = samples.div_ceil(4);
            // A crop counts the pixels of the whole picture: it would name another part of a smaller one.
            if self.crop.is_none() && render.crop_px.is_none() {
                (width, height) = (width.div_ceil(2), height.div_ceil(2));
            }
        }
        for (key, value, old) in [
            ("samples_per_pixel", samples, render.samples_per_pixel),
            ("width_px", width, render.width_px),
            ("height_px", height, render.height_px),
        ] {
            if value != old {
                set.push(format!("render.{key}={value}"));
            }
        }
        if let Some(camera) = &self.camera {
            let (position, look_at) = match camera.split_once(':') {
                Some((position, look_at)) => (position, Some(look_at)),
                None => (camera.as_str(), None),
            };
            let point = |text: &str| {
                numbers::<3>(text).ok_or_else(|| {
                    Failure::input(format!(
                        "--camera {camera}: expected a point as in 1,0.5,8, or two with a colon between them: where the \
                         camera stands, and what it looks at"
                    ))
                })
            };
            set.push(format!("render.camera.position_m={:?}", point(position)?));
            if let Some(look_at) = look_at {
                set.push(format!("render.camera.look_at_m={:?}", point(look_at)?));
            }
            if !render.camera.path.is_empty() {
                set.push("render.camera.path=[]".to_owned());
            }
        }
        if let Some(crop) = &self.crop {
            let expected = || {
                Failure::input(format!(
                    "--crop {crop}: expected left, top, width and height in pixels, as in 100,50,320,180"
                ))
            };
            let part: Vec<u32> = crop.split(',').map_while(|text| text.trim().parse().ok()).collect();
            if part.len() != 4 || crop.split(',').count() != 4 {
                return Err(expected());
            }
            set.push(format!("render.crop_px={part:?}"));
        }
        Ok(set)
    }

    fn is_preview(&self) -> bool {
        let asked =
            || std::env::var_os(PREVIEW_VARIABLE).is_some_and(|value| !value.is_empty() && value != "0");
        self.preview || std::io::stdout().is_terminal() && asked()
    }
}

/// Numbers with commas between them.
fn numbers<const COUNT: usize>(text: &str) -> Option<[f64; COUNT]> {
    let numbers: Vec<f64> = text.split(',').map_while(|text| text.trim().parse().ok()).collect();
    let whole = text.split(',').count() == COUNT && numbers.iter().all(|number| number.is_finite());
    if whole { numbers.try_into().ok() } else { None }
}

/// Every N-th frame, beginning with the I-th: `3/8`. Neighbours take about as long, so shares do, too.
pub fn share(text: &str, count: u64) -> Result<Vec<u64>, Failure> {
    let number = |text: &str| text.trim().parse::<u64>().ok();
    match text.split_once('/').and_then(|(share, of)| number(share).zip(number(of))) {
        Some((share, of)) if 0 < share && share <= of => {
            Ok((share - 1..count).step_by(usize::try_from(of).unwrap_or(usize::MAX)).collect())
        }
        _ => Err(Failure::input(format!(
            "--share {text}: expected the number of a share, from 1, and how many there are, as in 3/8"
        ))),
    }
}

/// A frame, or a range of them with both ends: `7`, `10-20`.
pub fn frame_range(text: &str, count: u64) -> Result<RangeInclusive<u64>, Failure> {
    let number = |text: &str| text.trim().parse::<u64>().ok();
    let range = match text.split_once('-') {
        Some((first, last)) => number(first).zip(number(last)),
        None => number(text).map(|frame| (frame, frame)),
    };
    match range {
        Some((first, last)) if first <= last && last < count => Ok(first..=last),
        _ => Err(Failure::input(format!(
            "--frames {text}: expected a frame or a range of them, as in 7 or 10-20, from 0 to {}",
            count.saturating_sub(1)
        ))),
    }
}

//! From linear radiance to an 8-bit sRGB picture in a PNG file.

use crate::film::Film;
use crate::tone::tone_map;
use geometry::Vec3;
use schemas::scene::render::Render;
use std::sync::OnceLock;

/// `THRESHOLDS[k]` is the linear value from which on the 8-bit sRGB code `k + 1` is the nearest.
static THRESHOLDS: OnceLock<[f64; 255]> = OnceLock::new();

/// The 8-bit sRGB code of a linear value: 0 up to black, 255 from white on. NaN gives 0.
///
/// # Source
/// IEC 61966-2-1. The code is that whose linear value is nearest to the given one *after* encoding, found in a
/// table of the 255 values where it changes, so nothing is left to the rounding of a power at run time.
pub fn srgb_code(linear: f64) -> u8 {
    THRESHOLDS.get_or_init(thresholds).partition_point(|&threshold| threshold <= linear) as u8
}

fn thresholds() -> [f64; 255] {
    std::array::from_fn(|k| {
        let encoded = (k as f64 + 0.5) / 255.0;
        if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
    })
}

/// The film as 8-bit sRGB: three bytes a pixel, row by row from the top left, with the settings' exposure and tone mapping.
pub fn srgb_bytes(film: &Film, settings: &Render) -> Vec<u8> {
    let pixel = |rgb: &[f64; 3]| {
        let light = tone_map(&(Vec3::from(*rgb) * settings.exposure), settings.tone_mapping);
        [srgb_code(light.x), srgb_code(light.y), srgb_code(light.z)]
    };
    film.rgb.iter().flat_map(pixel).collect()
}

/// The film as a PNG file in memory: 8 bits, red, green, blue, marked as sRGB.
///
/// # Errors
///
/// If the encoder fails, which it does not for a film whose size is right.
pub fn png_bytes(film: &Film, settings: &Render) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, film.width_px, film.height_px);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&srgb_bytes(film, settings))?;
    writer.finish()?;
    Ok(bytes)
}

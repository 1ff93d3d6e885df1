//! OpenEXR files in memory: linear numbers, 32 bits each.

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    LineOrder, MetaData, ReadChannels, ReadLayers, Vec2, WritableImage, read,
};
use std::io::Cursor;

/// A picture of more texels is refused before there is room for it.
const TEXELS_MAX: usize = 1 << 28;

/// Width, height and texels (red, green, blue), row by row from the top.
type Picture = (usize, usize, Vec<[f32; 3]>);

/// A file of named channels of `width` x `height` numbers each, row by row from the top. The same bytes every time.
///
/// # Errors
///
/// The encoder's reason, for a picture that it does not know how to write.
pub fn encode(width: usize, height: usize, channels: Vec<(String, Vec<f32>)>) -> Result<Vec<u8>, String> {
    let channels = channels.into_iter().map(|(name, samples)| {
        assert_eq!(samples.len(), width * height, "channel {name} of {width} x {height} pixels");
        AnyChannel::new(name.as_str(), FlatSamples::F32(samples))
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let channels = AnyChannels::sort(channels.collect());
    let layer = Layer::new(Vec2(width, height), LayerAttributes::default(), encoding, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|error| error.to_string())?;
    Ok(bytes.into_inner())
}

/// Reads the red, green and blue channels of the first layer that has them; the reason if that cannot be done.
pub(crate) fn decode(bytes: &[u8]) -> Result<Picture, String> {
    let head = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| error.to_string())?;
    for header in &head.headers {
        let Vec2(width, height) = header.layer_size;
        if width.saturating_mul(height) > TEXELS_MAX {
            return Err(format!("it says that it has {width} x {height} texels: at most 2^28 are read"));
        }
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |Vec2(width, height), _| (width, vec![[0.0_f32; 3]; width * height]),
            |(width, texels): &mut (usize, Vec<[f32; 3]>),
             Vec2(x, y),
             (red, green, blue): (f32, f32, f32)| {
                texels[y * *width + x] = [red, green, blue];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| error.to_string())?;
    let Vec2(width, height) = image.layer_data.size;
    Ok((width, height, image.layer_data.channel_data.pixels.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read() {
        let plane = |factor: f32| (0..15).map(|k| k as f32 * factor).collect::<Vec<_>>();
        let channels = || {
            ["R", "G", "B", "Z"].iter().zip([1.0, 0.5, 1e-3, 1e9]).map(|(n, f)| ((*n).to_owned(), plane(f)))
        };
        let bytes = encode(5, 3, channels().collect()).expect("it is written");
        assert_eq!(bytes, encode(5, 3, channels().collect()).expect("it is written"), "the same bytes");
        let (width, height, texels) = decode(&bytes).expect("it is read");
        assert_eq!((width, height), (5, 3));
        assert_eq!(texels[7], [7.0, 3.5, 7.0 * 1e-3]);
    }

    #[test]
    fn cut_and_broken_files_are_errors() {
        let channels = ["R", "G", "B"].map(|name| (name.to_owned(), vec![0.5; 16]));
        let bytes = encode(4, 4, channels.to_vec()).expect("it is written");
        for cut in 0..bytes.len() {
            assert!(decode(&bytes[..cut]).is_err(), "cut at {cut}");
        }
        assert!(decode(b"\x76\x2f\x31\x01 and nothing more").is_err());
    }
}

//! An H.264 movie in an MP4 file, encoded in process.

use muxide::api::{Muxer, MuxerBuilder, VideoCodec};
use openh264::encoder::{
    BitRate, Complexity, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, QpRange,
    RateControlMode, VuiConfig,
};
use openh264::formats::{RgbSliceU8, YUVBuffer};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// One decoded picture: 8-bit red, green, blue, row by row from the top.
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// `3 * width * height` bytes.
    pub rgb: Vec<u8>,
}

impl Picture {
    /// Reads a PNG as the renderer writes it: 8 bits, red, green, blue.
    pub fn from_png(bytes: &[u8]) -> Result<Picture, String> {
        let fail = |error: png::DecodingError| format!("a frame of the log is not a PNG: {error}");
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().map_err(fail)?;
        // No packed bytes hold more than so many times their number: a size beyond that is not that of a picture.
        const PACKED_MAX: usize = 1032;
        let size = reader.output_buffer_size().filter(|&size| size / PACKED_MAX <= bytes.len());
        let size = size.ok_or("a frame of the log claims to be larger than its bytes can be")?;
        let mut rgb = vec![0; size];
        let info = reader.next_frame(&mut rgb).map_err(fail)?;
        if info.color_type != png::ColorType::Rgb || info.bit_depth != png::BitDepth::Eight {
            return Err("a frame of the log is not an 8-bit RGB picture".to_owned());
        }
        rgb.truncate(info.buffer_size());
        Ok(Picture { width: info.width as usize, height: info.height as usize, rgb })
    }

    /// The same picture with even sides, as 4:2:0 video needs: the last column or row is repeated.
    fn padded_to_even(self) -> Picture {
        let (width, height) = (self.width.next_multiple_of(2), self.height.next_multiple_of(2));
        if (width, height) == (self.width, self.height) {
            return self;
        }
        let mut rgb = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            let row = &self.rgb[3 * self.width * y.min(self.height - 1)..][..3 * self.width];
            rgb.extend_from_slice(row);
            if width > self.width {
                rgb.extend_from_slice(&row[3 * (self.width - 1)..]);
            }
        }
        Picture { width, height, rgb }
    }
}

/// An MP4 file that is being written: H.264, one frame after another.
pub struct Movie {
    encoder: Encoder,
    muxer: Muxer<BufWriter<File>>,
    size: (usize, usize),
    frames_per_second: f64,
    frames: u64,
}

impl Movie {
    /// Bits per pixel and frame at most: enough for pictures with a little noise.
    const BITS_PER_PIXEL: f64 = 1.5;
    /// OpenH264 refuses more than 288 million.
    const BITS_PER_SECOND_MAX: f64 = 240e6;

    /// Starts a movie of pictures of the first one's size.
    ///
    /// Fails where the encoder does not take the size; the frames are there all the same.
    pub fn create(path: &Path, first: &Picture, frames_per_second: f64) -> Result<Movie, String> {
        let size = (first.width.next_multiple_of(2), first.height.next_multiple_of(2));
        if size.0 < 16 || size.1 < 16 || size.0 * size.1 > 36_864 * 256 {
            return Err(format!(
                "H.264 takes pictures from 16x16 up to 9.4 million pixels, not {}x{}",
                size.0, size.1
            ));
        }
        let wanted = Self::BITS_PER_PIXEL * (size.0 * size.1) as f64 * frames_per_second;
        let bits_per_second =
            if wanted < Self::BITS_PER_SECOND_MAX { wanted } else { Self::BITS_PER_SECOND_MAX };
        let config = EncoderConfig::new()
            .rate_control_mode(RateControlMode::Bufferbased)
            .bitrate(BitRate::from_bps(bits_per_second.round() as u32))
            .qp(QpRange::new(10, 24))
            .max_frame_rate(FrameRate::from_hz(frames_per_second as f32))
            .intra_frame_period(IntraFramePeriod::from_num_frames(48))
            .complexity(Complexity::High)
            .skip_frames(false)
            .scene_change_detect(false)
            .num_threads(1)
            .vui(VuiConfig::bt601());
        let api = openh264::OpenH264API::from_source();
        let encoder = Encoder::with_api_config(api, config).map_err(|error| error.to_string())?;
        let file =
            File::create(path).map_err(|error| format!("cannot create {}: {error}", path.display()))?;
        let muxer = MuxerBuilder::new(BufWriter::new(file))
            .video(VideoCodec::H264, size.0 as u32, size.1 as u32, frames_per_second)
            .build()
            .map_err(|error| error.to_string())?;
        Ok(Movie { encoder, muxer, size, frames_per_second, frames: 0 })
    }

    /// Appends a picture.
    pub fn push(&mut self, picture: Picture) -> Result<(), String> {
        let picture = picture.padded_to_even();
        if (picture.width, picture.height) != self.size {
            return Err(format!(
                "a frame of {}x{} in a movie of {:?}",
                picture.width, picture.height, self.size
            ));
        }
        let yuv = YUVBuffer::from_rgb8_source(RgbSliceU8::new(&picture.rgb, self.size));
        let encoded = self.encoder.encode(&yuv).map_err(|error| error.to_string())?;
        let key = matches!(encoded.frame_type(), FrameType::IDR | FrameType::I);
        let time_s = self.frames as f64 / self.frames_per_second;
        self.muxer.write_video(time_s, &encoded.to_vec(), key).map_err(|error| error.to_string())?;
        self.frames += 1;
        Ok(())
    }

    /// Completes the file.
    pub fn finish(self) -> Result<(), String> {
        self.muxer.finish().map_err(|error| error.to_string())
    }
}

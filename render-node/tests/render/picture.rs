//! From radiance to bytes.

use crate::staging::{film, scene};
use render_node::{png_bytes, srgb_bytes, srgb_code};

#[test]
fn srgb_codes_are_exact_at_their_own_values() {
    for code in 0..=255_u8 {
        let encoded = f64::from(code) / 255.0;
        let linear =
            if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) };
        assert_eq!(srgb_code(linear), code);
    }
    assert_eq!(srgb_code(0.5), 188);
    assert_eq!(srgb_code(0.18), 118);
}

#[test]
fn srgb_codes_rise_from_black_to_white() {
    let mut last = 0;
    for step in 0..=1_000_000 {
        let code = srgb_code(f64::from(step) * 1e-6);
        assert!(code == last || code == last + 1, "code {code} after {last}");
        last = code;
    }
    assert_eq!(last, 255);
    assert_eq!([-1.0, -0.0, f64::NAN, f64::NEG_INFINITY].map(srgb_code), [0; 4]);
    assert_eq!([1.0, 7.0, f64::INFINITY].map(srgb_code), [255; 3]);
}

#[test]
fn png_holds_the_pixels_and_is_the_same_every_time() {
    let scene = scene(
        "plane = [{ normal = [0, 1, 0], offset_m = -1.0, material = 'a' }]\nrender.width_px = 37\nrender.height_px = 23",
    );
    let film = film(&scene);
    let bytes = png_bytes(&film, 1.5).expect("a film is encoded");
    assert_eq!(bytes, png_bytes(&film, 1.5).expect("a film is encoded"));
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a small picture")];
    let info = reader.next_frame(&mut pixels).expect("a whole PNG");
    assert_eq!((info.width, info.height), (37, 23));
    assert_eq!(pixels, srgb_bytes(&film, 1.5));
    assert_ne!(pixels, srgb_bytes(&film, 1.0));
}

//! From radiance to bytes.

use crate::staging::{film, scene};
use geometry::Vec3;
use render_node::{png_bytes, srgb_bytes, srgb_code, tone_map};
use schemas::scene::render::ToneMapping;

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
    let mut bright = scene.render.clone();
    bright.exposure = 1.5;
    let bytes = png_bytes(&film, &bright).expect("a film is encoded");
    assert_eq!(bytes, png_bytes(&film, &bright).expect("a film is encoded"));
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a small picture")];
    let info = reader.next_frame(&mut pixels).expect("a whole PNG");
    assert_eq!((info.width, info.height), (37, 23));
    assert_eq!(pixels, srgb_bytes(&film, &bright));
    assert_ne!(pixels, srgb_bytes(&film, &scene.render));
}

/// Curves rise, black is black, grey stays grey, much light is white, and middle grey is where its inventors put it.
#[test]
fn tone_mappings_are_film_like() {
    for (mapping, grey_low, grey_high) in
        [(ToneMapping::Srgb, 0.18, 0.18), (ToneMapping::Aces, 0.09, 0.13), (ToneMapping::Agx, 0.16, 0.24)]
    {
        let grey = |light: f64| tone_map(&Vec3::repeat(light), mapping);
        let mut last = -1.0;
        for stop in -200..=100 {
            let shown = grey(libm::exp2(f64::from(stop) / 20.0));
            assert!(shown.x >= last, "{mapping:?} falls at {stop}: {} after {last}", shown.x);
            // The matrices' published digits make rows that add up to 1 within 1e-4.
            assert!(
                (shown.max() - shown.min()).abs() < 2e-3 * shown.x + 1e-6,
                "{mapping:?} tints grey: {shown:?}"
            );
            last = shown.x;
        }
        let (black, middle, white) = (grey(0.0).x, grey(0.18).x, grey(32.0).x);
        println!("{mapping:?}: black {black:.5}, middle grey {middle:.4}, white {white:.4}");
        assert!(black.abs() < 1e-3 && middle >= grey_low && middle <= grey_high && white > 0.97);
    }
    // A light that is far too bright in one colour turns towards white with AgX, and stays what it is with none.
    let red = Vec3::new(50.0, 0.5, 0.5);
    let (plain, soft) = (tone_map(&red, ToneMapping::Srgb), tone_map(&red, ToneMapping::Agx));
    println!("bright red: {plain:?} becomes {soft:?}");
    assert!(soft.y > 0.3 && soft.x > soft.y);
}

//! The film: crops, ranges of samples, filters, variance.

use crate::staging::{film, scene, threads};
use geometry::Vec3;
use render_node::{
    FeatureImages, Film, Job, PixelSums, RenderModel, add_samples, exr_bytes, film_channels, render,
};
use schemas::scene::Scene;

/// A ring of brass over a checkered floor of plastic, a light and a sky.
fn still_life(more: &str) -> Scene {
    scene(&format!(
        "
        ring = [{{ major_radius_m = 1.0, minor_radius_m = 0.3, mass_kg = 1.0, material = 'a', position_m = [0.1, 0.2, 0.3], orientation = [0.6, 0, 0, 0.8] }}]
        plane = [{{ normal = [0, 0, 1], offset_m = -1.0, material = 'b' }}]
        render.width_px = 53
        render.height_px = 37
        render.camera = {{ position_m = [1, -4, 3], up = [0, 0, 1] }}
        render.look.a = {{ bsdf = 'conductor', metal = 'brass', roughness = 0.4 }}
        render.look.b = {{ bsdf = 'plastic', albedo = [0.2, 0.3, 0.7], checker_albedo = [0.8, 0.8, 0.8] }}
        render.light = [{{ shape = 'sphere', position_m = [2, -3, 4], radius_m = 0.5, radiance = [20, 20, 20] }}]
        {more}
        "
    ))
}

const SAMPLERS: [&str; 2] = ["sobol", "independent"];

#[test]
fn a_crop_has_the_pixels_of_the_whole() {
    for sampler in SAMPLERS {
        let text = format!(
            "render.sampler = '{sampler}'\nrender.samples_per_pixel = 6\nrender.filter = {{ shape = 'gaussian', radius_px = 1.5 }}"
        );
        let whole = film(&still_life(&text));
        for crop in [[0, 0, 53, 37], [17, 5, 20, 31], [52, 36, 1, 1], [0, 20, 53, 1]] {
            let [left, top, width, height] = crop;
            let part =
                film(&still_life(&format!("{text}\nrender.crop_px = [{left}, {top}, {width}, {height}]")));
            assert_eq!((part.width_px, part.height_px), (width, height));
            for y in 0..height {
                let start = ((top + y) * 53 + left) as usize;
                let row = &whole.sums[start..start + width as usize];
                let found = &part.sums[(y * width) as usize..((y + 1) * width) as usize];
                assert_eq!(found, row, "{sampler}, crop {crop:?}, row {y}");
            }
        }
    }
}

/// Renders a range of samples on top of a film.
fn add(scene: &Scene, samples: core::ops::Range<u32>, film: Film, count: usize) -> Film {
    let (model, _) = RenderModel::compile(scene);
    let job = Job { frame: 3, seed: scene.seed, threads: threads(count) };
    add_samples(&model, &scene.initial_bodies(), &job, samples, film, &mut || true)
        .expect("the state is the scene's")
        .expect("nobody gave up")
}

#[test]
fn samples_in_two_parts_are_samples_in_one() {
    for sampler in SAMPLERS {
        let scene = still_life(&format!("render.sampler = '{sampler}'\nrender.samples_per_pixel = 48"));
        let (model, _) = RenderModel::compile(&scene);
        let whole = render(&model, &scene.initial_bodies(), 3, scene.seed, threads(2)).expect("a state");
        let black = || Film::black(53, 37);
        let parts = add(&scene, 16..48, add(&scene, 0..16, black(), 1), 3);
        assert_eq!(parts, whole, "{sampler}");
        let single = (0..48).fold(black(), |film, sample| add(&scene, sample..sample + 1, film, 2));
        assert_eq!(single, whole, "{sampler}, one by one");
    }
}

/// The mean of a filter over a half plane, at distances from its edge: what a picture of an edge is. The edge is the
/// horizon between a black floor and a white sky, seen from just above a floor that ends nowhere.
#[test]
fn filters_have_their_shapes() {
    // The camera looks along the floor from high above, so the horizon is a straight line in the middle of the picture.
    let edge = |filter: &str| {
        let film = film(&scene(&format!(
            "
            plane = [{{ normal = [0, 0, 1], offset_m = 0.0, material = 'a' }}]
            render.look.a.albedo = [0, 0, 0]
            render.sky = {{ zenith_radiance = [1, 1, 1], horizon_radiance = [1, 1, 1] }}
            render.camera = {{ position_m = [0, 0, 1], look_at_m = [1, 0, 1], up = [0, 0, 1], vertical_field_of_view_rad = 0.1 }}
            render.width_px = 64
            render.height_px = 8
            render.samples_per_pixel = 64
            render.filter = {filter}
            "
        )));
        // By rows, from the top: the edge lies between rows 3 and 4.
        film.rgb
            .chunks_exact(64)
            .map(|row| row.iter().map(|pixel| pixel[0]).sum::<f64>() / 64.0)
            .collect::<Vec<_>>()
    };
    // Shares of the filter above the edge, for a pixel whose middle lies half a pixel or one and a half below it.
    let tent = |distance: f64, radius: f64| 0.5 * (1.0 - distance / radius) * (1.0 - distance / radius);
    for (filter, half, one_and_a_half) in [
        ("{ shape = 'box', radius_px = 0.5 }", 0.0, 0.0),
        ("{ shape = 'box', radius_px = 2.0 }", 1.5 / 4.0, 0.5 / 4.0),
        ("{ shape = 'tent', radius_px = 2.0 }", tent(0.5, 2.0), tent(1.5, 2.0)),
        // By numerical integration of exp(-2 r^2 / 4) over the disc of radius 2 beyond the edge.
        ("{ shape = 'gaussian', radius_px = 2.0 }", gaussian_beyond(0.25), gaussian_beyond(0.75)),
    ] {
        let rows = edge(filter);
        println!(
            "{filter}: {rows:.4?}, expected {half:.4} and {one_and_a_half:.4} in rows 4 and 5, tolerance 0.01"
        );
        // 64 x 64 evenly spread points: far below the error of independent ones, which is 0.5 / 64 = 0.008.
        assert!((rows[4] - half).abs() < 0.01 && (rows[5] - one_and_a_half).abs() < 0.01);
        assert!((rows[3] - (1.0 - half)).abs() < 0.01 && (rows[2] - (1.0 - one_and_a_half)).abs() < 0.01);
        assert_eq!((rows[0], rows[7]), (1.0, 0.0));
    }
}

/// The share of a Gaussian of standard deviation 1/2 on the unit disc that lies beyond a line at this distance.
fn gaussian_beyond(distance: f64) -> f64 {
    const PARTS: i32 = 600;
    let (mut beyond, mut all) = (0.0, 0.0);
    for k in 0..PARTS {
        for l in 0..PARTS {
            let place = |k: i32| (2.0 * f64::from(k) + 1.0) / f64::from(PARTS) - 1.0;
            let (x, y) = (place(k), place(l));
            if x * x + y * y < 1.0 {
                let weight = libm::exp(-2.0 * (x * x + y * y));
                all += weight;
                beyond += if y > distance { weight } else { 0.0 };
            }
        }
    }
    beyond / all
}

/// The estimated variance of pixels is that of renderings with other seeds.
#[test]
fn variance_is_the_spread_of_pictures() {
    let scene = still_life(
        "render.sampler = 'independent'\nrender.samples_per_pixel = 32\nrender.crop_px = [10, 10, 16, 16]",
    );
    let (model, _) = RenderModel::compile(&scene);
    const RUNS: u64 = 60;
    let (mut estimated, mut spread) = (0.0, 0.0);
    let mut luminances = vec![(0.0, 0.0); 256];
    for seed in 0..RUNS {
        let film = render(&model, &scene.initial_bodies(), 0, seed, threads(2)).expect("a state");
        estimated += film.sums.iter().map(PixelSums::variance).sum::<f64>();
        for (sums, pixel) in luminances.iter_mut().zip(&film.rgb) {
            let luminance = render_node::luminance(&Vec3::from(*pixel));
            *sums = (sums.0 + luminance, sums.1 + luminance * luminance);
        }
    }
    for (sum, squares) in luminances {
        spread += (squares - sum * sum / RUNS as f64) / (RUNS - 1) as f64;
    }
    estimated /= RUNS as f64;
    // 256 pixels of 59 degrees of freedom each; a few noisy pixels carry most of the sum, so a fifth is allowed.
    println!("estimated variance {estimated:.4e}, spread of {RUNS} pictures {spread:.4e}, tolerance 20 %");
    assert!((estimated / spread - 1.0).abs() < 0.2);
    assert_eq!(PixelSums::default().variance(), 0.0);
}

/// With a limit of noise a pixel stops at a multiple of 16 samples, as soon as its error allows, and nowhere else.
#[test]
fn pixels_stop_at_the_noise_that_is_asked_for() {
    let settings = "render.samples_per_pixel = 512\nrender.bounces_max = 1";
    let limit = still_life(&format!("{settings}\nrender.noise_max = 0.05"));
    let film = film(&limit);
    let counts: Vec<u32> = film.sums.iter().map(|sums| sums.count).collect();
    assert!(counts.iter().all(|count| count.is_multiple_of(16) && (32..=512).contains(count)));
    let (least, most) = (counts.iter().min(), counts.iter().max());
    println!("samples from {least:?} to {most:?}, {} in all of {}", film.samples(), 512 * counts.len());
    assert!(least == Some(&32) && most > least && film.samples() < 256 * counts.len() as u64);
    for (sums, rgb) in film.sums.iter().zip(&film.rgb).filter(|(sums, _)| sums.count < 512) {
        let allowed = 0.05 * (render_node::luminance(&Vec3::from(*rgb)) + 0.01);
        assert!(sums.variance() <= allowed * allowed);
    }
    // In parts, in a crop and on other threads it is the same.
    let (model, _) = RenderModel::compile(&limit);
    let whole = render(&model, &limit.initial_bodies(), 3, limit.seed, threads(1)).expect("a state");
    let parts = add(&limit, 48..512, add(&limit, 0..48, Film::black(53, 37), 2), 3);
    assert_eq!(parts, whole);
    let crop = self::film(&still_life(&format!(
        "{settings}\nrender.noise_max = 0.05\nrender.crop_px = [9, 9, 4, 1]"
    )));
    assert_eq!(crop.sums[..], film.sums[9 * 53 + 9..9 * 53 + 13]);
}

#[test]
fn feature_images_tell_what_is_there() {
    let scene = still_life("");
    let (model, _) = RenderModel::compile(&scene);
    let images = FeatureImages::new(&model, &scene.initial_bodies(), 0).expect("a state");
    assert_eq!((images.width_px, images.height_px, images.surface.len()), (53, 37, 53 * 37));
    let mut seen = [0; 3];
    for (index, &surface) in images.surface.iter().enumerate() {
        seen[(surface + 1) as usize] += 1;
        let (distance, normal) = (images.distance_m[index], Vec3::from(images.normal[index]));
        if surface < 0 {
            assert!(distance == f64::INFINITY && normal == Vec3::zeros());
        } else {
            assert!(distance > 1.0 && (normal.norm() - 1.0).abs() < 1e-12);
        }
        if surface == 1 {
            assert_eq!(normal, Vec3::z(), "the floor's normal");
        }
        if surface == 0 {
            let brass = render_node::bsdf::ComplexIndex::measured(schemas::scene::render::Metal::Brass);
            assert_eq!(Vec3::from(images.albedo[index]), brass.reflectance(1.0));
        }
    }
    println!("nothing, ring, floor: {seen:?} pixels");
    assert!(seen[1] > 100 && seen[2] > 100);
    // They and the film become one file.
    let film = film(&scene);
    let channels: Vec<_> = film_channels(&film).into_iter().chain(images.channels()).collect();
    let names: Vec<_> = channels.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names.join(" "),
        "R G B variance.Y samples.count Z normal.X normal.Y normal.Z albedo.R albedo.G albedo.B id.surface"
    );
    let bytes = exr_bytes(53, 37, channels).expect("a file");
    assert!(bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]));
}

/// Colours by speed and penetration are those of the colour map, by number differ from each other.
#[test]
fn colours_can_mean_something() {
    let colours = |settings: &str, velocities: [f64; 3]| {
        let scene = scene(&format!(
            "
            ring = [
                {{ major_radius_m = 1.0, minor_radius_m = 0.2, mass_kg = 1.0, material = 'a', position_m = [0, 0, 0] }},
                {{ major_radius_m = 1.0, minor_radius_m = 0.2, mass_kg = 1.0, material = 'a', position_m = [2.38, 0, 0] }},
                {{ major_radius_m = 1.0, minor_radius_m = 0.2, mass_kg = 1.0, material = 'a', position_m = [6, 0, 0] }},
            ]
            render.camera = {{ position_m = [3, 0, 10], projection = 'orthographic', view_height_m = 4.0, look_at_m = [3, 0, 0] }}
            render.width_px = 96
            render.height_px = 48
            {settings}
            "
        ));
        let mut bodies = scene.initial_bodies();
        for (body, speed) in bodies.iter_mut().zip(velocities) {
            body.linear_velocity_m_per_s = [0.0, 0.0, speed];
        }
        let (model, _) = RenderModel::compile(&scene);
        let images = FeatureImages::new(&model, &bodies, 0).expect("a state");
        [0, 1, 2].map(|ring| {
            let pixel = images.surface.iter().position(|&surface| surface == ring).expect("it is seen");
            images.albedo[pixel]
        })
    };
    assert_eq!(colours("", [1.0, 2.0, 3.0]), [[0.5; 3]; 3]);
    let linear = |code: f64| libm::pow((code / 255.0 + 0.055) / 1.055, 2.4);
    let near = |found: [f64; 3], code: [f64; 3]| {
        let expected = code.map(linear);
        println!("{found:.4?}, expected {expected:.4?}");
        assert!((0..3).all(|axis| (found[axis] - expected[axis]).abs() < 1e-3));
    };
    let speeds = colours("render.colouring = { by = 'speed', max = 4.0 }", [0.0, 2.0, 9.0]);
    near(speeds[1], [33.0, 145.0, 140.0]);
    near(speeds[2], [253.0, 231.0, 37.0]);
    assert!(speeds[0][2] > speeds[0][0] && speeds[0][0] > speeds[0][1]);
    // The first two penetrate by 0.02 of a wire of 0.4: 0.05 of its diameter, the whole scale by default.
    let depths = colours("render.colouring.by = 'penetration'", [0.0; 3]);
    near(depths[0], [253.0, 231.0, 37.0]);
    assert_eq!(depths[0], depths[1]);
    assert_eq!(depths[2], speeds[0]);
    let numbers = colours("render.colouring.by = 'number'", [0.0; 3]);
    assert!(numbers[0] != numbers[1] && numbers[1] != numbers[2]);
}

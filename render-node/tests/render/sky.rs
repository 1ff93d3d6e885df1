//! Light from infinitely far away: suns and environment maps.

use crate::staging::{Dice, scene, threads};
use core::f64::consts::{PI, TAU};
use geometry::Vec3;
use render_node::{EnvironmentMap, Film, MapError, PoseError, RenderModel, exr_bytes, render};
use schemas::scene::Scene;

fn mean_and_error(film: &Film, channel: usize) -> (f64, f64) {
    let count = film.rgb.len() as f64;
    let mean = film.rgb.iter().map(|pixel| pixel[channel]).sum::<f64>() / count;
    let squares = film.rgb.iter().map(|pixel| (pixel[channel] - mean) * (pixel[channel] - mean)).sum::<f64>();
    (mean, (squares / (count - 1.0) / count).sqrt())
}

/// One point of a plane z = 0 under what is given.
fn point(settings: &str, map: Option<EnvironmentMap>) -> Film {
    let scene = scene(&format!(
        "
        plane = [{{ normal = [0, 0, 1], offset_m = 0.0, material = 'a' }}]
        render.sky = {{ up = [0, 0, 1], zenith_radiance = [0, 0, 0], horizon_radiance = [0, 0, 0] }}
        render.camera = {{ position_m = [3, 0, 4], look_at_m = [0, 0, 0], up = [0, 0, 1], vertical_field_of_view_rad = 1e-5 }}
        render.width_px = 48
        render.height_px = 48
        render.bounces_max = 0
        {settings}
        "
    ));
    film(&scene, map)
}

fn film(scene: &Scene, map: Option<EnvironmentMap>) -> Film {
    let (model, _) = RenderModel::compile(scene);
    let model = match map {
        Some(map) => model.with_environment(map),
        None => model,
    };
    render(&model, &scene.initial_bodies(), 0, scene.seed, threads(2)).expect("the state is the scene's")
}

const GREY: &str = "render.look.a.albedo = [0.7, 0.7, 0.7]\n";
const MAP: &str = "render.environment = { file = 'a map given by hand.exr' }\n";

/// A wide map: dark, with a bright patch high up and a coloured one near the horizon.
fn patches() -> EnvironmentMap {
    let (width, height) = (32, 16);
    let mut texels = vec![[0.05_f32, 0.05, 0.08]; width * height];
    texels[3 * width + 10] = [90.0, 80.0, 70.0];
    texels[3 * width + 11] = [30.0, 30.0, 30.0];
    for x in 20..26 {
        texels[6 * width + x] = [1.0, 3.0, 1.0];
    }
    EnvironmentMap::new(width, height, &texels).expect("a map")
}

#[test]
fn sun_over_a_plane() {
    for (radius, x, z) in [(0.00465, 0.0, 1.0), (0.2, 1.0, 1.0), (1e-6, -2.0, 1.0), (0.5, 0.3, 1.0_f64)] {
        let film = point(
            &format!(
                "{GREY}render.light = [{{ shape = 'sun', direction = [{x}, 0, {z}], angular_radius_rad = {radius}, irradiance = [5, 4, 3] }}]"
            ),
            None,
        );
        let cosine = z / (x * x + z * z).sqrt();
        for (channel, irradiance) in [5.0, 4.0, 3.0].into_iter().enumerate() {
            let (mean, error) = mean_and_error(&film, channel);
            // The irradiance of a disc above the horizon goes with the cosine of its middle, exactly.
            let expected = 0.7 / PI * irradiance * cosine;
            println!("sun of radius {radius}: {mean:.6} +- {error:.6}, expected {expected:.6}");
            assert!((mean - expected).abs() < 4.5 * error + 1e-9 * expected && error < 0.01 * expected);
        }
    }
}

#[test]
fn the_sun_itself_is_seen_and_mirrored() {
    // 0.1 rad seen through 0.4 rad: pi 0.1^2 / 0.4^2 of the picture but for the flatness of the picture (tan).
    let scene = scene(
        "
        render.sky = { up = [0, 0, 1], zenith_radiance = [0, 0, 0], horizon_radiance = [0, 0, 0] }
        render.light = [{ shape = 'sun', direction = [0, 0, 2], angular_radius_rad = 0.1, irradiance = [1, 1, 1] }]
        render.camera = { position_m = [0, 0, 0], look_at_m = [0, 0, 1], up = [0, 1, 0], vertical_field_of_view_rad = 0.4 }
        render.width_px = 64
        render.height_px = 64
        ",
    );
    let film = film(&scene, None);
    let (mean, _) = mean_and_error(&film, 0);
    let radiance = 1.0 / (PI * libm::sin(0.1) * libm::sin(0.1));
    let side = 2.0 * libm::tan(0.2);
    let share = PI * libm::tan(0.1) * libm::tan(0.1) / (side * side);
    println!("share of the picture {:.5}, expected {share:.5}, tolerance 1e-3", mean / radiance);
    assert!((mean / radiance - share).abs() < 1e-3);
}

/// A chi-squared test of `sample` against the light of the texels, and of `pdf` against `eval`.
#[test]
fn maps_are_sampled_by_their_light() {
    let map = patches();
    let (width, height) = map.size();
    let mut dice = Dice::new(6);
    let mut counts = vec![0_u32; width * height];
    const SAMPLES: u32 = 100_000;
    for _ in 0..SAMPLES {
        let sample = map.sample((dice.unit(), dice.unit()));
        assert!((sample.direction.norm() - 1.0).abs() < 1e-14);
        let (radiance, pdf) = map.eval(&sample.direction);
        assert_eq!((radiance, pdf), (sample.radiance, sample.pdf));
        let polar = libm::acos(sample.direction.z) / PI;
        let turn = libm::atan2(sample.direction.y, sample.direction.x) / TAU + 0.5;
        let texel = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
        counts[texel(polar, height) * width + texel(turn, width)] += 1;
    }
    let solid_angle = |row: usize| {
        let border = |row: usize| libm::cos(PI * row as f64 / height as f64);
        (border(row) - border(row + 1)) * TAU / width as f64
    };
    let light = |index: usize| {
        let (row, column) = (index / width, index % width);
        let polar = PI * (row as f64 + 0.5) / height as f64;
        let turn = TAU * ((column as f64 + 0.5) / width as f64 - 0.5);
        let direction = Vec3::new(
            libm::sin(polar) * libm::cos(turn),
            libm::sin(polar) * libm::sin(turn),
            libm::cos(polar),
        );
        let (radiance, pdf) = map.eval(&direction);
        (render_node::luminance(&radiance) * solid_angle(row), pdf * solid_angle(row))
    };
    let all: f64 = (0..width * height).map(|index| light(index).0).sum();
    let (mut chi_squared, mut degrees, mut densities) = (0.0, -1.0, 0.0);
    let mut rest = (0.0, 0.0);
    for (index, &count) in counts.iter().enumerate() {
        let (light, share) = light(index);
        densities += share;
        assert!((share - light / all).abs() < 1e-12);
        let expected = light / all * f64::from(SAMPLES);
        if expected < 20.0 {
            rest = (rest.0 + f64::from(count), rest.1 + expected);
            continue;
        }
        chi_squared += (f64::from(count) - expected) * (f64::from(count) - expected) / expected;
        degrees += 1.0;
    }
    chi_squared += (rest.0 - rest.1) * (rest.0 - rest.1) / rest.1;
    let limit = degrees + 1.0 + 5.0 * (2.0 * degrees + 2.0_f64).sqrt() + 10.0;
    println!(
        "chi-squared {chi_squared:.1} of {} degrees, limit {limit:.1}; shares add up to {densities}",
        degrees + 1.0
    );
    assert!(chi_squared < limit && (densities - 1.0).abs() < 1e-12);
}

#[test]
fn a_white_map_is_a_furnace() {
    let white = EnvironmentMap::new(7, 5, &[[1.0; 3]; 35]).expect("a map");
    // Where the reflection alone finds light each sample is exactly 1, on a torus and on a polynomial, too.
    let scene = scene(&format!(
        "
        ring = [{{ major_radius_m = 1.0, minor_radius_m = 0.3, mass_kg = 1.0, material = 'white', position_m = [0, 0, 0.2] }}]
        polynomial = [{{ formula = 'x^4 + y^4 + z^4 - 1', bounding_radius_m = 1.0, scale_m = 0.6, density_kg_per_m3 = 1.0, material = 'white', position_m = [1.6, 0, 0] }}]
        render.sky.up = [0, 1, 0]
        render.camera = {{ position_m = [2, -4, 3], look_at_m = [0.5, 0, 0.5], up = [0, 0, 1], vertical_field_of_view_rad = 0.8 }}
        render.width_px = 24
        render.height_px = 24
        render.bounces_max = 200
        render.direct_light = 'bsdf'
        {MAP}
        "
    ));
    assert!(film(&scene, Some(white.clone())).rgb.iter().all(|pixel| *pixel == [1.0; 3]));
    // Both ways together have a mean of 1 and little noise.
    let (mean, error) =
        mean_and_error(&point(&format!("render.look.a.albedo = [1, 1, 1]\n{MAP}"), Some(white)), 0);
    println!("mis: {mean:.6} +- {error:.6}, expected 1");
    assert!((mean - 1.0).abs() < 4.5 * error && error < 2e-3);
}

#[test]
fn strategies_agree_under_a_map_and_a_sun() {
    let sun = "render.light = [{ shape = 'sun', direction = [-1, 0.2, 1], angular_radius_rad = 0.1, irradiance = [2, 2, 2] }]";
    for look in [
        "render.look.a.albedo = [0.7, 0.7, 0.7]",
        "render.look.a = { bsdf = 'conductor', metal = 'brass', roughness = 0.4 }",
        "render.look.a = { bsdf = 'plastic', roughness = 0.3 }",
    ] {
        let [mis, asked, met] = ["mis", "lights", "bsdf"].map(|strategy| {
            let film = point(
                &format!(
                    "{look}\n{sun}\n{MAP}render.direct_light = '{strategy}'\nrender.samples_per_pixel = 32"
                ),
                Some(patches()),
            );
            mean_and_error(&film, 1)
        });
        println!("{look}: mis {mis:.5?}, lights {asked:.5?}, bsdf {met:.5?}");
        for other in [asked, met] {
            assert!((mis.0 - other.0).abs() < 5.0 * (mis.1 * mis.1 + other.1 * other.1).sqrt(), "{look}");
        }
        // A small bright patch is found by asking; evenly spread questions alone have less noise than a mixture, but a
        // mixture is never far from the better way, and far from the worse one.
        let (better, worse) = if asked.1 < met.1 { (asked.1, met.1) } else { (met.1, asked.1) };
        assert!(mis.1 < 5.0 * better && mis.1 < 0.6 * worse, "{look}");
    }
}

#[test]
fn maps_that_cannot_be_are_refused() {
    let error = EnvironmentMap::new(2, 1, &[[0.0; 3]; 2]).expect_err("it is black");
    assert!(matches!(error, MapError::Black { width: 2, height: 1 }), "{error}");
    for wrong in [f32::NAN, -1.0, f32::INFINITY] {
        let error = EnvironmentMap::new(1, 2, &[[1.0; 3], [0.0, wrong, 0.0]]).expect_err("it is no radiance");
        assert!(matches!(error, MapError::Texel { x: 0, y: 1, .. }), "{error}");
    }
    assert!(matches!(EnvironmentMap::decode(b"\x89PNG"), Err(MapError::Format)));
    assert!(EnvironmentMap::decode(b"").is_err());
    let planes = ["R", "G", "B"].map(|name| (name.to_owned(), vec![0.5_f32; 6]));
    let map = EnvironmentMap::decode(&exr_bytes(3, 2, planes.to_vec()).expect("a picture")).expect("a map");
    assert_eq!(map, EnvironmentMap::new(3, 2, &[[0.5; 3]; 6]).expect("a map"));
    let scene = scene(MAP);
    let (model, plan) = RenderModel::compile(&scene);
    assert!(plan.needs("light/environment") && !plan.needs("light/sky"));
    let error = render(&model, &[], 0, 0, threads(1)).expect_err("the map is missing");
    assert!(matches!(error, PoseError::NoEnvironment { .. }), "{error}");
}

//! A z-test of every pixel against a reference of many samples, kept as numbers: changes of random numbers, of weights or of
//! the order of work may change every bit of a film, but not its mean.

use crate::staging::{scene, threads};
use geometry::Vec3;
use render_node::{Film, RenderModel, luminance, render};
use schemas::scene::Scene;
use std::fmt::Write;

const WIDTH: u32 = 16;
const HEIGHT: u32 = 9;
const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/render/reference.txt");

/// All kinds of surfaces and lights that the sampler has to find its way through.
fn still_life(samples: u32, strategy: &str) -> Scene {
    scene(&format!(
        "
        material.floor = {{}}
        material.gloss = {{}}
        ring = [
            {{ major_radius_m = 1.0, minor_radius_m = 0.25, mass_kg = 1.0, material = 'a', position_m = [-0.4, 0, 0], orientation = [0.6, 0, 0, 0.8] }},
            {{ major_radius_m = 0.9, minor_radius_m = 0.2, mass_kg = 1.0, material = 'b', position_m = [0.8, 0, 0.1] }},
        ]
        sphere = [{{ radius_m = 0.6, mass_kg = 1.0, material = 'gloss', position_m = [1.6, 0.8, -0.9] }}]
        plane = [{{ normal = [0, 0, 1], offset_m = -1.5, material = 'floor' }}]
        render.look.a = {{ bsdf = 'conductor', metal = 'steel', roughness = 0.5 }}
        render.look.b = {{ bsdf = 'conductor', metal = 'brass', roughness = 0.7 }}
        render.look.gloss = {{ bsdf = 'plastic', albedo = [0.7, 0.2, 0.1], roughness = 0.4 }}
        render.look.floor = {{ albedo = [0.3, 0.3, 0.3], checker_albedo = [0.6, 0.6, 0.6] }}
        render.camera = {{ position_m = [1, -5, 3], look_at_m = [0.2, 0, -0.4], up = [0, 0, 1], vertical_field_of_view_rad = 0.7 }}
        render.sky.up = [0, 0, 1]
        render.light = [
            {{ shape = 'rectangle', corner_m = [-3, -3, 3], edge_u_m = [3, 0, 0], edge_v_m = [0, 3, 0.5], radiance = [0, 0, 0] }},
            {{ shape = 'rectangle', corner_m = [-4, -2, 2], edge_u_m = [0, 3, 0], edge_v_m = [2, 0, 1.5], radiance = [6, 6, 6] }},
            {{ shape = 'sphere', position_m = [3, -3, 3], radius_m = 0.6, radiance = [12, 12, 12] }},
            {{ shape = 'sun', direction = [1, -1, 2], angular_radius_rad = 0.1, irradiance = [1, 1, 1] }},
        ]
        render.sampler = 'independent'
        render.direct_light = '{strategy}'
        render.roulette_after = 1
        render.bounces_max = 5
        render.samples_per_pixel = {samples}
        render.width_px = {WIDTH}
        render.height_px = {HEIGHT}
        "
    ))
}

fn picture(samples: u32, seed: u64, strategy: &str) -> Film {
    let scene = still_life(samples, strategy);
    let (model, _) = RenderModel::compile(&scene);
    let film =
        render(&model, &scene.initial_bodies(), 0, seed, threads(2)).expect("the state is the scene's");
    assert_eq!(film.non_finite_samples, 0);
    film
}

/// Mean luminance and variance of the mean, pixel by pixel.
fn statistics(film: &Film) -> Vec<(f64, f64)> {
    let mean = |pixel: &[f64; 3]| luminance(&Vec3::from(*pixel));
    film.rgb.iter().zip(&film.sums).map(|(pixel, sums)| (mean(pixel), sums.variance())).collect()
}

/// `CHAINMAIL_WRITE_REFERENCE=1 cargo test -p render-node reference` writes the reference again; the commit says why light
/// was meant to change.
#[test]
fn pixels_are_those_of_the_reference() {
    if std::env::var_os("CHAINMAIL_WRITE_REFERENCE").is_some() {
        let mut text = String::new();
        for (mean, variance) in statistics(&picture(1 << 14, 1_000, "mis")) {
            writeln!(text, "{mean:.9e} {variance:.9e}").expect("a text grows");
        }
        std::fs::write(PATH, text).expect("the reference can be written");
    }
    let text = std::fs::read_to_string(PATH).expect("tests/render/reference.txt is there");
    let reference: Vec<(f64, f64)> = text
        .lines()
        .map(|line| {
            let (mean, variance) = line.split_once(' ').expect("two numbers");
            (mean.parse().expect("a mean"), variance.parse().expect("a variance"))
        })
        .collect();
    assert_eq!(reference.len(), (WIDTH * HEIGHT) as usize);
    for (strategy, samples) in [("mis", 256), ("lights", 1024)] {
        let found = statistics(&picture(samples, 1, strategy));
        let (mut worst, mut sum) = (0.0, 0.0);
        for (&(mean, variance), &(expected, own)) in found.iter().zip(&reference) {
            // Where few samples met a light their own spread says little; the reference's, for as many samples, says more.
            let known = own * f64::from(1 << 14) / f64::from(samples);
            let variance = if strategy == "mis" && known > variance { known } else { variance };
            let z = (mean - expected) / (variance + own).sqrt();
            worst = if z.abs() > worst { z.abs() } else { worst };
            sum += z * z;
        }
        // Of 144 normal numbers none is beyond 5 by chance (8e-5 in all); sums of rare bright samples have longer tails,
        // so another half. The mean of their squares is 1, with a deviation of 0.12.
        let mean_square = sum / found.len() as f64;
        println!(
            "{strategy}, {samples} samples: largest |z| {worst:.2} (limit 5.5), mean z^2 {mean_square:.3} (limit 1.7)"
        );
        assert!(worst < 5.5 && mean_square < 1.7, "{strategy}");
    }
}

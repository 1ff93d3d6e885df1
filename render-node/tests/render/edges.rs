//! Odd scenes and odd pictures.

use crate::staging::{film, scene, threads};
use render_node::{PoseError, RenderModel, SamplePlace, World, render};
use schemas::scene::Scene;

const RING: &str = "{ major_radius_m = 1.0, minor_radius_m = 0.3, mass_kg = 1.0, material = 'a', position_m = [0.1, 0.2, 0.3], orientation = [0.6, 0, 0, 0.8] }";

const SMALL: &str = "
    render.width_px = 24
    render.height_px = 16
    render.samples_per_pixel = 4
    render.light = [{ shape = 'sphere', position_m = [2, 3, 4], radius_m = 0.5, radiance = [20, 20, 20] }]
";

fn with_rings(count: usize) -> Scene {
    scene(&format!("ring = [{}]\n{SMALL}", [RING].repeat(count).join(", ")))
}

#[test]
fn coincident_rings_look_like_one() {
    let one = film(&with_rings(1));
    for count in [2, 40] {
        let many = film(&with_rings(count));
        assert_eq!(many.hash(), one.hash(), "{count} rings in one place");
        assert_eq!(many.rays, one.rays);
    }
}

#[test]
fn nothing_at_all_is_sky() {
    let film = film(&scene(
        "render.sky = { zenith_radiance = [0.5, 0.25, 2.0], horizon_radiance = [0.5, 0.25, 2.0] }",
    ));
    assert_eq!(film.rgb.len(), 640 * 360);
    assert!(film.rgb.iter().all(|pixel| *pixel == [0.5, 0.25, 2.0]));
    assert_eq!(film.rays, 640 * 360 * 16);
}

#[test]
fn no_rings_but_a_floor() {
    let film = film(&scene(&format!(
        "plane = [{{ normal = [0, 1, 0], offset_m = -1.0, material = 'a' }}]\n{SMALL}"
    )));
    assert!(film.rgb.iter().flatten().all(|channel| *channel > 0.0));
}

#[test]
fn no_light_is_black() {
    let dark = "render.sky = { zenith_radiance = [0, 0, 0], horizon_radiance = [0, 0, 0] }";
    let scene = scene(&format!("ring = [{RING}]\n{dark}\nrender.width_px = 24\nrender.height_px = 16"));
    let (_, plan) = RenderModel::compile(&scene);
    assert!(!plan.needs("light/sky") && !plan.needs("light/area"));
    let film = film(&scene);
    // Zeros with a positive sign.
    assert!(film.rgb.iter().flatten().all(|channel| channel.to_bits() == 0));
}

#[test]
fn camera_in_the_hole_sees_ring_and_sky() {
    let film = film(&scene(&format!(
        "ring = [{RING}]\n{SMALL}
        render.camera = {{ position_m = [0.1, 0.2, 0.3], look_at_m = [1.1, 0.2, 0.3], vertical_field_of_view_rad = 1.5 }}"
    )));
    let different = film.rgb.iter().any(|pixel| pixel != &film.rgb[0]);
    assert!(different && film.non_finite_samples == 0);
}

#[test]
fn no_light_gets_into_a_tube() {
    // The camera stands on the wire's centreline, within the white wire: nothing can be seen, however many bounces.
    let film = film(&scene(&format!(
        "ring = [{{ major_radius_m = 1.0, minor_radius_m = 0.3, mass_kg = 1.0, material = 'white', position_m = [0, 0, 0] }}]
        render.camera = {{ position_m = [1, 0, 0], look_at_m = [1, 1, 0.1], up = [0, 0, 1], vertical_field_of_view_rad = 2.0 }}
        render.bounces_max = 40\n{SMALL}"
    )));
    assert!(film.rgb.iter().all(|pixel| *pixel == [0.0; 3]));
    assert!(film.rays > 24 * 16 * 4 * 40);
}

#[test]
fn one_pixel_and_one_row() {
    for (width, height) in [(1, 1), (16_384, 1), (1, 300), (17, 33)] {
        let mut scene = with_rings(1);
        scene.render.width_px = width;
        scene.render.height_px = height;
        scene.render.samples_per_pixel = 1;
        let film = film(&scene);
        assert_eq!(film.rgb.len(), width as usize * height as usize);
        assert_eq!(film.non_finite_samples, 0);
        // A single path may end in a place that no light reaches, but hardly any does.
        let dark = film.rgb.iter().filter(|pixel| **pixel == [0.0; 3]).count();
        assert!(film.rgb.iter().flatten().all(|channel| *channel >= 0.0) && dark * 100 <= film.rgb.len());
    }
}

#[test]
fn samples_that_are_not_finite_are_counted_and_named() {
    let mut scene = with_rings(1);
    let clean = film(&scene);
    assert_eq!((clean.non_finite_samples, clean.first_non_finite), (0, None));
    // No scene file can say this.
    scene.render.sky.zenith_radiance = [1.0, f64::NAN, 1.0];
    scene.render.sky.up = [0.0, 0.0, -1.0];
    let film = film(&scene);
    println!("{} samples, the first at {:?}", film.non_finite_samples, film.first_non_finite);
    // The camera looks down, that is to the zenith of this sky: the first pixel sees it at once.
    assert!(film.non_finite_samples >= 24 * 16 * 4 / 2);
    assert_eq!(film.first_non_finite, Some(SamplePlace { y_px: 0, x_px: 0, sample: 0 }));
    assert!(film.rgb.iter().flatten().all(|channel| channel.is_finite()));
    let (model, _) = RenderModel::compile(&scene);
    assert_eq!(render(&model, &scene.initial_bodies(), 0, scene.seed, threads(3)).expect("a state"), film);
}

#[test]
fn states_of_another_scene_are_refused() {
    let scene = with_rings(2);
    let (model, _) = RenderModel::compile(&scene);
    let mut states = scene.initial_bodies();
    let error = World::new(&model, &states[..1]).expect_err("one body is missing");
    assert!(matches!(error, PoseError::BodyCount { expected: 2, found: 1 }), "{error}");
    states[1].position_m[2] = f64::NAN;
    let error = World::new(&model, &states).expect_err("a position is NaN");
    assert!(matches!(error, PoseError::Pose { body: 1, .. }), "{error}");
    states[1].position_m[2] = 0.0;
    states[1].orientation = [0.0; 4];
    assert!(World::new(&model, &states).is_err());
}

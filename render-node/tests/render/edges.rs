//! Odd scenes and odd pictures.

use crate::staging::{film, scene, threads};
use render_node::{FeatureImages, PoseError, RenderModel, SamplePlace, World, render};
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

/// From ten million metres away a ring covers the very pixels of its parallel projection, and no light is lost.
#[test]
fn camera_ten_million_away() {
    // 2.8 m at 1e7 m.
    let distance = 1e7;
    let away = format!(
        "render.camera.position_m = [0.1, {distance:?}, 0.3]\nrender.camera.look_at_m = [0.1, 0.2, 0.3]"
    );
    let up = "render.camera.up = [0, 0, 1]";
    let perspective = format!("{away}\n{up}\nrender.camera.vertical_field_of_view_rad = 2.8e-7");
    let parallel = format!(
        "{up}\nrender.camera.projection = 'orthographic'\nrender.camera.view_height_m = 2.8\nrender.camera.position_m = [0.1, 9.2, 0.3]\nrender.camera.look_at_m = [0.1, 0.2, 0.3]"
    );
    let seen = |camera: &str| {
        let scene =
            scene(&format!("ring = [{RING}]\nrender.width_px = 120\nrender.height_px = 90\n{camera}"));
        let (model, _) = RenderModel::compile(&scene);
        let images =
            FeatureImages::new(&model, &scene.initial_bodies(), 0).expect("the state is the scene's");
        images.surface
    };
    let (far, near) = (seen(&perspective), seen(&parallel));
    let covered = near.iter().filter(|&&surface| surface == 0).count();
    let differ = near.iter().zip(&far).filter(|(a, b)| a != b).count();
    println!("{covered} pixels show the ring, {differ} of all differ");
    assert!(covered > 1_000 && differ <= 2);
    let furnace = film(&scene(&format!(
        "ring = [{}]\nrender.sky = {{ zenith_radiance = [1, 1, 1], horizon_radiance = [1, 1, 1] }}
        render.width_px = 40\nrender.height_px = 30\nrender.samples_per_pixel = 4\nrender.bounces_max = 200\n{perspective}",
        RING.replace("'a'", "'white'")
    )));
    assert!(furnace.rgb.iter().all(|pixel| *pixel == [1.0; 3]));
    assert!(furnace.rays > 40 * 30 * 4 * 11 / 10);
}

/// A wire a millionth as thick as its ring, from ten wires away, fills as much of the picture as a straight one.
#[test]
fn a_wire_of_a_millionth() {
    let scene = scene(
        "ring = [{ major_radius_m = 1.0, minor_radius_m = 1e-6, mass_kg = 1.0, material = 'white', position_m = [0, 0, 0] }]
        render.sky = { zenith_radiance = [1, 1, 1], horizon_radiance = [1, 1, 1] }
        render.camera = { position_m = [1, 0, 1e-5], look_at_m = [1, 0, 0], up = [1, 0, 0], vertical_field_of_view_rad = 0.4 }
        render.width_px = 20
        render.height_px = 200
        render.samples_per_pixel = 2
        render.bounces_max = 100",
    );
    let (model, _) = RenderModel::compile(&scene);
    let images = FeatureImages::new(&model, &scene.initial_bodies(), 0).expect("the state is the scene's");
    let rows = images.surface.iter().filter(|&&surface| surface == 0).count() as f64 / 20.0;
    // The tangent from a distance d to a circle of radius r has the slope r / sqrt(d^2 - r^2).
    let expected = 200.0 * 0.1 / 0.99_f64.sqrt() / libm::tan(0.2);
    println!("{rows} rows show the wire, expected {expected:.2}");
    assert!((rows - expected).abs() <= 1.0);
    assert!(film(&scene).rgb.iter().all(|pixel| *pixel == [1.0; 3]));
}

/// A ring whose hole has closed is refused as a body, since nothing can be linked with it; its surface can be shown.
#[test]
fn a_horn_torus_is_a_surface_and_no_ring() {
    let ring = "time = { duration_s = 0.0, time_step_s = 0.001 }\nmaterial.a = {}
        ring = [{ major_radius_m = 1.0, minor_radius_m = 1.0, mass_kg = 1.0, material = 'a', position_m = [0, 0, 0] }]";
    let error = Scene::parse(ring, &[]).expect_err("no hole").to_string();
    assert_eq!(error, "ring[0].minor_radius_m = 1.0: expected less than major_radius_m = 1.0");
    // Nearly one: the picture is that of the surface but for a hole of a thousandth.
    let camera = "render.camera = { position_m = [0, 0, 6], vertical_field_of_view_rad = 0.8 }\nrender.width_px = 60\nrender.height_px = 60";
    let seen = |body: &str| {
        let scene = scene(&format!("{body}\n{camera}"));
        let (model, _) = RenderModel::compile(&scene);
        let images =
            FeatureImages::new(&model, &scene.initial_bodies(), 0).expect("the state is the scene's");
        images.distance_m
    };
    let surface = seen(
        "render.look.a = {}\nrender.surface = [{ formula = '(x^2 + y^2 + z^2)^2 - 4*(x^2 + y^2)', bounding_radius_m = 2.0, look = 'a' }]",
    );
    let ring = seen(
        "ring = [{ major_radius_m = 1.0, minor_radius_m = 0.9999, mass_kg = 1.0, material = 'a', position_m = [0, 0, 0] }]",
    );
    let worst = surface.iter().zip(&ring).filter(|(a, _)| a.is_finite()).map(|(a, b)| (a - b).abs());
    let worst = worst.fold(0.0, |worst, apart| if apart > worst { apart } else { worst });
    let met = surface.iter().filter(|distance| distance.is_finite()).count();
    // The surfaces are 1e-4 apart, and rays slant to them by at most a root of twice that.
    println!("{met} pixels, distances at most {worst:e} m apart, allowed 0.05");
    assert!(met > 1_000 && worst < 0.05);
}

/// A hundred thousand rings in one place: a tree over boxes that nothing parts, and rays that meet all of them.
#[test]
fn a_hundred_thousand_coincident_rings() {
    let mut scene = with_rings(1);
    scene.render.width_px = 4;
    scene.render.height_px = 2;
    scene.render.samples_per_pixel = 1;
    scene.render.bounces_max = 0;
    let one = film(&scene);
    scene.rings.resize(100_000, scene.rings[0].clone());
    let many = film(&scene);
    println!("{} rays, {}", many.rays, many.hash());
    assert_eq!((many.hash(), many.rays), (one.hash(), one.rays));
}

#[test]
fn pictures_of_nothing_are_refused() {
    let refused = |settings: &str| {
        let text = format!("time = {{ duration_s = 0.0, time_step_s = 0.001 }}\n{settings}");
        Scene::parse(&text, &[]).expect_err(settings).to_string()
    };
    for (settings, words) in [
        ("render.samples_per_pixel = 0", "render.samples_per_pixel = 0: expected 1 or more"),
        ("render.width_px = 0", "render.width_px = 0: expected 1 to 65536 pixels"),
        (
            "render.light = [{ shape = 'sphere', position_m = [0, 0, 0], radius_m = 0.0, radiance = [1, 1, 1] }]",
            "a light of no size is shape = \"point\" with an intensity (pi r^2 times the radiance)",
        ),
    ] {
        let error = refused(settings);
        assert!(error.contains(words), "{error}");
    }
}

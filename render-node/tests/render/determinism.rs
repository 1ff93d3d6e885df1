//! The same bits: twice, on any number of threads, with nothing left out, and as written down.

use crate::staging::{film, scene, threads};
use render_node::{RenderModel, render};
use schemas::scene::Scene;

/// A little of everything: linked rings, a ball, a checkered floor, both kinds of light, a sky.
fn still_life() -> Scene {
    scene(
        "
        seed = 12
        weave = [{ pattern = 'european-4-in-1', rows = 3, columns = 4, major_radius_m = 1.0, minor_radius_m = 0.18, ring_mass_kg = 1.0, material = 'a', position_m = [-2, -1.2, 0.5] }]
        sphere = [{ radius_m = 0.7, mass_kg = 1.0, material = 'b', position_m = [0, 0, -1] }]
        plane = [{ normal = [0, 0, 1], offset_m = -2.0, material = 'b' }]
        render.width_px = 36
        render.height_px = 20
        render.samples_per_pixel = 5
        render.bounces_max = 3
        render.camera = { position_m = [1, -7, 5], look_at_m = [0, 0, 0], up = [0, 0, 1], vertical_field_of_view_rad = 0.8 }
        render.sky.up = [0, 0, 1]
        render.look.a.albedo = [0.8, 0.6, 0.3]
        render.look.b = { albedo = [0.3, 0.4, 0.5], checker_albedo = [0.7, 0.7, 0.7] }
        render.light = [
            { shape = 'sphere', position_m = [3, -2, 6], radius_m = 0.8, radiance = [9, 8, 7] },
            { shape = 'rectangle', corner_m = [-6, -2, 3], edge_u_m = [0, 4, 0], edge_v_m = [2, 0, 2], radiance = [3, 3, 5] },
        ]
        ",
    )
}

#[test]
fn threads_do_not_matter() {
    let scene = still_life();
    let (model, _) = RenderModel::compile(&scene);
    let states = scene.initial_bodies();
    let film =
        |count| render(&model, &states, 4, scene.seed, threads(count)).expect("the state is the scene's");
    let one = film(1);
    for count in [1, 2, 3, 8] {
        assert_eq!(film(count), one, "{count} threads");
    }
}

#[test]
fn frame_and_seed_matter() {
    let scene = still_life();
    let (model, _) = RenderModel::compile(&scene);
    let states = scene.initial_bodies();
    let hash = |frame, seed| render(&model, &states, frame, seed, threads(2)).expect("a state").hash();
    assert_ne!(hash(0, 12), hash(1, 12));
    assert_ne!(hash(0, 12), hash(0, 13));
}

#[test]
fn what_is_left_out_would_not_change_a_bit() {
    for (bounces, sky, lights) in [(0, true, false), (2, false, true), (3, false, false), (1, true, true)] {
        let mut scene = still_life();
        scene.render.bounces_max = bounces;
        if !sky {
            scene.render.sky.zenith_radiance = [0.0; 3];
            scene.render.sky.horizon_radiance = [0.0; 3];
        }
        for light in &mut scene.render.lights {
            use schemas::scene::render::Light::{Point, Rectangle, Sphere, Sun};
            let (Sphere { radiance, .. }
            | Rectangle { radiance, .. }
            | Point { intensity: radiance, .. }
            | Sun { irradiance: radiance, .. }) = light;
            *radiance = if lights { *radiance } else { [0.0; 3] };
        }
        let (planned, plan) = RenderModel::compile(&scene);
        assert_eq!(plan.needs("light/sky"), sky);
        assert_eq!(plan.needs("light/area"), lights);
        assert_eq!(plan.needs("light/indirect"), bounces > 0);
        assert!(plan.needs("shape/ring") && plan.needs("shape/plane") && plan.needs("look/checkerboard"));
        let everything = RenderModel::compile_with_everything(&scene);
        let states = scene.initial_bodies();
        let film = |model| render(model, &states, 0, 1, threads(1)).expect("the state is the scene's");
        let (planned, everything) = (film(&planned), film(&everything));
        assert_eq!(planned.hash(), everything.hash(), "{bounces} bounces, sky {sky}, lights {lights}");
        assert!(planned.rays <= everything.rays);
    }
}

/// The film of the still life, as a hash. It may only change when light is meant to change; then
/// `CHAINMAIL_WRITE_GOLDEN=1 cargo test -p render-node golden` writes it again, and the commit says why.
#[test]
fn golden_film() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/render/golden_film.txt");
    let film = film(&still_life());
    let found = format!("{} {} rays\n", film.hash(), film.rays);
    if std::env::var_os("CHAINMAIL_WRITE_GOLDEN").is_some() {
        std::fs::write(path, &found).expect("the golden file can be written");
    }
    let expected = std::fs::read_to_string(path).expect("tests/render/golden_film.txt is there");
    assert_eq!(found, expected, "the film of the still life has changed");
}

//! Cameras: where things come to lie in the picture, how sharp they are, and what moves.

use crate::staging::{film, scene, threads};
use render_node::{Film, RenderModel, render};
use schemas::scene::Scene;

/// A glowing ball of radius 0.1 at places, seen by a camera in the dark.
fn balls(places: &[[f64; 3]], camera: &str, more: &str) -> Scene {
    let balls: Vec<_> = places
        .iter()
        .map(|place| format!("{{ radius_m = 0.1, mass_kg = 1.0, material = 'a', position_m = {place:?} }}"))
        .collect();
    scene(&format!(
        "
        sphere = [{}]
        render.look.a = {{ bsdf = 'emitter', radiance = [1, 1, 1] }}
        render.sky = {{ zenith_radiance = [0, 0, 0], horizon_radiance = [0, 0, 0] }}
        render.width_px = 80
        render.height_px = 60
        render.bounces_max = 0
        render.camera = {{ {camera} }}
        {more}
        ",
        balls.join(", ")
    ))
}

/// Middle (columns, rows), mass in pixels and mean square distance from the middle of the light in a picture.
fn blob(film: &Film) -> ([f64; 2], f64, f64) {
    let (mut mass, mut moments, mut square) = (0.0, [0.0; 2], 0.0);
    for (index, pixel) in film.rgb.iter().enumerate() {
        let place = [(index % 80) as f64 + 0.5, (index / 80) as f64 + 0.5];
        mass += pixel[0];
        for axis in 0..2 {
            moments[axis] += pixel[0] * place[axis];
            square += pixel[0] * place[axis] * place[axis];
        }
    }
    let middle = moments.map(|moment| moment / mass);
    (middle, mass, square / mass - middle[0] * middle[0] - middle[1] * middle[1])
}

#[test]
fn an_orthographic_picture_is_a_plan() {
    let camera =
        "position_m = [0, 0, 5], look_at_m = [0, 0, 0], projection = 'orthographic', view_height_m = 3.0";
    // 20 pixels a metre, at any distance.
    for [x, y, z] in [[0.0, 0.0, 0.0], [1.0, 0.5, 0.0], [1.0, 0.5, 3.0], [-1.5, -1.0, -40.0]] {
        let (middle, mass, _) = blob(&film(&balls(&[[x, y, z]], camera, "")));
        let expected = [40.0 + 20.0 * x, 30.0 - 20.0 * y];
        println!("at {:?}: middle {middle:.3?}, expected {expected:.3?}; {mass:.2} pixels", [x, y, z]);
        assert!((middle[0] - expected[0]).abs() < 0.1 && (middle[1] - expected[1]).abs() < 0.1);
        assert!((mass / (core::f64::consts::PI * 4.0) - 1.0).abs() < 0.02);
    }
}

#[test]
fn a_lens_blurs_what_is_not_in_focus() {
    let camera =
        |more: &str| format!("position_m = [0, 0, 5], look_at_m = [0, 0, 0], lens_radius_m = 0.2{more}");
    let spread = |place: [f64; 3], more: &str| {
        let scene = balls(&[place], &camera(more), "render.samples_per_pixel = 256");
        blob(&film(&scene))
    };
    let sharp = blob(&film(&balls(&[[0.0; 3]], "position_m = [0, 0, 5]", "render.samples_per_pixel = 256")));
    let in_focus = spread([0.0; 3], "");
    println!("pinhole {sharp:.3?}, in focus {in_focus:.3?}");
    assert!((in_focus.2 / sharp.2 - 1.0).abs() < 0.05);
    // A ball at distance d with focus at f is spread by a disc of radius lens |1 - d/f| in its own plane; the mean square
    // of a disc is half its radius squared. Pixels at distance d are 2 tan(0.35) d / 60 wide.
    for (z, focus) in [(-5.0, 5.0), (2.0, 5.0), (0.0, 10.0)] {
        let distance: f64 = 5.0 - z;
        let (_, _, square) = spread([0.0, 0.0, z], &format!(", focus_distance_m = {focus:?}"));
        let pixel = 2.0 * libm::tan(0.35) * distance / 60.0;
        let disc = 0.2 * (1.0 - distance / focus).abs();
        let expected = (0.5 * disc * disc + 0.5 * 0.1 * 0.1) / (pixel * pixel) + 1.0 / 6.0;
        println!(
            "distance {distance}, focus {focus}: mean square {square:.3}, expected {expected:.3}, tolerance 5 %"
        );
        assert!((square / expected - 1.0).abs() < 0.05);
    }
}

#[test]
fn an_open_shutter_draws_the_way() {
    let camera = "position_m = [0, 0, 5], projection = 'orthographic', view_height_m = 3.0";
    let still = balls(&[[-0.5, 0.0, 0.0]], camera, "render.samples_per_pixel = 256");
    let (model, _) = RenderModel::compile(&still);
    let mut bodies = still.initial_bodies();
    bodies[0].linear_velocity_m_per_s = [10.0, 0.0, 0.0];
    let seen = |scene: &Scene, count: usize| {
        let (model, _) = RenderModel::compile(scene);
        render(&model, &bodies, 0, scene.seed, threads(count)).expect("a state")
    };
    let closed = render(&model, &bodies, 0, still.seed, threads(1)).expect("a state");
    let mut open = still.clone();
    open.render.camera.shutter_s = 0.1;
    open.render.camera.shutter_moments = 64;
    let film = seen(&open, 1);
    assert_eq!(film, seen(&open, 3), "threads");
    let (before, after) = (blob(&closed), blob(&film));
    println!("closed {before:.3?}, open {after:.3?}");
    // One metre of way: its middle half a metre on, the light of the ball spread over 20 more pixels, all of it there.
    assert!((after.0[0] - before.0[0] - 10.0).abs() < 0.15 && (after.0[1] - before.0[1]).abs() < 0.05);
    assert!((after.1 / before.1 - 1.0).abs() < 0.02);
    // The moments' mean square distance is that of evenly spread points: a twelfth of the square of the way.
    assert!((after.2 - before.2 - 400.0 / 12.0).abs() < 0.5);
    // A turn: a ring seen edge on that turns about its diameter by half a turn fills a disc.
    let ring = scene(
        "
        ring = [{ major_radius_m = 1.0, minor_radius_m = 0.05, mass_kg = 1.0, material = 'a', position_m = [0, 0, 0] }]
        render.look.a = { bsdf = 'emitter', radiance = [1, 1, 1] }
        render.sky = { zenith_radiance = [0, 0, 0], horizon_radiance = [0, 0, 0] }
        render.width_px = 80
        render.height_px = 60
        render.samples_per_pixel = 128
        render.camera = { position_m = [0, 5, 0], up = [0, 0, 1], projection = 'orthographic', view_height_m = 3.0, shutter_s = 1.0, shutter_moments = 128 }
        ",
    );
    let mut bodies = ring.initial_bodies();
    bodies[0].angular_velocity_rad_per_s = [core::f64::consts::PI, 0.0, 0.0];
    let (model, _) = RenderModel::compile(&ring);
    let film = render(&model, &bodies, 0, 0, threads(2)).expect("a state");
    let lit = film.rgb.iter().filter(|pixel| pixel[0] > 0.0).count();
    let expected = core::f64::consts::PI * 21.0 * 21.0;
    println!("{lit} pixels lit, disc of {expected:.0}, tolerance 8 %");
    assert!((lit as f64 / expected - 1.0).abs() < 0.08);
}

#[test]
fn a_camera_follows_its_path() {
    let path = "path = [
        { time_s = 0.0, position_m = [0, 0, 5], look_at_m = [0, 0, 0] },
        { time_s = 1.0, position_m = [1, 0, 5], look_at_m = [1, 0, 0] },
        { time_s = 2.0, position_m = [2, 0, 5], look_at_m = [2, 0, 0], vertical_field_of_view_rad = 0.7 },
        { time_s = 4.0, position_m = [4, 0, 5], look_at_m = [4, 0, 0] },
    ], projection = 'orthographic', view_height_m = 3.0";
    let mut on_a_path = balls(&[[1.5, 0.0, 0.0]], path, "");
    on_a_path.time.frames_per_second = 4.0;
    let (model, _) = RenderModel::compile(&on_a_path);
    // The viewpoints lie on a line at even speed, which the curve keeps: one metre a second.
    for frame in [0, 3, 4, 6, 9, 12] {
        let film = render(&model, &on_a_path.initial_bodies(), frame, 0, threads(1)).expect("a state");
        let expected = 40.0 + 20.0 * (1.5 - frame as f64 / 4.0);
        let (middle, ..) = blob(&film);
        println!("frame {frame}: at {:.3}, expected {expected:.3}", middle[0]);
        assert!((middle[0] - expected).abs() < 0.1);
    }
    // After the last viewpoint it stands still; random numbers differ from frame to frame, the picture does not.
    let after = render(&model, &on_a_path.initial_bodies(), 400, 0, threads(1)).expect("a state");
    assert!(
        after.rgb.iter().all(|pixel| pixel[0] == 0.0),
        "the ball is 2.5 m away, the picture ends after 2 m"
    );
}

#[test]
fn wrong_cameras_are_refused() {
    for (camera, named) in [
        ("projection = 'orthographic'", "view_height_m"),
        ("view_height_m = 2.0", "view_height_m"),
        ("lens_radius_m = -1.0", "lens_radius_m"),
        ("shutter_moments = 3", "shutter_moments"),
        ("shutter_s = -1.0", "shutter_s"),
        ("focus_distance_m = 0.0", "focus_distance_m"),
        (
            "path = [{ time_s = 1.0, position_m = [0, 0, 5], look_at_m = [0, 0, 0] }, { time_s = 1.0, position_m = [0, 0, 5], look_at_m = [0, 0, 0] }]",
            "path[1].time_s",
        ),
        ("path = [{ time_s = 1.0, position_m = [0, 0, 0], look_at_m = [0, 0, 0] }]", "path[0]"),
    ] {
        let text =
            format!("time = {{ duration_s = 0.0, time_step_s = 0.001 }}\nrender.camera = {{ {camera} }}");
        let error = Scene::parse(&text, &[]).map(drop).expect_err(camera).to_string();
        assert!(error.contains(named) || error.contains("camera.up"), "{camera}: {error}");
    }
}

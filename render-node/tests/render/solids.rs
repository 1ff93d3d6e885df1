//! Capsules, boxes and polynomial bodies in pictures.

use crate::staging::{Dice, scene, threads};
use geometry::shift::closest_approach;
use render_node::{Ray, RenderModel, World, initial_states, render};
use schemas::scene::Scene;

/// Solids of all kinds around the origin, white under a white sky; some overlap, which a picture does not mind.
fn solids(dice: &mut Dice, count: usize) -> Scene {
    let mut text = String::from(
        "render.sky.zenith_radiance = [1, 1, 1]\nrender.sky.horizon_radiance = [1, 1, 1]\n\
         render.width_px = 48\nrender.height_px = 36\nrender.samples_per_pixel = 4\nrender.bounces_max = 60\n\
         render.camera.position_m = [0, -9, 1]\nrender.camera.look_at_m = [0, 0, 0]\nrender.camera.up = [0, 0, 1]\n",
    );
    let mut add = |dice: &mut Dice, kind: &str, shape: &str, reach: f64| {
        let place: [f64; 3] = dice.in_cube(reach).into();
        text += &format!(
            "[[{kind}]]\n{shape}\nmass_kg = 1.0\nmaterial = \"white\"\nposition_m = {place:?}\norientation = {:?}\n",
            dice.quaternion()
        );
    };
    for index in 0..count {
        let size = 0.2 + 0.3 * dice.unit();
        let half_length = dice.unit();
        add(dice, "capsule", &format!("radius_m = {size:?}\nhalf_length_m = {half_length:?}"), 3.0);
        let edge = if index % 2 == 0 { 0.0 } else { 0.1 };
        let half = [size, 0.3 + 0.4 * dice.unit(), 0.5];
        add(dice, "box", &format!("half_extents_m = {half:?}\nedge_radius_m = {edge:?}"), 3.0);
    }
    let torus =
        "formula = \"(x^2 + y^2 + z^2 + 3)^2 - 16*(x^2 + y^2)\"\nscale_m = 0.3\nbounding_radius_m = 0.95";
    let tangle = "formula = \"x^4 - 5*x^2 + y^4 - 5*y^2 + (z - 1)^4 - 5*(z - 1)^2 + 11.8\"\nscale_m = 0.3\n\
                  bounding_radius_m = 1.4";
    add(dice, "polynomial", torus, 2.0);
    add(dice, "polynomial", tangle, 2.0);
    scene(&text)
}

#[test]
fn the_tree_finds_what_asking_every_solid_finds() {
    let mut dice = Dice::new(5);
    for count in [1, 12] {
        let scene = solids(&mut dice, count);
        let (model, plan) = RenderModel::compile(&scene);
        assert!(plan.needs("shape/capsule") && plan.needs("shape/box") && plan.needs("shape/polynomial"));
        let states = initial_states(&scene).expect("formulas of bodies");
        let world = World::new(&model, &states).expect("the state is the scene's");
        let mut met = 0;
        for index in 0..4000 {
            let target = dice.in_cube(3.0);
            let far = [3.0, 30.0, 1e4][index % 3];
            let origin = target + dice.direction() * far;
            let mut ray = Ray::new(origin, (target - origin).normalize());
            if index % 4 == 3 {
                // From a surface.
                if let Some(hit) = world.closest_of_all(&ray) {
                    ray = Ray::new(ray.origin + ray.direction * hit.distance, dice.direction());
                }
            }
            let expected = world.closest_of_all(&ray);
            let bits = |hit: Option<render_node::Hit>| hit.map(|hit| (hit.distance.to_bits(), hit.surface));
            assert_eq!(bits(world.closest(&ray)), bits(expected), "{index}: {ray:?}");
            let distance = expected.map_or(f64::INFINITY, |hit| hit.distance * 1.1);
            assert_eq!(world.any(&ray, distance, None), expected.is_some(), "{index}: {ray:?}");
            met += usize::from(expected.is_some());
        }
        println!("{count} of each: {met} of 4000 rays meet a solid");
        assert!(met > 300);
    }
}

/// From a million sizes away a turned solid is met where its like is met from nearby: to half a unit in the last place of
/// the ray parameter, and of the place where the ray begins.
#[test]
fn solids_far_away_are_met_where_they_are() {
    let mut dice = Dice::new(73);
    let scene = solids(&mut dice, 30);
    let (model, _) = RenderModel::compile(&scene);
    let states = initial_states(&scene).expect("formulas of bodies");
    let world = World::new(&model, &states).expect("the state is the scene's");
    let mut errors = Vec::new();
    for _ in 0..4_000 {
        let (to, direction) = (dice.in_cube(3.0), dice.direction());
        let far = Ray::new(to - direction * 1e6, direction);
        let (s, nearest) = closest_approach(&far.origin, &direction, 4.0);
        let near = Ray::new(nearest - direction * 16.0, direction);
        let (Some(a), Some(b)) = (world.closest(&far), world.closest(&near)) else { continue };
        if a.surface == b.surface {
            errors.push((a.distance - s - (b.distance - 16.0)).abs());
        }
    }
    errors.sort_by(f64::total_cmp);
    let (median, most) = (errors[errors.len() / 2], errors[errors.len() * 99 / 100]);
    // Half a unit in the last place of 1e6 is 5.8e-11, in the parameter and in each coordinate of the way from the solid's
    // centre; at a shallow angle a shift to the side counts more.
    println!(
        "{} hits from 1e6 away: median {median:.1e} (limit 1e-10), 99 % {most:.1e} (1e-9)",
        errors.len()
    );
    assert!(errors.len() > 1_000 && median < 1e-10 && most < 1e-9, "{median:e} {most:e}");
}

/// White bodies under a white sky cannot be seen: no light is lost or made at any surface. A ray that got into a body
/// would be dark.
#[test]
fn white_solids_vanish_under_a_white_sky() {
    let mut dice = Dice::new(6);
    let scene = solids(&mut dice, 3);
    let (model, _) = RenderModel::compile(&scene);
    let states = initial_states(&scene).expect("formulas of bodies");
    let film = render(&model, &states, 0, scene.seed, threads(2)).expect("the state is the scene's");
    let mut darkest = f64::INFINITY;
    for &light in film.rgb.iter().flatten() {
        darkest = if light < darkest { light } else { darkest };
    }
    println!("darkest pixel {darkest}");
    // Paths end after 60 bounces; between bodies that overlap few need as many.
    assert!(darkest > 0.99);
}

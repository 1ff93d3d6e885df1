//! The tree finds what asking every body finds, bit for bit.

use crate::staging::{Dice, scene};
use geometry::Vec3;
use geometry::lanes::Level;
use render_node::{Hit, Ray, RenderModel, ShadowEnd, Tracer, World};
use schemas::scene::{Ring, Scene, Sphere};

/// Rings and spheres at random places in a cube of half side 10, of sizes that differ up to a thousandfold.
fn heap(dice: &mut Dice, rings: usize, spheres: usize) -> Scene {
    let mut scene = scene("plane = [{ normal = [0, 0, 1], offset_m = -12.0, material = 'b' }]");
    let size = |dice: &mut Dice| libm::pow(10.0, -2.0 + 3.0 * dice.unit() * dice.unit());
    for _ in 0..rings {
        let major_radius_m = size(dice);
        let position_m = dice.in_cube(10.0).into();
        scene.rings.push(Ring {
            major_radius_m,
            minor_radius_m: major_radius_m * (0.02 + 0.3 * dice.unit()),
            mass_kg: 1.0,
            material: "a".to_owned(),
            position_m,
            orientation: dice.quaternion(),
            linear_velocity_m_per_s: [0.0; 3],
            angular_velocity_rad_per_s: [0.0; 3],
            pinned: false,
            drag: None,
            motion: None,
        });
    }
    for _ in 0..spheres {
        scene.spheres.push(Sphere {
            radius_m: size(dice),
            mass_kg: 1.0,
            material: "b".to_owned(),
            position_m: dice.in_cube(10.0).into(),
            linear_velocity_m_per_s: [0.0; 3],
            angular_velocity_rad_per_s: [0.0; 3],
            pinned: false,
            drag: None,
            motion: None,
        });
    }
    scene
}

fn bits(hit: Option<Hit>) -> Option<(u64, u32)> {
    hit.map(|hit| (hit.distance.to_bits(), hit.surface))
}

/// A ray past or into a body, of one of eight kinds: from near it, from outside at three distances, along an axis,
/// nearly along one, from its very centre, and from a surface. `places` are centres and sizes of the bodies.
fn ray(dice: &mut Dice, kind: usize, world: &World, places: &[(Vec3, f64)]) -> Ray {
    let (centre, size) = places[(places.len() as f64 * dice.unit()) as usize];
    let target = centre + dice.in_cube(1.5 * size);
    let from = |dice: &mut Dice, distance: f64| {
        let origin = dice.direction() * distance;
        Ray::new(origin, (target - origin).normalize())
    };
    let axis =
        [Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y(), Vec3::z(), -Vec3::z()][(6.0 * dice.unit()) as usize];
    match kind {
        0 => Ray::new(target, dice.direction()),
        1 => from(dice, 40.0),
        2 => from(dice, 1e4),
        3 => from(dice, 1e7),
        4 => Ray::new(target - axis * 30.0, axis),
        5 => Ray::new(target - axis * 30.0, (axis + dice.direction() * 1e-12).normalize()),
        6 => Ray::new(centre, dice.direction()),
        _ => {
            let first = Ray::new(target, dice.direction());
            match world.closest_of_all(&first) {
                Some(hit) => Ray::new(first.origin + first.direction * hit.distance, dice.direction()),
                None => first,
            }
        }
    }
}

/// Compares the tree with asking every body, on rays of all kinds, and returns how many met a body and were blocked.
fn compare(dice: &mut Dice, scene: &Scene, rays: usize) -> (usize, usize) {
    let (model, _) = RenderModel::compile(scene);
    let states = scene.initial_bodies();
    let sizes = scene.rings.iter().map(|ring| ring.major_radius_m);
    let sizes = sizes.chain(scene.spheres.iter().map(|sphere| sphere.radius_m));
    let places: Vec<_> = states.iter().map(|state| Vec3::from(state.position_m)).zip(sizes).collect();
    let world = World::new(&model, &states).expect("the state is the scene's");
    let (mut met, mut blocked) = (0, 0);
    for index in 0..rays {
        let ray = ray(dice, index % 8, &world, &places);
        let expected = world.closest_of_all(&ray);
        assert_eq!(
            bits(world.closest(&ray)),
            bits(expected),
            "{} bodies, ray {index}: {ray:?}",
            states.len()
        );
        // The very distance of the first hit is the sharpest question: it must not block itself.
        let distance = match expected {
            Some(hit) if index % 3 == 0 => hit.distance,
            Some(hit) => hit.distance * (0.5 + dice.unit()),
            None => f64::INFINITY,
        };
        let expected_any = world.any_of_all(&ray, distance, None);
        assert_eq!(
            world.any(&ray, distance, None),
            expected_any,
            "{} bodies, ray {index}: {ray:?}",
            states.len()
        );
        met += usize::from(expected.is_some_and(|hit| (hit.surface as usize) < states.len()));
        blocked += usize::from(expected_any);
    }
    (met, blocked)
}

#[test]
fn tree_equals_every_body_bit_for_bit() {
    let mut dice = Dice::new(1);
    for (rings, spheres, rays) in [(1, 0, 400), (0, 1, 400), (4, 1, 400), (30, 5, 2_000), (400, 60, 4_000)] {
        let scene = heap(&mut dice, rings, spheres);
        let (met, blocked) = compare(&mut dice, &scene, rays);
        println!("{rings} rings, {spheres} spheres: {met} of {rays} rays met a body, {blocked} were blocked");
        assert!(met > rays / 8);
    }
}

#[test]
fn tree_equals_every_body_far_from_the_origin_and_with_a_stray() {
    let mut dice = Dice::new(3);
    for (shift, stray) in [([1e6, -3e5, 2e4], None), ([0.0; 3], Some(1e3)), ([7.0, 1e3, 0.0], Some(1e8))] {
        let mut scene = heap(&mut dice, 60, 10);
        scene.planes.clear();
        let places = scene.rings.iter_mut().map(|ring| &mut ring.position_m);
        for place in places.chain(scene.spheres.iter_mut().map(|sphere| &mut sphere.position_m)) {
            *place = std::array::from_fn(|axis| place[axis] + shift[axis]);
        }
        if let Some(distance) = stray {
            scene.rings[7].position_m = [distance, 0.0, 0.0];
        }
        let (met, blocked) = compare(&mut dice, &scene, 2_000);
        println!("shift {shift:?}, stray {stray:?}: {met} of 2000 rays met a body, {blocked} were blocked");
        assert!(met > 200);
    }
}

/// A weave is the densest case: every ring lies in its neighbours' boxes.
#[test]
fn tree_equals_every_body_in_a_weave() {
    let mut dice = Dice::new(4);
    let scene = scene(
        "weave = [{ pattern = 'european-4-in-1', rows = 12, columns = 14, major_radius_m = 1.0, minor_radius_m = 0.18, ring_mass_kg = 1.0, material = 'a' }]",
    );
    let (met, blocked) = compare(&mut dice, &scene, 4_000);
    println!("weave: {met} of 4000 rays met a ring, {blocked} were blocked");
    assert!(met > 2_000);
}

#[test]
fn equal_distances_go_to_the_lowest_number() {
    let mut dice = Dice::new(2);
    let mut scene = heap(&mut dice, 1, 0);
    scene.rings[0].major_radius_m = 3.0;
    scene.rings[0].minor_radius_m = 1.0;
    scene.rings.resize(40, scene.rings[0].clone());
    let (model, _) = RenderModel::compile(&scene);
    let states = scene.initial_bodies();
    let world = World::new(&model, &states).expect("the state is the scene's");
    let centre = Vec3::from(scene.rings[0].position_m);
    let mut met = 0;
    for _ in 0..300 {
        let direction = dice.direction();
        let ray = Ray::new(centre + dice.in_cube(3.0) - direction * 20.0, direction);
        if let Some(hit) = world.closest(&ray).filter(|hit| hit.surface != 40) {
            assert_eq!(hit.surface, 0);
            met += 1;
        }
    }
    assert!(met > 50, "{met} rays met the rings");
}

/// What many rays meet, and whether they are blocked, as bits.
fn traced(world: &World, level: Level, rays: &[Ray]) -> Vec<(Option<(u64, u32)>, bool)> {
    let mut tracer = Tracer::new(level);
    let (mut hits, mut blocked) = (Vec::new(), Vec::new());
    world.closest_each(&mut tracer, rays, &mut hits);
    let distance = |hit: &Option<Hit>| hit.map_or(f64::INFINITY, |hit| hit.distance * 1.25);
    let ends: Vec<_> = hits.iter().map(|hit| ShadowEnd { distance: distance(hit), target: None }).collect();
    world.any_each(&mut tracer, rays, &ends, &mut blocked);
    hits.into_iter().map(bits).zip(blocked).collect()
}

#[test]
fn lists_of_rays_meet_what_each_ray_meets_on_every_instruction_set() {
    let mut dice = Dice::new(5);
    let scene = heap(&mut dice, 300, 20);
    let (model, _) = RenderModel::compile(&scene);
    let states = scene.initial_bodies();
    let world = World::new(&model, &states).expect("the state is the scene's");
    let places: Vec<_> = states.iter().map(|state| (Vec3::from(state.position_m), 1.0)).collect();
    let rays: Vec<_> = (0..3_000).map(|index| ray(&mut dice, index % 8, &world, &places)).collect();
    let found = traced(&world, Level::new(), &rays);
    for (ray, found) in rays.iter().zip(&found) {
        assert_eq!(found.0, bits(world.closest_of_all(ray)), "{ray:?}");
    }
    let best = Level::new();
    let mut levels = vec![Level::baseline()];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    levels.extend([best.as_avx2().map(Level::Avx2), best.as_sse2().map(Level::Sse2)].into_iter().flatten());
    for level in levels {
        assert_eq!(traced(&world, level, &rays), found, "{level:?} and {best:?}");
        // Other lists, the same answers.
        let parts: Vec<_> = rays.chunks(77).flat_map(|rays| traced(&world, level, rays)).collect();
        assert_eq!(parts, found, "{level:?} in parts");
    }
    let met = found.iter().filter(|(hit, _)| hit.is_some()).count();
    println!("{met} of {} rays met something", rays.len());
    assert!(met > 1_000);
}

#[test]
fn a_hierarchy_of_an_earlier_state_finds_the_same() {
    let mut dice = Dice::new(6);
    let scene = heap(&mut dice, 200, 10);
    let (model, _) = RenderModel::compile(&scene);
    let before = scene.initial_bodies();
    for moved_by in [1e-3, 1.0, 30.0, 1e6] {
        let mut after = before.clone();
        for state in &mut after {
            let place = Vec3::from(state.position_m) + dice.in_cube(moved_by);
            (state.position_m, state.orientation) = (place.into(), dice.quaternion());
        }
        let earlier = World::new(&model, &before).expect("a state").into_hierarchy();
        let kept = World::after(&model, &after, Some(earlier)).expect("a state");
        let anew = World::new(&model, &after).expect("a state");
        let places: Vec<_> = after.iter().map(|state| (Vec3::from(state.position_m), 1.0)).collect();
        let rays: Vec<_> = (0..2_000).map(|index| ray(&mut dice, index % 8, &anew, &places)).collect();
        let found = traced(&anew, Level::new(), &rays);
        assert_eq!(traced(&kept, Level::new(), &rays), found, "moved by {moved_by}");
        let met = found.iter().filter(|(hit, _)| hit.is_some()).count();
        println!("moved by up to {moved_by}: {met} of {} rays met something", rays.len());
        assert!(met > 250);
    }
}

#[test]
fn rings_all_in_one_place_are_met() {
    let mut dice = Dice::new(7);
    let mut scene = heap(&mut dice, 1, 0);
    scene.rings[0].major_radius_m = 3.0;
    scene.rings[0].minor_radius_m = 1.0;
    scene.rings.resize(700, scene.rings[0].clone());
    let (met, blocked) = compare(&mut dice, &scene, 800);
    println!("{met} of 800 rays met a ring, {blocked} were blocked");
    assert!(met > 100, "{met} rays met a ring");
}

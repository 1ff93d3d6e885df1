//! Surfaces that are only looked at, and the two root finders.

use crate::staging::{Dice, film, scene, threads};
use geometry::Vec3;
use nalgebra::{Quaternion, UnitQuaternion};
use render_node::{FeatureImages, Ray, RenderModel, World, initial_states, render};
use schemas::scene::Scene;

/// A ray from outside or inside through a ball about a point.
fn ray(dice: &mut Dice, about: &Vec3, size: f64) -> Ray {
    let target = about + dice.direction() * (size * dice.unit());
    let origin = target + dice.direction() * (size * [0.1, 3.0, 1e3, 1e6][(4.0 * dice.unit()) as usize]);
    Ray::new(origin, (target - origin).normalize())
}

fn with_world<T>(scene: &Scene, look: impl FnOnce(&World) -> T) -> T {
    let (model, _) = RenderModel::compile(scene);
    let states = initial_states(scene).expect("the formulas are those of bodies");
    look(&World::new(&model, &states).expect("the state is the scene's"))
}

#[test]
fn a_sphere_by_formula_is_a_sphere_in_its_place_and_size() {
    let formula = scene(
        "render.look.a = {}
        render.surface = [{ formula = 'x^2 + y^2 + z^2 - 1', scale_m = 0.7, bounding_radius_m = 1.0, look = 'a', position_m = [0.1, 0.2, -3.0], orientation = [0.6, 0, 0, 0.8] }]",
    );
    let body =
        scene("sphere = [{ radius_m = 0.7, mass_kg = 1.0, material = 'a', position_m = [0.1, 0.2, -3.0] }]");
    assert_eq!(formula.body_count(), 0);
    let mut dice = Dice::new(50);
    let (mut hits, mut worst) = (0, 0.0);
    with_world(&formula, |formula| {
        with_world(&body, |body| {
            for _ in 0..4_000 {
                let ray = ray(&mut dice, &Vec3::new(0.1, 0.2, -3.0), 0.9);
                match (formula.closest(&ray), body.closest(&ray)) {
                    (Some(ours), Some(exact)) => {
                        hits += 1;
                        // Across the surface, where a grazing ray's parameter is not sharp; far away a unit in the last
                        // place of the parameter is 1e-10.
                        let normal = (ray.origin + ray.direction * exact.distance
                            - Vec3::new(0.1, 0.2, -3.0))
                        .normalize();
                        let slope = normal.dot(&ray.direction).abs();
                        let off =
                            (ours.distance - exact.distance).abs() * slope / (1.0 + 1e-4 * exact.distance);
                        worst = if off > worst { off } else { worst };
                    }
                    (None, None) => {}
                    other => panic!("{ray:?}: {other:?}"),
                }
            }
        });
    });
    println!("{hits} hits, at most {worst:e} m apart, allowed 1e-11");
    assert!(hits > 1_500 && worst < 1e-11);
}

#[test]
fn a_box_cuts_a_surface_off_in_its_own_axes() {
    let orientation = [0.1, 0.3, -0.2, 0.927_361_849_549_570_4];
    let scene = scene(&format!(
        "render.look.a = {{}}
        render.surface = [{{ formula = 'z', scale_m = 2.0, bounding_half_extents_m = [1.0, 0.5, 0.2], look = 'a', position_m = [5, 0, 0], orientation = {orientation:?} }}]"
    ));
    let [x, y, z, w] = orientation;
    let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    let centre = Vec3::new(5.0, 0.0, 0.0);
    let mut dice = Dice::new(51);
    let mut hits = 0;
    with_world(&scene, |world| {
        for _ in 0..4_000 {
            let ray = ray(&mut dice, &centre, 1.2);
            let (o, d) = (
                turn.inverse_transform_vector(&(ray.origin - centre)),
                turn.inverse_transform_vector(&ray.direction),
            );
            let t = -o.z / d.z;
            let at = o + d * t;
            let inside = |margin: f64| at.x.abs() < 1.0 + margin && at.y.abs() < 0.5 + margin && t > margin;
            let found = world.closest(&ray);
            // From 1e6 away the edge is uncertain by 1e-9.
            if inside(-1e-6) {
                let hit = found.expect("a ray within the box meets the plane");
                assert!((hit.distance - t).abs() < 1e-9 * (1.0 + t) / d.z.abs(), "{hit:?} {t}");
                hits += 1;
            } else if !inside(1e-6) {
                assert_eq!(found, None, "{ray:?}");
            }
        }
    });
    println!("{hits} hits");
    assert!(hits > 500);
}

/// The rule of double roots: what does not change its sign is not there.
#[test]
fn where_a_formula_only_touches_zero_nothing_is_seen() {
    let with = |formula: &str| {
        scene(&format!(
            "render.look.a = {{}}
            render.surface = [{{ formula = '{formula}', bounding_radius_m = 2.0, look = 'a' }}]"
        ))
    };
    for formula in ["(x^2 + y^2 + z^2 - 1)^2", "x^2*(1 + z^2)", "7"] {
        let error =
            RenderModel::try_compile(&with(formula)).map(|_| formula).expect_err("nothing").to_string();
        assert!(error.contains("render.surface[0].formula") && error.contains("only touches 0"), "{error}");
    }
    // A simple factor is seen as if the square beside it were not there, a triple one as a simple one.
    for (formula, plane) in
        [("(x^2 + y^2 + z^2 - 1)^2*(z - 0.25)", 0.25), ("z^2*(z - 0.5)", 0.5), ("(z + 0.5)^3", -0.5)]
    {
        let mut dice = Dice::new(52);
        with_world(&with(formula), |world| {
            let (mut hits, mut worst) = (0, 0.0);
            for _ in 0..500 {
                let from = dice.in_cube(1.0) + Vec3::new(0.0, 0.0, 6.0);
                let ray = Ray::new(from, (dice.in_cube(0.8) - from).normalize());
                let t = (plane - from.z) / ray.direction.z;
                let hit = world.closest(&ray).expect("the plane is below");
                let off = (hit.distance - t).abs();
                worst = if off > worst { off } else { worst };
                hits += 1;
            }
            // A root of multiplicity m of a polynomial that is known to 1e-15 is known to 1e-15^(1/m).
            let tolerance = if formula.ends_with("^3") { 1e-4 } else { 1e-11 };
            println!("{formula}: {hits} hits, at most {worst:e} m off, allowed {tolerance:e}");
            assert!(worst < tolerance, "{formula}: {worst:e}");
        });
    }
}

/// All that a surface may be wrong in, with the place of the mistake.
#[test]
fn surfaces_that_cannot_be_shown_are_refused() {
    let parse = |surface: &str| {
        let text = format!(
            "time = {{ duration_s = 0.0, time_step_s = 0.001 }}\nrender.look.blue = {{}}\nrender.surface = [{{ {surface} }}]"
        );
        Scene::parse(&text, &[])
    };
    for (surface, words) in [
        ("formula = 'x', look = 'blue'", "render.surface[0].bounding_radius_m = not given: expected either"),
        (
            "formula = 'x', look = 'blue', bounding_radius_m = 1.0, bounding_half_extents_m = [1, 1, 1]",
            "given beside the box",
        ),
        ("formula = 'x', look = 'bleu', bounding_radius_m = 1.0", "did you mean \"blue\"?"),
        ("formula = 'x', look = 'blue', bounding_radius_m = 0.0", "a positive number"),
        (
            "formula = 'x', look = 'blue', bounding_radius_m = 1.0, scale_m = -1.0",
            "render.surface[0].scale_m",
        ),
        ("formula = 'x', look = 'blue', bounding_radius_m = 1.0, orientation = [1, 1, 0, 0]", "length 1"),
    ] {
        let error = parse(surface).expect_err(surface).to_string();
        assert!(error.contains(words), "{error}");
    }
    let scene =
        parse("formula = 'x^2 + 3y', look = 'blue', bounding_radius_m = 1.0").expect("keys are right");
    let error =
        RenderModel::try_compile(&scene).map(|_| ()).expect_err("a product needs its sign").to_string();
    let expected = "render.surface[0].formula: an operator (+ - * ^) was expected, not 'y', at character 8 of the \
                    formula: x^2 + 3>>>y";
    assert_eq!(error, expected);
}

/// A little of everything that has roots to find.
const STILL_LIFE: &str = "
    ring = [
        { major_radius_m = 1.0, minor_radius_m = 0.25, mass_kg = 1.0, material = 'a', position_m = [-0.4, 0, 0], orientation = [0.6, 0, 0, 0.8] },
        { major_radius_m = 0.9, minor_radius_m = 0.2, mass_kg = 1.0, material = 'b', position_m = [0.5, 0, 0.1] },
    ]
    sphere = [{ radius_m = 0.5, mass_kg = 1.0, material = 'b', position_m = [1.6, 0.8, -0.9] }]
    polynomial = [{ formula = 'x^4 + y^4 + z^4 - 1', bounding_radius_m = 1.0, scale_m = 0.5, density_kg_per_m3 = 1.0, material = 'a', position_m = [-1.6, -0.5, -0.6] }]
    plane = [{ normal = [0, 0, 1], offset_m = -1.5, material = 'b' }]
    render.surface = [{ formula = 'x^2*y^2 + y^2*z^2 + z^2*x^2 - x*y*z', bounding_radius_m = 1.0, look = 'a', position_m = [0, -1, 1] }]
    render.look.a.albedo = [0.8, 0.6, 0.3]
    render.light = [{ shape = 'sphere', position_m = [3, -3, 3], radius_m = 0.6, radiance = [12, 12, 12] }]
    render.camera = { position_m = [1, -6, 3], look_at_m = [0, 0, -0.2], up = [0, 0, 1], vertical_field_of_view_rad = 0.7 }
    render.sky.up = [0, 0, 1]
    render.width_px = 64
    render.height_px = 48
    render.samples_per_pixel = 4
";

#[test]
fn both_root_finders_see_the_same() {
    let with = |settings: &str| scene(&format!("{STILL_LIFE}\n{settings}"));
    let by = |settings: &str| {
        let scene = with(settings);
        let (model, plan) = RenderModel::compile(&scene);
        let states = initial_states(&scene).expect("formulas of bodies");
        let features = FeatureImages::new(&model, &states, 0).expect("the state is the scene's");
        let film = render(&model, &states, 0, scene.seed, threads(2)).expect("the state is the scene's");
        (features, film, plan)
    };
    let (bernstein, film, plan) = by("");
    assert!(plan.entries.iter().all(|entry| entry.part != "shape/companion"));
    assert!(plan.needs("shape/surface"));
    let (companion, other, plan) = by("render.root_finder = 'companion'");
    assert!(plan.needs("shape/companion"));
    assert_eq!(bernstein.surface, companion.surface);
    let mut numbers = bernstein.surface.clone();
    numbers.sort_unstable();
    numbers.dedup();
    // Two rings, a sphere, the body, the surface and the plane; sky and light are out of sight.
    assert_eq!(numbers, [0, 1, 2, 3, 4, 5]);
    let pairs = bernstein.distance_m.iter().zip(&companion.distance_m).filter(|(a, _)| a.is_finite());
    let apart =
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, |worst, apart| if apart > worst { apart } else { worst });
    let mean =
        |film: &render_node::Film| film.rgb.iter().flatten().sum::<f64>() / (3.0 * film.rgb.len() as f64);
    let (ours, theirs) = (mean(&film), mean(&other));
    println!("distances at most {apart:e} m apart, allowed 1e-9; mean radiance {ours:.6} and {theirs:.6}");
    // A path goes another way once a rounding has turned it past an edge; few of 12,288 do.
    assert!(apart < 1e-9 && (ours - theirs).abs() < 1e-3 * ours);
    assert_ne!(film.hash(), other.hash(), "the companion matrix was asked");
    // What colours a body does not depend on it: the rings' wires cross.
    let albedo = |finder: &str| {
        by(&format!("render.colouring.by = 'penetration'\nrender.root_finder = '{finder}'")).0.albedo
    };
    assert_eq!(albedo("bernstein"), albedo("companion"));
}

/// White surfaces under a white sky cannot be seen: an open sheet, which has two sides, a cut off cubic, a surface that
/// crosses itself, and a torus without a hole.
#[test]
fn white_surfaces_vanish_under_a_white_sky() {
    let film = film(&scene(
        "
        render.surface = [
            { formula = 'x*y - z', bounding_half_extents_m = [1, 1, 0.8], look = 'white', position_m = [-1.2, 0, 0] },
            { formula = 'x^3 + y^3 + z^3 - 0.1', bounding_radius_m = 0.8, look = 'white', position_m = [1.2, 0, 0] },
            { formula = 'x^2*y^2 + y^2*z^2 + z^2*x^2 - x*y*z', scale_m = 2.0, bounding_radius_m = 2.0, look = 'white', position_m = [0, 1.5, 0] },
            { formula = '(x^2 + y^2 + z^2)^2 - 4*(x^2 + y^2)', scale_m = 0.4, bounding_radius_m = 1.0, look = 'white', position_m = [0, -1.5, 0] },
        ]
        render.sky = { zenith_radiance = [1, 1, 1], horizon_radiance = [1, 1, 1] }
        render.camera = { position_m = [0.5, -1, 6], vertical_field_of_view_rad = 0.8 }
        render.width_px = 40
        render.height_px = 40
        render.samples_per_pixel = 8
        render.bounces_max = 1000
        ",
    ));
    assert!(film.rgb.iter().all(|pixel| *pixel == [1.0; 3]));
    println!("{} rays for {} samples", film.rays, 40 * 40 * 8);
    assert!(film.rays > 40 * 40 * 8 * 5 / 4, "{} rays: the camera sees the surfaces", film.rays);
}

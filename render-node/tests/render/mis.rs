//! Each way to find light gives the same mean, and both together are better than either where it is bad.

use crate::staging::{film, scene};
use render_node::Film;

fn mean_and_error(film: &Film) -> (f64, f64) {
    let count = film.rgb.len() as f64;
    let luminance = |pixel: &[f64; 3]| pixel.iter().sum::<f64>() / 3.0;
    let mean = film.rgb.iter().map(luminance).sum::<f64>() / count;
    let squares: f64 =
        film.rgb.iter().map(|pixel| (luminance(pixel) - mean) * (luminance(pixel) - mean)).sum();
    (mean, (squares / (count - 1.0) / count).sqrt())
}

/// One point of a plane z = 0 of a look under lights, by one strategy.
fn point(look: &str, lights: &str, strategy: &str, bounces: &str) -> (f64, f64) {
    let film = film(&scene(&format!(
        "
        plane = [{{ normal = [0, 0, 1], offset_m = 0.0, material = 'a' }}]
        render.look.a = {look}
        render.sky = {{ up = [0, 0, 1], zenith_radiance = [0.2, 0.2, 0.2], horizon_radiance = [0.1, 0.1, 0.1] }}
        render.camera = {{ position_m = [3, 0, 4], look_at_m = [0, 0, 0], up = [0, 0, 1], vertical_field_of_view_rad = 1e-5 }}
        render.width_px = 64
        render.height_px = 64
        render.samples_per_pixel = 16
        render.bounces_max = {bounces}
        render.direct_light = '{strategy}'
        render.light = [{lights}]
        "
    )));
    assert_eq!(film.non_finite_samples, 0);
    mean_and_error(&film)
}

/// Where a mirror at the point would show the light, and a wide one there.
const SMALL: &str = "{ shape = 'sphere', position_m = [-3, 0, 4], radius_m = 0.3, radiance = [60, 60, 60] }";
const WIDE: &str = "{ shape = 'rectangle', corner_m = [-5, -3, 1.5], edge_u_m = [0, 6, 0], edge_v_m = [3, 0, 3], radiance = [3, 3, 3] }";

#[test]
fn strategies_agree() {
    for look in [
        "{ albedo = [0.7, 0.7, 0.7] }",
        "{ bsdf = 'conductor', metal = 'steel', roughness = 0.25 }",
        "{ bsdf = 'conductor', metal = 'gold', roughness = 0.7 }",
        "{ bsdf = 'plastic', albedo = [0.4, 0.4, 0.4], roughness = 0.3 }",
        "{ bsdf = 'plastic', albedo = [0.4, 0.4, 0.4], roughness = 0.0 }",
        "{ bsdf = 'mirror', albedo = [0.9, 0.9, 0.9] }",
    ] {
        for lights in [SMALL, WIDE, &format!("{SMALL}, {WIDE}")] {
            let [mis, asked, met] =
                ["mis", "lights", "bsdf"].map(|strategy| point(look, lights, strategy, "0"));
            println!(
                "{look}, {} lights: mis {mis:.5?}, lights {asked:.5?}, bsdf {met:.5?}",
                lights.matches("shape").count()
            );
            for other in [asked, met] {
                // Five standard errors: 6e-7 by chance, the same in every run.
                let error = (mis.1 * mis.1 + other.1 * other.1).sqrt();
                assert!(
                    (mis.0 - other.0).abs() < 5.0 * error + 1e-12,
                    "{look}, {lights}: {mis:?} against {other:?}"
                );
            }
            // The worse strategy may be hopeless; both together are never much worse than the better one,
            // though evenly spread questions of one kind alone have less noise than a mixture.
            let better = if asked.1 < met.1 { asked.1 } else { met.1 };
            assert!(mis.1 < 2.0 * better + 1e-12, "{look}, {lights}: {mis:?}, {asked:?}, {met:?}");
        }
    }
}

/// With a narrow lobe and a wide light asking lights is bad, with a wide lobe and a small light following the reflection.
#[test]
fn both_ways_are_needed() {
    let narrow = "{ bsdf = 'conductor', roughness = 0.15 }";
    let asked = point(narrow, WIDE, "lights", "0");
    let mis = point(narrow, WIDE, "mis", "0");
    println!("narrow lobe, wide light: lights alone {asked:.5?}, mis {mis:.5?}");
    assert!(mis.1 < 0.3 * asked.1);
    let wide = "{ albedo = [0.7, 0.7, 0.7] }";
    let met = point(wide, SMALL, "bsdf", "0");
    let mis = point(wide, SMALL, "mis", "0");
    println!("wide lobe, small light: bsdf alone {met:.5?}, mis {mis:.5?}");
    assert!(mis.1 < 0.1 * met.1);
}

/// Within a grey ball with a ball light in its middle the light of all bounces is a geometric series.
#[test]
fn roulette_keeps_the_mean() {
    let within = |settings: &str| {
        let film = film(&scene(&format!(
            "
            sphere = [{{ radius_m = 2.0, mass_kg = 1.0, material = 'a', position_m = [0, 0, 0] }}]
            render.look.a.albedo = [0.8, 0.8, 0.8]
            render.light = [{{ shape = 'sphere', position_m = [0, 0, 0], radius_m = 0.6, radiance = [10, 10, 10] }}]
            render.camera = {{ position_m = [0, 0, 1.5], look_at_m = [3, 0, 1.5], vertical_field_of_view_rad = 0.5 }}
            render.width_px = 48
            render.height_px = 48
            {settings}
            "
        )));
        (mean_and_error(&film), film.rays)
    };
    let share = 0.3_f64 * 0.3;
    // Light that the wall sends out, whatever the number of bounces: the whole series.
    let expected = 0.8 * 10.0 * share / (1.0 - 0.8 * (1.0 - share));
    for settings in [
        "render.bounces_max = 'unlimited'",
        "render.bounces_max = 'unlimited'\nrender.roulette_after = 0",
        "render.bounces_max = 100\nrender.roulette_after = 1",
        "render.bounces_max = 100\nrender.roulette_after = 1000",
    ] {
        let ((mean, error), rays) = within(settings);
        let z = (mean - expected) / error;
        println!(
            "{settings:?}: {mean:.5} +- {error:.5}, expected {expected:.5}, z = {z:.2} (limit 4.5), {rays} rays"
        );
        assert!(z.abs() < 4.5 && error < 0.01 * expected);
    }
}

/// Light that is cut is cut after the first reflection alone, and never more than asked for.
#[test]
fn indirect_light_can_be_cut() {
    let picture = |settings: &str| {
        film(&scene(&format!(
            "
            sphere = [{{ radius_m = 1.0, mass_kg = 1.0, material = 'b', position_m = [0, 0, 1] }}]
            plane = [{{ normal = [0, 0, 1], offset_m = 0.0, material = 'a' }}]
            render.look.a.albedo = [0.5, 0.5, 0.5]
            render.look.b = {{ bsdf = 'conductor', metal = 'silver', roughness = 0.1 }}
            render.sky = {{ zenith_radiance = [0, 0, 0], horizon_radiance = [0, 0, 0] }}
            render.camera = {{ position_m = [2, -6, 3], look_at_m = [0, 0, 0.5], up = [0, 0, 1] }}
            render.light = [{SMALL}]
            render.width_px = 32
            render.height_px = 24
            {settings}
            "
        )))
    };
    let (all, loose, tight) = (
        picture("render.bounces_max = 3"),
        picture("render.bounces_max = 3\nrender.indirect_max = 1e9"),
        picture("render.bounces_max = 3\nrender.indirect_max = 0.01"),
    );
    assert_eq!(all.rgb, loose.rgb);
    let mean = |film: &Film| mean_and_error(film).0;
    // The light on the floor and the light seen in the ball come after one reflection or none: they stay.
    let direct = mean(&picture("render.bounces_max = 0"));
    println!("mean {:.4}, cut {:.4}, direct alone {direct:.4}", mean(&all), mean(&tight));
    assert!(mean(&tight) < 0.995 * mean(&all) && mean(&tight) > 0.9 * direct);
    // Each sample brings at most three cut contributions beyond the direct light.
    for (cut, whole) in tight.rgb.iter().zip(&all.rgb) {
        assert!(cut[0] <= whole[0] + 1e-12);
    }
}

/// A thousand bounces between white walls, and roulette without an end: exactly 1, and 1 on average.
#[test]
fn white_rooms_with_a_thousand_bounces() {
    let room = |settings: &str| {
        film(&scene(&format!(
            "
            sphere = [{{ radius_m = 1.0, mass_kg = 1.0, material = 'white', position_m = [0, 0, 1] }}]
            ring = [{{ major_radius_m = 1.0, minor_radius_m = 0.3, mass_kg = 1.0, material = 'white', position_m = [0, 0, 0.2] }}]
            polynomial = [{{ formula = 'x^4 + y^4 + z^4 - 1', bounding_radius_m = 1.0, scale_m = 0.6, density_kg_per_m3 = 1.0, material = 'white', position_m = [1.6, 0, 0] }}]
            plane = [{{ normal = [0, 0, 1], offset_m = -0.5, material = 'white' }}]
            render.sky = {{ zenith_radiance = [1, 1, 1], horizon_radiance = [1, 1, 1] }}
            render.camera = {{ position_m = [2, -4, 3], look_at_m = [0.5, 0, 0.5], up = [0, 0, 1], vertical_field_of_view_rad = 0.8 }}
            render.width_px = 24
            render.height_px = 24
            render.samples_per_pixel = 8
            {settings}
            "
        )))
    };
    let exact = room("render.bounces_max = 1000");
    assert!(exact.rgb.iter().all(|pixel| *pixel == [1.0; 3]), "{} rays", exact.rays);
    let (mean, error) = mean_and_error(&room("render.bounces_max = 'unlimited'"));
    println!("unlimited: {mean:.6} +- {error:.6}, expected 1");
    assert!((mean - 1.0).abs() < 4.5 * error);
}

//! The second half of a scene: what is refused and how, and that keys with their defaults leave no trace.

use schemas::scene::Scene;
use schemas::scene::render::UNLIMITED;

fn scene(render: &str) -> Result<Scene, String> {
    let text = format!("time = {{ duration_s = 0.0, time_step_s = 0.001 }}\n{render}");
    Scene::parse(&text, &[]).map_err(|error| error.to_string())
}

#[test]
fn what_cannot_be_shown_is_refused_with_what_mends_it() {
    for (render, key, mend) in [
        ("render.samples_per_pixel = 0", "render.samples_per_pixel", "1 or more"),
        ("render.look.a.roughness = 0.3", "render.look.a.roughness", "\"conductor\" or \"plastic\""),
        ("render.look.a = { bsdf = 'mirror', metal = 'gold' }", "render.look.a.metal", "\"conductor\""),
        ("render.look.a = { bsdf = 'conductor', roughness = 1.5 }", "render.look.a.roughness", "from 0"),
        ("render.look.a = { bsdf = 'conductor', eta = [1, 1, 1] }", "render.look.a.eta", "k beside it"),
        (
            "render.look.a = { bsdf = 'conductor', metal = 'gold', eta = [1, 1, 1], k = [1, 1, 1] }",
            "render.look.a.eta",
            "not both",
        ),
        (
            "render.look.a = { bsdf = 'plastic', refractive_index = 1.0 }",
            "render.look.a.refractive_index",
            "more than 1",
        ),
        ("render.look.a.bsdf = 'emitter'", "render.look.a.radiance", "emits"),
        ("render.look.a = { bsdf = 'conducter' }", "conducter", "did you mean \"conductor\"?"),
        (
            "render.light = [{ shape = 'sphere', position_m = [0, 0, 1], radius_m = 0.0, radiance = [1, 1, 1] }]",
            "render.light[0].radius_m",
            "a light of no size is shape = \"point\"",
        ),
        (
            "render.light = [{ shape = 'sun', direction = [0, 0, 0], irradiance = [1, 1, 1] }]",
            "render.light[0].direction",
            "not zero",
        ),
        (
            "render.light = [{ shape = 'sun', direction = [0, 0, 1], angular_radius_rad = 0.0, irradiance = [1, 1, 1] }]",
            "render.light[0].angular_radius_rad",
            "the sun's is 0.00465",
        ),
        ("render.crop_px = [630, 0, 20, 20]", "render.crop_px", "640 x 360"),
        ("render.crop_px = [0, 0, 0, 1]", "render.crop_px", "part of"),
        ("render.filter.radius_px = 0.0", "render.filter.radius_px", "16 pixels"),
        ("render.noise_max = 1.0", "render.noise_max", "less than 1"),
        ("render.indirect_max = -1.0", "render.indirect_max", "positive"),
        ("render.bounces_max = 'many'", "many", "unlimited"),
        ("render.bounces_max = -1", "-1", "number of bounces"),
        ("render.environment = { file = '' }", "render.environment.file", ".exr"),
    ] {
        let error = scene(render).map(drop).expect_err(render);
        assert!(error.contains(key) && error.contains(mend), "{render}: {error}");
    }
}

/// A scene of before a key existed has the same record as before.
#[test]
fn defaults_leave_no_trace_in_the_record() {
    let plain = scene("").expect("a scene");
    let text = serde_json::to_string(&plain.render).expect("JSON");
    let keys = "width_px height_px samples_per_pixel bounces_max exposure camera sky light look";
    let value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let mut found: Vec<_> = value.as_object().expect("a table").keys().map(String::as_str).collect();
    let mut expected: Vec<_> = keys.split(' ').collect();
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(found, expected);
}

#[test]
fn everything_that_can_be_said_is_read_back() {
    let all = scene(
        "
        render.bounces_max = 'unlimited'
        render.roulette_after = 1
        render.crop_px = [1, 2, 3, 4]
        render.sampler = 'independent'
        render.filter = { shape = 'tent', radius_px = 1.0 }
        render.noise_max = 0.1
        render.indirect_max = 2.0
        render.direct_light = 'lights'
        render.tone_mapping = 'agx'
        render.colouring = { by = 'speed', max = 2.0 }
        render.environment = { file = 'a.hdr', scale = 2.0 }
        render.camera = { lens_radius_m = 0.1, focus_distance_m = 3.0, shutter_s = 0.01, path = [{ time_s = 0.0, position_m = [0, 0, 5], look_at_m = [0, 0, 0] }] }
        render.light = [{ shape = 'sun', direction = [0, 0, 1], irradiance = [1, 1, 1] }]
        render.look.a = { bsdf = 'conductor', metal = 'aluminium', roughness = 0.1 }
        render.look.b = { bsdf = 'emitter', radiance = [1, 2, 3] }
        ",
    )
    .expect("a scene");
    assert_eq!(all.render.bounces_max, UNLIMITED);
    let text = serde_json::to_string(&all).expect("JSON");
    assert_eq!(serde_json::from_str::<Scene>(&text).expect("a scene"), all);
    // Overrides go through TOML.
    let again = all.with_render(&["render.exposure=2".to_owned()]).expect("a scene");
    assert_eq!(again.render.exposure, 2.0);
    assert_eq!(Scene { render: all.render.clone(), ..again }, all);
}

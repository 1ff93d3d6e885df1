//! Scene files: what is read, what is refused, and how the refusal reads.

use schemas::scene::{BroadPhase, OnRisk, Scene, SceneError};

const SMALL: &str = r#"
[time]
duration_s = 1.0
time_step_s = 0.001

[material.steel]

[[weave]]
pattern = "european-4-in-1"
rows = 3
columns = 2
major_radius_m = 0.4
minor_radius_m = 0.06
ring_mass_kg = 0.01
material = "steel"
pins = [[0, 0], [0, 1]]

[[ring]]
major_radius_m = 0.4
minor_radius_m = 0.06
mass_kg = 0.01
material = "steel"
position_m = [9.0, -0.0, 0.0]
"#;

fn error(text: &str, overrides: &[&str]) -> String {
    let overrides: Vec<_> = overrides.iter().map(|&text| text.to_owned()).collect();
    Scene::parse(text, &overrides).expect_err("the scene should be refused").to_string()
}

fn parse(overrides: &[&str]) -> Scene {
    let overrides: Vec<_> = overrides.iter().map(|&text| text.to_owned()).collect();
    Scene::parse(SMALL, &overrides).expect("the small scene is right")
}

#[test]
fn weaves_are_laid_out_before_explicit_rings() {
    let scene = parse(&[]);
    assert_eq!(scene.rings.len(), 7);
    assert!(scene.weaves.is_empty());
    let pinned: Vec<_> = scene.rings.iter().map(|ring| ring.pinned).collect();
    assert_eq!(pinned, [true, true, false, false, false, false, false]);
    assert_eq!(scene.rings[6].position_m[0], 9.0);
    assert!(scene.rings[6].position_m[1].is_sign_positive(), "-0.0 is canonicalised");
}

#[test]
fn materials_are_resolved_to_constants() {
    let steel = |overrides: &[&str]| parse(overrides).materials["steel"].clone();
    assert_eq!(steel(&[]).line_stiffness_n_per_m2, Some(1e4));
    let hertz = steel(&["material.steel.contact_modulus_pa=1.1e11"]);
    assert_eq!((hertz.line_stiffness_n_per_m2, hertz.line_stiffness()), (None, 5.5e10));
    let bouncy = steel(&["material.steel.restitution=0.5", "material.steel.restitution_speed_m_per_s=3.0"]);
    let at_one = steel(&["material.steel.restitution=0.5"]);
    assert_eq!((bouncy.restitution, bouncy.restitution_speed_m_per_s), (None, None));
    assert!((at_one.damping_s_per_m / bouncy.damping_s_per_m - 3.0).abs() < 1e-15);
    // z v of e = 0.5: the root of a - ln(1 + a) = -a/2 - ln(1 - a/2).
    assert!((at_one.damping_s_per_m - 1.43275).abs() < 1e-5, "{}", at_one.damping_s_per_m);
    // Two rings of 0.01 kg: k l = 1e4 l, effective mass 0.005 kg, with the arc of the crossing.
    let arc = 2.0 * f64::sqrt(2.0 * 0.05 * 0.12 / (1.0 / 0.12 - 1.0 / 0.4));
    let damped = steel(&["material.steel.damping_ratio=0.5"]);
    let expected = f64::sqrt(1e4 * arc * 0.005) / arc;
    assert!((damped.line_damping_n_s_per_m2 / expected - 1.0).abs() < 1e-14);
    assert_eq!(damped.damping_ratio, None);
    // Resolving again changes nothing: no key is left that stands against another.
    let scene = parse(&["material.steel.restitution=0.5"]);
    assert_eq!(scene.with_render(&[]).expect("it was right before").materials, scene.materials);

    let both = "not both";
    for (overrides, parts) in [
        (&["contact_modulus_pa=1e9", "line_stiffness_n_per_m2=1e4"][..], &["contact_modulus_pa", both][..]),
        (&["contact_modulus_pa=0.0"], &["contact_modulus_pa", "positive"]),
        (&["contact_modulus_pa=nan"], &["contact_modulus_pa", "positive"]),
        (&["line_stiffness_n_per_m2=-1.0"], &["line_stiffness_n_per_m2", "positive"]),
        (&["restitution=0.5", "damping_s_per_m=0.1"], &["restitution", "damping_s_per_m", both]),
        (&["restitution=0.5", "damping_ratio=0.1"], &["restitution", "damping_ratio", both]),
        (&["damping_ratio=0.5", "line_damping_n_s_per_m2=0.1"], &["damping_ratio", "line_damping", both]),
        (&["damping_ratio=0.5", "contact_modulus_pa=1e9"], &["damping_ratio", "take restitution"]),
        (&["damping_ratio=-0.5"], &["damping_ratio", "0 or a positive"]),
        (&["damping_ratio=inf"], &["damping_ratio", "0 or a positive"]),
        (&["restitution=0.0"], &["restitution = 0.0", "more than 0.001"]),
        (&["restitution=1.5"], &["restitution = 1.5", "at most 1"]),
        (&["restitution=nan"], &["restitution", "at most 1"]),
        (&["restitution_speed_m_per_s=1.0"], &["restitution_speed_m_per_s", "without restitution"]),
        (&["restitution=0.5", "restitution_speed_m_per_s=0.0"], &["restitution_speed_m_per_s", "positive"]),
    ] {
        let overrides: Vec<_> = overrides.iter().map(|text| format!("material.steel.{text}")).collect();
        let message = error(SMALL, &overrides.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(parts.iter().all(|part| message.contains(part)), "{overrides:?} says {message:?}");
    }
}

#[test]
fn drag_is_checked_wherever_it_stands() {
    for (over, part) in [
        ("forces.quadratic_drag_kg_per_m=-1.0", "forces.quadratic_drag_kg_per_m"),
        ("forces.quadratic_drag_kg_per_m=nan", "forces.quadratic_drag_kg_per_m"),
        ("ring.0.drag={ linear_kg_per_s = inf }", "ring[0].drag.linear_kg_per_s"),
        ("ring.0.drag={ quadratic_kg_per_m = -1.0 }", "ring[0].drag.quadratic_kg_per_m"),
        ("weave.0.drag={ angular_kg_m2_per_s = nan }", "weave[0].drag.angular_kg_m2_per_s"),
    ] {
        let message = error(SMALL, &[over]);
        assert!(message.contains(part) && message.contains("0 or a positive"), "{over} says {message:?}");
    }
    let scene = parse(&["weave.0.drag={ linear_kg_per_s = 2.0 }"]);
    assert_eq!(scene.rings[0].drag.map(|drag| drag.linear_kg_per_s), Some(2.0));
    assert_eq!(scene.rings[6].drag, None);
}

#[test]
fn motions_are_named_by_rings_and_grips() {
    let motion = [
        "motion.pull.keyframe=[{ time_s = 1.0, translation_m = [0.0, 1.0, -0.0] }]",
        "motion.pull.axis=[0.0, 0.0, 1.0000001]",
        "weave.0.grip=[{ motion = \"pull\", rows = [2] }]",
        "ring.0.motion=\"pull\"",
    ];
    let scene = parse(&motion);
    let motions: Vec<_> = scene.rings.iter().map(|ring| ring.motion.is_some()).collect();
    assert_eq!(motions, [false, false, false, false, true, true, true]);
    assert_eq!(scene.motions["pull"].axis, [0.0, 0.0, 1.0]);
    assert!(scene.motions["pull"].keyframes[0].translation_m[2].is_sign_positive());
    let refused = |more: &str, parts: &[&str]| {
        let mut overrides = motion.to_vec();
        overrides.push(more);
        let message = error(SMALL, &overrides);
        assert!(
            parts.iter().all(|part| message.contains(part)),
            "{more} says {message:?}, without {parts:?}"
        );
    };
    refused("ring.0.motion=\"pul\"", &["ring[0].motion", "no such motion", "did you mean \"pull\"?"]);
    refused("ring.0.pinned=true", &["ring[0].motion", "pinned"]);
    refused("weave.0.pins=[[2, 1]]", &["weave[0].grip", "ring [2, 1] held more than once"]);
    refused("weave.0.grip.0.rows=[3]", &["weave[0].grip[0].rows = 3", "below 3"]);
    refused("weave.0.grip.0.columns=[2]", &["weave[0].grip[0].columns = 2", "below 2"]);
    refused("weave.0.grip.0.rings=[[0, 2]]", &["weave[0].grip[0].rings", "below [3, 2]"]);
    refused("weave.0.grip.0.motion=\"x\"", &["weave[0].grip[0].motion", "no such motion"]);
    refused("motion.pull.axis=[0.0, 0.0, 0.0]", &["motion.pull.axis", "length 1"]);
    refused("motion.pull.pivot_m=[nan, 0.0, 0.0]", &["motion.pull.pivot_m", "finite"]);
    for time in ["0.0", "-1.0", "nan", "inf"] {
        let more = format!("motion.pull.keyframe.0.time_s={time}");
        refused(&more, &["motion.pull.keyframe[0].time_s", "positive"]);
    }
    refused(
        "motion.pull.keyframe=[{ time_s = 1.0 }, { time_s = 1.0 }]",
        &["motion.pull.keyframe[1].time_s = 1.0", "more than 1.0"],
    );
    refused("motion.pull.keyframe.0.angle_rad=inf", &["keyframe[0].angle_rad", "finite"]);
    refused("motion.pull.keyframe.0.translation_m=[0.0, inf, 0.0]", &["translation_m", "finite"]);
    refused("motion.pull.shake={ frequency_hz = 0.0 }", &["motion.pull.shake.frequency_hz", "positive"]);
    refused("motion.pull.shake={ frequency_hz = 1.0, ramp_s = -1.0 }", &["shake.ramp_s", "0 or a positive"]);
    refused("motion.pull.shake={ frequency_hz = 1.0, start_s = nan }", &["shake.start_s"]);
    refused("motion.pull.shake={ frequency_hz = 1.0, angle_rad = nan }", &["shake.angle_rad"]);
}

#[test]
fn rings_are_left_out_by_seed() {
    let count = |overrides: &[&str]| parse(overrides).rings.len();
    assert_eq!(count(&["weave.0.rows=30", "weave.0.columns=10", "weave.0.remove_share=0.1"]), 271);
    let left = |seed: u64| {
        let overrides = ["weave.0.rows=30".to_owned(), "weave.0.remove_share=0.25".to_owned()];
        let scene = Scene::parse_seeded(SMALL, &overrides, Some(seed)).expect("the small scene is right");
        assert_eq!(scene.seed, seed);
        // The two pins are never taken.
        assert!(scene.rings[0].pinned && scene.rings[1].pinned);
        scene.rings
    };
    assert_eq!(left(1), left(1));
    assert_ne!(left(1), left(2));
    assert_eq!(left(1).len(), 46);
}

#[test]
fn whole_rows_are_pinned() {
    let scene = parse(&["weave.0.pin_rows=[2]"]);
    let pinned: Vec<_> = scene.rings.iter().map(|ring| ring.pinned).collect();
    assert_eq!(pinned, [true, true, false, false, true, true, false]);
}

#[test]
fn resolved_scene_survives_json_bit_for_bit() {
    let scene = parse(&["weave.0.rotation_rad=[0.1, 0.2, 0.3]", "time.time_step_s=0.00041666666666666664"]);
    let text = serde_json::to_string(&scene).expect("a scene is JSON");
    let back: Scene = serde_json::from_str(&text).expect("its own JSON");
    assert_eq!(back, scene);
    assert_eq!(serde_json::to_string(&back).expect("JSON"), text);
    for (a, b) in scene.rings.iter().zip(&back.rings) {
        assert_eq!(a.orientation.map(f64::to_bits), b.orientation.map(f64::to_bits));
    }
}

#[test]
fn overrides_reach_tables_and_lists() {
    let scene = parse(&[
        "time.duration_s=2",
        "ring.0.pinned=true",
        "material.steel.friction_coefficient=0.25",
        "seed=7",
    ]);
    assert_eq!(scene.time.duration_s, 2.0);
    assert!(scene.rings[6].pinned);
    assert_eq!(scene.materials["steel"].friction_coefficient, 0.25);
    assert_eq!(scene.seed, 7);
    let changed = scene.with_render(&["render.samples_per_pixel=3".to_owned()]).expect("a key of render");
    assert_eq!(changed.render.samples_per_pixel, 3);
    assert_eq!(changed.rings, scene.rings);
    let refused = scene.with_render(&["time.duration_s=3".to_owned()]).expect_err("a key outside render");
    assert!(refused.to_string().starts_with("time.duration_s = 3: expected a key of render.*"), "{refused}");
}

#[test]
fn refusals_name_key_value_and_expectation() {
    for (overrides, parts) in [
        (&["time.time_step_s=-0.001"][..], &["time.time_step_s", "-0.001", "positive"][..]),
        (&["time.time_step_s=nan"], &["time.time_step_s", "NaN", "positive"]),
        (&["time.time_step_s=5e-324"], &["time.time_step_s", "positive"]),
        (
            &["time.time_step_s=1e-320"],
            &["time.time_step_s = 1e-320:", "a positive number from 2.3e-308 to 1e24"],
        ),
        (&["ring.0.mass_kg=1e300"], &["ring[0].mass_kg = 1e300:", "a positive number from 2.3e-308 to 1e24"]),
        (
            &["time.frames_per_second=1001"],
            &["time.frames_per_second = 1001.0:", "at most one frame a step: 1000.0"],
        ),
        (&["seed=18446744073709551615"], &["9223372036854775807", "--seed takes more"]),
        (&["weave.0.rows=-9223372036854775809"], &["weave.0.rows", "9223372036854775807"]),
        (&["time.duration_s=inf"], &["time.duration_s", "inf"]),
        (&["ring.0.minor_radius_m=0.4"], &["ring[0].minor_radius_m", "0.4", "less than major_radius_m"]),
        (&["method.tolerance=0"], &["method.tolerance = 0.0:", "1e-13 to 0.1"]),
        (&["method.tolerance=nan"], &["method.tolerance = NaN:", "1e-13 to 0.1"]),
        (&["method.tolerance=inf"], &["method.tolerance = inf:", "1e-13 to 0.1"]),
        (&["method.tolerance=-1e-3"], &["method.tolerance = -0.001:", "1e-13 to 0.1"]),
        (&["method.absolute_tolerance=0"], &["method.absolute_tolerance = 0.0:", "positive"]),
        (&["method.absolute_tolerance=nan"], &["method.absolute_tolerance = NaN:", "positive"]),
        (&["ring.0.mass_kg=0"], &["ring[0].mass_kg", "positive"]),
        (&["ring.0.orientation=[0.0,0.0,0.0,0.0]"], &["ring[0].orientation", "length 1"]),
        (&["ring.0.position_m=[1e13,0.0,0.0]"], &["ring[0].position_m", "1e12"]),
        (&["ring.0.material=\"stel\""], &["ring[0].material", "stel", "did you mean \"steel\"?"]),
        (&["weave.0.pins=[[3,0]]"], &["weave[0].pins", "[3, 0]", "below [3, 2]"]),
        (&["weave.0.pin_rows=[3]"], &["weave[0].pin_rows = 3", "below 3"]),
        (&["weave.0.remove_share=1.0"], &["weave[0].remove_share = 1.0", "less than 1"]),
        (&["weave.0.remove_share=-0.1"], &["weave[0].remove_share", "0 or more"]),
        (&["weave.0.remove_share=nan"], &["weave[0].remove_share", "0 or more"]),
        (
            &["weave.0.minor_radius_m=0.1"],
            &["weave[0].minor_radius_m = 0.1:", "less than 0.1", "0.25 major radii"],
        ),
        (
            &["weave.0.pattern=european-6-in-1", "weave.0.minor_radius_m=0.08"],
            &["weave[0].minor_radius_m", "0.185 major radii", "european-6-in-1"],
        ),
        (&["weave.0.pattern=chain", "weave.0.minor_radius_m=0.126"], &["less than 0.125", "0.3125"]),
        (
            &["weave.0.pattern=japanese-12-in-2", "weave.0.minor_radius_m=0.07"],
            &[
                "weave[0].minor_radius_m = 0.07",
                "at most 0.0639",
                "0.1598 major radii",
                "connector_minor_radius_m",
            ],
        ),
        (
            &["weave.0.pattern=japanese-12-in-2", "weave.0.connector_minor_radius_m=0.1"],
            &["weave[0].connector_minor_radius_m = 0.1", "at most 0.064"],
        ),
        (
            &["weave.0.pattern=japanese-8-in-2", "weave.0.connector_major_radius_m=0.1"],
            &["weave[0].connector_major_radius_m = 0.1", "from 0.1938", " to 0.3151"],
        ),
        (
            &["weave.0.pattern=japanese-8-in-2", "weave.0.connector_mass_kg=nan"],
            &["weave[0].connector_mass_kg", "positive"],
        ),
        (&["weave.0.connector_mass_kg=1.0"], &["weave[0].connector_mass_kg", "has no connectors"]),
        (&["weave.0.rows=4294967295", "weave.0.columns=4294967295"], &["weave[0].rows", "at most"]),
        (
            &["material.steel.friction_coefficient=-1"],
            &["material.steel.friction_coefficient", "0 or a positive"],
        ),
        (&["render.samples_per_pixel=0"], &["render.samples_per_pixel", "1 or more"]),
        (&["render.camera.up=[0.0,0.0,1.0]"], &["render.camera.up", "along the view"]),
        (&["time.durations=1"], &["unknown field `durations`", "did you mean \"duration_s\"?"]),
        (&["time.duration=1"], &["did you mean \"duration_s\"?"]),
        (&["time.duration_s"], &["key.path=value"]),
        (&["ring.5.mass_kg=1"], &["there is no '5'"]),
        (&["record.state_every=0"], &["record.state_every", "1 or more"]),
        (&["method.surface.samples=0"], &["method.surface.samples = 0:", "from 1 to 16777216"]),
        (&["method.surface.samples=16777217"], &["method.surface.samples = 16777217:", "from 1 to 16777216"]),
        (&["method.surface.sampler=\"sobel\""], &["sobel", "did you mean \"sobol\"?"]),
        (&["method.contact_law=\"surface\""], &["unknown variant `surface`"]),
        (
            &["material.steel.surface_stiffness_n_per_m3=0"],
            &["material.steel.surface_stiffness_n_per_m3 = 0.0:", "a positive number"],
        ),
        (
            &["material.steel.surface_damping_n_s_per_m3=-1"],
            &["material.steel.surface_damping_n_s_per_m3 = -1.0:", "0 or a positive"],
        ),
    ] {
        let message = error(SMALL, overrides);
        for part in parts {
            assert!(message.contains(part), "{overrides:?} says {message:?}, without {part:?}");
        }
    }
}

#[test]
fn every_number_refuses_nan_and_infinity() {
    let scene = parse(&[]);
    let value = toml::Value::try_from(&scene).expect("a scene is TOML");
    let mut paths = Vec::new();
    numbers(&value, String::new(), &mut paths);
    assert!(paths.len() > 80, "{} numbers were found", paths.len());
    let text = toml::to_string(&scene).expect("a scene is TOML");
    // Not written where they have their defaults.
    for field in ["surface_stiffness_n_per_m3", "surface_damping_n_s_per_m3"] {
        paths.push(format!("material.steel.{field}"));
    }
    for path in &paths {
        for bad in ["nan", "inf", "-inf"] {
            let overrides = [format!("{path}={bad}")];
            assert!(Scene::parse(&text, &overrides).is_err(), "{path} takes {bad}");
        }
    }
}

fn numbers(value: &toml::Value, path: String, paths: &mut Vec<String>) {
    match value {
        toml::Value::Float(_) => paths.push(path),
        toml::Value::Array(items) => {
            items
                .iter()
                .enumerate()
                .for_each(|(index, item)| numbers(item, format!("{path}.{index}"), paths));
        }
        toml::Value::Table(table) => {
            for (key, item) in table {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                numbers(item, path, paths);
            }
        }
        _ => {}
    }
}

/// A scene without the law `surface-integral` is written as it was before there was one.
#[test]
fn the_surface_law_is_written_only_where_it_is_chosen() {
    let plain = serde_json::to_string(&parse(&[])).expect("a scene is JSON");
    assert!(!plain.contains("surface"), "{plain}");
    let chosen = parse(&[
        "method.contact_law=\"surface-integral\"",
        "method.surface.sampler=\"uniform-angles\"",
        "method.surface.average=\"all-samples\"",
        "material.steel.surface_stiffness_n_per_m3=1e7",
    ]);
    assert_eq!(chosen.method.surface.samples, 1000);
    let text = serde_json::to_string(&chosen).expect("a scene is JSON");
    for part in
        ["\"surface-integral\"", "\"uniform-angles\"", "\"all-samples\"", "surface_stiffness_n_per_m3"]
    {
        assert!(text.contains(part), "{part} is missing in {text}");
    }
    assert_eq!(serde_json::from_str::<Scene>(&text).expect("its own JSON"), chosen);
}

#[test]
fn syntax_errors_have_a_place() {
    let message = error("[time]\nduration_s = 1.0\ntime_step_s = 0.001\nframe_per_second = 24.0\n", &[]);
    assert!(message.contains("line 4, column 1"), "{message}");
    let line = message.lines().find(|line| line.contains("did you mean \"frames_per_second\"?"));
    assert!(line.is_some_and(|line| line.starts_with("unknown field `frame_per_second`")), "{message}");
    assert!(matches!(Scene::parse("[time", &[]), Err(SceneError::Syntax(_))));
    assert!(error("", &[]).contains("missing field `time`"));
}

#[test]
fn frames_lie_on_their_steps() {
    let scene = parse(&["time.duration_s=2", "time.time_step_s=0.0005", "time.frames_per_second=24"]);
    assert_eq!((scene.time.step_count(), scene.time.frame_count()), (4000, 48));
    let frames: Vec<_> = (0..=4000).filter_map(|step| scene.time.frame_at(step)).collect();
    assert_eq!(frames, (0..48).collect::<Vec<_>>());
    assert_eq!(scene.time.frame_step(1), 83);
    assert!(scene.state_is_recorded(83) && scene.state_is_recorded(4000));
    let each = parse(&["time.time_step_s=0.001", "time.frames_per_second=1000"]);
    assert!((0..1000).all(|step| each.time.frame_at(step) == Some(step)), "a frame a step is not too many");
    let still = parse(&["time.duration_s=0"]);
    assert_eq!((still.time.step_count(), still.time.frame_count()), (0, 1));
}

#[test]
fn broad_phase_is_a_choice_that_is_written_only_when_made() {
    let plain = parse(&[]);
    assert_eq!(plain.method.broad_phase, BroadPhase::Auto);
    assert!(!serde_json::to_string(&plain).expect("JSON").contains("broad_phase"));
    let chosen = parse(&["method.broad_phase=range-tree"]);
    assert_eq!(chosen.method.broad_phase, BroadPhase::RangeTree);
    let text = serde_json::to_string(&chosen).expect("JSON");
    assert_eq!(serde_json::from_str::<Scene>(&text).expect("its own JSON"), chosen);
    let refused = error(SMALL, &["method.broad_phase=range-trie"]);
    assert!(refused.contains("range-trie") && refused.contains("range-tree"), "{refused}");
}

#[test]
fn an_automatic_step_is_a_word_in_the_file_and_a_number_in_the_log() {
    let scene = parse(&["time.time_step_s=auto", "time.frames_per_second=50"]);
    assert!(scene.time.automatic);
    assert_eq!(scene.time.time_step_s, 0.02, "a frame's interval until it is resolved");
    let text = serde_json::to_string(&scene).expect("JSON");
    let back: Scene = serde_json::from_str(&text).expect("its own JSON");
    assert!(!back.time.automatic && back.time.time_step_s == 0.02);
    assert_eq!(parse(&["time.time_step_s=1", "time.frames_per_second=1"]).time.time_step_s, 1.0);
    let refused = error(SMALL, &["time.time_step_s=automatic"]);
    assert!(
        refused.contains("automatic") && refused.contains("a number of seconds, or \"auto\""),
        "{refused}"
    );
    let refused = error(SMALL, &["time.time_step_s=auto", "time.frames_per_second=nan"]);
    assert!(refused.starts_with("time.frames_per_second = NaN"), "{refused}");
}

#[test]
fn the_penetration_of_the_stability_bound_is_a_share_that_is_written_only_when_chosen() {
    let plain = parse(&[]);
    assert_eq!(plain.method.stability_penetration, 0.05);
    assert!(!serde_json::to_string(&plain).expect("JSON").contains("stability_penetration"));
    let chosen = parse(&["method.stability_penetration=0.02"]);
    let text = serde_json::to_string(&chosen).expect("JSON");
    assert!(text.contains("\"stability_penetration\":0.02"), "{text}");
    assert_eq!(serde_json::from_str::<Scene>(&text).expect("its own JSON"), chosen);
    for bad in ["0.0", "-0.01", "1.01", "nan", "inf"] {
        let refused = error(SMALL, &[&format!("method.stability_penetration={bad}")]);
        assert!(
            refused.starts_with("method.stability_penetration = ") && refused.contains("0.05"),
            "{refused}"
        );
    }
}

#[test]
fn what_is_done_on_risk_and_the_error_estimate_are_written_only_when_chosen() {
    let plain = serde_json::to_string(&parse(&[])).expect("JSON");
    assert!(!plain.contains("on_risk") && !plain.contains("error_estimate") && !plain.contains("tolerance"));
    let chosen = parse(&["method.on_risk=subdivide", "record.error_estimate=true", "method.tolerance=1e-4"]);
    assert_eq!(chosen.method.on_risk, OnRisk::Subdivide);
    let text = serde_json::to_string(&chosen).expect("JSON");
    assert_eq!(serde_json::from_str::<Scene>(&text).expect("its own JSON"), chosen);
    assert!(error(SMALL, &["method.on_risk=go"]).contains("subdivide"));
}

//! Scene keys of capsules, boxes and polynomial bodies: what is read, what is refused.

use schemas::scene::{Scene, SceneError};

const SMALL: &str = r#"
[time]
duration_s = 1.0
time_step_s = 0.001

[material.steel]
"#;

fn error(text: &str, overrides: &[&str]) -> String {
    let overrides: Vec<_> = overrides.iter().map(|&text| text.to_owned()).collect();
    let refused: SceneError = Scene::parse(text, &overrides).expect_err("the scene should be refused");
    refused.to_string()
}

#[test]
fn capsules_and_boxes_are_checked() {
    let text = format!(
        "{SMALL}\n[[capsule]]\nradius_m = 0.1\nhalf_length_m = 0.2\nmass_kg = 1.0\nmaterial = \"steel\"\n\
         position_m = [0.0, 5.0, -0.0]\norientation = [0.0, 0.0, 0.0, 1.0000001]\n\
         [[box]]\nhalf_extents_m = [0.1, 0.2, 0.3]\nedge_radius_m = 0.05\nmass_kg = 1.0\n\
         material = \"steel\"\nposition_m = [0.0, 0.0, 8.0]\npinned = true\n\
         linear_velocity_m_per_s = [1.0, 0.0, 0.0]\n"
    );
    let scene = Scene::parse(&text, &[]).expect("the scene is right");
    assert_eq!(scene.body_count(), 2);
    assert_eq!(scene.body_name(0), "capsule 0");
    assert_eq!(scene.body_name(1), "box 0");
    assert_eq!(scene.capsules[0].orientation, [0.0, 0.0, 0.0, 1.0]);
    let states = scene.initial_bodies();
    assert!(states[0].position_m[2].is_sign_positive(), "-0.0 is canonicalised");
    assert_eq!(states[1].linear_velocity_m_per_s, [0.0; 3], "a pinned box is at rest");
    let json = serde_json::to_string(&scene).expect("a scene is JSON");
    assert_eq!(serde_json::from_str::<Scene>(&json).expect("its own JSON"), scene);
    for (key, values, message) in [
        ("capsule.0.radius_m", ["nan", "inf", "0.0", "-1.0"], "a positive number"),
        ("capsule.0.half_length_m", ["nan", "-inf", "0.0", "-1.0"], "a positive number"),
        ("capsule.0.mass_kg", ["nan", "inf", "0.0", "-1.0"], "a positive number"),
        ("box.0.mass_kg", ["nan", "inf", "0.0", "-1.0"], "a positive number"),
        ("box.0.edge_radius_m", ["nan", "inf", "-inf", "-1.0"], "0 or a positive number"),
    ] {
        for value in values {
            let refused = error(&text, &[&format!("{key}={value}")]);
            let shown = key.replacen(".0.", "[0].", 1);
            assert!(refused.starts_with(&shown) && refused.contains(message), "{refused}");
        }
    }
    let refused = error(&text, &["box.0.edge_radius_m=0.1"]);
    assert_eq!(
        refused,
        "box[0].edge_radius_m = 0.1: expected less than each of half_extents_m = [0.1, 0.2, 0.3]"
    );
    assert!(
        error(&text, &["box.0.half_extents_m=[0.1, nan, 1.0]"]).starts_with("box[0].half_extents_m = NaN")
    );
    assert!(error(&text, &["box.0.material=\"stele\""]).contains("did you mean \"steel\"?"));
    assert!(error(&text, &["capsule.0.orientation=[0.0, 0.0, 0.0, 2.0]"]).contains("length 1"));
}

#[test]
fn polynomials_are_checked() {
    let text = format!(
        "{SMALL}\n[[polynomial]]\nformula = \"x^2 + y^2 + z^2 - 1\"\nbounding_radius_m = 1.1\nmass_kg = 1.0\n\
         material = \"steel\"\nposition_m = [0.0, 5.0, -0.0]\n"
    );
    let scene = Scene::parse(&text, &[]).expect("the scene is right");
    assert_eq!((scene.body_count(), scene.polynomials[0].scale_m), (1, 1.0));
    assert_eq!(scene.body_name(0), "polynomial 0");
    let json = serde_json::to_string(&scene).expect("a scene is JSON");
    assert!(
        !json.contains("density_kg_per_m3") && !json.contains("capsule"),
        "what is not there is not written"
    );
    assert_eq!(serde_json::from_str::<Scene>(&json).expect("its own JSON"), scene);
    for key in ["scale_m", "bounding_radius_m", "mass_kg"] {
        for value in ["nan", "inf", "-inf", "0.0", "-1.0"] {
            let refused = error(&text, &[&format!("polynomial.0.{key}={value}")]);
            let expected = format!("polynomial[0].{key} = ");
            assert!(refused.starts_with(&expected) && refused.contains("a positive number"), "{refused}");
        }
    }
    let refused = error(&text, &["polynomial.0.density_kg_per_m3=2.0"]);
    assert!(
        refused.contains("given beside density_kg_per_m3: expected either mass_kg or density"),
        "{refused}"
    );
    let light = text.replace("mass_kg = 1.0\n", "");
    assert!(error(&light, &[]).contains("mass_kg = not given: expected either mass_kg or density_kg_per_m3"));
    let dense = ["polynomial.0.density_kg_per_m3=2.0".to_owned()];
    assert_eq!(Scene::parse(&light, &dense).expect("a density will do").polynomials[0].mass_kg, None);
    assert!(error(&light, &["polynomial.0.density_kg_per_m3=0.0"]).contains("a positive number"));
}

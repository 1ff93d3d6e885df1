//! Any text as a scene, with its first line as an override: refused with a reason, or a scene that is one again when it
//! is written and read.

#![no_main]

use libfuzzer_sys::fuzz_target;
use schemas::scene::Scene;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let overrides: Vec<String> = match text.strip_prefix("# --set ").and_then(|rest| rest.lines().next()) {
        Some(line) => vec![line.to_owned()],
        None => Vec::new(),
    };
    match Scene::parse(text, &overrides) {
        Ok(scene) => {
            // Rings cost memory: a text of so many bytes must not ask for more than a weave of a million.
            assert!(scene.body_count() <= 1 << 24, "{} bodies", scene.body_count());
            let json = serde_json::to_string(&scene).expect("a scene has a JSON form");
            let again: Scene = serde_json::from_str(&json).expect("its own form");
            assert_eq!(serde_json::to_string(&again).expect("a scene has a JSON form"), json);
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});

//! State hashes of short scenes every 100 steps or so, of every integrator and kind of body, kept as text: the same in
//! debug and release builds, and on every machine.
//!
//! When the physics is meant to change, `UPDATE_GOLDEN=1 cargo test -p sim-node golden` makes the file anew;
//! the commit says why.

use crate::support::Run;
use schemas::state;
use std::fmt::Write;
use std::path::Path;

#[test]
fn golden() {
    let mut text = String::new();
    for (name, scene) in [
        ("two-rings", include_str!("../../../scenes/two-rings.toml")),
        ("ball", include_str!("../../../scenes/ball.toml")),
    ] {
        for integrator in ["verlet", "rk4"] {
            let mut overrides =
                vec![format!("method.integrator={integrator}"), "time.time_step_s=5e-5".to_owned()];
            if name == "ball" {
                // Near enough to reach the mail within the 1000 steps.
                overrides.push("sphere.0.position_m=[0.0, -0.3, -1.0]".to_owned());
            }
            let mut run = Run::with(scene, &overrides);
            for _ in 0..10 {
                run.steps(100);
                let mut message = Vec::new();
                let hash =
                    state::encode(&run.state.header(), &run.state.bodies, &run.state.contacts, &mut message);
                writeln!(text, "{name} {integrator} {} {hash}", run.state.step).unwrap();
            }
        }
    }
    crate::every_body::golden(&mut text);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden.txt");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap();
    for (line, (kept, made)) in kept.lines().zip(text.lines()).enumerate() {
        assert_eq!(kept, made, "line {} of {}", line + 1, path.display());
    }
    assert_eq!(kept.lines().count(), text.lines().count());
}

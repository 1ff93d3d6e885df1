//! A run that its own audits stop: exit code 1, the step, the rings and the cause named, and a log that is whole up
//! to there.

use crate::command::{Place, TINY, end_of, message_counts};
use schemas::end::Outcome;

/// A linked pair; one of the two rings flies so fast that it is through the other's wire within a step.
const SHOT: &str = r#"
[[ring]]
major_radius_m = 0.4
minor_radius_m = 0.06
mass_kg = 0.1
material = "steel"
position_m = [5.0, 0.0, 0.0]
orientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]
pinned = true

[[ring]]
major_radius_m = 0.4
minor_radius_m = 0.06
mass_kg = 0.1
material = "steel"
position_m = [5.0, 0.5, 0.0]
linear_velocity_m_per_s = [0.0, 1e3, 0.0]
"#;

#[test]
fn a_broken_link_ends_the_run_and_leaves_a_whole_log() {
    let place = Place::new();
    std::fs::write(place.path("shot.toml"), format!("{SHOT}{TINY}")).expect("a file");
    let text = place.expect(1, &["run", "shot.toml", "--out", "run"]);
    // Links are looked at when a frame is taken: the first one after the start is at step 17.
    let said =
        "step 17: ring 2 and ring 3 were linked at the start and are not any more (links left: 1 of 2)";
    assert!(text.contains(said), "{text}");
    let counts = message_counts(&place.path("run/log.mcap"));
    let kept = ["/scene", "/state", "/step", "/frame", "/end"].map(|topic| counts[topic]);
    assert_eq!(kept, [1, 18, 18, 2, 1]);
    let end = end_of(&place.path("run/log.mcap"));
    assert_eq!((end.step_count, end.state_count, end.keyframe_count), (17, 18, 2));
    let Outcome::Stopped(reason) = &end.outcome else { panic!("{end:?}") };
    assert!(reason.contains(said), "{reason}");
    // The log can be looked at, simulated again and rendered again.
    let text = place.expect(0, &["info", "run/log.mcap"]);
    assert!(text.contains("stopped") && text.contains(said), "{text}");
    place.expect(0, &["verify", "run/log.mcap"]);
    // Rendered again it is still the log of a run that was stopped.
    place.expect(1, &["rerender", "run/log.mcap", "--out", "again", "--set", "render.samples_per_pixel=1"]);
    assert_eq!(end_of(&place.path("again/log.mcap")), end);
    assert_eq!(message_counts(&place.path("again/log.mcap"))["/frame"], 2);
}

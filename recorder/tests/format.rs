//! docs/log-format.md says what is written: its bytes are made again, its keys are those of the records.

use prost::Message as _;
use recorder::Kind;
use schemas::end::{End, Outcome};
use schemas::frame::{CompressedImage, FRAME_INFO_JSON_SCHEMA};
use schemas::state::{self, BodyState, ContactState, StateHeader};
use schemas::step::STEP_JSON_SCHEMA;
use schemas::{Hash, chain, wire};

fn page() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/log-format.md");
    std::fs::read_to_string(path).expect("docs/log-format.md")
}

/// The bytes of a block of the page.
fn block(name: &str) -> Vec<u8> {
    let page = page();
    let (_, rest) =
        page.split_once(&format!("```text {name}\n")).unwrap_or_else(|| panic!("no block {name}"));
    let (block, _) = rest.split_once("```").expect("a block ends");
    block.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("two digits")).collect()
}

#[test]
fn the_documented_bytes_are_those_that_are_written() {
    let header = StateHeader { step: 7, sim_time_s: 0.5, dissipated_energy_j: 0.25, ..Default::default() };
    let body = BodyState {
        position_m: [1.0, 2.0, -1.0],
        orientation: [0.0, 0.0, 0.0, 1.0],
        linear_velocity_m_per_s: [0.5, 0.0, 0.0],
        angular_velocity_rad_per_s: [0.0, 0.0, 2.0],
    };
    let contact = ContactState { body_b: 1, mid_cos: 1.0, spring_m: [1e-3, 0.0, 0.0], ..Default::default() };
    let mut message = Vec::new();
    let hash = state::encode(&header, &[body], &[contact], &mut message);
    assert_eq!(message, block("state"));
    assert_eq!(message.len(), 232);
    let chained_hash = chain(&Hash::default(), &hash);
    let end =
        End { outcome: Outcome::Completed, step_count: 7, state_count: 8, keyframe_count: 2, chained_hash };
    assert_eq!(wire::encode(&end), block("end"));
    assert_eq!(CompressedImage::png(1_500_000_000, vec![9]).encode_to_vec(), block("frame"));
}

#[test]
fn every_key_and_channel_is_documented() {
    let page = page();
    for schema in [STEP_JSON_SCHEMA, FRAME_INFO_JSON_SCHEMA] {
        let schema: serde_json::Value = serde_json::from_str(schema).expect("JSON");
        for key in schema["properties"].as_object().expect("properties").keys() {
            assert!(page.contains(&format!("`{key}`")), "docs/log-format.md says nothing of {key}");
        }
    }
    for kind in Kind::ALL {
        let channel = kind.channel();
        let row = format!("| `{}` | ", channel.topic);
        let line = page.lines().find(|line| line.starts_with(&row));
        let line = line.unwrap_or_else(|| panic!("docs/log-format.md has no row for {}", channel.topic));
        assert!(line.contains(channel.message_encoding) && line.contains(channel.schema_name), "{line}");
    }
}

//! Rendered frames: the picture as `foxglove.CompressedImage`, and what it shows.

use crate::Hash;
use crate::plan::Plan;
use crate::scene::render::Render;
use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};
use serde::{Deserialize, Serialize};

/// A compressed picture; the protobuf message `foxglove.CompressedImage`, which MCAP viewers show.
#[derive(Clone, PartialEq, Message)]
pub struct CompressedImage {
    /// Simulated time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<prost_types::Timestamp>,
    /// The picture's bytes.
    #[prost(bytes = "vec", tag = "2")]
    pub data: Vec<u8>,
    /// `png`.
    #[prost(string, tag = "3")]
    pub format: String,
    /// `camera`.
    #[prost(string, tag = "4")]
    pub frame_id: String,
}

impl CompressedImage {
    /// A PNG taken at a log time.
    pub fn png(log_time_ns: u64, data: Vec<u8>) -> CompressedImage {
        let timestamp = prost_types::Timestamp {
            seconds: (log_time_ns / 1_000_000_000) as i64,
            nanos: (log_time_ns % 1_000_000_000) as i32,
        };
        CompressedImage {
            timestamp: Some(timestamp),
            data,
            format: "png".to_owned(),
            frame_id: "camera".to_owned(),
        }
    }
}

/// The `FileDescriptorSet` that describes [`CompressedImage`] to readers of the log.
pub fn compressed_image_descriptor() -> Vec<u8> {
    let field = |name: &str, number: i32, kind: Type, type_name: Option<&str>| FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        label: Some(Label::Optional as i32),
        r#type: Some(kind as i32),
        type_name: type_name.map(str::to_owned),
        ..Default::default()
    };
    let message = |name: &str, field: Vec<FieldDescriptorProto>| DescriptorProto {
        name: Some(name.to_owned()),
        field,
        ..Default::default()
    };
    let file = |name: &str, package: &str, dependency: &[&str], message_type| FileDescriptorProto {
        name: Some(name.to_owned()),
        package: Some(package.to_owned()),
        dependency: dependency.iter().map(|&name| name.to_owned()).collect(),
        message_type: vec![message_type],
        syntax: Some("proto3".to_owned()),
        ..Default::default()
    };
    let timestamp = message(
        "Timestamp",
        vec![field("seconds", 1, Type::Int64, None), field("nanos", 2, Type::Int32, None)],
    );
    let image = message(
        "CompressedImage",
        vec![
            field("timestamp", 1, Type::Message, Some(".google.protobuf.Timestamp")),
            field("data", 2, Type::Bytes, None),
            field("format", 3, Type::String, None),
            field("frame_id", 4, Type::String, None),
        ],
    );
    let timestamp_file = "google/protobuf/timestamp.proto";
    let set = FileDescriptorSet {
        file: vec![
            file(timestamp_file, "google.protobuf", &[], timestamp),
            file("foxglove/CompressedImage.proto", "foxglove", &[timestamp_file], image),
        ],
    };
    set.encode_to_vec()
}

/// What a frame shows and how it was made; JSON in the log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameInfo {
    /// Number of the frame, from 0.
    pub frame: u64,
    /// The step whose state it shows.
    pub step: u64,
    /// Simulated time in seconds.
    pub sim_time_s: f64,
    /// The hash of the state that it shows.
    pub state_hash: Hash,
    /// BLAKE3 of the linear film: width and height as `u32`, then red, green and blue of each pixel as `f64`, all
    /// little-endian, row by row from the top.
    pub film_hash: Hash,
    /// Rays traced: camera, bounce and shadow rays.
    pub rays: u64,
    /// Samples of all pixels together.
    #[serde(default)]
    pub samples: u64,
    /// Samples that came out as NaN or infinite; they are counted and left out of the mean.
    pub non_finite_samples: u64,
    /// Column, row and number of the first of those samples, in the order of rows, columns and samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_non_finite: Option<[u32; 3]>,
    /// BLAKE3 of the file of the environment map, if the picture has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment_hash: Option<Hash>,
    /// The settings of the picture.
    pub render: Render,
    /// What the picture needed of the renderer, and what was left out.
    pub plan: Plan,
}

/// JSON Schema of [`FrameInfo`], written beside its channel.
pub const FRAME_INFO_JSON_SCHEMA: &str = r#"{"title":"chainmail.FrameInfo","type":"object","properties":{"frame":{"type":"integer"},"step":{"type":"integer"},"sim_time_s":{"type":"number"},"state_hash":{"type":"string"},"film_hash":{"type":"string"},"rays":{"type":"integer"},"samples":{"type":"integer"},"non_finite_samples":{"type":"integer"},"first_non_finite":{"type":"array"},"environment_hash":{"type":"string"},"render":{"type":"object"},"plan":{"type":"object"}}}"#;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn image_bytes_are_as_protobuf_says() {
        let image = CompressedImage::png(1_500_000_000, vec![9]);
        let bytes = image.encode_to_vec();
        // tag 1: a Timestamp of 1 s and 500,000,000 ns; tag 2: one byte; tags 3 and 4: strings.
        let expected =
            [&[10, 8, 8, 1, 16, 128, 202, 181, 238, 1, 18, 1, 9, 26, 3][..], b"png", &[34, 6], b"camera"]
                .concat();
        assert_eq!(bytes, expected);
        assert_eq!(CompressedImage::decode(&bytes[..]).unwrap(), image);
    }

    #[test]
    fn descriptor_names_the_message() {
        let set = FileDescriptorSet::decode(&compressed_image_descriptor()[..]).unwrap();
        assert_eq!(set.file[1].package(), "foxglove");
        assert_eq!(set.file[1].message_type[0].name(), "CompressedImage");
    }
}

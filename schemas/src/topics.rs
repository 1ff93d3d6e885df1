//! The one manifest of topics: who publishes, who listens, how long the queue is, and where the message
//! lies in the log. A message has the same bytes on the bus and in the log.
//!
//! A topic that is not in [`TOPICS`] cannot be published, and one that is in it says how it is recorded.

use crate::{frame, scene, state, step};
use std::collections::BTreeMap;

/// The part that a process plays in a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Publishes scene, states and step records: a live simulator, or a replay.
    Simulator,
    /// Turns keyframes into frames.
    Renderer,
    /// Writes the log.
    Recorder,
}

impl Role {
    /// The role's name in messages to people and in node names.
    pub fn name(self) -> &'static str {
        match self {
            Role::Simulator => "simulator",
            Role::Renderer => "renderer",
            Role::Recorder => "recorder",
        }
    }
}

/// One stream of messages with one publisher.
#[derive(Debug, PartialEq, Eq)]
pub struct Topic {
    /// Name of the bus service.
    pub name: &'static str,
    /// Who publishes it.
    pub publisher: Role,
    /// Who must receive every message of it.
    pub subscribers: &'static [Role],
    /// How many messages wait for a slow subscriber before the publisher has to.
    pub queue: usize,
    /// Where the recorder writes it; `None` for a topic whose messages reach the log through another one.
    pub channel: Option<&'static Channel>,
}

/// A channel of the log.
#[derive(Debug, PartialEq, Eq)]
pub struct Channel {
    /// The channel's topic in the MCAP file.
    pub topic: &'static str,
    /// MCAP message encoding: `json`, `bincode` or `protobuf`.
    pub message_encoding: &'static str,
    /// Name of the MCAP schema; empty for none.
    pub schema_name: &'static str,
    /// MCAP schema encoding: `jsonschema`, `protobuf`, or empty for none.
    pub schema_encoding: &'static str,
}

impl Channel {
    /// The bytes of the channel's schema; empty for none.
    pub fn schema_data(&self) -> Vec<u8> {
        match self.topic {
            "/scene" => scene::SCENE_JSON_SCHEMA.as_bytes().to_vec(),
            "/step" => step::STEP_JSON_SCHEMA.as_bytes().to_vec(),
            "/frame" => frame::compressed_image_descriptor(),
            "/frame_info" => frame::FRAME_INFO_JSON_SCHEMA.as_bytes().to_vec(),
            _ => Vec::new(),
        }
    }

    /// The channel's metadata: how numpy reads a state, and the layout's hash.
    pub fn metadata(&self) -> BTreeMap<String, String> {
        let mut metadata = BTreeMap::new();
        if self.topic == STATE_CHANNEL.topic {
            let layout = [
                ("header_dtype", state::HEADER_DTYPE.to_owned()),
                ("ring_dtype", state::BODY_DTYPE.to_owned()),
                ("contact_dtype", state::CONTACT_DTYPE.to_owned()),
                ("layout_hash", state::layout_hash().to_string()),
                ("byte_order", "little".to_owned()),
            ];
            metadata.extend(layout.map(|(key, value)| (key.to_owned(), value)));
        }
        metadata
    }
}

/// `/scene`: [`scene::SceneRecord`], once, first.
pub static SCENE_CHANNEL: Channel = Channel {
    topic: "/scene",
    message_encoding: "json",
    schema_name: "chainmail.Scene",
    schema_encoding: "jsonschema",
};
/// `/state`: [`state::StateMessage`].
pub static STATE_CHANNEL: Channel =
    Channel { topic: "/state", message_encoding: "bincode", schema_name: "", schema_encoding: "" };
/// `/step`: [`step::StepRecord`], one for every step.
pub static STEP_CHANNEL: Channel = Channel {
    topic: "/step",
    message_encoding: "json",
    schema_name: "chainmail.Step",
    schema_encoding: "jsonschema",
};
/// `/frame`: [`frame::CompressedImage`], a PNG.
pub static FRAME_CHANNEL: Channel = Channel {
    topic: "/frame",
    message_encoding: "protobuf",
    schema_name: "foxglove.CompressedImage",
    schema_encoding: "protobuf",
};
/// `/frame_info`: [`frame::FrameInfo`], one for every frame, after it.
pub static FRAME_INFO_CHANNEL: Channel = Channel {
    topic: "/frame_info",
    message_encoding: "json",
    schema_name: "chainmail.FrameInfo",
    schema_encoding: "jsonschema",
};
/// `/end`: [`End`](crate::end::End), once, last.
pub static END_CHANNEL: Channel =
    Channel { topic: "/end", message_encoding: "bincode", schema_name: "", schema_encoding: "" };

/// The resolved scene, the plan, program version and seed; once, before everything else.
pub static SCENE: Topic = Topic {
    name: "scene",
    publisher: Role::Simulator,
    subscribers: &[Role::Renderer, Role::Recorder],
    queue: 1,
    channel: Some(&SCENE_CHANNEL),
};
/// Every recorded state.
pub static STATE: Topic = Topic {
    name: "state",
    publisher: Role::Simulator,
    subscribers: &[Role::Recorder],
    queue: 16,
    channel: Some(&STATE_CHANNEL),
};
/// The record of every step, after the step's state.
pub static STEP: Topic = Topic {
    name: "step",
    publisher: Role::Simulator,
    subscribers: &[Role::Recorder],
    queue: 16,
    channel: Some(&STEP_CHANNEL),
};
/// The states at frame times, for the renderer; the same messages as on `state`, so they are not recorded twice.
pub static KEYFRAME: Topic = Topic {
    name: "keyframe",
    publisher: Role::Simulator,
    subscribers: &[Role::Renderer],
    queue: 4,
    channel: None,
};
/// Rendered frames, one for each keyframe, in order.
pub static FRAME: Topic = Topic {
    name: "frame",
    publisher: Role::Renderer,
    subscribers: &[Role::Recorder],
    queue: 4,
    channel: Some(&FRAME_CHANNEL),
};
/// What each frame shows and how it was made.
pub static FRAME_INFO: Topic = Topic {
    name: "frame_info",
    publisher: Role::Renderer,
    subscribers: &[Role::Recorder],
    queue: 4,
    channel: Some(&FRAME_INFO_CHANNEL),
};
/// Counts and the final chained hash; once, after everything else.
pub static END: Topic = Topic {
    name: "end",
    publisher: Role::Simulator,
    subscribers: &[Role::Recorder],
    queue: 1,
    channel: Some(&END_CHANNEL),
};

/// All topics.
pub static TOPICS: [&Topic; 7] = [&SCENE, &STATE, &STEP, &KEYFRAME, &FRAME, &FRAME_INFO, &END];

/// How many keyframes a frame's place in the log lies behind its own: the frame of keyframe `k` is written
/// right after the state and step record of keyframe `k + FRAME_LAG`, or before `/end`.
///
/// This is the order of the log, fixed by the run alone; it bounds what a recorder has to hold and how far
/// a simulator runs ahead of its renderer. Changing it changes every log's bytes.
pub const FRAME_LAG: u64 = 8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_topic_reaches_the_log() {
        for topic in TOPICS {
            let recorded = topic.channel.is_some() && topic.subscribers.contains(&Role::Recorder);
            assert!(recorded || topic.name == "keyframe", "{} would be lost", topic.name);
            assert!(topic.queue > 0 && !topic.subscribers.contains(&topic.publisher));
        }
    }

    #[test]
    fn names_are_unique_and_schemas_are_there() {
        let names: std::collections::BTreeSet<_> = TOPICS.iter().map(|topic| topic.name).collect();
        assert_eq!(names.len(), TOPICS.len());
        for channel in TOPICS.iter().filter_map(|topic| topic.channel) {
            assert_eq!(channel.schema_data().is_empty(), channel.schema_encoding.is_empty());
        }
    }
}

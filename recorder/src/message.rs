//! A message as the log sees it: which channel, when, and the very bytes that were on the bus.

use schemas::topics::{
    Channel, END_CHANNEL, FRAME_CHANNEL, FRAME_INFO_CHANNEL, SCENE_CHANNEL, STATE_CHANNEL, STEP_CHANNEL,
};
use std::borrow::Cow;

/// The channels of a log, in the order in which they are registered and numbered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// `/scene`: once, first.
    Scene,
    /// `/state`: recorded states.
    State,
    /// `/step`: one record for every step.
    Step,
    /// `/frame`: pictures.
    Frame,
    /// `/frame_info`: one for every picture.
    FrameInfo,
    /// `/end`: once, last.
    End,
}

impl Kind {
    /// All kinds, in the order of their channels.
    pub const ALL: [Kind; 6] =
        [Kind::Scene, Kind::State, Kind::Step, Kind::Frame, Kind::FrameInfo, Kind::End];

    /// How the log describes this kind.
    pub fn channel(self) -> &'static Channel {
        match self {
            Kind::Scene => &SCENE_CHANNEL,
            Kind::State => &STATE_CHANNEL,
            Kind::Step => &STEP_CHANNEL,
            Kind::Frame => &FRAME_CHANNEL,
            Kind::FrameInfo => &FRAME_INFO_CHANNEL,
            Kind::End => &END_CHANNEL,
        }
    }

    /// The kind whose channel has this topic, if there is one.
    pub fn of_topic(topic: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.channel().topic == topic)
    }

    /// Its place in [`Kind::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// Whether only a renderer publishes this kind.
    pub fn is_rendered(self) -> bool {
        matches!(self, Kind::Frame | Kind::FrameInfo)
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.channel().topic)
    }
}

/// One message, borrowed from a log or owned after coming off the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message<'a> {
    /// Its channel.
    pub kind: Kind,
    /// Simulated time in nanoseconds; `log_time` and `publish_time` of the log.
    pub log_time_ns: u64,
    /// The payload.
    pub bytes: Cow<'a, [u8]>,
}

impl<'a> Message<'a> {
    /// A message over borrowed or owned bytes.
    pub fn new(kind: Kind, log_time_ns: u64, bytes: impl Into<Cow<'a, [u8]>>) -> Message<'a> {
        Message { kind, log_time_ns, bytes: bytes.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use schemas::topics::TOPICS;

    #[test]
    fn every_recorded_topic_has_a_kind() {
        for channel in TOPICS.iter().filter_map(|topic| topic.channel) {
            let kind = Kind::of_topic(channel.topic).expect(channel.topic);
            assert_eq!(kind.channel(), channel);
            assert_eq!(Kind::ALL[kind.index()], kind);
        }
    }
}

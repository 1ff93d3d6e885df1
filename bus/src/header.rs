//! What travels beside the bytes of a message, and the numbers of the wake-up events.

use iceoryx2::prelude::ZeroCopySend;
use schemas::topics::{Role, TOPICS, Topic};

/// The roles in the order of their numbers in event ids.
pub(crate) const ROLES: [Role; 3] = [Role::Simulator, Role::Renderer, Role::Recorder];

/// "Look at your topics": the event that follows every message.
pub(crate) const EVENT_LOOK: usize = 0;
/// Handshake rounds that are told apart. A round begins when a subscriber comes or goes, so an answer
/// would have to be eight subscribers late to be taken for a present one.
const ROUNDS: usize = 8;
/// The largest event id in use.
pub(crate) const EVENT_ID_MAX: usize = ROUNDS * TOPICS.len() * ROLES.len();

/// The number of a role in event ids and lock files.
pub(crate) fn role_index(role: Role) -> usize {
    match role {
        Role::Simulator => 0,
        Role::Renderer => 1,
        Role::Recorder => 2,
    }
}

/// The number of a topic in event ids.
///
/// # Panics
/// If the topic is not in the manifest [`TOPICS`].
pub(crate) fn topic_index(topic: &Topic) -> usize {
    TOPICS
        .iter()
        .position(|entry| entry.name == topic.name)
        .unwrap_or_else(|| panic!("topic {:?} is not in schemas::topics::TOPICS", topic.name))
}

/// The event with which `role` answers a hello of handshake `round` on `topic`.
pub(crate) fn answer_event(topic: &Topic, role: Role, round: u64) -> usize {
    let round_index = (round % ROUNDS as u64) as usize;
    1 + (round_index * TOPICS.len() + topic_index(topic)) * ROLES.len() + role_index(role)
}

/// The publisher asks "are you connected?"; `sequence` is the handshake round.
pub(crate) const KIND_HELLO: u32 = 1;
/// Every subscriber has answered; messages follow.
pub(crate) const KIND_START: u32 = 2;
/// A message, or a part of one.
pub(crate) const KIND_DATA: u32 = 3;
/// No message follows; `sequence` is the count of messages that were sent.
pub(crate) const KIND_END: u32 = 4;

/// What travels beside each piece of a message. Its layout and its name with version are part of what
/// iceoryx2 compares when two processes meet, so processes with different layouts refuse each other.
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("chainmail/MessageHeader/v1")]
#[repr(C)]
pub(crate) struct MessageHeader {
    /// Number of the message on its topic, from 0; see the kinds for what else it means.
    pub sequence: u64,
    /// Simulated time of the message in nanoseconds.
    pub log_time_ns: u64,
    /// Where in the message this piece begins, in bytes.
    pub offset: u64,
    /// Length of the whole message in bytes.
    pub message_bytes: u64,
    /// One of the `KIND_` constants.
    pub kind: u32,
    /// Always 0.
    pub reserved: u32,
}

const _: () = assert!(size_of::<MessageHeader>() == 40);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_told_apart_and_fit() {
        let mut ids = std::collections::BTreeSet::from([EVENT_LOOK]);
        for round in 0..ROUNDS as u64 {
            for topic in TOPICS {
                for role in ROLES {
                    assert!(ids.insert(answer_event(topic, role, round)));
                }
            }
        }
        assert_eq!(ids.last(), Some(&EVENT_ID_MAX));
        assert_eq!(ids.len(), EVENT_ID_MAX + 1);
    }
}

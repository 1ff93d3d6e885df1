//! The receiving side of a topic.

use crate::bus::{Shared, attempt};
use crate::header::*;
use crate::{Bus, BusError};
use iceoryx2::identifiers::UniquePublisherId;
use iceoryx2::port::ReceiveError;
use iceoryx2::prelude::*;
use schemas::topics::{Role, Topic};
use std::rc::Rc;

type Port = iceoryx2::port::subscriber::Subscriber<ipc::Service, [u8], MessageHeader>;

/// A message that was received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Its number on the topic, from 0 without gaps.
    pub sequence: u64,
    /// Its simulated time in nanoseconds.
    pub log_time_ns: u64,
    /// The very bytes that were sent.
    pub bytes: Vec<u8>,
}

/// What a look at a topic finds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Received {
    /// Nothing has come yet.
    Nothing,
    /// The next message.
    Message(Message),
    /// The publisher is done and all its messages have been received; so it stays.
    End {
        /// How many messages there were.
        count: u64,
    },
}

/// The receiving side of a topic. Receive until [`Received::End`] before dropping it: a subscriber that
/// leaves earlier is lost for its publisher.
#[derive(Debug)]
pub struct Subscriber {
    /// `None` while it has to be made anew.
    port: Option<Port>,
    topic: &'static Topic,
    /// Who said hello last.
    origin: Option<UniquePublisherId>,
    stage: Stage,
    /// Number of the next message, which is also the count of those received.
    sequence: u64,
    /// The beginning of the next message, if it travels in pieces.
    pieces: Vec<u8>,
    shared: Rc<Shared>,
}

/// How far a subscriber is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Connecting,
    Open,
    Ended,
}

impl Subscriber {
    /// Opens the receiving side of `topic`. Connect it with [`Bus::handshake`].
    ///
    /// # Errors
    /// [`BusError::Transport`].
    ///
    /// # Panics
    /// If this process does not subscribe to the topic by the manifest.
    pub fn open(bus: &Bus, topic: &'static Topic) -> Result<Subscriber, BusError> {
        let shared = Rc::clone(&bus.0);
        assert!(topic.subscribers.contains(&shared.role), "topic {}: {:?}", topic.name, shared.role);
        let mut subscriber = Subscriber {
            port: None,
            topic,
            origin: None,
            stage: Stage::Connecting,
            sequence: 0,
            pieces: Vec::new(),
            shared,
        };
        subscriber.make_port()?;
        Ok(subscriber)
    }

    fn make_port(&mut self) -> Result<(), BusError> {
        // iceoryx2 counts a port as there until it is dropped, and there is place for one of this role.
        self.port = None;
        let name = PortName::new(self.shared.role.name())
            .map_err(|reason| BusError::transport("naming a port", reason))?;
        let port =
            attempt(|| self.shared.topic_service(self.topic).subscriber_builder().name(&name).create())
                .map_err(|reason| {
                    BusError::transport(format!("subscribing to topic {}", self.topic.name), reason)
                })?;
        self.port = Some(port);
        self.shared.notify(self.topic.publisher, EVENT_LOOK);
        Ok(())
    }

    /// One round of the handshake; returns who is still missing.
    pub(crate) fn shake_hands(&mut self) -> Result<Option<Role>, BusError> {
        // No message comes before the start, so this looks at hellos only.
        while self.stage == Stage::Connecting && self.take_sample()?.is_some() {}
        Ok((self.stage == Stage::Connecting).then_some(self.topic.publisher))
    }

    /// Looks whether something has come; does not wait ([`Bus::wait`] does).
    ///
    /// # Errors
    /// [`BusError::PeerLost`] when the publisher has died or has broken off the topic, after everything that
    /// it had sent was received; [`BusError::TooLate`] when the publisher had begun without this process;
    /// [`BusError::Gap`] when a message is missing; [`BusError::Transport`].
    pub fn receive(&mut self) -> Result<Received, BusError> {
        if self.stage == Stage::Ended {
            return Ok(Received::End { count: self.sequence });
        }
        // Whether the publisher is gone is asked before the queue is emptied: then nothing can follow.
        let gone = self.stage == Stage::Open && !self.publisher_present();
        while let Some(progress) = self.take_sample()? {
            match progress {
                Progress::Message(message) => return Ok(Received::Message(message)),
                Progress::End => return Ok(Received::End { count: self.sequence }),
                Progress::Part => {}
            }
        }
        if gone {
            return Err(self.publisher_lost());
        }
        Ok(Received::Nothing)
    }

    /// Messages received so far.
    pub fn message_count(&self) -> u64 {
        self.sequence
    }

    fn publisher_present(&self) -> bool {
        self.shared.roster.alive(self.topic.publisher)
            && self.shared.topic_service(self.topic).dynamic_config().number_of_publishers() > 0
    }

    fn publisher_lost(&self) -> BusError {
        BusError::PeerLost { topic: self.topic.name, role: self.topic.publisher, messages: self.sequence }
    }

    /// Takes one sample from the queue; `None` when it is empty.
    fn take_sample(&mut self) -> Result<Option<Progress>, BusError> {
        let Some(port) = &self.port else {
            self.make_port()?;
            return Ok(None);
        };
        let sample = match port.receive() {
            Ok(Some(sample)) => sample,
            Ok(None) => return Ok(None),
            Err(ReceiveError::ConnectionFailure(_)) if self.stage == Stage::Connecting => {
                // iceoryx2 does not try again to connect, so the port is made anew.
                self.make_port()?;
                return Ok(None);
            }
            Err(reason) => {
                return Err(BusError::transport(format!("receiving topic {}", self.topic.name), reason));
            }
        };
        let header = *sample.user_header();
        let origin = sample.origin();
        if self.stage == Stage::Open && self.origin != Some(origin) {
            return Err(self.publisher_lost());
        }
        if header.kind != KIND_HELLO && self.origin != Some(origin) {
            return Err(BusError::TooLate { topic: self.topic.name });
        }
        match header.kind {
            KIND_HELLO => {
                self.origin = Some(origin);
                drop(sample);
                let answer = answer_event(self.topic, self.shared.role, header.sequence);
                self.shared.notify(self.topic.publisher, answer);
                Ok(Some(Progress::Part))
            }
            KIND_START => {
                self.stage = Stage::Open;
                Ok(Some(Progress::Part))
            }
            KIND_DATA => self.join_piece(&header, sample.payload()),
            KIND_END if header.sequence == self.sequence && self.pieces.is_empty() => {
                self.stage = Stage::Ended;
                Ok(Some(Progress::End))
            }
            KIND_END => Err(self.gap(&header)),
            other => panic!("topic {}: a sample of kind {other}", self.topic.name),
        }
    }

    fn join_piece(&mut self, header: &MessageHeader, piece: &[u8]) -> Result<Option<Progress>, BusError> {
        let (got, due) = ((header.sequence, header.offset), (self.sequence, self.pieces.len() as u64));
        if got < due {
            // The second copy of a piece whose delivery a signal had interrupted.
            return Ok(Some(Progress::Part));
        }
        if got > due {
            return Err(self.gap(header));
        }
        self.pieces.reserve_exact((header.message_bytes - header.offset) as usize);
        self.pieces.extend_from_slice(piece);
        if (self.pieces.len() as u64) < header.message_bytes {
            return Ok(Some(Progress::Part));
        }
        assert_eq!(self.pieces.len() as u64, header.message_bytes, "topic {}", self.topic.name);
        self.sequence += 1;
        let bytes = std::mem::take(&mut self.pieces);
        Ok(Some(Progress::Message(Message {
            sequence: header.sequence,
            log_time_ns: header.log_time_ns,
            bytes,
        })))
    }

    fn gap(&self, header: &MessageHeader) -> BusError {
        BusError::Gap { topic: self.topic.name, expected: self.sequence, got: header.sequence }
    }
}

/// What a sample was.
enum Progress {
    /// A part of something; the next sample tells more.
    Part,
    Message(Message),
    End,
}

//! The sending side of a topic.

use crate::bus::{ATTEMPTS, Shared, WATCHERS_MAX, attempt};
use crate::claim::Roster;
use crate::header::*;
use crate::{Bus, BusError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::port::{BackpressureAction, BackpressureInfo, SendError};
use iceoryx2::prelude::*;
use schemas::topics::{Role, Topic};
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

type Port = iceoryx2::port::publisher::Publisher<ipc::Service, [u8], MessageHeader>;

/// How long a full queue is waited for once a stop was asked for: long enough for a subscriber that is
/// at work to make room for the last messages, short enough for a person who pressed Ctrl-C.
const STOP_PATIENCE: Duration = Duration::from_millis(500);

/// A publisher that sends faster than this looks at its subscribers and wakes them once in this time, or when
/// half a queue waits for them: each costs a system call, and the latter often a change of process. What is
/// unannounced when the publisher pauses is found by the subscriber's own looking, at most 50 ms later.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// The sending side of a topic. Dropping it without [`finish`](Publisher::finish) tells the subscribers
/// that the topic was broken off.
#[derive(Debug)]
pub struct Publisher {
    /// `None` while it has to be made anew.
    port: Option<Port>,
    topic: &'static Topic,
    subscribers: Vec<Role>,
    message_bytes: usize,
    stage: Stage,
    /// Number of the next message.
    sequence: u64,
    /// When the subscribers were last looked at and woken.
    looked_at: Instant,
    /// Pieces sent since.
    unannounced: usize,
    pressure: Arc<Pressure>,
    shared: Rc<Shared>,
}

/// How far a publisher is.
#[derive(Debug)]
enum Stage {
    /// The subscribers are not all there, or have not all answered.
    Connecting {
        /// Number of the latest hello, from 0 for none.
        round: u64,
        /// The subscriber ports that the latest hello went to, ordered by role.
        greeted: Vec<(Role, u128)>,
        /// Who has answered it.
        answered: Vec<Role>,
    },
    /// Messages may be sent.
    Open,
    /// A message could not be delivered to everyone, so none may follow it.
    Broken,
}

impl Publisher {
    /// Opens the sending side of `topic` for the `subscribers` that take part in this run, some or all of
    /// those in the manifest. Connect it with [`Bus::handshake`] before the first message.
    ///
    /// `message_bytes` is the size of a place in the queue: choose the size of a usual large message.
    /// A longer message is not an error: it travels in several pieces, one place each.
    ///
    /// # Errors
    /// [`BusError::SharedMemoryTooSmall`] when the queue does not fit, [`BusError::Transport`].
    ///
    /// # Panics
    /// If this process does not publish the topic, a subscriber does not subscribe to it by the
    /// manifest, or `message_bytes` is 0.
    pub fn open(
        bus: &Bus,
        topic: &'static Topic,
        subscribers: &[Role],
        message_bytes: usize,
    ) -> Result<Publisher, BusError> {
        let shared = Rc::clone(&bus.0);
        assert_eq!(topic.publisher, shared.role, "topic {}", topic.name);
        assert!(message_bytes > 0, "topic {}: message_bytes is 0", topic.name);
        let mut subscribers = subscribers.to_vec();
        subscribers.sort();
        subscribers.dedup();
        for role in &subscribers {
            assert!(
                topic.subscribers.contains(role),
                "topic {}: {} is no subscriber",
                topic.name,
                role.name()
            );
        }
        check_shared_memory(topic, message_bytes)?;
        let stage = Stage::Connecting { round: 0, greeted: Vec::new(), answered: Vec::new() };
        let pressure = Arc::new(Pressure {
            roster: Arc::clone(&shared.roster),
            stop: Arc::clone(&shared.stop),
            ports: Mutex::default(),
        });
        Ok(Publisher {
            port: None,
            topic,
            subscribers,
            message_bytes,
            stage,
            sequence: 0,
            looked_at: Instant::now(),
            unannounced: 0,
            pressure,
            shared,
        })
    }

    /// One round of the handshake; returns who is still missing.
    pub(crate) fn shake_hands(&mut self) -> Result<Vec<Role>, BusError> {
        let mut present = self.subscriber_ports();
        // A killed process's ports stay until somebody cleans up after it.
        present.retain(|(role, _)| self.shared.roster.alive(*role));
        let Stage::Connecting { round, greeted, answered } = &mut self.stage else { return Ok(Vec::new()) };
        for role in &self.subscribers {
            if *round > 0 && self.shared.take_answer(answer_event(self.topic, *role, *round)) {
                answered.push(*role);
            }
        }
        if *greeted != present {
            // Somebody came or went since the hello: the answers so far are void.
            answered.clear();
        } else if answered.len() == self.subscribers.len() {
            self.stage = Stage::Open;
            self.deliver(KIND_START, 0, 0, &[])?;
            return Ok(Vec::new());
        }
        let all_there = present.iter().map(|(role, _)| role).eq(&self.subscribers);
        if *greeted != present && all_there {
            // Everyone is asked again, as an old answer does not show that a new connection works.
            *round += 1;
            self.pressure.await_only(present.clone());
            *greeted = present;
            let round = *round;
            for role in &self.subscribers {
                self.shared.take_answer(answer_event(self.topic, *role, round));
            }
            self.greet(round)?;
        }
        let Stage::Connecting { answered, .. } = &self.stage else { return Ok(Vec::new()) };
        Ok(self.subscribers.iter().copied().filter(|role| !answered.contains(role)).collect())
    }

    /// Says hello to all subscriber ports. A hello waits in a new port's queue until its process looks.
    fn greet(&mut self, round: u64) -> Result<(), BusError> {
        let port = match self.port.take() {
            Some(port) => port,
            None => self.make_port()?,
        };
        let reached = port.update_connections().is_ok().then(|| {
            let header = MessageHeader { sequence: round, kind: KIND_HELLO, ..Default::default() };
            send_piece(&port, header, &[])
        });
        match reached {
            Some(Ok(count)) if count >= self.subscribers.len() => self.port = Some(port),
            // A connection could not be made. iceoryx2 does not try again, so the port is made anew.
            _ => {
                drop(port);
                if let Stage::Connecting { greeted, .. } = &mut self.stage {
                    greeted.clear();
                }
            }
        }
        self.wake_all();
        Ok(())
    }

    fn make_port(&self) -> Result<Port, BusError> {
        attempt(|| {
            let pressure = Arc::clone(&self.pressure);
            self.shared
                .topic_service(self.topic)
                .publisher_builder()
                .initial_max_slice_len(self.message_bytes)
                .max_loaned_samples(1)
                .allocation_strategy(AllocationStrategy::Static)
                .backpressure_strategy(BackpressureStrategy::RetryUntilDelivered)
                .set_backpressure_handler(move |info| pressure.action(info))
                .create()
        })
        .map_err(|reason| BusError::transport(format!("publishing topic {}", self.topic.name), reason))
    }

    /// The ports of the expected subscribers, ordered by role.
    fn subscriber_ports(&self) -> Vec<(Role, u128)> {
        let mut ports = Vec::new();
        self.shared.topic_service(self.topic).dynamic_config().list_subscribers(|details| {
            let role =
                ROLES.into_iter().find(|role| role.name().as_bytes() == details.subscriber_name.as_bytes());
            ports.extend(role.map(|role| (role, details.subscriber_id.value())));
            CallbackProgression::Continue
        });
        ports.sort();
        ports
    }

    /// Sends a message to every subscriber; waits while a queue is full. `log_time_ns` is simulated time
    /// in nanoseconds.
    ///
    /// # Errors
    /// [`BusError::PeerLost`] when a subscriber has died or has closed the topic (found at once while
    /// waiting, else with the next message), [`BusError::Stopped`] when a stop was asked for and a queue
    /// stays full. The message has not reached everyone then, and the publisher accepts no further one.
    ///
    /// # Panics
    /// If the handshake was not done, or an earlier message failed.
    pub fn send(&mut self, log_time_ns: u64, message: &[u8]) -> Result<(), BusError> {
        assert!(matches!(self.stage, Stage::Open), "topic {}: {:?}", self.topic.name, self.stage);
        self.deliver(KIND_DATA, self.sequence, log_time_ns, message)?;
        self.sequence += 1;
        Ok(())
    }

    /// Messages sent so far.
    pub fn message_count(&self) -> u64 {
        self.sequence
    }

    /// Tells the subscribers that no message follows, and how many there were. It waits for a place in
    /// their queues, not until they have read: they keep what is queued when this process ends.
    ///
    /// # Errors
    /// As [`send`](Publisher::send). After a failed message there is no proper end: the subscribers find
    /// the topic broken off.
    ///
    /// # Panics
    /// If the handshake was not done.
    pub fn finish(mut self) -> Result<u64, BusError> {
        match self.stage {
            Stage::Connecting { .. } => panic!("topic {}: finished before the handshake", self.topic.name),
            Stage::Broken => Err(self.lost_or_stopped()),
            Stage::Open => self.deliver(KIND_END, self.sequence, 0, &[]).map(|()| self.sequence),
        }
    }

    fn deliver(
        &mut self,
        kind: u32,
        sequence: u64,
        log_time_ns: u64,
        message: &[u8],
    ) -> Result<(), BusError> {
        if self.subscribers.is_empty() {
            return Ok(());
        }
        let mut offset = 0;
        loop {
            let piece_bytes = if message.len() - offset < self.message_bytes {
                message.len() - offset
            } else {
                self.message_bytes
            };
            let header = MessageHeader {
                sequence,
                log_time_ns,
                offset: offset as u64,
                message_bytes: message.len() as u64,
                kind,
                reserved: 0,
            };
            let due = kind != KIND_DATA || self.looked_at.elapsed() >= LOOK_EVERY;
            self.deliver_piece(header, &message[offset..offset + piece_bytes], due)?;
            self.unannounced += 1;
            if due || 2 * self.unannounced >= self.topic.queue {
                self.wake_all();
                self.looked_at = Instant::now();
                self.unannounced = 0;
            }
            offset += piece_bytes;
            if offset == message.len() {
                return Ok(());
            }
        }
    }

    /// Delivers one piece to every subscriber or breaks the publisher.
    ///
    /// A signal can interrupt a blocked delivery after some subscribers have the piece: it is sent again to
    /// all, and those who have it already drop the second copy by its number.
    ///
    /// With `look`, or once it has waited, it asks first whether all subscribers are alive. A dead one that is
    /// not looked at is found when its queue is full, or at the next look.
    fn deliver_piece(&mut self, header: MessageHeader, piece: &[u8], look: bool) -> Result<(), BusError> {
        let mut last_error = None;
        let mut attempts = 0;
        while attempts < ATTEMPTS {
            let begin = Instant::now();
            // Who has got the end leaves, perhaps before it is sent again to the others.
            let may_have_left = header.kind == KIND_END && last_error.is_some();
            let look = look || last_error.is_some();
            if look && !may_have_left && self.subscribers.iter().any(|role| !self.shared.roster.alive(*role))
            {
                break;
            }
            let Some(port) = &self.port else { break };
            match send_piece(port, header, piece) {
                Ok(count) if count == self.subscribers.len() => return Ok(()),
                // Somebody receives the topic on whom this run does not count.
                Ok(count) if count > self.subscribers.len() && self.missing_role().is_none() => {
                    return Ok(());
                }
                Ok(_) if may_have_left => return Ok(()),
                Ok(_) | Err(SendError::UnableToDeliver) => break,
                Err(reason) => last_error = Some(reason),
            }
            // Signals may come again and again while a slow subscriber is waited for; what fails without
            // having waited is not their doing.
            if begin.elapsed() < Duration::from_millis(1) {
                attempts += 1;
            }
        }
        self.stage = Stage::Broken;
        match last_error {
            Some(reason) if self.missing_role().is_none() && !self.shared.stopped() => {
                Err(BusError::transport(format!("sending on topic {}", self.topic.name), reason))
            }
            _ => Err(self.lost_or_stopped()),
        }
    }

    /// A subscriber that has died or has closed the topic.
    fn missing_role(&self) -> Option<Role> {
        let present = self.subscriber_ports();
        let there = |role: Role| {
            self.shared.roster.alive(role) && present.iter().any(|(port_role, _)| *port_role == role)
        };
        self.subscribers.iter().copied().find(|role| !there(*role))
    }

    fn lost_or_stopped(&self) -> BusError {
        let topic = self.topic.name;
        match self.missing_role() {
            Some(role) => BusError::PeerLost { topic, role, messages: self.sequence },
            None => BusError::Stopped { waiting_for: format!("a place in the queue of topic {topic}") },
        }
    }

    fn wake_all(&self) {
        for role in &self.subscribers {
            self.shared.notify(*role, EVENT_LOOK);
        }
    }
}

/// What decides, again and again while a queue is full, whether to go on waiting.
#[derive(Debug)]
struct Pressure {
    roster: Arc<Roster>,
    stop: Arc<AtomicBool>,
    /// The ports worth waiting for, and whose they are.
    ports: Mutex<Vec<(Role, u128)>>,
}

impl Pressure {
    fn await_only(&self, ports: Vec<(Role, u128)>) {
        *self.ports.lock().unwrap_or_else(PoisonError::into_inner) = ports;
    }

    fn action(&self, info: &BackpressureInfo) -> BackpressureAction {
        let ports = self.ports.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((role, _)) = ports.iter().find(|(_, port)| *port == info.receiver_port_id) else {
            // Somebody who came too late, or on whom this run does not count: nobody waits for it.
            return BackpressureAction::DiscardData;
        };
        let impatient = self.stop.load(Ordering::Relaxed) && info.elapsed_time >= STOP_PATIENCE;
        if impatient || !self.roster.alive(*role) {
            BackpressureAction::DiscardDataAndFail
        } else {
            BackpressureAction::Retry
        }
    }
}

/// Returns how many ports got the piece.
fn send_piece(port: &Port, header: MessageHeader, piece: &[u8]) -> Result<usize, SendError> {
    let mut sample = port.loan_slice_uninit(piece.len())?;
    *sample.user_header_mut() = header;
    sample.write_from_slice(piece).send()
}

/// Refuses a queue that does not fit: without room, the system kills the process that first touches it.
fn check_shared_memory(topic: &Topic, message_bytes: usize) -> Result<(), BusError> {
    let Ok(free) = rustix::fs::statvfs("/dev/shm") else { return Ok(()) };
    let places = (topic.subscribers.len() + WATCHERS_MAX) * (topic.queue + 1) + 1;
    let bytes = places as u64 * message_bytes as u64;
    let bytes_free = free.f_bavail.saturating_mul(free.f_frsize);
    if bytes > bytes_free {
        return Err(BusError::SharedMemoryTooSmall { topic: topic.name, bytes, bytes_free });
    }
    Ok(())
}

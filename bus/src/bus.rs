//! A process's place on a bus: its node, its wake-up events, and who else is there.

use crate::claim::{self, Claim, Roster};
use crate::header::{EVENT_ID_MAX, EVENT_LOOK, MessageHeader, ROLES, role_index, topic_index};
use crate::{BusError, BusName, Publisher, Subscriber};
use iceoryx2::node::NodeCreationFailure;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::{event, publish_subscribe};
use schemas::topics::{Role, TOPICS, Topic};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The service of one topic.
pub(crate) type TopicService = publish_subscribe::PortFactory<ipc::Service, [u8], MessageHeader>;
/// The events that wake a role's process.
type WakeService = event::PortFactory<ipc::Service>;

/// The longest that a wait goes on before the caller looks around again: a killed peer wakes nobody, so
/// this bounds how late its death is seen.
const WAIT_MAX: Duration = Duration::from_millis(50);
/// Bytes that a socket's path may have on Linux (`sun_path` less its final zero).
const SOCKET_PATH_BYTES_MAX: usize = 107;
/// Bytes of the longest socket name after the prefix: an id of 39 digits and `.event`.
const SOCKET_NAME_BYTES: usize = 39 + 6;
/// Attempts at things that a signal or a process in the middle of its own start can spoil.
pub(crate) const ATTEMPTS: usize = 10;

/// A process's place on a bus.
///
/// It holds the role until it and all publishers and subscribers made from it are dropped; the last process
/// of the run to do so removes what the bus has in `/dev/shm` and in its directory. Not `Send`: a bus and
/// its ports stay on the thread that made them.
#[derive(Debug)]
pub struct Bus(pub(crate) Rc<Shared>);

/// What a bus and its ports share. The fields are dropped in this order: ports, node, role.
#[derive(Debug)]
pub(crate) struct Shared {
    listener: Listener<ipc::Service>,
    notifiers: RefCell<BTreeMap<Role, Notifier<ipc::Service>>>,
    topics: Vec<TopicService>,
    wakes: Vec<WakeService>,
    /// Answers to this process's hellos that have come and nobody has asked for yet.
    answers: RefCell<BTreeSet<usize>>,
    _node: Node<ipc::Service>,
    pub(crate) role: Role,
    pub(crate) stop: Arc<AtomicBool>,
    pub(crate) roster: Arc<Roster>,
    claim: Claim,
}

impl Drop for Shared {
    fn drop(&mut self) {
        self.claim.begin_to_leave();
    }
}

impl Bus {
    /// Takes the part `role` on the bus `name`. Leftovers of killed processes are removed.
    ///
    /// Once `stop` is set (say by a signal), whatever waits for a peer ends with [`BusError::Stopped`];
    /// what need not wait still works, so that a stopped process can end its topics properly.
    ///
    /// # Errors
    /// [`BusError::NameInUse`] when a living process plays this part on this bus already;
    /// [`BusError::PathTooLong`], [`BusError::File`] and [`BusError::Transport`] when the system refuses.
    pub fn join(name: &BusName, role: Role, stop: Arc<AtomicBool>) -> Result<Bus, BusError> {
        let root_dir = name.root_dir();
        let prefix = name.shared_memory_prefix();
        let bytes = root_dir.as_os_str().len() + 1 + prefix.len() + SOCKET_NAME_BYTES;
        if bytes > SOCKET_PATH_BYTES_MAX {
            return Err(BusError::PathTooLong { root_dir, bytes, bytes_max: SOCKET_PATH_BYTES_MAX });
        }
        // iceoryx2 writes to stderr by itself; what matters here comes back as an error.
        set_log_level_from_env_or(LogLevel::Fatal);
        let (claim, door) = Claim::take(name, role)?;
        let refused = |reason: &dyn std::fmt::Debug| {
            BusError::transport(format!("joining bus {name} as {}", role.name()), reason)
        };
        let mut config = Config::default();
        config.global.prefix = FileName::new(prefix.as_bytes()).map_err(|reason| refused(&reason))?;
        let root_path =
            Path::new(root_dir.as_os_str().as_encoded_bytes()).map_err(|reason| refused(&reason))?;
        config.global.set_root_path(&root_path);
        let node_name = NodeName::new(role.name()).map_err(|reason| refused(&reason))?;
        let node = attempt(|| {
            NodeBuilder::new()
                .config(&config)
                .name(&node_name)
                .signal_handling_mode(SignalHandlingMode::Disabled)
                .create::<ipc::Service>()
        })
        .map_err(|reason: NodeCreationFailure| refused(&reason))?;
        claim::make_private(name)?;
        // Everybody opens everything while nobody else joins, and keeps it: so services are made by the first
        // process of a run alone. One that is killed while it makes a service leaves a half-made one, on
        // which all others would wait; when the first is killed, nobody else is there and it is wiped.
        let topics = TOPICS.iter().map(|topic| topic_service(&node, topic)).collect::<Result<_, _>>()?;
        let wakes: Vec<_> = ROLES.iter().map(|role| wake_service(&node, *role)).collect::<Result<_, _>>()?;
        let listener = attempt(|| wakes[role_index(role)].listener_builder().create())
            .map_err(|reason| refused(&reason))?;
        drop(door);
        let roster = claim.roster();
        Ok(Bus(Rc::new(Shared {
            listener,
            notifiers: RefCell::default(),
            topics,
            wakes,
            answers: RefCell::default(),
            _node: node,
            role,
            stop,
            roster,
            claim,
        })))
    }

    /// Connects all ports of this process, in any order of starting: returns when every subscriber of every
    /// publisher has answered, and every subscriber's publisher has said that it starts. Waits without a
    /// limit for processes that have not been started yet.
    ///
    /// Name all ports of the process in one call: two processes that connect topics one after the other,
    /// in different orders, would wait for each other.
    ///
    /// # Errors
    /// [`BusError::Stopped`] when a stop was asked for meanwhile; [`BusError::Transport`].
    pub fn handshake(
        &self,
        publishers: &mut [&mut Publisher],
        subscribers: &mut [&mut Subscriber],
    ) -> Result<(), BusError> {
        loop {
            let mut missing = BTreeSet::new();
            for publisher in publishers.iter_mut() {
                missing.extend(publisher.shake_hands()?);
            }
            for subscriber in subscribers.iter_mut() {
                missing.extend(subscriber.shake_hands()?);
            }
            if missing.is_empty() {
                return Ok(());
            }
            if self.0.stopped() {
                let names: Vec<_> = missing.into_iter().map(Role::name).collect();
                return Err(BusError::Stopped { waiting_for: format!("the {}", names.join(" and the ")) });
            }
            self.wait(WAIT_MAX)?;
        }
    }

    /// Sleeps until another process has sent something, a signal came, or the time is over: `at_most`,
    /// and never more than 50 ms. Look at every subscriber after it.
    ///
    /// # Errors
    /// [`BusError::Transport`].
    pub fn wait(&self, at_most: Duration) -> Result<(), BusError> {
        self.0.wait(at_most)
    }

    /// Whether a living process plays `role` on this bus. A process that a signal has stopped lives.
    pub fn alive(&self, role: Role) -> bool {
        self.0.roster.alive(role)
    }

    /// Removes what a run has left in `/dev/shm` and in the bus's directory, if no living process is on the
    /// bus `name`; for whoever started processes that may have been killed. Returns whether nothing is left.
    ///
    /// # Errors
    /// [`BusError::File`] when a file cannot be removed.
    pub fn clean_up(name: &BusName) -> Result<bool, BusError> {
        claim::clean_up(name)
    }

    /// Removes what runs have left whose processes were all killed, whatever their names were.
    pub fn clean_up_all() {
        claim::clean_up_all();
    }
}

impl Shared {
    pub(crate) fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn wait(&self, at_most: Duration) -> Result<(), BusError> {
        let at_most = if at_most < WAIT_MAX { at_most } else { WAIT_MAX };
        let mut answers = self.answers.borrow_mut();
        let note = |event: EventActivation| {
            if event.id.as_value() != EVENT_LOOK {
                answers.insert(event.id.as_value());
            }
        };
        use iceoryx2::port::listener::ListenerWaitError;
        match self.listener.timed_wait(note, at_most) {
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => Ok(()),
            Err(reason) => Err(BusError::transport("waiting for messages", reason)),
        }
    }

    /// Whether the event has come since it was last asked for.
    pub(crate) fn take_answer(&self, event: usize) -> bool {
        self.answers.borrow_mut().remove(&event)
    }

    /// Wakes `role`'s process with an event. If that fails, the process looks by itself before long
    /// ([`WAIT_MAX`]), and one that is not there yet looks when it comes.
    pub(crate) fn notify(&self, role: Role, event: usize) {
        let event = EventId::new(event);
        let mut notifiers = self.notifiers.borrow_mut();
        if let Some(notifier) = notifiers.get(&role)
            && notifier.notify_with_custom_event_id(event).is_ok_and(|reached| reached > 0)
        {
            return;
        }
        // A notifier looks for listeners again only when their list changes, so one that failed to open a
        // listener that was just being made would never wake it: make a new one.
        notifiers.remove(&role);
        if !self.roster.alive(role) {
            return;
        }
        match attempt(|| self.wakes[role_index(role)].notifier_builder().create()) {
            Ok(notifier) => {
                if let Err(reason) = notifier.notify_with_custom_event_id(event) {
                    tracing::warn!("the {} was not woken: {reason}", role.name());
                }
                notifiers.insert(role, notifier);
            }
            Err(reason) => tracing::warn!("the {} cannot be woken: {reason}", role.name()),
        }
    }

    /// The service of a topic.
    pub(crate) fn topic_service(&self, topic: &Topic) -> &TopicService {
        &self.topics[topic_index(topic)]
    }
}

/// Processes that may have a service open: one for each role, and some that died and are not cleaned up.
const NODES_MAX: usize = 16;

/// Other programs that may look at a topic, `iox2` for one. Nobody waits for them: what finds their queue full passes them
/// by.
pub(crate) const WATCHERS_MAX: usize = 2;

/// Opens the service of a topic. Everyone does it in the same words: the settings must agree.
fn topic_service(node: &Node<ipc::Service>, topic: &Topic) -> Result<TopicService, BusError> {
    let refused =
        |reason: &dyn std::fmt::Debug| BusError::transport(format!("opening topic {}", topic.name), reason);
    let name = ServiceName::new(topic.name).map_err(|reason| refused(&reason))?;
    attempt(|| {
        node.service_builder(&name)
            .publish_subscribe::<[u8]>()
            .user_header::<MessageHeader>()
            .enable_safe_overflow(false)
            .history_size(0)
            .subscriber_max_buffer_size(topic.queue)
            .subscriber_max_borrowed_samples(1)
            .max_publishers(1)
            .max_subscribers(topic.subscribers.len() + WATCHERS_MAX)
            .max_nodes(NODES_MAX)
            .open_or_create()
    })
    .map_err(|reason| refused(&reason))
}

/// Opens the events that wake a role's process.
fn wake_service(node: &Node<ipc::Service>, role: Role) -> Result<WakeService, BusError> {
    let refused = |reason: &dyn std::fmt::Debug| {
        BusError::transport(format!("opening the wake-up events of the {}", role.name()), reason)
    };
    let name = ServiceName::new(&format!("wake-{}", role.name())).map_err(|reason| refused(&reason))?;
    attempt(|| {
        node.service_builder(&name)
            .event()
            .max_listeners(2)
            .max_notifiers(NODES_MAX)
            .max_nodes(NODES_MAX)
            .event_id_max_value(EVENT_ID_MAX)
            .open_or_create()
    })
    .map_err(|reason| refused(&reason))
}

/// Tries again what another process in the middle of its start or end, or a signal, can spoil.
pub(crate) fn attempt<T, E>(mut act: impl FnMut() -> Result<T, E>) -> Result<T, E> {
    for _ in 1..ATTEMPTS {
        if let Ok(done) = act() {
            return Ok(done);
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    act()
}

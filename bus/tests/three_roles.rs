//! All topics of the manifest between the three roles, in every order of starting. Each role is a thread
//! here; `processes.rs` has what takes processes.

use bus::{Bus, BusError, BusName, Publisher, Received, Subscriber};
use schemas::topics::{Role, TOPICS, Topic};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::Duration;

const MESSAGES: u64 = 50;
const PATIENCE: Duration = Duration::from_secs(60);

/// Opens all that the manifest gives the role.
fn open_ports(bus: &Bus, role: Role) -> Result<(Vec<Publisher>, Vec<Subscriber>), BusError> {
    let publish = |topic: &&'static Topic| Publisher::open(bus, topic, topic.subscribers, 100);
    let subscribe = |topic: &&'static Topic| Subscriber::open(bus, topic);
    let publishers: Result<Vec<_>, _> =
        TOPICS.iter().filter(|topic| topic.publisher == role).map(publish).collect();
    let subscribers: Result<Vec<_>, _> =
        TOPICS.iter().filter(|topic| topic.subscribers.contains(&role)).map(subscribe).collect();
    Ok((publishers?, subscribers?))
}

/// Sends and receives on all topics at once; returns how many messages came.
fn play(bus: &Bus, role: Role) -> Result<u64, BusError> {
    let (mut publishers, mut subscribers) = open_ports(bus, role)?;
    bus.handshake(
        &mut publishers.iter_mut().collect::<Vec<_>>(),
        &mut subscribers.iter_mut().collect::<Vec<_>>(),
    )?;
    let mut come = 0;
    let mut open: Vec<&mut Subscriber> = subscribers.iter_mut().collect();
    // The simulator sends first and the renderer for each message that it gets, as in a run.
    let mut due = if role == Role::Simulator { MESSAGES } else { 0 };
    let mut sent = 0;
    while !open.is_empty() || sent < due {
        if sent < due {
            for publisher in &mut publishers {
                publisher.send(sent, format!("{sent}").as_bytes())?;
            }
            sent += 1;
        }
        let mut left = Vec::new();
        let mut idle = sent == due;
        for subscriber in open {
            match subscriber.receive()? {
                Received::Nothing => {}
                Received::Message(message) => {
                    assert_eq!(message.bytes, format!("{}", message.sequence).as_bytes());
                    come += 1;
                    due = if role == Role::Renderer { MESSAGES } else { due };
                    idle = false;
                }
                Received::End { count } => {
                    assert_eq!(count, MESSAGES);
                    continue;
                }
            }
            left.push(subscriber);
        }
        open = left;
        if idle && !open.is_empty() {
            bus.wait(PATIENCE)?;
        }
    }
    for publisher in publishers {
        publisher.finish()?;
    }
    Ok(come)
}

#[test]
fn every_order_of_starting_connects_all_topics() {
    use Role::{Recorder, Renderer, Simulator};
    let orders = [
        [Simulator, Renderer, Recorder],
        [Simulator, Recorder, Renderer],
        [Renderer, Simulator, Recorder],
        [Renderer, Recorder, Simulator],
        [Recorder, Simulator, Renderer],
        [Recorder, Renderer, Simulator],
    ];
    for order in orders {
        let name = BusName::unique();
        let (sender, joined) = channel();
        let roles: Vec<_> = order
            .into_iter()
            .map(|role| {
                let (name, sender) = (name.clone(), sender.clone());
                let thread = std::thread::spawn(move || {
                    let bus = Bus::join(&name, role, Arc::default()).unwrap();
                    sender.send(role).unwrap();
                    play(&bus, role)
                });
                assert_eq!(joined.recv_timeout(PATIENCE).unwrap(), role);
                (role, thread)
            })
            .collect();
        for (role, thread) in roles {
            let subscribed = TOPICS.iter().filter(|topic| topic.subscribers.contains(&role)).count() as u64;
            assert_eq!(thread.join().unwrap().unwrap(), subscribed * MESSAGES, "{role:?} of {order:?}");
        }
        assert!(!name.root_dir().exists());
    }
}

#[test]
fn a_stop_ends_the_handshake_and_names_who_is_missing() {
    let name = BusName::unique();
    let stop = Arc::new(AtomicBool::new(false));
    let bus = Bus::join(&name, Role::Renderer, Arc::clone(&stop)).unwrap();
    let (mut publishers, mut subscribers) = open_ports(&bus, Role::Renderer).unwrap();
    stop.store(true, Ordering::Relaxed);
    let publishers = &mut publishers.iter_mut().collect::<Vec<_>>();
    let error = bus.handshake(publishers, &mut subscribers.iter_mut().collect::<Vec<_>>()).unwrap_err();
    assert_eq!(error.to_string(), "stopped while waiting for the simulator and the recorder");
    assert!(bus.alive(Role::Renderer) && !bus.alive(Role::Recorder));
}

#[test]
fn a_queue_that_does_not_fit_into_shared_memory_is_refused() {
    let name = BusName::unique();
    let bus = Bus::join(&name, Role::Simulator, Arc::default()).unwrap();
    let topic = &schemas::topics::STATE;
    let error = Publisher::open(&bus, topic, topic.subscribers, 1 << 56).unwrap_err();
    assert!(matches!(error, BusError::SharedMemoryTooSmall { topic: "state", .. }), "{error}");
}

#[test]
fn a_publisher_without_subscribers_counts_and_ends() {
    let name = BusName::unique();
    let bus = Bus::join(&name, Role::Simulator, Arc::default()).unwrap();
    let mut publisher = Publisher::open(&bus, &schemas::topics::KEYFRAME, &[], 10).unwrap();
    bus.handshake(&mut [&mut publisher], &mut []).unwrap();
    publisher.send(0, b"unheard").unwrap();
    assert_eq!(publisher.finish().unwrap(), 1);
}

#[test]
fn other_users_can_neither_read_nor_write_what_a_bus_keeps_in_files() {
    use std::os::unix::fs::PermissionsExt;
    let name = BusName::unique();
    let bus = Bus::join(&name, Role::Simulator, Arc::default()).unwrap();
    let other = Bus::join(&name, Role::Recorder, Arc::default()).unwrap();
    let _ports = (open_ports(&bus, Role::Simulator).unwrap(), open_ports(&other, Role::Recorder).unwrap());
    let prefix = name.shared_memory_prefix();
    let shared = std::fs::read_dir("/dev/shm").unwrap().map(Result::unwrap);
    let shared =
        shared.filter(|entry| entry.file_name().to_str().is_some_and(|file| file.starts_with(&prefix)));
    let mut modes: Vec<_> = shared.map(|entry| (entry.path(), entry.metadata().unwrap())).collect();
    assert!(modes.len() > TOPICS.len(), "{modes:?}");
    modes.push((name.root_dir(), name.root_dir().metadata().unwrap()));
    for (path, metadata) in modes {
        assert_eq!(metadata.permissions().mode() & 0o077, 0, "{}", path.display());
    }
}

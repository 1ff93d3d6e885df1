//! A program on which the run does not count looks at a topic, as `iox2` does: it gets messages, and nobody waits for it.

use bus::{Bus, BusName, Publisher, Received, Subscriber};
use iceoryx2::prelude::*;
use schemas::topics::{Role, STATE};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

const MESSAGES: u64 = 500;

/// What travels beside a message, as anybody can write it down from what `iox2 service details` says.
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("chainmail/MessageHeader/v1")]
#[repr(C)]
struct Header {
    sequence: u64,
    log_time_ns: u64,
    offset: u64,
    message_bytes: u64,
    kind: u32,
    reserved: u32,
}

#[test]
fn a_watcher_that_does_not_read_holds_nobody_up() {
    let name = BusName::unique();
    let stop = || Arc::new(AtomicBool::new(false));
    let recorder = std::thread::spawn({
        let name = name.clone();
        move || {
            let bus = Bus::join(&name, Role::Recorder, stop()).expect("a bus");
            let mut states = Subscriber::open(&bus, &STATE).expect("a topic");
            bus.handshake(&mut [], &mut [&mut states]).expect("a handshake");
            let mut next = 0_u64;
            loop {
                match states.receive().expect("the simulator is there") {
                    Received::Message(message) => {
                        assert_eq!((message.sequence, message.bytes), (next, next.to_le_bytes().to_vec()));
                        next += 1;
                    }
                    Received::End { count } => return (next, count),
                    Received::Nothing => bus.wait(Duration::from_millis(50)).expect("a wait"),
                }
            }
        }
    });
    let bus = Bus::join(&name, Role::Simulator, stop()).expect("a bus");
    let mut states = Publisher::open(&bus, &STATE, &[Role::Recorder], 8).expect("a topic");
    bus.handshake(&mut [&mut states], &mut []).expect("a handshake");
    // The configuration that `chainmail bus NAME` prints.
    let mut config = Config::default();
    config.global.prefix = FileName::new(name.shared_memory_prefix().as_bytes()).expect("a prefix");
    let root_dir = name.root_dir();
    config.global.set_root_path(&Path::new(root_dir.as_os_str().as_encoded_bytes()).expect("a path"));
    let node = NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
    let service = node
        .service_builder(&"state".try_into().expect("a name"))
        .publish_subscribe::<[u8]>()
        .user_header::<Header>()
        .open()
        .expect("the topic is there");
    let watcher = service.subscriber_builder().create().expect("room for a watcher");
    for number in 0..MESSAGES {
        states.send(number, &number.to_le_bytes()).expect("the recorder is there");
    }
    // Its queue is full, and has the first messages.
    let sample = watcher.receive().expect("a topic").expect("a message");
    assert_eq!((sample.user_header().sequence, sample.payload()), (0, &0_u64.to_le_bytes()[..]));
    assert_eq!(states.finish().expect("the recorder is there"), MESSAGES);
    assert_eq!(recorder.join().expect("no panic"), (MESSAGES, MESSAGES));
}

//! One side of a topic as a process of its own, to try the bus by hand and for the tests:
//!
//! ```text
//! cargo run -p bus --example peer -- publish NAME --topic state --messages 1000
//! cargo run -p bus --example peer -- subscribe NAME --topic state --role recorder
//! ```
//!
//! It prints one line for each thing that happens. Exit code: 0 done, 1 other errors, 2 bad usage, 3 peer
//! lost, 4 stopped by a signal.

use bus::{Bus, BusError, BusName, Message, Publisher, Received, Subscriber};
use schemas::topics::{Role, TOPICS, Topic};
use std::collections::BTreeMap;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What the command line says.
struct Options {
    name: BusName,
    topic: &'static Topic,
    values: BTreeMap<String, String>,
}

impl Options {
    fn number(&self, key: &str, default: u64) -> u64 {
        let parse = |text: &String| text.parse().unwrap_or_else(|_| panic!("--{key}: {text} is no number"));
        self.values.get(key).map_or(default, parse)
    }

    fn role(&self) -> Role {
        let role = self.values.get("role").map_or("recorder", String::as_str);
        let roles = [Role::Simulator, Role::Renderer, Role::Recorder];
        roles.into_iter().find(|known| known.name() == role).expect("--role simulator|renderer|recorder")
    }
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (Some(verb), Some(name)) = (words.first(), words.get(1)) else {
        eprintln!("usage: peer publish|subscribe NAME [--topic T] [--KEY NUMBER ..]");
        return ExitCode::from(2);
    };
    let values: BTreeMap<String, String> = words[2..]
        .chunks_exact(2)
        .map(|pair| (pair[0].trim_start_matches("--").to_owned(), pair[1].clone()))
        .collect();
    let topic = values.get("topic").map_or("state", String::as_str);
    let topic =
        TOPICS.into_iter().find(|known| known.name == topic).expect("--topic: a name of the manifest");
    let outcome = name.parse().and_then(|name| {
        let options = Options { name, topic, values };
        if verb == "publish" { publish(&options) } else { subscribe(&options) }
    });
    let Err(error) = outcome else { return ExitCode::SUCCESS };
    println!("error {error}");
    match error {
        BusError::PeerLost { .. } => ExitCode::from(3),
        BusError::Stopped { .. } => ExitCode::from(4),
        _ => ExitCode::from(1),
    }
}

/// Set by SIGTERM. SIGUSR1 does nothing but interrupt what the process waits for.
fn stop_flag() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let ignored = Arc::new(AtomicBool::new(false));
    for (signal, flag) in [(signal_hook::consts::SIGTERM, &stop), (signal_hook::consts::SIGUSR1, &ignored)] {
        signal_hook::flag::register(signal, Arc::clone(flag)).expect("a handler of a signal");
    }
    stop
}

/// The message of a number: its length runs from 0 to `bytes_max` and its bytes depend on number and place.
fn message(sequence: u64, bytes_max: u64) -> Message {
    let length = sequence.wrapping_mul(7919) % (bytes_max + 1);
    let bytes = (0..length).map(|place| (sequence.wrapping_mul(31).wrapping_add(place)) as u8).collect();
    Message { sequence, log_time_ns: sequence * 1000, bytes }
}

/// `--messages N` (0: until stopped), `--bytes-max`, `--slot-bytes`, `--say-every`,
/// `--count-on ROLE` (instead of on all of the manifest).
fn publish(options: &Options) -> Result<(), BusError> {
    let stop = stop_flag();
    let bus = Bus::join(&options.name, options.topic.publisher, Arc::clone(&stop))?;
    println!("joined");
    let bytes_max = options.number("bytes-max", 1000);
    let slot_bytes = options.number("slot-bytes", 1000) as usize;
    let counted = |role: &&Role| options.values.get("count-on").is_none_or(|name| name == role.name());
    let subscribers: Vec<Role> = options.topic.subscribers.iter().filter(counted).copied().collect();
    let mut publisher = Publisher::open(&bus, options.topic, &subscribers, slot_bytes)?;
    bus.handshake(&mut [&mut publisher], &mut [])?;
    println!("connected");
    let count = options.number("messages", 0);
    let say_every = options.number("say-every", 1000);
    while publisher.message_count() != count || (count == 0 && !stop.load(Ordering::Relaxed)) {
        let next = message(publisher.message_count(), bytes_max);
        publisher.send(next.log_time_ns, &next.bytes)?;
        if (next.sequence + 1).is_multiple_of(say_every) {
            println!("sent {}", next.sequence + 1);
        }
        if count == 0 && stop.load(Ordering::Relaxed) {
            break;
        }
    }
    println!("finished {}", publisher.finish()?);
    Ok(())
}

/// `--bytes-max`, `--say-every`, `--first-look-ms` (late after opening), `--each-us` (time that a message
/// takes), `--hold-messages 1` (connects and reads nothing until SIGTERM).
fn subscribe(options: &Options) -> Result<(), BusError> {
    let stop = stop_flag();
    let bus = Bus::join(&options.name, options.role(), Arc::clone(&stop))?;
    println!("joined");
    let mut subscriber = Subscriber::open(&bus, options.topic)?;
    println!("opened");
    std::thread::sleep(Duration::from_millis(options.number("first-look-ms", 0)));
    bus.handshake(&mut [], &mut [&mut subscriber])?;
    println!("connected");
    let bytes_max = options.number("bytes-max", 1000);
    let say_every = options.number("say-every", 1000);
    while options.number("hold-messages", 0) == 1 && !stop.load(Ordering::Relaxed) {
        bus.wait(Duration::from_secs(1))?;
    }
    loop {
        match subscriber.receive()? {
            Received::Nothing => bus.wait(Duration::from_secs(1))?,
            Received::Message(got) => {
                let sent = message(got.sequence, bytes_max);
                assert!(got == sent, "message {}: other bytes than were sent", got.sequence);
                std::thread::sleep(Duration::from_micros(options.number("each-us", 0)));
                if (got.sequence + 1).is_multiple_of(say_every) {
                    println!("got {}", got.sequence + 1);
                }
            }
            Received::End { count } => {
                println!("end {count}");
                return Ok(());
            }
        }
    }
}

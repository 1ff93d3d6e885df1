//! Lossless topics between the processes of a run, over iceoryx2 shared memory.
//!
//! ```
//! use bus::{Bus, BusName, Publisher, Received, Subscriber};
//! use schemas::topics::{Role, STATE};
//! use std::sync::{Arc, atomic::AtomicBool};
//! use std::time::Duration;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let name = BusName::unique(); // or "my-run".parse()?
//! let stop = Arc::new(AtomicBool::new(false)); // for a handler of signals
//!
//! // The two sides are processes; they may also be threads. They start in any order.
//! let recorder = std::thread::spawn({
//!     let (name, stop) = (name.clone(), stop.clone());
//!     move || -> Result<u64, bus::BusError> {
//!         let bus = Bus::join(&name, Role::Recorder, stop)?;
//!         let mut states = Subscriber::open(&bus, &STATE)?;
//!         bus.handshake(&mut [], &mut [&mut states])?;
//!         let mut bytes = 0;
//!         loop {
//!             match states.receive()? {
//!                 Received::Nothing => bus.wait(Duration::from_secs(1))?,
//!                 Received::Message(message) => bytes += message.bytes.len() as u64,
//!                 Received::End { count } => {
//!                     assert_eq!(count, 100);
//!                     return Ok(bytes);
//!                 }
//!             }
//!         }
//!     }
//! });
//!
//! let bus = Bus::join(&name, Role::Simulator, stop)?;
//! let mut states = Publisher::open(&bus, &STATE, &[Role::Recorder], 4096)?;
//! bus.handshake(&mut [&mut states], &mut [])?;
//! for step in 0..100 {
//!     states.send(step * 1_000_000, &[7; 64])?;
//! }
//! assert_eq!(states.finish()?, 100);
//! assert_eq!(recorder.join().unwrap()?, 6400);
//! # Ok(())
//! # }
//! ```
//!
//! # What it promises
//! - Every subscriber gets every message once, in order, with the very bytes that were sent; message
//!   numbers and the count at the end are checked at the receiving side.
//! - A publisher does not begin before every subscriber it counts on has answered; it waits while a queue
//!   is full, for a slow subscriber and for one that a signal has stopped.
//! - A peer that dies hangs nobody: a waiting publisher finds it within its next look at the full queue (10 ms
//!   apart at most), one that does not wait finds it with its next message, a waiting subscriber within
//!   50 ms, after it has received everything that was queued.
//! - A stop flag ends what waits.
//! - Nothing stays in `/dev/shm` or the temporary directory after the last process of a run has ended; what
//!   killed processes leave is removed by the next to join the same name, or by [`Bus::clean_up`].
//!
//! # Limits
//! - One host, Linux, processes of one user (all files are private to it) with the same temporary directory,
//!   built with the same iceoryx2.
//! - One publisher for a topic, and one process for a role.
//! - A subscriber that joins after its publisher began gets an error, not the rest.
//! - Shared memory: `(subscribers * (queue + 1) + 1) * message_bytes` for each topic, where `subscribers` and
//!   `queue` are the manifest's and `message_bytes` is what the publisher asked for; pages that no message
//!   has touched cost nothing. A longer message travels in pieces, so it needs no more.
//! - Delivery to the subscribers of a topic is sequential: the slowest one sets the pace of all.
//! - A publisher makes its shared memory in the handshake: a file system that fills up afterwards, by other
//!   programs, kills the process that touches a new page.
//! - A receive copies the message out of shared memory.
//! - iceoryx2's own complaints go to stderr when `IOX2_LOG_LEVEL` is set, and nowhere otherwise.
//!
//! Files: the locks that tell who lives (`claim`), the node and its wake-up events (`bus`), the two sides of a
//! topic (`publisher`, `subscriber`), and what travels beside a message (`header`).

mod bus;
mod claim;
mod error;
mod header;
mod name;
mod publisher;
mod subscriber;

pub use bus::Bus;
pub use error::BusError;
pub use name::{BusName, NAME_LENGTH_MAX};
pub use publisher::Publisher;
pub use subscriber::{Message, Received, Subscriber};

//! Lossless topics between the processes of a run, over iceoryx2 shared memory.
//!
//! Being written: docs follow.

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

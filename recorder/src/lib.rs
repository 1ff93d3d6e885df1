//! The log: what was sent, recorded in an order that the run alone fixes, and read back bit for bit.
//!
//! - [`Sequencer`] brings the messages of three processes into that order;
//! - [`LogWriter`] writes them, and checks what it writes;
//! - [`Log`] reads them back, finished or not;
//! - [`Summary`] says what is in a log, [`diff()`] where two logs part, [`export`] writes it for other programs;
//! - [`recover()`] makes a whole log of what is left of a broken one;
//! - [`node::record`] is the process: it alone knows the bus, the clock and the file that is written.
//!
//! A log is an MCAP file: any MCAP tool opens it. Its chunks are not compressed, its `library` field is
//! fixed, and `log_time` is simulated time, so that two runs of one scene write the same bytes.

pub mod check;
mod container;
mod container_writer;
pub mod diff;
pub mod export;
mod fault;
pub mod glance;
mod index;
pub mod merge;
pub mod message;
pub mod node;
pub mod order;
pub mod reader;
mod rebuild;
pub mod recover;
pub mod resume;
mod salvage;
pub mod states;
pub mod summary;
mod target;
pub mod writer;

pub use container_writer::Sink;
pub use diff::{Diff, diff};
pub use fault::{Health, LogError, LogProblem};
pub use glance::Glance;
pub use merge::{MergeError, PartWriter, merge_files};
pub use message::{Kind, Message};
pub use order::Sequencer;
pub use reader::Log;
pub use recover::{RecoverError, Recovery, Remake, recover};
pub use salvage::Loss;
pub use states::{Kept, StateSource};
pub use summary::Summary;
pub use writer::{LogWriter, WriteError, Written};

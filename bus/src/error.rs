//! What can go wrong on a bus, in words for the person who has to mend it.

use schemas::topics::Role;
use std::path::PathBuf;

/// What went wrong on a bus.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BusError {
    /// The text is no bus name.
    #[error(
        "{name:?} is no bus name: 1 to 24 characters were expected, each an ASCII letter, a digit, '-' or '_'"
    )]
    BadName {
        /// The text.
        name: String,
    },
    /// Another living process plays the same part on this bus.
    #[error(
        "bus name {name:?} is in use: process {process} is its {} already; choose another name or end that process",
        role.name()
    )]
    NameInUse {
        /// The bus.
        name: String,
        /// The part that is taken.
        role: Role,
        /// The process number of who has it, `?` if it is not known.
        process: String,
    },
    /// The temporary directory's path leaves no room for the names of sockets.
    #[error(
        "the path of a socket in {} would have {bytes} bytes, and the system allows {bytes_max}: \
         choose a shorter bus name or set TMPDIR to a shorter directory",
        root_dir.display()
    )]
    PathTooLong {
        /// The directory of the bus.
        root_dir: PathBuf,
        /// Bytes of the longest path.
        bytes: usize,
        /// Bytes that the system allows.
        bytes_max: usize,
    },
    /// The file system of shared memory is too small for the queue of a topic.
    #[error(
        "topic {topic}: its queue takes {bytes} bytes of shared memory and {bytes_free} are free in /dev/shm: \
         free some, mount it larger (docker run --shm-size=1g), or use a smaller scene or picture"
    )]
    SharedMemoryTooSmall {
        /// The topic.
        topic: &'static str,
        /// Bytes that the queue takes.
        bytes: u64,
        /// Bytes that are free.
        bytes_free: u64,
    },
    /// A file or directory of the bus could not be used.
    #[error("{action} {} failed: {source}", path.display())]
    File {
        /// What was done to it: `creating`, `locking`, ...
        action: &'static str,
        /// The file or directory.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A stop was asked for while the process waited.
    #[error("stopped while waiting for {waiting_for}")]
    Stopped {
        /// Whom or what it waited for.
        waiting_for: String,
    },
    /// The other side of a topic has died, or has closed it before the end.
    #[error(
        "topic {topic}: the {} was lost after {messages} messages (its process died, or it closed the topic)",
        role.name()
    )]
    PeerLost {
        /// The topic.
        topic: &'static str,
        /// Who was lost.
        role: Role,
        /// Messages that were queued for it (seen by a publisher) or received from it (by a subscriber).
        messages: u64,
    },
    /// The publisher had begun before this process was there.
    #[error(
        "topic {topic}: its publisher began without this process: start it before the publisher has all \
         the peers that it counts on, or tell the publisher to count on it"
    )]
    TooLate {
        /// The topic.
        topic: &'static str,
    },
    /// A message is missing. This must not happen: it is checked because a lossless bus has to prove it.
    #[error("topic {topic}: message {expected} was expected and {got} came: messages were lost on the bus")]
    Gap {
        /// The topic.
        topic: &'static str,
        /// The sequence number that was due, counted from 0.
        expected: u64,
        /// The sequence number that came; at the end, the count of messages that were sent.
        got: u64,
    },
    /// iceoryx2 refused to do something.
    #[error("{action} failed in iceoryx2: {reason}")]
    Transport {
        /// What was done, and to which topic.
        action: String,
        /// iceoryx2's reason.
        reason: String,
    },
}

impl BusError {
    /// What a process exits with that cannot go on for this reason: 2 where another bus name or directory
    /// would do ([`BusError::BadName`], [`BusError::NameInUse`], [`BusError::PathTooLong`]), else 3.
    pub fn exit_code(&self) -> u8 {
        match self {
            BusError::BadName { .. } | BusError::NameInUse { .. } | BusError::PathTooLong { .. } => 2,
            _ => 3,
        }
    }

    /// A refusal of iceoryx2.
    pub(crate) fn transport(action: impl Into<String>, reason: impl std::fmt::Debug) -> Self {
        BusError::Transport { action: action.into(), reason: format!("{reason:?}") }
    }
}

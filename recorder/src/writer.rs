//! Writing a log: MCAP, uncompressed, with every byte fixed by the messages alone.

use crate::check::{CheckError, Checker, Counts};
use crate::message::{Kind, Message};
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions};
use std::io::{self, Seek, SeekFrom, Write};

/// Uncompressed size at which a chunk is closed, in bytes, if no keyframe closes it before.
///
/// Chunks are the unit of loss after a crash and of checking when one message is read. Changing this
/// changes every log's bytes.
const CHUNK_BYTES: u64 = 1 << 20;

/// The `library` field of the MCAP header: fixed, so that a log does not depend on a library's version text.
pub const LIBRARY: &str = "chainmail";

/// A log that cannot be written on.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The message does not belong into the log.
    #[error(transparent)]
    Check(#[from] CheckError),
    /// The sink refused bytes: a full disk, most often.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The MCAP library refused.
    #[error("the log's container cannot be written: {0}")]
    Container(#[source] Box<McapError>),
}

impl From<McapError> for WriteError {
    fn from(error: McapError) -> WriteError {
        match error {
            McapError::Io(error) => WriteError::Io(error),
            error => WriteError::Container(Box::new(error)),
        }
    }
}

/// What a finished or broken-off log holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Written {
    /// Messages by kind.
    pub counts: Counts,
    /// Bytes of the file so far.
    pub bytes: u64,
    /// Frames that the end record promises and that never came.
    pub frames_missing: u64,
}

/// Writes a log, message by message, and checks what it writes (see [`Checker`]).
///
/// Bytes reach the sink in whole chunks, in sequence: what has been written is never written over, so a
/// file that breaks off at any point is a readable prefix. A chunk ends with the step record of a keyframe,
/// or when it exceeds 1 MiB.
///
/// ```
/// use recorder::LogWriter;
///
/// let writer = LogWriter::create(Vec::new(), false)?;
/// let (bytes, written) = writer.finish()?;
/// assert_eq!(written.bytes, bytes.len() as u64);
/// # Ok::<(), recorder::WriteError>(())
/// ```
pub struct LogWriter<W: Write> {
    mcap: mcap::Writer<Sink<W>>,
    channel_ids: [u16; 6],
    sequences: [u32; 6],
    checker: Checker,
    /// What the closed chunks hold.
    saved: Counts,
}

impl<W: Write> LogWriter<W> {
    /// Begins a log; with `renderer`, it has channels for frames.
    ///
    /// # Errors
    ///
    /// [`WriteError::Io`] if the sink refuses the header.
    pub fn create(sink: W, renderer: bool) -> Result<LogWriter<W>, WriteError> {
        let options = WriteOptions::new()
            .profile("")
            .library(LIBRARY)
            .compression(None)
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true);
        let mut mcap = options.create(Sink { inner: sink, position: 0 })?;
        let mut channel_ids = [0; 6];
        for kind in Kind::ALL.into_iter().filter(|kind| renderer || !kind.is_rendered()) {
            let channel = kind.channel();
            let schema_id = match channel.schema_encoding {
                "" => 0,
                encoding => mcap.add_schema(channel.schema_name, encoding, &channel.schema_data())?,
            };
            channel_ids[kind.index()] =
                mcap.add_channel(schema_id, channel.topic, channel.message_encoding, &channel.metadata())?;
        }
        let (sequences, checker, saved) = ([0; 6], Checker::new(renderer), Counts::default());
        Ok(LogWriter { mcap, channel_ids, sequences, checker, saved })
    }

    /// Appends a message. The messages must come in the order of [`Sequencer`](crate::order::Sequencer).
    ///
    /// # Errors
    ///
    /// [`WriteError::Check`] if the message breaks a promise of the log; it is not written then, and the log
    /// can still be finished. [`WriteError::Io`] if the sink refuses bytes.
    pub fn write(&mut self, message: &Message) -> Result<(), WriteError> {
        let step = self.checker.check(message)?.map(|record| record.step);
        let index = message.kind.index();
        let header = MessageHeader {
            channel_id: self.channel_ids[index],
            // MCAP counts in 32 bits; the step number in the message is the count that never wraps.
            sequence: self.sequences[index],
            log_time: message.log_time_ns,
            publish_time: message.log_time_ns,
        };
        self.sequences[index] = self.sequences[index].wrapping_add(1);
        self.mcap.write_to_known_channel(&header, &message.bytes)?;
        if step.is_some_and(|step| self.checker.is_keyframe(step)) {
            self.mcap.flush()?;
            self.saved = self.checker.counts();
        }
        Ok(())
    }

    /// What has been written, messages in the open chunk included.
    pub fn counts(&self) -> Counts {
        self.checker.counts()
    }

    /// What can be read back if the process dies now, as of the last keyframe.
    pub fn saved(&self) -> Counts {
        self.saved
    }

    /// Whether the end record has been written.
    pub fn has_end(&self) -> bool {
        self.checker.end().is_some()
    }

    /// Closes the last chunk, writes the index and gives the sink back, flushed but not synced.
    ///
    /// # Errors
    ///
    /// [`WriteError::Io`] if the sink refuses bytes.
    pub fn finish(mut self) -> Result<(W, Written), WriteError> {
        self.mcap.finish()?;
        let (counts, frames_missing) = (self.checker.counts(), self.checker.frames_missing());
        let Sink { mut inner, position } = self.mcap.into_inner();
        inner.flush()?;
        Ok((inner, Written { counts, bytes: position, frames_missing }))
    }
}

/// Counts bytes, and knows its position without asking the file.
struct Sink<W> {
    inner: W,
    position: u64,
}

impl<W: Write> Write for Sink<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.inner.write(bytes)?;
        self.position += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl<W: Write> Seek for Sink<W> {
    fn seek(&mut self, target: SeekFrom) -> io::Result<u64> {
        match target {
            SeekFrom::Current(0) => Ok(self.position),
            // The MCAP writer is told not to seek.
            _ => Err(io::Error::other("a log is written in sequence")),
        }
    }
}

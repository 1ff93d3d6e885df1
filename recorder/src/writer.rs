//! Writing a log: MCAP, uncompressed, with every byte fixed by the messages alone.

use crate::check::{CheckError, Checker, Counts};
use crate::container_writer::{ContainerWriter, Sink};
use crate::message::{Kind, Message};
use std::io;

/// Uncompressed size at which a chunk is closed, in bytes, if no keyframe closes it before.
///
/// Chunks are the unit of loss after a crash and of checking when one message is read. Changing this
/// changes every log's bytes.
pub(crate) const CHUNK_BYTES: usize = 1 << 20;

/// So many chunks are closed by keyframes however small they are; from then on, a keyframe closes a chunk that holds at
/// least this part of the file so far (its inverse).
///
/// Each chunk has a line in the index, which is held in memory until the end. With this there are at most some ten
/// thousand before chunks are as large as [`CHUNK_BYTES`], and one a mebibyte from then on: a run of ten million steps
/// of two rings, which has 120,000 frames, holds 2 MB of index instead of 30.
const CHUNKS_MAX: u32 = 1024;

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
/// Bytes reach the sink in whole chunks, in sequence, and a chunk in progress when [`LogWriter::flush`] is called, so a
/// file that breaks off at any point is a readable prefix. A chunk ends with the step record of a keyframe (after 1024
/// chunks: once it holds 1/1024 of the file), or when it exceeds 1 MiB; flushing changes no byte of the finished log.
///
/// ```
/// use recorder::LogWriter;
///
/// let writer = LogWriter::create(Vec::new(), false)?;
/// let (bytes, written) = writer.finish()?;
/// assert_eq!(written.bytes, bytes.len() as u64);
/// # Ok::<(), recorder::WriteError>(())
/// ```
pub struct LogWriter<W: Sink> {
    container: ContainerWriter<W>,
    channel_ids: [u16; 6],
    sequences: [u32; 6],
    checker: Checker,
    /// What the sink holds.
    saved: Counts,
}

impl<W: Sink> LogWriter<W> {
    /// Begins a log; with `renderer`, it has channels for frames.
    ///
    /// # Errors
    ///
    /// [`WriteError::Io`] if the sink refuses the header.
    pub fn create(sink: W, renderer: bool) -> Result<LogWriter<W>, WriteError> {
        let mut container = ContainerWriter::create(sink, LIBRARY, CHUNK_BYTES)?;
        let mut channel_ids = [0; 6];
        for kind in Kind::ALL.into_iter().filter(|kind| renderer || !kind.is_rendered()) {
            let channel = kind.channel();
            let schema_id = match channel.schema_encoding {
                "" => 0,
                encoding => container.add_schema(channel.schema_name, encoding, &channel.schema_data()),
            };
            let (topic, encoding) = (channel.topic, channel.message_encoding);
            channel_ids[kind.index()] =
                container.add_channel(schema_id, topic, encoding, &channel.metadata());
        }
        let (sequences, checker, saved) = ([0; 6], Checker::new(renderer), Counts::default());
        Ok(LogWriter { container, channel_ids, sequences, checker, saved })
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
        // MCAP counts in 32 bits; the step number in the message is the count that never wraps.
        let sequence = self.sequences[index];
        self.sequences[index] = sequence.wrapping_add(1);
        self.container.write(self.channel_ids[index], sequence, message.log_time_ns, &message.bytes)?;
        if step.is_some_and(|step| self.checker.is_keyframe(step))
            && self.container.is_chunk_worth_closing(CHUNKS_MAX)
        {
            self.container.close_chunk()?;
            self.saved = self.checker.counts();
        }
        Ok(())
    }

    /// Puts the chunk in progress on the sink, so that all that was written can be read if the process dies now.
    ///
    /// It may be called at any time between two messages; the finished log is the same. Only a sink that can be written
    /// over takes it: a pipe does not.
    ///
    /// # Errors
    ///
    /// [`WriteError::Io`] if the sink refuses bytes.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.container.flush()?;
        self.saved = self.checker.counts();
        Ok(())
    }

    /// Bytes of the file so far, those of the chunk in progress included.
    pub fn bytes(&self) -> u64 {
        self.container.bytes()
    }

    /// What has been written, messages in the open chunk included.
    pub fn counts(&self) -> Counts {
        self.checker.counts()
    }

    /// What can be read back if the process dies now, as of the last keyframe or flush.
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
    pub fn finish(self) -> Result<(W, Written), WriteError> {
        let (counts, frames_missing) = (self.checker.counts(), self.checker.frames_missing());
        let (sink, bytes) = self.container.finish()?;
        Ok((sink, Written { counts, bytes, frames_missing }))
    }
}

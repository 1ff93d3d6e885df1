//! Frames rendered in several places, and one log made of them: the log that one renderer would have led to, byte for
//! byte.
//!
//! The one thing to know: a *part* is an MCAP file with `/scene`, `/frame` and `/frame_info` alone, each message with the
//! bytes that it has in a log. It has no steps, so it is no log; merged with the log whose motion it shows, it becomes one.

use crate::container_writer::{ContainerWriter, Sink};
use crate::fault::LogError;
use crate::message::{Kind, Message};
use crate::order::{OrderError, Sequencer};
use crate::reader::Log;
use crate::recover::{keep, temporary_beside};
use crate::writer::{CHUNK_BYTES, LIBRARY, LogWriter, WriteError, Written};
use schemas::end::End;
use schemas::scene::{Scene, SceneRecord, render::Render};
use schemas::wire;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// What a part holds, in the order of its channels.
const KINDS: [Kind; 3] = [Kind::Scene, Kind::Frame, Kind::FrameInfo];

/// Writes a part: the scene, then frames in any order, each with its info.
pub struct PartWriter<W: Sink> {
    container: ContainerWriter<W>,
    frames: u32,
}

impl<W: Sink> PartWriter<W> {
    /// Begins a part with the message of its scene.
    ///
    /// # Errors
    ///
    /// The sink's.
    pub fn create(sink: W, scene: &[u8]) -> io::Result<PartWriter<W>> {
        let mut container = ContainerWriter::create(sink, LIBRARY, CHUNK_BYTES)?;
        for kind in KINDS {
            let channel = kind.channel();
            let schema =
                container.add_schema(channel.schema_name, channel.schema_encoding, &channel.schema_data());
            container.add_channel(schema, channel.topic, channel.message_encoding, &channel.metadata());
        }
        container.write(1, 0, 0, scene)?;
        container.close_chunk()?;
        Ok(PartWriter { container, frames: 0 })
    }

    /// Appends a frame and its info, and puts both on the sink.
    ///
    /// # Errors
    ///
    /// The sink's.
    pub fn write(&mut self, log_time_ns: u64, frame: &[u8], info: &[u8]) -> io::Result<()> {
        self.container.write(2, self.frames, log_time_ns, frame)?;
        self.container.write(3, self.frames, log_time_ns, info)?;
        self.frames += 1;
        self.container.close_chunk()
    }

    /// Writes the index and gives the sink back.
    ///
    /// # Errors
    ///
    /// The sink's.
    pub fn finish(self) -> io::Result<W> {
        Ok(self.container.finish()?.0)
    }
}

/// Why nothing was merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// One of the files cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// None of the files has steps, or several have.
    #[error(
        "{count} of the files have steps: expected one, the log whose frames the parts are, and besides it the files that \
         `rerender --share` wrote"
    )]
    Motion {
        /// How many.
        count: usize,
    },
    /// The log with the steps has no end record.
    #[error("{file}: it has no end record; `chainmail recover` or `resume` makes a whole log of it first")]
    Unfinished {
        /// The log.
        file: String,
    },
    /// Two files were rendered with different settings, or show different motions.
    #[error("{a} and {b} have different scenes ({what}): they are no parts of one log")]
    Scene {
        /// One file.
        a: String,
        /// The other.
        b: String,
        /// What differs.
        what: &'static str,
    },
    /// A frame is there twice, and not the same.
    #[error("frame {frame} differs in {a} and {b}: were they rendered by one version of the program?")]
    Frame {
        /// Its number.
        frame: u64,
        /// One file.
        a: String,
        /// The other.
        b: String,
    },
    /// Frames are in no file.
    #[error(
        "{count} of {of} frames are in no part, the first is frame {first}: render its share, and merge again"
    )]
    Missing {
        /// How many.
        count: u64,
        /// How many there should be.
        of: u64,
        /// The first.
        first: u64,
    },
    /// The files contradict each other.
    #[error(transparent)]
    Order(#[from] OrderError),
    /// The files contradict each other, or the new log cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The new log cannot be made.
    #[error("cannot write {}: {source}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
}

/// Merges files into the log `out`, which appears when it is finished, or not at all; with `force`, in place of another.
///
/// # Errors
///
/// [`MergeError`]; `out` is as it was before.
pub fn merge_files(logs: &[Log], out: &Path, force: bool) -> Result<Written, MergeError> {
    let create = |source| MergeError::Create { path: out.to_owned(), source };
    let temporary = temporary_beside(out).map_err(create)?;
    let (file, written) = merge(logs, temporary.as_file().try_clone().map_err(create)?)?;
    file.sync_all().and_then(|()| keep(temporary, out, force)).map_err(create)?;
    Ok(written)
}

/// Where a frame lies: the number of its file, and its number there.
type Place = (usize, usize);

/// Makes one log of a log's motion and the frames of the others.
///
/// Frames that the log itself has are taken if it was rendered with the same settings; else they are left out.
///
/// # Errors
///
/// [`MergeError`]; what the sink holds then is of no use.
pub fn merge<W: Sink>(logs: &[Log], sink: W) -> Result<(W, Written), MergeError> {
    let mut with_steps = logs.iter().filter(|log| log.count(Kind::Step) > 0);
    let (base, count) = (with_steps.next(), logs.iter().filter(|log| log.count(Kind::Step) > 0).count());
    let Some(base) = base.filter(|_| count == 1) else { return Err(MergeError::Motion { count }) };
    let end = base.end()?.ok_or_else(|| MergeError::Unfinished { file: base.file().to_owned() })?;
    let scene = common_scene(base, logs)?;
    let frames = frames_of(base, logs, &scene, &end)?;
    let mut writer = LogWriter::create(sink, true)?;
    let mut sequencer = Sequencer::new(true);
    sequencer.push(Message::new(Kind::Scene, 0, scene))?;
    for (log, index) in frames {
        for kind in [Kind::Frame, Kind::FrameInfo] {
            sequencer.push(logs[log].nth(kind, index)?)?;
        }
    }
    let last = base.nth(Kind::End, 0)?;
    sequencer.push(Message::new(Kind::End, last.log_time_ns, wire::encode(&end)))?;
    for kind in [Kind::Scene, Kind::Frame, Kind::FrameInfo, Kind::End] {
        sequencer.close(kind);
    }
    for message in base.messages() {
        let message = message?;
        if matches!(message.kind, Kind::State | Kind::Step) {
            sequencer.push(message)?;
            write_what_is_due(&mut sequencer, &mut writer)?;
        }
    }
    sequencer.close(Kind::State);
    sequencer.close(Kind::Step);
    write_what_is_due(&mut sequencer, &mut writer)?;
    Ok(writer.finish()?)
}

fn write_what_is_due<W: Sink>(
    sequencer: &mut Sequencer,
    writer: &mut LogWriter<W>,
) -> Result<(), MergeError> {
    while let Some(message) = sequencer.next()? {
        writer.write(&message)?;
    }
    Ok(())
}

/// The scene message of all parts: that of the new log.
fn common_scene<'a>(base: &'a Log, logs: &'a [Log]) -> Result<Cow<'a, [u8]>, MergeError> {
    let mut parts = logs.iter().filter(|log| !std::ptr::eq(*log, base));
    let base_scene = base.nth(Kind::Scene, 0)?.bytes;
    let Some(first) = parts.next() else { return Ok(base_scene) };
    let scene = first.nth(Kind::Scene, 0)?.bytes;
    let differ = |a: &Log, b: &Log, what| {
        let (a, b) = (a.file().to_owned(), b.file().to_owned());
        Err(MergeError::Scene { a, b, what })
    };
    for part in parts {
        if part.nth(Kind::Scene, 0)?.bytes != scene {
            return differ(first, part, "they were rendered with other settings");
        }
    }
    let motion = |record: SceneRecord| {
        let scene = Scene { render: Render::default(), ..record.scene };
        SceneRecord { scene, ..record }
    };
    if motion(base.scene()?) != motion(first.scene()?) {
        return differ(base, first, "the part shows another motion");
    }
    Ok(scene)
}

/// Where each frame lies, in their order.
fn frames_of(base: &Log, logs: &[Log], scene: &[u8], end: &End) -> Result<Vec<Place>, MergeError> {
    let mut frames: BTreeMap<u64, Place> = BTreeMap::new();
    for (number, log) in logs.iter().enumerate() {
        if std::ptr::eq(log, base) && *base.nth(Kind::Scene, 0)?.bytes != *scene {
            continue;
        }
        let count = [log.count(Kind::Frame), log.count(Kind::FrameInfo)];
        for index in 0..if count[0] < count[1] { count[0] } else { count[1] } {
            let frame = log.frame_info(index)?.frame;
            let Some(&(other, at)) = frames.get(&frame) else {
                frames.insert(frame, (number, index));
                continue;
            };
            for kind in [Kind::Frame, Kind::FrameInfo] {
                if log.nth(kind, index)? != logs[other].nth(kind, at)? {
                    let (a, b) = (logs[other].file().to_owned(), log.file().to_owned());
                    return Err(MergeError::Frame { frame, a, b });
                }
            }
        }
    }
    let of = end.keyframe_count;
    let mut missing = (0..of).filter(|frame| !frames.contains_key(frame));
    if let Some(first) = missing.next() {
        return Err(MergeError::Missing { count: 1 + missing.count() as u64, of, first });
    }
    Ok(frames.into_values().collect())
}

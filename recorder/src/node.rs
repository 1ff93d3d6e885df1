//! The recorder process: takes the messages of a run off the bus and writes them. The only file that knows
//! the bus and the clock.

use crate::check::Counts;
use crate::fault::LogError;
use crate::message::{Kind, Message};
use crate::order::{OrderError, Sequencer};
use crate::reader::Log;
use crate::resume;
use crate::target::{Refusal, Target};
use crate::writer::{LogWriter, WriteError, Written};
use bus::{Bus, BusError, BusName, Received, Subscriber};
use schemas::end::{End, Outcome};
use schemas::scene::{Record, SceneRecord};
use schemas::topics::{Role, TOPICS, Topic};
use schemas::wire;
use std::fs::File;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// After a stop was asked for, or a process was lost, the others have this long to send what they hold.
const PATIENCE: Duration = Duration::from_millis(1200);
/// The log is brought to the disk whenever so many bytes have been written since, and every `record.flush_every_s`
/// seconds: a lost process or power failure costs no more than this.
const FLUSH_BYTES: u64 = 64 << 20;

/// What to record, and where.
#[derive(Clone, Debug, clap::Args)]
pub struct RecordOptions {
    /// Name of the bus that the run's processes share
    #[arg(long, value_name = "NAME")]
    pub bus: BusName,
    /// The log file to write
    #[arg(long, value_name = "LOG")]
    pub out: PathBuf,
    /// Replace the log file if it exists
    #[arg(long)]
    pub force: bool,
    /// Expect no renderer: the log has no frames
    #[arg(long)]
    pub no_render: bool,
    /// Begin with what this log holds up to a step, and go on with what the bus brings after it
    #[arg(long, value_name = "LOG", requires = "from_step")]
    pub resume: Option<PathBuf>,
    /// The last step that is taken from the log of --resume
    #[arg(long, value_name = "STEP", requires = "resume")]
    pub from_step: Option<u64>,
}

/// How far a recording is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Waiting for the other processes to start.
    Waiting,
    /// Recording.
    Recording {
        /// Steps written.
        step: u64,
        /// Steps of the whole run.
        step_count: u64,
        /// Frames written.
        frames: u64,
    },
}

/// A finished recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// What the log holds.
    pub written: Written,
    /// How the simulator said that the run ended.
    pub outcome: Outcome,
}

/// A recording that failed. The message says what is in the log.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The log file exists.
    #[error("{} exists already; choose another file, or add --force to replace it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// Another recorder is writing the log file.
    #[error("another recorder is writing {}; wait for it, stop it, or choose another file", path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
    /// The log file cannot be made.
    #[error("cannot write {}: {source}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The log of --resume cannot be used.
    #[error(transparent)]
    Resume(#[from] LogError),
    /// The bus could not be joined, or the recording was stopped before anything came.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The recording came to a bad end; the log was finished with what had come until then.
    #[error("{cause}; {} was closed with {saved}", path.display())]
    Ended {
        /// The file.
        path: PathBuf,
        /// What it holds.
        saved: Saved,
        /// Why.
        cause: Box<Cause>,
    },
    /// The file took no more bytes: a full disk, most often. The log was not finished, but what is named can
    /// be read.
    #[error(
        "cannot write {}: {source}; {saved} in it are safe: `chainmail recover` makes a whole log of them",
        path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// What it holds for certain.
        saved: Saved,
        /// The system's reason.
        source: io::Error,
    },
}

/// Why a recording ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum Cause {
    /// A process was lost.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The log of --resume is damaged.
    #[error(transparent)]
    Resume(#[from] LogError),
    /// A message has no place in the log.
    #[error(transparent)]
    Order(#[from] OrderError),
    /// A message breaks a promise of the log, or the file took no more bytes.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The streams ended, but something is missing.
    #[error("{0}")]
    Missing(String),
}

impl RecordError {
    /// The process's exit code: 2 for bad input, 3 for a log that is not what it should be.
    pub fn exit_code(&self) -> u8 {
        match self {
            RecordError::Exists { .. }
            | RecordError::Busy { .. }
            | RecordError::Create { .. }
            | RecordError::Resume(_) => 2,
            RecordError::Bus(error) => error.exit_code(),
            _ => 3,
        }
    }
}

/// What is in a log, in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Saved(pub Counts);

impl std::fmt::Display for Saved {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Counts { step_records, states, frames, .. } = self.0;
        let plural = |count| if count == 1 { "" } else { "s" };
        write!(f, "{step_records} step record{}, ", plural(step_records))?;
        write!(f, "{states} state{} and {frames} frame{}", plural(states), plural(frames))
    }
}

/// Records one run: waits for the other processes, writes until they end, and finishes the log.
///
/// When `stop` is set, by a signal handler, recording goes on until the simulator has ended its topics, but
/// not for much more than a second. A process that is killed ends the recording as quickly.
///
/// # Errors
///
/// [`RecordError`]. Unless the file itself cannot be written, the log is finished properly even then.
pub fn record(
    options: &RecordOptions,
    stop: Arc<AtomicBool>,
    progress: &mut dyn FnMut(Progress),
) -> Result<Recorded, RecordError> {
    let path = options.out.clone();
    let earlier = options.resume.as_deref().map(Log::open).transpose()?;
    let target = match Target::open(&path, options.force) {
        Ok(target) => target,
        Err(Refusal::Exists) => return Err(RecordError::Exists { path }),
        Err(Refusal::Busy) => return Err(RecordError::Busy { path }),
        Err(Refusal::Io(source)) => return Err(RecordError::Create { path, source }),
    };
    let mut inlets = Vec::new();
    let connected = Bus::join(&options.bus, Role::Recorder, Arc::clone(&stop)).and_then(|bus| {
        inlets = open_inlets(&bus, !options.no_render)?;
        progress(Progress::Waiting);
        let mut subscribers: Vec<&mut Subscriber> =
            inlets.iter_mut().map(|inlet| &mut inlet.subscriber).collect();
        bus.handshake(&mut [], &mut subscribers)?;
        Ok(bus)
    });
    let bus = match connected {
        Ok(bus) => bus,
        Err(error) => {
            target.abandon();
            return Err(error.into());
        }
    };
    let mut recording = Recording::start(path, target, !options.no_render)?;
    let begun = match (&earlier, options.from_step) {
        (Some(log), Some(step)) => recording.go_on_from(log, step),
        _ => Ok(()),
    };
    let ended = begun.and_then(|()| recording.receive_all(&bus, &mut inlets, &stop, progress));
    recording.conclude(ended)
}

/// A topic's subscriber, and whether its stream is over.
struct Inlet {
    kind: Kind,
    subscriber: Subscriber,
    is_over: bool,
}

/// Frames are looked at first: they must never wait behind states.
const INLET_ORDER: [Kind; 6] =
    [Kind::Frame, Kind::FrameInfo, Kind::Scene, Kind::State, Kind::Step, Kind::End];

fn open_inlets(bus: &Bus, renderer: bool) -> Result<Vec<Inlet>, BusError> {
    let kinds = INLET_ORDER.into_iter().filter(|kind| renderer || !kind.is_rendered());
    let open = |kind: Kind| {
        let subscriber = Subscriber::open(bus, topic_of(kind))?;
        Ok(Inlet { kind, subscriber, is_over: false })
    };
    kinds.map(open).collect()
}

fn topic_of(kind: Kind) -> &'static Topic {
    let is_of_kind = |topic: &&&Topic| topic.channel == Some(kind.channel());
    TOPICS.iter().find(is_of_kind).expect("every channel has a topic, which a test of `message` holds")
}

/// A log that is being written.
struct Recording {
    path: PathBuf,
    /// A second handle, to sync what the writer has written; `None` for what can be neither synced nor written over.
    file: Option<File>,
    writer: LogWriter<File>,
    sequencer: Sequencer<'static>,
    /// The scene of the log that this one goes on from.
    scene: Option<Vec<u8>>,
    step_count: u64,
    outcome: Option<Outcome>,
    flush_every: Duration,
    flushed_at: Instant,
    flushed_bytes: u64,
}

impl Recording {
    fn start(path: PathBuf, target: Target, renderer: bool) -> Result<Recording, RecordError> {
        let begin = || -> Result<_, WriteError> {
            let (file, handle) = target.begin()?;
            Ok((handle, LogWriter::create(file, renderer)?))
        };
        match begin() {
            Ok((file, writer)) => Ok(Recording {
                path,
                file,
                writer,
                sequencer: Sequencer::new(renderer),
                scene: None,
                step_count: 0,
                outcome: None,
                flush_every: Duration::from_secs_f64(Record::FLUSH_EVERY_S),
                flushed_at: Instant::now(),
                flushed_bytes: 0,
            }),
            Err(error) => Err(failed(path, Saved(Counts::default()), error)),
        }
    }

    /// Takes over what a log holds up to a step.
    fn go_on_from(&mut self, log: &Log, last_step: u64) -> Result<(), Cause> {
        for message in resume::messages(log, last_step)? {
            let message = message?;
            self.note(message.kind, &message.bytes);
            if message.kind == Kind::Scene {
                self.scene = Some(message.bytes.to_vec());
            }
            let bytes = message.bytes.into_owned();
            self.sequencer.push(Message::new(message.kind, message.log_time_ns, bytes))?;
            self.write_what_is_due()?;
        }
        Ok(())
    }

    /// Receives and writes until every stream is over, or until there is a reason to end before that.
    fn receive_all(
        &mut self,
        bus: &Bus,
        inlets: &mut [Inlet],
        stop: &AtomicBool,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<(), Cause> {
        let mut lost: Option<BusError> = None;
        let mut deadline: Option<Instant> = None;
        loop {
            let mut received = false;
            for inlet in inlets.iter_mut().filter(|inlet| !inlet.is_over) {
                match self.receive(inlet) {
                    Ok(any) => received |= any,
                    Err(Cause::Bus(error @ BusError::PeerLost { .. })) => {
                        self.close(inlet)?;
                        lost.get_or_insert(error);
                    }
                    Err(cause) => return Err(cause),
                }
            }
            let frames = self.writer.counts().frames;
            let step = self.writer.counts().step_records.saturating_sub(1);
            if received {
                progress(Progress::Recording { step, step_count: self.step_count, frames });
            }
            self.flush_if_due()?;
            if inlets.iter().all(|inlet| inlet.is_over) {
                return lost.map_or(Ok(()), |error| Err(error.into()));
            }
            if deadline.is_none() && (lost.is_some() || stop.load(Ordering::Relaxed)) {
                deadline = Some(Instant::now() + PATIENCE);
            }
            if deadline.is_some_and(|deadline| Instant::now() > deadline) {
                for inlet in inlets.iter_mut() {
                    self.close(inlet)?;
                }
                let stopped = || Cause::Missing("stopped before the simulator had ended".to_owned());
                return Err(lost.map_or_else(stopped, Cause::Bus));
            }
            if !received {
                bus.wait(PATIENCE)?;
            }
        }
    }

    /// Takes what a topic has and the log can place; says whether there was anything.
    fn receive(&mut self, inlet: &mut Inlet) -> Result<bool, Cause> {
        let mut received = false;
        while !inlet.is_over && self.sequencer.wants(inlet.kind) {
            match inlet.subscriber.receive()? {
                Received::Nothing => break,
                Received::End { .. } => self.close(inlet)?,
                // The log has this message already.
                Received::Message(message) if inlet.kind == Kind::Scene && self.scene.is_some() => {
                    if self.scene.as_ref() != Some(&message.bytes) {
                        return Err(Cause::Missing("the simulator goes on from another log".to_owned()));
                    }
                }
                Received::Message(message) => {
                    self.note(inlet.kind, &message.bytes);
                    let message = Message::new(inlet.kind, message.log_time_ns, message.bytes);
                    self.sequencer.push(message)?;
                    self.write_what_is_due()?;
                }
            }
            received = true;
        }
        Ok(received)
    }

    fn close(&mut self, inlet: &mut Inlet) -> Result<(), Cause> {
        inlet.is_over = true;
        self.sequencer.close(inlet.kind);
        self.write_what_is_due()
    }

    /// Keeps what the progress and the report need; a message that does not parse is refused elsewhere.
    fn note(&mut self, kind: Kind, bytes: &[u8]) {
        if kind == Kind::Scene
            && let Ok(record) = serde_json::from_slice::<SceneRecord>(bytes)
        {
            self.step_count = record.scene.time.step_count();
            // A scene from elsewhere may say anything; the default is as good.
            self.flush_every =
                Duration::try_from_secs_f64(record.scene.record.flush_every_s).unwrap_or(self.flush_every);
        }
        if kind == Kind::End
            && let Ok(end) = wire::decode::<End>(bytes)
        {
            self.outcome = Some(end.outcome);
        }
    }

    fn write_what_is_due(&mut self) -> Result<(), Cause> {
        while let Some(message) = self.sequencer.next()? {
            self.writer.write(&message)?;
        }
        Ok(())
    }

    /// Brings what has been written to the disk, the chunk in progress included, when it is time to.
    fn flush_if_due(&mut self) -> Result<(), WriteError> {
        let bytes = self.writer.bytes();
        let is_due =
            self.flushed_at.elapsed() >= self.flush_every || bytes - self.flushed_bytes >= FLUSH_BYTES;
        if let Some(file) = &self.file
            && is_due
        {
            if bytes > self.flushed_bytes {
                self.writer.flush()?;
                file.sync_data()?;
                self.flushed_bytes = bytes;
            }
            self.flushed_at = Instant::now();
        }
        Ok(())
    }

    /// Finishes the log and says what became of it.
    fn conclude(self, ended: Result<(), Cause>) -> Result<Recorded, RecordError> {
        let (path, has_end, outcome) = (self.path, self.writer.has_end(), self.outcome);
        let certain = Saved(self.writer.saved());
        let pending = self.sequencer.pending_count();
        let cause = match ended {
            Err(Cause::Write(error @ WriteError::Io(_))) => {
                return Err(failed(path, certain, error));
            }
            Err(cause) => Some(cause),
            Ok(()) => None,
        };
        let file = self.file;
        let finished = self.writer.finish().and_then(|(_, written)| {
            file.map_or(Ok(()), |file| file.sync_all())?;
            Ok(written)
        });
        let written = match finished {
            Ok(written) => written,
            Err(error) => return Err(failed(path, certain, error)),
        };
        let was_stopped = matches!(cause, Some(Cause::Missing(_)));
        let missing = match &outcome {
            _ if cause.is_some() && !(was_stopped && has_end) => cause,
            None => Some(Cause::Missing("the simulator ended its topics without an end record".to_owned())),
            // Then the renderer may have stopped before its last frames.
            Some(Outcome::Interrupted) if has_end => None,
            _ if written.frames_missing > 0 => {
                Some(Cause::Missing(format!("{} frames never came", written.frames_missing)))
            }
            _ if pending > 0 || !has_end => {
                Some(Cause::Missing(format!("{pending} messages had no place in the log")))
            }
            _ => None,
        };
        match (missing, outcome) {
            (None, Some(outcome)) => Ok(Recorded { written, outcome }),
            (cause, _) => {
                let cause = cause.unwrap_or_else(|| Cause::Missing("nothing came".to_owned()));
                Err(RecordError::Ended { path, saved: Saved(written.counts), cause: Box::new(cause) })
            }
        }
    }
}

/// The error of a file that takes no more bytes.
fn failed(path: PathBuf, saved: Saved, error: WriteError) -> RecordError {
    let source = match error {
        WriteError::Io(error) => error,
        error => io::Error::other(error.to_string()),
    };
    RecordError::Write { path, saved, source }
}

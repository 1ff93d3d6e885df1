//! Reading a log: finished ones through their index, others up to the damage.

use crate::check::Checker;
use crate::fault::{Health, LogError, LogProblem};
use crate::index::{Entries, Entry, Index, index_of};
use crate::message::{Kind, Message};
use prost::Message as _;
use schemas::end::End;
use schemas::frame::{CompressedImage, FrameInfo};
use schemas::scene::SceneRecord;
use schemas::state::{self, StateMessage};
use schemas::step::StepRecord;
use schemas::wire;
use std::fs::File;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The bytes of a log, mapped or held.
enum Bytes {
    Mapped(memmap2::Mmap),
    Held(Vec<u8>),
}

impl std::ops::Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Bytes::Mapped(map) => map,
            Bytes::Held(bytes) => bytes,
        }
    }
}

/// An opened log.
///
/// Only the index is read on opening (a log without one is scanned), and what is held is a line a chunk, however many
/// messages there are. A chunk's checksum is compared when the first message in it is asked for, so what is handed out is
/// what was written.
///
/// The file must not be cut short while it is open: it is mapped into memory.
pub struct Log {
    file: String,
    bytes: Bytes,
    index: Index,
    /// Chunks whose checksum has been found right.
    checked: Vec<AtomicBool>,
    /// Where the messages lie in the chunks that were walked through last.
    walked: Mutex<Vec<(usize, Arc<Entries>)>>,
    /// The first damage that reading has found in a log whose index is whole.
    found: OnceLock<Health>,
}

impl Log {
    /// Opens a log file.
    ///
    /// # Errors
    ///
    /// [`LogError`] if it cannot be read at all, is no log, or has another state layout. A log that is cut
    /// short or damaged opens: see [`Log::health`].
    pub fn open(path: &Path) -> Result<Log, LogError> {
        let file = path.display().to_string();
        match map(path) {
            Ok(map) => Log::new(file, Bytes::Mapped(map)),
            Err(error) => Err(LogError { file, problem: error.into() }),
        }
    }

    /// Opens a log that is in memory; `name` stands for the file in messages.
    ///
    /// # Errors
    ///
    /// As [`Log::open`].
    pub fn from_bytes(name: &str, bytes: Vec<u8>) -> Result<Log, LogError> {
        Log::new(name.to_owned(), Bytes::Held(bytes))
    }

    fn new(file: String, bytes: Bytes) -> Result<Log, LogError> {
        match index_of(&bytes) {
            Ok((index, are_checked)) => {
                let checked = index.chunks.iter().map(|_| AtomicBool::new(are_checked)).collect();
                Ok(Log { file, bytes, index, checked, walked: Mutex::default(), found: OnceLock::new() })
            }
            Err(problem) => Err(LogError { file, problem }),
        }
    }

    /// The file's path, or the name given to the bytes.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Size of the file in bytes.
    pub fn file_bytes(&self) -> u64 {
        self.bytes.len() as u64
    }

    /// How whole it is, as far as it has been read: [`Log::check`] makes the answer final.
    pub fn health(&self) -> Health {
        match &self.index.damage {
            None => match self.found.get() {
                Some(found) => found.clone(),
                None if self.count(Kind::End) == 0 => Health::Unfinished,
                None => Health::Complete,
            },
            Some(damage) if damage.cut => Health::Truncated { offset: damage.offset },
            Some(damage) => Health::Damaged { offset: damage.offset, what: damage.what.clone() },
        }
    }

    /// Whether it was recorded with a renderer.
    pub fn has_renderer(&self) -> bool {
        self.index.has_renderer
    }

    /// How many messages a channel has.
    pub fn count(&self, kind: Kind) -> usize {
        self.index.count(kind) as usize
    }

    /// All messages, in the order in which they lie in the file.
    pub fn messages(&self) -> impl ExactSizeIterator<Item = Result<Message<'_>, LogError>> {
        let count = Kind::ALL.into_iter().map(|kind| self.count(kind)).sum();
        let (mut chunk, mut entries, mut next) = (0, None, 0);
        (0..count).map(move |_| {
            loop {
                let walked: &Arc<Entries> = match &entries {
                    Some(walked) => walked,
                    None => {
                        self.check_chunk(chunk)?;
                        entries.insert(self.entries(chunk))
                    }
                };
                if let Some(&entry) = walked.all.get(next) {
                    next += 1;
                    return self
                        .index
                        .message(&self.bytes, chunk, entry)
                        .map_err(|damage| self.error(damage));
                }
                if let Some(damage) = &walked.damage {
                    return Err(self.error(damage.clone()));
                }
                (chunk, entries, next) = (chunk + 1, None, 0);
            }
        })
    }

    /// A channel's message by its number, from 0.
    ///
    /// # Errors
    ///
    /// [`LogProblem::Missing`] if there is none, [`LogProblem::Damaged`] if its bytes were altered.
    pub fn nth(&self, kind: Kind, index: usize) -> Result<Message<'_>, LogError> {
        let (chunk, entry) = self.entry(kind, index, true)?;
        self.index.message(&self.bytes, chunk, entry).map_err(|damage| self.error(damage))
    }

    /// As [`Log::nth`], without comparing the chunk's checksum: to look at what damage did.
    pub(crate) fn nth_unchecked(&self, kind: Kind, index: usize) -> Result<Message<'_>, LogError> {
        let (chunk, entry) = self.entry(kind, index, false)?;
        self.index.message(&self.bytes, chunk, entry).map_err(|damage| self.error(damage))
    }

    /// The scene record, every value of the scene checked.
    ///
    /// # Errors
    ///
    /// [`LogError`] if it is not there, does not parse, or is none that a scene file could have made.
    pub fn scene(&self) -> Result<SceneRecord, LogError> {
        let record: SceneRecord = self.json(Kind::Scene, 0)?;
        record.scene.validate().map_err(|error| self.record_error(Kind::Scene, 0, error))?;
        Ok(record)
    }

    /// The step record of a step.
    ///
    /// # Errors
    ///
    /// [`LogError`] if it is not there or does not parse.
    pub fn step(&self, step: u64) -> Result<StepRecord, LogError> {
        // Step records are numbered by their steps: `check` and the writer hold that.
        self.json(Kind::Step, usize::try_from(step).unwrap_or(usize::MAX))
    }

    /// All step records, from step 0.
    pub fn steps(&self) -> impl ExactSizeIterator<Item = Result<StepRecord, LogError>> {
        (0..self.count(Kind::Step)).map(|index| self.json(Kind::Step, index))
    }

    /// All states, hash checked.
    pub fn states(&self) -> impl ExactSizeIterator<Item = Result<StateMessage, LogError>> {
        (0..self.count(Kind::State)).map(|index| {
            let message = self.nth(Kind::State, index)?;
            state::decode(&message.bytes).map_err(|error| self.record_error(Kind::State, index, error))
        })
    }

    /// The state after a step, hash checked; `None` if the log keeps none of that step.
    ///
    /// # Errors
    ///
    /// [`LogError`] if states cannot be read.
    pub fn state(&self, step: u64) -> Result<Option<StateMessage>, LogError> {
        let Some(index) = self.state_index(step)? else { return Ok(None) };
        let message = self.nth(Kind::State, index)?;
        let state = state::decode(&message.bytes);
        state.map(Some).map_err(|error| self.record_error(Kind::State, index, error))
    }

    /// The last state that the log keeps up to a step, hash checked; `None` without one.
    ///
    /// # Errors
    ///
    /// [`LogError`] if states cannot be read.
    pub fn state_at_or_before(&self, step: u64) -> Result<Option<StateMessage>, LogError> {
        let (mut low, mut high) = (0, self.count(Kind::State));
        while low < high {
            let middle = low + (high - low) / 2;
            if self.state_step(middle)? <= step {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        let Some(index) = low.checked_sub(1) else { return Ok(None) };
        let message = self.nth(Kind::State, index)?;
        let state = state::decode(&message.bytes);
        state.map(Some).map_err(|error| self.record_error(Kind::State, index, error))
    }

    /// The message of the state after a step, as it was on the bus; `None` if the log keeps none of that step.
    ///
    /// # Errors
    ///
    /// [`LogError`] if states cannot be read.
    pub fn state_message(&self, step: u64) -> Result<Option<Message<'_>>, LogError> {
        self.state_index(step)?.map(|index| self.nth(Kind::State, index)).transpose()
    }

    /// The message of a step record, as it was on the bus.
    ///
    /// # Errors
    ///
    /// [`LogError`] if it is not there.
    pub fn step_message(&self, step: u64) -> Result<Message<'_>, LogError> {
        self.nth(Kind::Step, usize::try_from(step).unwrap_or(usize::MAX))
    }

    /// Which of the state messages is that of a step, by bisection.
    pub(crate) fn state_index(&self, step: u64) -> Result<Option<usize>, LogError> {
        let (mut low, mut high) = (0, self.count(Kind::State));
        while low < high {
            let middle = low + (high - low) / 2;
            let got = self.state_step(middle)?;
            match got.cmp(&step) {
                std::cmp::Ordering::Equal => return Ok(Some(middle)),
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
            }
        }
        Ok(None)
    }

    /// The step that a state message names.
    pub(crate) fn state_step(&self, index: usize) -> Result<u64, LogError> {
        let message = self.nth_unchecked(Kind::State, index)?;
        match state::decode_header(&message.bytes) {
            Ok(header) => Ok(header.step),
            Err(error) => Err(self.record_error(Kind::State, index, error)),
        }
    }

    /// A frame's picture, by its number from 0.
    ///
    /// # Errors
    ///
    /// [`LogError`] if it is not there or does not parse.
    pub fn frame(&self, index: usize) -> Result<CompressedImage, LogError> {
        let message = self.nth(Kind::Frame, index)?;
        CompressedImage::decode(&message.bytes[..])
            .map_err(|error| self.record_error(Kind::Frame, index, error))
    }

    /// What a frame shows, by its number from 0.
    ///
    /// # Errors
    ///
    /// [`LogError`] if it is not there or does not parse.
    pub fn frame_info(&self, index: usize) -> Result<FrameInfo, LogError> {
        self.json(Kind::FrameInfo, index)
    }

    /// The end record; `None` if the log has none.
    ///
    /// # Errors
    ///
    /// [`LogError`] if it does not parse.
    pub fn end(&self) -> Result<Option<End>, LogError> {
        if self.count(Kind::End) == 0 {
            return Ok(None);
        }
        let message = self.nth(Kind::End, 0)?;
        wire::decode(&message.bytes).map(Some).map_err(|error| self.record_error(Kind::End, 0, error))
    }

    /// Refuses a log of another program version: for acts that promise the same bits.
    ///
    /// # Errors
    ///
    /// [`LogProblem::Version`] with both versions.
    pub fn require_same_version(&self) -> Result<(), LogError> {
        let found = self.scene()?.version;
        let expected = env!("CARGO_PKG_VERSION").to_owned();
        if found == expected { Ok(()) } else { Err(self.error(LogProblem::Version { found, expected })) }
    }

    /// Reads every byte: all checksums, hashes and promises. `visit` sees each message, with its parsed
    /// step record if it is one.
    ///
    /// # Errors
    ///
    /// The first thing that is wrong, with the messages before it visited. A log that is cut short is wrong
    /// after its last whole message; so is one without an end record.
    pub fn check(
        &self,
        visit: &mut dyn FnMut(&Message<'_>, Option<&StepRecord>),
    ) -> Result<Checker, LogError> {
        let checked = self.check_all(visit);
        if let Err(error) = &checked
            && !matches!(error.problem, LogProblem::Missing { kind: Kind::End, .. })
        {
            self.found.get_or_init(|| Health::from(&error.problem));
        }
        checked
    }

    fn check_all(
        &self,
        visit: &mut dyn FnMut(&Message<'_>, Option<&StepRecord>),
    ) -> Result<Checker, LogError> {
        let mut checker = Checker::new(self.has_renderer());
        for message in self.messages() {
            let message = message?;
            let step = checker.check(&message).map_err(|error| self.error(error))?;
            visit(&message, step.as_ref());
        }
        if let Some(damage) = &self.index.damage {
            return Err(self.error(damage.clone()));
        }
        self.index.check_data(&self.bytes).map_err(|damage| self.error(damage))?;
        if checker.end().is_none() {
            return Err(self.error(LogProblem::Missing { kind: Kind::End, index: 0, count: 0 }));
        }
        Ok(checker)
    }

    /// Where a message lies: its chunk, and its place there.
    fn entry(&self, kind: Kind, index: usize, is_checked: bool) -> Result<(usize, Entry), LogError> {
        let missing = || self.error(LogProblem::Missing { kind, index, count: self.count(kind) });
        let (chunk, nth) = self.index.place(kind, index as u64).ok_or_else(missing)?;
        if is_checked {
            self.check_chunk(chunk)?;
        }
        let entries = self.entries(chunk);
        match entries.by_kind[kind.index()].get(nth as usize) {
            Some(&place) => Ok((chunk, entries.all[place as usize])),
            None => Err(entries.damage.clone().map_or_else(missing, |damage| self.error(damage))),
        }
    }

    /// Where the messages of a chunk lie. The last few are remembered: one asks for neighbours.
    fn entries(&self, chunk: usize) -> Arc<Entries> {
        const REMEMBERED: usize = 8;
        let lock = || self.walked.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, entries)) = lock().iter().find(|(number, _)| *number == chunk) {
            return Arc::clone(entries);
        }
        let entries = Arc::new(self.index.entries(&self.bytes, chunk));
        let mut walked = lock();
        if walked.len() == REMEMBERED {
            walked.remove(0);
        }
        walked.push((chunk, Arc::clone(&entries)));
        entries
    }

    /// Compares a chunk's checksum, once.
    pub(crate) fn check_chunk(&self, number: usize) -> Result<(), LogError> {
        // Relaxed: the flag only saves work; the bytes do not change.
        if !self.checked[number].load(Ordering::Relaxed) {
            self.index.check_chunk(&self.bytes, number).map_err(|damage| self.error(damage))?;
            self.checked[number].store(true, Ordering::Relaxed);
        }
        Ok(())
    }

    /// The number of the chunk in which a message lies, and which of the chunk's messages of its kind it is.
    pub(crate) fn place(&self, kind: Kind, index: usize) -> Option<(usize, u64)> {
        self.index.place(kind, index as u64)
    }

    /// The records of a chunk, and the checksum that its head gives for them; not compared.
    pub(crate) fn chunk(&self, number: usize) -> (&[u8], u32) {
        let place = self.index.chunks[number];
        (&self.bytes[place.start()..place.end], self.index.crc(&self.bytes, number))
    }

    /// How many chunks have been read and found to be as they were written, and how many there are.
    pub fn chunks_checked(&self) -> (usize, usize) {
        // Relaxed: a count of what has been done so far.
        let checked = self.checked.iter().filter(|checked| checked.load(Ordering::Relaxed)).count();
        (checked, self.checked.len())
    }

    fn json<T: serde::de::DeserializeOwned>(&self, kind: Kind, index: usize) -> Result<T, LogError> {
        let message = self.nth(kind, index)?;
        serde_json::from_slice(&message.bytes).map_err(|error| self.record_error(kind, index, error))
    }

    fn record_error(&self, kind: Kind, index: usize, reason: impl std::fmt::Display) -> LogError {
        let offset = self.entry(kind, index, false).map_or(0, |(_, entry)| entry.offset);
        self.error(LogProblem::Record { kind, index, offset, reason: reason.to_string() })
    }

    fn error(&self, problem: impl Into<LogProblem>) -> LogError {
        LogError { file: self.file.clone(), problem: problem.into() }
    }
}

/// Maps a file into memory.
#[expect(
    unsafe_code,
    reason = "a mapping is only sound while nobody cuts the file short, which its doc says"
)]
pub(crate) fn map(path: &Path) -> std::io::Result<memmap2::Mmap> {
    let file = File::open(path)?;
    if file.metadata()?.is_dir() {
        return Err(std::io::Error::other("a folder; give the log file in it"));
    }
    // SAFETY: the map is read-only and private to this process; logs are only ever appended to.
    unsafe { memmap2::Mmap::map(&file) }
}

//! What a log promises, checked message by message: while it is written, and again when it is read.
//!
//! Steps come one after the other, each state lies right before its step record, bytes hash to what they
//! claim, the chain of hashes holds, log times are the simulated times, frames show the keyframes, and the
//! end record counts what is there.

use crate::message::{Kind, Message};
use prost::Message as _;
use schemas::end::End;
use schemas::frame::{CompressedImage, FrameInfo};
use schemas::scene::{Scene, SceneRecord};
use schemas::state::{BodyState, ContactState, StateHeader};
use schemas::step::StepRecord;
use schemas::{Hash, chain, log_time_ns, state, wire};
use serde::Serialize;
use std::collections::VecDeque;

/// A message that breaks a promise of the log.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// Not the record that its channel holds. JSON has no NaN or infinity: a record with one ends here too.
    #[error("{kind} message {index} is not a valid record: {reason}")]
    Malformed {
        /// The channel.
        kind: Kind,
        /// Which of its messages, from 0.
        index: u64,
        /// What the parser said.
        reason: String,
    },
    /// A message where another one should be.
    #[error("{kind} message {index}: {got}, where {expected} was expected")]
    Place {
        /// The channel.
        kind: Kind,
        /// Which of its messages, from 0.
        index: u64,
        /// What is wrong about its place.
        got: String,
        /// What would be right.
        expected: String,
    },
    /// A hash that is not that of the data.
    #[error("step {step}: the {what} is {saved}, but {calculated} was calculated")]
    Hash {
        /// The step.
        step: u64,
        /// Which hash.
        what: &'static str,
        /// The hash in the message.
        saved: String,
        /// The hash that it should be.
        calculated: String,
    },
    /// A log time that is not the simulated time.
    #[error("{kind} message {index} has log time {got} ns, but its simulated time is {expected} ns")]
    LogTime {
        /// The channel.
        kind: Kind,
        /// Which of its messages, from 0.
        index: u64,
        /// The message's log time.
        got: u64,
        /// The log time of its simulated time.
        expected: u64,
    },
    /// The end record counts something else than what is in the log.
    #[error("the end record counts {expected} {what}, but the log has {got}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// The end record's count.
        expected: u64,
        /// The log's count.
        got: u64,
    },
    /// Another layout of the state bytes.
    #[error(
        "the log's state layout is {found}, this program's is {expected}: use the version that wrote the log"
    )]
    Layout {
        /// The layout hash in the log.
        found: String,
        /// This program's.
        expected: String,
    },
}

/// How much is in a log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Step records, that of step 0 included.
    pub step_records: u64,
    /// Full states.
    pub states: u64,
    /// Bytes of the state messages.
    pub state_bytes: u64,
    /// Frames with their info.
    pub frames: u64,
}

/// Checks the messages of a log in their order.
#[derive(Debug, Default)]
pub struct Checker {
    renderer: bool,
    scene: Option<Scene>,
    counts: Counts,
    /// The state that waits for its step record.
    state: Option<StateHeader>,
    chained_hash: Hash,
    /// Keyframes whose frame has not come yet: step and state hash.
    keyframes: VecDeque<(u64, Hash)>,
    keyframe_count: u64,
    /// The log time of the frame that waits for its info.
    frame: Option<u64>,
    end: Option<End>,
}

impl Checker {
    /// Before the first message; with `renderer`, the log has frames.
    pub fn new(renderer: bool) -> Checker {
        Checker { renderer, ..Checker::default() }
    }

    /// What has passed so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The end record, once it has passed.
    pub fn end(&self) -> Option<&End> {
        self.end.as_ref()
    }

    /// The chained hash of the steps so far; zeros before the first.
    pub fn chained_hash(&self) -> Hash {
        self.chained_hash
    }

    /// Frames that the end record promises and that are not there; 0 as long as it has not come.
    pub fn frames_missing(&self) -> u64 {
        match &self.end {
            Some(end) if self.renderer => end.keyframe_count.saturating_sub(self.counts.frames),
            _ => 0,
        }
    }

    /// Whether a step is one of those that the scene takes a frame of.
    pub fn is_keyframe(&self, step: u64) -> bool {
        self.scene.as_ref().is_some_and(|scene| scene.time.frame_at(step).is_some())
    }

    /// Checks one message. Returns its parsed step record, if it is one.
    ///
    /// # Errors
    ///
    /// [`CheckError`]: the message, and what is wrong with it. After an error the checker is of no use.
    pub fn check(&mut self, message: &Message) -> Result<Option<StepRecord>, CheckError> {
        let kind = message.kind;
        if self.end.is_some() {
            return Err(self.misplaced(kind, "it comes after /end", "nothing"));
        }
        if kind != Kind::Scene && self.scene.is_none() {
            return Err(self.misplaced(kind, "it comes first", "/scene"));
        }
        match kind {
            Kind::Scene => self.check_scene(message)?,
            Kind::State => self.check_state(message)?,
            Kind::Step => return self.check_step(message).map(Some),
            Kind::Frame => self.check_frame(message)?,
            Kind::FrameInfo => self.check_frame_info(message)?,
            Kind::End => self.check_end(message)?,
        }
        Ok(None)
    }

    fn check_scene(&mut self, message: &Message) -> Result<(), CheckError> {
        if self.scene.is_some() {
            return Err(self.misplaced(Kind::Scene, "it is the second", "one /scene message"));
        }
        let record: SceneRecord = self.parse(message)?;
        if record.layout_hash != state::layout_hash() {
            let (found, expected) = (record.layout_hash.to_string(), state::layout_hash().to_string());
            return Err(CheckError::Layout { found, expected });
        }
        self.scene = Some(record.scene);
        Ok(())
    }

    fn check_state(&mut self, message: &Message) -> Result<(), CheckError> {
        let index = self.counts.states;
        let header = state::decode_header(&message.bytes).map_err(|error| self.malformed(message, error))?;
        if header.step != self.counts.step_records || self.state.is_some() {
            let expected = format!("step {}, once", self.counts.step_records);
            return Err(self.misplaced(Kind::State, &format!("it is of step {}", header.step), &expected));
        }
        if let Some(scene) = &self.scene
            && let Err(reason) = check_lengths(&message.bytes, scene.body_count())
        {
            return Err(self.malformed(message, reason));
        }
        let calculated = state::hash_of(&message.bytes);
        if header.state_hash != calculated {
            return Err(hash_error(header.step, "state hash", &header.state_hash, &calculated));
        }
        check_log_time(message, index, header.sim_time_s)?;
        self.counts.states += 1;
        self.counts.state_bytes += message.bytes.len() as u64;
        self.state = Some(header);
        Ok(())
    }

    fn check_step(&mut self, message: &Message) -> Result<StepRecord, CheckError> {
        let step = self.counts.step_records;
        let record: StepRecord = self.parse(message)?;
        if record.step != step {
            let got = format!("it is of step {}", record.step);
            return Err(self.misplaced(Kind::Step, &got, &format!("step {step}")));
        }
        check_log_time(message, step, record.sim_time_s)?;
        match self.state.take() {
            Some(header) if header.state_hash != record.state_hash => {
                let what = "state hash of the step record";
                return Err(hash_error(step, what, &record.state_hash, &header.state_hash));
            }
            None if self.state_is_scheduled(step) => {
                let expected = format!("the state of step {step}");
                return Err(self.misplaced(Kind::Step, "no state lies before it", &expected));
            }
            _ => {}
        }
        let short = record.state_hash.short();
        if record.stages.state != short {
            let (what, saved) = ("stage hash of the state", record.stages.state);
            return Err(CheckError::Hash { step, what, saved, calculated: short });
        }
        let chained = chain(&self.chained_hash, &record.state_hash);
        if record.chained_hash != chained {
            return Err(hash_error(step, "chained hash", &record.chained_hash, &chained));
        }
        self.chained_hash = chained;
        self.counts.step_records += 1;
        if self.is_keyframe(step) {
            self.keyframe_count += 1;
            if self.renderer {
                self.keyframes.push_back((step, record.state_hash));
            }
        }
        Ok(record)
    }

    fn check_frame(&mut self, message: &Message) -> Result<(), CheckError> {
        if self.frame.is_some() {
            return Err(self.misplaced(Kind::Frame, "a frame lies before it", "/frame_info"));
        }
        let image =
            CompressedImage::decode(&message.bytes[..]).map_err(|error| self.malformed(message, error))?;
        if image.format != "png" {
            let reason = format!("format \"{}\", where \"png\" was expected", image.format);
            return Err(self.malformed(message, reason));
        }
        self.frame = Some(message.log_time_ns);
        Ok(())
    }

    fn check_frame_info(&mut self, message: &Message) -> Result<(), CheckError> {
        let index = self.counts.frames;
        let Some(frame_time_ns) = self.frame.take() else {
            return Err(self.misplaced(Kind::FrameInfo, "no frame lies before it", "/frame"));
        };
        let info: FrameInfo = self.parse(message)?;
        check_log_time(message, index, info.sim_time_s)?;
        if frame_time_ns != message.log_time_ns {
            let (got, expected) = (frame_time_ns, message.log_time_ns);
            return Err(CheckError::LogTime { kind: Kind::Frame, index, got, expected });
        }
        match self.keyframes.pop_front() {
            Some((step, _)) if step != info.step => {
                let got = format!("it shows step {}", info.step);
                Err(self.misplaced(Kind::FrameInfo, &got, &format!("step {step}")))
            }
            Some((step, hash)) if hash != info.state_hash => {
                Err(hash_error(step, "state hash of the frame", &info.state_hash, &hash))
            }
            Some(_) => {
                self.counts.frames += 1;
                Ok(())
            }
            None => Err(self.misplaced(Kind::FrameInfo, "it is one too many", "as many frames as keyframes")),
        }
    }

    fn check_end(&mut self, message: &Message) -> Result<(), CheckError> {
        let end: End = wire::decode(&message.bytes).map_err(|error| self.malformed(message, error))?;
        let counts = [
            ("step records", end.step_count.saturating_add(1), self.counts.step_records),
            ("states", end.state_count, self.counts.states),
            ("keyframes", end.keyframe_count, self.keyframe_count),
        ];
        for (what, expected, got) in counts {
            if expected != got {
                return Err(CheckError::Count { what, expected, got });
            }
        }
        if end.chained_hash != self.chained_hash {
            let what = "chained hash of the end record";
            return Err(hash_error(end.step_count, what, &end.chained_hash, &self.chained_hash));
        }
        self.end = Some(end);
        Ok(())
    }

    fn state_is_scheduled(&self, step: u64) -> bool {
        self.scene.as_ref().is_some_and(|scene| scene.state_is_recorded(step))
    }

    fn parse<T: serde::de::DeserializeOwned>(&self, message: &Message) -> Result<T, CheckError> {
        serde_json::from_slice(&message.bytes).map_err(|error| self.malformed(message, error))
    }

    fn malformed(&self, message: &Message, reason: impl std::fmt::Display) -> CheckError {
        let kind = message.kind;
        CheckError::Malformed { kind, index: self.index(kind), reason: reason.to_string() }
    }

    fn misplaced(&self, kind: Kind, got: &str, expected: &str) -> CheckError {
        let (got, expected) = (got.to_owned(), expected.to_owned());
        CheckError::Place { kind, index: self.index(kind), got, expected }
    }

    /// How many messages of a kind have passed.
    fn index(&self, kind: Kind) -> u64 {
        match kind {
            Kind::Scene => u64::from(self.scene.is_some()),
            Kind::State => self.counts.states,
            Kind::Step => self.counts.step_records,
            Kind::Frame | Kind::FrameInfo => self.counts.frames,
            Kind::End => u64::from(self.end.is_some()),
        }
    }
}

/// Checks the two counts of a state message against its length and the scene, without reading the rest.
fn check_lengths(bytes: &[u8], body_count: usize) -> Result<(), String> {
    let count_at = |offset: usize| -> Result<u64, String> {
        let length = || format!("{} bytes end before the count at byte {offset}", bytes.len());
        let tail = bytes.get(offset..).and_then(|tail| tail.first_chunk()).ok_or_else(length)?;
        Ok(u64::from_le_bytes(*tail))
    };
    let bodies = count_at(size_of::<StateHeader>())?;
    if bodies != body_count as u64 {
        return Err(format!("it has {bodies} bodies, the scene has {body_count}"));
    }
    let contacts_at = size_of::<StateHeader>() + 8 + body_count * size_of::<BodyState>();
    let contacts = count_at(contacts_at)?;
    let expected =
        (contacts_at as u64 + 8).saturating_add(contacts.saturating_mul(size_of::<ContactState>() as u64));
    if bytes.len() as u64 != expected {
        let length = bytes.len();
        return Err(format!("{bodies} bodies and {contacts} contacts take {expected} bytes, not {length}"));
    }
    Ok(())
}

fn check_log_time(message: &Message, index: u64, sim_time_s: f64) -> Result<(), CheckError> {
    let expected = log_time_ns(sim_time_s);
    if message.log_time_ns != expected {
        return Err(CheckError::LogTime { kind: message.kind, index, got: message.log_time_ns, expected });
    }
    Ok(())
}

fn hash_error(step: u64, what: &'static str, saved: &Hash, calculated: &Hash) -> CheckError {
    CheckError::Hash { step, what, saved: saved.to_string(), calculated: calculated.to_string() }
}

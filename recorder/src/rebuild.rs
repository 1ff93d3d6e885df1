//! From what a broken file still holds to a new log, step by step.

use crate::container_writer::Sink;
use crate::message::{Kind, Message};
use crate::order::{OrderError, Sequencer};
use crate::recover::{BytesError, Recovery, Remake};
use crate::salvage::{Find, Salvage};
use crate::writer::{LogWriter, WriteError};
use schemas::end::{End, Outcome};
use schemas::scene::SceneRecord;
use schemas::step::StepRecord;
use schemas::{log_time_ns, state, wire};
use std::io;
use std::ops::Range;

/// A step record is JSON with long hashes: so many lost bytes held one step at the most.
const STEP_BYTES_MIN: u64 = 300;

/// What there is to make a log of, and how much of it may be taken.
pub(crate) struct Source<'a> {
    file: &'a [u8],
    found: Salvage,
    scene: Message<'a>,
    record: SceneRecord,
    /// The step records, by their step.
    steps: Vec<Find>,
    /// The states with their steps, in order.
    states: Vec<(u64, Find)>,
    /// Frames and infos in pairs, from the first without a gap.
    frames: Vec<(Find, Find)>,
    end: Option<End>,
    /// Whether the end record may be taken over.
    end_fits: bool,
    /// Steps from this one on are not taken.
    step_limit: u64,
    frame_limit: usize,
    remake_failed: Option<String>,
}

/// What came of one attempt to write the new log.
pub(crate) enum Attempt<W> {
    Done((W, Recovery)),
    /// A message breaks a promise of the log; less will be taken the next time.
    Refused,
}

/// Which steps the new log has.
struct Extent {
    last: u64,
    /// Steps to be made again; each is followed by one that is there.
    holes: Vec<Range<u64>>,
}

/// Why an attempt ended early.
enum Interruption {
    Io(io::Error),
    /// A message contradicts those before it.
    Refused(String),
    /// The steps from this one on cannot be made again.
    Remake(u64, String),
}

impl From<WriteError> for Interruption {
    fn from(error: WriteError) -> Interruption {
        match error {
            WriteError::Io(error) => Interruption::Io(error),
            WriteError::Check(error) => Interruption::Refused(error.to_string()),
        }
    }
}

impl From<OrderError> for Interruption {
    fn from(error: OrderError) -> Interruption {
        Interruption::Refused(error.to_string())
    }
}

/// The new log while it is written.
struct Output<'a, W: Sink> {
    writer: LogWriter<W>,
    sequencer: Sequencer<'a>,
    /// The kind of the message at hand.
    last_kind: Kind,
}

impl<'a, W: Sink> Output<'a, W> {
    fn push(&mut self, message: Message<'a>) -> Result<(), Interruption> {
        self.last_kind = message.kind;
        self.sequencer.push(message)?;
        Ok(())
    }

    fn write_what_is_due(&mut self) -> Result<(), Interruption> {
        loop {
            self.last_kind = Kind::State;
            let Some(message) = self.sequencer.next()? else { return Ok(()) };
            self.last_kind = message.kind;
            self.writer.write(&message)?;
        }
    }
}

impl<'a> Source<'a> {
    pub fn new(file: &'a [u8], found: Salvage) -> Result<Source<'a>, BytesError> {
        let nothing = |reason: &str| BytesError::Nothing(reason.to_owned());
        let scene = found.finds.iter().find(|find| find.kind == Kind::Scene);
        let scene = scene.ok_or_else(|| nothing("the scene, its first message, is not whole"))?;
        let scene = scene.message(file);
        let record: SceneRecord = serde_json::from_slice(&scene.bytes)
            .map_err(|error| nothing(&format!("the scene cannot be read: {error}")))?;
        record.scene.validate().map_err(|error| nothing(&format!("the scene is none: {error}")))?;
        let of_kind = |kind| found.finds.iter().copied().filter(move |find| find.kind == kind);
        let mut states: Vec<(u64, Find)> = Vec::new();
        for find in of_kind(Kind::State) {
            let step = state::decode_header(&find.message(file).bytes).ok().map(|header| header.step);
            // A state with a step that has passed has no place.
            if let Some(step) = step.filter(|&step| states.last().is_none_or(|&(last, _)| step > last)) {
                states.push((step, find));
            }
        }
        let pairs = of_kind(Kind::Frame).zip(of_kind(Kind::FrameInfo)).enumerate();
        let without_gap = pairs.map_while(|(number, (frame, info))| {
            (frame.number == number as u64 && info.number == number as u64).then_some((frame, info))
        });
        let frames: Vec<_> = without_gap.collect();
        let end = of_kind(Kind::End).next().and_then(|find| wire::decode(&find.message(file).bytes).ok());
        let steps = of_kind(Kind::Step).collect();
        Ok(Source {
            file,
            scene,
            record,
            steps,
            states,
            frame_limit: frames.len(),
            frames,
            end,
            end_fits: true,
            step_limit: u64::MAX,
            remake_failed: None,
            found,
        })
    }

    /// Writes the new log, as far as nothing contradicts.
    pub fn rebuild<W: Sink>(
        &mut self,
        sink: W,
        remake: &mut Option<&mut dyn Remake>,
    ) -> Result<Attempt<W>, BytesError> {
        let extent = self.extent(remake.is_some() && self.remake_failed.is_none())?;
        let end = self.end_of(&extent)?;
        let mut output = Output {
            writer: LogWriter::create(sink, self.found.has_renderer).map_err(io_of)?,
            sequencer: Sequencer::new(self.found.has_renderer),
            last_kind: Kind::Scene,
        };
        let filled = self.fill(&mut output, &extent, &end, remake);
        let counts = output.writer.counts();
        match filled {
            Ok(()) => {
                let (sink, written) = output.writer.finish().map_err(io_of)?;
                Ok(Attempt::Done((sink, self.report(&extent, end, written.counts))))
            }
            Err(Interruption::Io(error)) => Err(BytesError::Io(error)),
            Err(Interruption::Remake(from, reason)) => {
                (self.step_limit, self.remake_failed) = (from, Some(reason));
                Ok(Attempt::Refused)
            }
            Err(Interruption::Refused(reason)) => {
                let step = counts.step_records;
                let hole = extent.holes.iter().find(|hole| hole.start <= step && step <= hole.end);
                match output.last_kind {
                    Kind::Frame | Kind::FrameInfo => self.frame_limit = counts.frames as usize,
                    Kind::End if self.end_fits => self.end_fits = false,
                    Kind::State | Kind::Step if step > 0 => {
                        // What was made again is proven by the next step alone.
                        if hole.is_some() {
                            self.remake_failed = Some(format!("this program makes others: {reason}"));
                        }
                        self.step_limit = hole.map_or(step, |hole| hole.start);
                    }
                    _ => return Err(BytesError::Nothing(reason)),
                }
                Ok(Attempt::Refused)
            }
        }
    }

    /// How far the new log reaches: to the last step without a gap before it, but for gaps that can be filled.
    fn extent(&self, fills: bool) -> Result<Extent, BytesError> {
        let (mut next, mut holes, mut states) = (0, Vec::new(), self.states.iter().peekable());
        let mut lost_steps_max = self.bytes_lost() / STEP_BYTES_MIN;
        for step in self.steps.iter().map(|find| find.number).take_while(|&step| step < self.step_limit) {
            while states.next_if(|(of, _)| *of < step).is_some() {}
            let has_state = states.peek().is_some_and(|(of, _)| *of == step);
            if self.record.scene.state_is_recorded(step) && !has_state {
                continue;
            }
            let missing = step - next;
            if missing > 0 {
                if !fills || next == 0 || missing > lost_steps_max {
                    break;
                }
                lost_steps_max -= missing;
                holes.push(next..step);
            }
            next = step + 1;
        }
        if next == 0 {
            return Err(BytesError::Nothing("step 0 is not whole".to_owned()));
        }
        Ok(Extent { last: next - 1, holes })
    }

    /// The end of the new log: the broken one's, if the new one reaches it.
    fn end_of(&self, extent: &Extent) -> Result<End, BytesError> {
        let last = extent.last;
        if let Some(end) = &self.end
            && self.end_fits
            && end.step_count == last
        {
            return Ok(end.clone());
        }
        let record = self.step_record(last).ok_or_else(|| {
            BytesError::Nothing(format!("the record of step {last} cannot be read, and it is the last"))
        })?;
        let scene = &self.record.scene;
        let is_kept = |&step: &u64| scene.state_is_recorded(step);
        let has_last = self.state_at_or_before(last).is_some_and(|(step, _)| step == last);
        let state_count = (0..=last).filter(is_kept).count() as u64 + u64::from(has_last && !is_kept(&last));
        let keyframe_count = (0..=last).filter(|&step| scene.time.frame_at(step).is_some()).count() as u64;
        let outcome = Outcome::Recovered(format!("and what came after step {last} is missing"));
        let chained_hash = record.chained_hash;
        Ok(End { outcome, step_count: last, state_count, keyframe_count, chained_hash })
    }

    /// Gives the new log its messages.
    fn fill<W: Sink>(
        &mut self,
        output: &mut Output<'a, W>,
        extent: &Extent,
        end: &End,
        remake: &mut Option<&mut dyn Remake>,
    ) -> Result<(), Interruption> {
        output.push(self.scene.clone())?;
        let last_ns = log_time_ns(extent.last as f64 * self.record.scene.time.time_step_s);
        output.push(Message::new(Kind::End, last_ns, wire::encode(end)))?;
        let keyframes = end.keyframe_count as usize;
        for &(frame, info) in self.frames.iter().take(self.frame_limit).take(keyframes) {
            output.push(frame.message(self.file))?;
            output.push(info.message(self.file))?;
        }
        for kind in [Kind::Scene, Kind::Frame, Kind::FrameInfo, Kind::End] {
            output.sequencer.close(kind);
        }
        let mut holes = extent.holes.iter();
        let mut hole = holes.next();
        let mut states = self.states.iter().peekable();
        for find in self.steps.iter().take_while(|find| find.number <= extent.last) {
            let step = find.number;
            if let Some(range) = hole.filter(|range| range.end <= step) {
                self.refill(output, range, remake)?;
                hole = holes.next();
            }
            if hole.is_some_and(|range| range.contains(&step)) {
                continue;
            }
            while states.next_if(|(of, _)| *of < step).is_some() {}
            let is_kept = self.record.scene.state_is_recorded(step) || step == extent.last;
            if let Some((_, state)) = states.next_if(|(of, _)| *of == step && is_kept) {
                output.push(state.message(self.file))?;
            }
            output.push(find.message(self.file))?;
            output.write_what_is_due()?;
        }
        output.sequencer.close(Kind::State);
        output.sequencer.close(Kind::Step);
        output.write_what_is_due()?;
        assert!(output.writer.has_end(), "all is closed, so the end has come");
        Ok(())
    }

    /// Makes lost steps again.
    fn refill<W: Sink>(
        &self,
        output: &mut Output<'a, W>,
        lost: &Range<u64>,
        remake: &mut Option<&mut dyn Remake>,
    ) -> Result<(), Interruption> {
        let fail = |reason: String| Interruption::Remake(lost.start, reason);
        let remake = remake.as_mut().ok_or_else(|| fail("no simulator is at hand".to_owned()))?;
        let (from, find) = self
            .state_at_or_before(lost.start - 1)
            .ok_or_else(|| fail(format!("no state lies before step {}", lost.start)))?;
        let state = state::decode(&find.message(self.file).bytes).map_err(|error| fail(error.to_string()))?;
        let record = self.step_record(from).ok_or_else(|| fail(format!("no record of step {from}")))?;
        let mut interrupted = None;
        let mut emit = |record: &StepRecord, state: &[u8]| -> Result<(), String> {
            if record.step < lost.start {
                return Ok(());
            }
            let log_time_ns = log_time_ns(record.sim_time_s);
            let mut push = || -> Result<(), Interruption> {
                if self.record.scene.state_is_recorded(record.step) {
                    output.push(Message::new(Kind::State, log_time_ns, state.to_vec()))?;
                }
                let json = serde_json::to_vec(record).expect("a step record has a JSON form");
                output.push(Message::new(Kind::Step, log_time_ns, json))?;
                output.write_what_is_due()
            };
            push().map_err(|interruption| {
                interrupted = Some(interruption);
                "the log refused a message".to_owned()
            })
        };
        let made = remake.remake(&self.record, state, record.chained_hash, lost.end - 1, &mut emit);
        match (interrupted, made) {
            (Some(interruption), _) => Err(interruption),
            (None, Err(reason)) => Err(fail(reason)),
            (None, Ok(())) => Ok(()),
        }
    }

    fn report(&self, extent: &Extent, end: End, counts: crate::check::Counts) -> Recovery {
        let of_kind = |kind| self.found.finds.iter().filter(move |find| find.kind == kind);
        let seen = |kind| of_kind(kind).next_back().map_or(0, |find| find.number + 1);
        let ended = self.end.as_ref();
        let told = |seen: u64, ended: Option<u64>| ended.filter(|&count| count > seen).unwrap_or(seen);
        let steps_told = told(seen(Kind::Step), ended.map(|end| end.step_count.saturating_add(1)));
        Recovery {
            last_step: extent.last,
            sim_time_s: extent.last as f64 * self.record.scene.time.time_step_s,
            steps_planned: self.record.scene.time.step_count(),
            counts,
            steps_remade: extent.holes.iter().map(|hole| hole.end - hole.start).sum(),
            steps_lost: steps_told.saturating_sub(counts.step_records),
            frames_lost: seen(Kind::Frame).saturating_sub(counts.frames),
            frames_due: if self.found.has_renderer { end.keyframe_count } else { 0 },
            bytes: self.file.len() as u64,
            bytes_lost: self.bytes_lost(),
            losses: self.found.losses.clone(),
            outcome: end.outcome,
            remake_failed: self.remake_failed.clone(),
        }
    }

    fn bytes_lost(&self) -> u64 {
        self.found.losses.iter().filter(|loss| !loss.is_index).map(|loss| loss.bytes).sum()
    }

    fn step_record(&self, step: u64) -> Option<StepRecord> {
        let index = self.steps.binary_search_by_key(&step, |find| find.number).ok()?;
        serde_json::from_slice(&self.steps[index].message(self.file).bytes).ok()
    }

    fn state_at_or_before(&self, step: u64) -> Option<(u64, Find)> {
        let after = self.states.partition_point(|&(of, _)| of <= step);
        after.checked_sub(1).map(|index| self.states[index])
    }
}

fn io_of(error: WriteError) -> BytesError {
    match error {
        WriteError::Io(error) => BytesError::Io(error),
        WriteError::Check(error) => BytesError::Nothing(error.to_string()),
    }
}

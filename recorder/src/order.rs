//! The order of the log. Messages arrive on six topics in whatever order three processes happen to run;
//! they are written in the one order that the run alone fixes:
//!
//! ```text
//! /scene
//! for each step k = 0, 1, ...:
//!     /state k        if the scene records it (`Scene::state_is_recorded`), or the run ended at k
//!     /step k
//!     /frame j, /frame_info j      if k is the step of keyframe j + FRAME_LAG and a renderer takes part
//! the remaining /frame, /frame_info pairs
//! /end
//! ```
//!
//! No clock, no bus, no files: messages in, messages out.

use crate::message::{Kind, Message};
use schemas::end::End;
use schemas::scene::{Scene, SceneRecord};
use schemas::topics::{FRAME_LAG, STATE, STEP};
use schemas::wire;
use std::collections::VecDeque;

/// States, and likewise step records, that may wait here before no more of them are taken off the bus.
///
/// Two would do (see [`Sequencer::wants`]); as many as the bus queue holds let a burst through at once.
const PENDING_MAX: usize = STATE.queue;
const _: () = assert!(PENDING_MAX >= 2 && STEP.queue >= 2);

/// A message that cannot take its place in the log.
#[derive(Debug, thiserror::Error)]
pub enum OrderError {
    /// The scene record does not parse, so nothing is known about the order.
    #[error("the scene record cannot be read: {0}; do all processes come from one version of the program?")]
    Scene(#[source] serde_json::Error),
    /// The end record does not parse.
    #[error("the end record cannot be read: {0}; do all processes come from one version of the program?")]
    End(#[source] wire::WireError),
    /// A message that may come once came twice.
    #[error("a second {0} message: is another publisher on this bus name?")]
    Twice(Kind),
    /// A state message too short to hold its step number.
    #[error("a state message of {length} bytes: it must begin with a header of 56 bytes")]
    ShortState {
        /// Bytes that the message has.
        length: usize,
    },
    /// A state of a step that should have none, or that has passed.
    #[error("the state of step {got} came where that of step {expected} was due")]
    State {
        /// The step whose state was due, or at which the log stands.
        expected: u64,
        /// The step that the message names.
        got: u64,
    },
    /// A frame came although this recording was started without a renderer.
    #[error("a {0} message came, but this recording expects no renderer: start it without --no-render")]
    NoRenderer(Kind),
}

/// Where the log stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Scene,
    State,
    Step,
    Frame,
    FrameInfo,
    Tail,
    Done,
}

/// Brings the messages of a run into the order of the log.
///
/// # Bounds
///
/// At most 16 states and 16 step records wait here. Frames are always taken: how many can wait is bounded
/// by how far the simulator runs ahead, which is the states and steps held here and in the bus queues, so
/// at most `FRAME_LAG` frames and those of the keyframes among about 35 steps.
///
/// # Why it cannot lock up
///
/// What is due next is never refused: a state or step record is refused only while 16 of its own kind
/// wait. While a frame is due, its keyframe left the simulator `FRAME_LAG` keyframes ago, so that the
/// renderer needs nothing that is held up behind a full `state` or `step` queue.
#[derive(Debug)]
pub struct Sequencer<'a> {
    renderer: bool,
    scene: Option<Scene>,
    end: Option<End>,
    place: Place,
    pending: [VecDeque<Message<'a>>; 6],
    closed: [bool; 6],
    next_step: u64,
    states_done: u64,
    keyframes_done: u64,
    frames_done: u64,
}

impl<'a> Sequencer<'a> {
    /// An empty log; with `renderer`, a frame is awaited for every keyframe.
    pub fn new(renderer: bool) -> Sequencer<'a> {
        Sequencer {
            renderer,
            scene: None,
            end: None,
            place: Place::Scene,
            pending: Default::default(),
            closed: [false; 6],
            next_step: 0,
            states_done: 0,
            keyframes_done: 0,
            frames_done: 0,
        }
    }

    /// Whether messages of a kind should be taken off the bus now; if not, they wait in its queue and their
    /// publisher waits when that is full.
    pub fn wants(&self, kind: Kind) -> bool {
        match kind {
            Kind::State | Kind::Step => {
                self.place == Place::Done || self.pending[kind.index()].len() < PENDING_MAX
            }
            _ => true,
        }
    }

    /// Messages that wait for their place.
    pub fn pending_count(&self) -> usize {
        self.pending.iter().map(VecDeque::len).sum()
    }

    /// Takes a message in. Messages of one kind must come in the order in which they were sent.
    ///
    /// # Errors
    ///
    /// [`OrderError`] if the message has no place in a log.
    pub fn push(&mut self, message: Message<'a>) -> Result<(), OrderError> {
        let kind = message.kind;
        match kind {
            Kind::Scene => {
                if self.scene.is_some() {
                    return Err(OrderError::Twice(kind));
                }
                let record: SceneRecord =
                    serde_json::from_slice(&message.bytes).map_err(OrderError::Scene)?;
                self.scene = Some(record.scene);
            }
            Kind::End => {
                if self.end.is_some() {
                    return Err(OrderError::Twice(kind));
                }
                self.end = Some(wire::decode(&message.bytes).map_err(OrderError::End)?);
            }
            Kind::State => {
                step_of_state(&message)?;
            }
            Kind::Frame | Kind::FrameInfo if !self.renderer => return Err(OrderError::NoRenderer(kind)),
            _ => {}
        }
        self.pending[kind.index()].push_back(message);
        Ok(())
    }

    /// Says that no more messages of a kind will come: its publisher has ended the stream, or was lost.
    pub fn close(&mut self, kind: Kind) {
        self.closed[kind.index()] = true;
    }

    /// Whether `/end` has been given out, or nothing more can come.
    pub fn is_done(&self) -> bool {
        self.place == Place::Done
    }

    /// The next message of the log, or `None` until more have been pushed.
    ///
    /// # Errors
    ///
    /// [`OrderError::State`] if the states do not fit the steps.
    #[allow(clippy::should_implement_trait)] // not an iterator: `None` means "not yet"
    pub fn next(&mut self) -> Result<Option<Message<'a>>, OrderError> {
        loop {
            let (message, place) = match self.place {
                Place::Scene => match self.pop(Kind::Scene) {
                    Some(scene) => (Some(scene), Place::State),
                    None if self.is_closed(Kind::Scene) => (None, Place::Done),
                    None => return Ok(None),
                },
                Place::State => match self.state_is_due()? {
                    // A state is given out only with its step record, so that a log that ends early ends
                    // with a whole step.
                    Some(true) if self.both_at_hand(Kind::State, Kind::Step) => {
                        self.states_done += 1;
                        (self.pop(Kind::State), Place::Step)
                    }
                    Some(true) if self.is_closed(Kind::State) || self.is_closed(Kind::Step) => {
                        (None, Place::Tail)
                    }
                    Some(true) => return Ok(None),
                    Some(false) => (None, Place::Step),
                    None if self.steps_are_over() => (None, Place::Tail),
                    None => return Ok(None),
                },
                Place::Step => match self.pop(Kind::Step) {
                    Some(step) => (Some(step), self.after_step()),
                    None if self.is_closed(Kind::Step) => (None, Place::Tail),
                    None => return Ok(None),
                },
                Place::Frame if self.both_at_hand(Kind::Frame, Kind::FrameInfo) => {
                    (self.pop(Kind::Frame), Place::FrameInfo)
                }
                Place::Frame if self.frames_are_over() => (None, Place::State),
                Place::Frame => return Ok(None),
                Place::FrameInfo => {
                    self.frames_done += 1;
                    let more = self.steps_are_over();
                    (self.pop(Kind::FrameInfo), if more { Place::Tail } else { Place::State })
                }
                Place::Tail if self.frames_remain() && self.both_at_hand(Kind::Frame, Kind::FrameInfo) => {
                    (self.pop(Kind::Frame), Place::FrameInfo)
                }
                Place::Tail if self.frames_remain() && !self.frames_are_over() => return Ok(None),
                Place::Tail => match self.pop(Kind::End) {
                    Some(end) => (Some(end), Place::Done),
                    None if self.is_closed(Kind::End) => (None, Place::Done),
                    None => return Ok(None),
                },
                Place::Done => return Ok(None),
            };
            self.place = place;
            if message.is_some() {
                return Ok(message);
            }
        }
    }

    /// Whether the step at which the log stands has a state; `None` while that cannot be known, or when
    /// there is no such step.
    fn state_is_due(&self) -> Result<Option<bool>, OrderError> {
        if self.steps_are_over() {
            return Ok(None);
        }
        let step = self.next_step;
        let scheduled = self.scene.as_ref().is_some_and(|scene| scene.state_is_recorded(step));
        if let Some(state) = self.pending[Kind::State.index()].front() {
            let got = step_of_state(state)?;
            if got < step || (scheduled && got > step) {
                return Err(OrderError::State { expected: step, got });
            }
            return Ok(Some(got == step));
        }
        if scheduled {
            return Ok(Some(true));
        }
        // A run that ends early has a state at its last step. A later step record shows that this step was
        // not the last; otherwise only the end can tell.
        if self.pending[Kind::Step.index()].len() >= 2 {
            return Ok(Some(false));
        }
        if let Some(end) = &self.end {
            return Ok(Some(end.step_count == step && end.state_count > self.states_done));
        }
        Ok(if self.is_closed(Kind::State) { Some(false) } else { None })
    }

    /// Counts a step record that is given out, and says what comes after it.
    fn after_step(&mut self) -> Place {
        let is_keyframe =
            self.scene.as_ref().is_some_and(|scene| scene.time.frame_at(self.next_step).is_some());
        self.next_step += 1;
        self.keyframes_done += u64::from(is_keyframe);
        let frame_is_due = is_keyframe && self.keyframes_done > self.frames_done + FRAME_LAG;
        if self.renderer && frame_is_due { Place::Frame } else { Place::State }
    }

    /// Whether every step record of the run has been given out.
    fn steps_are_over(&self) -> bool {
        match &self.end {
            Some(end) => self.next_step > end.step_count,
            None => self.is_closed(Kind::Step),
        }
    }

    fn both_at_hand(&self, one: Kind, other: Kind) -> bool {
        !self.pending[one.index()].is_empty() && !self.pending[other.index()].is_empty()
    }

    /// Whether no whole frame can come any more.
    fn frames_are_over(&self) -> bool {
        [Kind::Frame, Kind::FrameInfo].into_iter().any(|kind| self.is_closed(kind))
    }

    /// Whether the run has frames that are not in the log yet. Without an end record these are the frames
    /// of the keyframes in the log: a frame of a step that was lost has no place.
    fn frames_remain(&self) -> bool {
        let count = self.end.as_ref().map_or(self.keyframes_done, |end| end.keyframe_count);
        self.renderer && self.frames_done < count
    }

    /// Whether nothing of a kind is left and nothing more will come.
    fn is_closed(&self, kind: Kind) -> bool {
        self.closed[kind.index()] && self.pending[kind.index()].is_empty()
    }

    fn pop(&mut self, kind: Kind) -> Option<Message<'a>> {
        self.pending[kind.index()].pop_front()
    }
}

/// The step that a state message names: its first eight bytes.
fn step_of_state(message: &Message) -> Result<u64, OrderError> {
    match message.bytes.first_chunk() {
        Some(bytes) => Ok(u64::from_le_bytes(*bytes)),
        None => Err(OrderError::ShortState { length: message.bytes.len() }),
    }
}

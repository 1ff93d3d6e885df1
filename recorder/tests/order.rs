//! The order of the log does not depend on the order of arrival, and waiting for it never locks up.

mod sample;

use proptest::prelude::*;
use recorder::order::OrderError;
use recorder::{Kind, Message, Sequencer};
use sample::{Run, write};
use schemas::topics::{FRAME_LAG, TOPICS};
use std::collections::VecDeque;

fn runs() -> impl Strategy<Value = Run> {
    (0..60_u64, 0..60_u64, 1..9_u64, any::<bool>()).prop_map(|(planned, steps, state_every, renderer)| Run {
        rings: 1,
        steps_planned: planned,
        steps: if steps < planned { steps } else { planned },
        state_every,
        renderer,
    })
}

/// The order as the module's doc gives it, written out plainly.
fn expected(run: &Run) -> Vec<Message<'static>> {
    let mut queues = run.messages().0.map(VecDeque::from);
    let scene = run.scene();
    let mut ordered = Vec::new();
    let mut take = |ordered: &mut Vec<_>, kind: Kind| ordered.extend(queues[kind.index()].pop_front());
    take(&mut ordered, Kind::Scene);
    let mut keyframes = 0;
    for step in 0..=run.steps {
        if scene.state_is_recorded(step) || step == run.steps {
            take(&mut ordered, Kind::State);
        }
        take(&mut ordered, Kind::Step);
        if scene.time.frame_at(step).is_some() {
            keyframes += 1;
            if keyframes > FRAME_LAG {
                take(&mut ordered, Kind::Frame);
                take(&mut ordered, Kind::FrameInfo);
            }
        }
    }
    for _ in 0..FRAME_LAG {
        take(&mut ordered, Kind::Frame);
        take(&mut ordered, Kind::FrameInfo);
    }
    take(&mut ordered, Kind::End);
    ordered
}

/// Sends a run's messages through bus queues of their real lengths, one action after the other as
/// `choices` says: the simulator and the renderer send, the recorder receives.
struct Play {
    /// What the simulator sends, in its order; `None` for a keyframe.
    simulator: VecDeque<(Option<Kind>, Message<'static>)>,
    frames: VecDeque<(Message<'static>, Message<'static>)>,
    keyframe_queue: usize,
    queues: [VecDeque<Message<'static>>; 6],
    sequencer: Sequencer<'static>,
    ordered: Vec<Message<'static>>,
    frames_waiting_max: usize,
}

fn queue_length(name: &str) -> usize {
    TOPICS.iter().find(|topic| topic.name == name).expect("a topic").queue
}

impl Play {
    fn new(run: &Run) -> Play {
        let scene = run.scene();
        let [first, states, steps, frames, infos, last] = run.messages().0.map(VecDeque::from);
        let mut simulator: VecDeque<_> =
            first.into_iter().map(|message| (Some(Kind::Scene), message)).collect();
        let mut states = states.into_iter().peekable();
        for (step, record) in steps.into_iter().enumerate() {
            let step = step as u64;
            if scene.state_is_recorded(step) || step == run.steps {
                simulator.push_back((Some(Kind::State), states.next().expect("a state")));
            }
            simulator.push_back((Some(Kind::Step), record.clone()));
            if scene.time.frame_at(step).is_some() && run.renderer {
                simulator.push_back((None, record));
            }
        }
        simulator.extend(last.into_iter().map(|message| (Some(Kind::End), message)));
        Play {
            simulator,
            frames: frames.into_iter().zip(infos).collect(),
            keyframe_queue: 0,
            queues: Default::default(),
            sequencer: Sequencer::new(run.renderer),
            ordered: Vec::new(),
            frames_waiting_max: 0,
        }
    }

    fn simulate(&mut self) -> bool {
        match self.simulator.front() {
            Some((None, _)) if self.keyframe_queue < queue_length("keyframe") => {
                self.simulator.pop_front();
                self.keyframe_queue += 1;
                true
            }
            Some((Some(kind), _)) if self.has_room(*kind) => {
                let (kind, message) = self.simulator.pop_front().expect("looked at");
                self.queues[kind.expect("not a keyframe").index()].push_back(message);
                true
            }
            _ => false,
        }
    }

    fn render(&mut self) -> bool {
        if self.keyframe_queue == 0 || !self.has_room(Kind::Frame) || !self.has_room(Kind::FrameInfo) {
            return false;
        }
        self.keyframe_queue -= 1;
        let (frame, info) = self.frames.pop_front().expect("a frame for every keyframe");
        self.queues[Kind::Frame.index()].push_back(frame);
        self.queues[Kind::FrameInfo.index()].push_back(info);
        true
    }

    fn receive(&mut self, kind: Kind) -> bool {
        if !self.sequencer.wants(kind) || self.queues[kind.index()].is_empty() {
            return false;
        }
        let message = self.queues[kind.index()].pop_front().expect("not empty");
        self.sequencer.push(message).expect("a place");
        while let Some(message) = self.sequencer.next().expect("a place") {
            self.ordered.push(message);
        }
        let waiting = self.sequencer.pending_count();
        if waiting > self.frames_waiting_max {
            self.frames_waiting_max = waiting;
        }
        true
    }

    fn has_room(&self, kind: Kind) -> bool {
        let name = kind.channel().topic.trim_start_matches('/');
        self.queues[kind.index()].len() < queue_length(name)
    }

    fn act(&mut self, choice: u8) -> bool {
        match choice {
            0 => self.simulate(),
            1 => self.render(),
            other => self.receive(Kind::ALL[usize::from(other - 2) % 6]),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_order_of_arrival_gives_the_same_log(run in runs(), choices in proptest::collection::vec(0..8_u8, 1..3000)) {
        let mut play = Play::new(&run);
        // A run of choices lets one process get far ahead; in the end each acts in turn as long as one can.
        for (index, &choice) in choices.iter().enumerate() {
            for _ in 0..=index % 7 {
                play.act(choice);
            }
        }
        while (0..8).any(|choice| play.act(choice)) {}
        prop_assert!(play.sequencer.is_done(), "locked up after {} messages", play.ordered.len());
        prop_assert_eq!(play.sequencer.pending_count(), 0);
        prop_assert!(play.ordered == expected(&run), "another order");
        // The documented bound: 16 states, 16 steps, and pairs for FRAME_LAG and some 35 steps' keyframes.
        prop_assert!(play.frames_waiting_max <= 32 + 2 * (FRAME_LAG as usize + 35));
    }

    #[test]
    fn the_file_is_the_same_too(run in runs(), choices in proptest::collection::vec(0..8_u8, 1..300)) {
        let mut play = Play::new(&run);
        for choice in choices {
            play.act(choice);
        }
        while (0..8).any(|choice| play.act(choice)) {}
        prop_assert!(write(&play.ordered, run.renderer) == run.log_bytes());
    }

    #[test]
    fn a_lost_process_leaves_a_prefix_with_whole_steps_and_frames(
        run in runs(),
        keep in proptest::collection::vec(0..70_usize, 6),
    ) {
        let mut sequencer = Sequencer::new(run.renderer);
        for (kind, messages) in Kind::ALL.into_iter().zip(run.messages().0) {
            // The end never comes from a simulator that was lost.
            let keep = if kind == Kind::End { 0 } else { keep[kind.index()] };
            for message in messages.into_iter().take(keep) {
                sequencer.push(message).expect("a place");
            }
            sequencer.close(kind);
        }
        let mut ordered = Vec::new();
        while let Some(message) = sequencer.next().expect("a place") {
            ordered.push(message);
        }
        prop_assert!(sequencer.is_done());
        let log = recorder::Log::from_bytes("lost", write(&ordered, run.renderer)).expect("a log");
        prop_assert_eq!(log.count(Kind::Frame), log.count(Kind::FrameInfo));
        prop_assert_eq!(log.messages().len(), ordered.len());
    }
}

#[test]
fn messages_without_a_place_are_refused() {
    let run = Run::default();
    let [scene, states, _, frames, ..] = run.messages().0;
    let mut sequencer = Sequencer::new(false);
    sequencer.push(scene[0].clone()).expect("a place");
    assert!(matches!(sequencer.push(scene[0].clone()), Err(OrderError::Twice(Kind::Scene))));
    assert!(matches!(sequencer.push(frames[0].clone()), Err(OrderError::NoRenderer(Kind::Frame))));
    let short = Message::new(Kind::State, 0, vec![1, 2, 3]);
    assert!(matches!(sequencer.push(short), Err(OrderError::ShortState { length: 3 })));
    sequencer.push(states[1].clone()).expect("held until it is due");
    sequencer.next().expect("the scene").expect("the scene");
    assert!(matches!(sequencer.next(), Err(OrderError::State { expected: 0, got: 1 })));
}

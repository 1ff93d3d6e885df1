//! Where two logs part: the first step, its first stage, the body, the field, the bits; and how the
//! difference grows. For frames: which differ, and by how much.
//!
//! The chained hashes of two runs, once apart, stay apart, so the first differing step is found by bisection, and
//! no more is read than that takes. Where the hashes find nothing, they are not taken on trust: then every byte is
//! compared before two logs are called the same.

mod chunks;
mod first;
mod frames;
mod html;
mod keys;
mod states;
mod text;

pub use frames::{
    DifferencePicture, FirstFrame, FrameDifference, PixelError, PixelErrorOfFrame, difference_picture,
};
pub use html::html;
pub use keys::{KeyDifference, compare_records};
pub use states::{FieldDifference, Growth, StateDifference, compare as compare_states};

use crate::fault::Health;
use crate::message::{Kind, Message};
use crate::reader::Log;
use crate::states::{Kept, StateSource};
use chunks::{Chunks, Depth};
use schemas::end::End;
use schemas::scene::{Scene, SceneRecord};
use schemas::step::StepRecord;
use schemas::{state, wire};
use serde::Serialize;
use std::cell::RefCell;

/// What became of the comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every message that counts is the same.
    Same,
    /// They differ.
    Differs,
    /// They cannot be compared; [`Diff::notes`] says why.
    Incomparable,
    /// One of them is damaged; [`Diff::notes`] says which, and the rest was compared as far as it goes.
    Damaged,
}

impl Verdict {
    /// The exit code of `diff`.
    pub fn exit_code(self) -> u8 {
        match self {
            Verdict::Same => 0,
            Verdict::Differs => 1,
            Verdict::Incomparable => 2,
            Verdict::Damaged => 3,
        }
    }
}

/// How much is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Options {
    /// Compare every byte up to the first difference, even if the hashes lead to it without: that finds states that
    /// were altered in the file.
    pub thorough: bool,
    /// Steps after the first difference at which its growth is measured, besides those 0, 1, 2, 4, 8, ... later.
    pub growth_points: usize,
}

/// The first step at which two logs differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepDifference {
    /// The step.
    pub step: u64,
    /// The first stage whose hash differs, in the order in which a step runs; `None` if all agree.
    pub stage: Option<&'static str>,
    /// The stages before that one, whose hashes agree.
    pub stages_before: Vec<&'static str>,
    /// Fields of the step records that differ.
    pub record: Vec<KeyDifference>,
    /// How the states differ, at this step or, if it was not logged, at the next one that both logs have.
    pub state: Option<StateDifference>,
}

/// The comparison of two logs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diff {
    /// The two files.
    pub files: [String; 2],
    /// The result.
    pub verdict: Verdict,
    /// Damage found on the way, or why there is no comparison.
    pub notes: Vec<String>,
    /// Program versions, if they differ. Only the same version promises the same bits.
    pub versions: Option<[String; 2]>,
    /// Scene keys that differ, `render.*` aside.
    pub scene: Vec<KeyDifference>,
    /// Keys of `render.*` that differ.
    pub render: Vec<KeyDifference>,
    /// Lines of the plan that differ.
    pub plan: Vec<KeyDifference>,
    /// Step records of each.
    pub step_records: [u64; 2],
    /// How each ended, if that differs.
    pub ends: Option<[Option<End>; 2]>,
    /// The first differing step, among those that both have.
    pub first: Option<StepDifference>,
    /// How far states are apart, 0, 1, 2, 4, 8, ... steps later, and in between if that is asked for.
    pub growth: Vec<Growth>,
    /// The frames; `None` if neither log has any.
    pub frames: Option<FrameDifference>,
    /// Whether every byte before the first difference was compared; if not, the hashes led there.
    pub every_byte_compared: bool,
    /// Chunks of each log that were read, and how many it has.
    pub chunks_read: [[usize; 2]; 2],
}

/// Compares two logs; [`diff_with`] does it with other options.
pub fn diff(a: &Log, b: &Log) -> Diff {
    diff_with(a, b, Options::default())
}

/// Compares two logs by the states that they keep.
pub fn diff_with(a: &Log, b: &Log, options: Options) -> Diff {
    diff_by(a, b, options, [&mut Kept(a), &mut Kept(b)])
}

/// Compares two logs; `sources` give the states that the logs do not keep.
pub fn diff_by(a: &Log, b: &Log, options: Options, sources: [&mut dyn StateSource; 2]) -> Diff {
    let [source_a, source_b] = sources;
    let sides = [Side::new(a, source_a), Side::new(b, source_b)];
    let mut diff = Diff {
        files: [a, b].map(|log| log.file().to_owned()),
        verdict: Verdict::Same,
        notes: Vec::new(),
        versions: None,
        scene: Vec::new(),
        render: Vec::new(),
        plan: Vec::new(),
        step_records: [a, b].map(|log| log.count(Kind::Step) as u64),
        ends: None,
        first: None,
        growth: Vec::new(),
        frames: None,
        every_byte_compared: false,
        chunks_read: [[0; 2]; 2],
    };
    let Some(scene) = diff.compare_scenes(&sides) else {
        diff.verdict = if is_damaged(&sides) { Verdict::Damaged } else { Verdict::Incomparable };
        diff.take_damage(sides);
        return diff;
    };
    let bisected = first::by_hashes(&sides);
    let depth = if options.thorough || bisected.is_none() { Depth::Bytes } else { Depth::Claims };
    let chunks = Chunks::new(&sides, depth);
    diff.every_byte_compared = depth == Depth::Bytes;
    diff.first = first::first_step(&sides, &chunks, bisected, &scene);
    if let Some(state) = diff.first.as_ref().and_then(|first| first.state.as_ref()) {
        diff.growth = states::growth(&sides, state.step, options.growth_points, &scene);
    }
    let ends = [0, 1].map(|side| sides[side].end());
    if ends[0] != ends[1] {
        diff.ends = Some(ends);
    }
    diff.frames = frames::compare(&sides, &chunks);
    let differs = diff.differs();
    diff.verdict = match (is_damaged(&sides), differs) {
        (true, _) => Verdict::Damaged,
        (false, true) => Verdict::Differs,
        (false, false) => Verdict::Same,
    };
    diff.take_damage(sides);
    diff.chunks_read = [a, b].map(|log| log.chunks_checked().into());
    diff
}

impl Diff {
    /// Compares the scene records; the scene of the first, or `None` if there is no comparing.
    fn compare_scenes(&mut self, sides: &[Side; 2]) -> Option<Scene> {
        let messages = [0, 1].map(|side| sides[side].message(Kind::Scene, 0));
        let [Some(message_a), Some(message_b)] = messages else {
            self.notes.push("a scene record is missing or cannot be read".to_owned());
            return None;
        };
        let records =
            [(&sides[0], &message_a), (&sides[1], &message_b)].map(|(side, message)| scene(side, message));
        let [record_a, record_b] = match records {
            [Ok(a), Ok(b)] => [a, b],
            refused => {
                self.notes.extend(refused.into_iter().filter_map(Result::err));
                return None;
            }
        };
        if record_a.layout_hash != record_b.layout_hash {
            let (a, b) = (record_a.layout_hash, record_b.layout_hash);
            self.notes.push(format!("the state layouts differ: {a} and {b}"));
            return None;
        }
        if message_a.bytes == message_b.bytes {
            return Some(record_a.scene);
        }
        if record_a.version != record_b.version {
            self.versions = Some([record_a.version, record_b.version]);
        }
        let values = [&record_a.scene, &record_b.scene].map(serde_json::to_value);
        let [Ok(a), Ok(b)] = values else { return None };
        for difference in keys::compare(&a, &b) {
            if difference.key.starts_with("render.") {
                self.render.push(difference);
            } else {
                self.scene.push(difference);
            }
        }
        self.plan = keys::compare_plans(&record_a.plan, &record_b.plan);
        Some(record_a.scene)
    }

    fn differs(&self) -> bool {
        let keys = self.scene.len() + self.render.len() + self.plan.len();
        let steps_differ = self.step_records[0] != self.step_records[1];
        let frames_differ = self.frames.as_ref().is_some_and(FrameDifference::differs);
        keys > 0 || steps_differ || self.ends.is_some() || self.first.is_some() || frames_differ
    }

    fn take_damage(&mut self, sides: [Side; 2]) {
        for side in sides {
            self.notes.extend(side.damage.into_inner());
        }
    }
}

/// The scene record in a message, or why this program cannot read it.
fn scene(side: &Side, message: &Message) -> Result<SceneRecord, String> {
    #[derive(serde::Deserialize)]
    struct Version {
        version: String,
    }
    serde_json::from_slice(&message.bytes).map_err(|reason| {
        let (file, own) = (side.log.file(), env!("CARGO_PKG_VERSION"));
        match serde_json::from_slice::<Version>(&message.bytes) {
            Ok(Version { version }) => format!(
                "{file}: its scene was written by version {version}, and this version, {own}, cannot read it ({reason}); \
                 compare logs with a program that reads both"
            ),
            Err(_) => format!("{file}: its scene record cannot be read: {reason}"),
        }
    })
}

fn is_damaged(sides: &[Side; 2]) -> bool {
    sides.iter().any(|side| !side.damage.borrow().is_empty())
}

/// One of the two logs, and what was found to be wrong with it.
struct Side<'a> {
    log: &'a Log,
    /// Gives the states that the log does not keep.
    source: RefCell<&'a mut dyn StateSource>,
    damage: RefCell<Vec<String>>,
}

impl<'a> Side<'a> {
    fn new(log: &'a Log, source: &'a mut dyn StateSource) -> Side<'a> {
        let damage = match log.health() {
            Health::Complete => Vec::new(),
            health => vec![format!("{}: {health}", log.file())],
        };
        Side { log, source: RefCell::new(source), damage: RefCell::new(damage) }
    }

    fn count(&self, kind: Kind) -> usize {
        self.log.count(kind)
    }

    fn note(&self, damage: String) {
        let mut notes = self.damage.borrow_mut();
        if !notes.contains(&damage) {
            notes.push(damage);
        }
    }

    /// A message, even from a chunk whose checksum is wrong: then the damage is noted.
    fn message(&self, kind: Kind, index: usize) -> Option<Message<'a>> {
        match self.log.nth(kind, index) {
            Ok(message) => Some(message),
            Err(error) => {
                self.note(error.to_string());
                self.log.nth_unchecked(kind, index).ok()
            }
        }
    }

    fn json<T: serde::de::DeserializeOwned>(&self, kind: Kind, index: usize) -> Option<T> {
        let message = self.message(kind, index)?;
        match serde_json::from_slice(&message.bytes) {
            Ok(value) => Some(value),
            Err(error) => {
                self.note(format!("{}: {kind} message {index} cannot be read: {error}", self.log.file()));
                None
            }
        }
    }

    fn step(&self, step: u64) -> Option<StepRecord> {
        self.json(Kind::Step, usize::try_from(step).ok()?)
    }

    fn end(&self) -> Option<End> {
        if self.count(Kind::End) == 0 {
            return None;
        }
        wire::decode(&self.message(Kind::End, 0)?.bytes).ok()
    }

    /// Notes it if a state's bytes are not those that were hashed.
    fn check_state(&self, step: u64, bytes: &[u8]) {
        if let Err(error) = state::decode(bytes) {
            self.note(format!(
                "{}: the state of step {step} is not as it was written: {error}",
                self.log.file()
            ));
        }
    }
}

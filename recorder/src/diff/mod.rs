//! Where two logs part: the first step, its first stage, the body, the field, the bits; and how the
//! difference grows. For frames: which differ, and by how much.
//!
//! The chained hashes of two runs, once apart, stay apart, so the first differing step is found by bisection.
//! What the hashes say is not taken on trust: where they agree, the bytes are compared as well.

mod frames;
mod keys;
mod states;
mod text;

pub use frames::{FirstFrame, FrameDifference, PixelError};
pub use keys::KeyDifference;
pub use states::{FieldDifference, Growth, StateDifference};

use crate::fault::Health;
use crate::message::{Kind, Message};
use crate::reader::Log;
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

/// The first step at which two logs differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepDifference {
    /// The step.
    pub step: u64,
    /// The first stage whose hash differs, in the order in which a step runs; `None` if all agree.
    pub stage: Option<&'static str>,
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
    /// How far positions are apart, 0, 1, 2, 4, 8, ... steps later.
    pub growth: Vec<Growth>,
    /// The frames; `None` if neither log has any.
    pub frames: Option<FrameDifference>,
}

/// Compares two logs.
pub fn diff(a: &Log, b: &Log) -> Diff {
    let sides = [Side::new(a), Side::new(b)];
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
    };
    let Some(scene) = diff.compare_scenes(&sides) else {
        diff.verdict = if is_damaged(&sides) { Verdict::Damaged } else { Verdict::Incomparable };
        diff.take_damage(sides);
        return diff;
    };
    diff.first = first_step(&sides, &scene);
    if let Some(state) = diff.first.as_ref().and_then(|first| first.state.as_ref()) {
        diff.growth = states::growth(&sides, state.step);
    }
    let ends = [0, 1].map(|side| sides[side].end());
    if ends[0] != ends[1] {
        diff.ends = Some(ends);
    }
    diff.frames = frames::compare(&sides);
    let differs = diff.differs();
    diff.verdict = match (is_damaged(&sides), differs) {
        (true, _) => Verdict::Damaged,
        (false, true) => Verdict::Differs,
        (false, false) => Verdict::Same,
    };
    diff.take_damage(sides);
    diff
}

impl Diff {
    /// Compares the scene records; the scene of the first, or `None` if there is no comparing.
    fn compare_scenes(&mut self, sides: &[Side; 2]) -> Option<Scene> {
        let values = [0, 1].map(|side| sides[side].json::<serde_json::Value>(Kind::Scene, 0));
        let records = [0, 1].map(|side| sides[side].json::<SceneRecord>(Kind::Scene, 0));
        let ([Some(a), Some(b)], [Some(record_a), Some(record_b)]) = (values, records) else {
            self.notes.push("a scene record is missing or cannot be read".to_owned());
            return None;
        };
        if record_a.layout_hash != record_b.layout_hash {
            let (a, b) = (record_a.layout_hash, record_b.layout_hash);
            self.notes.push(format!("the state layouts differ: {a} and {b}"));
            return None;
        }
        if record_a.version != record_b.version {
            self.versions = Some([record_a.version, record_b.version]);
        }
        for difference in keys::compare(&a, &b) {
            if let Some(key) = difference.key.strip_prefix("scene.render.") {
                self.render.push(KeyDifference { key: format!("render.{key}"), ..difference });
            } else if let Some(key) = difference.key.strip_prefix("scene.") {
                self.scene.push(KeyDifference { key: key.to_owned(), ..difference });
            } else if difference.key.starts_with("plan.") {
                self.plan.push(difference);
            }
        }
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

fn is_damaged(sides: &[Side; 2]) -> bool {
    sides.iter().any(|side| !side.damage.borrow().is_empty())
}

/// One of the two logs, and what was found to be wrong with it.
struct Side<'a> {
    log: &'a Log,
    damage: RefCell<Vec<String>>,
}

impl<'a> Side<'a> {
    fn new(log: &'a Log) -> Side<'a> {
        let damage = match log.health() {
            Health::Complete => Vec::new(),
            health => vec![format!("{}: {health}", log.file())],
        };
        Side { log, damage: RefCell::new(damage) }
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

/// The first step at which records or states differ.
fn first_step(sides: &[Side; 2], scene: &Scene) -> Option<StepDifference> {
    let common = sides[0].count(Kind::Step).min(sides[1].count(Kind::Step)) as u64;
    let bisected = first_apart(common, |step| {
        let [a, b] = [0, 1].map(|side| sides[side].step(step).map(|record| record.chained_hash));
        a != b
    });
    // Before that, hashes agree. Records and states must, too.
    let by_record = (0..bisected.unwrap_or(common)).find(|&step| {
        let [a, b] =
            [0, 1].map(|side| sides[side].message(Kind::Step, step as usize).map(|message| message.bytes));
        a != b
    });
    let by_state = states::first_altered(sides, by_record.or(bisected).unwrap_or(u64::MAX));
    let step = by_state.or(by_record).or(bisected)?;
    let records = [0, 1].map(|side| sides[side].step(step));
    let stage = match &records {
        [Some(a), Some(b)] => {
            let pairs = a.stages.in_order().into_iter().zip(b.stages.in_order());
            let mut apart = pairs.filter(|((_, a), (_, b))| a != b);
            apart.next().map(|((name, _), _)| name)
        }
        _ => None,
    };
    let values = [0, 1].map(|side| sides[side].json::<serde_json::Value>(Kind::Step, step as usize));
    let record = match &values {
        [Some(a), Some(b)] => keys::compare(a, b),
        _ => Vec::new(),
    };
    Some(StepDifference { step, stage, record, state: states::compare_from(sides, step, scene) })
}

/// The first of `count` steps for which `apart` holds, given that it holds for all after that; by bisection.
fn first_apart(count: u64, apart: impl Fn(u64) -> bool) -> Option<u64> {
    let last = count.checked_sub(1)?;
    if !apart(last) {
        return None;
    }
    let (mut low, mut high) = (0, last);
    while low < high {
        let middle = low + (high - low) / 2;
        if apart(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bisection_finds_the_first() {
        for count in 0..20 {
            for first in 0..=count {
                let expected = (first < count).then_some(first);
                assert_eq!(first_apart(count, |step| step >= first), expected, "{first} of {count}");
            }
        }
    }
}

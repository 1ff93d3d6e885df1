//! The first step at which two logs part.

use super::chunks::{Chunks, Depth};
use super::{Side, StepDifference, keys, states};
use crate::message::Kind;
use schemas::Hash;
use schemas::scene::Scene;
use serde::Deserialize;

/// The step from which on the chained hashes differ: by bisection, reading one record of each log a probe.
pub(super) fn by_hashes(sides: &[Side; 2]) -> Option<u64> {
    first_apart(common_steps(sides), |step| {
        let [a, b] = [0, 1].map(|side| sides[side].chained_hash(step));
        a != b
    })
}

/// The first step at which records or states differ, given what the chained hashes say.
pub(super) fn first_step(
    sides: &[Side; 2],
    chunks: &Chunks,
    bisected: Option<u64>,
    scene: &Scene,
) -> Option<StepDifference> {
    let limit = bisected.unwrap_or(common_steps(sides));
    // Before that, hashes agree. Records must, too: a count, an energy or a stage may differ before any state does.
    let by_record = (0..limit).find(|&step| record_differs(sides, chunks, step));
    // That states are those which were hashed is believed, unless every byte is to be compared.
    let by_state = match chunks.depth() {
        Depth::Claims => None,
        Depth::Bytes => states::first_altered(sides, chunks, by_record.or(bisected).unwrap_or(u64::MAX)),
    };
    let step = by_state.or(by_record).or(bisected)?;
    // What led here was not compared with its checksum; these are the two records that it rests on.
    for step in [step.checked_sub(1), Some(step)].into_iter().flatten() {
        for side in sides {
            side.message(Kind::Step, step as usize);
        }
    }
    let records = [0, 1].map(|side| sides[side].step(step));
    let stages = match &records {
        [Some(a), Some(b)] => {
            let pairs = a.stages.in_order().into_iter().zip(b.stages.in_order());
            pairs.map(|((name, a), (_, b))| (name, a == b)).collect()
        }
        _ => Vec::new(),
    };
    let stage = stages.iter().find(|(_, same)| !same).map(|&(name, _)| name);
    let stages_before: Vec<_> = stages.iter().take_while(|(_, same)| *same).map(|&(name, _)| name).collect();
    let values = [0, 1].map(|side| sides[side].json::<serde_json::Value>(Kind::Step, step as usize));
    let record = match &values {
        [Some(a), Some(b)] => keys::compare(a, b),
        _ => Vec::new(),
    };
    let state = states::compare_from(sides, step, scene);
    Some(StepDifference { step, stage, stages_before, record, state })
}

fn common_steps(sides: &[Side; 2]) -> u64 {
    sides[0].count(Kind::Step).min(sides[1].count(Kind::Step)) as u64
}

fn record_differs(sides: &[Side; 2], chunks: &Chunks, step: u64) -> bool {
    let index = step as usize;
    if chunks.hold_the_same(Kind::Step, [index, index]) {
        return false;
    }
    let [a, b] = [0, 1].map(|side| {
        let message = match chunks.depth() {
            // No whole chunk is read for the sake of one record in it.
            Depth::Claims => sides[side].log.nth_unchecked(Kind::Step, index).ok(),
            Depth::Bytes => sides[side].message(Kind::Step, index),
        };
        message.map(|message| message.bytes)
    });
    a != b
}

impl Side<'_> {
    /// The chained hash of a step's record, without comparing the checksum of its chunk.
    fn chained_hash(&self, step: u64) -> Option<Hash> {
        #[derive(Deserialize)]
        struct Chained {
            chained_hash: Hash,
        }
        let message = self.log.nth_unchecked(Kind::Step, usize::try_from(step).ok()?).ok()?;
        Some(serde_json::from_slice::<Chained>(&message.bytes).ok()?.chained_hash)
    }
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

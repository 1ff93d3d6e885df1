//! `diff --explain`: the differing step once more, on this machine, from the last state that both logs have.

use crate::again::{Again, Difference};
use crate::failure::Failure;
use crate::{log_file, stop};
use recorder::Log;
use recorder::diff::Diff;
use schemas::scene::{Scene, render::Render};
use serde::Serialize;

/// What this program makes of the step at which two logs part.
#[derive(Debug, Serialize)]
pub struct Explanation {
    /// The step at which the logs part.
    pub step: u64,
    /// The state that was simulated from; `None` for the start of the run.
    pub from_step: Option<u64>,
    /// Whether both logs have one scene, apart from how it looks. If not, each is simulated with its own.
    pub same_scene: bool,
    /// Which of the logs this program agrees with.
    pub agrees_with: Agreement,
    /// Where it parts from each of them: A and B.
    pub differences: [Option<Difference>; 2],
    /// Versions of the program that wrote the logs, if they are not this one.
    pub other_versions: [Option<String>; 2],
}

/// Which of two logs this program agrees with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Agreement {
    /// The first.
    A,
    /// The second.
    B,
    /// Each with its own scene.
    Both,
    /// None of them.
    Neither,
}

/// Simulates the first differing step again; `None` if no step differs.
pub fn explain(a: &Log, b: &Log, diff: &Diff, threads: usize) -> Result<Option<Explanation>, Failure> {
    let Some(first) = &diff.first else { return Ok(None) };
    let records = [a.scene().map_err(log_file::failure)?, b.scene().map_err(log_file::failure)?];
    let same_scene = motion(&records[0].scene) == motion(&records[1].scene);
    let own = env!("CARGO_PKG_VERSION");
    let other_versions = records.map(|record| Some(record.version).filter(|version| version != own));
    let from_step = last_common_state(a, b, first.step)?;
    let simulate = |log: &Log, logs: &[&Log]| simulate(log, logs, from_step, first.step, threads);
    let differences: [Option<Difference>; 2] = if same_scene {
        simulate(a, &[a, b])?.try_into().unwrap_or_default()
    } else {
        [simulate(a, &[a])?.pop().flatten(), simulate(b, &[b])?.pop().flatten()]
    };
    let agrees_with = match differences.each_ref().map(Option::is_none) {
        [true, true] => Agreement::Both,
        [true, false] => Agreement::A,
        [false, true] => Agreement::B,
        [false, false] => Agreement::Neither,
    };
    let step = first.step;
    Ok(Some(Explanation { step, from_step, same_scene, agrees_with, differences, other_versions }))
}

/// The half of a scene that moves bodies.
fn motion(scene: &Scene) -> Scene {
    Scene { render: Render::default(), ..scene.clone() }
}

/// The last step before `step` whose state both logs keep, with the same bytes.
fn last_common_state(a: &Log, b: &Log, step: u64) -> Result<Option<u64>, Failure> {
    for step in (0..step).rev() {
        let [a, b] = [a, b].map(|log| log.state_message(step).map_err(log_file::failure));
        if let (Some(a), Some(b)) = (a?, b?)
            && a.bytes == b.bytes
        {
            return Ok(Some(step));
        }
    }
    Ok(None)
}

/// Simulates a log's scene up to a step and compares every step on the way with some logs: where each of them
/// parts from it.
fn simulate(
    log: &Log,
    logs: &[&Log],
    from_step: Option<u64>,
    step: u64,
    threads: usize,
) -> Result<Vec<Option<Difference>>, Failure> {
    let mut again = match from_step {
        Some(from) => Again::from_state(log, from, threads)?,
        None => Again::from_start(log, threads)?,
    };
    let mut differences = vec![None; logs.len()];
    for step in from_step.map_or(0, |from| from + 1)..=step {
        if stop::requested() {
            return Err(Failure::lost(format!("interrupted before step {step} was simulated again")));
        }
        let simulated = match again.advance() {
            Ok(simulated) => simulated,
            Err(reason) => {
                differences.iter_mut().for_each(|difference| {
                    difference.get_or_insert_with(|| Difference::stopped(step, &reason));
                });
                break;
            }
        };
        for (difference, log) in differences.iter_mut().zip(logs) {
            if difference.is_none() {
                *difference = again.compare(log, &simulated)?.0;
            }
        }
    }
    Ok(differences)
}

impl std::fmt::Display for Explanation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.from_step {
            Some(from) => write!(f, "explain  step {} made again from the state of step {from}", self.step)?,
            None => write!(f, "explain  step {} made again from the start of the run", self.step)?,
        }
        write!(
            f,
            ", {}",
            if self.same_scene { "which both logs have" } else { "for each log by its own scene" }
        )?;
        let verdict = match self.agrees_with {
            Agreement::A => {
                "this program agrees with A: B was made by another program or machine, or altered since"
            }
            Agreement::B => {
                "this program agrees with B: A was made by another program or machine, or altered since"
            }
            Agreement::Both if self.same_scene => {
                "this program agrees with both: what differs is not made by a step"
            }
            Agreement::Both => "this program agrees with both: the scenes make the difference",
            Agreement::Neither => "this program agrees with neither",
        };
        write!(f, "\nexplain  {verdict}")?;
        for (name, difference) in ["A", "B"].into_iter().zip(&self.differences) {
            if let Some(difference) = difference {
                write!(f, "\n{name:<8} {}", difference.to_string().replace("\n  ", "\n         "))?;
            }
        }
        for (name, version) in ["A", "B"].into_iter().zip(&self.other_versions) {
            if let Some(version) = version {
                let own = env!("CARGO_PKG_VERSION");
                write!(f, "\nnote     {name} was written by version {version}, this is {own}")?;
            }
        }
        Ok(())
    }
}

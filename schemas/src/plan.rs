//! What a scene needs and what it does not: printed by `plan`, written into the log.

use serde::{Deserialize, Serialize};

/// The choices made for a scene before its first step, in the order in which the work is done.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Plan {
    /// One line a choice.
    pub entries: Vec<PlanEntry>,
}

/// One part of the program: taken in, or left out, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanEntry {
    /// The part, as `group/part`: `force/gravity`, `contact/ring-plane`, `light/sky`.
    pub part: String,
    /// Whether the scene needs it.
    pub needed: bool,
    /// The reason, in a few words, with the values that decided.
    pub reason: String,
}

impl Plan {
    /// Adds a line.
    pub fn push(&mut self, part: &str, needed: bool, reason: impl Into<String>) {
        self.entries.push(PlanEntry { part: part.to_owned(), needed, reason: reason.into() });
    }

    /// Whether a part was taken in; a part that is not listed was not.
    pub fn needs(&self, part: &str) -> bool {
        self.entries.iter().any(|entry| entry.part == part && entry.needed)
    }
}

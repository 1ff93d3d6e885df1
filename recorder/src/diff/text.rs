//! The comparison in words.

use super::{Diff, FieldDifference, FrameDifference, Growth, KeyDifference, StateDifference, Verdict};
use crate::summary::outcome_text;
use std::fmt;

/// Keys that are listed of each half of the scene; the others are counted.
const KEYS_LISTED_MAX: usize = 12;

/// Fields of a state that are told; JSON has some more.
const FIELDS_TOLD_MAX: usize = 6;

impl fmt::Display for Diff {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.verdict {
            Verdict::Same => "same",
            Verdict::Differs => "they differ",
            Verdict::Incomparable => "they cannot be compared",
            Verdict::Damaged => "damaged",
        };
        writeln!(f, "A        {}", self.files[0])?;
        writeln!(f, "B        {}", self.files[1])?;
        write!(f, "verdict  {verdict}")?;
        for note in &self.notes {
            write!(f, "\nnote     {note}")?;
        }
        if let Some([a, b]) = &self.versions {
            write!(f, "\nversion  {a} and {b}: only the same version promises the same bits")?;
        }
        for (label, keys) in [("scene", &self.scene), ("render", &self.render), ("plan", &self.plan)] {
            write_keys(f, label, keys)?;
        }
        let [a, b] = self.step_records;
        if a != b {
            write!(f, "\nsteps    {} and {}", a.saturating_sub(1), b.saturating_sub(1))?;
        }
        self.write_ends(f)?;
        self.write_first(f)?;
        self.frames.as_ref().map_or(Ok(()), |frames| write_frames(f, frames))?;
        if self.verdict == Verdict::Incomparable || self.every_byte_compared {
            return Ok(());
        }
        let [[a, all_a], [b, all_b]] = self.chunks_read;
        write!(
            f,
            "\nread     {a} of {all_a} chunks and {b} of {all_b}: the hashes led here; --thorough compares every byte \
             before it"
        )
    }
}

impl Diff {
    /// What differs in how the runs ended. Their last hashes are told only if nothing else shows where the
    /// runs part.
    fn write_ends(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some([a, b]) = &self.ends else { return Ok(()) };
        let [outcome_a, outcome_b] = [a, b].map(|end| end.as_ref().map(|end| &end.outcome));
        if outcome_a != outcome_b {
            write!(f, "\nend      outcome: {}; {}", outcome_text(outcome_a), outcome_text(outcome_b))?;
        }
        let (Some(a), Some(b)) = (a, b) else { return Ok(()) };
        for (field, a, b) in [
            ("step_count", a.step_count, b.step_count),
            ("state_count", a.state_count, b.state_count),
            ("keyframe_count", a.keyframe_count, b.keyframe_count),
        ] {
            if a != b {
                write!(f, "\nend      {field}: {a} and {b}")?;
            }
        }
        if a.chained_hash != b.chained_hash && self.first.is_none() {
            write!(f, "\nend      chained_hash: {} and {}", a.chained_hash.short(), b.chained_hash.short())?;
        }
        Ok(())
    }

    fn write_first(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(first) = &self.first else {
            let [a, b] = self.step_records;
            let common = if a < b { a } else { b };
            if common > 0 && self.verdict != Verdict::Incomparable {
                write!(f, "\nstates   the same in all {common} step records that both have")?;
            }
            return Ok(());
        };
        write!(f, "\nfirst    step {}", first.step)?;
        match first.stage {
            Some(stage) => {
                write!(f, ", stage {stage}")?;
                if !first.stages_before.is_empty() {
                    write!(f, " (those before it agree: {})", first.stages_before.join(", "))?;
                }
            }
            None if first.record.is_empty() && first.state.is_none() => {
                write!(f, ", the bytes of its record; the states are the same")?;
            }
            None => write!(f, ", all stage hashes agree")?,
        }
        // The hashes differ whenever anything does; what they were made of says more.
        let told: Vec<_> =
            first.record.iter().filter(|difference| !difference.key.contains("hash")).cloned().collect();
        write_keys(f, "record", &told)?;
        if let Some(state) = &first.state {
            write_state(f, state, first.step)?;
        }
        for growth in &self.growth {
            let Some(later) = growth.step.checked_sub(first.step) else { continue };
            // What was measured in between is for the plot.
            if later.is_power_of_two() || later == 0 || Some(growth) == self.growth.last() {
                write_growth(f, growth, later)?;
            }
        }
        Ok(())
    }
}

fn write_growth(f: &mut fmt::Formatter<'_>, growth: &Growth, later: u64) -> fmt::Result {
    let Growth { step, position_max_m, velocity_max_m_per_s, bodies_differing, .. } = growth;
    write!(
        f,
        "\ngrowth   step {step}, {later} later: positions {position_max_m:.3e} m apart at most, velocities \
         {velocity_max_m_per_s:.3e} m/s, {bodies_differing} bodies differ"
    )
}

fn write_keys(f: &mut fmt::Formatter<'_>, label: &str, keys: &[KeyDifference]) -> fmt::Result {
    for KeyDifference { key, a, b } in keys.iter().take(KEYS_LISTED_MAX) {
        write!(f, "\n{label:<8} {key}: {} and {}", text_of(a.as_ref()), text_of(b.as_ref()))?;
    }
    if keys.len() > KEYS_LISTED_MAX {
        write!(f, "\n{label:<8} and {} keys more", keys.len() - KEYS_LISTED_MAX)?;
    }
    Ok(())
}

fn text_of(value: Option<impl fmt::Display>) -> String {
    value.map_or("not there".to_owned(), |value| value.to_string())
}

fn write_state(f: &mut fmt::Formatter<'_>, state: &StateDifference, first: u64) -> fmt::Result {
    if state.step != first {
        write!(f, "\nstate    of step {}: the first that is to be had of both logs", state.step)?;
    }
    match state.made_again {
        [false, false] => {}
        [true, true] => {
            write!(f, "\nstate    of step {}, simulated again: neither log keeps it", state.step)?
        }
        [a, _] => {
            let which = if a { "A" } else { "B" };
            write!(
                f,
                "\nstate    of step {}, simulated again for {which}, which does not keep it",
                state.step
            )?;
        }
    }
    for (what, [a, b]) in [("bodies", state.bodies), ("contact histories", state.contacts)] {
        if a != b {
            write!(f, "\nstate    {a} {what} and {b}")?;
        }
    }
    for FieldDifference { owner, field, component, a, b, a_bits, b_bits, ulp, .. } in
        state.fields.iter().take(FIELDS_TOLD_MAX)
    {
        let dot = if component.is_empty() { "" } else { "." };
        write!(f, "\nfield    {owner}, {field}{dot}{component}: {a:?} and {b:?} ({a_bits}, {b_bits}")?;
        match ulp {
            Some(ulp) => write!(f, "; {ulp} ULP apart)")?,
            None => write!(f, ")")?,
        }
    }
    let (fields, bodies) = (state.fields_differing, state.bodies_differing);
    write!(
        f,
        "\nin all   {fields} fields of step {} differ, {bodies} of {} bodies",
        state.step, state.bodies[0]
    )
}

fn write_frames(f: &mut fmt::Formatter<'_>, frames: &FrameDifference) -> fmt::Result {
    let [a, b] = frames.counts;
    if a != b {
        write!(f, "\nframes   {a} and {b}")?;
    }
    let Some(first) = &frames.first else {
        return write!(f, "\nframes   the same in all {} that both have", frames.compared);
    };
    write!(
        f,
        "\nframes   {} of {} differ, the first is frame {}",
        frames.differing, frames.compared, first.frame
    )?;
    if first.picture_is_same {
        write!(f, " (its film differs, its picture of 8 bits does not)")?;
    }
    if let Some([[width_a, height_a], [width_b, height_b]]) = frames.sizes {
        write!(f, "\npixels   {width_a} x {height_a} and {width_b} x {height_b}: not compared")?;
    }
    if let Some(error) = frames.error.filter(|error| error.max > 0) {
        write!(f, "\npixels   {:.4} of 255 apart on average, {} at most", error.mean, error.max)?;
    }
    Ok(())
}

//! What the plan left out of each scene, and what that saved.

use crate::report::{Figure, Section, Table};
use crate::timing::{Times, processor_seconds};
use crate::{Effort, NamedScene};
use schemas::Hash;
use schemas::state;
use sim_node::{Model, Records, Scratch, State, evaluate, step};

pub(crate) fn study(effort: Effort, scenes: &[NamedScene], part: &mut dyn FnMut(&str)) -> Section {
    let mut rows = Vec::new();
    let mut faults = Vec::new();
    for named in scenes {
        part(&named.name);
        match row(named, effort) {
            Ok((cells, same)) => {
                if !same {
                    faults.push(format!("left-out: {} has other bits with everything on", named.name));
                }
                rows.push(cells);
            }
            Err(reason) => rows.push(vec![named.name.clone(), reason]),
        }
    }
    rows.iter_mut().for_each(|row| row.resize(6, String::new()));
    Section {
        faults,
        id: "left-out",
        title: "What was left out".to_owned(),
        text: vec![
            "Each scene is compiled twice: as planned, and with every part forced on. The first steps are run in turn, and must give the same \
             bits."
                .to_owned(),
        ],
        figures: vec![Figure::Table(Table {
            id: "left-out".to_owned(),
            title: "Plan and time saved".to_owned(),
            caption: "Time: median of some rounds of the same steps, everything on over as planned.".to_owned(),
            head: ["scene", "left out", "as planned (s)", "everything on (s)", "ratio", "bits"].map(str::to_owned).to_vec(),
            rows,
        })],
    }
}

/// The scene's row, and whether the bits are the same.
fn row(named: &NamedScene, effort: Effort) -> Result<(Vec<String>, bool), String> {
    let (planned, plan) = Model::compile(&named.scene).map_err(|error| error.to_string())?;
    let (everything, _) = Model::compile_everything_on(&named.scene).map_err(|error| error.to_string())?;
    let wanted = effort.pick(20_000, 200_000) / planned.body_count().max(1) + 1;
    let steps = (wanted as u64).clamp(2, planned.time().step_count());
    let mut times = [Vec::new(), Vec::new()];
    let mut hashes = [String::new(), String::new()];
    for round in 0..=effort.pick(2, 5) {
        for (index, model) in [&planned, &everything].into_iter().enumerate() {
            let mut state = State::initial(model);
            let mut scratch = Scratch::new(model, 1);
            let mut records = Records::after(Hash::default());
            evaluate(model, &state, &mut scratch);
            let before = processor_seconds();
            for _ in 0..steps {
                step(model, &mut state, &mut scratch).map_err(|stop| stop.to_string())?;
            }
            let spent = processor_seconds() - before;
            records.record(model, &state, &scratch);
            if round > 0 {
                times[index].push(spent);
            }
            hashes[index] =
                state::encode(&state.header(), &state.bodies, &state.contacts, &mut Vec::new()).short();
        }
    }
    let [planned, everything] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        Times { low: times[0], median: times[times.len() / 2], high: times[times.len() - 1] }
    });
    let left_out: Vec<&str> =
        plan.entries.iter().filter(|entry| !entry.needed).map(|entry| entry.part.as_str()).collect();
    let same = hashes[0] == hashes[1];
    let cells = vec![
        named.name.clone(),
        left_out.join(", "),
        format!("{:.2e}", planned.median),
        format!("{:.2e}", everything.median),
        format!("{:.2}", everything.median / planned.median),
        if same { "same" } else { "DIFFERENT" }.to_owned(),
    ];
    Ok((cells, same))
}

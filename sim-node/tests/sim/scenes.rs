//! Every scene that comes with the program compiles, and its first steps keep links and energy.

use crate::support::Run;
use sim_node::{Records, audit, check_audit, evaluate};
use std::path::Path;

/// Ring-steps that each scene gets.
const WORK: u64 = 400_000;

#[test]
fn every_scene_starts_well() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let mut paths: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    assert!(paths.len() >= 9, "{} scenes in {}", paths.len(), folder.display());
    for path in paths {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("# "), "{name} says what it shows");
        let mut run = Run::new(&text);
        let steps = (WORK / (1 + run.model.body_count() as u64)).clamp(4, run.model.time().step_count());
        let mut records = Records::after(schemas::Hash::default());
        evaluate(&run.model, &run.state, &mut run.scratch);
        let first = records_at(&mut records, &run);
        records.check_energy(&first).unwrap();
        for _ in 0..steps {
            run.step();
            let record = records_at(&mut records, &run);
            records.check_energy(&record).unwrap_or_else(|stop| panic!("{name}: {stop}"));
            records.check_momentum().unwrap_or_else(|stop| panic!("{name}: {stop}"));
        }
        let found = audit(&run.model, &run.state);
        println!(
            "{name}: {} bodies, {steps} steps, {} links of {}",
            run.model.body_count(),
            found.links_intact,
            found.links
        );
        check_audit(&run.model, &run.state, &found).unwrap_or_else(|stop| panic!("{name}: {stop}"));
    }
}

fn records_at(records: &mut Records, run: &Run) -> schemas::step::StepRecord {
    records.record(&run.model, &run.state, &run.scratch)
}

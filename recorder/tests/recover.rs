//! A broken log and what is made of it: cut at every byte, altered at every byte, with holes, and built to be hostile.

mod sample;

use recorder::recover::{BytesError, Emit, recover_bytes};
use recorder::{Health, Kind, Log, Message, RecoverError, Recovery, Remake, recover};
use sample::Run;
use schemas::Hash;
use schemas::end::Outcome;
use schemas::scene::SceneRecord;
use schemas::state::StateMessage;
use schemas::step::StepRecord;

/// Makes the steps of the sample run again, and says how many it made.
struct Again {
    run: Run,
    made: u64,
    /// Alters a number that no hash covers but that of the chain of the next state.
    wrong: bool,
}

impl Remake for Again {
    fn remake(
        &mut self,
        scene: &SceneRecord,
        state: StateMessage,
        chained_hash: Hash,
        last: u64,
        emit: Emit<'_>,
    ) -> Result<(), String> {
        assert_eq!(scene.scene, self.run.scene());
        let all = Run { state_every: 1, ..self.run }.messages();
        let bytes = |kind: Kind, step: u64| all.0[kind.index()][step as usize].bytes.to_vec();
        let record = |step| serde_json::from_slice::<StepRecord>(&bytes(Kind::Step, step)).expect("JSON");
        assert_eq!(record(state.header.step).chained_hash, chained_hash);
        let mut chained_hash = chained_hash;
        for step in state.header.step + 1..=last {
            self.made += 1;
            let mut record = record(step);
            let mut state = bytes(Kind::State, step);
            if self.wrong {
                let header =
                    schemas::state::StateHeader { step, sim_time_s: record.sim_time_s, ..Default::default() };
                let bodies = sample::bodies(step + 1, self.run.rings);
                record.state_hash = schemas::state::encode(&header, &bodies, &[], &mut state);
                record.stages.state = record.state_hash.short();
                chained_hash = schemas::chain(&chained_hash, &record.state_hash);
                record.chained_hash = chained_hash;
            }
            emit(&record, &state)?;
        }
        Ok(())
    }
}

fn rebuilt(broken: &[u8], remake: Option<&mut dyn Remake>) -> Result<(Vec<u8>, Recovery), BytesError> {
    recover_bytes(broken, &mut || Ok(Vec::new()), remake)
}

/// What holds for every recovered log: it is whole, and all of it was in the original.
fn check(bytes: &[u8], recovery: &Recovery, original: &[Message], place: &str) {
    let log = Log::from_bytes("recovered", bytes.to_vec()).unwrap_or_else(|error| panic!("{place}: {error}"));
    assert_eq!(log.health(), Health::Complete, "{place}");
    let checker = log.check(&mut |_, _| {}).unwrap_or_else(|error| panic!("{place}: {error}"));
    assert_eq!(checker.counts(), recovery.counts, "{place}");
    assert_eq!(recovery.last_step + 1, recovery.counts.step_records, "{place}");
    for kind in Kind::ALL.into_iter().filter(|kind| *kind != Kind::End) {
        let mut expected = original.iter().filter(|message| message.kind == kind);
        for message in
            log.messages().map(|message| message.expect("whole")).filter(|message| message.kind == kind)
        {
            assert_eq!(Some(&message), expected.next(), "{place}");
        }
    }
    let end = log.end().expect("whole").expect("an end");
    assert_eq!(end.outcome, recovery.outcome, "{place}");
    assert_eq!(end.step_count, recovery.last_step, "{place}");
}

const RUN: Run = Run { rings: 2, steps_planned: 24, steps: 24, state_every: 1, renderer: true };

#[test]
fn a_log_cut_at_any_byte_is_made_whole() {
    for run in [Run::default(), RUN, Run { state_every: 5, ..RUN }, Run { renderer: false, ..RUN }] {
        let (bytes, original) = (run.log_bytes(), run.in_order());
        let mut whole = 0;
        // The shorter log at every byte; of the others, every byte from the third-last keyframe's chunk on.
        let from = if run.steps < 24 { 0 } else { bytes.len() * 7 / 8 };
        for cut in from..=bytes.len() {
            let (place, file) = (format!("{run:?} cut at {cut}"), &bytes[..cut]);
            match rebuilt(file, None) {
                Ok((made, recovery)) => {
                    check(&made, &recovery, &original, &place);
                    let left = Log::from_bytes("cut", file.to_vec()).expect("it was recovered");
                    // A step without its state, where a chunk ends between them, is no step.
                    assert!(recovery.counts.step_records as usize >= left.count(Kind::Step), "{place}");
                    assert_eq!(recovery.counts.frames as usize, left.count(Kind::FrameInfo), "{place}");
                    if recovery.is_complete() {
                        whole += 1;
                        assert!(made == bytes, "{place}: nothing is lost, but the log differs");
                    } else {
                        assert!(matches!(recovery.outcome, Outcome::Recovered(_)), "{place}");
                    }
                }
                Err(BytesError::Problem(problem)) => assert!(cut < 8, "{place}: {problem}"),
                Err(BytesError::Nothing(_)) => assert!(
                    Log::from_bytes("cut", file.to_vec()).expect("a log").count(Kind::Step) == 0,
                    "{place}"
                ),
                Err(BytesError::Io(error)) => panic!("{place}: {error}"),
            }
        }
        println!("{run:?}: {} bytes, {whole} cuts without a loss", bytes.len());
        assert!(whole > 500, "cuts within the index lose nothing");
    }
}

#[test]
fn an_altered_byte_costs_a_chunk_at_most_and_nothing_with_a_simulator() {
    let run = Run { renderer: false, steps_planned: 10, steps: 10, ..RUN };
    let (bytes, original) = (run.log_bytes(), run.in_order());
    let first_chunk =
        Log::from_bytes("first", bytes[..bytes.len() / 3].to_vec()).expect("a log").count(Kind::Step);
    assert!(first_chunk >= 1);
    let (mut identical, mut remade, mut lost) = (0, 0, 0);
    for index in 0..bytes.len() {
        {
            let mask = [1, 0x80, 0xFF][index % 3];
            let place = format!("byte {index} ^ {mask:#x}");
            let mut altered = bytes.clone();
            altered[index] ^= mask;
            if let Ok((made, recovery)) = rebuilt(&altered, None) {
                check(&made, &recovery, &original, &place);
            }
            let mut again = Again { run, made: 0, wrong: false };
            match rebuilt(&altered, Some(&mut again)) {
                Ok((made, recovery)) => {
                    check(&made, &recovery, &original, &place);
                    assert_eq!(recovery.steps_remade > 0, again.made > 0, "{place}");
                    identical += usize::from(made == bytes);
                    remade += usize::from(again.made > 0);
                    // Only the end itself, in the last chunk, cannot be made again.
                    assert!(recovery.last_step >= 8, "{place}: {recovery}");
                }
                Err(_) => lost += 1,
            }
        }
    }
    println!(
        "{} altered files: {identical} made as they were, {remade} of them with steps simulated again, {lost} without a scene",
        bytes.len()
    );
    assert!(remade > 1000 && 2 * identical > bytes.len());
}

#[test]
fn frames_after_a_lost_one_are_said_to_be_lost() {
    let (bytes, original) = (RUN.log_bytes(), RUN.in_order());
    let needle = sample::png(4);
    let at = bytes.windows(needle.len()).position(|window| window == needle).expect("the frame of step 4");
    let mut altered = bytes.clone();
    altered[at + 40] ^= 1;
    let mut again = Again { run: RUN, made: 0, wrong: false };
    let (made, recovery) = rebuilt(&altered, Some(&mut again)).expect("a log");
    check(&made, &recovery, &original, "a lost frame");
    assert_eq!((recovery.last_step, recovery.counts.frames), (24, 2), "{recovery}");
    assert_eq!(recovery.frames_lost + recovery.counts.frames, recovery.frames_due);
    assert!(!recovery.is_complete() && recovery.steps_remade > 0);
    // The run has ended as it said; only frames are missing.
    assert_eq!(recovery.outcome, Outcome::Completed);
}

#[test]
fn what_is_made_again_wrongly_is_not_taken() {
    let run = Run { renderer: false, ..RUN };
    let (bytes, original) = (run.log_bytes(), run.in_order());
    let mut altered = bytes.clone();
    altered[bytes.len() / 2] ^= 1;
    let plain = rebuilt(&altered, None).expect("a log").1;
    let mut wrong = Again { run, made: 0, wrong: true };
    let (made, recovery) = rebuilt(&altered, Some(&mut wrong)).expect("a log");
    assert!(wrong.made > 0);
    check(&made, &recovery, &original, "made wrongly");
    assert_eq!(recovery.last_step, plain.last_step);
    let reason = recovery.remake_failed.expect("a reason");
    assert!(reason.contains("chained hash") || reason.contains("others"), "{reason}");
}

#[test]
fn a_file_made_to_cost_much_does_not() {
    // Half a million heads of chunks, each of which claims all the rest of the file.
    let mut file = RUN.log_bytes();
    file.truncate(file.len() / 2);
    let total = file.len() + 49 * (1 << 15);
    while file.len() < total {
        let left = (total - file.len()) as u64;
        file.push(0x06);
        file.extend((left - 9).to_le_bytes());
        file.extend([0; 16]);
        file.extend((left - 49).to_le_bytes());
        file.extend([0; 8]);
        file.extend((left - 49).to_le_bytes());
    }
    let (made, recovery) = rebuilt(&file, None).expect("a log");
    check(&made, &recovery, &RUN.in_order(), "hostile");
}

#[test]
fn files_are_made_at_once_or_not_at_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let bytes = RUN.log_bytes();
    std::fs::write(path("cut.mcap"), &bytes[..bytes.len() / 2]).expect("a file");
    std::fs::write(path("mine.mcap"), "mine").expect("a file");
    let error = recover(&path("cut.mcap"), &path("mine.mcap"), false, None).expect_err("it exists");
    assert!(matches!(error, RecoverError::Exists { .. }) && error.to_string().contains("--force"), "{error}");
    assert_eq!(std::fs::read(path("mine.mcap")).expect("a file"), b"mine");
    let recovery = recover(&path("cut.mcap"), &path("new.mcap"), false, None).expect("a log");
    assert!(recovery.steps_lost == 0 && recovery.last_step < 24, "{recovery}");
    let text = recovery.to_string();
    for word in ["at byte", "of 24", "frames", "recovered"] {
        assert!(text.contains(word), "'{word}' is not in:\n{text}");
    }
    recover(&path("cut.mcap"), &path("mine.mcap"), true, None).expect("a log");
    assert!(
        std::fs::read(path("mine.mcap")).expect("a file") == std::fs::read(path("new.mcap")).expect("a file")
    );
    // What cannot be recovered leaves nothing behind, and neither does a folder that is not there.
    std::fs::write(path("start.mcap"), &bytes[..50]).expect("a file");
    assert!(matches!(
        recover(&path("start.mcap"), &path("none.mcap"), false, None),
        Err(RecoverError::Nothing { .. })
    ));
    std::fs::write(path("text.mcap"), "some words, no log at all").expect("a file");
    assert!(matches!(
        recover(&path("text.mcap"), &path("none.mcap"), false, None),
        Err(RecoverError::Log(_))
    ));
    assert!(matches!(
        recover(&path("cut.mcap"), &path("no/none.mcap"), false, None),
        Err(RecoverError::Write { .. })
    ));
    let names: std::collections::BTreeSet<_> =
        folder.path().read_dir().expect("a folder").map(|entry| entry.expect("one").file_name()).collect();
    assert_eq!(
        names,
        ["cut.mcap", "mine.mcap", "new.mcap", "start.mcap", "text.mcap"].map(Into::into).into()
    );
}

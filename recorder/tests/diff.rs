//! What differs is found, exactly: the step, the stage, the body, the field, the bits.

mod sample;

use proptest::prelude::*;
use prost::Message as _;
use recorder::diff::{Diff, Verdict, diff};
use recorder::{Health, Kind, Log, Summary};
use sample::{BODIES_AT, Run, another_run, flip, write};
use schemas::end::End;
use schemas::frame::{CompressedImage, FrameInfo};
use schemas::step::StepRecord;
use schemas::{Hash, chain, state, wire};

const RUN: Run = Run { rings: 3, steps_planned: 20, steps: 20, state_every: 1, renderer: true };
const FIELDS: [(&str, &str); 13] = [
    ("position_m", "x"),
    ("position_m", "y"),
    ("position_m", "z"),
    ("orientation", "x"),
    ("orientation", "y"),
    ("orientation", "z"),
    ("orientation", "w"),
    ("linear_velocity_m_per_s", "x"),
    ("linear_velocity_m_per_s", "y"),
    ("linear_velocity_m_per_s", "z"),
    ("angular_velocity_rad_per_s", "x"),
    ("angular_velocity_rad_per_s", "y"),
    ("angular_velocity_rad_per_s", "z"),
];

fn open(name: &str, bytes: Vec<u8>) -> Log {
    Log::from_bytes(name, bytes).expect("a log")
}

fn compare(a: Vec<u8>, b: Vec<u8>) -> Diff {
    diff(&open("a.mcap", a), &open("b.mcap", b))
}

fn expected_bits(step: u64, body: usize, field: usize, bit: u32) -> (String, String) {
    let value = field_value(step, body, field).to_bits();
    (format!("{value:#018x}"), format!("{:#018x}", value ^ (1 << bit)))
}

fn field_value(step: u64, body: usize, field: usize) -> f64 {
    let body = sample::bodies(step, RUN.rings)[body];
    let all = [
        &body.position_m[..],
        &body.orientation,
        &body.linear_velocity_m_per_s,
        &body.angular_velocity_rad_per_s,
    ];
    all.concat()[field]
}

fn check_first(found: &Diff, step: u64, body: usize, field: usize, bit: u32) -> Result<(), TestCaseError> {
    let first = found.first.as_ref().expect("a difference");
    prop_assert_eq!(first.step, step);
    let state = first.state.as_ref().expect("states to compare");
    prop_assert_eq!((state.step, state.fields_differing, state.bodies_differing), (step, 1, 1));
    let difference = &state.fields[0];
    prop_assert_eq!(difference.owner.clone(), format!("ring {body}"));
    prop_assert_eq!(difference.body, Some(body));
    prop_assert_eq!((difference.field, difference.component), FIELDS[field]);
    let (a_bits, b_bits) = expected_bits(step, body, field, bit);
    prop_assert_eq!(&difference.a_bits, &a_bits);
    prop_assert_eq!(&difference.b_bits, &b_bits);
    let text = found.to_string();
    for word in [&format!("step {step}"), &difference.owner, FIELDS[field].0, &a_bits, &b_bits] {
        prop_assert!(text.contains(word), "'{}' is not in:\n{}", word, text);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn a_run_that_went_another_way_by_one_bit_is_found(
        step in 0..=20_u64, body in 0..3_usize, field in 0..13_usize, bit in 0..64_u32, later in any::<bool>(),
    ) {
        let other = another_run(RUN, |at, bytes| {
            if at == step {
                flip(bytes, body, field, bit);
            } else if at > step && later {
                flip(bytes, 0, 0, 3);
            }
        });
        let found = compare(RUN.log_bytes(), other);
        prop_assert_eq!(found.verdict, Verdict::Differs);
        prop_assert!(found.notes.is_empty(), "{:?}", found.notes);
        prop_assert_eq!(found.first.as_ref().and_then(|first| first.stage), Some("state"));
        check_first(&found, step, body, field, bit)?;
    }

    #[test]
    fn a_state_altered_in_the_file_by_one_bit_is_found_and_called_damage(
        step in 0..=20_u64, body in 0..3_usize, field in 0..13_usize, bit in 0..64_u32, crc in any::<bool>(),
    ) {
        let original = RUN.log_bytes();
        let altered = alter_in_file(&original, step, crc, |bytes| flip(bytes, body, field, bit));
        let found = compare(original.clone(), altered);
        prop_assert_eq!(found.verdict, Verdict::Damaged);
        let notes = found.notes.join("\n");
        prop_assert!(notes.contains("b.mcap") && !notes.contains("a.mcap"), "{}", notes);
        prop_assert!(notes.contains(&format!("the state of step {step} is not as it was written")), "{}", notes);
        prop_assert_eq!(notes.contains("CRC"), !crc);
        check_first(&found, step, body, field, bit)?;
    }
}

/// Alters a state where it lies; with `mend_crc`, its chunk's checksum is made right again.
fn alter_in_file(log: &[u8], step: u64, mend_crc: bool, alter: impl Fn(&mut [u8])) -> Vec<u8> {
    sample::alter_in_file(log, (Kind::State, step as usize), mend_crc, alter)
}

#[test]
fn the_same_log_is_the_same() {
    let found = compare(RUN.log_bytes(), RUN.log_bytes());
    assert_eq!(found.verdict, Verdict::Same, "{found}");
    assert!(found.to_string().contains("the same in all 21 step records"), "{found}");
    serde_json::to_string(&found).expect("JSON");
    // Log every state or few: the run is the same, the key is not.
    let few = Run { state_every: 7, ..RUN };
    let found = compare(RUN.log_bytes(), few.log_bytes());
    assert_eq!(found.verdict, Verdict::Differs);
    assert!(found.first.is_none());
    assert_eq!(found.scene[0].key, "record.state_every");
    let text = found.to_string();
    let ends: Vec<_> = text.lines().filter(|line| line.starts_with("end ")).collect();
    let [ends] = ends[..] else { panic!("one field of the ends differs:\n{text}") };
    assert!(ends.starts_with("end      state_count: 21 and "), "{ends}");
}

#[test]
fn a_skipped_state_is_compared_at_the_next_one_that_was_logged() {
    let few = Run { state_every: 8, renderer: false, ..RUN };
    let mut hash = None;
    let mut messages = few.in_order();
    // Another run from step 5 on, where no state was logged: only hashes tell.
    let mut chained_hash = Hash::default();
    for message in &mut messages {
        let bytes = message.bytes.to_mut();
        match message.kind {
            Kind::State if state::decode_header(bytes).expect("a state").step >= 5 => {
                flip(bytes, 1, 9, 0);
                let new = state::hash_of(bytes);
                bytes[24..56].copy_from_slice(&new.0);
                hash = Some(new);
            }
            Kind::Step => {
                let mut record: StepRecord = serde_json::from_slice(bytes).expect("a record");
                if record.step >= 5 {
                    record.state_hash = hash.take().unwrap_or(Hash::of(&record.step.to_le_bytes()));
                    record.stages.state = record.state_hash.short();
                    record.stages.forces = "0".repeat(16);
                }
                chained_hash = chain(&chained_hash, &record.state_hash);
                record.chained_hash = chained_hash;
                *bytes = serde_json::to_vec(&record).expect("JSON");
            }
            Kind::End => {
                let end: End = wire::decode(bytes).expect("an end");
                *bytes = wire::encode(&End { chained_hash, ..end });
            }
            _ => {}
        }
    }
    let found = compare(few.log_bytes(), write(&messages, false));
    let first = found.first.as_ref().expect("a difference");
    assert_eq!((first.step, first.stage), (5, Some("forces")), "{found}");
    let state = first.state.as_ref().expect("a later state");
    // Steps 0, 2, 4, 6, ... have frames, so 6 is the next that was logged.
    assert_eq!((state.step, state.fields[0].owner.as_str(), state.fields[0].component), (6, "ring 1", "z"));
    assert_eq!(state.fields[0].ulp, Some(1));
    assert!(found.to_string().contains("of step 6: the first that is to be had of both logs"), "{found}");
}

#[test]
fn growth_is_measured_at_doubling_distances() {
    let other = another_run(RUN, |step, bytes| {
        if step >= 3 {
            let apart_m = 1e-9 * (step - 2) as f64;
            let x = field_value(step, 2, 0) + apart_m;
            bytes[BODIES_AT + 208..BODIES_AT + 216].copy_from_slice(&x.to_le_bytes());
        }
    });
    let found = compare(RUN.log_bytes(), other);
    let growth: Vec<_> = found.growth.iter().map(|growth| growth.step).collect();
    assert_eq!(growth, [3, 4, 5, 7, 11, 19]);
    for growth in &found.growth {
        let expected_m = 1e-9 * (growth.step - 2) as f64;
        // A position of about 2.5 m carries an error of half an ULP, 2.2e-16 m.
        assert!((growth.position_max_m - expected_m).abs() < 5e-16, "{growth:?}");
    }
}

#[test]
fn a_shorter_run_is_the_same_as_far_as_it_goes() {
    let shorter = Run { steps: 13, ..RUN };
    let found = compare(RUN.log_bytes(), shorter.log_bytes());
    assert_eq!(found.verdict, Verdict::Differs);
    assert_eq!((found.step_records, &found.first), ([21, 14], &None));
    let text = found.to_string();
    assert!(text.contains("20 and 13") && text.contains("completed; interrupted"), "{text}");
    assert!(text.contains("the same in all 14"), "{text}");
}

#[test]
fn another_number_of_rings_is_told() {
    let found = compare(RUN.log_bytes(), Run { rings: 2, ..RUN }.log_bytes());
    assert_eq!(found.verdict, Verdict::Differs);
    let state = found.first.and_then(|first| first.state).expect("states to compare");
    assert_eq!((state.step, state.bodies), (0, [3, 2]));
    assert!(found.scene.iter().any(|difference| difference.key == "ring.2" && difference.b.is_none()));
}

#[test]
fn a_cut_log_is_compared_as_far_as_it_goes() {
    let whole = RUN.log_bytes();
    let found = compare(whole.clone(), whole[..whole.len() / 2].to_vec());
    assert_eq!(found.verdict, Verdict::Damaged);
    assert!(found.first.is_none() && found.step_records[1] > 3 && found.step_records[1] < 21, "{found}");
    assert!(found.notes[0].contains("b.mcap: truncated"), "{found}");
    for cut in (8..whole.len()).step_by(41) {
        let found = compare(whole.clone(), whole[..cut].to_vec());
        assert_eq!(found.verdict, Verdict::Damaged, "cut at {cut}");
        assert!(found.first.is_none(), "cut at {cut}: {found}");
    }
}

#[test]
fn an_altered_step_record_is_damage_and_no_divergence() {
    let original = RUN.log_bytes();
    let mut altered = original.clone();
    let record = open("a", original.clone()).step_message(9).expect("a record").bytes.into_owned();
    let at = altered.windows(record.len()).position(|window| window == record).expect("it lies in the file");
    // A digit of the first energy: the record still parses.
    let digit = record.windows(18).position(|window| window == b"\"kinetic_energy_j\"").expect("a key") + 19;
    altered[at + digit] ^= 1;
    let found = compare(original, altered);
    assert_eq!(found.verdict, Verdict::Damaged);
    assert!(found.notes.iter().any(|note| note.contains("b.mcap") && note.contains("CRC")), "{found}");
    let first = found.first.expect("a difference");
    assert_eq!((first.step, first.stage, first.state, found.growth), (9, None, None, Vec::new()));
    assert_eq!(first.record[0].key, "kinetic_energy_j");
}

/// The run's log with other pictures: `change` gives a frame's PNG and whether its film differs.
fn with_pictures(change: impl Fn(usize) -> Option<Vec<u8>>) -> Vec<u8> {
    let mut messages = RUN.in_order();
    let (mut frame, mut changed) = (0, false);
    for message in &mut messages {
        let bytes = message.bytes.to_mut();
        match message.kind {
            Kind::Frame => {
                let new = change(frame);
                changed = new.is_some();
                if let Some(png) = new {
                    *bytes = CompressedImage::png(message.log_time_ns, png).encode_to_vec();
                }
                frame += 1;
            }
            Kind::FrameInfo if changed => {
                let mut info: FrameInfo = serde_json::from_slice(bytes).expect("an info");
                info.film_hash = Hash::of(b"another film");
                *bytes = serde_json::to_vec(&info).expect("JSON");
            }
            _ => {}
        }
    }
    write(&messages, true)
}

#[test]
fn frames_are_compared_by_pixels() {
    // Ten frames, of grey 0, 2, 4, ...: frame 3 is 5 brighter, frame 7 is 1 darker.
    let other = with_pictures(|frame| match frame {
        3 => Some(sample::png(6 + 5)),
        7 => Some(sample::png(14 - 1)),
        _ => None,
    });
    let found = compare(RUN.log_bytes(), other);
    assert_eq!(found.verdict, Verdict::Differs);
    assert!(found.first.is_none());
    let frames = found.frames.as_ref().expect("frames");
    assert_eq!((frames.compared, frames.differing), (10, 2));
    let first = frames.first.as_ref().expect("a frame");
    assert_eq!((first.frame, first.steps, first.picture_is_same), (3, [Some(6), Some(6)], false));
    let error = frames.error.expect("pictures of one size");
    assert_eq!((error.mean, error.max), (0.6, 5));
    assert!(found.to_string().contains("2 of 10 differ, the first is frame 3"), "{found}");
}

#[test]
fn a_film_that_differs_below_8_bits_is_told_so() {
    let found = compare(RUN.log_bytes(), with_pictures(|frame| (frame == 4).then(|| sample::png(8))));
    let first = found.frames.and_then(|frames| frames.first).expect("a frame");
    assert!(first.frame == 4 && first.picture_is_same);
}

#[test]
fn pictures_that_are_none_are_damage() {
    let found =
        compare(RUN.log_bytes(), with_pictures(|frame| (frame == 2).then(|| b"not a picture".to_vec())));
    assert_eq!(found.verdict, Verdict::Damaged);
    assert!(found.notes[0].contains("the picture of frame 2 cannot be read"), "{found}");
}

#[test]
fn a_log_without_frames_differs_from_one_with_them() {
    let found = compare(RUN.log_bytes(), Run { renderer: false, ..RUN }.log_bytes());
    assert_eq!(found.verdict, Verdict::Differs);
    assert_eq!(found.frames.expect("frames").counts, [10, 0]);
}

#[test]
fn the_summary_of_a_log() {
    let summary = Summary::of(&RUN.log()).expect("a summary");
    assert_eq!((summary.rings, summary.steps, summary.steps_planned, summary.frames), (3, 20, 20, 10));
    assert_eq!((summary.states, summary.state_bytes), (21, 21 * (56 + 8 + 3 * 104 + 8 + 56)));
    assert_eq!((summary.links, summary.links_intact, summary.gap_min_m), (Some(1), Some(1), Some(0.01)));
    assert_eq!(summary.health, Health::Complete);
    // Made up: kinetic 0.1 k, gravity 1 - 0.1 k, penetration 1e-4 k at step k; the wire is 0.2 m thick.
    let energy = summary.energy.expect("steps");
    assert!((energy.start_j - 1.0).abs() < 1e-15 && energy.drift_j.abs() < 1e-15, "{energy:?}");
    assert_eq!(energy.exchanged_max_j, 2.0);
    assert_eq!(summary.penetration_max_m, 2e-3);
    assert!((summary.penetration_max_share.expect("rings") - 0.01).abs() < 1e-15);
    let text = summary.to_string();
    for word in ["steps", "energy", "penetration", "1.000 %", "1 of 1 intact", "hash", "complete"] {
        assert!(text.contains(word), "'{word}' is not in:\n{text}");
    }
}

#[test]
fn the_summary_of_a_damaged_log_says_so() {
    let bytes = RUN.log_bytes();
    let cut = Summary::of(&open("cut", bytes[..bytes.len() / 2].to_vec())).expect("a summary");
    assert!(matches!(cut.health, Health::Truncated { .. }), "{}", cut.health);
    assert!(cut.steps > 3 && cut.steps < 20 && cut.outcome.is_none());
    let flipped = alter_in_file(&bytes, 9, false, |state| state[70] ^= 1);
    let log = open("flipped", flipped);
    assert_eq!(log.health(), Health::Complete, "its index is whole");
    let flipped = Summary::of(&log).expect("a summary");
    assert!(matches!(flipped.health, Health::Damaged { .. }), "{}", flipped.health);
    assert_eq!(log.health(), flipped.health, "what was found is known from then on");
    assert!(flipped.steps < 9 && flipped.to_string().contains("offset"));
    let mended = alter_in_file(&bytes, 9, true, |state| state[70] ^= 1);
    let mended = Summary::of(&open("mended", mended)).expect("a summary");
    let Health::Inconsistent { what } = &mended.health else { panic!("{}", mended.health) };
    assert!(what.contains("step 9") && what.contains("state hash"), "{what}");
}

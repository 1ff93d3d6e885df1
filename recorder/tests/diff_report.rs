//! How much `diff` reads, what it makes of frames, and its HTML page.

mod sample;

use recorder::diff::{Diff, Options, Verdict, diff, diff_with, difference_picture, html};
use recorder::{Kind, Log};
use sample::{Run, alter_in_file, another_run, flip, write};
use schemas::Hash;
use schemas::frame::{CompressedImage, FrameInfo};
use schemas::step::StepRecord;

/// A chunk ends at each frame, so this has 200 chunks.
const LONG: Run = Run { rings: 3, steps_planned: 400, steps: 400, state_every: 1, renderer: true };

fn open(name: &str, bytes: Vec<u8>) -> Log {
    Log::from_bytes(name, bytes).expect("a log")
}

fn flipped_from(step: u64) -> Vec<u8> {
    another_run(LONG, |at, bytes| {
        if at >= step {
            flip(bytes, 1, 0, 0);
        }
    })
}

#[test]
fn where_hashes_lead_there_no_more_is_read() {
    for step in [0, 1, 136, 137, 200, 399, 400] {
        let (a, b) = (open("a", LONG.log_bytes()), open("b", flipped_from(step)));
        let found = diff(&a, &b);
        let first = found.first.as_ref().expect("a difference");
        assert_eq!((first.step, first.stage, found.verdict), (step, Some("state"), Verdict::Differs));
        assert_eq!(first.stages_before, ["candidate_pairs", "contacts", "forces"]);
        assert!(!found.every_byte_compared);
        // The scene, the step before, the step, at most ten steps of growth, the end: each in a chunk of its own.
        for [read, all] in found.chunks_read {
            println!("step {step}: {read} of {all} chunks");
            assert!(all >= 200 && read <= 14, "{read} of {all}");
        }
        assert!(found.to_string().contains("--thorough"), "{found}");
    }
}

#[test]
fn without_a_difference_every_byte_is_compared() {
    let (a, b) = (open("a", LONG.log_bytes()), open("b", LONG.log_bytes()));
    let found = diff(&a, &b);
    assert_eq!((found.verdict, found.every_byte_compared), (Verdict::Same, true));
    // One check serves two chunks of the same bytes.
    let [[read, all], _] = found.chunks_read;
    assert_eq!(read, all);
    // The same damage in both logs is damage all the same.
    let damaged = alter_in_file(&LONG.log_bytes(), (Kind::Step, 77), false, |bytes| bytes[40] ^= 1);
    let found = diff(&open("a", damaged.clone()), &open("b", damaged));
    assert_eq!((found.verdict, &found.first), (Verdict::Damaged, &None));
    assert_eq!(found.notes.len(), 2, "{found}");
    // A picture that was altered is not seen by the film's hash, and is by its bytes.
    let damaged = alter_in_file(&LONG.log_bytes(), (Kind::Frame, 150), true, |bytes| {
        let last = bytes.len() - 30;
        bytes[last] ^= 1;
    });
    let found = diff(&a, &open("b", damaged));
    assert_eq!(found.frames.expect("frames").first.expect("a frame").frame, 150);
}

#[test]
fn thorough_finds_what_was_altered_in_the_file_before_the_runs_part() {
    let altered = alter_in_file(&flipped_from(300), (Kind::State, 50), false, |bytes| flip(bytes, 2, 4, 7));
    let (a, b) = (open("a", LONG.log_bytes()), open("b", altered));
    let quick = diff(&a, &b);
    assert_eq!((quick.verdict, quick.first.expect("a difference").step), (Verdict::Differs, 300));
    let thorough = diff_with(&a, &b, Options { thorough: true, ..Options::default() });
    assert_eq!((thorough.verdict, thorough.every_byte_compared), (Verdict::Damaged, true));
    let first = thorough.first.expect("a difference");
    let field = &first.state.as_ref().expect("a state").fields[0];
    assert_eq!(
        (first.step, first.stage, field.owner.as_str(), field.field),
        (50, None, "ring 2", "orientation")
    );
}

/// The log with another step record at a step.
fn with_record(log: &[u8], step: u64, change: impl Fn(&mut StepRecord)) -> Vec<u8> {
    let log = open("a", log.to_vec());
    let mut messages: Vec<_> = log.messages().map(|message| message.expect("whole")).collect();
    let mut records = messages.iter_mut().filter(|message| message.kind == Kind::Step);
    let bytes = records.nth(step as usize).expect("a record").bytes.to_mut();
    let mut record = serde_json::from_slice(bytes).expect("a record");
    change(&mut record);
    *bytes = serde_json::to_vec(&record).expect("JSON");
    write(&messages, true)
}

#[test]
fn a_stage_that_differs_before_any_state_does_is_the_first() {
    for (step, stage, before) in [(31, "contacts", 1), (32, "candidate_pairs", 0), (33, "forces", 2)] {
        let other = with_record(&flipped_from(40), step, |record| {
            let stage = match stage {
                "candidate_pairs" => &mut record.stages.candidate_pairs,
                "contacts" => &mut record.stages.contacts,
                _ => &mut record.stages.forces,
            };
            *stage = Hash::of(b"another").short();
        });
        let found = diff(&open("a", LONG.log_bytes()), &open("b", other));
        let first = found.first.as_ref().expect("a difference");
        assert_eq!((first.step, first.stage, first.stages_before.len()), (step, Some(stage), before));
        // The state of that step is the same; the next that differs is shown.
        assert_eq!(first.state.as_ref().expect("a state").step, 40);
    }
}

#[test]
fn a_scene_that_only_another_version_can_read_is_refused_with_the_reason() {
    let newer = alter_in_file(&LONG.log_bytes(), (Kind::Scene, 0), true, |bytes| {
        for (old, new) in
            [(&b"\"version\":\"0.1.0\""[..], &b"\"version\":\"9.9.9\""[..]), (b"\"seed\"", b"\"sead\"")]
        {
            let at = bytes.windows(old.len()).position(|window| window == old).expect("it is in a scene");
            bytes[at..at + old.len()].copy_from_slice(new);
        }
    });
    let found = diff(&open("a.mcap", LONG.log_bytes()), &open("b.mcap", newer));
    assert_eq!(found.verdict, Verdict::Incomparable, "{found}");
    for word in ["b.mcap", "9.9.9", env!("CARGO_PKG_VERSION"), "sead"] {
        assert!(found.notes[0].contains(word), "{found}");
    }
}

/// Frames 3, 5 and 6 of the log get other pictures and films.
fn other_frames() -> Vec<u8> {
    let mut messages = LONG.in_order();
    for kind in [Kind::Frame, Kind::FrameInfo] {
        let of_kind = messages.iter_mut().filter(|message| message.kind == kind);
        for (frame, message) in of_kind.enumerate().filter(|(frame, _)| [3, 5, 6].contains(frame)) {
            let time_ns = message.log_time_ns;
            let bytes = message.bytes.to_mut();
            if kind == Kind::Frame {
                use prost::Message as _;
                // Frame k shows grey 2k.
                let grey = 2 * frame as u8 + [0, 0, 0, 30, 0, 2, 1][frame];
                *bytes = CompressedImage::png(time_ns, sample::png(grey)).encode_to_vec();
            } else {
                let mut info: FrameInfo = serde_json::from_slice(bytes).expect("an info");
                info.film_hash = Hash::of(b"another film");
                *bytes = serde_json::to_vec(&info).expect("JSON");
            }
        }
    }
    write(&messages, true)
}

#[test]
fn each_differing_frame_has_its_error_and_a_picture() {
    let (a, b) = (open("a", LONG.log_bytes()), open("b", other_frames()));
    let found = diff(&a, &b).frames.expect("frames");
    let errors: Vec<_> =
        found.errors.iter().map(|frame| (frame.frame, frame.error.expect("one size"))).collect();
    let told: Vec<_> = errors.iter().map(|(frame, error)| (*frame, error.mean, error.max)).collect();
    assert_eq!(told, [(3, 30.0, 30), (5, 2.0, 2), (6, 1.0, 1)]);
    let picture = difference_picture(&a, &b, 3).expect("a picture");
    assert_eq!(picture.gain, 8, "8 times 30 is the largest multiple below 256");
    let mut reader = png::Decoder::new(std::io::Cursor::new(picture.png)).read_info().expect("a PNG");
    let mut levels = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut levels).expect("a PNG");
    assert_eq!((info.width, info.height), (6, 2));
    let row = [[6; 6], [36; 6], [240; 6]].concat();
    assert_eq!(levels, [row.clone(), row].concat());
    assert!(difference_picture(&a, &b, 999).expect_err("no such frame").contains("no /frame message 999"));
}

fn page(found: &Diff, a: &Log, b: &Log) -> String {
    let pictures: Vec<_> =
        found.frames.iter().flat_map(|frames| &frames.errors).map(|error| error.frame).take(1).collect();
    let pictures: Vec<_> = pictures
        .into_iter()
        .map(|frame| (frame, difference_picture(a, b, frame).expect("a picture")))
        .collect();
    html(found, &pictures)
}

#[test]
fn the_page_needs_nothing_else_and_says_what_the_text_says() {
    let apart = another_run(LONG, |step, bytes| {
        if step >= 3 {
            // Positions drift apart by 1e-9 m a step.
            let at = sample::BODIES_AT + 2 * 104;
            let x = f64::from_le_bytes(bytes[at..at + 8].try_into().expect("8 bytes"));
            bytes[at..at + 8].copy_from_slice(&(x + 1e-9 * (step - 2) as f64).to_le_bytes());
        }
    });
    let (a, b) = (open("a<b>.mcap", LONG.log_bytes()), open("b", apart));
    let found = diff_with(&a, &b, Options { growth_points: 20, ..Options::default() });
    assert!(found.growth.len() > 20 && found.growth.is_sorted_by_key(|point| point.step));
    assert_eq!(found.growth.last().expect("points").step, 400);
    assert!(found.growth.iter().all(|point| point.body.as_deref() == Some("ring 2")));
    let text = page(&found, &a, &b);
    check_page(&text);
    for word in ["a&lt;b&gt;.mcap", "step 3", "ring 2", "position_m.x", "<svg", "1e-9", "Growth"] {
        assert!(text.contains(word), "'{word}' is not in:\n{text}");
    }
    // One point a curve and measurement; velocities are nowhere apart.
    assert_eq!(text.matches("<circle").count(), found.growth.len());
    // The picture of the first differing frame is in the page.
    let b = open("b", other_frames());
    let text = page(&diff(&a, &b), &a, &b);
    check_page(&text);
    assert!(text.contains("data:image/png;base64,iVBORw0KGgo") && text.contains("Frame 3"), "{text}");
    check_page(&page(&diff(&a, &a), &a, &a));
}

/// Every tag is closed, and nothing is loaded from elsewhere.
fn check_page(text: &str) {
    for word in ["http", "<script", "<link", "url(", "@import"] {
        assert!(!text.contains(word), "'{word}' is in the page");
    }
    assert_eq!(text.matches("src=").count(), text.matches("src=\"data:").count());
    let mut open = Vec::new();
    let body = text.strip_prefix("<!DOCTYPE html>").expect("a page");
    for tag in body.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').expect("a tag ends");
        let name = tag.split([' ', '/']).find(|part| !part.is_empty()).expect("a name");
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "</{name}>");
        } else if !tag.ends_with('/') && !["meta", "br", "img"].contains(&name) {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?} are not closed");
}

//! Written, read, written again; cut anywhere; altered anywhere; a sink that fails.

mod sample;

use proptest::prelude::*;
use recorder::{Health, Kind, Log, LogProblem, LogWriter, Message, Sink, WriteError};
use sample::{Run, write};
use std::io::{self, Write};

#[test]
fn write_read_write_gives_the_same_bytes() {
    for run in [
        Run::default(),
        Run { renderer: false, ..Run::default() },
        Run { steps: 3, state_every: 4, ..Run::default() },
        Run { steps_planned: 60, steps: 60, state_every: 7, ..Run::default() },
        Run { rings: 0, steps_planned: 0, steps: 0, ..Run::default() },
    ] {
        let bytes = run.log_bytes();
        let log = Log::from_bytes("sample", bytes.clone()).expect("a log");
        assert_eq!(log.health(), Health::Complete, "{run:?}");
        let messages: Vec<Message> = log.messages().map(|message| message.expect("whole")).collect();
        assert_eq!(messages, run.in_order(), "{run:?}");
        assert!(write(&messages, run.renderer) == bytes, "{run:?}");
        let checker = log.check(&mut |_, _| {}).expect("all promises kept");
        assert_eq!(checker.counts().step_records, run.steps + 1);
        assert_eq!(checker.frames_missing(), 0);
    }
}

#[test]
fn typed_reading() {
    let run = Run { steps_planned: 30, steps: 30, state_every: 8, ..Run::default() };
    let log = run.log();
    assert_eq!(log.scene().expect("a scene").scene, run.scene());
    assert_eq!(log.steps().len(), 31);
    for (step, record) in log.steps().enumerate() {
        assert_eq!(record.expect("a record").step, step as u64);
    }
    let states: Vec<_> = log.states().map(|state| state.expect("a state")).collect();
    for step in 0..=30 {
        let state = log.state(step).expect("whole");
        assert_eq!(state.is_some(), run.scene().state_is_recorded(step), "step {step}");
        assert_eq!(state.as_ref(), states.iter().find(|state| state.header.step == step));
        let message = log.state_message(step).expect("whole");
        assert_eq!(message.is_some(), state.is_some());
        assert_eq!(log.step_message(step).expect("whole").log_time_ns, step * 10_000_000);
        if let Some(state) = state {
            assert_eq!(state.bodies, sample::bodies(step, run.rings));
        }
    }
    assert_eq!(log.frame(3).expect("a frame").data, sample::png(6));
    assert_eq!(log.frame_info(3).expect("an info").step, 6);
    assert_eq!(log.end().expect("whole").expect("an end").step_count, 30);
    log.require_same_version().expect("this version wrote it");
    let error = log.step(31).expect_err("there is none").to_string();
    assert!(
        error.contains("sample") && error.contains("/step message 31") && error.contains("31"),
        "{error}"
    );
}

/// The last offset up to which a chunk is whole, for every length of the file.
fn whole_chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let mut ends = Vec::new();
    for cut in 0..bytes.len() {
        if let Ok(log) = Log::from_bytes("cut", bytes[..cut].to_vec()) {
            ends.push((cut, log.messages().len()));
        }
    }
    ends
}

#[test]
fn a_log_cut_at_any_byte_keeps_its_whole_chunks() {
    let bytes = Run::default().log_bytes();
    let all: Vec<Message> = Run::default().in_order();
    let counts = whole_chunks(&bytes);
    assert_eq!(counts.len(), bytes.len() - 8, "only a file without its magic is refused");
    for window in counts.windows(2) {
        assert!(window[0].1 <= window[1].1, "a longer file has no fewer messages: {window:?}");
    }
    let steps: std::collections::BTreeSet<usize> = counts.iter().map(|&(_, count)| count).collect();
    // Chunks: up to the four keyframes (steps 0, 2, 4 and, after the last frame time, none), and the rest.
    assert!(steps.len() >= 5, "the chunks come one by one: {steps:?}");
    assert_eq!(counts.last().expect("one").1, all.len());
    for (cut, count) in counts {
        let log = Log::from_bytes("cut", bytes[..cut].to_vec()).expect("it opened before");
        for (message, expected) in log.messages().zip(&all[..count]) {
            assert_eq!(&message.expect("whole"), expected, "cut at {cut}");
        }
        match log.health() {
            Health::Truncated { offset } => assert!(offset <= cut as u64),
            health => panic!("cut at {cut}: {health}"),
        }
        let error = log.check(&mut |_, _| {}).expect_err("it is cut").to_string();
        assert!(error.contains("offset"), "cut at {cut}: {error}");
    }
}

#[test]
fn every_altered_byte_is_found_and_none_is_handed_out() {
    let bytes = Run::default().log_bytes();
    let all = Run::default().in_order();
    for index in 0..bytes.len() {
        for mask in [1, 0x80, 0xFF] {
            let mut altered = bytes.clone();
            altered[index] ^= mask;
            let Ok(log) = Log::from_bytes("altered", altered) else { continue };
            let mut expected = all.iter();
            for message in log.messages() {
                match message {
                    // A log that lost its index ends where the damage begins; it never skips.
                    Ok(message) => assert_eq!(Some(&message), expected.next(), "byte {index}"),
                    Err(error) => {
                        assert!(matches!(error.problem, LogProblem::Damaged { .. }), "byte {index}: {error}");
                        break;
                    }
                }
            }
            assert!(log.check(&mut |_, _| {}).is_err(), "byte {index} ^ {mask:#x} was not found");
        }
    }
}

#[test]
fn absurd_lengths_are_refused_without_allocating() {
    // A record that claims 2^60 bytes; a chunk, a text and a map that claim 4 GiB.
    let mut huge_record = b"\x89MCAP0\r\n\x06".to_vec();
    huge_record.extend((1_u64 << 60).to_le_bytes());
    let log = Log::from_bytes("huge", huge_record).expect("an empty log");
    assert_eq!(log.health(), Health::Truncated { offset: 8 });
    let mut channel = vec![1, 0, 0, 0];
    channel.extend(u32::MAX.to_le_bytes());
    let mut huge_text = b"\x89MCAP0\r\n\x04".to_vec();
    huge_text.extend((channel.len() as u64).to_le_bytes());
    huge_text.extend(&channel);
    let log = Log::from_bytes("huge", huge_text).expect("an empty log");
    assert!(matches!(log.health(), Health::Damaged { offset: 25, .. }), "{}", log.health());
}

#[test]
fn a_scene_that_no_file_could_make_is_refused() {
    let mut messages = Run::default().in_order();
    let text = String::from_utf8(messages[0].bytes.to_vec()).expect("JSON");
    for (from, to, key) in [
        ("\"time_step_s\":0.01", "\"time_step_s\":1e-300", "time.time_step_s"),
        ("\"minor_radius_m\":0.1", "\"minor_radius_m\":-0.1", "minor_radius_m"),
        ("\"state_every\":1", "\"state_every\":0", "record.state_every"),
    ] {
        assert!(text.contains(from), "{from} is not in {text}");
        messages[0] = Message::new(Kind::Scene, 0, text.replacen(from, to, 1).into_bytes());
        // Whoever makes such a log does not use this writer's checks.
        let mut writer = LogWriter::create(Vec::new(), true).expect("memory");
        writer.write(&messages[0]).expect("it is JSON");
        let log = Log::from_bytes("hostile", writer.finish().expect("memory").0).expect("a log");
        let error = log.scene().expect_err("it is none").to_string();
        assert!(error.contains("hostile") && error.contains(key), "{error}");
    }
}

#[test]
fn files_that_are_no_logs() {
    let open = |bytes: &[u8]| Log::from_bytes("file", bytes.to_vec()).err().map(|error| error.to_string());
    assert!(open(b"").expect("an error").contains("not an MCAP file"));
    assert!(open(b"some text").expect("an error").contains("not an MCAP file"));
    let error = Log::open(std::path::Path::new("no/such.mcap")).err().expect("an error").to_string();
    assert!(error.contains("no/such.mcap") && error.contains("No such file"), "{error}");
    let mut other =
        mcap::WriteOptions::new().compression(None).create(io::Cursor::new(Vec::new())).expect("memory");
    other.add_channel(0, "/camera", "json", &Default::default()).expect("memory");
    other.finish().expect("memory");
    let error = open(&other.into_inner().into_inner()).expect("an error");
    assert!(error.contains("no /scene channel"), "{error}");
}

#[test]
fn another_state_layout_is_refused_with_both_hashes() {
    let mut other =
        mcap::WriteOptions::new().compression(None).create(io::Cursor::new(Vec::new())).expect("memory");
    let metadata = [("layout_hash".to_owned(), "00ff".to_owned())].into();
    other.add_channel(0, "/state", "bincode", &metadata).expect("memory");
    other.finish().expect("memory");
    let bytes = other.into_inner().into_inner();
    for cut in [0, 20] {
        let error = Log::from_bytes("other", bytes[..bytes.len() - cut].to_vec()).err().expect("an error");
        let text = error.to_string();
        assert!(text.contains("00ff") && text.contains(&schemas::state::layout_hash().to_string()), "{text}");
    }
}

/// A disk that has room for so many bytes.
struct FullDisk {
    bytes: Vec<u8>,
    room: usize,
}

impl Sink for FullDisk {
    fn rewrite(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        self.bytes.rewrite(offset, bytes)
    }
}

impl Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = bytes.len().min(self.room - self.bytes.len());
        if count == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.bytes.extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_an_error_and_leaves_a_readable_prefix() {
    let messages = Run::default().in_order();
    let size = Run::default().log_bytes().len();
    for room in (0..size).step_by(97) {
        let mut disk = FullDisk { bytes: Vec::new(), room };
        let mut saved = Default::default();
        let mut record = || -> Result<(), WriteError> {
            let mut writer = LogWriter::create(&mut disk, true)?;
            for message in &messages {
                writer.write(message)?;
                saved = writer.saved();
            }
            writer.finish().map(drop)
        };
        let error = record().expect_err("the disk is too small");
        assert!(
            matches!(&error, WriteError::Io(error) if error.kind() == io::ErrorKind::StorageFull),
            "{error}"
        );
        if room < 8 {
            continue;
        }
        let log = Log::from_bytes("full", disk.bytes).expect("a prefix");
        assert!(log.count(Kind::Step) as u64 >= saved.step_records, "room {room}: {saved:?}");
        assert!(log.messages().all(|message| message.is_ok()), "room {room}");
    }
}

#[test]
fn what_breaks_a_promise_is_not_written() {
    let messages = Run::default().in_order();
    let alter = |kind: Kind, nth: usize, alter: &dyn Fn(&mut Vec<u8>)| {
        let mut messages = messages.clone();
        let target = messages.iter_mut().filter(|message| message.kind == kind).nth(nth).expect("one");
        alter(target.bytes.to_mut());
        refusal(&messages)
    };
    let replace = |from: &'static str, to: &'static str| {
        move |bytes: &mut Vec<u8>| {
            let text = String::from_utf8(bytes.clone()).expect("JSON").replacen(from, to, 1);
            *bytes = text.into_bytes();
        }
    };
    for (text, words) in [
        (alter(Kind::State, 3, &|bytes| bytes[100] ^= 1), ["step 3", "state hash"]),
        (alter(Kind::State, 3, &|bytes| bytes.truncate(80)), ["/state message 3", "80"]),
        (alter(Kind::State, 3, &|bytes| bytes[56] = 9), ["/state message 3", "9 bodies"]),
        (
            alter(Kind::Step, 2, &replace("\"contacts\":1", "\"contacts\":NaN")),
            ["/step message 2", "expected"],
        ),
        (
            alter(Kind::Step, 2, &replace("\"kinetic_energy_j\":", "\"kinetic_energy_j\":1e999,\"x\":")),
            ["/step message 2", "range"],
        ),
        (alter(Kind::Step, 2, &replace("\"step\":2", "\"step\":4")), ["step 4", "step 2"]),
        (
            alter(Kind::Step, 2, &replace("\"sim_time_s\":0.02", "\"sim_time_s\":0.03")),
            ["/step message 2", "30000000"],
        ),
        (
            alter(Kind::Step, 2, &replace("\"state_hash\":\"", "\"state_hash\":\"z")),
            ["/step message 2", "hash"],
        ),
        (
            alter(Kind::FrameInfo, 1, &replace("\"step\":2", "\"step\":0")),
            ["/frame_info message 1", "step 2"],
        ),
        (alter(Kind::Frame, 1, &|bytes| bytes.truncate(9)), ["/frame message 1", "not a valid record"]),
        (alter(Kind::Scene, 0, &|bytes| bytes.truncate(9)), ["/scene message 0", "not a valid record"]),
        (alter(Kind::End, 0, &|bytes| bytes[4] += 1), ["8 step records", "has 7"]),
        (alter(Kind::End, 0, &|bytes| *bytes.last_mut().expect("a hash") ^= 1), ["step 6", "chained hash"]),
    ] {
        for word in words {
            assert!(text.contains(word), "'{word}' is not in: {text}");
        }
    }
}

fn refusal(messages: &[Message]) -> String {
    let mut writer = LogWriter::create(Vec::new(), true).expect("memory");
    let error = messages.iter().find_map(|message| writer.write(message).err()).expect("a refusal");
    assert!(matches!(error, WriteError::Check(_)), "{error}");
    error.to_string()
}

#[test]
fn what_is_left_out_is_missed() {
    let messages = Run::default().in_order();
    for (kind, nth, words) in [
        (Kind::Scene, 0, "it comes first"),
        (Kind::State, 2, "the state of step 2"),
        (Kind::Step, 2, "it is of step 3"),
        (Kind::Step, 6, "7 step records, but the log has 6"),
        (Kind::Frame, 0, "no frame lies before it"),
        (Kind::FrameInfo, 0, "a frame lies before it"),
    ] {
        let index =
            messages.iter().enumerate().filter(|(_, message)| message.kind == kind).nth(nth).expect("one").0;
        let mut fewer = messages.clone();
        fewer.remove(index);
        let text = refusal(&fewer);
        assert!(text.contains(words), "without {kind} {nth}: {text}");
    }
    // The last frame that is missing is counted, not refused: an interrupted renderer ends a log like this.
    let fewer: Vec<_> = messages
        .iter()
        .filter(|message| !(message.kind.is_rendered() && message.log_time_ns > 0))
        .cloned()
        .collect();
    let mut writer = LogWriter::create(Vec::new(), true).expect("memory");
    for message in &fewer {
        writer.write(message).expect("a valid message");
    }
    assert_eq!(writer.finish().expect("memory").1.frames_missing, 2);
}

proptest! {
    #[test]
    fn any_bytes_are_read_without_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400), keep in 0..400_usize) {
        let mut file = Run::default().log_bytes();
        file.truncate(file.len().saturating_sub(keep));
        file.extend(bytes);
        if let Ok(log) = Log::from_bytes("noise", file) {
            let _ = log.check(&mut |_, _| {});
        }
    }
}

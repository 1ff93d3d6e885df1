//! The container is that of the `mcap` crate to the byte, however often it is flushed on the way; and whatever write a
//! process dies in, what was flushed before is readable.

mod sample;

use proptest::prelude::*;
use recorder::writer::LIBRARY;
use recorder::{Kind, Log, LogWriter, Message, Sink};
use sample::{Run, write};
use std::cell::RefCell;
use std::io::{self, Write};
use std::rc::Rc;

/// What the `mcap` crate writes of the same messages.
fn by_the_library(messages: &[Message], renderer: bool) -> Vec<u8> {
    let options = mcap::WriteOptions::new()
        .profile("")
        .library(LIBRARY)
        .compression(None)
        .chunk_size(Some(1 << 20))
        .disable_seeking(true);
    let mut writer = options.create(io::Cursor::new(Vec::new())).expect("memory");
    let mut channel_ids = [0; 6];
    for kind in Kind::ALL.into_iter().filter(|kind| renderer || !kind.is_rendered()) {
        let channel = kind.channel();
        let schema_id = match channel.schema_encoding {
            "" => 0,
            encoding => {
                writer.add_schema(channel.schema_name, encoding, &channel.schema_data()).expect("memory")
            }
        };
        let (topic, encoding) = (channel.topic, channel.message_encoding);
        let id = writer.add_channel(schema_id, topic, encoding, &channel.metadata()).expect("memory");
        channel_ids[kind.index()] = id;
    }
    let mut sequences = [0; 6];
    let frames_at = |time_ns: u64| time_ns.is_multiple_of(20_000_000) && time_ns / 10_000_000 < 6;
    for message in messages {
        let index = message.kind.index();
        let header = mcap::records::MessageHeader {
            channel_id: channel_ids[index],
            sequence: sequences[index],
            log_time: message.log_time_ns,
            publish_time: message.log_time_ns,
        };
        sequences[index] += 1;
        writer.write_to_known_channel(&header, &message.bytes).expect("memory");
        if message.kind == Kind::Step && frames_at(message.log_time_ns) {
            writer.flush().expect("memory");
        }
    }
    writer.finish().expect("memory");
    writer.into_inner().into_inner()
}

#[test]
fn the_bytes_are_those_of_the_mcap_crate() {
    for run in [
        Run::default(),
        Run { renderer: false, ..Run::default() },
        Run { steps: 3, state_every: 4, ..Run::default() },
        // States beyond the size at which a chunk is closed.
        Run { rings: 11_000, ..Run::default() },
    ] {
        let messages = run.in_order();
        assert!(write(&messages, run.renderer) == by_the_library(&messages, run.renderer), "{run:?}");
    }
    assert!(write(&[], true) == by_the_library(&[], true), "without a message");
}

/// One write: the offset (`None` for the end) and the bytes.
type Writing = (Option<u64>, Vec<u8>);

/// What was done to a file, in order.
#[derive(Clone, Default)]
struct Diary(Rc<RefCell<Vec<Writing>>>);

impl Write for Diary {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().push((None, bytes.to_vec()));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Sink for Diary {
    fn rewrite(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        self.0.borrow_mut().push((Some(offset), bytes.to_vec()));
        Ok(())
    }
}

/// The file after the first `count` writes and `bytes` bytes of the next.
fn file_after(diary: &[Writing], count: usize, bytes: usize) -> Vec<u8> {
    let mut file = Vec::new();
    let whole = diary[..count].iter().map(|(at, written)| (at, &written[..]));
    let part = diary.get(count).map(|(at, written)| (at, &written[..bytes.min(written.len())]));
    for (at, written) in whole.chain(part) {
        match at {
            None => file.extend_from_slice(written),
            Some(offset) => file.rewrite(*offset, written).expect("memory"),
        }
    }
    file
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_flush_changes_no_byte_and_keeps_what_it_flushed(
        flushed in proptest::collection::vec(any::<bool>(), 40),
        renderer in any::<bool>(),
        state_every in 1_u64..4,
    ) {
        let run = Run { steps_planned: 12, steps: 12, state_every, renderer, ..Run::default() };
        let messages = run.in_order();
        let diary = Diary::default();
        let mut writer = LogWriter::create(diary.clone(), renderer).expect("memory");
        // Writes after which so many messages must be readable.
        let mut promises = vec![(0, 0)];
        for (number, message) in messages.iter().enumerate() {
            writer.write(message).expect("a valid message");
            if flushed[number % flushed.len()] {
                writer.flush().expect("memory");
                prop_assert_eq!(writer.saved(), writer.counts());
                promises.push((diary.0.borrow().len(), number + 1));
            }
        }
        writer.finish().expect("memory");
        let diary = diary.0.borrow();
        prop_assert!(file_after(&diary, diary.len(), 0) == write(&messages, renderer), "the finished log differs");
        for count in 1..diary.len() {
            let promised = promises.iter().rev().find(|(writes, _)| *writes <= count).expect("the first").1;
            // A head that is written over is so short that the system writes it as one.
            let parts = if diary[count].0.is_some() { vec![0] } else { vec![0, 1, 30, 200, diary[count].1.len() - 1] };
            for bytes in parts {
                let log = Log::from_bytes("killed", file_after(&diary, count, bytes)).expect("a log");
                prop_assert!(log.messages().len() >= promised, "{} of {promised}", log.messages().len());
                for (message, expected) in log.messages().zip(&messages) {
                    prop_assert_eq!(&message.expect("whole"), expected);
                }
            }
        }
    }
}

#[test]
fn the_index_stays_small_however_many_keyframes_there_are() {
    // 6,000 keyframes, each of which would close a chunk of some 2.5 kB.
    let run = Run { rings: 1, steps_planned: 12_000, steps: 12_000, state_every: 1000, renderer: false };
    let log = run.log();
    let (_, chunks) = log.chunks_checked();
    // While the file has less than 1024 times a keyframe's bytes, each closes a chunk. From then on the file grows by
    // 1/1024 with every chunk, so n chunks later it is exp(n / 1024) times as large.
    let keyframes = 6_000.0_f64;
    let chunks_max = 1024.0 * (1.0 + libm::log(keyframes / 1024.0));
    println!("{chunks} chunks of {} bytes; at most {chunks_max:.0} expected", log.file_bytes());
    assert!((chunks as f64) < 1.02 * chunks_max && chunks > 1024);
    log.check(&mut |_, _| {}).expect("whole");
}

//! The process, on a real bus: simulator and renderer are played by threads, each with a bus of its own.

mod sample;

use bus::{Bus, BusError, BusName, Publisher};
use recorder::node::{Progress, RecordError, RecordOptions, record};
use recorder::{Health, Kind, Log, Message};
use sample::{Messages, Run};
use schemas::topics::{Role, TOPICS, Topic};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

fn topic_of(kind: Kind) -> &'static Topic {
    TOPICS.iter().find(|topic| topic.channel == Some(kind.channel())).expect("a topic")
}

fn options(bus: &BusName, out: &Path) -> RecordOptions {
    let out = out.to_owned();
    RecordOptions { bus: bus.clone(), out, force: false, no_render: false, resume: None, from_step: None }
}

/// Publishes a role's messages of a run, in the order in which a process of this role sends them; after
/// `limit` messages it dies.
fn play(bus: &BusName, role: Role, messages: &Messages, limit: usize) -> JoinHandle<Result<(), BusError>> {
    let bus = bus.clone();
    let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|kind| topic_of(*kind).publisher == role).collect();
    let mut to_send = in_sending_order(messages, &kinds);
    to_send.truncate(limit);
    std::thread::spawn(move || {
        let bus = Bus::join(&bus, role, Arc::new(AtomicBool::new(false)))?;
        let open = |kind: &Kind| Publisher::open(&bus, topic_of(*kind), &[Role::Recorder], 1 << 16);
        let mut publishers = kinds.iter().map(open).collect::<Result<Vec<_>, _>>()?;
        bus.handshake(&mut publishers.iter_mut().collect::<Vec<_>>(), &mut [])?;
        for message in to_send {
            let index = kinds.iter().position(|kind| *kind == message.kind).expect("one of this role's");
            publishers[index].send(message.log_time_ns, &message.bytes)?;
        }
        if limit == usize::MAX {
            for publisher in publishers {
                publisher.finish()?;
            }
        }
        Ok(())
    })
}

/// Step by step: scene, then state and record of each step, then the end; frame and info in pairs.
fn in_sending_order(messages: &Messages, kinds: &[Kind]) -> Vec<Message<'static>> {
    let mut queues: Vec<VecDeque<_>> =
        kinds.iter().map(|kind| messages.0[kind.index()].clone().into()).collect();
    let mut ordered = Vec::new();
    while let Some(time_ns) =
        queues.iter().filter_map(|queue| queue.front()).map(|message| message.log_time_ns).min()
    {
        for queue in &mut queues {
            while queue.front().is_some_and(|message| message.log_time_ns == time_ns) {
                ordered.extend(queue.pop_front());
            }
        }
    }
    ordered
}

#[test]
fn a_whole_run_is_recorded_to_the_byte_whoever_starts_first() {
    let run = Run { rings: 5, steps_planned: 200, steps: 200, ..Run::default() };
    let folder = tempfile::tempdir().expect("a folder");
    for (number, order) in [[0, 1, 2], [2, 1, 0], [1, 2, 0]].into_iter().enumerate() {
        let bus = BusName::unique();
        let out = folder.path().join(format!("{number}.mcap"));
        let mut others = Vec::new();
        let mut recorder = None;
        for role in order {
            match role {
                0 => others.push(play(&bus, Role::Simulator, &run.messages(), usize::MAX)),
                1 => others.push(play(&bus, Role::Renderer, &run.messages(), usize::MAX)),
                _ => {
                    let options = options(&bus, &out);
                    recorder = Some(std::thread::spawn(move || {
                        let mut seen = Vec::new();
                        let recorded = record(&options, Arc::default(), &mut |progress| seen.push(progress));
                        recorded.map(|recorded| (recorded, seen))
                    }));
                }
            }
        }
        let (recorded, seen) = recorder.expect("started").join().expect("no panic").expect("a recording");
        for other in others {
            other.join().expect("no panic").expect("everything sent");
        }
        assert_eq!(recorded.written.counts.step_records, 201);
        assert_eq!(recorded.written.counts.frames, 100);
        assert_eq!(seen[0], Progress::Waiting);
        assert_eq!(seen.last(), Some(&Progress::Recording { step: 200, step_count: 200, frames: 100 }));
        let file = std::fs::read(&out).expect("a file");
        assert_eq!(file.len() as u64, recorded.written.bytes);
        assert!(file == run.log_bytes(), "started as {order:?} the log differs");
    }
}

/// Records a run of which one role dies after so many messages.
fn lose(role: Role, limit: usize, out: &Path) -> (RecordError, Log) {
    let run = Run { rings: 5, steps_planned: 60, steps: 60, ..Run::default() };
    let bus = BusName::unique();
    let others = [Role::Simulator, Role::Renderer]
        .map(|other| play(&bus, other, &run.messages(), if other == role { limit } else { usize::MAX }));
    let error = record(&options(&bus, out), Arc::default(), &mut |_| {}).expect_err("a process was lost");
    for other in others {
        // The other one may have sent everything, or have lost the recorder.
        let _ = other.join().expect("no panic");
    }
    let log = Log::open(out).expect("a log");
    log.messages().for_each(|message| assert!(message.is_ok()));
    (error, log)
}

#[test]
fn a_lost_simulator_leaves_a_finished_log() {
    let folder = tempfile::tempdir().expect("a folder");
    // The scene, and state and record of 20 steps.
    let (error, log) = lose(Role::Simulator, 41, &folder.path().join("log.mcap"));
    let text = error.to_string();
    assert!(matches!(error, RecordError::Ended { .. }) && error.exit_code() == 3, "{text}");
    assert!(text.contains("the simulator was lost") && text.contains("20 step records, 20 states"), "{text}");
    assert_eq!((log.count(Kind::Step), log.count(Kind::Frame)), (20, 10));
    assert_eq!(log.health(), Health::Unfinished);
}

#[test]
fn a_lost_renderer_leaves_a_finished_log() {
    let folder = tempfile::tempdir().expect("a folder");
    let (error, log) = lose(Role::Renderer, 9, &folder.path().join("log.mcap"));
    let text = error.to_string();
    assert!(matches!(error, RecordError::Ended { .. }), "{text}");
    assert!(text.contains("the renderer was lost"), "{text}");
    // The fifth frame came without its info.
    assert_eq!(log.count(Kind::Frame), 4);
    assert_eq!(log.count(Kind::FrameInfo), 4);
    assert_eq!(log.count(Kind::Step), 61);
    assert_eq!(log.health(), Health::Complete);
}

#[test]
fn a_file_that_exists_is_kept_unless_it_is_forced() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("log.mcap");
    std::fs::write(&out, "mine").expect("a file");
    let mut options = options(&BusName::unique(), &out);
    let error = record(&options, Arc::default(), &mut |_| {}).expect_err("it exists");
    assert!(matches!(error, RecordError::Exists { .. }) && error.exit_code() == 2);
    assert!(error.to_string().contains("--force") && error.to_string().contains("log.mcap"), "{error}");
    // Forced, but stopped before the others came: nothing is lost for nothing.
    options.force = true;
    let error = stopped_while_waiting(&options);
    assert!(matches!(error, RecordError::Bus(BusError::Stopped { .. })), "{error}");
    assert_eq!(std::fs::read(&out).expect("a file"), b"mine");
    // A file that was not there before is not there after.
    options.out = folder.path().join("new.mcap");
    stopped_while_waiting(&options);
    assert!(!options.out.exists());
    options.out = folder.path().join("no/such/folder.mcap");
    let error = record(&options, Arc::default(), &mut |_| {}).expect_err("there is no folder");
    assert!(matches!(error, RecordError::Create { .. }) && error.exit_code() == 2, "{error}");
}

fn stopped_while_waiting(options: &RecordOptions) -> RecordError {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    record(options, stop, &mut |_| flag.store(true, Ordering::Relaxed)).expect_err("it was stopped")
}

#[test]
fn forced_over_a_longer_file_the_log_is_whole() {
    let run = Run { renderer: false, ..Run::default() };
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("log.mcap");
    std::fs::write(&out, vec![7; 100_000]).expect("a file");
    let bus = BusName::unique();
    let simulator = play(&bus, Role::Simulator, &run.messages(), usize::MAX);
    let options = RecordOptions { force: true, no_render: true, ..options(&bus, &out) };
    record(&options, Arc::default(), &mut |_| {}).expect("a recording");
    simulator.join().expect("no panic").expect("everything sent");
    assert!(std::fs::read(&out).expect("a file") == run.log_bytes());
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_told() {
    let run = Run { renderer: false, ..Run::default() };
    let bus = BusName::unique();
    let simulator = play(&bus, Role::Simulator, &run.messages(), usize::MAX);
    let options = RecordOptions { force: true, no_render: true, ..options(&bus, Path::new("/dev/full")) };
    let error = record(&options, Arc::default(), &mut |_| {}).expect_err("/dev/full takes nothing");
    assert!(matches!(error, RecordError::Write { .. }) && error.exit_code() == 3, "{error}");
    assert!(
        error.to_string().contains("/dev/full") && error.to_string().contains("No space left"),
        "{error}"
    );
    // The simulator finds out that nobody listens any more, or had sent everything before.
    let _ = simulator.join().expect("no panic");
}

#[test]
fn what_breaks_a_promise_ends_the_recording_with_what_was_good() {
    let run = Run { renderer: false, ..Run::default() };
    let mut messages = run.messages();
    messages.0[Kind::State.index()][3].bytes.to_mut()[100] ^= 1;
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("log.mcap");
    let bus = BusName::unique();
    let simulator = play(&bus, Role::Simulator, &messages, usize::MAX);
    let options = RecordOptions { no_render: true, ..options(&bus, &out) };
    let error = record(&options, Arc::default(), &mut |_| {}).expect_err("a state is not what it claims");
    let text = error.to_string();
    assert!(
        text.contains("step 3") && text.contains("state hash") && text.contains("3 step records"),
        "{text}"
    );
    let _ = simulator.join().expect("no panic");
    assert_eq!(Log::open(&out).expect("a log").count(Kind::Step), 3);
}

#[test]
fn stopped_before_the_simulator_ends_the_log_is_finished_all_the_same() {
    let run = Run { renderer: false, ..Run::default() };
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("log.mcap");
    let bus = BusName::unique();
    let (done, wait_until_done) = std::sync::mpsc::channel::<()>();
    let simulator = std::thread::spawn({
        let bus = bus.clone();
        move || -> Result<(), BusError> {
            let bus = Bus::join(&bus, Role::Simulator, Arc::default())?;
            let open = |kind: Kind| Publisher::open(&bus, topic_of(kind), &[Role::Recorder], 1 << 16);
            let mut publishers =
                [open(Kind::Scene)?, open(Kind::State)?, open(Kind::Step)?, open(Kind::End)?];
            bus.handshake(&mut publishers.iter_mut().collect::<Vec<_>>(), &mut [])?;
            let [scene, states, steps, ..] = &run.messages().0;
            publishers[0].send(0, &scene[0].bytes)?;
            publishers[1].send(0, &states[0].bytes)?;
            publishers[2].send(0, &steps[0].bytes)?;
            // It hangs: neither a further step nor an end.
            let _ = wait_until_done.recv();
            Ok(())
        }
    });
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    let options = RecordOptions { no_render: true, ..options(&bus, &out) };
    let error = record(&options, stop, &mut |progress| {
        if progress != Progress::Waiting {
            flag.store(true, Ordering::Relaxed);
        }
    });
    let error = error.expect_err("the run did not end");
    assert!(error.to_string().contains("stopped before the simulator had ended"), "{error}");
    assert!(
        error.to_string().contains("1 step record, 1 state and 0 frames") && error.exit_code() == 3,
        "{error}"
    );
    assert_eq!(Log::open(&out).expect("a log").health(), Health::Unfinished);
    drop(done);
    simulator.join().expect("no panic").expect("it was waited for");
}

//! Starts the processes of a run, shows their progress, and ends all of them when one is lost.

use crate::failure::Failure;
use crate::progress::{self, LINES_VARIABLE, Meter, Progress};
use crate::stop;
use crate::terminal::say;
use indicatif::MultiProgress;
use rustix::process::{Pid, Signal, kill_process};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

/// A process to start: this program again, with other arguments.
pub struct Part {
    /// What people know it as.
    pub name: &'static str,
    /// What its progress counts.
    pub unit: &'static str,
    /// Verb and arguments.
    pub arguments: Vec<OsString>,
    /// What it reads on stdin.
    pub input: Option<String>,
}

/// How a run ended that lost no process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// All is done.
    Done,
    /// The run's own audits stopped it.
    Stopped,
    /// A signal stopped it.
    Interrupted,
}

/// After one process was lost, the others have this long to bring what they hold into safety.
const GRACE: Duration = Duration::from_millis(1500);
/// After a signal they finish what they are at: a frame in progress, the log.
const GRACE_INTERRUPTED: Duration = Duration::from_secs(10);

enum Report {
    Progress(usize, Progress),
    Diagnostic(usize, String),
    Exited(usize, ExitStatus),
}

struct Running {
    name: &'static str,
    pid: Option<Pid>,
    exited: Option<ExitStatus>,
    /// The signals that it was sent from here.
    signals: Vec<Signal>,
    /// The lines it wrote to stderr.
    diagnostics: Vec<String>,
}

/// Runs the parts to their end.
///
/// A part that is killed or fails ends the whole run within [`GRACE`], as a [`Failure`] that names it.
pub fn supervise(parts: Vec<Part>) -> Result<Ended, Failure> {
    let program = std::env::current_exe()
        .map_err(|error| Failure::lost(format!("cannot find this program's own file: {error}")))?;
    let bars = progress::group();
    let (sender, receiver) = channel();
    let mut running = Vec::new();
    let mut meters = Vec::new();
    for (index, part) in parts.into_iter().enumerate() {
        meters.push(Meter::in_group(&bars, part.name, part.unit));
        let spawned = Command::new(&program)
            .args(&part.arguments)
            .env(LINES_VARIABLE, "1")
            .env(stop::SUPERVISOR_VARIABLE, std::process::id().to_string())
            .stdin(if part.input.is_some() { Stdio::piped() } else { Stdio::null() })
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        match spawned {
            Ok(mut child) => {
                feed(&mut child, part.input);
                let pid = Pid::from_raw(child.id() as i32);
                watch(index, child, sender.clone());
                running.push(Running {
                    name: part.name,
                    pid,
                    exited: None,
                    signals: Vec::new(),
                    diagnostics: Vec::new(),
                });
            }
            Err(error) => {
                signal_all(&mut running, Signal::KILL);
                return Err(Failure::lost(format!("cannot start the {}: {error}", part.name)));
            }
        }
    }
    drop(sender);
    let first_failed = attend(&receiver, &mut running, &mut meters, &bars);
    meters.iter().for_each(Meter::finish);
    conclude(&running, first_failed)
}

impl Running {
    /// What it said was wrong.
    fn complaint(&self) -> Option<&str> {
        self.diagnostics.iter().find_map(|line| line.strip_prefix("error: "))
    }
}

/// Whether a complaint is only about what happened to others.
fn is_echo(complaint: &str) -> bool {
    let begins = ["interrupted", "stopped while waiting"].iter().any(|word| complaint.starts_with(word));
    begins || complaint.contains(" was lost after ")
}

/// Writes a child's input, from a thread: it may be longer than a pipe holds.
fn feed(child: &mut Child, input: Option<String>) {
    if let (Some(mut stdin), Some(input)) = (child.stdin.take(), input) {
        // A child that does not read to the end says why itself.
        thread::spawn(move || drop(stdin.write_all(input.as_bytes())));
    }
}

/// Threads that turn what a child does into reports.
fn watch(index: usize, mut child: Child, sender: Sender<Report>) {
    if let Some(stdout) = child.stdout.take() {
        let sender = sender.clone();
        forward(stdout, move |line| match serde_json::from_str(&line) {
            Ok(progress) => drop(sender.send(Report::Progress(index, progress))),
            Err(_) => drop(sender.send(Report::Diagnostic(index, line))),
        });
    }
    let diagnostics = child.stderr.take().map(|stderr| {
        let sender = sender.clone();
        forward(stderr, move |line| drop(sender.send(Report::Diagnostic(index, line))))
    });
    thread::spawn(move || {
        let status = child.wait();
        // What it said before it died is part of the report, so it comes first.
        if let Some(thread) = diagnostics {
            let _ = thread.join();
        }
        if let Ok(status) = status {
            let _ = sender.send(Report::Exited(index, status));
        }
    });
}

fn forward(
    stream: impl Read + Send + 'static,
    send: impl Fn(String) + Send + 'static,
) -> thread::JoinHandle<()> {
    thread::spawn(move || BufReader::new(stream).lines().map_while(Result::ok).for_each(send))
}

/// Follows the run until every process has ended; returns which one failed first.
fn attend(
    receiver: &Receiver<Report>,
    running: &mut [Running],
    meters: &mut [Meter],
    bars: &MultiProgress,
) -> Option<usize> {
    let mut first_failed = None;
    let mut deadline: Option<Instant> = None;
    let mut interrupted = false;
    while running.iter().any(|part| part.exited.is_none()) {
        match receiver.recv_timeout(Duration::from_millis(50)) {
            Ok(Report::Progress(index, progress)) => meters[index].show(progress),
            Ok(Report::Diagnostic(index, line)) => {
                bars.suspend(|| say(format!("{}: {line}", running[index].name)));
                running[index].diagnostics.push(line);
            }
            Ok(Report::Exited(index, status)) => {
                running[index].exited = Some(status);
                let fine = match status.code() {
                    Some(0 | 1) => true,
                    Some(3) => stop::requested(),
                    _ => false,
                };
                if !fine && first_failed.is_none() {
                    first_failed = Some(index);
                    deadline = Some(Instant::now() + GRACE);
                    signal_all(running, Signal::TERM);
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if stop::requested() && !interrupted {
            interrupted = true;
            deadline = Some(Instant::now() + GRACE_INTERRUPTED);
            signal_all(running, Signal::TERM);
        }
        if deadline.is_some_and(|deadline| Instant::now() > deadline) {
            signal_all(running, Signal::KILL);
        }
    }
    first_failed
}

fn signal_all(running: &mut [Running], signal: Signal) {
    for part in running.iter_mut().filter(|part| part.exited.is_none()) {
        part.signals.push(signal);
        if let Some(pid) = part.pid {
            let _ = kill_process(pid, signal);
        }
    }
}

fn conclude(running: &[Running], first_failed: Option<usize>) -> Result<Ended, Failure> {
    let any_exited_with =
        |code| running.iter().any(|part| part.exited.and_then(|status| status.code()) == Some(code));
    let Some(first) = first_failed else {
        // A signal that came when all was done already interrupted nothing.
        return Ok(match (any_exited_with(3), any_exited_with(1)) {
            (true, _) => Ended::Interrupted,
            (false, true) => Ended::Stopped,
            (false, false) => Ended::Done,
        });
    };
    // The others complain of whoever was lost, and one of them may have been reaped first. So: a process that
    // somebody killed, else one that failed for a reason of its own, else the first.
    let signalled = |part: &&Running| {
        let signal = part.exited.and_then(|status| status.signal());
        signal.is_some_and(|signal| !part.signals.iter().any(|ours| ours.as_raw() == signal))
    };
    let has_own_reason = |part: &&Running| {
        let failed = !matches!(part.exited.and_then(|status| status.code()), Some(0 | 1));
        failed && part.complaint().is_some_and(|said| !is_echo(said))
    };
    let mut parts = std::iter::once(&running[first]).chain(running);
    let part =
        parts.clone().find(signalled).or_else(|| parts.find(has_own_reason)).unwrap_or(&running[first]);
    let name = part.name;
    let status = part.exited.unwrap_or_default();
    let said = part.complaint().map_or(String::new(), |line| format!(": {line}"));
    Err(match (status.signal(), status.code()) {
        (Some(signal), _) => Failure::lost(format!("the {name} was lost: killed by signal {signal}{said}")),
        (None, Some(2)) => Failure::input(format!("the {name} refused its input{said}")),
        (None, code) => {
            Failure::lost(format!("the {name} ended with exit code {}{said}", code.unwrap_or(-1)))
        }
    })
}

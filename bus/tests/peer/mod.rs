//! Runs the example `peer` as processes of their own and reads what they say.

use bus::{Bus, BusName};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Longest wait for a line. Far above what any step takes, so that a slow machine fails no test; a hang does.
const PATIENCE: Duration = Duration::from_secs(60);

/// A running peer; killed when dropped, with what it leaves behind.
pub struct Peer {
    name: BusName,
    child: Child,
    finished: bool,
    lines: Receiver<String>,
    what: String,
}

impl Peer {
    /// Starts `peer VERB NAME WORDS..`.
    pub fn start(verb: &str, name: &BusName, words: &str) -> Peer {
        let test = std::env::current_exe().unwrap();
        let program = test.parent().and_then(Path::parent).unwrap().join("examples").join("peer");
        assert!(program.exists(), "{} is missing: cargo build -p bus --example peer", program.display());
        let mut child = Command::new(program)
            .args([verb, name.as_str()])
            .args(words.split_whitespace())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                let _ = sender.send(line);
            }
        });
        Peer { name: name.clone(), child, finished: false, lines, what: format!("{verb} {name} {words}") }
    }

    /// Reads lines until this one.
    pub fn expect(&mut self, expected: &str) {
        let mut seen = Vec::new();
        loop {
            match self.lines.recv_timeout(PATIENCE) {
                Ok(line) if line == expected => return,
                Ok(line) => seen.push(line),
                Err(reason) => {
                    panic!("{}: {expected:?} did not come ({reason}), but {seen:?}", self.what)
                }
            }
        }
    }

    /// Waits for a line that is said after this call.
    pub fn expect_fresh_line(&mut self) {
        let old = self.lines.try_iter().count();
        // One more may have been on its way.
        for _ in 0..2 {
            let line = self.lines.recv_timeout(PATIENCE);
            assert!(line.is_ok(), "{}: no line after {old} others", self.what);
        }
    }

    /// Asserts that the peer lives and says nothing for so long.
    pub fn expect_silence(&mut self, time: Duration) {
        assert_eq!(self.lines.recv_timeout(time), Err(RecvTimeoutError::Timeout), "{}", self.what);
    }

    /// Reads to the end: the lines that were not asked for, the exit code (`None`: killed), and how long the
    /// peer went on living.
    pub fn finish(mut self) -> (Vec<String>, Option<i32>, Duration) {
        let begin = Instant::now();
        let mut lines = Vec::new();
        loop {
            match self.lines.recv_timeout(PATIENCE) {
                Ok(line) => lines.push(line),
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => panic!("{} hangs after {lines:?}", self.what),
            }
        }
        let time = begin.elapsed();
        self.finished = true;
        (lines, self.child.wait().unwrap().code(), time)
    }

    /// Sends a signal by its short name.
    pub fn signal(&self, signal: &str) {
        let sent = Command::new("kill").args(["-s", signal, &self.child.id().to_string()]).status();
        assert!(sent.unwrap().success());
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        if !self.finished {
            let _ = self.child.kill();
            let _ = self.child.wait();
            let _ = Bus::clean_up(&self.name);
        }
    }
}

/// Files of a bus in shared memory and its directory.
pub fn leftovers(name: &BusName) -> Vec<String> {
    let prefix = name.shared_memory_prefix();
    let mut left: Vec<String> = std::fs::read_dir("/dev/shm")
        .unwrap()
        .filter_map(|entry| entry.unwrap().file_name().into_string().ok())
        .filter(|file| file.starts_with(&prefix))
        .collect();
    if name.root_dir().exists() {
        left.push(name.root_dir().display().to_string());
    }
    left
}

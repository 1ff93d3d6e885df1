//! The built command, run as a user runs it.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

/// Two rings, one pinned, and a floor: 60 steps, 4 frames of 32x18 pixels.
pub const TINY: &str = r#"
[time]
duration_s = 0.06
time_step_s = 0.001
frames_per_second = 60.0

[forces]
gravity_m_per_s2 = [0.0, -9.81, 0.0]

[material.steel]
friction_coefficient = 0.2

[[weave]]
pattern = "chain"
rows = 1
columns = 2
major_radius_m = 0.4
minor_radius_m = 0.06
ring_mass_kg = 0.1
material = "steel"
pins = [[0, 0]]

[[plane]]
normal = [0.0, 1.0, 0.0]
offset_m = -2.0
material = "steel"

[render]
width_px = 32
height_px = 18
samples_per_pixel = 2

[render.camera]
position_m = [0.5, 0.3, 4.0]
look_at_m = [0.3, -0.2, 0.0]
"#;

/// A folder of its own for one test, with the tiny scene in it.
pub struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    pub fn new() -> Place {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("tiny.toml"), TINY).expect("a file");
        Place { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The command, to be run in this folder.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_chainmail"));
        command.args(arguments).current_dir(self.folder.path()).env_remove("RUST_LOG").stdin(Stdio::null());
        command
    }

    /// Runs the command to its end.
    pub fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the command starts")
    }

    /// Runs the command and expects an exit code; returns stdout and stderr as one text.
    pub fn expect(&self, code: i32, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let text =
            [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
        assert_eq!(output.status.code(), Some(code), "chainmail {}\n{text}", arguments.join(" "));
        assert!(!text.contains("panicked") && !text.contains("RUST_BACKTRACE"), "{text}");
        text
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }
}

/// A run in the background whose stderr is read line by line.
pub struct Background {
    pub child: Child,
    lines: std::io::Lines<BufReader<std::process::ChildStderr>>,
    pub seen: String,
}

impl Background {
    pub fn start(mut command: Command) -> Background {
        let mut child =
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts");
        let stderr = child.stderr.take().expect("a pipe");
        Background { child, lines: BufReader::new(stderr).lines(), seen: String::new() }
    }

    /// Reads on until a line contains a text.
    pub fn wait_for(&mut self, text: &str) {
        for line in self.lines.by_ref() {
            let line = line.expect("text");
            self.seen += &format!("{line}\n");
            if line.contains(text) {
                return;
            }
        }
        panic!("the process ended without '{text}':\n{}", self.seen);
    }

    /// The next line; `None` at the end.
    pub fn next_line(&mut self) -> Option<String> {
        let line = self.lines.next()?.expect("text");
        self.seen += &format!("{line}\n");
        Some(line)
    }

    /// Reads on to the end; returns the exit code.
    pub fn finish(&mut self) -> Option<i32> {
        for line in self.lines.by_ref() {
            self.seen += &format!("{}\n", line.expect("text"));
        }
        self.child.wait().expect("it was started").code()
    }

    /// The process of a run that plays a part: the child whose command line has the verb.
    pub fn part(&self, verb: &str) -> u32 {
        let pid = self.child.id();
        // Children belong to the thread that started them.
        let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).expect("the run is there");
        let children = tasks.flatten().flat_map(|task| {
            let children = std::fs::read_to_string(task.path().join("children")).unwrap_or_default();
            children.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
        });
        let plays = |pid: &String| {
            let line = std::fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
            line.split('\0').nth(1) == Some(verb)
        };
        let found = children.into_iter().find(plays);
        found.and_then(|pid| pid.parse().ok()).unwrap_or_else(|| panic!("no process plays '{verb}'"))
    }
}

/// Sends a signal.
pub fn signal(pid: u32, name: &str) {
    let status = Command::new("kill").args([&format!("-{name}"), &pid.to_string()]).status().expect("kill");
    assert!(status.success(), "kill -{name} {pid}");
}

/// How many messages each channel of a log holds, read with the mcap crate alone.
pub fn message_counts(log: &Path) -> std::collections::BTreeMap<String, u64> {
    let bytes = std::fs::read(log).expect("a log");
    let mut counts = std::collections::BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).expect("MCAP") {
        *counts.entry(message.expect("a message").channel.topic.clone()).or_insert(0) += 1;
    }
    counts
}

/// The log's last message, decoded.
pub fn end_of(log: &Path) -> schemas::end::End {
    let bytes = std::fs::read(log).expect("a log");
    let messages = mcap::MessageStream::new(&bytes).expect("MCAP").map(|message| message.expect("a message"));
    let last = messages.last().expect("a log has messages");
    assert_eq!(last.channel.topic, "/end");
    schemas::wire::decode(&last.data).expect("an end record")
}

//! Progress: a bar per process on a terminal, plain lines otherwise.
//!
//! A process that `run` started reports on its stdout, one JSON object a line; the parent draws. A process
//! started by hand draws its own bar.

use crate::terminal::say;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::{Deserialize, Serialize};
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// Set in the environment of a process whose parent draws its progress.
pub const LINES_VARIABLE: &str = "CHAINMAIL_PROGRESS_LINES";

/// How far a process is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Units done.
    pub done: u64,
    /// Units in all; 0 while unknown.
    pub total: u64,
}

/// Shows the progress of one process.
pub struct Meter {
    kind: Kind,
    last: Option<Instant>,
}

enum Kind {
    Lines,
    Bar(ProgressBar),
    Plain { label: String, tenth: u64 },
}

/// Reports come at most this often; a report costs a system call.
const REPORT_EVERY: Duration = Duration::from_millis(100);

impl Meter {
    /// For this process: lines for a parent, a bar on a terminal, plain lines otherwise.
    pub fn for_this_process(label: &str, unit: &'static str) -> Meter {
        let kind = if std::env::var_os(LINES_VARIABLE).is_some() {
            Kind::Lines
        } else if std::io::stderr().is_terminal() {
            Kind::Bar(styled(ProgressBar::no_length(), label, unit))
        } else {
            Kind::Plain { label: format!("{label} ({unit})"), tenth: 0 }
        };
        Meter { kind, last: None }
    }

    /// For another process, among others.
    pub fn in_group(group: &MultiProgress, label: &str, unit: &'static str) -> Meter {
        let kind = if std::io::stderr().is_terminal() {
            Kind::Bar(styled(group.add(ProgressBar::no_length()), label, unit))
        } else {
            Kind::Plain { label: format!("{label} ({unit})"), tenth: 0 }
        };
        Meter { kind, last: None }
    }

    /// Shows a report; most of them are dropped, the last one never.
    pub fn show(&mut self, progress: Progress) {
        let complete = progress.total > 0 && progress.done >= progress.total;
        let now = Instant::now();
        if !complete && self.last.is_some_and(|last| now - last < REPORT_EVERY) {
            return;
        }
        self.last = Some(now);
        match &mut self.kind {
            Kind::Lines => {
                // A parent that has gone away is no reason to stop.
                if let Ok(line) = serde_json::to_string(&progress) {
                    let _ = writeln!(std::io::stdout().lock(), "{line}");
                }
            }
            Kind::Bar(bar) => {
                bar.set_length(progress.total);
                bar.set_position(progress.done);
            }
            Kind::Plain { label, tenth } => {
                let now = (10 * progress.done).checked_div(progress.total).unwrap_or(0);
                if now > *tenth {
                    *tenth = now;
                    say(format!("{label}: {} of {}", progress.done, progress.total));
                }
            }
        }
    }

    /// Says something to a person; a parent that draws has its own words.
    pub fn say(&self, text: &str) {
        match &self.kind {
            Kind::Lines => {}
            Kind::Bar(bar) => bar.suspend(|| say(text)),
            Kind::Plain { .. } => say(text),
        }
    }

    /// Leaves the bar as it stands.
    pub fn finish(&self) {
        if let Kind::Bar(bar) = &self.kind {
            bar.abandon();
        }
    }
}

fn styled(bar: ProgressBar, label: &str, unit: &str) -> ProgressBar {
    let template =
        format!("{{prefix:<10}} {{wide_bar}} {{pos}} of {{len}} {unit}, {{elapsed}}, {{eta}} left");
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_prefix(label.to_owned());
    bar
}

/// A place for several bars, one under the other.
pub fn group() -> MultiProgress {
    MultiProgress::with_draw_target(ProgressDrawTarget::stderr())
}

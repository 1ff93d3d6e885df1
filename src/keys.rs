//! Keys from the terminal, one at a time and without Enter. The terminal is given back as it was.

use crate::player::Key;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::termios::{self, LocalModes, OptionalActions, SpecialCodeIndex, Termios};
use std::collections::VecDeque;
use std::io::{IsTerminal, stdin};
use std::time::Duration;

/// The terminal on stdin, set to give keys as they are pressed; nothing, if stdin is none.
pub struct Keys {
    /// How the terminal was set.
    before: Option<Termios>,
    waiting: VecDeque<Key>,
}

impl Keys {
    /// Takes the terminal, if there is one. Ctrl-C goes on to be a signal.
    pub fn take() -> Keys {
        let set = || -> rustix::io::Result<Termios> {
            let before = termios::tcgetattr(stdin())?;
            let mut now = before.clone();
            now.local_modes -= LocalModes::ICANON | LocalModes::ECHO;
            // A read gives what there is and does not wait.
            (now.special_codes[SpecialCodeIndex::VMIN], now.special_codes[SpecialCodeIndex::VTIME]) = (0, 0);
            termios::tcsetattr(stdin(), OptionalActions::Now, &now)?;
            Ok(before)
        };
        let before = if stdin().is_terminal() { set().ok() } else { None };
        Keys { before, waiting: VecDeque::new() }
    }

    /// Whether keys can be pressed at all.
    pub fn are_there(&self) -> bool {
        self.before.is_some()
    }

    /// The next key; waits for one as long as is said.
    pub fn next(&mut self, wait: Duration) -> Option<Key> {
        if self.waiting.is_empty() {
            if self.before.is_none() {
                std::thread::park_timeout(wait);
                return None;
            }
            let timeout = Timespec::try_from(wait).ok();
            // A signal ends the wait, too.
            let ready = poll(&mut [PollFd::new(&stdin(), PollFlags::IN)], timeout.as_ref());
            let mut bytes = [0; 64];
            if matches!(ready, Ok(1..))
                && let Ok(count) = rustix::io::read(stdin(), &mut bytes)
            {
                if count == 0 {
                    // The terminal has gone away.
                    self.before = None;
                }
                let mut rest = &bytes[..count];
                while !rest.is_empty() {
                    let (key, length) = Key::parse(rest);
                    self.waiting.extend(key);
                    rest = &rest[length..];
                }
            }
        }
        self.waiting.pop_front()
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        if let Some(before) = &self.before {
            // If the terminal is gone, nobody sees it.
            let _ = termios::tcsetattr(stdin(), OptionalActions::Now, before);
        }
    }
}

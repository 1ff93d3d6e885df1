//! Where a replay stands, and what keys do to it: no clock, no terminal, no bus.
//!
//! The one thing to know: it says which step is due when; who calls it waits, publishes, and says what was pressed.

use std::time::Duration;

/// What can be asked for by a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// Play or rest.
    Pause,
    /// One step and rest.
    Step,
    /// Twice as fast.
    Faster,
    /// Half as fast.
    Slower,
    /// As fast as the listeners take it, or at the rate before.
    Unbound,
    /// A second of simulated time back.
    Back,
    /// A second of simulated time on.
    Forward,
    /// To the first step of the range.
    Home,
    /// To the last step of the range.
    End,
    /// From the last step to the first again, or not.
    Loop,
    /// End the replay.
    Quit,
}

/// The keys, for the help and for the start of a replay.
pub const KEYS: &str = "space pause or play, . one step, + twice and - half as fast, f as fast as possible, left and \
                        right arrow a second back and on, home and end, l loop, q quit";

impl Key {
    /// What the bytes that a terminal sends ask for, and how many of them that takes; `None` for no key of these.
    pub fn parse(bytes: &[u8]) -> (Option<Key>, usize) {
        const SEQUENCES: [(&[u8], Key); 8] = [
            (b"\x1b[D", Key::Back),
            (b"\x1b[C", Key::Forward),
            (b"\x1bOD", Key::Back),
            (b"\x1bOC", Key::Forward),
            (b"\x1b[H", Key::Home),
            (b"\x1b[F", Key::End),
            (b"\x1b[1~", Key::Home),
            (b"\x1b[4~", Key::End),
        ];
        for (sequence, key) in SEQUENCES {
            if bytes.starts_with(sequence) {
                return (Some(key), sequence.len());
            }
        }
        let key = match bytes.first() {
            Some(b' ') => Key::Pause,
            Some(b'.') => Key::Step,
            Some(b'+' | b'=') => Key::Faster,
            Some(b'-') => Key::Slower,
            Some(b'f') => Key::Unbound,
            Some(b'l') => Key::Loop,
            Some(b'q') => Key::Quit,
            // Another key's sequence goes by as a whole.
            Some(b'\x1b') => return (None, bytes.len()),
            Some(_) => return (None, 1),
            None => return (None, 0),
        };
        (Some(key), 1)
    }
}

/// When the next step is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// Now.
    Now,
    /// After so long.
    In(Duration),
    /// When a key is pressed.
    Resting,
    /// Never: the last step of the range was played.
    Over,
}

/// A replay's place in time.
#[derive(Clone, Debug)]
pub struct Player {
    first: u64,
    last: u64,
    time_step_s: f64,
    /// The step that is played next; one beyond `last` when all were.
    next: u64,
    playing: bool,
    /// Simulated seconds in a second of time.
    rate: f64,
    unbound: bool,
    looped: bool,
    /// Whether steps can be left out or played again.
    seeks: bool,
    /// A step and when it was due.
    anchor: (u64, Duration),
}

impl Player {
    /// At the first step of a range, at some rate or as fast as possible (`None`). A listener that needs every step once,
    /// in order, forbids seeking.
    pub fn new(
        range: std::ops::RangeInclusive<u64>,
        time_step_s: f64,
        rate: Option<f64>,
        seeks: bool,
    ) -> Player {
        let (first, last) = range.into_inner();
        Player {
            first,
            last,
            time_step_s,
            next: first,
            playing: true,
            rate: rate.unwrap_or(1.0),
            unbound: rate.is_none(),
            looped: false,
            seeks,
            anchor: (first, Duration::ZERO),
        }
    }

    /// Begins at rest.
    pub fn paused(self, paused: bool) -> Player {
        Player { playing: !paused, ..self }
    }

    /// Plays again and again.
    pub fn looped(self, looped: bool) -> Player {
        Player { looped, ..self }
    }

    /// The step that is played next.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// When the next step is due, `now` after the start.
    pub fn due(&self, now: Duration) -> Due {
        if self.next > self.last {
            return Due::Over;
        }
        if !self.playing {
            return Due::Resting;
        }
        let (step, at) = self.anchor;
        let seconds = (self.next - step) as f64 * self.time_step_s / self.rate;
        // A step that is not due in the time that a clock can count is as good as resting.
        match (self.unbound, Duration::try_from_secs_f64(seconds)) {
            (true, _) => Due::Now,
            (false, Err(_)) => Due::Resting,
            (false, Ok(later)) => match (at + later).checked_sub(now) {
                None | Some(Duration::ZERO) => Due::Now,
                Some(left) => Due::In(left),
            },
        }
    }

    /// The next step was played.
    pub fn played(&mut self, now: Duration) {
        self.next += 1;
        if self.next > self.last && self.looped {
            self.go_to(self.first, now);
        }
    }

    /// A key was pressed. Says what it did, or why it does nothing.
    pub fn press(&mut self, key: Key, now: Duration) -> String {
        let second = libm::round(1.0 / self.time_step_s) as u64;
        match key {
            Key::Pause => self.play(!self.playing, now),
            Key::Step => {
                // The one step is due now, and none after it.
                self.play(false, now);
                return self.state();
            }
            Key::Faster | Key::Slower => {
                let factor = if key == Key::Faster { 2.0 } else { 0.5 };
                let rate = self.rate * factor;
                if (1e-6..=1e6).contains(&rate) {
                    self.rate = rate;
                }
                self.unbound = false;
                self.anchor = (self.next, now);
            }
            Key::Unbound => {
                self.unbound = !self.unbound;
                self.anchor = (self.next, now);
            }
            Key::Quit => {}
            _ if !self.seeks => {
                return "the recorder needs every step once, in order: no seeking and no loop; add --no-record to play for \
                        other listeners"
                    .to_owned();
            }
            Key::Back => self.go_to(self.next.saturating_sub(second), now),
            Key::Forward => self.go_to(self.next.saturating_add(second), now),
            Key::Home => self.go_to(self.first, now),
            Key::End => self.go_to(self.last, now),
            Key::Loop => self.looped = !self.looped,
        }
        self.state()
    }

    fn play(&mut self, playing: bool, now: Duration) {
        self.playing = playing;
        self.anchor = (self.next, now);
    }

    fn go_to(&mut self, step: u64, now: Duration) {
        self.next = if step < self.first {
            self.first
        } else if step > self.last {
            self.last
        } else {
            step
        };
        self.anchor = (self.next, now);
    }

    fn state(&self) -> String {
        let what = if self.playing { "playing" } else { "resting" };
        let rate = if self.unbound {
            "as fast as possible".to_owned()
        } else {
            format!("{} times as fast", self.rate)
        };
        let looped = if self.looped { ", in a loop" } else { "" };
        format!("{what} at step {} of {}, {rate}{looped}", self.next, self.last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: fn(u64) -> Duration = Duration::from_millis;

    /// Plays steps as they become due until there is nothing to do at `now`.
    fn play(player: &mut Player, now: Duration, limit: usize) -> Vec<u64> {
        let mut steps = Vec::new();
        while player.due(now) == Due::Now && steps.len() < limit {
            steps.push(player.next());
            player.played(now);
        }
        steps
    }

    #[test]
    fn steps_are_due_at_the_rate() {
        // A step is 10 ms; twice as fast as real time, one is due every 5 ms.
        let mut player = Player::new(2..=6, 0.01, Some(2.0), true);
        assert_eq!(play(&mut player, MS(0), 9), [2]);
        assert_eq!(player.due(MS(4)), Due::In(MS(1)));
        assert_eq!(play(&mut player, MS(14), 9), [3, 4]);
        player.press(Key::Slower, MS(14));
        assert_eq!(play(&mut player, MS(14), 9), [5]);
        assert_eq!(player.due(MS(15)), Due::In(MS(9)));
        player.press(Key::Unbound, MS(15));
        assert_eq!(play(&mut player, MS(15), 9), [6]);
        assert_eq!(player.due(MS(15)), Due::Over);
    }

    #[test]
    fn it_rests_and_makes_single_steps() {
        let mut player = Player::new(0..=9, 0.01, None, false).paused(true);
        assert_eq!(player.due(MS(0)), Due::Resting);
        // The caller plays one step for it.
        assert!(player.press(Key::Step, MS(1)).contains("resting at step 0 of 9"));
        player.played(MS(1));
        assert_eq!((player.due(MS(2)), player.next()), (Due::Resting, 1));
        player.press(Key::Pause, MS(3));
        assert_eq!(play(&mut player, MS(3), 99), (1..=9).collect::<Vec<_>>());
        // A pause is not made up for.
        let mut player = Player::new(0..=9, 0.01, Some(1.0), false);
        play(&mut player, MS(0), 9);
        player.press(Key::Pause, MS(1));
        assert_eq!(player.due(MS(5000)), Due::Resting);
        player.press(Key::Pause, MS(5000));
        assert_eq!(play(&mut player, MS(5000), 9), [1]);
        assert_eq!(player.due(MS(5001)), Due::In(MS(9)));
    }

    #[test]
    fn it_seeks_and_loops_within_its_range_unless_a_recorder_listens() {
        let mut player = Player::new(100..=450, 0.01, None, true);
        let mut at = |key| {
            player.press(key, MS(0));
            player.next()
        };
        let keys = [Key::Back, Key::Forward, Key::Forward, Key::Back, Key::End, Key::Forward, Key::Home];
        assert_eq!(keys.map(&mut at), [100, 200, 300, 200, 450, 450, 100]);
        player.press(Key::Loop, MS(0));
        assert_eq!(play(&mut player, MS(0), 353)[350..], [450, 100, 101]);
        let mut bound = Player::new(0..=9, 0.01, None, false);
        for key in [Key::Back, Key::Forward, Key::Home, Key::End, Key::Loop] {
            assert!(bound.press(key, MS(0)).contains("--no-record"));
            assert_eq!(bound.next(), 0);
        }
    }

    #[test]
    fn keys_are_read_from_what_terminals_send() {
        let mut bytes: &[u8] = b" .+=-flq\x1b[D\x1bOC\x1b[H\x1b[4~x";
        let mut keys = Vec::new();
        while !bytes.is_empty() {
            let (key, length) = Key::parse(bytes);
            keys.extend(key);
            bytes = &bytes[length..];
        }
        use Key::*;
        assert_eq!(
            keys,
            [Pause, Step, Faster, Faster, Slower, Unbound, Loop, Quit, Back, Forward, Home, End]
        );
        assert_eq!(Key::parse(b"\x1b[15~"), (None, 5));
        assert_eq!(Key::parse(b""), (None, 0));
    }
}

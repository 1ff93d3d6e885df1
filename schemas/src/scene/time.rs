//! Simulated time: how long, in which steps, and when a frame is taken.

use serde::{Deserialize, Deserializer, Serialize, de};
use std::fmt;

/// Simulated time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "TimeInFile")]
pub struct Time {
    /// Simulated time of the whole run, in seconds.
    pub duration_s: f64,
    /// Simulated time of one step, in seconds; in a file also `"auto"`.
    pub time_step_s: f64,
    /// The file says `time_step_s = "auto"`: the simulator takes a step from the scene's stiffness when it
    /// compiles the scene, and what it publishes and logs holds the number. Until then `time_step_s` is the
    /// time between two frames.
    #[serde(skip)]
    pub automatic: bool,
    /// Frames per second of simulated time, at most one a step; also the movie's rate.
    pub frames_per_second: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TimeInFile {
    duration_s: f64,
    time_step_s: StepInFile,
    #[serde(default = "default_frames_per_second")]
    frames_per_second: f64,
}

fn default_frames_per_second() -> f64 {
    24.0
}

impl From<TimeInFile> for Time {
    fn from(file: TimeInFile) -> Time {
        let TimeInFile { duration_s, time_step_s, frames_per_second } = file;
        let (time_step_s, automatic) = match time_step_s {
            StepInFile::Seconds(seconds) => (seconds, false),
            StepInFile::Auto => (1.0 / frames_per_second, true),
        };
        Time { duration_s, time_step_s, automatic, frames_per_second }
    }
}

enum StepInFile {
    Seconds(f64),
    Auto,
}

impl<'de> Deserialize<'de> for StepInFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<StepInFile, D::Error> {
        deserializer.deserialize_any(StepVisitor)
    }
}

struct StepVisitor;

impl de::Visitor<'_> for StepVisitor {
    type Value = StepInFile;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a number of seconds, or \"auto\"")
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<StepInFile, E> {
        Ok(StepInFile::Seconds(value))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<StepInFile, E> {
        Ok(StepInFile::Seconds(value as f64))
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<StepInFile, E> {
        Ok(StepInFile::Seconds(value as f64))
    }

    fn visit_str<E: de::Error>(self, value: &str) -> Result<StepInFile, E> {
        if value == "auto" {
            return Ok(StepInFile::Auto);
        }
        Err(E::invalid_value(de::Unexpected::Str(value), &self))
    }
}

impl Time {
    /// Steps of the whole run: the duration over the time step, rounded to nearest.
    pub fn step_count(&self) -> u64 {
        nearest(self.duration_s / self.time_step_s)
    }

    /// Frames of the whole run: frame `k` is taken at time `k / frames_per_second`, while that lies before
    /// the end. A run of no duration has one frame.
    pub fn frame_count(&self) -> u64 {
        let frames = libm::ceil(self.duration_s * self.frames_per_second - 1e-9) as u64;
        if frames == 0 { 1 } else { frames }
    }

    /// The step at which a frame is taken: the one nearest to the frame's time.
    pub fn frame_step(&self, frame: u64) -> u64 {
        nearest(frame as f64 / (self.frames_per_second * self.time_step_s))
    }

    /// Whether a step is the run's last, or a frame is taken at it: the steps of the audits.
    pub fn is_audited(&self, step: u64) -> bool {
        step == self.step_count() || self.frame_at(step).is_some()
    }

    /// The frame that is taken at a step, if one is.
    pub fn frame_at(&self, step: u64) -> Option<u64> {
        let guess = libm::floor(step as f64 * self.time_step_s * self.frames_per_second) as u64;
        (guess.saturating_sub(1)..=guess.saturating_add(1))
            .find(|&frame| self.frame_step(frame) == step && frame < self.frame_count())
    }
}

fn nearest(value: f64) -> u64 {
    libm::floor(value + 0.5) as u64
}

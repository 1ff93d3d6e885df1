//! Rebuilding a broken log: what is whole in it, in the order of a log, with a new index and an end.
//!
//! The one thing to know: the new log is a log like any other. It goes from step 0 to the last step up to which nothing
//! is missing. Steps that are lost in the middle can be made again by a simulator ([`Remake`]); the chained hash of the
//! next step that is there proves them.

use crate::check::Counts;
use crate::container_writer::Sink;
use crate::fault::{LogError, LogProblem};
use crate::rebuild::{Attempt, Source};
use crate::salvage::{Loss, salvage};
use schemas::Hash;
use schemas::end::Outcome;
use schemas::scene::SceneRecord;
use schemas::state::StateMessage;
use schemas::step::StepRecord;
use serde::Serialize;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Takes the record and the state message of a step.
pub type Emit<'a> = &'a mut dyn FnMut(&StepRecord, &[u8]) -> Result<(), String>;

/// What simulates lost steps again.
pub trait Remake {
    /// Simulates from a state to the step `last` and emits the record and the state message of each step on the way.
    ///
    /// # Errors
    ///
    /// Why it cannot be done: another version of the program, most often.
    fn remake(
        &mut self,
        scene: &SceneRecord,
        state: StateMessage,
        chained_hash: Hash,
        last: u64,
        emit: Emit<'_>,
    ) -> Result<(), String>;
}

/// What became of a broken log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recovery {
    /// Last step of the new log, and its simulated time (s).
    pub last_step: u64,
    /// The time of the last step (s).
    pub sim_time_s: f64,
    /// Steps that the scene asks for.
    pub steps_planned: u64,
    /// What the new log holds.
    pub counts: Counts,
    /// Steps of the new log that were lost and have been simulated again.
    pub steps_remade: u64,
    /// Steps that the broken log tells of and the new one has not.
    pub steps_lost: u64,
    /// Frames that the broken log tells of and the new one has not.
    pub frames_lost: u64,
    /// Frames that the new log's steps ask for, if it was recorded with a renderer.
    pub frames_due: u64,
    /// Size of the broken log.
    pub bytes: u64,
    /// Bytes of it that no checksum vouches for, the index aside.
    pub bytes_lost: u64,
    /// Where they are.
    pub losses: Vec<Loss>,
    /// How the run ended, as the new log says.
    pub outcome: Outcome,
    /// Why lost steps were not simulated again.
    pub remake_failed: Option<String>,
}

impl Recovery {
    /// Whether the new log holds all that was ever written, to the end of the run.
    pub fn is_complete(&self) -> bool {
        let has_end = !matches!(self.outcome, Outcome::Recovered(_));
        has_end && self.frames_lost == 0 && (self.bytes_lost == 0 || self.counts.frames == self.frames_due)
    }
}

/// Why nothing was recovered.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    /// The broken log cannot be read, or is none.
    #[error(transparent)]
    Log(#[from] LogError),
    /// There is nothing to make a log of.
    #[error("{file}: nothing can be recovered: {reason}")]
    Nothing {
        /// The broken log.
        file: String,
        /// What is missing.
        reason: String,
    },
    /// The new log exists already.
    #[error("{} exists already; choose another file, or add --force to replace it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The new log cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
}

/// Rebuilds the log `broken` as the file `out`. The file appears when it is finished, or not at all.
///
/// # Errors
///
/// [`RecoverError`]; `out` is as it was before.
pub fn recover(
    broken: &Path,
    out: &Path,
    force: bool,
    remake: Option<&mut dyn Remake>,
) -> Result<Recovery, RecoverError> {
    let file = broken.display().to_string();
    let map =
        crate::reader::map(broken).map_err(|error| LogError { file: file.clone(), problem: error.into() })?;
    let exists = || RecoverError::Exists { path: out.to_owned() };
    let write_error = |source| RecoverError::Write { path: out.to_owned(), source };
    if out.exists() && !force {
        return Err(exists());
    }
    let mut temporary = None;
    let mut make = || -> io::Result<File> {
        let made = temporary_beside(out)?;
        let handle = made.as_file().try_clone()?;
        temporary = Some(made);
        Ok(handle)
    };
    let (written, recovery) = recover_bytes(&map, &mut make, remake).map_err(|error| match error {
        BytesError::Problem(problem) => LogError { file: file.clone(), problem }.into(),
        BytesError::Nothing(reason) => RecoverError::Nothing { file: file.clone(), reason },
        BytesError::Io(source) => write_error(source),
    })?;
    written.sync_all().map_err(write_error)?;
    match keep(temporary.expect("it was written to"), out, force) {
        Ok(()) => Ok(recovery),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(exists()),
        Err(error) => Err(write_error(error)),
    }
}

/// A file in the folder of `out` that is gone if it is not kept.
pub(crate) fn temporary_beside(out: &Path) -> io::Result<NamedTempFile> {
    use std::os::unix::fs::PermissionsExt;
    let folder = match out.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    tempfile::Builder::new()
        .prefix(".chainmail-")
        // As any new file: what the user's mask leaves of it.
        .permissions(std::fs::Permissions::from_mode(0o666))
        .tempfile_in(folder)
}

/// Gives a finished file its name; with `force`, in place of another.
pub(crate) fn keep(finished: NamedTempFile, out: &Path, force: bool) -> io::Result<()> {
    let kept = if force { finished.persist(out) } else { finished.persist_noclobber(out) };
    kept.map(drop).map_err(|error| error.error)
}

/// Why [`recover_bytes`] made nothing.
#[derive(Debug)]
pub enum BytesError {
    /// The bytes are no log.
    Problem(LogProblem),
    /// There is nothing to make a log of.
    Nothing(String),
    /// The sink refused bytes.
    Io(io::Error),
}

/// As [`recover`], from bytes to a sink. `make` makes an empty sink; what an earlier one holds is of no use.
///
/// # Errors
///
/// [`BytesError`].
pub fn recover_bytes<W: Sink>(
    broken: &[u8],
    make: &mut dyn FnMut() -> io::Result<W>,
    mut remake: Option<&mut dyn Remake>,
) -> Result<(W, Recovery), BytesError> {
    let found = salvage(broken).map_err(BytesError::Problem)?;
    let mut source = Source::new(broken, found)?;
    loop {
        let sink = make().map_err(BytesError::Io)?;
        match source.rebuild(sink, &mut remake)? {
            Attempt::Done(done) => return Ok(done),
            // Each refusal takes something away that is not taken again, so this ends.
            Attempt::Refused => {}
        }
    }
}

impl std::fmt::Display for Recovery {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Counts { states, frames, .. } = self.counts;
        writeln!(
            f,
            "steps           0 to {} of {}, {} s",
            self.last_step, self.steps_planned, self.sim_time_s
        )?;
        writeln!(f, "states          {states}")?;
        writeln!(f, "frames          {frames} of the {} that these steps ask for", self.frames_due)?;
        if self.steps_remade > 0 {
            let steps = self.steps_remade;
            writeln!(
                f,
                "made again      {steps} lost steps, simulated and proven by the chained hash after them"
            )?;
        }
        if let Some(reason) = &self.remake_failed {
            writeln!(f, "not made again  {reason}")?;
        }
        let is_all = self.is_complete();
        let lost = if is_all {
            "nothing".to_owned()
        } else {
            let (steps, frames) = (self.steps_lost, self.frames_lost);
            format!(
                "{steps} steps and {frames} frames that the broken log tells of, {} bytes",
                self.bytes_lost
            )
        };
        writeln!(f, "lost            {lost}")?;
        for loss in &self.losses {
            let what = if loss.is_index { "index, made again" } else { &loss.what };
            writeln!(f, "  at byte       {}, {} bytes: {what}", loss.offset, loss.bytes)?;
        }
        write!(f, "outcome         {}", crate::summary::outcome_text(Some(&self.outcome)))
    }
}

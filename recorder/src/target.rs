//! The file that a log is written into: nothing of the user's is lost for nothing.

use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A recorder whose supervisor was killed is gone after about 2 s; one that is still there then records.
const WAIT_FOR_ANOTHER: Duration = Duration::from_secs(4);
/// Locks come with no event that could be waited for with a limit.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// Why a file cannot be written.
pub(crate) enum Refusal {
    /// It exists, and is not to be replaced.
    Exists,
    /// Another recorder is writing it.
    Busy,
    /// The system refuses.
    Io(io::Error),
}

/// The log file, not yet begun.
///
/// A regular file is locked for as long as it is open here: two recorders never write one file, and none removes what
/// another has begun. Readers ask for no lock. Where the file system has no locks there is none.
pub(crate) struct Target {
    file: File,
    path: PathBuf,
    is_new: bool,
    /// Pipes and devices can neither be locked, cut to length nor synced.
    is_regular: bool,
}

impl Target {
    /// Opens the file without touching what is in it, so that a bad path shows before anything starts.
    pub fn open(path: &Path, replace: bool) -> Result<Target, Refusal> {
        Target::open_within(WAIT_FOR_ANOTHER, path, replace)
    }

    fn open_within(wait: Duration, path: &Path, replace: bool) -> Result<Target, Refusal> {
        let deadline = Instant::now() + wait;
        loop {
            let (file, is_new) = match OpenOptions::new().write(true).create_new(true).open(path) {
                Ok(file) => (file, true),
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(Refusal::Io(error)),
                Err(_) if !replace => return Err(Refusal::Exists),
                Err(_) => match OpenOptions::new().write(true).open(path) {
                    Ok(file) => (file, false),
                    // It was removed in this very moment; a link that leads nowhere is still there.
                    Err(error) if error.kind() == io::ErrorKind::NotFound && !path.is_symlink() => continue,
                    Err(error) => return Err(Refusal::Io(error)),
                },
            };
            let is_regular = file.metadata().map_err(Refusal::Io)?.is_file();
            let target = Target { file, path: path.to_owned(), is_new, is_regular };
            if !is_regular || target.is_mine().map_err(Refusal::Io)? {
                return Ok(target);
            }
            if Instant::now() > deadline {
                return Err(Refusal::Busy);
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }

    /// Locks the file; whether nobody else has, and its name still leads to it.
    fn is_mine(&self) -> io::Result<bool> {
        match self.file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(false),
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
            Err(TryLockError::Error(error)) => return Err(error),
        }
        let mine = self.file.metadata()?;
        match std::fs::metadata(&self.path) {
            Ok(named) => Ok((named.dev(), named.ino()) == (mine.dev(), mine.ino())),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Leaves everything as it was before.
    pub fn abandon(self) {
        if self.is_new {
            // If it cannot be removed, an empty file stays behind; there is a better error to report.
            let _ = std::fs::remove_file(&self.path);
        }
    }

    /// Empties the file. Returns it, and a second handle to sync it by, if it can be synced.
    pub fn begin(self) -> io::Result<(File, Option<File>)> {
        if !self.is_regular {
            return Ok((self.file, None));
        }
        self.file.set_len(0)?;
        let handle = self.file.try_clone()?;
        Ok((self.file, Some(handle)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn busy(opened: Result<Target, Refusal>) -> bool {
        matches!(opened, Err(Refusal::Busy))
    }

    #[test]
    fn two_recorders_never_have_one_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        let Ok(first) = Target::open(&path, true) else { panic!("a new file") };
        let soon = |path| Target::open_within(LOOK_EVERY * 2, path, true);
        assert!(busy(soon(&path)), "it is to be written");
        let Ok((written, handle)) = first.begin() else { panic!("an empty file") };
        assert!(busy(soon(&path)), "begun or not");
        drop((written, handle));
        assert!(soon(&path).is_ok(), "a recorder that has ended, however it ended, is in nobody's way");
    }

    #[test]
    fn who_waited_for_a_file_that_was_abandoned_has_one_that_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        let Ok(first) = Target::open(&path, true) else { panic!("a new file") };
        // What the second has opened while it waits.
        let file = OpenOptions::new().write(true).open(&path).unwrap();
        let waiting = Target { file, path: path.clone(), is_new: false, is_regular: true };
        assert!(!waiting.is_mine().unwrap(), "the first has it");
        first.abandon();
        assert!(!waiting.is_mine().unwrap(), "it is free, but its name leads nowhere");
        let Ok(second) = Target::open(&path, true) else { panic!("the next has its turn") };
        assert!(second.begin().is_ok() && path.exists(), "and its file is there");
    }
}

//! The file that a log is written into: nothing of the user's is lost for nothing.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// Why a file cannot be written.
pub(crate) enum Refusal {
    /// It exists, and is not to be replaced.
    Exists,
    /// The system refuses.
    Io(io::Error),
}

/// The log file, not yet begun.
pub(crate) struct Target {
    file: File,
    path: PathBuf,
    is_new: bool,
    /// Pipes and devices can neither be cut to length nor synced.
    is_regular: bool,
}

impl Target {
    /// Opens the file without touching what is in it, so that a bad path shows before anything starts.
    pub fn open(path: &Path, replace: bool) -> Result<Target, Refusal> {
        let (file, is_new) = match OpenOptions::new().write(true).create_new(true).open(path) {
            Ok(file) => (file, true),
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(Refusal::Io(error)),
            Err(_) if !replace => return Err(Refusal::Exists),
            Err(_) => (OpenOptions::new().write(true).open(path).map_err(Refusal::Io)?, false),
        };
        let is_regular = file.metadata().map_err(Refusal::Io)?.is_file();
        Ok(Target { file, path: path.to_owned(), is_new, is_regular })
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

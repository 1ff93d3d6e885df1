//! From the log's frames to picture files and a movie; the log is the only source.

use crate::failure::Failure;
use crate::log_file;
#[cfg(feature = "movie")]
use crate::movie::{Movie, Picture};
#[cfg(feature = "movie")]
use crate::terminal::say;
use recorder::{Kind, Log};
use std::fs;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

/// What was made.
pub struct Made {
    /// The folder of the frames, if there are any.
    pub frames: Option<PathBuf>,
    /// The movie, if one could be made.
    pub movie: Option<PathBuf>,
}

/// Writes `frames/0000.png`, ... (byte for byte as in the log) and `movie.mp4` into a folder; those of an
/// earlier run in it are removed.
pub fn export(log: &Log, folder: &Path) -> Result<Made, Failure> {
    let fail = |path: &Path, error: Error| Failure::lost(format!("cannot write {}: {error}", path.display()));
    remove_earlier(folder).map_err(|error| fail(folder, error))?;
    let count = log.count(Kind::Frame);
    if count == 0 {
        return Ok(Made { frames: None, movie: None });
    }
    let frames = folder.join("frames");
    fs::create_dir_all(&frames).map_err(|error| fail(&frames, error))?;
    let mut movie = InTheMaking::new(log, folder)?;
    for index in 0..count {
        let image = log.frame(index).map_err(log_file::failure)?;
        let path = frames.join(format!("{index:04}.png"));
        fs::write(&path, &image.data).map_err(|error| fail(&path, error))?;
        movie.push(&image.data);
    }
    Ok(Made { frames: Some(frames), movie: movie.finish() })
}

/// Removes what a run writes beside its log, and nothing else: `movie.mp4`, `frames/NNNN.png` and `frames/NNNN.exr`.
pub fn remove_earlier(folder: &Path) -> Result<(), Error> {
    match fs::remove_file(folder.join("movie.mp4")) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let frames = folder.join("frames");
    if !fs::symlink_metadata(&frames).is_ok_and(|file| file.is_dir()) {
        return Ok(());
    }
    for frame in fs::read_dir(frames)? {
        let path = frame?.path();
        let number = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or("");
        let is_numbered = number.len() >= 4 && number.bytes().all(|byte| byte.is_ascii_digit());
        if is_numbered && path.extension().is_some_and(|extension| extension == "png" || extension == "exr") {
            fs::remove_file(path)?;
        }
    }
    Ok(())
}

/// A movie in the making. What goes wrong with it is a warning: log and frames are there.
#[cfg(feature = "movie")]
pub struct InTheMaking {
    path: PathBuf,
    frames_per_second: f64,
    state: State,
}

#[cfg(feature = "movie")]
enum State {
    Empty,
    Begun(Box<Movie>),
    Failed,
}

#[cfg(feature = "movie")]
impl InTheMaking {
    pub fn new(log: &Log, folder: &Path) -> Result<InTheMaking, Failure> {
        let frames_per_second = log.scene().map_err(log_file::failure)?.scene.time.frames_per_second;
        Ok(InTheMaking { path: folder.join("movie.mp4"), frames_per_second, state: State::Empty })
    }

    pub fn push(&mut self, png: &[u8]) {
        if let Err(reason) = self.try_push(png) {
            self.fail(&reason);
        }
    }

    fn try_push(&mut self, png: &[u8]) -> Result<(), String> {
        if let State::Failed = self.state {
            return Ok(());
        }
        let picture = Picture::from_png(png)?;
        if let State::Empty = self.state {
            let movie = Movie::create(&self.path, &picture, self.frames_per_second)?;
            self.state = State::Begun(Box::new(movie));
        }
        match &mut self.state {
            State::Begun(movie) => movie.push(picture),
            State::Empty | State::Failed => Ok(()),
        }
    }

    pub fn finish(mut self) -> Option<PathBuf> {
        match std::mem::replace(&mut self.state, State::Failed) {
            State::Begun(movie) => match movie.finish() {
                Ok(()) => Some(self.path),
                Err(reason) => {
                    self.fail(&reason);
                    None
                }
            },
            State::Empty | State::Failed => None,
        }
    }

    fn fail(&mut self, reason: &str) {
        let reason = reason.lines().next().unwrap_or_default();
        say(format!("warning: no movie: {reason}; the frames are there"));
        self.state = State::Failed;
        // Half a movie is of no use. If it was never begun, there is nothing to remove.
        let _ = fs::remove_file(&self.path);
    }
}

/// Without movies: nothing to make.
#[cfg(not(feature = "movie"))]
pub struct InTheMaking;

#[cfg(not(feature = "movie"))]
impl InTheMaking {
    pub fn new(_: &Log, _: &Path) -> Result<InTheMaking, Failure> {
        Ok(InTheMaking)
    }

    pub fn push(&mut self, _: &[u8]) {}

    pub fn finish(self) -> Option<PathBuf> {
        None
    }
}

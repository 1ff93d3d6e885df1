//! From the log's frames to picture files and a movie; the log is the only source.

use crate::failure::Failure;
use crate::log_file;
#[cfg(feature = "movie")]
use crate::movie::Movie;
use recorder::{Kind, Log};
use std::fs;
use std::path::{Path, PathBuf};

/// What was made.
pub struct Made {
    /// The folder of the frames, if there are any.
    pub frames: Option<PathBuf>,
    /// The movie, if one could be made.
    pub movie: Option<PathBuf>,
}

/// Writes `frames/0000.png`, ... (byte for byte as in the log) and `movie.mp4` into a folder.
pub fn export(log: &Log, folder: &Path) -> Result<Made, Failure> {
    let count = log.count(Kind::Frame);
    if count == 0 {
        return Ok(Made { frames: None, movie: None });
    }
    let frames = folder.join("frames");
    let fail = |path: &Path, error: std::io::Error| {
        Failure::lost(format!("cannot write {}: {error}", path.display()))
    };
    fs::create_dir_all(&frames).map_err(|error| fail(&frames, error))?;
    let mut movie = movie_in(log, folder)?;
    for index in 0..count {
        let image = log.frame(index).map_err(log_file::failure)?;
        let path = frames.join(format!("{index:04}.png"));
        fs::write(&path, &image.data).map_err(|error| fail(&path, error))?;
        movie.push(&image.data)?;
    }
    Ok(Made { frames: Some(frames), movie: movie.finish()? })
}

/// A movie in the making; nothing where the program was built without movies.
struct InTheMaking {
    #[cfg(feature = "movie")]
    path: PathBuf,
    #[cfg(feature = "movie")]
    frames_per_second: f64,
    /// Whether the first picture has been seen, by whose size a movie is begun or not.
    #[cfg(feature = "movie")]
    started: bool,
    #[cfg(feature = "movie")]
    movie: Option<Movie>,
}

#[cfg(feature = "movie")]
fn movie_in(log: &Log, folder: &Path) -> Result<InTheMaking, Failure> {
    let frames_per_second = log.scene().map_err(log_file::failure)?.scene.time.frames_per_second;
    Ok(InTheMaking { path: folder.join("movie.mp4"), frames_per_second, started: false, movie: None })
}

#[cfg(not(feature = "movie"))]
fn movie_in(_: &Log, _: &Path) -> Result<InTheMaking, Failure> {
    Ok(InTheMaking {})
}

impl InTheMaking {
    #[cfg(feature = "movie")]
    fn push(&mut self, png: &[u8]) -> Result<(), Failure> {
        use crate::movie::Picture;
        let fail = |what| Failure::lost(format!("cannot make the movie: {what}; the frames are there"));
        let picture = Picture::from_png(png).map_err(fail)?;
        if !self.started {
            self.started = true;
            match Movie::create(&self.path, &picture, self.frames_per_second) {
                Ok(movie) => self.movie = Some(movie),
                Err(reason) => eprintln!("warning: no movie: {reason}; the frames are there"),
            }
        }
        self.movie.as_mut().map_or(Ok(()), |movie| movie.push(picture).map_err(fail))
    }

    #[cfg(feature = "movie")]
    fn finish(self) -> Result<Option<PathBuf>, Failure> {
        let Some(movie) = self.movie else { return Ok(None) };
        movie.finish().map_err(|what| Failure::lost(format!("cannot finish the movie: {what}")))?;
        Ok(Some(self.path))
    }

    #[cfg(not(feature = "movie"))]
    fn push(&mut self, _: &[u8]) -> Result<(), Failure> {
        Ok(())
    }

    #[cfg(not(feature = "movie"))]
    fn finish(self) -> Result<Option<PathBuf>, Failure> {
        Ok(None)
    }
}

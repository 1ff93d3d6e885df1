//! The folder that a run writes into: a new one, unless the user names one; never over the user's files.

use crate::failure::Failure;
use std::fs;
use std::path::{Path, PathBuf};

/// Makes the output folder: `out` if it is named, else `out/STEM`, `out/STEM-2`, ...
///
/// A named folder that exists and is not empty is refused without `force`. With it, only what a run itself
/// writes is removed (`log.mcap`, `movie.mp4`, `frames/*.png`).
pub fn make(out: Option<&Path>, stem: &str, force: bool) -> Result<PathBuf, Failure> {
    let folder = match out {
        Some(folder) => folder.to_owned(),
        None => return make_new(stem),
    };
    let fail = |error: std::io::Error| {
        Failure::input(format!("cannot make the output folder {}: {error}", folder.display()))
    };
    match fs::read_dir(&folder) {
        Ok(mut entries) => {
            if entries.next().is_some() {
                if !force {
                    return Err(Failure::input(format!(
                        "the output folder {} exists and is not empty; name another with --out, or add --force to \
                         replace the run in it",
                        folder.display()
                    )));
                }
                remove_run(&folder).map_err(fail)?;
            }
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            fs::create_dir_all(&folder).map_err(fail)?
        }
        Err(error) => return Err(fail(error)),
    }
    Ok(folder)
}

fn make_new(stem: &str) -> Result<PathBuf, Failure> {
    let parent = Path::new("out");
    let fail = |path: &Path, error: std::io::Error| {
        Failure::input(format!(
            "cannot make the output folder {}: {error}; name one with --out",
            path.display()
        ))
    };
    fs::create_dir_all(parent).map_err(|error| fail(parent, error))?;
    for number in 1_u32.. {
        let name = if number == 1 { stem.to_owned() } else { format!("{stem}-{number}") };
        let folder = parent.join(name);
        match fs::create_dir(&folder) {
            Ok(()) => return Ok(folder),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(fail(&folder, error)),
        }
    }
    unreachable!("there are more numbers than folders")
}

fn remove_run(folder: &Path) -> std::io::Result<()> {
    for name in ["log.mcap", "movie.mp4"] {
        match fs::remove_file(folder.join(name)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    if let Ok(frames) = fs::read_dir(folder.join("frames")) {
        for frame in frames {
            let path = frame?.path();
            if path.extension().is_some_and(|extension| extension == "png") {
                fs::remove_file(path)?;
            }
        }
    }
    Ok(())
}

//! The folder that a run writes into: a new one, unless the user names one; never over the user's files.

use crate::failure::Failure;
use std::fs;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

/// Makes the output folder: `out` if it is named, else `out/STEM`, `out/STEM-2`, ...
///
/// A named folder that exists and is not empty is refused without `force`. Nothing in it is touched here: the
/// recorder replaces the log when the new run has begun, and pictures are replaced when it has ended.
pub fn make(out: Option<&Path>, stem: &str, force: bool) -> Result<PathBuf, Failure> {
    let Some(folder) = out else { return make_new(stem) };
    let fail =
        |error: Error| Failure::input(format!("cannot make the output folder {}: {error}", folder.display()));
    match fs::read_dir(folder) {
        Ok(mut entries) => {
            if entries.next().is_some() && !force {
                return Err(Failure::input(format!(
                    "the output folder {} exists and is not empty; name another with --out, or add --force to replace \
                     the run in it",
                    folder.display()
                )));
            }
        }
        Err(error) if error.kind() == ErrorKind::NotFound => fs::create_dir_all(folder).map_err(fail)?,
        Err(error) => return Err(fail(error)),
    }
    let frames = folder.join("frames");
    if frames.exists() && !frames.is_dir() {
        return Err(Failure::input(format!(
            "{} is in the way: expected a folder, or nothing",
            frames.display()
        )));
    }
    Ok(folder.to_owned())
}

fn make_new(stem: &str) -> Result<PathBuf, Failure> {
    let parent = Path::new("out");
    let fail = |path: &Path, error: Error| {
        Failure::input(format!(
            "cannot make the output folder {}: {error}; name one with --out",
            path.display()
        ))
    };
    fs::create_dir_all(parent).map_err(|error| fail(parent, error))?;
    let names = std::iter::once(stem.to_owned()).chain((2_u32..).map(|number| format!("{stem}-{number}")));
    for name in names {
        let folder = parent.join(name);
        match fs::create_dir(&folder) {
            Ok(()) => return Ok(folder),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(fail(&folder, error)),
        }
    }
    unreachable!("there are more numbers than folders")
}

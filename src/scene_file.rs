//! Scene files on disk.

use crate::failure::Failure;
use schemas::scene::Scene;
use std::fs;
use std::path::Path;

/// Loads a scene file with overrides and, if one is given, another seed; returns its text too.
pub fn load(path: &Path, overrides: &[String], seed: Option<u64>) -> Result<(Scene, String), Failure> {
    let text = fs::read_to_string(path)
        .map_err(|error| Failure::input(format!("cannot read the scene {}: {error}", path.display())))?;
    let scene = Scene::parse_seeded(&text, overrides, seed)
        .map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
    Ok((scene, text))
}

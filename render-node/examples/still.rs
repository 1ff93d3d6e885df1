//! Renders the initial state of a scene file to a PNG: `cargo run --release --example still -- SCENE PNG [KEY=VALUE ..]`.

use render_node::{RenderModel, initial_states, node, png_bytes, render};
use schemas::scene::Scene;
use std::num::NonZeroUsize;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(scene), Some(picture)) = (arguments.next(), arguments.next()) else {
        return Err("usage: still SCENE PNG [KEY=VALUE ..]".into());
    };
    let overrides: Vec<String> = arguments.collect();
    let scene = Scene::parse(&std::fs::read_to_string(scene)?, &overrides)?;
    let (model, _) = node::with_environment_file(RenderModel::compile(&scene).0)?;
    let threads = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let start = std::time::Instant::now();
    let film = render(&model, &initial_states(&scene)?, 0, scene.seed, threads)?;
    let seconds = start.elapsed().as_secs_f64();
    println!("{} rays, {seconds:.2} s, film {}", film.rays, film.hash().short());
    std::fs::write(picture, png_bytes(&film, &scene.render)?)?;
    Ok(())
}

//! Renders one frame of the drop scene's first state on one core and prints rays per second and the film's hash.
//!
//! `cargo bench -p render-node --bench render [-- KEY=VALUE ..]` with keys as `render.samples_per_pixel=16`.

use render_node::{RenderModel, render};
use rustix::time::{ClockId, clock_gettime};
use schemas::scene::Scene;
use std::num::NonZeroUsize;

/// Stands in for `scenes/drop.toml` where that is not at hand.
const DROP: &str = include_str!("drop.toml");

fn main() {
    let overrides: Vec<String> = std::env::args().skip(1).filter(|argument| argument.contains('=')).collect();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/drop.toml");
    let text = std::fs::read_to_string(file).unwrap_or_else(|_| DROP.to_owned());
    for text in [DROP, &text] {
        let scene = Scene::parse(text, &overrides).expect("the scene is valid");
        let (model, _) = RenderModel::compile(&scene);
        let bodies = scene.initial_bodies();
        let mut best = f64::INFINITY;
        for _ in 0..3 {
            let start = core_seconds();
            let film =
                render(&model, &bodies, 0, scene.seed, NonZeroUsize::MIN).expect("the state is the scene's");
            let seconds = core_seconds() - start;
            best = if seconds < best { seconds } else { best };
            println!(
                "{} rings, {} rays, {seconds:.3} s, {:.2} million rays/s on one core, film {}",
                scene.rings.len(),
                film.rays,
                film.rays as f64 / seconds * 1e-6,
                film.hash().short(),
            );
        }
    }
}

/// Time that this thread has had a core, so that other load does not count.
fn core_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

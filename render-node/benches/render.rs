//! Renders one frame of the drop scene's first state on one core and prints rays per second and the film's hash.
//!
//! `cargo bench -p render-node --bench render [-- KEY=VALUE ..]` with keys as `render.samples_per_pixel=16`.

use render_node::{RenderModel, render};
use schemas::scene::Scene;
use std::num::NonZeroUsize;
use std::time::Instant;

/// Stands in for `scenes/drop.toml` where that is not at hand.
const DROP: &str = include_str!("drop.toml");

fn main() {
    let overrides: Vec<String> = std::env::args().skip(1).filter(|argument| argument.contains('=')).collect();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/drop.toml");
    let text = std::fs::read_to_string(file).unwrap_or_else(|_| DROP.to_owned());
    let begin = Instant::now();
    for text in [DROP, &text] {
        let scene = Scene::parse(text, &overrides).expect("the scene is valid");
        let (model, _) = RenderModel::compile(&scene);
        let bodies = scene.initial_bodies();
        let mut best = f64::INFINITY;
        for _ in 0..3 {
            let start = cpu_or_wall_seconds(begin);
            let film =
                render(&model, &bodies, 0, scene.seed, NonZeroUsize::MIN).expect("the state is the scene's");
            let seconds = cpu_or_wall_seconds(begin) - start;
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

/// Time that this process has had a core, where the system tells (Linux): other load does not count. Else the time
/// since the program's begin.
fn cpu_or_wall_seconds(begin: Instant) -> f64 {
    let schedule = std::fs::read_to_string("/proc/self/schedstat").ok();
    let nanoseconds = schedule.as_deref().and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| begin.elapsed().as_secs_f64(), |nanoseconds| nanoseconds * 1e-9)
}

//! One frame: tiles of pixels, handed out to threads as they become free.

use crate::film::{Film, SamplePlace};
use crate::model::RenderModel;
use crate::path::{PIXEL_PAIR, PathTracer, dimension_pairs};
use crate::sampler::Sampler;
use crate::world::{PoseError, World};
use geometry::Vec3;
use schemas::state::BodyState;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicU32, Ordering};

/// Width and height of a tile, in pixels: small enough to share work evenly, large enough to make handing out free.
const TILE_PX: u32 = 16;

/// Renders one frame.
///
/// `bodies` are the rings and then the spheres of a state, as in a state message. Each pixel has one owner, and its
/// samples are summed in their order, so the film does not depend on the number of threads.
///
/// # Errors
///
/// [`PoseError`] if `bodies` is not a state of the model's scene.
pub fn render(
    model: &RenderModel,
    bodies: &[BodyState],
    frame: u64,
    seed: u64,
    threads: NonZeroUsize,
) -> Result<Film, PoseError> {
    let world = World::new(model, bodies)?;
    let (width_px, height_px) = (model.render.width_px, model.render.height_px);
    let columns = width_px.div_ceil(TILE_PX);
    let tiles = columns * height_px.div_ceil(TILE_PX);
    let next = AtomicU32::new(0);
    let work = || {
        let pairs = dimension_pairs(model.render.bounces_max);
        let mut sampler = Sampler::new(seed, frame, pairs);
        let mut done = Vec::new();
        loop {
            let tile = next.fetch_add(1, Ordering::Relaxed);
            if tile >= tiles {
                return done;
            }
            let corner = (tile % columns * TILE_PX, tile / columns * TILE_PX);
            done.push(render_tile(model, &world, &mut sampler, corner));
        }
    };
    let done = std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads.get().min(tiles as usize)).map(|_| scope.spawn(work)).collect();
        let mut done = work();
        for other in others {
            done.extend(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        done
    });
    let mut film = Film {
        width_px,
        height_px,
        rgb: vec![[0.0; 3]; width_px as usize * height_px as usize],
        rays: 0,
        non_finite_samples: 0,
        first_non_finite: None,
    };
    // Tiles arrive in any order; nothing below depends on it.
    done.iter().for_each(|tile| tile.put(&mut film));
    Ok(film)
}

/// A tile's pixels, row by row, and its counts.
struct Tile {
    corner: (u32, u32),
    width: u32,
    rgb: Vec<[f64; 3]>,
    rays: u64,
    non_finite_samples: u64,
    first_non_finite: Option<SamplePlace>,
}

fn render_tile(model: &RenderModel, world: &World, sampler: &mut Sampler, corner: (u32, u32)) -> Tile {
    let width = TILE_PX.min(model.render.width_px - corner.0);
    let height = TILE_PX.min(model.render.height_px - corner.1);
    let samples = model.render.samples_per_pixel;
    let mut tracer = PathTracer { model, world, rays: 0 };
    let mut rgb = Vec::with_capacity(width as usize * height as usize);
    let mut non_finite_samples = 0;
    let mut first_non_finite = None;
    for y_px in corner.1..corner.1 + height {
        for x_px in corner.0..corner.0 + width {
            let pixel = u64::from(y_px) * u64::from(model.render.width_px) + u64::from(x_px);
            let mut sum = Vec3::zeros();
            let mut count = 0_u32;
            for sample in 0..samples {
                sampler.start(pixel, sample);
                let (u, v) = sampler.pair(PIXEL_PAIR);
                let ray = model.camera.ray(f64::from(x_px) + u, f64::from(y_px) + v);
                let radiance = tracer.radiance(ray, sampler);
                if radiance.iter().all(|channel| channel.is_finite()) {
                    sum += radiance;
                    count += 1;
                } else {
                    non_finite_samples += 1;
                    let place = SamplePlace { y_px, x_px, sample };
                    first_non_finite = earlier(first_non_finite, Some(place));
                }
            }
            let mean = if count > 0 { sum / f64::from(count) } else { sum };
            rgb.push([mean.x, mean.y, mean.z]);
        }
    }
    Tile { corner, width, rgb, rays: tracer.rays, non_finite_samples, first_non_finite }
}

impl Tile {
    fn put(&self, film: &mut Film) {
        for (row, pixels) in self.rgb.chunks_exact(self.width as usize).enumerate() {
            let start = (self.corner.1 as usize + row) * film.width_px as usize + self.corner.0 as usize;
            film.rgb[start..start + pixels.len()].copy_from_slice(pixels);
        }
        film.rays += self.rays;
        film.non_finite_samples += self.non_finite_samples;
        film.first_non_finite = earlier(film.first_non_finite, self.first_non_finite);
    }
}

fn earlier(a: Option<SamplePlace>, b: Option<SamplePlace>) -> Option<SamplePlace> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b < a { b } else { a }),
        _ => a.or(b),
    }
}

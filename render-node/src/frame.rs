//! One frame: tiles of pixels, handed out to threads as they become free.

use crate::film::{Film, SamplePlace};
use crate::model::RenderModel;
use crate::path::{PIXEL_PAIR, PathTracer, dimension_pairs};
use crate::sampler::Sampler;
use crate::world::{PoseError, World};
use geometry::Vec3;
use schemas::state::BodyState;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Width and height of a tile, in pixels: small enough to share work evenly, large enough to make handing out free.
const TILE_PX: u32 = 16;
/// Rays that a thread traces before it looks again whether the frame is still wanted: some hundredths of a second.
const RAYS_BETWEEN_LOOKS: u64 = 1 << 17;

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
    Ok(render_while(model, bodies, frame, seed, threads, &mut || true)?
        .expect("only a caller that says no ends a frame early"))
}

/// The same, but the calling thread asks `go_on` now and then, and once it says no, the frame is given up: `None`.
///
/// # Errors
///
/// As [`render`].
pub fn render_while(
    model: &RenderModel,
    bodies: &[BodyState],
    frame: u64,
    seed: u64,
    threads: NonZeroUsize,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Option<Film>, PoseError> {
    let world = World::new(model, bodies)?;
    let (width_px, height_px) = (model.render.width_px, model.render.height_px);
    let columns = width_px.div_ceil(TILE_PX);
    let tiles = columns * height_px.div_ceil(TILE_PX);
    let next = AtomicU32::new(0);
    let given_up = AtomicBool::new(false);
    let work = |go_on: Option<&mut dyn FnMut() -> bool>| {
        let mut worker = Worker {
            model,
            tracer: PathTracer { model, world: &world, rays: 0 },
            sampler: Sampler::new(seed, frame, dimension_pairs(model.render.bounces_max)),
            watch: Watch { go_on, given_up: &given_up, rays_asked: 0 },
        };
        let mut done = Vec::new();
        loop {
            let tile = next.fetch_add(1, Ordering::Relaxed);
            if tile >= tiles {
                return done;
            }
            match worker.render_tile((tile % columns * TILE_PX, tile / columns * TILE_PX)) {
                Some(tile) => done.push(tile),
                None => return done,
            }
        }
    };
    let done = std::thread::scope(|scope| {
        let others: Vec<_> =
            (1..threads.get().min(tiles as usize)).map(|_| scope.spawn(|| work(None))).collect();
        let mut done = work(Some(go_on));
        for other in others {
            done.extend(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        done
    });
    if done.len() < tiles as usize {
        return Ok(None);
    }
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
    Ok(Some(film))
}

/// What one thread needs to render tiles.
struct Worker<'a, 'b> {
    model: &'a RenderModel,
    tracer: PathTracer<'a>,
    sampler: Sampler,
    watch: Watch<'a, 'b>,
}

/// Looks now and then whether the frame is still wanted.
struct Watch<'a, 'b> {
    /// Asked by the calling thread alone.
    go_on: Option<&'b mut dyn FnMut() -> bool>,
    given_up: &'a AtomicBool,
    /// Rays that the thread had traced when it last looked.
    rays_asked: u64,
}

impl Watch<'_, '_> {
    fn given_up(&mut self, rays: u64) -> bool {
        if rays - self.rays_asked < RAYS_BETWEEN_LOOKS {
            return false;
        }
        self.rays_asked = rays;
        if self.go_on.as_mut().is_some_and(|go_on| !go_on()) {
            self.given_up.store(true, Ordering::Relaxed);
        }
        self.given_up.load(Ordering::Relaxed)
    }
}

impl Worker<'_, '_> {
    /// Renders the tile with this top left corner; `None` if the frame was given up.
    fn render_tile(&mut self, corner: (u32, u32)) -> Option<Tile> {
        let render = &self.model.render;
        let width = TILE_PX.min(render.width_px - corner.0);
        let height = TILE_PX.min(render.height_px - corner.1);
        let rays_before = self.tracer.rays;
        let mut tile = Tile {
            corner,
            width,
            rgb: Vec::with_capacity(width as usize * height as usize),
            rays: 0,
            non_finite_samples: 0,
            first_non_finite: None,
        };
        for y_px in corner.1..corner.1 + height {
            for x_px in corner.0..corner.0 + width {
                let mean = self.render_pixel(x_px, y_px, &mut tile)?;
                tile.rgb.push([mean.x, mean.y, mean.z]);
            }
        }
        tile.rays = self.tracer.rays - rays_before;
        Some(tile)
    }

    /// The mean of a pixel's finite samples; the others are counted in the tile.
    fn render_pixel(&mut self, x_px: u32, y_px: u32, tile: &mut Tile) -> Option<Vec3> {
        let pixel = u64::from(y_px) * u64::from(self.model.render.width_px) + u64::from(x_px);
        let mut sum = Vec3::zeros();
        let mut count = 0_u32;
        for sample in 0..self.model.render.samples_per_pixel {
            if self.watch.given_up(self.tracer.rays) {
                return None;
            }
            self.sampler.start(pixel, sample);
            let (u, v) = self.sampler.pair(PIXEL_PAIR);
            let ray = self.model.camera.ray(f64::from(x_px) + u, f64::from(y_px) + v);
            let radiance = self.tracer.radiance(ray, &self.sampler);
            if radiance.iter().all(|channel| channel.is_finite()) {
                sum += radiance;
                count += 1;
            } else {
                tile.non_finite_samples += 1;
                tile.first_non_finite = tile.first_non_finite.or(Some(SamplePlace { y_px, x_px, sample }));
            }
        }
        Some(if count > 0 { sum / f64::from(count) } else { sum })
    }
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

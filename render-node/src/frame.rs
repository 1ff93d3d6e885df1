//! One frame: tiles of pixels, handed out to threads as they become free.

use crate::camera::{self, Camera};
use crate::film::{Film, PixelSums, SamplePlace, luminance};
use crate::model::RenderModel;
use crate::path::{LENS_PAIR, PIXEL_PAIR, PathTracer};
use crate::ray::Ray;
use crate::sampler::{Points, SampleOf, Squares};
use crate::warp;
use crate::world::{Hierarchy, PoseError, World};
use geometry::Vec3;
use geometry::lanes::{LANES, Lanes, Simd, Vectors, dispatch};
use schemas::scene::render::{Filter, FilterShape};
use schemas::state::BodyState;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Width and height of a tile, in pixels: small enough to share work evenly, large enough to make handing out free.
const TILE_PX: u32 = 16;
/// Samples of a tile's pixels that are traced at once. It divides [`NOISE_BATCH`].
const SAMPLES_AT_ONCE: u32 = 4;
/// Rays that a thread traces before it looks again whether the frame is still wanted: some hundredths of a second.
const RAYS_BETWEEN_LOOKS: u64 = 1 << 17;
/// Samples after which a pixel's noise is looked at, and as many as two of them first: an estimate from fewer is worth little.
const NOISE_BATCH: u32 = 16;
/// Share of white that is added to a pixel's luminance before its noise is compared with it.
const NOISE_FLOOR: f64 = 0.01;

/// What decides a frame's bits, besides model and bodies, and how many threads compute them.
#[derive(Clone, Copy, Debug)]
pub struct Job {
    /// Number of the frame: it chooses the random numbers.
    pub frame: u64,
    /// The scene's seed.
    pub seed: u64,
    /// Threads; no bit depends on them.
    pub threads: NonZeroUsize,
}

/// Renders one frame.
///
/// `bodies` are those of a state, as in a state message. Each pixel has one owner, and its
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
    Ok(render_while(model, bodies, &Job { frame, seed, threads }, &mut || true)?
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
    job: &Job,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Option<Film>, PoseError> {
    render_on(&mut Stage::default(), model, bodies, job, go_on)
}

/// The same for one frame after another: `stage` is what a frame leaves for the next one. No bit depends on it.
///
/// # Errors
///
/// As [`render`].
pub fn render_on(
    stage: &mut Stage,
    model: &RenderModel,
    bodies: &[BodyState],
    job: &Job,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Option<Film>, PoseError> {
    let (_, _, width_px, height_px) = model.part();
    let film = Film::black(width_px, height_px);
    add_samples_on(stage, model, bodies, job, 0..model.render.samples_per_pixel, film, go_on)
}

/// What one frame of a scene leaves for the next: the hierarchies of its moments, so that they need not be built anew.
#[derive(Clone, Debug, Default)]
pub struct Stage(Vec<Hierarchy>);

/// Adds samples to a film that holds those before them: samples 0 to 64 and then 64 to 128 give the bits of samples 0 to
/// 128. `None` if `go_on` said no.
///
/// # Errors
///
/// As [`render`].
///
/// # Panics
///
/// If the film is of another size.
pub fn add_samples(
    model: &RenderModel,
    bodies: &[BodyState],
    job: &Job,
    samples: Range<u32>,
    film: Film,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Option<Film>, PoseError> {
    add_samples_on(&mut Stage::default(), model, bodies, job, samples, film, go_on)
}

fn add_samples_on(
    stage: &mut Stage,
    model: &RenderModel,
    bodies: &[BodyState],
    job: &Job,
    samples: Range<u32>,
    mut film: Film,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Option<Film>, PoseError> {
    let mut earlier = core::mem::take(&mut stage.0).into_iter();
    let time_s = model.frame_time(job.frame);
    let moments = camera::moments(&model.render.camera, job.seed, job.frame).into_iter().map(|after_s| {
        let world = if after_s == 0.0 {
            World::after(model, bodies, earlier.next())?
        } else {
            World::after(model, &camera::moved(bodies, after_s), earlier.next())?
        };
        Ok((world, Camera::at(&model.render, time_s + after_s)))
    });
    let moments = moments.collect::<Result<Vec<_>, PoseError>>()?;
    let (left, top, width_px, height_px) = model.part();
    assert_eq!((film.width_px, film.height_px), (width_px, height_px), "the film is of another size");
    let columns = width_px.div_ceil(TILE_PX);
    let tiles = columns * height_px.div_ceil(TILE_PX);
    let next = AtomicU32::new(0);
    let given_up = AtomicBool::new(false);
    let earlier = &film;
    let work = |go_on: Option<&mut dyn FnMut() -> bool>| {
        let mut worker = Worker {
            model,
            moments: &moments,
            tracer: PathTracer::new(model, &moments[0].0),
            points: Points::new(job.seed, job.frame, model.render.sampler),
            watch: Watch { go_on, given_up: &given_up, rays_asked: 0 },
            samples: samples.clone(),
            pixels: Vec::new(),
            origin: (left, top),
        };
        let mut done = Vec::new();
        loop {
            let tile = next.fetch_add(1, Ordering::Relaxed);
            if tile >= tiles {
                return done;
            }
            let corner = (tile % columns * TILE_PX, tile / columns * TILE_PX);
            match worker.render_tile(corner, earlier) {
                Some(tile) => done.push(tile),
                None => return done,
            }
        }
    };
    let done = std::thread::scope(|scope| {
        let others: Vec<_> =
            (1..job.threads.get().min(tiles as usize)).map(|_| scope.spawn(|| work(None))).collect();
        let mut done = work(Some(go_on));
        for other in others {
            done.extend(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        done
    });
    stage.0.extend(moments.into_iter().map(|(world, _)| world.into_hierarchy()));
    if done.len() < tiles as usize {
        return Ok(None);
    }
    // Tiles arrive in any order; nothing below depends on it.
    done.iter().for_each(|tile| tile.put(&mut film));
    Ok(Some(film))
}

/// Where in the picture a sample of a pixel looks, from the pixel's middle, in pixels.
#[inline(always)]
fn filter_offset(filter: &Filter, square: (f64, f64)) -> (f64, f64) {
    let (x, y) = match filter.shape {
        FilterShape::Box => (2.0 * square.0 - 1.0, 2.0 * square.1 - 1.0),
        shape => rounded_offset(shape, square),
    };
    (filter.radius_px * x, filter.radius_px * y)
}

#[inline(never)]
fn rounded_offset(shape: FilterShape, square: (f64, f64)) -> (f64, f64) {
    match shape {
        FilterShape::Gaussian => warp::gaussian_disc(square),
        FilterShape::Box | FilterShape::Tent => (warp::tent(square.0), warp::tent(square.1)),
    }
}

/// Samples whose camera rays are made at once.
#[derive(Default)]
struct Batch {
    /// Middles of the pixels.
    middles: [[f64; LANES]; 2],
    squares: Squares,
    of: [SampleOf; LANES],
    count: usize,
}

impl Batch {
    #[inline(always)]
    fn put(&mut self, (x_px, y_px): (u32, u32), of: SampleOf, points: &mut Points) {
        self.middles[0][self.count] = f64::from(x_px) + 0.5;
        self.middles[1][self.count] = f64::from(y_px) + 0.5;
        points.put(of, PIXEL_PAIR, self.count, &mut self.squares);
        self.of[self.count] = of;
        self.count += 1;
    }

    /// Begins the paths.
    fn begin(&mut self, camera: &Camera, filter: &Filter, points: &mut Points, tracer: &mut PathTracer) {
        let (mut places, mut directions) = (self.middles, [[0.0; LANES]; 3]);
        let pinhole = dispatch!(tracer.tracer.level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let [u, v] = self.squares.points();
                for (lane, (&u, &v)) in u.iter().zip(&v).enumerate() {
                    let (x, y) = filter_offset(filter, (u, v));
                    places[0][lane] += x;
                    places[1][lane] += y;
                }
                let [x, y] = [0, 1].map(
                    #[inline(always)]
                    |axis: usize| Lanes::load_array_ref(simd, &places[axis]),
                );
                let Some(Vectors(found)) = camera.directions(simd, x, y) else { return false };
                for (row, column) in directions.iter_mut().zip(found) {
                    column.store_array(row);
                }
                true
            }
        ));
        for (lane, &of) in self.of.iter().enumerate().take(self.count) {
            let ray = if pinhole {
                let [x, y, z] = [directions[0][lane], directions[1][lane], directions[2][lane]];
                Ray::new(camera.position(), Vec3::new(x, y, z))
            } else {
                camera.ray(places[0][lane], places[1][lane], || points.pair(of, LENS_PAIR))
            };
            tracer.begin(ray, of);
        }
        self.count = 0;
    }
}

/// What one thread needs to render tiles.
struct Worker<'a, 'b> {
    model: &'a RenderModel,
    /// What there is to see at each moment of the open shutter, and from where.
    moments: &'a [(World<'a>, Camera)],
    tracer: PathTracer<'a>,
    points: Points,
    watch: Watch<'a, 'b>,
    samples: Range<u32>,
    /// Numbers of the pixels whose samples are traced.
    pixels: Vec<u64>,
    /// Column and row of the whole picture where the film begins.
    origin: (u32, u32),
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
    /// Renders the tile with this top left corner on the film; `None` if the frame was given up.
    fn render_tile(&mut self, corner: (u32, u32), earlier: &Film) -> Option<Tile> {
        let width = TILE_PX.min(earlier.width_px - corner.0);
        let height = TILE_PX.min(earlier.height_px - corner.1);
        let rays_before = self.tracer.rays;
        let mut tile = Tile {
            corner,
            width,
            sums: Vec::with_capacity(width as usize * height as usize),
            rays: 0,
            non_finite_samples: 0,
            first_non_finite: None,
        };
        for y_px in corner.1..corner.1 + height {
            let start = y_px as usize * earlier.width_px as usize + corner.0 as usize;
            tile.sums.extend_from_slice(&earlier.sums[start..start + width as usize]);
        }
        // Pixels that still get samples: their places in the tile.
        let mut open: Vec<u32> = (0..width * height).collect();
        let mut sample = self.samples.start;
        while sample < self.samples.end && !open.is_empty() {
            if self.watch.given_up(self.tracer.rays) {
                return None;
            }
            if sample.is_multiple_of(NOISE_BATCH)
                && sample > NOISE_BATCH
                && self.model.render.noise_max.is_some()
            {
                open.retain(|&place| !self.is_quiet(&tile.sums[place as usize]));
            }
            // The moments of an open shutter are worlds of their own.
            let at_once = if self.moments.len() > 1 { 1 } else { SAMPLES_AT_ONCE };
            let next = (sample - sample % at_once).saturating_add(at_once).min(self.samples.end);
            self.add_samples(&open, sample..next, &mut tile);
            sample = next;
        }
        tile.rays = self.tracer.rays - rays_before;
        Some(tile)
    }

    /// Adds samples to pixels of a tile; those that are not finite are counted.
    fn add_samples(&mut self, open: &[u32], samples: Range<u32>, tile: &mut Tile) {
        let render = &self.model.render;
        let (left, top) = (self.origin.0 + tile.corner.0, self.origin.1 + tile.corner.1);
        let width = tile.width;
        let place = |place: u32| (left + place % width, top + place / width);
        // Their count is a power of two.
        let (world, camera) = &self.moments[samples.start as usize & (self.moments.len() - 1)];
        self.tracer.world = world;
        self.pixels.clear();
        self.pixels.extend(open.iter().map(|&pixel| {
            let (x_px, y_px) = place(pixel);
            u64::from(y_px) * u64::from(render.width_px) + u64::from(x_px)
        }));
        let level = self.tracer.tracer.level;
        self.points.start(level, &self.pixels, samples.clone());
        self.tracer.paths.clear();
        let count = samples.end - samples.start;
        let mut batch = Batch::default();
        for (index, &pixel) in (0..).zip(open) {
            for k in 0..count {
                batch.put(place(pixel), self.points.of(index, k), &mut self.points);
                if batch.count == LANES {
                    batch.begin(camera, &render.filter, &mut self.points, &mut self.tracer);
                }
            }
        }
        batch.begin(camera, &render.filter, &mut self.points, &mut self.tracer);
        self.tracer.follow(&mut self.points);
        let mut paths = self.tracer.paths.iter();
        for &pixel in open {
            for (sample, path) in samples.clone().zip(&mut paths) {
                let radiance = &path.radiance;
                if radiance.iter().all(|channel| channel.is_finite()) {
                    tile.sums[pixel as usize].add(radiance);
                } else {
                    let (x_px, y_px) = place(pixel);
                    let first = Some(SamplePlace { y_px, x_px, sample });
                    tile.non_finite_samples += 1;
                    tile.first_non_finite = earlier(tile.first_non_finite, first);
                }
            }
        }
    }

    /// Whether the picture asks for no less noise than the pixel has.
    fn is_quiet(&self, sums: &PixelSums) -> bool {
        let Some(share) = self.model.render.noise_max else { return false };
        let allowed = share * (luminance(&sums.mean()) + NOISE_FLOOR / self.model.render.exposure);
        sums.variance() <= allowed * allowed
    }
}

/// A tile's pixels, row by row, and its counts.
struct Tile {
    corner: (u32, u32),
    width: u32,
    sums: Vec<PixelSums>,
    rays: u64,
    non_finite_samples: u64,
    first_non_finite: Option<SamplePlace>,
}

impl Tile {
    fn put(&self, film: &mut Film) {
        for (row, pixels) in self.sums.chunks_exact(self.width as usize).enumerate() {
            let start = (self.corner.1 as usize + row) * film.width_px as usize + self.corner.0 as usize;
            film.sums[start..start + pixels.len()].copy_from_slice(pixels);
            for (mean, sums) in film.rgb[start..].iter_mut().zip(pixels) {
                *mean = sums.mean().into();
            }
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

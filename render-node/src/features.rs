//! What a picture shows besides light: distance, normal, albedo and number of the first thing that each pixel sees.

use crate::bvh::Tracer;
use crate::camera::Camera;
use crate::film::{Film, PixelSums};
use crate::model::RenderModel;
use crate::world::{PoseError, Surface, World};
use schemas::state::BodyState;

/// Feature images of a frame, row by row from the top left, from one ray through the middle of each pixel, at the frame's
/// time and through the middle of the lens.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureImages {
    /// Width in pixels.
    pub width_px: u32,
    /// Height in pixels.
    pub height_px: u32,
    /// Distance along the ray, in metres; infinite where nothing is met.
    pub distance_m: Vec<f64>,
    /// Unit normal of the surface in World, on the side of the camera; zero where there is none.
    pub normal: Vec<[f64; 3]>,
    /// Share of light that the surface reflects (of a metal, straight down); zero of lights and where nothing is.
    pub albedo: Vec<[f64; 3]>,
    /// Number of the surface, as [`Hit::surface`](crate::Hit) has it (rings come first, from 0); -1 where nothing is.
    pub surface: Vec<i64>,
}

impl FeatureImages {
    /// The feature images of a frame.
    ///
    /// # Errors
    ///
    /// [`PoseError`] if `bodies` is not a state of the model's scene.
    pub fn new(model: &RenderModel, bodies: &[BodyState], frame: u64) -> Result<FeatureImages, PoseError> {
        let world = World::new(model, bodies)?;
        let camera = Camera::at(model.settings(), model.frame_time(frame));
        let (left, top, width_px, height_px) = model.part();
        let mut images = FeatureImages {
            width_px,
            height_px,
            distance_m: Vec::new(),
            normal: Vec::new(),
            albedo: Vec::new(),
            surface: Vec::new(),
        };
        let (mut tracer, mut rays, mut hits) = (Tracer::default(), Vec::new(), Vec::new());
        for y_px in top..top + height_px {
            // The middle of the lens is at radius 0.
            let middle = |x_px| camera.ray(f64::from(x_px) + 0.5, f64::from(y_px) + 0.5, || (0.0, 0.0));
            rays.clear();
            rays.extend((left..left + width_px).map(middle));
            world.closest_each(&mut tracer, &rays, &mut hits);
            for (ray, hit) in rays.iter().zip(&hits) {
                let (normal, albedo) = match hit.map(|hit| world.surface(ray, &hit)) {
                    Some(Surface::Scattering(vertex)) => (vertex.normal.into(), vertex.bsdf.albedo().into()),
                    _ => ([0.0; 3], [0.0; 3]),
                };
                images.distance_m.push(hit.map_or(f64::INFINITY, |hit| hit.distance));
                images.normal.push(normal);
                images.albedo.push(albedo);
                images.surface.push(hit.map_or(-1, |hit| i64::from(hit.surface)));
            }
        }
        Ok(images)
    }

    /// The channels of an OpenEXR file: `Z`, `normal.X`, `normal.Y`, `normal.Z`, `albedo.R`, `albedo.G`, `albedo.B` and
    /// `id.surface`, as 32-bit numbers.
    pub fn channels(&self) -> Vec<(String, Vec<f32>)> {
        let mut channels = vec![("Z".to_owned(), self.distance_m.iter().map(|&z| z as f32).collect())];
        channels.extend(planes(["normal.X", "normal.Y", "normal.Z"], &self.normal));
        channels.extend(planes(["albedo.R", "albedo.G", "albedo.B"], &self.albedo));
        channels.push(("id.surface".to_owned(), self.surface.iter().map(|&id| id as f32).collect()));
        channels
    }
}

/// The channels of a film in an OpenEXR file: linear `R`, `G` and `B`, the variance of each pixel's mean luminance
/// (`variance.Y`) and its count of samples (`samples.count`), as 32-bit numbers.
pub fn film_channels(film: &Film) -> Vec<(String, Vec<f32>)> {
    let mut channels = planes(["R", "G", "B"], &film.rgb);
    let variance = |sums: &PixelSums| sums.variance() as f32;
    channels.push(("variance.Y".to_owned(), film.sums.iter().map(variance).collect()));
    channels.push(("samples.count".to_owned(), film.sums.iter().map(|sums| sums.count as f32).collect()));
    channels
}

fn planes(names: [&str; 3], pixels: &[[f64; 3]]) -> Vec<(String, Vec<f32>)> {
    let plane = |axis: usize| pixels.iter().map(|pixel| pixel[axis] as f32).collect();
    names.iter().enumerate().map(|(axis, name)| ((*name).to_owned(), plane(axis))).collect()
}

//! Cameras: pinhole, thin lens, orthographic; standing or on a path; and the moments of an open shutter.

use crate::flat::all_lanes;
use crate::ray::Ray;
use crate::warp;
use geometry::lanes::{Lanes, Simd, Vectors};
use geometry::{Vec3, rotation};
use nalgebra::{Quaternion, UnitQuaternion};
use random::{Stream, unit};
use schemas::scene::render::{self, Projection, Render, Viewpoint};
use schemas::state::BodyState;

/// Separates the moments of the shutter from other random numbers of the same seed.
const PURPOSE: &[u8; 16] = b"chainmail moment";

/// A camera at one time, with the picture's plane at distance 1. World frame.
#[derive(Clone, Debug)]
pub(crate) struct Camera {
    position: Vec3,
    /// From the camera to the top left corner of the picture; of an orthographic one without the way along the view.
    corner: Vec3,
    /// One pixel to the right.
    right: Vec3,
    /// One pixel down.
    down: Vec3,
    lens: Lens,
}

#[derive(Clone, Debug)]
enum Lens {
    Pinhole,
    /// Two axes of the lens, as long as its radius, and how far away things are sharp.
    Thin {
        across: [Vec3; 2],
        focus: f64,
    },
    /// All rays go along this.
    Orthographic(Vec3),
}

impl Camera {
    /// The camera of a picture at a simulated time (s).
    pub(crate) fn at(render: &Render, time_s: f64) -> Camera {
        let settings = &render.camera;
        let (position, look_at, angle) = view(settings, time_s);
        let to_middle = look_at - position;
        let forward = to_middle.normalize();
        let right = forward.cross(&Vec3::from(settings.up)).normalize();
        let up = right.cross(&forward);
        let half_height = match settings.projection {
            Projection::Perspective => libm::tan(0.5 * angle),
            Projection::Orthographic => 0.5 * settings.view_height_m.unwrap_or(1.0),
        };
        // Pixels are square.
        let pixel = 2.0 * half_height / f64::from(render.height_px);
        let half_width = 0.5 * pixel * f64::from(render.width_px);
        let middle = up * half_height - right * half_width;
        let radius = settings.lens_radius_m;
        let (corner, lens) = match settings.projection {
            Projection::Orthographic => (middle, Lens::Orthographic(forward)),
            Projection::Perspective if radius == 0.0 => (forward + middle, Lens::Pinhole),
            Projection::Perspective => {
                let focus = settings.focus_distance_m.unwrap_or(to_middle.norm());
                (forward + middle, Lens::Thin { across: [right * radius, up * radius], focus })
            }
        };
        Camera { position, corner, right: right * pixel, down: up * -pixel, lens }
    }

    /// The ray through a point of the picture, in pixels from its top left corner. `lens` gives a point of the unit square
    /// if the camera has a lens to choose a point of.
    #[inline]
    pub(crate) fn ray(&self, x_px: f64, y_px: f64, lens: impl FnOnce() -> (f64, f64)) -> Ray {
        let to_picture = self.corner + self.right * x_px + self.down * y_px;
        match &self.lens {
            Lens::Pinhole => Ray::new(self.position, to_picture.normalize()),
            Lens::Thin { across, focus } => {
                // All rays through a point of the picture meet where it is sharp.
                let (u, v) = lens();
                let (cosine, sine) = warp::circle_point(v);
                let offset = (across[0] * cosine + across[1] * sine) * u.sqrt();
                Ray::new(self.position + offset, (to_picture * *focus - offset).normalize())
            }
            Lens::Orthographic(forward) => Ray::new(self.position + to_picture, *forward),
        }
    }
}

impl Camera {
    /// Directions of sixteen rays from the [position](Camera::position) through points of the picture, as [`Camera::ray`] has
    /// them; `None` if the camera has a lens or is orthographic.
    #[inline(always)]
    pub(crate) fn directions<S: Simd>(&self, simd: S, x_px: Lanes<S>, y_px: Lanes<S>) -> Option<Vectors<S>> {
        let Lens::Pinhole = self.lens else { return None };
        let across = all_lanes(simd, &self.right).times(x_px);
        let down = all_lanes(simd, &self.down).times(y_px);
        let to_picture = all_lanes(simd, &self.corner).plus(&across).plus(&down);
        let norm = to_picture.dot(&to_picture).sqrt();
        let [x, y, z] = to_picture.0;
        Some(Vectors([x / norm, y / norm, z / norm]))
    }

    pub(crate) fn position(&self) -> Vec3 {
        self.position
    }
}

/// Where the camera stands, where it looks and its field of view, at a time: on the cubic curve through the viewpoints whose
/// tangents are the slopes between their neighbours (Catmull and Rom 1974, for uneven times); still before the first and
/// after the last.
fn view(camera: &render::Camera, time_s: f64) -> (Vec3, Vec3, f64) {
    let own = camera.vertical_field_of_view_rad;
    let numbers = |viewpoint: &Viewpoint| {
        let [a, b, c] = viewpoint.position_m;
        let [d, e, f] = viewpoint.look_at_m;
        [a, b, c, d, e, f, viewpoint.vertical_field_of_view_rad.unwrap_or(own)]
    };
    let Some((first, last)) = camera.path.first().zip(camera.path.last()) else {
        return (Vec3::from(camera.position_m), Vec3::from(camera.look_at_m), own);
    };
    let [a, b, c, d, e, f, angle] = if time_s <= first.time_s {
        numbers(first)
    } else if time_s >= last.time_s {
        numbers(last)
    } else {
        let next = camera.path.partition_point(|viewpoint| viewpoint.time_s <= time_s);
        let around = [next.saturating_sub(2), next - 1, next, (next + 1).min(camera.path.len() - 1)];
        let [before, from, to, after] = around.map(|index| &camera.path[index]);
        let span = to.time_s - from.time_s;
        let slope = |a: &Viewpoint, b: &Viewpoint, k: usize| {
            (numbers(b)[k] - numbers(a)[k]) / (b.time_s - a.time_s) * span
        };
        let t = (time_s - from.time_s) / span;
        std::array::from_fn(|k| {
            let (start, end) = (numbers(from)[k], numbers(to)[k]);
            let (leave, arrive) = (slope(before, to, k), slope(from, after, k));
            let (square, cube) = (t * t, t * t * t);
            start * (2.0 * cube - 3.0 * square + 1.0)
                + leave * (cube - 2.0 * square + t)
                + end * (3.0 * square - 2.0 * cube)
                + arrive * (cube - square)
        })
    };
    (Vec3::new(a, b, c), Vec3::new(d, e, f), angle)
}

/// The moments of a frame's open shutter, in seconds after the frame's time; one, at 0, of a closed one.
///
/// Each of the equal parts of the time has one moment, anywhere in it, and any first 2^k of them lie evenly.
pub(crate) fn moments(camera: &render::Camera, seed: u64, frame: u64) -> Vec<f64> {
    if camera.shutter_s == 0.0 {
        return vec![0.0];
    }
    let count = camera.shutter_moments;
    let mut stream = Stream::new(seed, frame, PURPOSE);
    let bits = count.trailing_zeros();
    (0..count)
        .map(|moment| {
            let part = if bits == 0 { 0 } else { moment.reverse_bits() >> (32 - bits) };
            camera.shutter_s * (f64::from(part) + unit(stream.word())) / f64::from(count)
        })
        .collect()
}

/// Bodies some time after their state, if their velocities stay what they are.
pub(crate) fn moved(bodies: &[BodyState], seconds: f64) -> Vec<BodyState> {
    let moved = bodies.iter().map(|body| {
        let position = Vec3::from(body.position_m) + Vec3::from(body.linear_velocity_m_per_s) * seconds;
        let turn = rotation::exp(Vec3::from(body.angular_velocity_rad_per_s) * seconds);
        let [x, y, z, w] = body.orientation;
        let turned = turn.quaternion() * Quaternion::new(w, x, y, z);
        let turned = UnitQuaternion::from_quaternion(turned);
        BodyState {
            position_m: position.into(),
            orientation: [turned.i, turned.j, turned.k, turned.w],
            ..*body
        }
    });
    moved.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::Sampler;
    use schemas::scene::Scene;

    /// A chi-squared test that rays leave the lens evenly over its disc, and that all of them meet where it is sharp.
    #[test]
    fn rays_leave_the_lens_evenly() {
        const RINGS: usize = 12;
        const TURNS: usize = 16;
        const RAYS: u32 = 60_000;
        let text = "
            time = { duration_s = 0.0, time_step_s = 0.001 }
            render.width_px = 40
            render.height_px = 30
            render.camera = { position_m = [1, 2, 3], look_at_m = [4, -1, 0], up = [0, 0, 1], lens_radius_m = 0.25, focus_distance_m = 3.0 }
        ";
        let scene = Scene::parse(text, &[]).expect("the scene is valid");
        let camera = Camera::at(&scene.render, 0.0);
        let Lens::Thin { across, .. } = camera.lens else { panic!("a lens") };
        let [u, v] = across.map(|axis| axis / 0.25);
        let forward = -u.cross(&v);
        let mut sampler = Sampler::new(31, 0, Default::default());
        let mut counts = [0_u32; RINGS * TURNS];
        let (mut sharp, mut worst) = (None, 0.0);
        for pixel in 0..RAYS {
            sampler.start(u64::from(pixel), pixel % 5);
            let ray = camera.ray(31.25, 7.5, || sampler.pair(1));
            let offset = ray.origin - Vec3::new(1.0, 2.0, 3.0);
            assert!(offset.dot(&forward).abs() < 1e-14, "off the lens");
            let (x, y) = (offset.dot(&u) / 0.25, offset.dot(&v) / 0.25);
            let bin = |share: f64, bins: usize| ((share * bins as f64) as usize).min(bins - 1);
            let turn = libm::atan2(y, x) / core::f64::consts::TAU + 0.5;
            // Rings of equal area.
            counts[bin(x * x + y * y, RINGS) * TURNS + bin(turn, TURNS)] += 1;
            let to_focus = (3.0 - offset.dot(&forward)) / ray.direction.dot(&forward);
            let met = ray.origin + ray.direction * to_focus;
            let apart = (met - *sharp.get_or_insert(met)).norm();
            worst = if apart > worst { apart } else { worst };
        }
        let expected = f64::from(RAYS) / counts.len() as f64;
        let chi_squared: f64 =
            counts.iter().map(|&n| (f64::from(n) - expected) * (f64::from(n) - expected) / expected).sum();
        // 191 degrees of freedom: mean 191, standard deviation 19.5; five deviations above the mean.
        println!(
            "lens: chi-squared {chi_squared:.1}, limit 290; rays meet within {worst:.1e}, allowed 1e-14"
        );
        assert!(chi_squared < 290.0 && worst < 1e-14, "{chi_squared} {worst:e}");
    }
}

//! The pinhole camera.

use crate::ray::Ray;
use geometry::Vec3;
use schemas::scene::render::Render;

/// A pinhole camera with the picture's plane at distance 1. World frame.
#[derive(Clone, Debug)]
pub(crate) struct Camera {
    position: Vec3,
    /// From the pinhole to the top left corner of the picture.
    corner: Vec3,
    /// One pixel to the right.
    right: Vec3,
    /// One pixel down.
    down: Vec3,
}

impl Camera {
    pub(crate) fn new(render: &Render) -> Camera {
        let position = Vec3::from(render.camera.position_m);
        let forward = (Vec3::from(render.camera.look_at_m) - position).normalize();
        let right = forward.cross(&Vec3::from(render.camera.up)).normalize();
        let up = right.cross(&forward);
        let half_height = libm::tan(0.5 * render.camera.vertical_field_of_view_rad);
        // Pixels are square.
        let pixel = 2.0 * half_height / f64::from(render.height_px);
        let half_width = 0.5 * pixel * f64::from(render.width_px);
        Camera {
            position,
            corner: forward - right * half_width + up * half_height,
            right: right * pixel,
            down: up * -pixel,
        }
    }

    /// The ray through a point of the picture, in pixels from its top left corner.
    pub(crate) fn ray(&self, x_px: f64, y_px: f64) -> Ray {
        let direction = self.corner + self.right * x_px + self.down * y_px;
        Ray::new(self.position, direction.normalize())
    }
}

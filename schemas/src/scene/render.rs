//! How to look at a scene: camera, light, looks of materials, film. The simulator never reads this half.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The second half of a scene; `rerender` replaces it alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Render {
    /// Width of a frame, in pixels.
    pub width_px: u32,
    /// Height of a frame, in pixels.
    pub height_px: u32,
    /// Paths traced through each pixel.
    pub samples_per_pixel: u32,
    /// Reflections that a path follows at most; 0 is direct light only.
    pub bounces_max: u32,
    /// Factor on radiance before the picture is encoded as sRGB.
    pub exposure: f64,
    /// The camera.
    pub camera: Camera,
    /// Radiance that comes from where nothing is.
    pub sky: Sky,
    /// Area lights.
    #[serde(rename = "light")]
    pub lights: Vec<Light>,
    /// Looks of the materials, by the names that bodies use; a material without one is grey.
    #[serde(rename = "look")]
    pub looks: BTreeMap<String, Look>,
}

impl Default for Render {
    fn default() -> Self {
        Render {
            width_px: 640,
            height_px: 360,
            samples_per_pixel: 16,
            bounces_max: 2,
            exposure: 1.0,
            camera: Camera::default(),
            sky: Sky::default(),
            lights: Vec::new(),
            looks: BTreeMap::new(),
        }
    }
}

/// A pinhole camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// Where it stands, in metres.
    pub position_m: [f64; 3],
    /// The point in the middle of the picture, in metres.
    pub look_at_m: [f64; 3],
    /// The direction that is up in the picture; not parallel to the view.
    pub up: [f64; 3],
    /// Angle from the bottom to the top of the picture, in radians.
    pub vertical_field_of_view_rad: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Camera {
            position_m: [0.0, 0.0, 5.0],
            look_at_m: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            vertical_field_of_view_rad: 0.7,
        }
    }
}

/// Radiance from where nothing is: a blend from horizon to zenith, by the height of the direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sky {
    /// The direction of the zenith.
    pub up: [f64; 3],
    /// Radiance (red, green, blue) at the zenith, in watts per steradian and square metre.
    pub zenith_radiance: [f64; 3],
    /// Radiance at and below the horizon.
    pub horizon_radiance: [f64; 3],
}

impl Default for Sky {
    fn default() -> Self {
        Sky { up: [0.0, 1.0, 0.0], zenith_radiance: [0.35, 0.45, 0.65], horizon_radiance: [0.8, 0.8, 0.8] }
    }
}

/// A light with an area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Light {
    /// A glowing sphere.
    Sphere {
        /// Centre, in metres.
        position_m: [f64; 3],
        /// Radius, in metres.
        radius_m: f64,
        /// Emitted radiance (red, green, blue).
        radiance: [f64; 3],
    },
    /// A glowing parallelogram: `corner + s edge_u + t edge_v`, shining to the side of `edge_u x edge_v`.
    Rectangle {
        /// One corner, in metres.
        corner_m: [f64; 3],
        /// First edge, in metres.
        edge_u_m: [f64; 3],
        /// Second edge, in metres.
        edge_v_m: [f64; 3],
        /// Emitted radiance (red, green, blue).
        radiance: [f64; 3],
    },
}

/// How a material looks: Lambertian.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Look {
    /// Share of light reflected (red, green, blue), each from 0 to 1.
    pub albedo: [f64; 3],
    /// A second albedo makes a checkerboard on planes, with squares of one metre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checker_albedo: Option<[f64; 3]>,
}

impl Default for Look {
    fn default() -> Self {
        Look { albedo: [0.5; 3], checker_albedo: None }
    }
}

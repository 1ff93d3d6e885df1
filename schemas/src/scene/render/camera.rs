//! Where a picture is taken from.

use serde::{Deserialize, Serialize};

/// A camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// Where it stands, in metres.
    pub position_m: [f64; 3],
    /// The point in the middle of the picture, in metres.
    pub look_at_m: [f64; 3],
    /// The direction that is up in the picture; not parallel to the view.
    pub up: [f64; 3],
    /// How points become points of the picture.
    #[serde(skip_serializing_if = "super::is_default")]
    pub projection: Projection,
    /// Angle from the bottom to the top of a perspective picture, in radians.
    pub vertical_field_of_view_rad: f64,
    /// `orthographic`: what the picture shows from bottom to top, in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view_height_m: Option<f64>,
    /// Radius of the lens of a perspective camera, in metres: 0 is a pinhole, with which everything is sharp.
    #[serde(skip_serializing_if = "is_zero")]
    pub lens_radius_m: f64,
    /// Distance along the view at which things are sharp, in metres; that of `look_at_m` if nothing is said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus_distance_m: Option<f64>,
    /// For how long light falls on a frame, from its time on, in seconds of simulated time. Bodies move on with the velocities
    /// that the state holds.
    #[serde(skip_serializing_if = "is_zero")]
    pub shutter_s: f64,
    /// How many moments of that time are seen, a power of two: sample k of every pixel sees moment k modulo this.
    #[serde(skip_serializing_if = "is_default_moments")]
    pub shutter_moments: u32,
    /// A path through the movie: instead of `position_m`, `look_at_m` and the field of view, a smooth curve through these.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub path: Vec<Viewpoint>,
}

/// Moments of an open shutter, unless a scene says otherwise: as many as samples of a pixel by default.
const SHUTTER_MOMENTS: u32 = 16;

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

fn is_default_moments(moments: &u32) -> bool {
    *moments == SHUTTER_MOMENTS
}

impl Default for Camera {
    fn default() -> Self {
        Camera {
            position_m: [0.0, 0.0, 5.0],
            look_at_m: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            projection: Projection::default(),
            vertical_field_of_view_rad: 0.7,
            view_height_m: None,
            lens_radius_m: 0.0,
            focus_distance_m: None,
            shutter_s: 0.0,
            shutter_moments: SHUTTER_MOMENTS,
            path: Vec::new(),
        }
    }
}

/// How points become points of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Projection {
    /// Along lines through the camera.
    #[default]
    Perspective,
    /// Along parallel lines: equal lengths look equal at any distance.
    Orthographic,
}

/// Where the camera is at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Viewpoint {
    /// Simulated time, in seconds; later than that of the viewpoint before.
    pub time_s: f64,
    /// Where the camera stands, in metres.
    pub position_m: [f64; 3],
    /// The point in the middle of the picture, in metres.
    pub look_at_m: [f64; 3],
    /// Angle from the bottom to the top of the picture, in radians; the camera's own if nothing is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical_field_of_view_rad: Option<f64>,
}

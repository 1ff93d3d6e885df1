//! Where light comes from.

use serde::{Deserialize, Serialize};

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

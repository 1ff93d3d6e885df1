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

/// A light.
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
    /// A point that shines alike to all sides. It cannot be seen, and with `direct_light = "bsdf"` it is never found.
    Point {
        /// Where it is, in metres.
        position_m: [f64; 3],
        /// Radiant intensity (red, green, blue), in watts per steradian: a ball of radius *r* and radiance *L* that is far away
        /// has pi *r*^2 *L*.
        intensity: [f64; 3],
    },
    /// A disc that is infinitely far away and as bright everywhere on it.
    Sun {
        /// The direction in which it stands, of any length.
        direction: [f64; 3],
        /// Half the angle under which it is seen, in radians; that of the sun if nothing is said.
        #[serde(default = "angular_radius_of_the_sun")]
        angular_radius_rad: f64,
        /// Irradiance (red, green, blue) of a surface that faces it, in watts per square metre.
        irradiance: [f64; 3],
    },
}

/// Radius over distance of the sun: 696,000 km over 149,600,000 km.
fn angular_radius_of_the_sun() -> f64 {
    0.00465
}

/// A picture of the light from all around, instead of the sky: columns of equal turns about `sky.up`, rows of equal
/// angles from it down (equirectangular).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Environment {
    /// An OpenEXR or Radiance file (`.exr`, `.hdr`) of linear radiance, found from the folder that the renderer is
    /// started in. The log does not hold it: `frame_info` has its hash.
    pub file: String,
    /// Factor on its radiance.
    #[serde(default = "one")]
    pub scale: f64,
    /// Angle by which it is turned about `sky.up`, in radians. At 0 its middle column lies along the World axis that is
    /// least along `sky.up`, made level.
    #[serde(default)]
    pub turn_rad: f64,
}

fn one() -> f64 {
    1.0
}

//! Surfaces that are only looked at, and how rays find them.

use super::super::SceneError;
use super::super::parse::suggestion;
use super::super::validate::{positive, refuse, unit, vector};
use super::Render;
use serde::{Deserialize, Serialize};

/// A polynomial surface `F(x, y, z) = 0` to look at: it stands still, touches nothing, has neither mass nor inside, and may
/// be open; the simulator does not know of it. It is seen where `F` changes its sign, from both sides, within a ball
/// (`bounding_radius_m`) or a box (`bounding_half_extents_m`) about the formula's origin: one of the two is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// The formula in `x`, `y` and `z`: sums, products, whole powers, parentheses and decimal numbers, of a degree of at most
    /// 16; for example `81*(x^3 + y^3 + z^3) - 189*(x^2*y + ...)`.
    pub formula: String,
    /// Metres per unit of the formula's coordinates.
    #[serde(default = "one")]
    pub scale_m: f64,
    /// Radius of a ball about the formula's origin beyond which nothing is seen, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bounding_radius_m: Option<f64>,
    /// Half extents, along the formula's axes, of a box about its origin beyond which nothing is seen, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bounding_half_extents_m: Option<[f64; 3]>,
    /// Name of the look (`render.look.NAME`).
    pub look: String,
    /// Where the formula's origin is, in metres.
    #[serde(default)]
    pub position_m: [f64; 3],
    /// Unit quaternion `[x, y, z, w]` from the formula's axes to World.
    #[serde(default = "identity")]
    pub orientation: [f64; 4],
}

/// How the places are found where a ray meets rings and polynomials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RootFinder {
    /// By sign changes of Bernstein coefficients, which prove how many there are.
    #[default]
    Bernstein,
    /// As eigenvalues of the balanced companion matrix, which prove nothing and take much longer: to compare.
    Companion,
}

fn one() -> f64 {
    1.0
}

fn identity() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

pub(super) fn validate_surfaces(render: &Render) -> Result<(), SceneError> {
    for (index, surface) in render.surfaces.iter().enumerate() {
        let key = |field: &str| format!("render.surface[{index}].{field}");
        positive(&key("scale_m"), surface.scale_m)?;
        match (surface.bounding_radius_m, surface.bounding_half_extents_m) {
            (Some(radius), None) => positive(&key("bounding_radius_m"), radius)?,
            (None, Some(half)) => {
                half.into_iter().try_for_each(|half| positive(&key("bounding_half_extents_m"), half))?;
            }
            (radius, _) => {
                let given = if radius.is_some() { "given beside the box" } else { "not given" };
                let expected =
                    "either bounding_radius_m or bounding_half_extents_m: where the surface is cut off";
                return Err(refuse(&key("bounding_radius_m"), given, expected));
            }
        }
        vector(&key("position_m"), &surface.position_m)?;
        unit(&key("orientation"), &surface.orientation)?;
        if !render.looks.contains_key(&surface.look) {
            return Err(SceneError::UnknownName {
                key: key("look"),
                value: surface.look.clone(),
                what: "render.look",
                suggestion: suggestion(&surface.look, render.looks.keys().map(String::as_str)),
            });
        }
    }
    Ok(())
}

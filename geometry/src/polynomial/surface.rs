//! A polynomial surface to look at: open or closed, with no inside, and cut off where its bounds end.

use super::{FormulaError, Polynomial};
use crate::{Aabb, RootFinder, Vec3, shift::closest_approach};

/// Lines along each axis and along each of the four diagonals, in each of two directions, on which a surface is looked for.
const LOOK_LINES: u32 = 32;

/// Where a surface is cut off, about the formula's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bounds {
    /// A ball of this radius (m).
    Ball(f64),
    /// A box with these half extents along the formula's axes (m).
    Box(Vec3),
}

/// The part of `F = 0` within bounds, in metres, in the formula's frame.
///
/// # What counts as the surface
/// A place where `F` changes its sign along the ray. So a double root, where `F` touches 0 and turns back, is none:
/// `F^2 = 0` cannot be seen at all, nor can single points and lines that stand off a surface (the Roman surface's axes
/// beyond it). [`crate::bernstein`] says how near two roots may come.
#[derive(Clone, Debug)]
pub struct Surface {
    polynomial: Polynomial,
    /// Metres per unit of the formula.
    scale: f64,
    /// In the formula's units.
    bounds: Bounds,
}

/// A formula of which nothing can be seen.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum SurfaceError {
    /// It cannot be read.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// There is no surface within the bounds.
    #[error(
        "no place was found where F changes its sign within its bounds: take larger bounds or another scale_m; where F only \
         touches 0, as x^2 does, there is nothing to see"
    )]
    Nothing,
}

impl Surface {
    /// A surface from its formula, the metres that one unit of the formula's coordinates has, and its bounds.
    ///
    /// # Errors
    ///
    /// [`SurfaceError`] if the formula cannot be read, or if nothing of it was found on ten thousand lines.
    pub fn new(formula: &str, scale: f64, bounds: Bounds) -> Result<Surface, SurfaceError> {
        let polynomial = Polynomial::parse(formula)?;
        let bounds = match bounds {
            Bounds::Ball(radius) => Bounds::Ball(radius / scale),
            Bounds::Box(half) => Bounds::Box(half / scale),
        };
        let surface = Surface { polynomial, scale, bounds };
        if surface.is_somewhere() { Ok(surface) } else { Err(SurfaceError::Nothing) }
    }

    /// Whether a ray of many meets it.
    fn is_somewhere(&self) -> bool {
        let reach = self.bounding_radius_m();
        let directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]];
        directions.into_iter().any(|direction| {
            let direction = Vec3::from(direction.map(f64::from)).normalize();
            let aside = if direction.x.abs() < 0.9 { Vec3::x() } else { Vec3::y() };
            let u = direction.cross(&aside).normalize();
            let v = direction.cross(&u);
            let at = |index: u32| reach * (f64::from(2 * index + 1) / f64::from(LOOK_LINES) - 1.0);
            (0..LOOK_LINES * LOOK_LINES).any(|line| {
                let start = u * at(line / LOOK_LINES) + v * at(line % LOOK_LINES) - direction * (2.0 * reach);
                self.ray(&start, &direction, 0.0, RootFinder::Bernstein).is_some()
            })
        })
    }

    /// Ray parameter of the first crossing of the surface beyond `t_min` (m), or `None`; `direction` is a unit vector.
    pub fn ray(&self, origin: &Vec3, direction: &Vec3, t_min: f64, finder: RootFinder) -> Option<f64> {
        let origin = origin / self.scale;
        // Counted from the closest approach to the formula's origin, for origins far away.
        let size = self.bounding_radius_m() / self.scale;
        let (s, near) = closest_approach(&origin, direction, size);
        let (entry, exit) = match self.bounds {
            Bounds::Ball(radius) => {
                let inside = radius * radius - near.norm_squared();
                if !(inside > 0.0) {
                    return None;
                }
                (-inside.sqrt(), inside.sqrt())
            }
            Bounds::Box(half) => {
                let inverse = direction.map(|component| 1.0 / component);
                Aabb { min: -half, max: half }.ray_interval(
                    &near,
                    &inverse,
                    f64::NEG_INFINITY,
                    f64::INFINITY,
                )?
            }
        };
        let least = t_min / self.scale - s;
        let start = if least > entry { least } else { entry };
        if !(start < exit) {
            return None;
        }
        let hit = self.polynomial.first_root(&near, direction, (start, exit), least, finder)?;
        Some((hit + s) * self.scale)
    }

    /// Unit normal at a point of the surface, towards growing `F`; where the gradient is 0, +x.
    pub fn normal(&self, point: &Vec3) -> Vec3 {
        let (_, gradient) = self.polynomial.value_and_gradient(&(point / self.scale));
        let length = gradient.norm_squared().sqrt();
        if length > 0.0 { gradient * (1.0 / length) } else { Vec3::x() }
    }

    /// Radius of a ball about the formula's origin that holds it (m).
    pub fn bounding_radius_m(&self) -> f64 {
        let radius = match self.bounds {
            Bounds::Ball(radius) => radius,
            Bounds::Box(half) => half.norm_squared().sqrt(),
        };
        radius * self.scale
    }

    /// Half extents, along the formula's axes, of a box about its origin that holds it (m).
    pub fn half_extents_m(&self) -> Vec3 {
        match self.bounds {
            Bounds::Ball(radius) => Vec3::repeat(radius * self.scale),
            Bounds::Box(half) => half * self.scale,
        }
    }
}

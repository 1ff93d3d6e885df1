//! Implicit surfaces of rings, spheres and planes: where a ray meets them, how far apart they are,
//! and which part of one ring touches another.
//!
//! The one thing to know: a ring is a circle with a wire of radius `r` around it (a torus), and both
//! questions that are asked millions of times a second, "where does this ray hit this torus" and
//! "which part of this circle is closer than `reach` to that circle", are the same question: where
//! does a curve of degree two run inside a disc? Both are answered by [`bernstein`], which isolates
//! the roots of the resulting quartic with proof instead of searching for them.
//!
//! # Conventions
//! SI units, radians, right-handed frames. `Vec3` is a column vector. Every function is a function of
//! its arguments alone and uses `+ - * / sqrt`, comparisons and the crate `libm`, so its result has
//! the same bits on every machine. Multiplying all lengths by a power of two multiplies all lengths in
//! the result by it, exactly, as long as nothing overflows or underflows.
//!
//! # Example
//! ```
//! use geometry::{Circle, Vec3, arc::circle_circle_arcs, circle::{closest_points, linked}};
//! use nalgebra::UnitQuaternion;
//!
//! let upright = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), core::f64::consts::FRAC_PI_2);
//! let a = Circle::from_pose(Vec3::zeros(), &UnitQuaternion::identity(), 1.0);
//! let b = Circle::from_pose(Vec3::new(1.2, 0.0, 0.0), &upright, 1.0);
//! assert!(linked(&a, &b));
//! assert!((closest_points(&a, &b).distance - 0.8).abs() < 1e-12);
//! // Wires of radius 0.4 just touch; thicker ones overlap along one arc.
//! assert!(circle_circle_arcs(&a, &b, 0.79).is_empty());
//! assert_eq!(circle_circle_arcs(&a, &b, 0.81).iter().count(), 1);
//! ```

// `!(x > 0.0)` is meant as written: a NaN must take the branch that finds nothing.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

pub mod aabb;
pub mod arc;
pub mod bernstein;
pub mod capsule;
pub mod circle;
pub mod companion;
pub mod cuboid;
pub mod gauss;
pub mod lanes;
pub mod minima;
pub mod patch;
pub mod plane;
pub mod polynomial;
pub mod rotation;
pub mod span;
pub mod sphere;
pub mod torus;

mod closest;
mod ellipse;
pub mod shift;

pub use aabb::Aabb;
pub use arc::{Arc, Arcs};
pub use circle::{Circle, ClosestPoints, closest_points, linked, point_circle_distance};
pub use companion::RootFinder;
pub use gauss::GaussRule;

/// A vector or point of three `f64`; unit and frame as the place that uses it says.
pub type Vec3 = nalgebra::Vector3<f64>;

//! The names of bodies in messages.

use std::fmt;

/// A body, named as a person counts them in the scene: rings (woven ones first), spheres, capsules, boxes,
/// polynomials and planes, each from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BodyName {
    /// `ring N`.
    Ring(usize),
    /// `sphere N`.
    Sphere(usize),
    /// `capsule N`.
    Capsule(usize),
    /// `box N`.
    Box(usize),
    /// `polynomial N`.
    Polynomial(usize),
    /// `plane N`.
    Plane(usize),
}

impl fmt::Display for BodyName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BodyName::Ring(index) => write!(f, "ring {index}"),
            BodyName::Sphere(index) => write!(f, "sphere {index}"),
            BodyName::Capsule(index) => write!(f, "capsule {index}"),
            BodyName::Box(index) => write!(f, "box {index}"),
            BodyName::Polynomial(index) => write!(f, "polynomial {index}"),
            BodyName::Plane(index) => write!(f, "plane {index}"),
        }
    }
}

//! Patches of any form: cross-sections, each cut exactly by root isolation.
//!
//! The surface is cut by half planes through an axis: a ring's own, or for a sphere that of the ring it touches. A
//! cross-section of the surface is a circle, and the part of it inside the other body is found as contact arcs
//! are, so nothing is missed. The area element is the circle's radius (for a sphere: its own) times the distance from
//! the axis, for each unit of both angles.
//!
//! The sum over cross-sections is a midpoint rule: all round where every one is cut, else in the angle whose sine
//! runs from end to end, in which the integrand (it falls as the 3/2 power there) is smooth.

use super::Solid;
use crate::{Arcs, Circle, GaussRule, Vec3};

/// Cross-sections that are tried to find where a patch begins and ends.
const TRIES: u32 = 16;

/// Halvings of a try's width to find an end. The force changes by the power 5/2 of an error there: 2^-12 of a sixteenth of
/// the arc leaves 1e-12 of it.
const HALVINGS: u32 = 12;

/// Cross-sections for each part of a patch, and all round.
const SLICES: u32 = 24;
const SLICES_ROUND: u32 = 48;

const PI: f64 = core::f64::consts::PI;

/// Hands out the points of the part of `surface` in `solid`: place, normal of the solid, depth and area. `guide` is
/// the ring whose axis is cut about (the surface itself, or for a sphere the solid), and `arcs` the contact arcs on its
/// centreline.
pub fn patch(
    surface: &Solid,
    solid: &Solid,
    guide: &Circle,
    arcs: &Arcs,
    mut visit: impl FnMut(&Vec3, &Vec3, f64, f64),
) {
    let slicer = Slicer { surface, solid, guide };
    let mut pieces = arcs.as_slice();
    while let Some(first) = pieces.first() {
        let count = pieces.iter().take_while(|piece| piece.connected == first.connected).count();
        let length: f64 = pieces[..count].iter().map(|piece| 2.0 * piece.half_angle()).sum();
        let start = first.at(-first.half_tangent);
        slicer.along(start, length, &mut visit);
        pieces = &pieces[count..];
    }
}

struct Slicer<'a> {
    surface: &'a Solid,
    solid: &'a Solid,
    guide: &'a Circle,
}

/// One cross-section.
struct Section {
    circle: Circle,
    /// Area for each unit of both angles and of distance from the axis (m).
    factor: f64,
    arcs: Arcs,
}

impl Slicer<'_> {
    /// The cross-section at an angle from a start; None if the surface does not reach there.
    fn at(&self, (cos, sin): (f64, f64), angle: f64) -> Option<Section> {
        let (s, c) = libm::sincos(angle);
        let (cos, sin) = (cos * c - sin * s, sin * c + cos * s);
        let radial = self.guide.u * cos + self.guide.w * sin;
        let tangent = self.guide.w * cos - self.guide.u * sin;
        let axis = self.guide.normal;
        let (circle, factor) = match self.surface {
            Solid::Ring { circle, minor_radius } => {
                let centre = circle.centre + radial * circle.radius;
                (
                    Circle { centre, u: radial, w: axis, normal: -tangent, radius: *minor_radius },
                    *minor_radius,
                )
            }
            Solid::Sphere { centre, radius } => {
                let aside = (centre - self.guide.centre).dot(&tangent);
                let square = radius * radius - aside * aside;
                if !(square > 0.0) {
                    return None;
                }
                let circle = Circle {
                    centre: centre - tangent * aside,
                    u: radial,
                    w: axis,
                    normal: -tangent,
                    radius: square.sqrt(),
                };
                (circle, *radius)
            }
            Solid::Plane { .. } => return None,
        };
        let arcs = self.solid.section(&circle);
        (!arcs.is_empty()).then_some(Section { circle, factor, arcs })
    }

    /// All cross-sections of one connected arc.
    fn along(&self, start: (f64, f64), length: f64, visit: &mut impl FnMut(&Vec3, &Vec3, f64, f64)) {
        let place = |index: u32, from: f64| from + length * (f64::from(index) + 0.5) / f64::from(TRIES);
        let cut = |index: u32| self.at(start, place(index, 0.0)).is_some();
        let Some(first) = (0..TRIES).find(|&index| cut(index)) else { return };
        let closed = length > 2.0 * PI - 1e-9;
        let gap = (first..TRIES).find(|&index| !cut(index));
        if closed && first == 0 && gap.is_none() {
            let width = length / f64::from(SLICES_ROUND);
            for index in 0..SLICES_ROUND {
                self.slice(start, (f64::from(index) + 0.5) * width, width, visit);
            }
            return;
        }
        // Round a whole circle with a gap, it begins in the gap.
        let (from, first) = match gap {
            Some(gap) if closed => {
                let from = place(gap, 0.0);
                let first = (0..TRIES).find(|&index| self.at(start, place(index, from)).is_some());
                (from, first.unwrap_or(0))
            }
            _ => (0.0, first),
        };
        let last = (first..TRIES).rev().find(|&index| self.at(start, place(index, from)).is_some());
        let begin =
            self.end(start, place(first, from), if first == 0 { from } else { place(first - 1, from) });
        let last = last.unwrap_or(first);
        let end = self.end(
            start,
            place(last, from),
            if last + 1 == TRIES { from + length } else { place(last + 1, from) },
        );
        let (middle, half) = (0.5 * (begin + end), 0.5 * (end - begin));
        for index in 0..SLICES {
            let (s, c) = libm::sincos(PI * (f64::from(index) + 0.5) / f64::from(SLICES));
            self.slice(start, middle - half * c, half * s * PI / f64::from(SLICES), visit);
        }
    }

    /// The angle up to which cross-sections are cut, between one that is and a bound.
    fn end(&self, start: (f64, f64), inside: f64, bound: f64) -> f64 {
        let (mut inside, mut outside) = (inside, bound);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            if self.at(start, middle).is_some() {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    }

    fn slice(
        &self,
        start: (f64, f64),
        angle: f64,
        width: f64,
        visit: &mut impl FnMut(&Vec3, &Vec3, f64, f64),
    ) {
        let Some(section) = self.at(start, angle) else { return };
        for arc in section.arcs.iter() {
            let rule = match arc.half_tangent {
                short if short < 0.02 => GaussRule::Four,
                middling if middling < 0.08 => GaussRule::Six,
                _ => GaussRule::Eight,
            };
            for node in arc.nodes(rule) {
                let point = section.circle.point(node.cos, node.sin);
                let rho = (point - self.guide.centre).dot(&section.circle.u);
                let (depth, normal) = self.solid.depth(&point);
                // Rounding at the end of an arc; and a sphere's other half belongs to the opposite half plane.
                if depth > 0.0 && rho > 0.0 {
                    visit(&point, &normal, depth, section.factor * rho * node.weight * width);
                }
            }
        }
    }
}

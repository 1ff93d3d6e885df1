//! Which lines, points and field a pair of shapes is made of.

use super::field::{Core, Field};
use super::{Carrier, Line, carried, carrier_gap, mutual, ring, ring_gap, sphere};
use crate::Model;
use crate::body::{Body, Shape};
use crate::contact::friction::Slip;
use crate::contact::material::NormalLaw;
use crate::contact::{Pair, PairForce};
use crate::model::HalfSpace;
use geometry::{Circle, Vec3, cuboid};

/// A body in its place.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'a> {
    pub model: &'a Model,
    pub body: &'a Body,
    pub frame: &'a Circle,
}

/// Lines and points of a box, or fewer.
struct Features {
    lines: [Line; 12],
    points: [Vec3; 8],
    counts: (usize, usize),
}

impl Features {
    fn carrier(&self) -> Carrier<'_> {
        Carrier { lines: &self.lines[..self.counts.0], points: &self.points[..self.counts.1] }
    }
}

impl<'a> Placed<'a> {
    /// The body as the one that is measured against.
    fn field(&self) -> Field<'a> {
        let core = match self.body.shape {
            Shape::Capsule { half_length_m, .. } => Core::Segment(half_length_m),
            Shape::Box { core_m, .. } => Core::Cuboid(core_m),
            Shape::Polynomial { surface, .. } => Core::Surface(self.model.solid(surface)),
            Shape::Ring { .. } | Shape::Sphere { .. } => Core::Segment(0.0),
        };
        Field { core, frame: self.frame, radius: self.body.minor_radius }
    }

    /// The body as the one that carries the contact. Rings carry theirs along their centreline.
    fn features(&self) -> Features {
        let Circle { u, w, normal, .. } = self.frame;
        let none = Line { middle: Vec3::zeros(), half: Vec3::zeros() };
        let mut features = Features { lines: [none; 12], points: [Vec3::zeros(); 8], counts: (0, 1) };
        match self.body.shape {
            // A polynomial carries nothing: no pair in which it would have to is accepted.
            Shape::Ring { .. } | Shape::Sphere { .. } | Shape::Polynomial { .. } => {}
            Shape::Capsule { half_length_m, .. } => {
                let half = normal * half_length_m;
                features.lines[0].half = half;
                features.points[0] = half;
                features.points[1] = -half;
                features.counts = (1, 2);
            }
            Shape::Box { core_m, .. } => {
                let world = |p: &Vec3| u * p.x + w * p.y + normal * p.z;
                features.points = cuboid::corners(&core_m).map(|corner| world(&corner));
                features.lines = cuboid::edges(&core_m).map(|(start, end)| {
                    let (start, end) = (world(&start), world(&end));
                    Line { middle: (start + end) * 0.5, half: (end - start) * 0.5 }
                });
                features.counts = (12, 8);
            }
        }
        features
    }
}

/// Contact of a body with a capsule, box or polynomial of a higher number.
///
/// `back` is the pair seen from the other body.
pub(crate) fn two_bodies<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    back: &Pair,
    (a, b): (Placed, Placed),
    point_law: NormalLaw,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let field = b.field();
    match (a.body.shape, b.body.shape) {
        (Shape::Ring { .. }, _) => ring::<DAMPED, FRICTION>(pair, &field, slip, forces),
        (Shape::Sphere { .. }, _) => sphere::<DAMPED, FRICTION>(pair, &field, slip, forces),
        (Shape::Box { .. }, Shape::Box { .. }) => {
            let (features_a, features_b) = (a.features(), b.features());
            let carriers = (&features_a.carrier(), &features_b.carrier());
            let fields = (&a.field(), &field);
            mutual::<DAMPED, FRICTION>(pair, back, point_law, carriers, fields, slip, forces);
        }
        _ => carried::<DAMPED, FRICTION>(pair, point_law, &a.features().carrier(), &field, slip, forces),
    }
}

/// Contact of a capsule or box with a plane.
pub(crate) fn on_plane<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    a: Placed,
    plane: &HalfSpace,
    point_law: NormalLaw,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let features = a.features();
    let field = below(a.frame, plane);
    carried::<DAMPED, FRICTION>(pair, point_law, &on_plane_carrier(&a, &features), &field, slip, forces);
}

/// A box stands on its corners: along its edges no point is lower than the lower end.
fn on_plane_carrier<'a>(a: &Placed, features: &'a Features) -> Carrier<'a> {
    let carrier = features.carrier();
    if matches!(a.body.shape, Shape::Box { .. }) { Carrier { lines: &[], ..carrier } } else { carrier }
}

/// The half-space as a field about the centre of a body.
fn below<'a>(frame: &'a Circle, plane: &HalfSpace) -> Field<'a> {
    let height = plane.normal.dot(&frame.centre) - plane.offset;
    Field { core: Core::HalfSpace { normal: plane.normal, height }, frame, radius: 0.0 }
}

/// Signed distance of two surfaces of which the second is a capsule, box or polynomial (m); negative is penetration.
pub(crate) fn gap(a: Placed, b: Placed) -> f64 {
    let (field, from_b, wire) = (b.field(), a.frame.centre - b.frame.centre, a.body.minor_radius);
    match (a.body.shape, b.body.shape) {
        (Shape::Ring { .. }, _) => ring_gap(a.frame, wire, &from_b, &field),
        (Shape::Box { .. }, Shape::Box { .. }) => {
            let one = carrier_gap(&a.features().carrier(), wire, &from_b, &field);
            let back = b.features();
            let other = carrier_gap(&back.carrier(), b.body.minor_radius, &-from_b, &a.field());
            if other < one { other } else { one }
        }
        _ => carrier_gap(&a.features().carrier(), wire, &from_b, &field),
    }
}

/// Signed distance of a capsule or box from a plane (m).
pub(crate) fn plane_gap(a: Placed, plane: &HalfSpace) -> f64 {
    let field = below(a.frame, plane);
    let features = a.features();
    carrier_gap(&on_plane_carrier(&a, &features), a.body.minor_radius, &Vec3::zeros(), &field)
}

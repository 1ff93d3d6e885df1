//! Contact of capsules, boxes and polynomial bodies: with each other, with rings, spheres and planes.
//!
//! The one thing to know: one body of a pair carries the contact, by lines and points of it with a radius
//! around them (its *wire*), and the other is a [`Field`]: the signed distance from its core. Along lines the law is
//! that of contact arcs (see [`super`]), with the line stiffness: a penetration `d = s - D`, with `D` the signed
//! distance from the core and `s` the wire's and the core's radius together, wherever it is positive. At points it is
//! the law of contact points. Both are gradients of a potential, so both conserve energy.
//!
//! | Carrier | Lines | Points |
//! |---|---|---|
//! | ring | its centreline | |
//! | sphere | | its centre |
//! | capsule | its segment | the segment's ends, for it to stand on |
//! | box | the edges of its core | the corners of its core |
//!
//! The carrier is the body with the lower number: rings, spheres, capsules, boxes. Two boxes carry both: the edges
//! and corners of each are measured against the other, for one of two boxes that meet always has an edge in the
//! other. On a plane a box stands on its corners alone.
//!
//! The parts of a line that are in contact are found with proof: see [`geometry::span`]. Their integrals are
//! taken with Gauss points on pieces no longer than `s`; where the nearest feature changes (from a face to an edge,
//! say) the integrand has a kink in its second derivative, which costs digits: about four are left.
//!
//! # Polynomial bodies
//! A polynomial body is always the field, so its other body is a ring, a sphere or a capsule; pairs of it with planes, boxes
//! and its like are refused when the model is compiled. The distance is that of the closest point
//! ([`geometry::polynomial::Solid`]), and where two parts of the surface are equally near, the normal jumps: a kink in
//! the penetration, not a step of it, so the force stays continuous.
//!
//! # Contacts
//! A ring has one contact for each connected arc, of more than two the third and further belong to the second. All
//! lines and points of a capsule or box together make one contact, with one spring of friction at its force
//! centre: it sticks and slides like the others, and does not resist being turned about the contact's normal.
//!
//! # Limits
//! A body whose core lies deep in a box is pushed out through the nearest face, which may be the wrong one; and a
//! centreline across the segment of a capsule has no direction to be pushed to. Both need penetrations of the
//! size of the bodies.

pub(crate) mod field;
pub(crate) mod pairs;

use super::{Node, Pair, PairForce, Patch, at_point, close, friction::Slip, material::NormalLaw};
use field::Field;
use geometry::span::{least, negative_spans};
use geometry::{GaussRule, Vec3};

const PI: f64 = core::f64::consts::PI;
/// Pieces of a line in contact, at most: beyond, they get longer.
const PIECES_MAX: f64 = 64.0;

/// A straight line that a body carries, and what lies at it: World axes, from A's centre.
#[derive(Clone, Copy)]
pub(crate) struct Line {
    pub middle: Vec3,
    /// From the middle to the end.
    pub half: Vec3,
}

/// A pair whose carrier is A, measured against B.
struct Meeting<'a> {
    pair: &'a Pair<'a>,
    field: &'a Field<'a>,
    /// The wire's and the core's radius together.
    reach: f64,
}

impl Meeting<'_> {
    fn distance(&self, lever: &Vec3) -> (Vec3, f64) {
        self.field.distance(&(self.pair.from_b + lever))
    }

    /// Adds a point with its share of the length; nothing where there is no penetration.
    fn add<const DAMPED: bool, const FRICTION: bool>(
        &self,
        patch: &mut Patch,
        lever: Vec3,
        (length, arc_length): (f64, f64),
        cos_sin: (f64, f64),
    ) {
        let (normal, distance) = self.distance(&lever);
        let penetration = self.reach - distance;
        if penetration > 0.0 {
            let node = Node { lever, normal, penetration, length, arc_length };
            patch.add::<DAMPED, FRICTION>(self.pair, &node, cos_sin);
        }
    }
}

/// Calls for the Gauss points of a piece of a line from `start` to `end`, with their lengths.
fn for_each_node(start: f64, end: f64, scale: f64, mut visit: impl FnMut(f64, f64)) {
    let length = end - start;
    let mut pieces = libm::ceil(length / scale);
    if !(pieces <= PIECES_MAX) {
        pieces = PIECES_MAX;
    }
    let half = 0.5 * length / pieces;
    let rule = if half < 0.25 * scale { GaussRule::Six } else { GaussRule::Eight };
    for piece in 0..pieces as u32 {
        let middle = start + half * f64::from(2 * piece + 1);
        for &(x, weight) in rule.nodes() {
            visit(middle + half * x, half * weight);
        }
    }
}

/// A ring against a field.
pub(crate) fn ring<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    field: &Field,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let meeting = Meeting { pair, field, reach: pair.a_minor_radius + field.radius };
    let radius = pair.a.radius;
    let (u, w) = (pair.a.u * radius, pair.a.w * radius);
    let at = |t: f64| {
        let (sin, cos) = libm::sincos(t / radius);
        (u * cos + w * sin, cos, sin)
    };
    let scale = field.scale(pair.a_minor_radius);
    let half = PI * radius;
    let spans = negative_spans(-half, half, field.bend(radius), field.width_min() * scale, |t| {
        let (lever, cos, sin) = at(t);
        let (normal, distance) = meeting.distance(&lever);
        (distance - meeting.reach, normal.dot(&(pair.a.w * cos - pair.a.u * sin)))
    });
    let spans = spans.closed(-half, 2.0 * half);
    if spans.as_slice().is_empty() {
        return;
    }
    let mut patches = [Patch::EMPTY; 2];
    let mut lengths = [0.0; 2];
    let patch_of = |index: usize| index.min(1);
    for (index, (start, end)) in spans.as_slice().iter().enumerate() {
        lengths[patch_of(index)] += end - start;
    }
    for (index, &(start, end)) in spans.as_slice().iter().enumerate() {
        let patch = &mut patches[patch_of(index)];
        for_each_node(start, end, scale, |t, length| {
            let (lever, cos, sin) = at(t);
            let length = (length, lengths[patch_of(index)]);
            meeting.add::<DAMPED, FRICTION>(patch, lever, length, (cos, sin));
        });
    }
    let count = patch_of(spans.as_slice().len() - 1) + 1;
    close::<DAMPED, FRICTION>(pair, &mut patches[..count], slip, forces);
}

/// A sphere against a field: a contact point.
pub(crate) fn sphere<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    field: &Field,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let (normal, distance) = field.distance(&pair.from_b);
    let penetration = pair.a_minor_radius + field.radius - distance;
    at_point::<DAMPED, FRICTION>(pair, normal, penetration, slip, forces);
}

/// What carries the contact on one side of a pair.
pub(crate) struct Carrier<'a> {
    pub lines: &'a [Line],
    pub points: &'a [Vec3],
}

/// Lines and points of A against a field.
pub(crate) fn carried<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    point_law: NormalLaw,
    carrier: &Carrier,
    field: &Field,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let mut patch = Patch::EMPTY;
    if add_carrier::<DAMPED, FRICTION>(&mut patch, pair, point_law, carrier, field) {
        close::<DAMPED, FRICTION>(pair, &mut [patch], slip, forces);
    }
}

/// Two boxes: A's edges and corners against B's field, and B's against A's. `back` is the pair seen from B.
pub(crate) fn mutual<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    back: &Pair,
    point_law: NormalLaw,
    (carrier_a, carrier_b): (&Carrier, &Carrier),
    (field_a, field_b): (&Field, &Field),
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let (mut patch, mut other) = (Patch::EMPTY, Patch::EMPTY);
    let mut touch = add_carrier::<DAMPED, FRICTION>(&mut patch, pair, point_law, carrier_a, field_b);
    touch |= add_carrier::<DAMPED, FRICTION>(&mut other, back, point_law, carrier_b, field_a);
    if touch {
        patch.add_reaction(&other, &back.from_b);
        close::<DAMPED, FRICTION>(pair, &mut [patch], slip, forces);
    }
}

/// Adds all lines and points of A; returns whether any is in contact.
fn add_carrier<const DAMPED: bool, const FRICTION: bool>(
    patch: &mut Patch,
    pair: &Pair,
    point_law: NormalLaw,
    carrier: &Carrier,
    field: &Field,
) -> bool {
    let meeting = Meeting { pair, field, reach: pair.a_minor_radius + field.radius };
    let scale = field.scale(pair.a_minor_radius);
    let mut total = 0.0;
    let mut found = [(0, 0.0, 0.0); 16];
    let mut count = 0;
    for (index, line) in carrier.lines.iter().enumerate() {
        let half = line.half.norm_squared().sqrt();
        let direction = line.half * (1.0 / half);
        let spans = negative_spans(-half, half, field.bend(f64::INFINITY), field.width_min() * scale, |t| {
            let (normal, distance) = meeting.distance(&(line.middle + direction * t));
            (distance - meeting.reach, normal.dot(&direction))
        });
        for &(start, end) in spans.as_slice() {
            if count < found.len() {
                total += end - start;
                found[count] = (index, start, end);
                count += 1;
            }
        }
    }
    // All lines and points may push at once, so damping is slowed as if all of them were where each one is: lines
    // and points alike, hence the factor of two.
    for &(index, start, end) in &found[..count] {
        let line = &carrier.lines[index];
        let direction = line.half * (1.0 / line.half.norm_squared().sqrt());
        for_each_node(start, end, scale, |t, length| {
            let lever = line.middle + direction * t;
            meeting.add::<DAMPED, FRICTION>(patch, lever, (length, 2.0 * total), (0.0, 0.0));
        });
    }
    let at_points = Pair { law: point_law, ..*pair };
    let meeting = Meeting { pair: &at_points, ..meeting };
    let before = patch.weight;
    let many = 2.0 * carrier.points.len() as f64;
    for point in carrier.points {
        meeting.add::<DAMPED, FRICTION>(patch, *point, (1.0, many), (0.0, 0.0));
    }
    count > 0 || patch.weight > before
}

/// The gap between A and a field (m), negative for penetration: the least distance of A's lines and points.
pub(crate) fn ring_gap(circle: &geometry::Circle, wire: f64, from_b: &Vec3, field: &Field) -> f64 {
    let (u, w, radius) = (circle.u * circle.radius, circle.w * circle.radius, circle.radius);
    let half = PI * radius;
    let scale = field.scale(wire);
    let (distance, _) =
        least(-half, half, field.bend(radius), field.width_min() * scale, 1e-12 * radius, |t| {
            let (sin, cos) = libm::sincos(t / radius);
            let (normal, distance) = field.distance(&(from_b + u * cos + w * sin));
            (distance, normal.dot(&(circle.w * cos - circle.u * sin)))
        });
    distance - wire - field.radius
}

/// The same for lines and points.
pub(crate) fn carrier_gap(carrier: &Carrier, wire: f64, from_b: &Vec3, field: &Field) -> f64 {
    let mut lowest = f64::INFINITY;
    let mut take = |distance: f64| {
        if distance < lowest {
            lowest = distance;
        }
    };
    for point in carrier.points {
        take(field.distance(&(from_b + point)).1);
    }
    let width = field.width_min() * field.scale(wire);
    for line in carrier.lines {
        let half = line.half.norm_squared().sqrt();
        let direction = line.half * (1.0 / half);
        let at = |t: f64| {
            let (normal, distance) = field.distance(&(from_b + line.middle + direction * t));
            (distance, normal.dot(&direction))
        };
        take(least(-half, half, field.bend(f64::INFINITY), width, 1e-12 * half, at).0);
    }
    lowest - wire - field.radius
}

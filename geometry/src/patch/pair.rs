//! Both patches of two bodies in contact, by quadrature.

use super::polar::{self, Deepest, Order};
use super::{Nodes, Solid, cap, slices};
use crate::arc::circle_circle_arcs;
use crate::minima::{Minima, circle_circle_minima, circle_plane_minima, circle_point_minima};
use crate::{Arcs, Circle, Vec3};

/// Adds the points of A's surface in B and of B's surface in A, each with its area times its body's share of
/// `shares`, and each with the normal that points from B to A: the direction of the force on A. Against a plane, whose
/// own surface has no points to speak of, A's surface counts alone.
///
/// `arcs` are the contact arcs on A's centreline for the sum of both wires' radii (see [`crate::arc`]); of two spheres,
/// or a sphere and a plane, none are needed. `nodes[0]` and `nodes[1]` get the points of contact arc 0 and 1. A ring comes
/// before a sphere and a sphere before a plane; another order adds nothing.
///
/// Each connected contact with one deepest point goes to [`polar`]; where that refuses, the whole pair goes to
/// [`slices`]. Which way is a function of the pair's pose alone.
pub fn quadrature(a: &Solid, b: &Solid, arcs: &Arcs, shares: [f64; 2], nodes: &mut [Nodes; 2]) {
    match (a, b) {
        (Solid::Ring { circle, .. }, Solid::Ring { circle: other, .. }) => {
            let minima = circle_circle_minima(circle, other, arcs);
            if !about_deepest(a, b, circle, arcs, &minima, shares, nodes) {
                nodes.iter_mut().for_each(Nodes::clear);
                in_slices(a, b, circle, arcs, shares, nodes);
            }
        }
        (Solid::Ring { circle, .. }, Solid::Sphere { centre, .. }) => {
            let minima = circle_point_minima(circle, centre);
            if !about_deepest(a, b, circle, arcs, &minima, shares, nodes) {
                nodes.iter_mut().for_each(Nodes::clear);
                in_slices(a, b, circle, arcs, shares, nodes);
            }
        }
        (Solid::Ring { circle, .. }, Solid::Plane { normal, .. }) => {
            let minima = circle_plane_minima(circle, normal);
            if !about_deepest(a, b, circle, arcs, &minima, shares, nodes) {
                nodes.iter_mut().for_each(Nodes::clear);
                in_slices(a, b, circle, arcs, shares, nodes);
            }
        }
        (Solid::Sphere { centre, radius }, Solid::Sphere { centre: other, radius: other_radius }) => {
            cap::cap(centre, *radius, b, shares[0], &mut nodes[0]);
            let turned = nodes[0].blocks().len();
            cap::cap(other, *other_radius, a, shares[1], &mut nodes[0]);
            turn(&mut nodes[0], turned);
        }
        (Solid::Sphere { centre, radius }, Solid::Plane { .. }) => {
            cap::cap(centre, *radius, b, shares[0], &mut nodes[0]);
        }
        _ => {}
    }
}

/// Turns the normals of the blocks from `first` on: they belong to the other body's surface.
pub(super) fn turn(nodes: &mut Nodes, first: usize) {
    for block in nodes.blocks_from(first) {
        for component in block.normal.iter_mut().flatten() {
            *component = -*component;
        }
    }
}

/// The closest point of a body's core (centreline, centre, surface of a plane) to a point, and for a ring its place.
fn core_point(solid: &Solid, point: &Vec3) -> (Vec3, (f64, f64)) {
    match solid {
        Solid::Ring { circle, .. } => {
            let closest = circle.closest_point(point);
            let d = (closest - circle.centre) * (1.0 / circle.radius);
            (closest, (d.dot(&circle.u), d.dot(&circle.w)))
        }
        Solid::Sphere { centre, .. } => (*centre, (1.0, 0.0)),
        Solid::Plane { normal, offset } => (point - normal * (normal.dot(point) - offset), (1.0, 0.0)),
    }
}

fn core_radius(solid: &Solid) -> f64 {
    match solid {
        Solid::Ring { minor_radius, .. } => *minor_radius,
        Solid::Sphere { radius, .. } => *radius,
        Solid::Plane { .. } => 0.0,
    }
}

/// The patches of every connected contact about its deepest point; false where one cannot be taken so.
fn about_deepest(
    a: &Solid,
    b: &Solid,
    circle: &Circle,
    arcs: &Arcs,
    minima: &Minima,
    shares: [f64; 2],
    nodes: &mut [Nodes; 2],
) -> bool {
    if minima.as_slice().len() != arcs.connected_count() {
        return false;
    }
    let (minor_a, minor_b) = (core_radius(a), core_radius(b));
    let thinner = if minor_b > 0.0 && minor_b < minor_a { minor_b } else { minor_a };
    for minimum in minima.as_slice() {
        let deepest = deepest_points(a, b, circle, (minimum.cos, minimum.sin));
        let depth = deepest[0].depth;
        // An arc of no length has no patch; one that reaches far towards the other's core is no bowl.
        if depth <= 0.0 {
            continue;
        }
        if !(depth < 0.5 * thinner) {
            return false;
        }
        let nodes = &mut nodes[usize::from(minimum.connected)];
        let order = Order::for_patch(depth, thinner);
        let plane = matches!(b, Solid::Plane { .. });
        nodes.note_depth(depth);
        if !polar::patch(a, b, &deepest[0], order, shares[0], nodes) {
            return false;
        }
        if !plane {
            let turned = nodes.blocks().len();
            if !polar::patch(b, a, &deepest[1], order, shares[1], nodes) {
                return false;
            }
            turn(nodes, turned);
        }
    }
    true
}

/// The deepest points of A's surface in B and of B's surface in A, on the line between the closest points of their
/// cores; `place` is the one on A's centreline.
pub fn deepest_points(a: &Solid, b: &Solid, circle: &Circle, place: (f64, f64)) -> [Deepest; 2] {
    let point = circle.point(place.0, place.1);
    let (minor_a, minor_b) = (core_radius(a), core_radius(b));
    let (other, other_place) = core_point(b, &point);
    let apart = other - point;
    let distance = apart.norm_squared().sqrt();
    let (outward, depth) = match b {
        Solid::Plane { normal, offset } => (-normal, offset - normal.dot(&point) + minor_a),
        _ => (apart * (1.0 / distance), minor_a + minor_b - distance),
    };
    [Deepest { place, outward, depth }, Deepest { place: other_place, outward: -outward, depth }]
}

fn in_slices(a: &Solid, b: &Solid, circle: &Circle, arcs: &Arcs, shares: [f64; 2], nodes: &mut [Nodes; 2]) {
    slices::patch(a, b, circle, arcs, |point, normal, depth, area| {
        nodes[connected_at(circle, arcs, point)].push(point, normal, depth, shares[0] * area);
    });
    let reversed;
    let (guide, guide_arcs) = match b {
        Solid::Ring { circle: other, .. } => {
            reversed = circle_circle_arcs(other, circle, core_radius(a) + core_radius(b));
            (other, &reversed)
        }
        Solid::Sphere { .. } => (circle, arcs),
        Solid::Plane { .. } => return,
    };
    slices::patch(b, a, guide, guide_arcs, |point, normal, depth, area| {
        nodes[connected_at(circle, arcs, point)].push(point, &-normal, depth, shares[1] * area);
    });
}

/// Which connected contact arc of a circle a point belongs to: the one that its angle about the axis lies in, or is
/// nearest to.
pub fn connected_at(circle: &Circle, arcs: &Arcs, point: &Vec3) -> usize {
    if arcs.connected_count() < 2 {
        return 0;
    }
    let d = point - circle.centre;
    let (x, y) = (d.dot(&circle.u), d.dot(&circle.w));
    let inverse = 1.0 / (x * x + y * y).sqrt();
    let mut best = (f64::NEG_INFINITY, 0);
    for piece in arcs.iter() {
        let square = piece.half_tangent * piece.half_tangent;
        let inside = (x * piece.mid_cos + y * piece.mid_sin) * inverse - (1.0 - square) / (1.0 + square);
        if inside > best.0 {
            best = (inside, usize::from(piece.connected));
        }
    }
    best.1
}

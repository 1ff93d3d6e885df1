//! Both patches of two bodies in contact, by quadrature.

use super::polar::{self, Deepest, Order};
use super::{Nodes, Solid, cap, rings, slices, strips};
use crate::arc::circle_circle_arcs;
use crate::minima::{Minima, Minimum, circle_circle_minima, circle_plane_minima, circle_point_minima};
use crate::{Arc, Arcs, Circle, Vec3};

/// Adds the points of A's surface in B and of B's surface in A, each with its area times its body's share of
/// `shares`, and each with the normal that points from B to A: the direction of the force on A. Against a plane, whose
/// own surface has no points to speak of, A's surface counts alone.
///
/// `arcs` are the contact arcs on A's centreline for the sum of both wires' radii (see [`crate::arc`]); of two spheres,
/// or a sphere and a plane, none are needed. `nodes[0]` and `nodes[1]` get the points of contact arc 0 and 1. A ring comes
/// before a sphere and a sphere before a plane; another order adds nothing.
///
/// Each connected contact with one deepest point goes to [`polar`]; where that refuses, and with two deepest points, to
/// [`strips`]; where that refuses too, the whole pair goes to [`slices`]. Which way is a function of the pair's pose alone.
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

/// The patches of every connected contact about its deepest point or, of two rings, in strips; false where one cannot be
/// taken so.
fn about_deepest(
    a: &Solid,
    b: &Solid,
    circle: &Circle,
    arcs: &Arcs,
    minima: &Minima,
    shares: [f64; 2],
    nodes: &mut [Nodes; 2],
) -> bool {
    let (minor_a, minor_b) = (core_radius(a), core_radius(b));
    let thinner = if minor_b > 0.0 && minor_b < minor_a { minor_b } else { minor_a };
    let mut rest = minima.as_slice();
    for (connected, nodes) in nodes.iter_mut().enumerate().take(arcs.connected_count()) {
        let here = |minimum: &&Minimum| usize::from(minimum.connected) == connected;
        let count = rest.iter().take_while(here).count();
        let (found, later) = rest.split_at(count);
        rest = later;
        let [first, ..] = found else { return false };
        let place = |minimum: &Minimum| deepest_points(a, b, circle, (minimum.cos, minimum.sin));
        let deepest = place(first);
        let mut depth = deepest[0].depth;
        // An arc of no length has no patch; one that reaches far towards the other's core is no bowl.
        let shallow = |depth: f64| depth < 0.5 * thinner;
        if found.len() == 1 && depth <= 0.0 {
            continue;
        }
        if !shallow(depth) {
            return false;
        }
        let order = Order::for_patch(depth, thinner);
        if !(found.len() == 1 && rays(a, b, &deepest, order, shares, nodes)) {
            let second = place(&found[found.len() - 1]);
            depth = if second[0].depth > depth { second[0].depth } else { depth };
            nodes.clear();
            let taken = found.len() <= 2 && shallow(depth) && depth > 0.0;
            if !(taken && strips_of(a, b, (arcs, connected), [&deepest, &second], depth, shares, nodes)) {
                return false;
            }
        }
        nodes.note_depth(depth);
    }
    rest.is_empty()
}

/// Both patches of a contact about its deepest points.
fn rays(
    a: &Solid,
    b: &Solid,
    deepest: &[Deepest; 2],
    order: Order,
    shares: [f64; 2],
    nodes: &mut Nodes,
) -> bool {
    if let (Solid::Ring { circle, minor_radius }, Solid::Ring { circle: other, minor_radius: other_minor }) =
        (a, b)
    {
        return rings::patches((circle, *minor_radius), (other, *other_minor), deepest, order, shares, nodes);
    }
    if !polar::patch(a, b, &deepest[0], order, shares[0], nodes) {
        return false;
    }
    if matches!(b, Solid::Plane { .. }) {
        return true;
    }
    let turned = nodes.blocks().len();
    if !polar::patch(b, a, &deepest[1], order, shares[1], nodes) {
        return false;
    }
    turn(nodes, turned);
    true
}

/// Both patches of a contact of two rings in strips along its two deepest points, or one that is given twice; `depth` is the
/// larger of their depths.
#[cold]
fn strips_of(
    a: &Solid,
    b: &Solid,
    (arcs, connected): (&Arcs, usize),
    deepest: [&[Deepest; 2]; 2],
    depth: f64,
    shares: [f64; 2],
    nodes: &mut Nodes,
) -> bool {
    let (Solid::Ring { circle, minor_radius }, Solid::Ring { circle: other, minor_radius: other_minor }) =
        (a, b)
    else {
        return false;
    };
    let reversed = circle_circle_arcs(other, circle, minor_radius + other_minor);
    let places = |side: usize| deepest.map(|points| points[side].place);
    let (Some(arc), Some(back)) = (
        sole_piece(arcs, |arc| usize::from(arc.connected) == connected),
        sole_piece(&reversed, |arc| places(1).iter().all(|&place| holds(arc, place))),
    ) else {
        return false;
    };
    if !strips::patch(a, b, arc, places(0), depth, shares[0], nodes) {
        return false;
    }
    let turned = nodes.blocks().len();
    if !strips::patch(b, a, back, places(1), depth, shares[1], nodes) {
        return false;
    }
    turn(nodes, turned);
    true
}

/// The piece of which something is true, if it is a whole connected arc.
fn sole_piece(arcs: &Arcs, is_meant: impl Fn(&Arc) -> bool) -> Option<&Arc> {
    let piece = arcs.iter().find(|arc| is_meant(arc))?;
    let alone = arcs.iter().filter(|other| other.connected == piece.connected).count() == 1;
    alone.then_some(piece)
}

/// Whether a piece of an arc holds a point of its circle.
fn holds(arc: &Arc, (cos, sin): (f64, f64)) -> bool {
    let square = arc.half_tangent * arc.half_tangent;
    (cos * arc.mid_cos + sin * arc.mid_sin) * (1.0 + square) > 1.0 - square
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

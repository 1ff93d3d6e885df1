//! The law `centreline-minima`: a spring at each local minimum of the distance.
//!
//! How engines with contact points work, for comparison. The minima of the distance from A's centreline to B are
//! found inside the certified contact arcs, all of them (`geometry::minima`); at each acts the law of a contact point
//! with `point_stiffness_n_per_m`, with damping and friction as for any contact.
//!
//! # Where it fails
//! - Where two minima merge into one, or one splits, the number of springs jumps, and with it force and energy: the
//!   energy of a motion through such a place does not converge with the time step.
//! - Where the distance is flat the place of the minimum is ill-defined: a ring that lies almost flat on a plane is held
//!   at one point, which leaps across the ring when its tilt changes sign. Exactly flat, and for coaxial rings, four
//!   points a quarter turn apart share the spring.
//! - The stiffness is the same for a long contact as for a short one.

use super::{Node, Pair, PairForce, Patch, close, from_circle, unit_or};
use crate::contact::friction::Slip;
use crate::model::HalfSpace;
use geometry::arc::{circle_plane_arcs, circle_point_arcs};
use geometry::minima::{Minima, circle_circle_minima, circle_plane_minima, circle_point_minima};
use geometry::{Arcs, Circle, Vec3};

/// Ring against ring: `arcs` are the contact arcs of A's centreline along B's.
pub(crate) fn ring_ring<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    b: &Circle,
    (arcs, reach): (&Arcs, f64),
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let minima = circle_circle_minima(pair.a, b, arcs);
    at_minima::<DAMPED, FRICTION>(pair, &minima, reach, slip, forces, |lever| from_circle(pair, b, lever));
}

/// Ring against sphere.
pub(crate) fn ring_sphere<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    centre: &Vec3,
    radius: f64,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let reach = pair.a_minor_radius + radius;
    if circle_point_arcs(pair.a, centre, reach).is_empty() {
        return;
    }
    let minima = circle_point_minima(pair.a, centre);
    at_minima::<DAMPED, FRICTION>(pair, &minima, reach, slip, forces, |lever| {
        unit_or(pair.from_b + lever, &pair.a.normal)
    });
}

/// Ring against plane.
pub(crate) fn ring_plane<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    plane: &HalfSpace,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    if circle_plane_arcs(pair.a, &plane.normal, plane.offset, pair.a_minor_radius).is_empty() {
        return;
    }
    let minima = circle_plane_minima(pair.a, &plane.normal);
    let height = plane.normal.dot(&pair.a.centre) - plane.offset;
    at_minima::<DAMPED, FRICTION>(pair, &minima, pair.a_minor_radius, slip, forces, |lever| {
        (plane.normal, height + plane.normal.dot(lever))
    });
}

/// One contact for each minimum; those beyond the second join the second, and the four that stand for a flat distance
/// are one.
fn at_minima<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    minima: &Minima,
    reach: f64,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
    closest: impl Fn(&Vec3) -> (Vec3, f64),
) {
    let mut patches = [Patch::EMPTY; 2];
    let mut count = 0;
    for (index, minimum) in minima.as_slice().iter().enumerate() {
        let lever = (pair.a.u * minimum.cos + pair.a.w * minimum.sin) * pair.a.radius;
        let (normal, distance) = closest(&lever);
        let contact = if index == 0 || minimum.share < 1.0 { 0 } else { 1 };
        count = contact + 1;
        let penetration = reach - distance;
        if penetration > 0.0 {
            let node = Node { lever, normal, penetration, length: minimum.share, arc_length: 1.0 };
            patches[contact].add::<DAMPED, FRICTION>(pair, &node, (minimum.cos, minimum.sin));
        }
    }
    close::<DAMPED, FRICTION>(pair, &mut patches[..count], slip, forces);
}

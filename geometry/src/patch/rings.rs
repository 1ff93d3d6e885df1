//! The patches of two rings about their deepest points: [`polar`](super::polar) for the common case, in vector instructions.
//!
//! The one thing to know: a place on the surface is told by how far it lies from the centreline's point under the patch, in that
//! point's own directions. So all numbers are of the size of the patch or of the other ring, and depth and height
//! over the other ring's plane take a few products. Both patches are worked on in turn, so that one fills
//! the time that the other waits.

use super::polar::{Deepest, EDGE, EDGE_STEPS, HOLLOW, Order, RAYS, TURN};
use super::{Nodes, WIDTH};
use crate::lanes::{Eight, Level, Simd, SimdBase, SimdCombine, SimdFloat, SimdMask, SimdSplit, dispatch};
use crate::{Circle, Vec3};

/// A ring: its centreline and its wire's radius.
pub(super) type Ring<'a> = (&'a Circle, f64);

/// Adds the points of A's surface in B and of B's surface in A, each with its area times its share, about their deepest
/// points, with normals from B to A. Returns false, and adds nothing, where a patch is not star-shaped about it, as
/// [`polar::patch`](super::polar::patch) does.
#[must_use]
pub(super) fn patches(
    a: Ring,
    b: Ring,
    deepest: &[Deepest; 2],
    order: Order,
    shares: [f64; 2],
    nodes: &mut Nodes,
) -> bool {
    let frames = [Frame::new(a, &deepest[0]), Frame::new(b, &deepest[1])];
    let crossing = frames[0].tangent.dot(&frames[1].tangent);
    let sides = [
        Side::new([a, b], &frames[0], &frames[1], crossing, deepest[0].depth, (shares[0], 1.0)),
        Side::new([b, a], &frames[1], &frames[0], crossing, deepest[1].depth, (shares[1], -1.0)),
    ];
    if !(sides[0].is_bowl && sides[1].is_bowl) {
        return false;
    }
    let start = nodes.blocks().len();
    let taken = dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || in_lanes(simd, &sides, order, nodes)
    ));
    if !taken {
        nodes.truncate(start);
    }
    taken
}

#[inline(always)]
fn in_lanes<S: Simd>(simd: S, sides: &[Side; 2], order: Order, nodes: &mut Nodes) -> bool {
    let sets = if order.many_rays { &RAYS[..] } else { &RAYS[..1] };
    let part = 0.5 * TURN / (WIDTH * sets.len()) as f64;
    for [cos, sin] in sets {
        let (cos, sin) = (Eight::load_array_ref(simd, cos), Eight::load_array_ref(simd, sin));
        let [first, second] = sides;
        let ends = [first.ray(cos, sin), second.ray(cos, sin)];
        let edges = [first.edges(simd, ends[0], order), second.edges(simd, ends[1], order)];
        let [Some(edge_first), Some(edge_second)] = edges else { return false };
        for &(node, gauss) in order.radial.nodes() {
            // The rule is for [-1, 1]; t^2 runs over [0, edge^2].
            let square = 0.5 * (1.0 + node);
            let weight = 0.5 * gauss * part;
            let good = [
                first.node(simd, ends[0], edge_first, square, weight, nodes),
                second.node(simd, ends[1], edge_second, square, weight, nodes),
            ];
            if good != [true; 2] {
                return false;
            }
        }
    }
    true
}

/// The directions at the point of a ring's centreline under a patch.
struct Frame {
    radial: Vec3,
    tangent: Vec3,
    /// Cosine and sine of the wire's angle at the deepest point.
    cos: f64,
    sin: f64,
}

impl Frame {
    fn new((circle, _): Ring, deepest: &Deepest) -> Frame {
        let (x, y) = deepest.place;
        let radial = circle.u * x + circle.w * y;
        Frame {
            radial,
            tangent: circle.w * x - circle.u * y,
            cos: deepest.outward.dot(&radial),
            sin: deepest.outward.dot(&circle.normal),
        }
    }
}

/// A patch of one ring's surface in the other.
struct Side {
    /// Whether the depth falls to all sides; if not, nothing else here is a number to use.
    is_bowl: bool,
    major: f64,
    minor: f64,
    other_major: f64,
    other_minor: f64,
    /// Radial direction, tangent and axis at the centreline's point.
    axes: [Vec3; 3],
    cos: f64,
    sin: f64,
    /// Distance of the deepest point from the ring's axis (m).
    rho: f64,
    other_centre: Vec3,
    other_normal: Vec3,
    /// The centreline's point from the other's centre (m).
    from_other: Vec3,
    /// Heights over the other's plane: of the centreline's point, and of the three directions.
    heights: [f64; 4],
    /// Twice the three directions' components of the point from the other's centre (m), and its square.
    leans: [f64; 4],
    depth: f64,
    /// The paraboloid: see [`super::polar`].
    map: [f64; 3],
    /// Area of a unit of its coordinates, times the ring's share.
    area: f64,
    /// Sign of the normals.
    sign: f64,
}

impl Side {
    #[inline(always)]
    fn new(
        [(circle, minor), (other, other_minor)]: [Ring; 2],
        own: &Frame,
        opposite: &Frame,
        crossing: f64,
        depth: f64,
        (share, sign): (f64, f64),
    ) -> Side {
        let rho = circle.radius + minor * own.cos;
        // Bendings of both surfaces. The other's depth has its level surface that far from its centreline.
        let distance = other_minor - depth;
        let around = 1.0 / distance;
        let round = opposite.cos / (other.radius + distance * opposite.cos);
        let across = (circle.normal * own.cos - own.radial * own.sin).dot(&opposite.tangent);
        let bend = round - around;
        let xx = around + bend * crossing * crossing + own.cos / rho;
        let yy = around + bend * across * across + 1.0 / minor;
        let xy = bend * crossing * across;
        // Cholesky's factor; its inverse transpose maps the disc to the patch.
        let determinant = xx * yy - xy * xy;
        let is_bowl = xx > 0.0 && determinant > 1e-9 * xx * yy && depth > 0.0;
        let inverse = 1.0 / xx;
        let (a, b) = ((2.0 * depth * inverse).sqrt(), (2.0 * depth * xx / determinant).sqrt());
        let axes = [own.radial, own.tangent, circle.normal];
        let from_other = circle.centre - other.centre + own.radial * circle.radius;
        let n = &other.normal;
        let (height, lean) = (|axis: &Vec3| axis.dot(n), |axis: &Vec3| 2.0 * axis.dot(&from_other));
        Side {
            is_bowl,
            major: circle.radius,
            minor,
            other_major: other.radius,
            other_minor,
            cos: own.cos,
            sin: own.sin,
            rho,
            other_centre: other.centre,
            other_normal: *n,
            heights: [height(&from_other), height(&axes[0]), height(&axes[1]), height(&axes[2])],
            leans: [from_other.norm_squared(), lean(&axes[0]), lean(&axes[1]), lean(&axes[2])],
            from_other,
            axes,
            depth,
            map: [a, -(xy * inverse) * b, b],
            area: a * b * share,
            sign,
        }
    }

    /// Ends of the rays at `t = 1`: half of the two coordinates over their radii.
    #[inline(always)]
    fn ray<S: Simd>(&self, cos: Eight<S>, sin: Eight<S>) -> [Eight<S>; 2] {
        let (half_x, half_y) = (0.5 / self.rho, 0.5 / self.minor);
        [cos * (self.map[0] * half_x) + sin * (self.map[1] * half_x), sin * (self.map[2] * half_y)]
    }

    /// `t` at the edge on each ray; None where one is too near or far.
    #[inline(always)]
    fn edges<S: Simd>(&self, simd: S, [x, y]: [Eight<S>; 2], order: Order) -> Option<Eight<S>> {
        let depth = self.at(simd, x, y).depth;
        let (low, high) = depth.split();
        let opposite = high.combine(low);
        let inverse = 0.5 / self.depth;
        let (cubic, quartic) = ((opposite - depth) * inverse, (opposite + depth) * -inverse);
        // As `polar::edge_at`.
        let one = Eight::splat(simd, 1.0);
        let mut t = one;
        for _ in 0..EDGE_STEPS {
            let value = one - t * t * (one + t * (cubic + t * quartic));
            let slope = t * (t * (cubic * 3.0 + t * (quartic * 4.0)) + 2.0);
            t += value / slope;
        }
        if order.many_rays {
            // The depth's slope in `t^2` is that of a paraboloid, nearly.
            let depth = self.at(simd, x * t, y * t).depth;
            let square = t * t;
            t = (square + square * depth * (1.0 / self.depth)).sqrt();
        }
        let square = t * t;
        let (least, most) = (Eight::splat(simd, EDGE.0), Eight::splat(simd, EDGE.1));
        (square.simd_gt(least) & square.simd_lt(most)).all_true().then_some(t)
    }

    /// Adds the points at a share of `t^2` on each ray; false where one of them is not as deep as in a bowl.
    #[inline(always)]
    fn node<S: Simd>(
        &self,
        simd: S,
        [x, y]: [Eight<S>; 2],
        edge: Eight<S>,
        square: f64,
        weight: f64,
        nodes: &mut Nodes,
    ) -> bool {
        let t = edge * square.sqrt();
        let at = self.at(simd, x * t, y * t);
        let area = edge * edge * at.area * (weight * self.area);
        // Normals: from the other's centreline.
        let unit = Eight::splat(simd, self.sign) / (at.rho * at.distance);
        let (along, lift) = (at.outward * unit, at.height * unit * self.other_major);
        let block = nodes.next_block();
        for axis in 0..3 {
            let [radial, tangent, up] = [0, 1, 2].map(
                #[inline(always)]
                |i: usize| self.axes[i][axis],
            );
            let d = at.place[0] * radial + at.place[1] * tangent + at.place[2] * up + self.from_other[axis];
            (d + self.other_centre[axis]).store_array(&mut block.point[axis]);
            (d * along + lift * self.other_normal[axis]).store_array(&mut block.normal[axis]);
        }
        at.depth.store_array(&mut block.depth);
        area.store_array(&mut block.area);
        at.depth.simd_gt(Eight::splat(simd, HOLLOW * (1.0 - square) * self.depth)).all_true()
    }

    /// The points of the surface at half the coordinates over their radii.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, s: Eight<S>, t: Eight<S>) -> At<S> {
        let one = Eight::splat(simd, 1.0);
        let (s_square, t_square) = (s * s, t * t);
        let (s_1, t_1) = (one + s_square, one + t_square);
        // One division for both: both angles are given by the tangents of their halves.
        let area = one / (s_1 * t_1);
        let (s_1, t_1) = (area * t_1, area * s_1);
        let (wire_cos, wire_sin) = ((one - t_square) * t_1, (t + t) * t_1);
        let away = (wire_cos * self.cos - wire_sin * self.sin) * self.minor;
        let up = (wire_cos * self.sin + wire_sin * self.cos) * self.minor;
        let out = away + self.major;
        let radial = away - (s_square + s_square) * s_1 * out;
        let aside = (s + s) * s_1 * out;
        let [h, h_radial, h_tangent, h_up] = self.heights;
        let height = radial * h_radial + aside * h_tangent + up * h_up + h;
        let [q, q_radial, q_tangent, q_up] = self.leans;
        let square = (radial * radial + aside * aside + up * up)
            + (radial * q_radial + aside * q_tangent + up * q_up)
            + q;
        let height_square = height * height;
        let rho = (square - height_square).sqrt();
        let outward = rho - self.other_major;
        let distance = (outward * outward + height_square).sqrt();
        At {
            place: [radial, aside, up],
            area: out * area * (1.0 / self.rho),
            height,
            rho,
            outward,
            distance,
            depth: Eight::splat(simd, self.other_minor) - distance,
        }
    }
}

/// Points of the surface.
struct At<S: Simd> {
    /// From the centreline's point, along the three axes (m).
    place: [Eight<S>; 3],
    /// Area for each unit of coordinate area.
    area: Eight<S>,
    /// Height over the other's plane, distance from its axis, that less its radius, and distance from its centreline (m).
    height: Eight<S>,
    rho: Eight<S>,
    outward: Eight<S>,
    distance: Eight<S>,
    /// Depth in the other (m).
    depth: Eight<S>,
}

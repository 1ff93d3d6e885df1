//! Patches that are star-shaped about their deepest point: rays out to the edge, Gauss points on each.
//!
//! About its deepest point the depth falls like `delta (1 - t^2)` in coordinates scaled by the two bendings of the
//! surfaces, so the patch is nearly the unit disc, however long and narrow it is. On each ray the edge is found from
//! two values of the depth by interpolation in `t^2`; an error `e` of the edge costs only `e^2`, since the depth is 0
//! there. The area element is `t dt = d(t^2) / 2`, so Gauss points in `t^2` are taken: with an even number of rays, odd
//! powers of `t` cancel and a rule of `n` points is exact to the power `4 n - 2`.
//!
//! # Accuracy
//! See [`Order::for_patch`].

use super::chart::{Chart, SurfacePoint};
use super::{Block, Lane, Nodes, Solid, WIDTH};
use crate::lanes::{Level, Simd, dispatch};
use crate::{GaussRule, Vec3};

const H: f64 = core::f64::consts::FRAC_1_SQRT_2;
pub(super) const TURN: f64 = 2.0 * core::f64::consts::PI;

/// Directions of eight rays, and of the eight between them.
pub(super) const RAYS: [[Lane; 2]; 2] = [
    [[1.0, H, 0.0, -H, -1.0, -H, 0.0, H], [0.0, H, 1.0, H, 0.0, -H, -1.0, -H]],
    [[C, S, -S, -C, -C, -S, S, C], [S, C, C, S, -S, -C, -C, -S]],
];
/// Cosine and sine of an eighth of a half turn.
const C: f64 = 0.923_879_532_511_286_7;
const S: f64 = 0.382_683_432_365_089_8;

/// A ray's edge may lie this much nearer or farther than the bendings say, in `t^2`; beyond, the patch is not taken.
pub(super) const EDGE: (f64, f64) = (0.25, 4.0);

/// The patch is not taken if the depth at a point is less than this part of what a paraboloid has.
pub(super) const HOLLOW: f64 = 0.25;

/// How many rays and how many points on each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Order {
    /// Points on each ray.
    pub radial: GaussRule,
    /// 8 or, if true, 16 rays.
    pub many_rays: bool,
}

impl Order {
    /// The order for a patch of a depth between wires of which the thinner has a radius.
    pub fn for_patch(depth: f64, minor_radius: f64) -> Order {
        let share = depth / minor_radius;
        if share < 0.03 {
            Order { radial: GaussRule::Two, many_rays: false }
        } else if share < 0.2 {
            Order { radial: GaussRule::Three, many_rays: false }
        } else {
            Order { radial: GaussRule::Six, many_rays: true }
        }
    }
}

/// The deepest point of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deepest {
    /// For a ring's surface: cosine and sine of the angle on its centreline.
    pub place: (f64, f64),
    /// Outward unit normal of the surface.
    pub outward: Vec3,
    /// Depth (m); positive.
    pub depth: f64,
}

/// Adds the points of the patch of `surface` in `solid` about its deepest point, each with its area times `share`.
/// Returns false, and adds nothing, where the patch is not star-shaped about it as far as can be seen: two opposite
/// rays or points disagree with a bowl, or the surfaces bend alike so that the depth is flat.
#[must_use]
pub fn patch(
    surface: &Solid,
    solid: &Solid,
    deepest: &Deepest,
    order: Order,
    share: f64,
    nodes: &mut Nodes,
) -> bool {
    // Plain loops over eight lanes, compiled for what the processor has: the same bits on each.
    dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || in_lanes(surface, solid, deepest, order, share, nodes)
    ))
}

#[inline(always)]
fn in_lanes(
    surface: &Solid,
    solid: &Solid,
    deepest: &Deepest,
    order: Order,
    share: f64,
    nodes: &mut Nodes,
) -> bool {
    let Some(chart) = Chart::about(surface, deepest.place, &deepest.outward) else { return false };
    let Some(bowl) = Bowl::new(&chart, solid, deepest.depth) else { return false };
    let first = nodes.blocks().len();
    let sets = if order.many_rays { &RAYS[..] } else { &RAYS[..1] };
    let weight = share * bowl.area * (0.5 * TURN / (WIDTH * sets.len()) as f64);
    for [cos, sin] in sets {
        let (mut x, mut y) = ([0.0; WIDTH], [0.0; WIDTH]);
        for i in 0..WIDTH {
            x[i] = bowl.map[0] * cos[i] + bowl.map[1] * sin[i];
            y[i] = bowl.map[2] * sin[i];
        }
        let edge = bowl.edges(&chart, solid, &x, &y, order.many_rays);
        if !edge.iter().all(|edge| *edge > EDGE.0 && *edge < EDGE.1) {
            nodes.truncate(first);
            return false;
        }
        for &(node, gauss) in order.radial.nodes() {
            // The rule is for [-1, 1]; t^2 runs over [0, edge].
            let square = 0.5 * (1.0 + node);
            let (mut x_t, mut y_t) = ([0.0; WIDTH], [0.0; WIDTH]);
            for i in 0..WIDTH {
                let t = (edge[i] * square).sqrt();
                x_t[i] = x[i] * t;
                y_t[i] = y[i] * t;
            }
            let (point, factor) = chart.points(&x_t, &y_t);
            let (depth, normal) = solid.depths(&point);
            let mut area = [0.0; WIDTH];
            for i in 0..WIDTH {
                area[i] = weight * (0.5 * gauss) * edge[i] * factor[i];
            }
            if !depth.iter().all(|depth| *depth > HOLLOW * (1.0 - square) * bowl.depth) {
                nodes.truncate(first);
                return false;
            }
            nodes.push_block(Block { point, normal, depth, area });
        }
    }
    true
}

/// A box round a patch, in coordinates in which the patch is nearly the unit disc.
#[derive(Debug, Clone, Copy)]
pub struct PatchBox {
    chart: Chart,
    map: [f64; 3],
    /// Half its side.
    half: f64,
    /// Area for each unit of area of the unit square and of the chart's area element (m^2).
    area: f64,
}

impl PatchBox {
    /// The box round the patch of `surface` in `solid`: half a tenth wider than the longest of eight rays to its edge.
    /// None where [`patch`] would take none.
    pub fn around(surface: &Solid, solid: &Solid, deepest: &Deepest) -> Option<PatchBox> {
        const MARGIN: f64 = 1.05;
        let chart = Chart::about(surface, deepest.place, &deepest.outward)?;
        let bowl = Bowl::new(&chart, solid, deepest.depth)?;
        let [cos, sin] = &RAYS[0];
        let (mut x, mut y) = ([0.0; WIDTH], [0.0; WIDTH]);
        for i in 0..WIDTH {
            x[i] = bowl.map[0] * cos[i] + bowl.map[1] * sin[i];
            y[i] = bowl.map[2] * sin[i];
        }
        let edge = bowl.edges(&chart, solid, &x, &y, true);
        if !edge.iter().all(|edge| *edge > EDGE.0 && *edge < EDGE.1) {
            return None;
        }
        let longest = edge.iter().fold(0.0, |longest, &edge| if edge > longest { edge } else { longest });
        let half = MARGIN * longest.sqrt();
        Some(PatchBox { chart, map: bowl.map, half, area: 4.0 * half * half * bowl.area })
    }

    /// The surface's point for a point of the unit square, and the area for each unit of the square's (m^2).
    #[inline]
    pub fn point(&self, (first, second): (f64, f64)) -> SurfacePoint {
        let (u, v) = (self.half * (2.0 * first - 1.0), self.half * (2.0 * second - 1.0));
        let (x, y) = (self.map[0] * u + self.map[1] * v, self.map[2] * v);
        let (point, factor) = self.chart.points(&[x], &[y]);
        SurfacePoint { point: Vec3::new(point[0][0], point[1][0], point[2][0]), area: self.area * factor[0] }
    }
}

/// The paraboloid that the depth is near: `depth (1 - t^2)` with `x = t (map[0] cos + map[1] sin)`, `y = t map[2] sin`.
struct Bowl {
    depth: f64,
    map: [f64; 3],
    /// Coordinate area of `t < 1` over pi.
    area: f64,
}

impl Bowl {
    /// None where the depth does not fall to all sides.
    fn new(chart: &Chart, solid: &Solid, depth: f64) -> Option<Bowl> {
        let [xx, xy, yy] = solid.bending(&chart.foot, &chart.x, &chart.y);
        let (xx, yy) = (xx + chart.curvature[0], yy + chart.curvature[1]);
        // Cholesky's factor of the bendings; its inverse transpose maps the disc to the patch.
        let determinant = xx * yy - xy * xy;
        if !(xx > 0.0 && determinant > 1e-9 * xx * yy && depth > 0.0) {
            return None;
        }
        let first = xx.sqrt();
        let second = (determinant / xx).sqrt();
        let scale = (2.0 * depth).sqrt();
        let (a, b) = (scale / first, scale / second);
        Some(Bowl { depth, map: [a, -(xy / xx) * b, b], area: a * b })
    }

    /// `t^2` at the edge on each ray: where the polynomial through the depths at both ends of a diameter, `t = 1`, has its
    /// root. `again`: once more with the depth there, for deep patches, which the polynomial leaves off by more.
    #[inline(always)]
    fn edges(&self, chart: &Chart, solid: &Solid, x: &Lane, y: &Lane, again: bool) -> Lane {
        let (points, _) = chart.points(x, y);
        let depth = solid.depths_only(&points);
        let inverse = 0.5 / self.depth;
        let mut edge = [0.0; WIDTH];
        for i in 0..WIDTH {
            let opposite = depth[(i + WIDTH / 2) % WIDTH];
            let t = edge_at((opposite - depth[i]) * inverse, -(opposite + depth[i]) * inverse);
            edge[i] = t * t;
        }
        if again {
            let (mut x_1, mut y_1) = ([0.0; WIDTH], [0.0; WIDTH]);
            for i in 0..WIDTH {
                let t = edge[i].sqrt();
                x_1[i] = x[i] * t;
                y_1[i] = y[i] * t;
            }
            let (points, _) = chart.points(&x_1, &y_1);
            let depth = solid.depths_only(&points);
            for i in 0..WIDTH {
                edge[i] += edge[i] * depth[i] / self.depth;
            }
        }
        edge
    }
}

/// Steps of Newton's method to an edge: with two, one stretched patch of 15 % of a wire was off by a tenth.
pub(super) const EDGE_STEPS: u32 = 3;

/// Where `1 - t^2 - cubic t^3 - quartic t^4` has its root: Newton's method from `t = 1`. Not a number, or far away, if it
/// has none there.
#[inline(always)]
pub(super) fn edge_at(cubic: f64, quartic: f64) -> f64 {
    let mut t = 1.0;
    for _ in 0..EDGE_STEPS {
        let value = 1.0 - t * t * (1.0 + t * (cubic + t * quartic));
        let slope = t * (2.0 + t * (3.0 * cubic + t * (4.0 * quartic)));
        t += value / slope;
    }
    t
}

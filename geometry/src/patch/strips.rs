//! Long patches between two rings, with one deepest point or two: cross-sections of the wire, eight side by side.
//!
//! The cross-sections of [`slices`](super::slices), without a proof for each: over a cross-section of the wire a shallow depth
//! is nearly a parabola in the wire's angle, so its peak is found from slope and bending, and its two edges like those of
//! `polar`. Along the wire the patch ends where the peak is 0, found by Newton's method from the ends of the
//! contact arc, which lie outside; where the peak is concave, so is every step. What a cross-section
//! brings falls with the power 3/2 of the distance from an end, so from each end to a cut between the deepest points
//! Gauss points are taken in the square root of that distance, in which the integrand is smooth.
//!
//! # Accuracy
//! `tests/oracles/strips.rs` has it: 5e-6 of force and torque in the median and 4e-5 at most for patches of 5 % of a wire.

use super::polar::edge_at;
use super::{Block, Nodes, Solid, WIDTH};
use crate::arc::Arc;
use crate::lanes::{Level, Simd, dispatch};
use crate::{Circle, GaussRule, Vec3};

/// Steps of Newton's method for the two ends. The arc's ends are off by a tenth of its length at most for wires of any kind,
/// and each step squares the share.
const END_STEPS: u32 = 3;

/// The peak of the cross-section at an end, as a share of the largest: the force changes by the power 5/2 of it.
const END_DEPTH: f64 = 1e-3;

/// An edge may lie this much nearer or farther than slope and bending say, in units of half the cross-section's width.
const EDGE: (f64, f64) = (0.5, 2.0);

/// A ring's surface that is looked at, and the ring that it is in.
struct Strips<'a> {
    circle: &'a Circle,
    minor: f64,
    other: &'a Circle,
    other_minor: f64,
    /// Directions at the middle of the arc: from the centre, and along the circle.
    radial: Vec3,
    tangent: Vec3,
}

/// Places along the circle.
struct Places<const N: usize> {
    radial: [[f64; N]; 3],
    tangent: [[f64; N]; 3],
    /// Angle for each unit of `tau`.
    speed: [f64; N],
    /// Directions within the cross-sections, to the outside and up.
    out: [f64; N],
    up: [f64; N],
}

/// What is known about the depth at one angle of each cross-section: itself, its slope and its bending by the wire's
/// angle (downwards), and its slope by the angle along the circle.
struct Depths<const N: usize> {
    value: [f64; N],
    slope: [f64; N],
    bending: [f64; N],
    along: [f64; N],
}

/// Adds the points of the part of `surface` in `solid` along an arc of its centreline with the contact's deepest points at
/// `deepest` (cosine and sine on the centreline; twice the same for one), each with its area times `share`.
/// `depth` is the largest depth. Returns false, and adds nothing, where the patch is not one strip between two ends as
/// far as can be seen.
#[must_use]
pub fn patch(
    surface: &Solid,
    solid: &Solid,
    arc: &Arc,
    deepest: [(f64, f64); 2],
    depth: f64,
    share: f64,
    nodes: &mut Nodes,
) -> bool {
    let (
        Solid::Ring { circle, minor_radius: minor },
        Solid::Ring { circle: other, minor_radius: other_minor },
    ) = (surface, solid)
    else {
        return false;
    };
    let (cos, sin) = (arc.mid_cos, arc.mid_sin);
    let strips = Strips {
        circle,
        minor: *minor,
        other,
        other_minor: *other_minor,
        radial: circle.u * cos + circle.w * sin,
        tangent: circle.w * cos - circle.u * sin,
    };
    let places = deepest.map(|(x, y)| (y * cos - x * sin) / (1.0 + (x * cos + y * sin)));
    // Plain loops over eight lanes, compiled for what the processor has: the same bits on each.
    dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || strips.in_lanes(arc.half_tangent, places, depth, solid, share, nodes)
    ))
}

impl Strips<'_> {
    #[inline(always)]
    fn in_lanes(
        &self,
        half: f64,
        [first, last]: [f64; 2],
        depth: f64,
        solid: &Solid,
        share: f64,
        nodes: &mut Nodes,
    ) -> bool {
        let (first, last) = if first < last { (first, last) } else { (last, first) };
        if !(-half < first && last < half) {
            return false;
        }
        let Some([begin, end]) = self.ends(half, depth) else { return false };
        if !(begin < first && last < end) {
            return false;
        }
        let rule = match depth / self.minor {
            shallow if shallow < 0.1 => GaussRule::Four,
            middling if middling < 0.2 => GaussRule::Six,
            _ => GaussRule::Eight,
        };
        let cut = 0.5 * (first + last);
        let start = nodes.blocks().len();
        for from in [begin, end] {
            if !self.half(from, cut, rule, solid, share, nodes) {
                nodes.truncate(start);
                return false;
            }
        }
        true
    }

    /// Where the patch ends, as `tan(t / 2)` from the middle of the arc.
    #[inline(always)]
    fn ends(&self, half: f64, depth: f64) -> Option<[f64; 2]> {
        let mut tau = [-half, half];
        let mut places = self.places(&tau);
        let mut depths = self.peaks(&mut places);
        for _ in 0..END_STEPS {
            for (i, tau) in tau.iter_mut().enumerate() {
                *tau -= depths.value[i] / (depths.along[i] * places.speed[i]);
            }
            // The direction is kept: it turns but little.
            let (out, up) = (places.out, places.up);
            places = self.frames(&tau);
            (places.out, places.up) = (out, up);
            depths = self.peak(&mut places);
        }
        let small = END_DEPTH * depth;
        // The peak rises from the first end and falls to the last. Not a number: no end.
        let good = depths.along[0] > 0.0 && depths.along[1] < 0.0;
        (good && depths.value.iter().all(|peak| peak.abs() < small)).then_some(tau)
    }

    /// The points from an end to the cut.
    #[inline(always)]
    fn half(
        &self,
        from: f64,
        cut: f64,
        rule: GaussRule,
        solid: &Solid,
        share: f64,
        nodes: &mut Nodes,
    ) -> bool {
        let length = cut - from;
        let (mut tau, mut width) = ([0.0; WIDTH], [0.0; WIDTH]);
        for (i, &(node, weight)) in GaussRule::Eight.nodes().iter().enumerate() {
            let root = 0.5 * (1.0 + node);
            tau[i] = from + length * root * root;
            width[i] = (length * root * weight).abs();
        }
        let mut places = self.places(&tau);
        let peaks = self.peaks(&mut places);
        let mut scale = [0.0; WIDTH];
        for i in 0..WIDTH {
            // An empty cross-section has width 0.
            let peak = if peaks.value[i] > 0.0 { peaks.value[i] } else { 0.0 };
            scale[i] = 0.5 * (2.0 * peak / peaks.bending[i]).sqrt();
            width[i] *= places.speed[i] * share * self.minor;
        }
        let mut back = [0.0; WIDTH];
        for i in 0..WIDTH {
            back[i] = -scale[i];
        }
        let (forth, _) = self.points(&places, &scale);
        let (back, _) = self.points(&places, &back);
        let (forth, back) = (solid.depths_only(&forth), solid.depths_only(&back));
        let (mut middle, mut reach) = ([0.0; WIDTH], [0.0; WIDTH]);
        for i in 0..WIDTH {
            let empty = !(scale[i] > 0.0);
            let inverse = if empty { 0.0 } else { 0.5 / peaks.value[i] };
            let (cubic, quartic) = ((back[i] - forth[i]) * inverse, -(back[i] + forth[i]) * inverse);
            let (after, before) = (edge_at(cubic, quartic), edge_at(-cubic, quartic));
            middle[i] = 0.5 * (after - before);
            reach[i] = 0.5 * (after + before);
        }
        let bowl = |i: usize| {
            let (low, high) = (reach[i] - middle[i].abs(), reach[i] + middle[i].abs());
            low > EDGE.0 && high < EDGE.1 && peaks.bending[i] > 0.0
        };
        if !(0..WIDTH).all(bowl) {
            return false;
        }
        for &(node, gauss) in rule.nodes() {
            let mut sigma = [0.0; WIDTH];
            for i in 0..WIDTH {
                sigma[i] = scale[i] * (middle[i] + reach[i] * node);
            }
            let (point, out) = self.points(&places, &sigma);
            let (depth, normal) = solid.depths(&point);
            let mut area = [0.0; WIDTH];
            for i in 0..WIDTH {
                let turn = 2.0 * scale[i] * reach[i] * gauss / (1.0 + sigma[i] * sigma[i]);
                let inside = if depth[i] > 0.0 { turn } else { 0.0 };
                area[i] = inside * width[i] * (self.circle.radius + self.minor * out[i]);
            }
            nodes.push_block(Block { point, normal, depth, area });
        }
        true
    }

    /// Places along the circle, without a direction.
    #[inline(always)]
    fn frames<const N: usize>(&self, tau: &[f64; N]) -> Places<N> {
        let mut places = Places {
            radial: [[0.0; N]; 3],
            tangent: [[0.0; N]; 3],
            speed: [0.0; N],
            out: [0.0; N],
            up: [0.0; N],
        };
        for (i, &tau) in tau.iter().enumerate() {
            let inverse = 1.0 / (1.0 + tau * tau);
            let (cos, sin) = ((1.0 - tau * tau) * inverse, 2.0 * tau * inverse);
            places.speed[i] = 2.0 * inverse;
            for a in 0..3 {
                places.radial[a][i] = self.radial[a] * cos + self.tangent[a] * sin;
                places.tangent[a][i] = self.tangent[a] * cos - self.radial[a] * sin;
            }
        }
        places
    }

    /// Places along the circle, with the direction towards the other circle.
    #[inline(always)]
    fn places<const N: usize>(&self, tau: &[f64; N]) -> Places<N> {
        let mut places = self.frames(tau);
        let (c, n, other) = (self.circle.centre - self.other.centre, self.other.normal, self.other.radius);
        let axis = self.circle.normal;
        for i in 0..N {
            let radial = [places.radial[0][i], places.radial[1][i], places.radial[2][i]];
            let mut d = [0.0; 3];
            for a in 0..3 {
                d[a] = c[a] + radial[a] * self.circle.radius;
            }
            let height = d[0] * n.x + d[1] * n.y + d[2] * n.z;
            let across = [d[0] - height * n.x, d[1] - height * n.y, d[2] - height * n.z];
            let inward = other / dot(&across, &across).sqrt() - 1.0;
            let mut to = [0.0; 3];
            for a in 0..3 {
                to[a] = across[a] * inward - height * n[a];
            }
            let (out, up) = (dot(&to, &radial), dot(&to, &[axis.x, axis.y, axis.z]));
            let inverse = 1.0 / (out * out + up * up).sqrt();
            places.out[i] = out * inverse;
            places.up[i] = up * inverse;
        }
        places
    }

    /// Turns the directions of the places to where the depth peaks, in two steps, and gives the depth there.
    #[inline(always)]
    fn peaks<const N: usize>(&self, places: &mut Places<N>) -> Depths<N> {
        let depths = self.depths(places);
        places.turn(&depths);
        self.peak(places)
    }

    /// Turns directions close to where the depth peaks to there, and gives the depth by its parabola.
    #[inline(always)]
    fn peak<const N: usize>(&self, places: &mut Places<N>) -> Depths<N> {
        let mut depths = self.depths(places);
        places.turn(&depths);
        for i in 0..N {
            depths.value[i] += 0.5 * depths.slope[i] * depths.slope[i] / depths.bending[i];
        }
        depths
    }

    /// The depth in the directions of the places.
    #[inline(always)]
    fn depths<const N: usize>(&self, places: &Places<N>) -> Depths<N> {
        let mut depths = Depths { value: [0.0; N], slope: [0.0; N], bending: [0.0; N], along: [0.0; N] };
        let (c, n, other) = (self.circle.centre - self.other.centre, self.other.normal, self.other.radius);
        let (axis, minor) = (self.circle.normal, self.minor);
        for i in 0..N {
            let (out, up) = (places.out[i], places.up[i]);
            let rho_own = self.circle.radius + minor * out;
            let (mut d, mut outward, mut turning) = ([0.0; 3], [0.0; 3], [0.0; 3]);
            for a in 0..3 {
                outward[a] = places.radial[a][i] * out + axis[a] * up;
                turning[a] = axis[a] * out - places.radial[a][i] * up;
                d[a] = c[a] + (places.radial[a][i] * rho_own + axis[a] * (minor * up));
            }
            let normal = [n.x, n.y, n.z];
            let tangent = [places.tangent[0][i], places.tangent[1][i], places.tangent[2][i]];
            let height = dot(&d, &normal);
            let across = [d[0] - height * n.x, d[1] - height * n.y, d[2] - height * n.z];
            let rho = dot(&across, &across).sqrt();
            let outside = rho - other;
            let distance = (outside * outside + height * height).sqrt();
            let (inverse_rho, inverse) = (1.0 / rho, 1.0 / distance);
            // Components of the wire's direction: from the other's axis, along that axis, and out of the other's wire.
            let from_axis = dot(&turning, &across) * inverse_rho;
            let up_axis = dot(&turning, &normal);
            let away = (outside * from_axis + height * up_axis) * inverse;
            let around = from_axis * from_axis + up_axis * up_axis;
            let meridian = around - away * away;
            let facing = (outside * (dot(&outward, &across) * inverse_rho) + height * dot(&outward, &normal))
                * inverse;
            let leaving = (outside * (dot(&tangent, &across) * inverse_rho)
                + height * dot(&tangent, &normal))
                * inverse;
            depths.value[i] = self.other_minor - distance;
            depths.slope[i] = -minor * away;
            depths.bending[i] =
                minor * (minor * (meridian + outside * (1.0 - around) * inverse_rho) * inverse - facing);
            depths.along[i] = -rho_own * leaving;
        }
        depths
    }

    /// The points of the cross-sections at `tan(turn / 2)` from the directions of the places, and the part of their
    /// directions that points away from the axis.
    #[inline(always)]
    fn points<const N: usize>(&self, places: &Places<N>, sigma: &[f64; N]) -> ([[f64; N]; 3], [f64; N]) {
        let (mut point, mut outs) = ([[0.0; N]; 3], [0.0; N]);
        let axis = self.circle.normal;
        for i in 0..N {
            let inverse = 1.0 / (1.0 + sigma[i] * sigma[i]);
            let (cos, sin) = ((1.0 - sigma[i] * sigma[i]) * inverse, 2.0 * sigma[i] * inverse);
            let out = places.out[i] * cos - places.up[i] * sin;
            let up = places.up[i] * cos + places.out[i] * sin;
            let rho = self.circle.radius + self.minor * out;
            for a in 0..3 {
                point[a][i] =
                    self.circle.centre[a] + (places.radial[a][i] * rho + axis[a] * (self.minor * up));
            }
            outs[i] = out;
        }
        (point, outs)
    }
}

/// The product of two vectors. Written out, so that it is compiled with its caller for what the processor has.
#[inline(always)]
fn dot(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

impl<const N: usize> Places<N> {
    /// Turns each direction by Newton's step to where the depth peaks.
    #[inline(always)]
    fn turn(&mut self, depths: &Depths<N>) {
        for i in 0..N {
            let half = 0.5 * depths.slope[i] / depths.bending[i];
            let inverse = 1.0 / (1.0 + half * half);
            let (cos, sin) = ((1.0 - half * half) * inverse, 2.0 * half * inverse);
            let (out, up) = (self.out[i], self.up[i]);
            self.out[i] = out * cos - up * sin;
            self.up[i] = up * cos + out * sin;
        }
    }
}

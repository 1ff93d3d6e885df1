//! The law of the module's page for many pairs of rings: arcs and forces, sixteen side by side.
//!
//! The one thing to know: the same law, the same quadrature and the same arcs as the scalar code, in the common
//! frame of each pair ([`geometry::lanes`]), where B's closest point needs two coordinates only. What is not
//! common is handed back for the scalar code. Each arc's result depends on its pair alone, and has its own
//! place, so neither the instruction set nor the grouping shows in a bit.
//!
//! # In the frame
//! A point of A at `(P1, P2, Z)` along `(e2, g, n_B)` from B's centre is at `rho = sqrt(P1^2 + P2^2)` from B's
//! axis and at `D = sqrt((rho - R_B)^2 + Z^2)` from B's centreline; with `u = rho - R_B` the normal is
//! `(P1 u / rho, P2 u / rho, Z) / D` and the torque of a unit push about B's centre is
//! `R_B Z / (rho D) (P2, -P1, 0)`. Where both centrelines cross (`D = 0`) there is no direction and no force.

use super::material::NormalLaw;
use super::{Contact, direction};
use crate::wrench::Velocity;
use geometry::arc::RULES;
use geometry::each_lane;
use geometry::lanes::{
    ArcSearch, Frames, LANES, LaneArc, Lanes, Line, PairLanes, Row, Simd, Vectors, columns, larger, rows_of,
};
use geometry::lanes::{Level, SimdBase, dispatch};
use geometry::{Circle, GaussRule};

/// Below this a product of lengths is taken for 0 (m^2).
const TINY: f64 = 1e-300;

/// A body's velocities as the lanes read them.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct MotionLine {
    /// Linear velocity (m/s), and the body's mobility (1/kg).
    pub linear: [f64; 4],
    /// Angular velocity (rad/s).
    pub angular: [f64; 4],
}

impl MotionLine {
    #[inline(always)]
    pub(crate) fn take(&mut self, velocity: &Velocity) {
        let (v, w) = (&velocity.linear, &velocity.angular);
        [self.linear[0], self.linear[1], self.linear[2]] = [v.x, v.y, v.z];
        [self.angular[0], self.angular[1], self.angular[2]] = [w.x, w.y, w.z];
    }
}

/// What all chunks read.
#[derive(Clone, Copy)]
pub(crate) struct RingScene<'a> {
    pub lines: &'a [Line],
    /// Not read without damping.
    pub motions: &'a [MotionLine],
    /// The material of each body.
    pub materials: &'a [u32],
    /// The laws of all pairs of materials, a square.
    pub laws: &'a [NormalLaw],
    /// Materials, the side of the square.
    pub material_count: usize,
    /// Half the time step, where damping is implicit; else 0.
    pub half_step: f64,
    /// Up to which distance wires are called close (m).
    pub close_margin: f64,
}

impl RingScene<'_> {
    #[inline(always)]
    fn law(&self, (a, b): (u32, u32)) -> &NormalLaw {
        let (a, b) = (self.materials[a as usize] as usize, self.materials[b as usize] as usize);
        &self.laws[a * self.material_count + b]
    }

    /// Stiffness, rate damping and viscous damping of pairs.
    #[inline(always)]
    fn law_lanes<S: Simd, const DAMPED: bool>(&self, simd: S, pairs: [(u32, u32); LANES]) -> [Lanes<S>; 3] {
        if let [law] = self.laws {
            let numbers = [law.stiffness, law.rate_damping, law.viscous_damping];
            return [
                Lanes::splat(simd, numbers[0]),
                Lanes::splat(simd, numbers[1]),
                Lanes::splat(simd, numbers[2]),
            ];
        }
        let laws: [&NormalLaw; LANES] = each_lane!(lane => self.law(pairs[lane]));
        let stiffness = Lanes::load_array(simd, each_lane!(lane => laws[lane].stiffness));
        if !DAMPED {
            return [stiffness, Lanes::splat(simd, 0.0), Lanes::splat(simd, 0.0)];
        }
        [
            stiffness,
            Lanes::load_array(simd, each_lane!(lane => laws[lane].rate_damping)),
            Lanes::load_array(simd, each_lane!(lane => laws[lane].viscous_damping)),
        ]
    }
}

/// What one contact arc does to both rings (N, N m, J, m), World axes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub(crate) struct ArcForce {
    /// Force on A; the energy in the springs.
    pub force: [f64; 4],
    /// Torque on A about its centre; the largest penetration.
    pub torque_a: [f64; 4],
    /// Torque on B about its centre; the sum of the pressure's magnitudes.
    pub torque_b: [f64; 4],
    /// Cosine and sine of the middle in the common frame and 1, each times the elastic force and summed.
    pub middle: [f64; 4],
    /// The part of the forces that is not elastic: force on A, torque on A, torque on B.
    pub lost: [[f64; 4]; 3],
    pub a: u32,
    pub b: u32,
}

impl ArcForce {
    /// Energy in the springs (J).
    pub(crate) fn energy(&self) -> f64 {
        self.force[3]
    }

    /// The contact as it is recorded: number `arc` of its pair.
    pub(crate) fn contact(&self, arc: u32, (a, b): (&Circle, &Circle)) -> Contact {
        let cross = a.normal.cross(&b.normal);
        let inverse = 1.0 / cross.norm_squared().sqrt();
        let e1 = (b.normal - a.normal * a.normal.dot(&b.normal)) * inverse;
        let [cos, sin, weight, _] = self.middle;
        let middle = e1 * cos + cross * (sin * inverse);
        let (mid_cos, mid_sin) = direction((middle.dot(&a.u), middle.dot(&a.w)), weight);
        Contact {
            arc,
            mid_cos,
            mid_sin,
            penetration: self.torque_a[3] + 0.0,
            normal_force: self.torque_b[3] + 0.0,
            spring: None,
        }
    }
}

/// The common pairs of one chunk.
#[derive(Debug, Default)]
pub(crate) struct RingChunk {
    pub search: ArcSearch,
    /// Numbers of the arcs for each of [`RULES`], and room.
    bins: [Vec<u32>; RULES.len()],
    /// In the order of the pairs.
    pub forces: Vec<ArcForce>,
}

impl RingChunk {
    /// Finds the contacts of some pairs of rings and their forces; `search.irregular` are those left out.
    pub(crate) fn collide<const DAMPED: bool>(
        &mut self,
        level: Level,
        scene: RingScene,
        pairs: &[(u32, u32)],
    ) {
        self.search.find(level, scene.lines, pairs);
        let count = self.search.arcs.len();
        if self.forces.len() < count {
            self.forces.resize(count, ArcForce::default());
        }
        self.forces.truncate(count);
        let counts = self.sort();
        let (arcs, forces) = (self.search.arcs.as_slice(), self.forces.as_mut_slice());
        let bins = self.bins.iter().zip(counts).map(|(bin, count)| &bin[..count]);
        for (bin, rule) in bins.zip(RULES).filter(|(bin, _)| !bin.is_empty()) {
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || for group in bin.chunks(LANES) {
                    push_group::<_, DAMPED>(simd, &scene, arcs, pairs, rule, group, forces);
                },
            ));
        }
    }

    /// Sorts the arcs by the rule that their length needs; returns how many there are of each. Written without branches:
    /// which rule it is cannot be foretold.
    fn sort(&mut self) -> [usize; RULES.len()] {
        let arcs = &self.search.arcs;
        let mut counts = [0; RULES.len()];
        for bin in self.bins.iter_mut().filter(|bin| bin.len() < arcs.len()) {
            bin.resize(arcs.len(), 0);
        }
        for (number, arc) in arcs.iter().enumerate() {
            let rule = arc.rule();
            self.bins[rule][counts[rule]] = number as u32;
            counts[rule] += 1;
        }
        counts
    }
}

/// Some arcs of one rule, side by side.
#[inline(always)]
fn push_group<S: Simd, const DAMPED: bool>(
    simd: S,
    scene: &RingScene,
    arcs: &[LaneArc],
    pairs: &[(u32, u32)],
    rule: GaussRule,
    group: &[u32],
    forces: &mut [ArcForce],
) {
    let number = |lane: usize| if lane < group.len() { group[lane] } else { group[0] } as usize;
    let numbers: [usize; LANES] = each_lane!(lane => number(lane));
    let arcs: [&LaneArc; LANES] = each_lane!(lane => &arcs[numbers[lane]]);
    let bodies: [(u32, u32); LANES] = each_lane!(lane => pairs[arcs[lane].pair()]);
    let rows = Push::<S>::new::<DAMPED>(simd, scene, arcs, bodies).rows::<DAMPED>(simd, rule);
    for (lane, &number) in group.iter().enumerate() {
        let force = &mut forces[number as usize];
        rows[0][lane].store_array(&mut force.force);
        rows[1][lane].store_array(&mut force.torque_a);
        rows[2][lane].store_array(&mut force.torque_b);
        rows[3][lane].store_array(&mut force.middle);
        if DAMPED {
            rows[4][lane].store_array(&mut force.lost[0]);
            rows[5][lane].store_array(&mut force.lost[1]);
            rows[6][lane].store_array(&mut force.lost[2]);
        }
        (force.a, force.b) = bodies[lane];
    }
}

/// Arcs, one a lane, with what their forces need.
struct Push<S: Simd> {
    pairs: PairLanes<S>,
    frame: Frames<S>,
    half_tangent: Lanes<S>,
    middle: [Lanes<S>; 2],
    stiffness: Lanes<S>,
    rate_damping: Lanes<S>,
    viscous_damping: Lanes<S>,
    /// Half the step times both mobilities times the arc's length.
    implicit: Lanes<S>,
    /// Velocity of A's matter at B's centre relative to B's, and relative angular velocity, in the frame.
    linear: [Lanes<S>; 3],
    angular: [Lanes<S>; 2],
}

impl<S: Simd> Push<S> {
    #[inline(always)]
    fn new<const DAMPED: bool>(
        simd: S,
        scene: &RingScene,
        arcs: [&LaneArc; LANES],
        bodies: [(u32, u32); LANES],
    ) -> Push<S> {
        let [mid_cos, mid_sin, half_tangent, _] = columns(simd, each_lane!(lane => &arcs[lane].numbers));
        let pairs = PairLanes::load(simd, scene.lines, bodies);
        let frame = Frames::of(&pairs);
        let zero = Lanes::splat(simd, 0.0);
        let [stiffness, rate_damping, viscous_damping] = scene.law_lanes::<S, DAMPED>(simd, bodies);
        let mut push = Push {
            pairs,
            frame,
            half_tangent,
            middle: [mid_cos, mid_sin],
            stiffness,
            rate_damping,
            viscous_damping,
            implicit: zero,
            linear: [zero; 3],
            angular: [zero; 2],
        };
        if DAMPED {
            push.damp(simd, scene, bodies);
        }
        push
    }

    #[inline(always)]
    fn damp(&mut self, simd: S, scene: &RingScene, bodies: [(u32, u32); LANES]) {
        let a: [&MotionLine; LANES] = each_lane!(lane => &scene.motions[bodies[lane].0 as usize]);
        let b: [&MotionLine; LANES] = each_lane!(lane => &scene.motions[bodies[lane].1 as usize]);
        let [x, y, z, of_a] = columns(simd, each_lane!(lane => &a[lane].linear));
        let v_a = Vectors([x, y, z]);
        let [x, y, z, of_b] = columns(simd, each_lane!(lane => &b[lane].linear));
        let v_b = Vectors([x, y, z]);
        let [x, y, z, _] = columns(simd, each_lane!(lane => &a[lane].angular));
        let w_a = Vectors([x, y, z]);
        let [x, y, z, _] = columns(simd, each_lane!(lane => &b[lane].angular));
        let w_b = Vectors([x, y, z]);
        self.implicit = scene.half_step * (of_a + of_b) * (4.0 * self.half_tangent * self.pairs.radius_a);
        let v = v_a.minus(&v_b).plus(&self.pairs.from_b.cross(&w_a));
        let w = w_a.minus(&w_b);
        let frame = &self.frame;
        self.linear = [v.dot(&frame.e2), v.dot(&frame.g), v.dot(&self.pairs.normal_b)];
        self.angular = [w.dot(&frame.e2), w.dot(&frame.g)];
    }

    /// Integrates over the arcs: rows of [`ArcForce`], kind by kind.
    #[inline(always)]
    fn rows<const DAMPED: bool>(&self, simd: S, rule: GaussRule) -> [[Row<S>; LANES]; 7] {
        let zero = Lanes::splat(simd, 0.0);
        let tiny = Lanes::splat(simd, TINY);
        let (radius_a, radius_b) = (self.pairs.radius_a, self.pairs.radius_b);
        let (tilt, rise) = (radius_a * self.frame.cos, radius_a * self.frame.sin);
        let [mid_cos, mid_sin] = self.middle;
        let mut all = Sums::zero(zero);
        let mut lost = Sums::zero(zero);
        let (mut energy, mut normal_force, mut penetration) = (zero, zero, zero);
        let mut middle = [zero; 3];
        let twice_radius = (self.half_tangent + self.half_tangent) * radius_a;
        for &(x, weight) in rule.nodes() {
            // Lengths times `whole`, and their products times its powers.
            let tau = self.half_tangent * x;
            let square = tau * tau;
            let whole = 1.0 + square;
            let (c, s) = (1.0 - square, tau + tau);
            let (cos, sin) = (mid_cos * c - mid_sin * s, mid_sin * c + mid_cos * s);
            let p_1 = self.frame.centre[0] * whole + radius_a * sin;
            let p_2 = self.frame.centre[1] * whole - tilt * cos;
            let z = self.frame.centre[2] * whole + rise * cos;
            let rho = (p_1 * p_1 + p_2 * p_2).sqrt();
            let u = rho - radius_b * whole;
            let distance = (u * u + z * z).sqrt();
            // Rounding at the very end of an arc may put a point outside.
            let depth = larger(self.pairs.reach * whole - distance, zero);
            let pressure = self.stiffness * depth;
            let area = larger(rho * distance, tiny);
            // Without damping all of this is the same to the bit.
            let damping = pressure * self.rate_damping + self.viscous_damping * whole;
            let slowed = if DAMPED { whole + self.implicit * damping } else { whole };
            // The one division: by `whole` twice, by `area` and by `slowed`.
            let squared = whole * whole;
            let (ends, push) = (squared * area, squared * slowed);
            let inverse = 1.0 / (ends * slowed);
            let inverse_area = inverse * push;
            let share = (weight * twice_radius) * (inverse * (area * slowed));
            let elastic = pressure * share;
            let mut force = elastic;
            if DAMPED {
                let [v_1, v_2, v_3] = self.linear;
                let [w_1, w_2] = self.angular;
                let turning = radius_b * (w_1 * p_2 - w_2 * p_1);
                let opening = (v_1 * p_1 + v_2 * p_2) * u + (v_3 * rho + turning) * z;
                let push = pressure - (damping * opening) * (inverse * (squared * whole));
                force = depth.simd_gt(zero).select(larger(push, zero), zero) * share;
                lost.add(p_1, p_2, rho, u, z, (force - elastic) * inverse_area);
            }
            all.add(p_1, p_2, rho, u, z, force * inverse_area);
            let inverse_whole = (inverse * slowed) * (whole * area);
            let depth = depth * inverse_whole;
            energy += elastic * depth;
            normal_force += force;
            penetration = larger(depth, penetration);
            let elastic_share = elastic * inverse_whole;
            middle = [middle[0] + elastic_share * cos, middle[1] + elastic_share * sin, middle[2] + elastic];
        }
        let [force, torque_a, torque_b] = self.wrenches(&all);
        let none = Row::splat(simd, 0.0);
        let mut rows = [
            row(&force, 0.5 * energy),
            row(&torque_a, penetration),
            row(&torque_b, normal_force),
            rows_of([middle[0], middle[1], middle[2], zero]),
            [none; LANES],
            [none; LANES],
            [none; LANES],
        ];
        if DAMPED {
            let [force, torque_a, torque_b] = self.wrenches(&lost);
            rows[4] = row(&force, zero);
            rows[5] = row(&torque_a, zero);
            rows[6] = row(&torque_b, zero);
        }
        rows
    }

    /// Force on A, torque on A and torque on B, World.
    #[inline(always)]
    fn wrenches(&self, sums: &Sums<S>) -> [Vectors<S>; 3] {
        let (e2, g, normal) = (&self.frame.e2, &self.frame.g, &self.pairs.normal_b);
        let [f_1, f_2, f_3] = sums.force;
        let [t_1, t_2] = [sums.torque[0] * self.pairs.radius_b, sums.torque[1] * self.pairs.radius_b];
        let force = e2.times(f_1).plus(&g.times(f_2)).plus(&normal.times(f_3));
        let about_b = e2.times(t_1).plus(&g.times(t_2));
        let torque_a = about_b.minus(&self.pairs.from_b.cross(&force));
        let torque_b = Vectors([-about_b.0[0], -about_b.0[1], -about_b.0[2]]);
        [force, torque_a, torque_b]
    }
}

/// Force on A, and its torque about B's centre over B's radius, along `e2`, `g` and the normal of B.
struct Sums<S: Simd> {
    force: [Lanes<S>; 3],
    torque: [Lanes<S>; 2],
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    fn zero(zero: Lanes<S>) -> Sums<S> {
        Sums { force: [zero; 3], torque: [zero; 2] }
    }

    /// Adds a push, given over `rho D`.
    #[inline(always)]
    fn add(&mut self, p_1: Lanes<S>, p_2: Lanes<S>, rho: Lanes<S>, u: Lanes<S>, z: Lanes<S>, push: Lanes<S>) {
        let (inward, upward) = (push * u, push * z);
        let [f_1, f_2, f_3] = self.force;
        self.force = [f_1 + p_1 * inward, f_2 + p_2 * inward, f_3 + rho * upward];
        self.torque = [self.torque[0] + p_2 * upward, self.torque[1] - p_1 * upward];
    }
}

/// Rows of a vector and a number.
#[inline(always)]
fn row<S: Simd>(vector: &Vectors<S>, last: Lanes<S>) -> [Row<S>; LANES] {
    rows_of([vector.0[0], vector.0[1], vector.0[2], last])
}

//! The law `surface-integral`: the paper's, made symmetric.
//!
//! The force of B on A is `k` times the integral, over the part of A's surface inside B, of the depth times B's outward
//! normal; likewise of A on B over B's surface. Each alone is the exact gradient of a potential, `k/2` times the integral
//! of the squared depth, but they are not opposite to each other. So half of each is taken, for both bodies with opposite
//! signs: `(F_AB - F_BA) / 2`. Against a plane A's surface counts alone.
//!
//! The pressure at each point is that of the other laws, `max(0, k d (1 + z d') + c d')`, with stiffness and damping per
//! area; friction acts at the contact's force centre, once for each connected contact. Where the points lie is told in
//! `geometry::patch` (`quadrature`) and in [`samples`] (the others).
//!
//! # Averages
//! With `method.surface.average = "all-samples"` every sample counts with `1 / N` instead of its area, and stiffness and
//! damping are those of contact points. By `uniform-angles` this is the law of the original program (with its errors
//! mended), which gives the inner side of a ring more than its share; by the others, `k / area` times the integral.
//!
//! # Source
//! T. Henderson, "Chainmail", 6.837 final project (2016), section 4.2, after E. Drumwright, "A fast and stable penalty
//! method for rigid body simulation", IEEE TVCG 14 (2008). Deviations: symmetric, damping never pulls, Coulomb friction.

pub(crate) mod samples;

use super::{Pair, PairForce, Patch, close};
use crate::contact::friction::Slip;
use geometry::Arcs;
use geometry::arc::{circle_plane_arcs, circle_point_arcs};
use geometry::lanes::{Level, Simd, dispatch};
use geometry::patch::pair::quadrature;
use geometry::patch::{Block, Lane, Nodes, Solid, WIDTH};
use schemas::scene::{SurfaceAverage, SurfaceIntegral, SurfaceSampler};
use schemas::step::SurfaceSamples;

/// Memory for the points of one pair.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    /// Those of contact 0 and 1.
    nodes: [Nodes; 2],
    /// What the samples of all pairs found since this was last set to zero.
    pub counts: SurfaceSamples,
}

/// What the law needs to know beside the pair.
pub(crate) struct Surfaces<'a> {
    pub settings: &'a SurfaceIntegral,
    /// Both bodies, seen from A's centre.
    pub a: Solid,
    pub b: Solid,
    /// Of two rings: the contact arcs on A's centreline.
    pub arcs: Option<&'a Arcs>,
    /// Random numbers of this seed and step; None for `quadrature`.
    pub random: Option<&'a random::Stream>,
}

impl Surfaces<'_> {
    /// If the two bodies touch, what they do to each other is appended.
    pub(crate) fn collide<const DAMPED: bool, const FRICTION: bool>(
        &self,
        pair: &Pair,
        slip: &Slip,
        workspace: &mut Workspace,
        forces: &mut Vec<PairForce>,
    ) {
        let Some(arcs) = self.arcs() else { return };
        let nodes = &mut workspace.nodes;
        nodes.iter_mut().for_each(Nodes::clear);
        let halves = if matches!(self.b, Solid::Plane { .. }) { [1.0, 0.0] } else { [0.5, 0.5] };
        match (self.settings.sampler, self.random) {
            (SurfaceSampler::Quadrature, _) | (_, None) => {
                let shares = match self.settings.average {
                    SurfaceAverage::Area => halves,
                    SurfaceAverage::AllSamples => [halves[0] / self.a.area(), halves[1] / self.b.area()],
                };
                quadrature(&self.a, &self.b, &arcs, shares, nodes);
            }
            (_, Some(random)) => {
                self.sample(pair.numbers, &arcs, halves, random.clone(), nodes);
                let hits = nodes.iter().map(Nodes::count).sum();
                let surfaces = halves.iter().filter(|&&share| share > 0.0).count() as u64;
                let samples = surfaces * u64::from(self.settings.samples);
                workspace.counts += SurfaceSamples { pairs: 1, missed: u64::from(hits == 0), samples, hits };
            }
        }
        let mut patches = [Patch::EMPTY; 2];
        // Arcs of a contact that no sample has met leave a contact without force: its friction has nothing to hold.
        let count = if arcs.connected_count() > 1 { 2 } else { 1 };
        for (patch, nodes) in patches.iter_mut().zip(nodes.iter()) {
            patch.add_surface::<DAMPED>(pair, nodes);
        }
        close::<DAMPED, FRICTION>(pair, &mut patches[..count], slip, forces);
    }

    /// The contact arcs on A's centreline; none are needed of a sphere. None without contact.
    fn arcs(&self) -> Option<Arcs> {
        let arcs = match (&self.a, &self.b) {
            (Solid::Ring { circle, minor_radius }, b) => match b {
                Solid::Ring { .. } => return self.arcs.copied(),
                Solid::Sphere { centre, radius } => circle_point_arcs(circle, centre, minor_radius + radius),
                Solid::Plane { normal, offset } => circle_plane_arcs(circle, normal, *offset, *minor_radius),
            },
            (Solid::Sphere { radius, .. }, Solid::Sphere { centre, radius: other }) => {
                let reach = radius + other;
                return (centre.norm_squared() < reach * reach).then_some(Arcs::NONE);
            }
            (Solid::Sphere { radius, .. }, Solid::Plane { offset, .. }) => {
                return (-offset < *radius).then_some(Arcs::NONE);
            }
            _ => return None,
        };
        (!arcs.is_empty()).then_some(arcs)
    }
}

impl Patch {
    /// Adds the points of a surface. Places are seen from A's centre: they are A's levers.
    fn add_surface<const DAMPED: bool>(&mut self, pair: &Pair, nodes: &Nodes) {
        let area: f64 = nodes.blocks().iter().flat_map(|block| block.area).sum();
        let mut sums = Sums::ZERO;
        // Plain loops over eight lanes, compiled for what the processor has: the same bits on each.
        dispatch!(Level::new(), simd => simd.vectorize(
            #[inline(always)]
            || nodes.blocks().iter().for_each(|block| sums.add::<DAMPED>(pair, block, pair.implicit * area))
        ));
        let total = |lane: &Lane| lane.iter().sum::<f64>();
        for axis in 0..3 {
            self.wrench.force[axis] = total(&sums.force[axis]);
            self.wrench.torque[axis] = total(&sums.torque[axis]);
            self.centre[axis] = total(&sums.centre[axis]);
            if DAMPED {
                self.lost.force[axis] = total(&sums.lost_force[axis]);
                self.lost.torque[axis] = total(&sums.lost_torque[axis]);
            }
        }
        self.energy = 0.5 * total(&sums.energy);
        self.normal_force = total(&sums.normal_force);
        self.weight = total(&sums.weight);
        self.penetration = nodes.deepest();
        // A sphere has no angle.
        if pair.a.radius > 0.0 {
            let inverse = 1.0 / pair.a.radius;
            self.mid = (self.centre.dot(&pair.a.u) * inverse, self.centre.dot(&pair.a.w) * inverse);
        }
    }
}

/// Sums in eight lanes, added up at the end in their order.
struct Sums {
    force: [Lane; 3],
    torque: [Lane; 3],
    lost_force: [Lane; 3],
    lost_torque: [Lane; 3],
    centre: [Lane; 3],
    energy: Lane,
    normal_force: Lane,
    weight: Lane,
}

impl Sums {
    const ZERO: Sums = Sums {
        force: [[0.0; WIDTH]; 3],
        torque: [[0.0; WIDTH]; 3],
        lost_force: [[0.0; WIDTH]; 3],
        lost_torque: [[0.0; WIDTH]; 3],
        centre: [[0.0; WIDTH]; 3],
        energy: [0.0; WIDTH],
        normal_force: [0.0; WIDTH],
        weight: [0.0; WIDTH],
    };

    /// `implicit`: see [`super::material::NormalLaw::push`], times the contact's area.
    #[inline(always)]
    fn add<const DAMPED: bool>(&mut self, pair: &Pair, block: &Block, implicit: f64) {
        let (p, n) = (&block.point, &block.normal);
        let mut turn = [[0.0; WIDTH]; 3];
        let mut force = [0.0; WIDTH];
        for i in 0..WIDTH {
            let elastic = pair.law.stiffness * block.depth[i] * block.area[i];
            turn[0][i] = p[1][i] * n[2][i] - p[2][i] * n[1][i];
            turn[1][i] = p[2][i] * n[0][i] - p[0][i] * n[2][i];
            turn[2][i] = p[0][i] * n[1][i] - p[1][i] * n[0][i];
            force[i] = elastic;
            self.energy[i] += elastic * block.depth[i];
            self.weight[i] += elastic;
            for (centre, p) in self.centre.iter_mut().zip(p) {
                centre[i] += p[i] * elastic;
            }
        }
        if DAMPED {
            let (v, w) = (pair.relative.linear, pair.relative.angular);
            for i in 0..WIDTH {
                let along = v.x * n[0][i] + v.y * n[1][i] + v.z * n[2][i];
                let about = w.x * turn[0][i] + w.y * turn[1][i] + w.z * turn[2][i];
                let push = pair.law.push(block.depth[i], -(along + about), implicit) * block.area[i];
                let lost = push - force[i];
                force[i] = push;
                for axis in 0..3 {
                    self.lost_force[axis][i] += n[axis][i] * lost;
                    self.lost_torque[axis][i] += turn[axis][i] * lost;
                }
            }
        }
        for i in 0..WIDTH {
            self.normal_force[i] += force[i];
            for axis in 0..3 {
                self.force[axis][i] += n[axis][i] * force[i];
                self.torque[axis][i] += turn[axis][i] * force[i];
            }
        }
    }
}

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
use crate::wrench::Wrench;
use geometry::arc::{circle_plane_arcs, circle_point_arcs};
use geometry::lanes::{Eight, Level, Select, Simd, SimdBase, SimdSplit, dispatch};
use geometry::patch::pair::quadrature;
use geometry::patch::{Nodes, Solid, WIDTH};
use geometry::{Arcs, Vec3};
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
        // The area counts where damping is taken implicitly.
        let area = if DAMPED && pair.implicit > 0.0 { whole_area(nodes) } else { 0.0 };
        // Eight points side by side, compiled for what the processor has: the same bits on each.
        let sums = dispatch!(Level::new(), simd => simd.vectorize(
            #[inline(always)]
            || Sums::of::<_, DAMPED>(simd, pair, nodes, pair.implicit * area)
        ));
        self.wrench = Wrench { force: sums.force, torque: sums.torque };
        self.lost = Wrench { force: sums.lost_force, torque: sums.lost_torque };
        self.centre = sums.centre;
        self.energy = 0.5 * sums.energy;
        self.normal_force = sums.normal_force;
        self.weight = sums.weight;
        self.penetration = nodes.deepest();
        // A sphere has no angle.
        if pair.a.radius > 0.0 {
            let inverse = 1.0 / pair.a.radius;
            self.mid = (self.centre.dot(&pair.a.u) * inverse, self.centre.dot(&pair.a.w) * inverse);
        }
    }
}

/// The area that all points stand for (m^2): lane by lane, then across.
fn whole_area(nodes: &Nodes) -> f64 {
    let mut sums = [0.0; WIDTH];
    for block in nodes.blocks() {
        for (sum, area) in sums.iter_mut().zip(&block.area) {
            *sum += area;
        }
    }
    sums.iter().sum()
}

/// Sums over the points of a contact.
struct Sums {
    force: Vec3,
    torque: Vec3,
    lost_force: Vec3,
    lost_torque: Vec3,
    centre: Vec3,
    /// Twice the energy.
    energy: f64,
    normal_force: f64,
    weight: f64,
}

impl Sums {
    /// `implicit`: see [`super::material::NormalLaw::push`], times the contact's area.
    #[inline(always)]
    fn of<S: Simd, const DAMPED: bool>(simd: S, pair: &Pair, nodes: &Nodes, implicit: f64) -> Sums {
        let zero = Eight::splat(simd, 0.0);
        let (mut force, mut torque, mut centre) = ([zero; 3], [zero; 3], [zero; 3]);
        let (mut lost_force, mut lost_torque) = ([zero; 3], [zero; 3]);
        let (mut energy, mut normal_force, mut weight) = (zero, zero, zero);
        let (v, w, law) = (pair.relative.linear, pair.relative.angular, pair.law);
        for block in nodes.blocks() {
            let [x, y, z] = [&block.point[0], &block.point[1], &block.point[2]];
            let p = [
                Eight::load_array_ref(simd, x),
                Eight::load_array_ref(simd, y),
                Eight::load_array_ref(simd, z),
            ];
            let [x, y, z] = [&block.normal[0], &block.normal[1], &block.normal[2]];
            let n = [
                Eight::load_array_ref(simd, x),
                Eight::load_array_ref(simd, y),
                Eight::load_array_ref(simd, z),
            ];
            let depth = Eight::load_array_ref(simd, &block.depth);
            let area = Eight::load_array_ref(simd, &block.area);
            let turn = [p[1] * n[2] - p[2] * n[1], p[2] * n[0] - p[0] * n[2], p[0] * n[1] - p[1] * n[0]];
            let pressure = depth * law.stiffness;
            let elastic = pressure * area;
            let mut size = elastic;
            energy += elastic * depth;
            weight += elastic;
            add(&mut centre, &p, elastic);
            if DAMPED {
                // As `NormalLaw::push`.
                let along = n[0] * v.x + n[1] * v.y + n[2] * v.z;
                let about = turn[0] * w.x + turn[1] * w.y + turn[2] * w.z;
                let damping = pressure * law.rate_damping + law.viscous_damping;
                let push = pressure - damping * ((along + about) / (damping * implicit + 1.0));
                size = push.simd_gt(zero).select(push, zero) * area;
                let lost = size - elastic;
                add(&mut lost_force, &n, lost);
                add(&mut lost_torque, &turn, lost);
            }
            normal_force += size;
            add(&mut force, &n, size);
            add(&mut torque, &turn, size);
        }
        Sums {
            force: across(force),
            torque: across(torque),
            lost_force: across(lost_force),
            lost_torque: across(lost_torque),
            centre: across(centre),
            energy: total(energy),
            normal_force: total(normal_force),
            weight: total(weight),
        }
    }
}

#[inline(always)]
fn add<S: Simd>(sums: &mut [Eight<S>; 3], vectors: &[Eight<S>; 3], times: Eight<S>) {
    for (sum, component) in sums.iter_mut().zip(vectors) {
        *sum += *component * times;
    }
}

#[inline(always)]
fn across<S: Simd>([x, y, z]: [Eight<S>; 3]) -> Vec3 {
    Vec3::new(total(x), total(y), total(z))
}

/// The sum of eight lanes: of both halves, then of what is left in order.
#[inline(always)]
fn total<S: Simd>(lanes: Eight<S>) -> f64 {
    let (low, high) = lanes.split();
    let [a, b, c, d] = (low + high).to_array();
    (a + b) + (c + d)
}

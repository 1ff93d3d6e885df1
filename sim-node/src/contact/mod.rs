//! Contact between two bodies: one short function for each pair of shapes.
//!
//! # The law
//! Body A carries the contact: the part of its centreline that is closer to body B than both wires'
//! radii together, `s`. At a point P of it with the distance D to its closest point Q on B (on B's
//! centreline, at a sphere's centre, on a plane) the penetration is `d = s - D`, the normal
//! `n = (P - Q) / D` points from B to A, and the pressure on A is `max(0, k d (1 + z d') + c d') n` per
//! length. Its elastic part is the exact gradient of the potential `k/2` times the integral of `d^2`.
//!
//! # Damping in a step of `verlet`
//! One force has to do for the whole kick, while damping changes the very rate that it is made from. The
//! rate taken is `d' / (1 + h/2 w C)`: what damping alone, with the coefficient `C` of the arc, leaves of it
//! in the middle of the step. `w` is the velocity that a unit impulse gives to both surfaces at most, times
//! the number of contacts that may act at once, so that however strong the damping is, all of them together
//! can stop the motion and not reverse it. For a short step this is the law above; the difference is of
//! first order in `h`. `rk4` takes the law as it is, and its bound on the step counts damping.
//!
//! # Where the force acts
//! On the line through P and Q, so any point of it gives the same torques; P is used. The rate
//! `d' = -(v_P - v_Q) . n` is the same for any point of the line too: moving a point along `n` changes its
//! velocity across `n` only. Both bodies get the same force with opposite signs, bit for bit, and the torque
//! on B is made from the torque on A, so that linear momentum is conserved exactly and angular momentum to
//! rounding.
//!
//! # Degenerate points
//! On B's axis every point of B's centreline is equally close: the one on B's own x axis is taken. Where
//! both centrelines cross (D below [`CROSSING`] of B's radius) there is no normal, and that point pushes nowhere: two rings in
//! the same place have energy and no force. It only occurs when one ring has passed through another.

pub(crate) mod friction;
pub(crate) mod kernel;
pub(crate) mod material;
pub(crate) mod minima;
pub(crate) mod shapes;
pub(crate) mod surface;

use crate::model::HalfSpace;
use crate::wrench::{Velocity, Wrench};
use friction::{Grip, Rub, Slip};

use geometry::arc::{circle_plane_arcs, circle_point_arcs, rule_for};
use geometry::{Arcs, Circle, Vec3};
use material::NormalLaw;

/// Distance of two centrelines, as a share of B's radius, below which it has no direction.
const CROSSING: f64 = 1e-13;

/// One contact: a connected contact arc, or a contact point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Contact {
    /// 0 or 1 among the contacts of its pair.
    pub arc: u32,
    /// Cosine and sine of the middle's angle on A's centreline, weighted by the elastic force; 0 and 0
    /// where that has no direction (a sphere, a whole circle).
    pub mid_cos: f64,
    pub mid_sin: f64,
    /// Largest penetration met by the quadrature (m).
    pub penetration: f64,
    /// Sum of the pressure's magnitudes (N): what friction is measured by.
    pub normal_force: f64,
    /// Friction's spring to keep for the next step (m), if the pair has friction.
    pub spring: Option<Vec3>,
}

/// What a pair of bodies does to each other.
#[derive(Clone, Debug)]
pub(crate) struct PairForce {
    pub a: u32,
    pub b: u32,
    pub on_a: Wrench,
    pub on_b: Wrench,
    /// The part of both that is not elastic: damping and friction.
    pub lost_on_a: Wrench,
    pub lost_on_b: Wrench,
    /// Energy in the normal springs (J).
    pub energy: f64,
    pub contacts: [Contact; 2],
    pub contact_count: usize,
    /// Friction at the contacts.
    pub rubs: [Rub; 2],
}

impl PairForce {
    /// The contacts of the pair.
    pub(crate) fn contacts(&self) -> core::slice::Iter<'_, Contact> {
        self.contacts[..self.contact_count].iter()
    }

    fn none((a, b): (u32, u32)) -> PairForce {
        const NONE: Contact =
            Contact { arc: 0, mid_cos: 0.0, mid_sin: 0.0, penetration: 0.0, normal_force: 0.0, spring: None };
        PairForce {
            a,
            b,
            on_a: Wrench::ZERO,
            on_b: Wrench::ZERO,
            lost_on_a: Wrench::ZERO,
            lost_on_b: Wrench::ZERO,
            energy: 0.0,
            contacts: [NONE; 2],
            contact_count: 0,
            rubs: [Rub::NONE; 2],
        }
    }
}

/// A pair's two bodies as the law sees them.
#[derive(Clone, Copy)]
pub(crate) struct Pair<'a> {
    /// Their numbers in the model.
    pub numbers: (u32, u32),
    pub a: &'a Circle,
    pub a_minor_radius: f64,
    pub law: NormalLaw,
    /// Hertz's modulus of sphere against sphere or plane (Pa); 0 where the law itself holds.
    pub sphere_modulus: f64,
    /// Centre of A less centre of B; zero for a plane.
    pub from_b: Vec3,
    /// Velocity of A's centre relative to B's matter there, and angular velocity of A relative to B.
    pub relative: Velocity,
    /// Half the time step times both bodies' mobility (s/kg); 0 where damping is explicit.
    pub implicit: f64,
}

impl Pair<'_> {
    /// The rate at which penetration grows at a point of A, given the normal and lever x normal:
    /// `(v + w x lever) . n = v . n + w . (lever x n)`.
    #[inline]
    fn rate(&self, normal: &Vec3, turn: &Vec3) -> f64 {
        -(self.relative.linear.dot(normal) + self.relative.angular.dot(turn))
    }
}

/// Sums over one connected arc while its points are visited.
struct Patch {
    wrench: Wrench,
    lost: Wrench,
    energy: f64,
    penetration: f64,
    normal_force: f64,
    /// Sums weighted by the elastic force: the weight, the angle's cosine and sine, the contact point.
    weight: f64,
    mid: (f64, f64),
    centre: Vec3,
}

/// One point of a contact: its lever from A's centre, the normal from B to A, penetration, length element.
struct Node {
    lever: Vec3,
    normal: Vec3,
    penetration: f64,
    length: f64,
    /// Length of the whole connected arc (m).
    arc_length: f64,
}

impl Patch {
    const EMPTY: Patch = Patch {
        wrench: Wrench::ZERO,
        lost: Wrench::ZERO,
        energy: 0.0,
        penetration: 0.0,
        normal_force: 0.0,
        weight: 0.0,
        mid: (0.0, 0.0),
        centre: Vec3::new(0.0, 0.0, 0.0),
    };

    #[inline]
    fn add<const DAMPED: bool, const FRICTION: bool>(
        &mut self,
        pair: &Pair,
        node: &Node,
        cos_sin: (f64, f64),
    ) {
        let elastic = pair.law.stiffness * node.penetration * node.length;
        // The torque of a unit push along the normal; the rate of penetration needs it too.
        let turn = node.lever.cross(&node.normal);
        let mut force = elastic;
        if DAMPED {
            let rate = pair.rate(&node.normal, &turn);
            let implicit = pair.implicit * node.arc_length;
            force = pair.law.push(node.penetration, rate, implicit) * node.length;
            let lost = force - elastic;
            self.lost.force += node.normal * lost;
            self.lost.torque += turn * lost;
        }
        self.wrench.force += node.normal * force;
        self.wrench.torque += turn * force;
        self.energy += 0.5 * elastic * node.penetration;
        self.normal_force += force;
        if node.penetration > self.penetration {
            self.penetration = node.penetration;
        }
        self.weight += elastic;
        self.mid.0 += elastic * cos_sin.0;
        self.mid.1 += elastic * cos_sin.1;
        if FRICTION {
            let surface = pair.a_minor_radius - 0.5 * node.penetration;
            self.centre += (node.lever - node.normal * surface) * elastic;
        }
    }

    /// Adds what another patch, made as the other body sees it, does to this one; `from_this` is that body's
    /// centre less this one's.
    fn add_reaction(&mut self, other: &Patch, from_this: &Vec3) {
        self.wrench.add(&other.wrench.reaction(from_this));
        self.lost.add(&other.lost.reaction(from_this));
        self.energy += other.energy;
        self.normal_force += other.normal_force;
        if other.penetration > self.penetration {
            self.penetration = other.penetration;
        }
        self.weight += other.weight;
        self.centre += other.centre + from_this * other.weight;
    }

    /// The middle's direction; none where the arc is symmetric about the centre.
    fn middle(&self) -> (f64, f64) {
        direction(self.mid, self.weight)
    }

    fn grip(&self, pair: &Pair) -> Grip {
        // An arc of no length has no weight, no force and no friction.
        let inverse = if self.weight > 0.0 { 1.0 / self.weight } else { 0.0 };
        Grip {
            lever: self.centre * inverse,
            normal: self.wrench.force,
            normal_force: self.normal_force,
            damping_time: pair.law.damping_time(2.0 * self.energy * inverse),
        }
    }
}

/// Adds up a pair's patches, with friction where there is any, and appends the result.
#[inline]
fn close<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    patches: &mut [Patch],
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let mut total = PairForce::none(pair.numbers);
    let mut mids = [(0.0, 0.0); 2];
    for (mid, patch) in mids.iter_mut().zip(patches.iter()) {
        *mid = patch.middle();
    }
    // A pair without friction has no springs, even where others have.
    let rubs = FRICTION && slip.coefficient > 0.0;
    let old = if rubs { slip.recognise(&mids[..patches.len()]) } else { [Vec3::zeros(); 2] };
    for (arc, patch) in patches.iter_mut().enumerate() {
        let mut spring = None;
        if rubs {
            let grip = patch.grip(pair);
            let (rub, kept) = slip.friction(pair, &grip, old[arc]);
            spring = Some(kept);
            patch.wrench.push(&rub.lever, rub.force);
            patch.lost.push(&rub.lever, rub.force);
            total.rubs[arc] = rub;
        }
        total.on_a.add(&patch.wrench);
        total.lost_on_a.add(&patch.lost);
        total.energy += patch.energy;
        total.contacts[arc] = Contact {
            arc: arc as u32,
            mid_cos: mids[arc].0,
            mid_sin: mids[arc].1,
            penetration: patch.penetration,
            normal_force: patch.normal_force,
            spring,
        };
    }
    total.contact_count = patches.len();
    total.on_b = total.on_a.reaction(&pair.from_b);
    if DAMPED || FRICTION {
        total.lost_on_b = total.lost_on_a.reaction(&pair.from_b);
    }
    forces.push(total);
}

/// Integrates the law along contact arcs. `closest` gives, for a point of A by its lever, the normal there
/// and the distance from B's centreline, centre or surface.
#[inline]
fn along_arcs<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    arcs: &Arcs,
    reach: f64,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
    closest: impl Fn(&Vec3) -> (Vec3, f64),
) {
    let mut patches = [Patch::EMPTY; 2];
    let mut count = 0;
    let mut arc_lengths = [0.0; 2];
    if DAMPED {
        for arc in arcs.iter() {
            // An arc of a quarter turn is 5 % longer than four half tangents say: near enough for a rate.
            arc_lengths[arc.connected as usize] += 4.0 * arc.half_tangent * pair.a.radius;
        }
    }
    let (u, w) = (pair.a.u * pair.a.radius, pair.a.w * pair.a.radius);
    for arc in arcs.iter() {
        let connected = arc.connected as usize;
        count = connected + 1;
        let patch = &mut patches[connected];
        for point in arc.nodes(rule_for(arc.half_tangent, pair.a.radius / reach)) {
            let lever = u * point.cos + w * point.sin;
            let (normal, distance) = closest(&lever);
            let penetration = reach - distance;
            // Rounding at the very end of an arc may put a point outside.
            if penetration > 0.0 {
                let length = point.weight * pair.a.radius;
                let arc_length = arc_lengths[connected];
                let node = Node { lever, normal, penetration, length, arc_length };
                patch.add::<DAMPED, FRICTION>(pair, &node, (point.cos, point.sin));
            }
        }
    }
    close::<DAMPED, FRICTION>(pair, &mut patches[..count], slip, forces);
}

/// Ring against ring: `arcs` are the contact arcs of A's centreline along B's.
#[inline]
pub(crate) fn ring_ring<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    b: &Circle,
    (arcs, reach): (&Arcs, f64),
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    along_arcs::<DAMPED, FRICTION>(pair, arcs, reach, slip, forces, |lever| from_circle(pair, b, lever));
}

/// The direction to a point of A, given by its lever, from its closest point on circle B, and their distance.
#[inline]
fn from_circle(pair: &Pair, b: &Circle, lever: &Vec3) -> (Vec3, f64) {
    let d = pair.from_b + lever;
    let height = d.dot(&b.normal);
    let across = d - b.normal * height;
    let rho = across.norm_squared().sqrt();
    let apart = if rho > 0.0 { d - across * (b.radius / rho) } else { b.normal * height - b.u * b.radius };
    let distance = apart.norm_squared().sqrt();
    // Rounding of the places, which are of the size of the radius, is no direction.
    if distance > CROSSING * b.radius {
        (apart * (1.0 / distance), distance)
    } else {
        (Vec3::zeros(), distance)
    }
}

/// Ring against sphere: the arc of the ring's centreline that is near the sphere.
#[inline]
pub(crate) fn ring_sphere<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    centre: &Vec3,
    radius: f64,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let reach = pair.a_minor_radius + radius;
    let arcs = circle_point_arcs(pair.a, centre, reach);
    if arcs.is_empty() {
        return;
    }
    along_arcs::<DAMPED, FRICTION>(pair, &arcs, reach, slip, forces, |lever| {
        unit_or(pair.from_b + lever, &pair.a.normal)
    });
}

/// Ring against plane: the arc of the ring's centreline that is less than a wire's radius above it.
#[inline]
pub(crate) fn ring_plane<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    plane: &HalfSpace,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let arcs = circle_plane_arcs(pair.a, &plane.normal, plane.offset, pair.a_minor_radius);
    if arcs.is_empty() {
        return;
    }
    let height = plane.normal.dot(&pair.a.centre) - plane.offset;
    along_arcs::<DAMPED, FRICTION>(pair, &arcs, pair.a_minor_radius, slip, forces, |lever| {
        (plane.normal, height + plane.normal.dot(lever))
    });
}

/// Sphere against sphere: one point on the line of centres.
#[inline]
pub(crate) fn sphere_sphere<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    b_radius: f64,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let reach = pair.a_minor_radius + b_radius;
    let (normal, distance) = unit_or(pair.from_b, &Vec3::z());
    let radius = pair.a_minor_radius * b_radius / reach;
    at_sphere::<DAMPED, FRICTION>(pair, normal, (reach - distance, radius), slip, forces);
}

/// Sphere against plane: one point below the centre.
#[inline]
pub(crate) fn sphere_plane<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    plane: &HalfSpace,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    let height = plane.normal.dot(&pair.a.centre) - plane.offset;
    let radius = pair.a_minor_radius;
    at_sphere::<DAMPED, FRICTION>(pair, plane.normal, (radius - height, radius), slip, forces);
}

/// A point contact of a sphere, by Hertz's law where the materials have a contact modulus.
#[inline]
fn at_sphere<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    normal: Vec3,
    (penetration, radius): (f64, f64),
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    if !(pair.sphere_modulus > 0.0 && penetration > 0.0) {
        return at_point::<DAMPED, FRICTION>(pair, normal, penetration, slip, forces);
    }
    let law = pair.law.hertz(pair.sphere_modulus, radius, penetration);
    at_point::<DAMPED, FRICTION>(&Pair { law, ..*pair }, normal, penetration, slip, forces);
    if let Some(force) = forces.last_mut() {
        // The spring's energy was that of a law linear in depth.
        force.energy *= 0.8;
    }
}

/// A point contact. The normal force acts on the line through A's centre, so its lever is zero.
#[inline]
fn at_point<const DAMPED: bool, const FRICTION: bool>(
    pair: &Pair,
    normal: Vec3,
    penetration: f64,
    slip: &Slip,
    forces: &mut Vec<PairForce>,
) {
    if !(penetration > 0.0) {
        return;
    }
    let mut patches = [Patch::EMPTY];
    let node = Node { lever: Vec3::zeros(), normal, penetration, length: 1.0, arc_length: 1.0 };
    patches[0].add::<DAMPED, FRICTION>(pair, &node, (0.0, 0.0));
    close::<DAMPED, FRICTION>(pair, &mut patches, slip, forces);
}

/// The direction of a weighted sum of directions, given the sum of the weights; 0 and 0 where it has none.
fn direction(sum: (f64, f64), weight: f64) -> (f64, f64) {
    let norm = (sum.0 * sum.0 + sum.1 * sum.1).sqrt();
    // A mean direction of less than a millionth of its parts is rounding.
    if norm > 1e-6 * weight { (sum.0 / norm + 0.0, sum.1 / norm + 0.0) } else { (0.0, 0.0) }
}

/// A vector's direction and length; `fallback` where it has none.
#[inline]
fn unit_or(vector: Vec3, fallback: &Vec3) -> (Vec3, f64) {
    let length = vector.norm_squared().sqrt();
    if length > 0.0 { (vector * (1.0 / length), length) } else { (*fallback, 0.0) }
}

//! The longest time step that a scene allows: a bound on the fastest vibration its contacts can make.
//!
//! # Stiffness of a contact
//! Two crossed wires whose centrelines are `D = s - d` apart, on an arc `x` along A, penetrate by
//! `d - x^2 (1/s - 1/R_A) / 2`: A runs across B's line and bends around it. With
//! `kappa = 1/s - 1/R_A` the contact arc has the length `l = 2 sqrt(2 d / kappa)`, and the stiffness
//! `dF/dd` of the line law is `k l`: line stiffness times length of arc. It grows with the root of the
//! penetration, so the bound is stated for one: `method.stability_penetration`, a share of `s`. It goes with the
//! fourth root of it, so a step that is shorter than the bound covers deeper contacts, see
//! [`covered_penetration`]. A ring lying flat on a plane, or a sphere sitting in a ring, touches all round:
//! `l = 2 pi R`. So do two coaxial rings: there neither push nor tilt has a lever longer than `R / sqrt(2)`.
//! Damping: `C = c l + z k l d`, the latter a little too much for an arc. Friction adds its spring, and damping in
//! proportion.
//!
//! Under `centreline-minima` each contact has its point stiffness. Under `surface-integral` the stiffness is the
//! surface's times the area of the patch, `2 pi d / kappa` with the bendings of both wires, which grows with `d`.
//!
//! # From contacts to the fastest mode
//! A contact acts on body `i` through its centre and a lever of at most `R`, so it moves it by at most
//! `w_i = 1/m + R^2/I1` per unit of impulse. For all contacts together, by Cauchy's inequality for each
//! contact and Gershgorin's for the sum, no mode is faster than `omega^2 = max over i of sum K (w_i + w_j)`
//! over the contacts of `i`. The contacts counted are the links at the start, and one with each plane, sphere and
//! other solid that a body could meet, the [`NEIGHBOURS`] stiffest of them. A ring without links may come to lie on others like itself: one all round, or
//! one above and one below.
//!
//! # Impacts
//! In a lasting contact a step is stable while `omega h < 2`. But contacts begin and end: a body that comes in at
//! `v` may be `v h` deep when its first force is evaluated. With a force that goes with the power `p` of the depth
//! it leaves at `v (1 - (omega h)^2 / p)`, `omega` being that of the stiffness at that depth, so it gains no speed
//! only while `(omega h)^2 <= 2 p`. Where the force is linear (a contact all round, a point, `centreline-minima`)
//! the stiffest contact alone, counted twice ([`IMPACT`]), is another bound beside the sum; crossed wires
//! (`p = 3/2`) and patches (`p = 2`) are left as they are, the first because the lever `R` overstates by as much: wires
//! touch at `R - r` at most.
//!
//! # From the mode to the step
//! `verlet`: `omega h < 2` (the eigenvalue -1 of the step's matrix). Damping is implicit and sets no bound,
//! nor do drag and free spin, which are exact. `rk4`: stable for all eigenvalues in
//! the left half plane with `|lambda| h < 2.6` (its stability region reaches 2.62 at its narrowest, near
//! damping ratio 0.5); drag adds to `lambda`, and the quaternion of a spin `w` needs `|w| h / 2 < 2.6`.
//!
//! # Limits
//! An estimate, on the safe side in what has been measured (`docs/methods.md` has a table; `cargo bench -p sim-node
//! --bench stability` makes it), but not a proof. Rings that are linked lie on each other all round only where mail
//! is folded or heaped: that would cost every sheet a factor of two to three in its step, so it is not in the
//! bound; the plan says what it would be ([`Bound::lying_s`]), and the energy audit stops a run that gains by it.

mod extent;

use crate::body::Shape;
use crate::contact::material::{NormalLaw, PairMaterial};
use crate::model::Model;
use geometry::Vec3;
use schemas::scene::{ContactLaw, Integrator, OnRisk, Scene, Time};

/// By how much the stiffest linear contact counts, so that no impact gains speed: `(omega h)^2 <= 4 / IMPACT`.
const IMPACT: f64 = 2.0;
/// Bodies that one can touch at once: so many spheres of one size fit around another. More make no step shorter.
const NEIGHBOURS: usize = 12;
/// Radius of the half disc that lies in the stability region of the classical Runge-Kutta method.
const RK4_RADIUS: f64 = 2.6;
const PI: f64 = core::f64::consts::PI;

/// The share of the bound that an automatic step takes, and a subdivided one at most. At the bound a
/// contact's vibration is barely bounded; at half of it verlet follows it with about six steps a period.
pub(crate) const AUTO_SHARE: f64 = 0.5;

/// The step of a scene that leaves it to us (s): an integer part of the time between frames, so that frames
/// fall on steps, and at most [`AUTO_SHARE`] of the bound.
pub(crate) fn automatic_step(time: &Time, largest_s: f64) -> f64 {
    let frame = 1.0 / time.frames_per_second;
    let parts = libm::ceil(frame / (AUTO_SHARE * largest_s));
    if parts > 1.0 { frame / parts } else { frame }
}

/// The bound, and what sets it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bound {
    pub largest_s: f64,
    pub cause: String,
    /// What it would be if rings with links came to lie on each other all round, too (s).
    pub lying_s: f64,
}

impl Bound {
    fn tighten(&mut self, largest_s: f64, cause: impl FnOnce() -> String) {
        if largest_s < self.largest_s {
            (self.largest_s, self.cause) = (largest_s, cause());
        }
    }
}

/// The penetration that a time step covers, as a share of both wires' radii together, if the bound for the stated
/// one is `largest_s`: the stiffness of crossed wires goes with its root under `centreline-arc`, with itself under
/// `surface-integral`, and `verlet`'s bound with the root of that. Infinite where no step has a bound, or depth no
/// part in it.
pub(crate) fn covered_penetration(model: &Model, largest_s: f64) -> f64 {
    let stated = model.method().stability_penetration;
    if largest_s.is_infinite() || model.contact_law() == ContactLaw::CentrelineMinima {
        return f64::INFINITY;
    }
    let whole = model.time().time_step_s;
    let parts = AUTO_SHARE * largest_s;
    let in_parts = model.method().on_risk == OnRisk::Subdivide && parts < whole;
    let square = |x: f64| x * x;
    let longer = square(largest_s / if in_parts { parts } else { whole });
    let deeper = if model.contact_law() == ContactLaw::CentrelineArc { square(longer) } else { longer };
    // Of damping, which `rk4` has to bear, a part goes with more than the penetration itself.
    let grows = model.integrator() == Integrator::Verlet && deeper > 1.0;
    if grows { stated * deeper } else { stated }
}

/// Stiffness and damping per effective mass, summed over the contacts of a body (1/s^2, 1/s).
#[derive(Clone, Copy, Debug, Default)]
struct Stiffness {
    spring: f64,
    damper: f64,
    /// What the stiffest linear contact counts for its impacts (1/s^2).
    impact: f64,
}

impl Stiffness {
    fn add(&mut self, other: &Stiffness) {
        self.spring += other.spring;
        self.damper += other.damper;
        self.impact = larger(self.impact, other.impact);
    }

    /// The fastest vibration without damping (1/s).
    fn frequency(&self) -> f64 {
        larger(self.spring, self.impact).sqrt()
    }
}

/// One contact between two bodies: normal spring and damper, and friction's.
struct Contact<'a> {
    law: &'a NormalLaw,
    material: &'a PairMaterial,
    /// Length of the contact arc (m); 1 for a point; area of the patch under `surface-integral` (m^2).
    length: f64,
    /// Penetration for which it is stated (m).
    penetration: f64,
    /// Whether the force goes with the depth itself.
    linear: bool,
    /// Sum of both bodies' mobilities along the normal, and along the tangent (1/kg).
    normal_mobility: f64,
    tangent_mobility: f64,
}

impl Contact<'_> {
    fn stiffness(&self) -> Stiffness {
        let law = self.law;
        let normal_spring = law.stiffness * self.length;
        // The integral of k z d over a parabolic arc is 2/3 of this, over a whole circle all of it.
        let normal_damper =
            law.viscous_damping * self.length + law.rate_damping * normal_spring * self.penetration;
        let rubs = self.material.friction_coefficient > 0.0;
        let tangent_spring = if rubs { self.material.friction_stiffness } else { 0.0 };
        let tangent_damper = tangent_spring * law.damping_time(self.penetration);
        let normal = normal_spring * self.normal_mobility;
        Stiffness {
            impact: if self.linear { IMPACT * normal } else { 0.0 },
            spring: normal + tangent_spring * self.tangent_mobility,
            damper: normal_damper * self.normal_mobility + tangent_damper * self.tangent_mobility,
        }
    }
}

/// The largest time step; infinite where nothing sets a bound.
pub(crate) fn bound(scene: &Scene, model: &Model) -> Bound {
    let mut bound = Bound { largest_s: f64::INFINITY, cause: String::new(), lying_s: f64::INFINITY };
    let contacts = contacts(model);
    for (index, (sum, body)) in contacts.iter().zip(model.bodies()).enumerate() {
        if body.pinned {
            continue;
        }
        let name = || model.body_name(index as u32);
        let drags = [&body.linear_drag, &body.transverse_drag, &body.axial_drag];
        let inverses = [body.inverse_mass, body.inverse_transverse, body.inverse_axial];
        let drag_rate =
            drags.iter().zip(inverses).map(|(drag, inverse)| drag.drag * inverse).fold(0.0, larger);
        let drag_rate = drag_rate + quadratic_drag_rate(model, index);
        let largest = |sum: &Stiffness| match scene.method.integrator {
            Integrator::Verlet => 2.0 / sum.frequency(),
            Integrator::Rk4 => RK4_RADIUS / (fastest(sum) + drag_rate),
            // Inner steps find their own length; implicit ones have no bound.
            Integrator::Dopri5 | Integrator::BackwardEuler | Integrator::EnergyDecaying => f64::INFINITY,
        };
        if index < model.ring_count() && model.ring_count() > 2 {
            let mut lying = *sum;
            lying.add(&all_round(model, index as u32).stiffness());
            let lying_s = largest(&lying);
            bound.lying_s = if lying_s < bound.lying_s { lying_s } else { bound.lying_s };
        }
        bound.tighten(largest(sum), || {
            format!("the contacts of {} (its stiffest mode is {:.4e} rad/s)", name(), sum.frequency())
        });
        if scene.method.integrator == Integrator::Rk4 {
            let [x, y, z] = model.initial_bodies()[index].angular_velocity_rad_per_s;
            let spin = (x * x + y * y + z * z).sqrt();
            bound.tighten(2.0 * RK4_RADIUS / spin, || format!("the spin of {} ({spin:.4e} rad/s)", name()));
        }
    }
    bound
}

/// The rate at which quadratic drag takes deviations of velocity, at the larger of terminal speed and speed at
/// the start (1/s).
fn quadratic_drag_rate(model: &Model, index: usize) -> f64 {
    let body = &model.bodies()[index];
    let gravity = model.gravity().norm_squared().sqrt();
    let start = geometry::Vec3::from(model.initial_bodies()[index].linear_velocity_m_per_s);
    let terminal =
        if body.quadratic_drag > 0.0 { (body.mass_kg * gravity / body.quadratic_drag).sqrt() } else { 0.0 };
    2.0 * body.quadratic_drag * body.inverse_mass * larger(terminal, start.norm_squared().sqrt())
}

/// The larger absolute value of the roots of `x^2 + damper x + spring`.
fn fastest(sum: &Stiffness) -> f64 {
    let half = 0.5 * sum.damper;
    let frequency = sum.frequency();
    let discriminant = half * half - frequency * frequency;
    if discriminant > 0.0 { half + discriminant.sqrt() } else { frequency }
}

fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// For each body the sum over its contacts.
fn contacts(model: &Model) -> Vec<Stiffness> {
    let mut sums = vec![Stiffness::default(); model.body_count()];
    for &(a, b) in model.linked_pairs() {
        let stiffness = crossing(model, a, b).stiffness();
        sums[a as usize].add(&stiffness);
        sums[b as usize].add(&stiffness);
    }
    let rings = model.ring_count();
    if rings > 1 {
        for (loose, sum) in sums.iter_mut().enumerate().take(rings) {
            // A ring without links may lie on another one like itself, and under one.
            if sum.spring == 0.0 {
                let number = loose as u32;
                let crossed = crossing(model, number, number).stiffness();
                let lying = all_round(model, number).stiffness();
                *sum = if crossed.spring > lying.spring { crossed } else { lying };
                if rings > 2 {
                    sum.add(&lying);
                }
            }
        }
    }
    let obstacles = rings..model.body_count() + model.planes().len();
    // Of the rings that a sphere may meet, the stiffest counts: it may sit in one.
    let mut in_ring = vec![Stiffness::default(); model.body_count()];
    let mut met = Vec::new();
    for (index, sum) in sums.iter_mut().enumerate() {
        met.clear();
        for other in obstacles.clone().filter(|&other| other != index) {
            let solids = model.round_count()..model.body_count();
            let stiffness = if solids.contains(&index) || solids.contains(&other) {
                solid(model, index, other)
            } else {
                obstacle(model, index, other).stiffness()
            };
            met.push(stiffness);
            if index < rings && other < model.body_count() && stiffness.spring > in_ring[other].spring {
                in_ring[other] = stiffness;
            }
        }
        if met.len() > NEIGHBOURS {
            met.sort_by(|a, b| b.spring.total_cmp(&a.spring));
            met.truncate(NEIGHBOURS);
        }
        met.iter().for_each(|stiffness| sum.add(stiffness));
    }
    sums.iter_mut().zip(&in_ring).for_each(|(sum, ring)| sum.add(ring));
    sums
}

/// Two rings with crossed wires.
fn crossing(model: &Model, a: u32, b: u32) -> Contact<'_> {
    let first = a;
    let material = model.pair_material(a, b);
    let (a, b) = (&model.bodies()[a as usize], &model.bodies()[b as usize]);
    let reach = a.minor_radius + b.minor_radius;
    let penetration = model.method().stability_penetration * reach;
    let curvature = 1.0 / reach - 1.0 / a.major_radius;
    let whole = 2.0 * PI * a.major_radius;
    let crossed = 2.0 * (2.0 * penetration / curvature).sqrt();
    // Wires nearly as thick as their ring bend around each other all the way.
    let length = if curvature > 0.0 && crossed < whole { crossed } else { whole };
    let area = extent::crossed_area(a, b, penetration);
    Contact {
        law: model.normal_law(material, first),
        material,
        length: extent::of(model, length, area, a),
        penetration,
        linear: model.contact_law() == ContactLaw::CentrelineMinima,
        normal_mobility: a.mobility_at(a.major_radius) + b.mobility_at(b.major_radius),
        tangent_mobility: a.mobility_at(a.bounding_radius) + b.mobility_at(b.bounding_radius),
    }
}

/// A ring and another one like it, coaxial: they touch all round.
fn all_round(model: &Model, ring: u32) -> Contact<'_> {
    let material = model.pair_material(ring, ring);
    let body = &model.bodies()[ring as usize];
    let penetration = model.method().stability_penetration * 2.0 * body.minor_radius;
    let length = 2.0 * PI * body.major_radius;
    Contact {
        law: model.normal_law(material, ring),
        material,
        length: extent::of(model, length, extent::resting_area(body, penetration), body),
        penetration,
        linear: model.contact_law() != ContactLaw::SurfaceIntegral,
        // The push acts at the centre; a tilt by `R sin t` along the circle, whose square is a half in the mean.
        normal_mobility: 2.0 * body.inverse_mass,
        tangent_mobility: 2.0 * body.mobility_at(body.bounding_radius),
    }
}

/// A body on a sphere or plane: a ring touches all round and is pushed straight on, a sphere at a point.
fn obstacle(model: &Model, index: usize, other: usize) -> Contact<'_> {
    let (low, high) = if other < index { (other, index) } else { (index, other) };
    let material = model.pair_material(low as u32, high as u32);
    let body = &model.bodies()[index];
    let ring = index < model.ring_count();
    let (thinner, other_normal, other_tangent) = match model.bodies().get(other) {
        Some(other) => {
            let thinner =
                if other.minor_radius < body.minor_radius { other.minor_radius } else { body.minor_radius };
            (thinner, other.inverse_mass, other.mobility_at(other.bounding_radius))
        }
        None => (body.minor_radius, 0.0, 0.0),
    };
    let penetration = model.method().stability_penetration * thinner;
    // A sphere by Hertz's law: its slope at that depth, as so many of the point law's springs.
    let hertz = 2.0 * material.sphere_modulus * (body.minor_radius * penetration).sqrt();
    let point = if hertz > 0.0 { hertz / material.point.stiffness } else { 1.0 };
    let length = if ring { 2.0 * PI * body.major_radius } else { point };
    let area = extent::resting_area(body, penetration);
    Contact {
        law: model.normal_law(material, low as u32),
        material,
        length: extent::of(model, length, area, body),
        penetration,
        linear: model.contact_law() != ContactLaw::SurfaceIntegral && hertz == 0.0,
        normal_mobility: body.inverse_mass + other_normal,
        tangent_mobility: body.mobility_at(body.bounding_radius) + other_tangent,
    }
}

/// A capsule or box and anything else: all lines and points of the carrier that can lie on the other body at
/// once, each where it moves both bodies most.
fn solid(model: &Model, index: usize, other: usize) -> Stiffness {
    let (low, high) = if other < index { (other, index) } else { (index, other) };
    let material = model.pair_material(low as u32, high as u32);
    let carrier = &model.bodies()[low];
    let (mut length, mut points) = (0.0, 0.0);
    let mut add_face = |core: &Vec3| {
        // The four edges and corners of the largest face.
        let least = if core.x < core.y { core.x } else { core.y };
        length += 4.0 * (core.x + core.y + core.z - if core.z < least { core.z } else { least });
        points += 4.0;
    };
    match (&carrier.shape, model.bodies().get(high).map(|body| &body.shape)) {
        (Shape::Box { .. }, None) => points = 4.0,
        (Shape::Box { core_m: a, .. }, Some(Shape::Box { core_m: b, .. })) => {
            add_face(a);
            add_face(b);
        }
        (Shape::Ring { major_radius_m, .. }, _) => length = 2.0 * PI * major_radius_m,
        (Shape::Capsule { half_length_m, .. }, _) => (length, points) = (2.0 * half_length_m, 2.0),
        _ => points = 1.0,
    }
    let (mut wire, mut mobility) = (carrier.bounding_radius, 0.0);
    for body in [Some(carrier), model.bodies().get(high)].into_iter().flatten() {
        mobility += body.mobility_at(body.bounding_radius);
        if body.minor_radius > 0.0 && body.minor_radius < wire {
            wire = body.minor_radius;
        }
    }
    let mut sum = Stiffness::default();
    for (law, length) in [(&material.line, length), (&material.point, points)] {
        let penetration = model.method().stability_penetration * wire;
        let contact = Contact {
            law,
            material,
            length,
            penetration,
            linear: true,
            normal_mobility: mobility,
            tangent_mobility: mobility,
        };
        if length > 0.0 {
            sum.add(&contact.stiffness());
        }
    }
    sum
}

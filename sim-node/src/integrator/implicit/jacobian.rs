//! How contact forces change with place and velocity: the stiffness and damping of each point of a contact,
//! as the rank-one block of its screw.
//!
//! At a point with the normal `n` and the lever `l` from a body's centre the screw is `s = (n, l x n)`: the
//! rate of penetration is `-(s_A . V_A - s_B . V_B)`, and the force on A is `f s_A`. The part of `dF/dx` that is
//! kept is `-k (1 + z d') s s^T` per length, and of `dF/dv` `-(k d z + c) s s^T`. Left out are the terms in which the
//! normal turns, `k d / D` across it: they are smaller by penetration over thickness, and of the sign that
//! could make the matrix indefinite. So the matrix is positive definite, and Newton's iteration converges
//! linearly by that ratio instead of quadratically; the residual is that of the true forces.
//!
//! # Friction
//! The spring and the damper of a contact act along its tangents, with the same kind of screw at the force centre. Where it
//! sticks both tangents count; where it slides, the one across the sliding, by the share that Coulomb's limit leaves.
//! That the limit follows the normal force is left out: it would make the matrix unsymmetric.

use super::system::{Block, Six, System, add_outer};
use crate::body::Body;
use crate::contact::PairForce;
use crate::contact::friction::Rub;
use crate::contact::material::{NormalLaw, PairMaterial};
use crate::wrench::relative_velocity;
use crate::{Model, Scratch};
use geometry::arc::{circle_circle_arcs, circle_plane_arcs, circle_point_arcs, rule_for};
use geometry::minima::{Minima, circle_circle_minima, circle_plane_minima, circle_point_minima};
use geometry::{Arcs, Circle, Vec3};
use schemas::scene::ContactLaw;

/// How much of a pair's stiffness (s^2) and damping (s) goes into the matrix: of the normal forces and of friction.
#[derive(Clone, Copy, Default)]
pub(super) struct Share {
    pub stiffness: f64,
    pub damping: f64,
    pub friction_stiffness: f64,
    pub friction_damping: f64,
}

/// How stiff a pair's contact is against the inertia of its bodies, summed over its points.
#[derive(Clone, Copy, Default)]
pub(super) struct Rates {
    /// Square of a circular frequency (1/s^2).
    pub spring: f64,
    /// Rate of decay (1/s).
    pub damper: f64,
}

/// A point of a contact.
struct Point {
    on_a: Six,
    on_b: Six,
    stiffness: f64,
    damping: f64,
    /// Of the penetration, or of the slip (m/s).
    rate: f64,
    friction: bool,
}

/// One pair at one moment.
struct Pair<'a> {
    law: NormalLaw,
    a: &'a Circle,
    from_b: Vec3,
    relative: crate::wrench::Velocity,
    minima: bool,
    points: Vec<Point>,
}

impl Pair<'_> {
    fn add(&mut self, lever: &Vec3, normal: &Vec3, penetration: f64, length: f64) {
        if !(penetration > 0.0) {
            return;
        }
        let turn = lever.cross(normal);
        let rate = -(self.relative.linear.dot(normal) + self.relative.angular.dot(&turn));
        let law = &self.law;
        if !(law.push(penetration, rate, 0.0) > 0.0) {
            return;
        }
        let stiffness = law.stiffness * (1.0 + law.rate_damping * rate) * length;
        let damping = (law.stiffness * penetration * law.rate_damping + law.viscous_damping) * length;
        let turn_b = (lever + self.from_b).cross(normal);
        let on_a: Six = [normal.x, normal.y, normal.z, turn.x, turn.y, turn.z];
        let on_b: Six = [normal.x, normal.y, normal.z, turn_b.x, turn_b.y, turn_b.z];
        self.points.push(Point { on_a, on_b, stiffness, damping, rate, friction: false });
    }

    /// The tangents of a contact that rubs.
    fn rub(&mut self, rub: &Rub, stiffness: f64) {
        let size = rub.force.norm_squared().sqrt();
        let slides = rub.share < 1.0 && size > 0.0;
        let n = &rub.normal;
        // Any tangent, or the one along which it slides.
        let least = if n.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
        let first = if slides { rub.force * (1.0 / size) } else { unit_or(n.cross(&least), &Vec3::x()).0 };
        let second = n.cross(&first);
        for (tangent, share) in [(first, if slides { 0.0 } else { rub.share }), (second, rub.share)] {
            let turn = rub.lever.cross(&tangent);
            let turn_b = (rub.lever + self.from_b).cross(&tangent);
            let rate = -(self.relative.linear.dot(&tangent) + self.relative.angular.dot(&turn));
            self.points.push(Point {
                on_a: [tangent.x, tangent.y, tangent.z, turn.x, turn.y, turn.z],
                on_b: [tangent.x, tangent.y, tangent.z, turn_b.x, turn_b.y, turn_b.z],
                stiffness: stiffness * share,
                damping: rub.damper * share,
                rate,
                friction: true,
            });
        }
    }

    /// The points of contact arcs, as `contact` takes them.
    fn along(
        &mut self,
        arcs: &Arcs,
        reach: f64,
        minima: impl Fn() -> Minima,
        closest: impl Fn(&Vec3) -> (Vec3, f64),
    ) {
        let radius = self.a.radius;
        let (u, w) = (self.a.u * radius, self.a.w * radius);
        if self.minima && !arcs.is_empty() {
            for minimum in minima().as_slice() {
                let lever = u * minimum.cos + w * minimum.sin;
                let (normal, distance) = closest(&lever);
                self.add(&lever, &normal, reach - distance, minimum.share);
            }
            return;
        }
        for arc in arcs.iter() {
            for point in arc.nodes(rule_for(arc.half_tangent, radius / reach)) {
                let lever = u * point.cos + w * point.sin;
                let (normal, distance) = closest(&lever);
                self.add(&lever, &normal, reach - distance, point.weight * radius);
            }
        }
    }

    /// A sphere's contact point, by Hertz's law where there is one: its slope is 3/2 of the secant.
    fn at_sphere(&mut self, material: &PairMaterial, normal: &Vec3, (penetration, radius): (f64, f64)) {
        if material.sphere_modulus > 0.0 && penetration > 0.0 {
            self.law = self.law.hertz(material.sphere_modulus, radius, penetration);
            self.law.stiffness *= 1.5;
        }
        self.add(&Vec3::zeros(), normal, penetration, 1.0);
    }

    fn rates(&self, a: &Free, b: Option<&Free>) -> Rates {
        let mut rates = Rates::default();
        for point in &self.points {
            let mobility = a.mobility(&point.on_a) + b.map_or(0.0, |b| b.mobility(&point.on_b));
            rates.spring += point.stiffness * mobility;
            rates.damper += point.damping * mobility;
        }
        rates
    }
}

/// A body that may move, in its place.
struct Free<'a> {
    body: &'a Body,
    frame: &'a Circle,
}

impl Free<'_> {
    /// Rate along a screw that a unit impulse along it makes (1/kg).
    fn mobility(&self, [x, y, z, a, b, c]: &Six) -> f64 {
        let (normal, turn) = (Vec3::new(*x, *y, *z), Vec3::new(*a, *b, *c));
        let spin = super::spin_of(self.body, self.frame, &turn);
        self.body.inverse_mass * normal.norm_squared() + spin.dot(&turn)
    }
}

fn unit_or(vector: Vec3, fallback: &Vec3) -> (Vec3, f64) {
    let length = vector.norm_squared().sqrt();
    if length > 0.0 { (vector * (1.0 / length), length) } else { (*fallback, 0.0) }
}

/// Adds the contacts of all pairs at the moment of the last evaluation, each with the share that `share` says for
/// the pair; to `right`, if there is one, the impulses of a damper as strong as the matrix, at the rates as they are.
pub(super) fn add_contacts(
    model: &Model,
    scratch: &Scratch,
    system: &mut System,
    mut right: Option<&mut Vec<Six>>,
    mut share: impl FnMut((u32, u32), Rates) -> Share,
) {
    let moment = &scratch.moment;
    let rings = model.ring_count();
    let mut rubbing: Vec<&PairForce> = Vec::new();
    if model.features.friction {
        rubbing.extend(scratch.evaluation.pair_forces());
        rubbing.sort_by_key(|force| (force.a, force.b));
    }
    for &(a, b) in scratch.evaluation.candidates(model, moment) {
        let (index_a, index_b) = (a as usize, b as usize);
        let circle_a = &moment.circles[index_a];
        let (material, body_a) = (model.pair_material(a, b), &model.bodies()[index_a]);
        let moving_b = model.bodies().get(index_b);
        let from_b = match moving_b {
            Some(_) => circle_a.centre - moment.circles[index_b].centre,
            None => Vec3::zeros(),
        };
        let velocities = &moment.velocities;
        let relative = match moving_b {
            Some(_) => relative_velocity(&velocities[index_a], &velocities[index_b], &from_b),
            None => velocities[index_a],
        };
        let mut pair = Pair {
            law: *model.normal_law(material, a),
            a: circle_a,
            from_b,
            relative,
            minima: model.contact_law() == ContactLaw::CentrelineMinima,
            points: Vec::new(),
        };
        match moving_b {
            Some(body_b) => {
                let circle_b = &moment.circles[index_b];
                let radii = (body_a.minor_radius, body_b.minor_radius);
                two_bodies(&mut pair, material, (index_a < rings, index_b < rings), circle_b, radii);
            }
            None => {
                let plane = &model.planes()[index_b - model.body_count()];
                let height = plane.normal.dot(&circle_a.centre) - plane.offset;
                let reach = body_a.minor_radius;
                if index_a < rings {
                    let arcs = circle_plane_arcs(circle_a, &plane.normal, plane.offset, reach);
                    let closest = |lever: &Vec3| (plane.normal, height + plane.normal.dot(lever));
                    pair.along(&arcs, reach, || circle_plane_minima(circle_a, &plane.normal), closest);
                } else {
                    pair.at_sphere(material, &plane.normal, (reach - height, reach));
                }
            }
        }
        if pair.points.is_empty() {
            continue;
        }
        if let Ok(place) = rubbing.binary_search_by_key(&(a, b), |force| (force.a, force.b)) {
            for rub in rubbing[place].rubs.iter().filter(|rub| rub.share > 0.0) {
                pair.rub(rub, material.friction_stiffness);
            }
        }
        let free_b = moving_b.map(|body| Free { body, frame: &moment.circles[index_b] });
        let rates = pair.rates(&Free { body: body_a, frame: circle_a }, free_b.as_ref());
        put(model, (a, b), &pair.points, share((a, b), rates), system, right.as_deref_mut());
    }
}

fn two_bodies(
    pair: &mut Pair,
    material: &PairMaterial,
    (a_is_ring, b_is_ring): (bool, bool),
    b: &Circle,
    (radius_a, radius_b): (f64, f64),
) {
    let (a, from_b, reach) = (pair.a, pair.from_b, radius_a + radius_b);
    if !a_is_ring {
        let (normal, distance) = unit_or(from_b, &Vec3::z());
        pair.at_sphere(material, &normal, (reach - distance, radius_a * radius_b / reach));
    } else if b_is_ring {
        let arcs = circle_circle_arcs(a, b, reach);
        let closest = |lever: &Vec3| {
            let d = from_b + lever;
            let height = d.dot(&b.normal);
            let across = d - b.normal * height;
            let rho = across.norm_squared().sqrt();
            if !(rho > 0.0) {
                return unit_or(b.normal * height - b.u * b.radius, &b.normal);
            }
            unit_or(d - across * (b.radius / rho), &b.normal)
        };
        pair.along(&arcs, reach, || circle_circle_minima(a, b, &arcs), closest);
    } else {
        let arcs = circle_point_arcs(a, &b.centre, reach);
        let closest = |lever: &Vec3| unit_or(from_b + lever, &a.normal);
        pair.along(&arcs, reach, || circle_point_minima(a, &b.centre), closest);
    }
}

/// Into the rows of the bodies that can move.
fn put(
    model: &Model,
    (a, b): (u32, u32),
    points: &[Point],
    share: Share,
    system: &mut System,
    right: Option<&mut Vec<Six>>,
) {
    let moves = |body: u32| model.bodies().get(body as usize).is_some_and(|body| !body.pinned);
    let (a_moves, b_moves) = (moves(a), moves(b));
    let zero: Block = [[0.0; 6]; 6];
    let (mut of_a, mut of_b, mut between) = (zero, zero, zero);
    let (mut push_a, mut push_b) = ([0.0; 6], [0.0; 6]);
    for point in points {
        let (of_stiffness, of_damping) = if point.friction {
            (share.friction_stiffness, share.friction_damping)
        } else {
            (share.stiffness, share.damping)
        };
        let weight = of_stiffness * point.stiffness + of_damping * point.damping;
        if !(weight > 0.0) {
            continue;
        }
        add_outer(&mut of_a, weight, &point.on_a, &point.on_a);
        add_outer(&mut between, -weight, &point.on_a, &point.on_b);
        add_outer(&mut of_b, weight, &point.on_b, &point.on_b);
        for i in 0..6 {
            push_a[i] += weight * point.rate * point.on_a[i];
            push_b[i] -= weight * point.rate * point.on_b[i];
        }
    }
    let add = |sum: &mut Block, block: &Block| {
        for (sum, row) in sum.iter_mut().zip(block) {
            sum.iter_mut().zip(row).for_each(|(a, b)| *a += b);
        }
    };
    if a_moves {
        add(&mut system.diagonal[a as usize], &of_a);
    }
    if b_moves {
        add(&mut system.diagonal[b as usize], &of_b);
    }
    if a_moves && b_moves {
        system.coupling.push((a, b, between));
    }
    if let Some(right) = right {
        let mut push = |body: u32, six: &Six| {
            right[body as usize].iter_mut().zip(six).for_each(|(a, b)| *a += b);
        };
        if a_moves {
            push(a, &push_a);
        }
        if b_moves {
            push(b, &push_b);
        }
    }
}

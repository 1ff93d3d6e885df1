//! How contact forces change with place and velocity: the stiffness and damping of each point of a contact,
//! as the rank-one block of its screw.
//!
//! At a point with the normal `n` and the lever `l` from a body's centre the screw is `s = (n, l x n)`: the
//! rate of penetration is `-(s_A . V_A - s_B . V_B)`, and the force on A is `f s_A`. The part of `dF/dx` that is
//! kept is `-k (1 + z d') s s^T` per length, and of `dF/dv` `-(k d z + c) s s^T`. Left out are the terms in which the
//! normal turns, `k d / D` across it: they are smaller by penetration over thickness, and of the sign that
//! could make the matrix indefinite. So the matrix is positive definite, and Newton's iteration converges
//! linearly by that ratio instead of quadratically; the residual is that of the true forces.

use super::system::{Block, Six, System, add_outer};
use crate::Model;
use crate::contact::material::NormalLaw;
use crate::forces::Moment;
use crate::wrench::relative_velocity;
use geometry::arc::{circle_circle_arcs, circle_plane_arcs, circle_point_arcs, rule_for};
use geometry::{Arcs, Circle, Vec3};

/// A pair's blocks while they are added up.
struct Blocks {
    aa: Block,
    ab: Block,
    bb: Block,
}

/// One pair at one moment.
struct Pair<'a> {
    law: NormalLaw,
    a: &'a Circle,
    from_b: Vec3,
    relative: crate::wrench::Velocity,
    /// Time by which a velocity moves the bodies (s).
    time: f64,
    blocks: Blocks,
    touched: bool,
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
        let stiffness = law.stiffness * (1.0 + law.rate_damping * rate);
        let damping = law.stiffness * penetration * law.rate_damping + law.viscous_damping;
        let weight = self.time * (self.time * stiffness + damping) * length;
        if !(weight > 0.0) {
            return;
        }
        self.touched = true;
        let turn_b = (lever + self.from_b).cross(normal);
        let on_a: Six = [normal.x, normal.y, normal.z, turn.x, turn.y, turn.z];
        let on_b: Six = [normal.x, normal.y, normal.z, turn_b.x, turn_b.y, turn_b.z];
        add_outer(&mut self.blocks.aa, weight, &on_a, &on_a);
        add_outer(&mut self.blocks.ab, -weight, &on_a, &on_b);
        add_outer(&mut self.blocks.bb, weight, &on_b, &on_b);
    }

    /// The points of contact arcs, as `contact` takes them.
    fn along(&mut self, arcs: &Arcs, reach: f64, closest: impl Fn(&Vec3) -> (Vec3, f64)) {
        let radius = self.a.radius;
        let (u, w) = (self.a.u * radius, self.a.w * radius);
        for arc in arcs.iter() {
            for point in arc.nodes(rule_for(arc.half_tangent, radius / reach)) {
                let lever = u * point.cos + w * point.sin;
                let (normal, distance) = closest(&lever);
                self.add(&lever, &normal, reach - distance, point.weight * radius);
            }
        }
    }
}

fn unit_or(vector: Vec3, fallback: &Vec3) -> (Vec3, f64) {
    let length = vector.norm_squared().sqrt();
    if length > 0.0 { (vector * (1.0 / length), length) } else { (*fallback, 0.0) }
}

/// Adds the contacts of all pairs; `time` as in [`Pair`].
pub(super) fn add_contacts<'p>(
    model: &Model,
    moment: &Moment,
    pairs: impl Iterator<Item = &'p (u32, u32)>,
    time: f64,
    system: &mut System,
) {
    let rings = model.ring_count();
    for &(a, b) in pairs {
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
        let zero = [[0.0; 6]; 6];
        let mut pair = Pair {
            law: if index_a < rings { material.line } else { material.point },
            a: circle_a,
            from_b,
            relative,
            time,
            blocks: Blocks { aa: zero, ab: zero, bb: zero },
            touched: false,
        };
        match moving_b {
            Some(body_b) => {
                let reach = body_a.minor_radius + body_b.minor_radius;
                let circle_b = &moment.circles[index_b];
                two_bodies(&mut pair, (index_a < rings, index_b < rings), circle_b, reach);
            }
            None => {
                let plane = &model.planes()[index_b - model.body_count()];
                let height = plane.normal.dot(&circle_a.centre) - plane.offset;
                let reach = body_a.minor_radius;
                if index_a < rings {
                    let arcs = circle_plane_arcs(circle_a, &plane.normal, plane.offset, reach);
                    let closest = |lever: &Vec3| (plane.normal, height + plane.normal.dot(lever));
                    pair.along(&arcs, reach, closest);
                } else {
                    pair.add(&Vec3::zeros(), &plane.normal, reach - height, 1.0);
                }
            }
        }
        put(model, (a, b), &pair, system);
    }
}

fn two_bodies(pair: &mut Pair, (a_is_ring, b_is_ring): (bool, bool), b: &Circle, reach: f64) {
    let from_b = pair.from_b;
    if !a_is_ring {
        let (normal, distance) = unit_or(from_b, &Vec3::z());
        pair.add(&Vec3::zeros(), &normal, reach - distance, 1.0);
    } else if b_is_ring {
        let arcs = circle_circle_arcs(pair.a, b, reach);
        pair.along(&arcs, reach, |lever| {
            let d = from_b + lever;
            let height = d.dot(&b.normal);
            let across = d - b.normal * height;
            let rho = across.norm_squared().sqrt();
            if !(rho > 0.0) {
                return unit_or(b.normal * height - b.u * b.radius, &b.normal);
            }
            unit_or(d - across * (b.radius / rho), &b.normal)
        });
    } else {
        let fallback = pair.a.normal;
        let arcs = circle_point_arcs(pair.a, &b.centre, reach);
        pair.along(&arcs, reach, |lever| unit_or(from_b + lever, &fallback));
    }
}

/// Into the rows of the bodies that can move.
fn put(model: &Model, (a, b): (u32, u32), pair: &Pair, system: &mut System) {
    if !pair.touched {
        return;
    }
    let moves = |body: u32| model.bodies().get(body as usize).is_some_and(|body| !body.pinned);
    let add = |sum: &mut Block, block: &Block| {
        for (sum, row) in sum.iter_mut().zip(block) {
            sum.iter_mut().zip(row).for_each(|(a, b)| *a += b);
        }
    };
    if moves(a) {
        add(&mut system.diagonal[a as usize], &pair.blocks.aa);
    }
    if moves(b) {
        add(&mut system.diagonal[b as usize], &pair.blocks.bb);
    }
    if moves(a) && moves(b) {
        system.coupling.push((a, b, pair.blocks.ab));
    }
}

//! A method of second order whose contacts never add energy, and lose it where the step does not resolve them.
//!
//! The one thing to know: poses move with the *mean* velocity of the step, as in the midpoint rule, so that the
//! kinetic energy changes by exactly the work of the mean force; and each pair's mean force is chosen between the
//! trapezoidal rule's and the end's so that it takes at least the energy that the contact stores.
//!
//! # The equations
//! The unknowns are mean velocities `V = (v, w)` of a step of length `h`: `x1 = x0 + h v`, `q1 = cay(h w) q0`,
//! `m (v1 - v0) = h F`, `L1 - L0 = h T`, with `v = (v0 + v1) / 2` and, for a symmetric top,
//! `w = L_m / I1 + (1/I3 - 1/I1) s_m n_m`, where `L_m`, `n_m` and `s_m` are the means of the momenta `L`, the axes `n` and
//! the spins `L . n` at both ends. Cayley's rotation makes `n1 - n0 = h w x n_m`, and so the kinetic energy changes
//! by exactly `h (F . v + T . w)`. A free top keeps energy and momentum to rounding.
//!
//! # The force of a pair
//! With `G0`, `G1` the pair's forces at the start and the end, and `N0`, `N1` the sums of their pressures,
//! `G = (G0 + G1)/2 * N / ((N0 + N1)/2)` with `N = ((1 - a) N0 + (1 + a) N1)/2`: the direction is that of
//! the trapezoidal rule, the size shifted towards the end by `a` in 0..1, which is the larger of
//! - `s / (s + 4)` with `s = (omega h)^2` of the pair's stiffest mode, so that unresolved contacts are
//!   implicit and resolved ones keep second order;
//! - what energy demands: that the work of `G`'s elastic part against the contact is at least the growth of the
//!   contact's energy. For a convex energy `a = 1` always does; where nothing begins or ends, it is of the size of `h`.
//!
//! # What is left of unresolved vibrations
//! `a = 1` brings the penetration of an unresolved contact to rest in one step, but its velocity only turns round.
//! So the velocities at the end are slowed by an implicit damper in each contact, of `h k s / (s + 4)`: one linear
//! system, which can only take energy. Motions in which surfaces do not approach are not touched by either, so
//! a sheet that swings on stiff contacts keeps second order.
//!
//! # Friction
//! Friction is that of the end alone, its springs stretched by `h` times the mean slip: first order, any friction
//! stiffness is stable, and the springs' energy only falls. Where a contact sticks the damper acts along it, too.
//!
//! # Source
//! The mean velocities: J. C. Simo, K. K. Wong, "Unconditionally stable algorithms for rigid body dynamics that exactly
//! preserve energy and momentum", Int. J. Numer. Methods Eng. 31 (1991). Forces from energies:
//! O. Gonzalez, "Time integration and discrete Hamiltonian systems", J. Nonlinear Sci. 6 (1996), and, for contact,
//! F. Armero, E. Petocz, Comput. Methods Appl. Mech. Eng. 158 (1998). Deviations: a choice of `a` for each pair instead
//! of their discrete gradients, and the damper.

use super::jacobian::{self, Rates, Share};
use super::system::{Six, System};
use super::touches::{Touch, touches};
use super::{Equations, Found, Part, drag, drag_power, frame, halves, spin_of};
use crate::forces::SlipMotion;
use crate::state::{Motion, renormalised};
use crate::wrench::Velocity;
use crate::{Scratch, motion};
use geometry::Vec3;
use nalgebra::{Quaternion, UnitQuaternion};

/// `(omega h)^2` at which a contact counts as half resolved.
const RESOLVED: f64 = 4.0;
/// Iterations after which a pair's `a` may only rise, and after which it stays.
const RISING: usize = 6;
const FROZEN: usize = 20;

pub(super) struct EnergyDecaying<'a> {
    part: Part<'a>,
    /// The pairs in contact at the start or the end, in order.
    pairs: Vec<Blend>,
    /// Of all bodies about their centres at the end (kg m^2/s).
    momenta: Vec<Vec3>,
    /// Mean velocities of all bodies.
    means: Vec<Velocity>,
}

/// What is known of a pair.
struct Blend {
    pair: (u32, u32),
    start: Touch,
    end: Touch,
    /// `s / (s + 4)` at the start.
    least: f64,
    shift: f64,
}

impl Blend {
    /// `N` over `(N0 + N1) / 2`.
    fn factor(&self) -> f64 {
        let sum = self.start.size + self.end.size;
        if sum > 0.0 { 1.0 + self.shift * (self.end.size - self.start.size) / sum } else { 1.0 }
    }

    /// The `a` that energy demands, for the sum of the powers of both ends' elastic forces at the mean velocities.
    fn demanded(&self, length: f64, power: f64) -> f64 {
        let stored = self.end.energy - self.start.energy;
        let taken = -0.5 * length * power;
        let (sum, growth) = (self.start.size + self.end.size, self.end.size - self.start.size);
        let shift = (stored / taken - 1.0) * sum / growth;
        // Also where it is 0/0: nothing is demanded.
        if shift > 0.0 { if shift < 1.0 { shift } else { 1.0 } } else { 0.0 }
    }
}

impl<'a> EnergyDecaying<'a> {
    /// Looks at the forces where the part starts.
    pub(super) fn new(part: Part<'a>, scratch: &mut Scratch) -> EnergyDecaying<'a> {
        let model = part.model;
        for (index, (body, base)) in model.bodies().iter().zip(part.base).enumerate() {
            let motion = Motion {
                position: base.position,
                orientation: base.orientation,
                linear: base.linear,
                angular: base.angular,
            };
            scratch.moment.circles[index] = frame(body, &motion);
            scratch.moment.velocities[index] = Velocity { linear: base.linear, angular: base.angular };
        }
        let velocities = scratch.moment.velocities.clone();
        evaluate(&Part { length: 0.0, ..part }, scratch, &velocities);
        let of_start = |start: Touch| {
            let pair = start.pair;
            Blend { pair, start, end: Touch::none(pair), least: 0.0, shift: 0.0 }
        };
        let mut decaying = EnergyDecaying {
            part,
            pairs: touches(scratch).into_iter().map(of_start).collect(),
            momenta: vec![Vec3::zeros(); model.body_count()],
            means: velocities,
        };
        let mut system = part.masses(scratch, &vec![[0.0; 6]; model.body_count()], 1.0);
        jacobian::add_contacts(model, scratch, &mut system, None, |pair, rates| {
            if let Some(blend) = find(&mut decaying.pairs, pair) {
                blend.least = unresolved(rates, part.length);
                blend.shift = blend.least;
            }
            Share::default()
        });
        decaying
    }

    /// Pose and velocity at the end for mean velocities, and the momentum about the centre.
    fn end(&self, index: usize, mean: &Six) -> (Motion, Vec3) {
        let (body, base, length) =
            (&self.part.model.bodies()[index], &self.part.base[index], self.part.length);
        let (v, w) = halves(mean);
        let half = w * (0.5 * length);
        let turn = Quaternion::new(1.0, half.x, half.y, half.z);
        let turn = turn * (1.0 / turn.norm_squared().sqrt());
        let orientation = renormalised(UnitQuaternion::new_unchecked(turn * base.orientation.into_inner()));
        let mut motion = Motion {
            position: base.position + v * length,
            orientation,
            linear: v * 2.0 - base.linear,
            angular: Vec3::zeros(),
        };
        let frame = frame(body, &motion);
        let (axis, before) = (frame.normal, &base.angular_momentum);
        let middle = (axis + base.axis) * 0.5;
        // I1 (1/I3 - 1/I1)
        let oblate = body.inertia_transverse_kg_m2 / body.inertia_axial_kg_m2 - 1.0;
        let i1w = w * body.inertia_transverse_kg_m2;
        let turned = 0.5 * (before.dot(&base.axis) - before.dot(&axis));
        let spin = (turned + i1w.dot(&axis)) / (1.0 + oblate * middle.dot(&axis));
        let momentum = (i1w - middle * (oblate * spin)) * 2.0 - before;
        motion.angular = spin_of(body, &frame, &momentum);
        (motion, momentum)
    }

    /// The mean velocity of a body; a plane has none.
    fn mean(&self, body: u32) -> Velocity {
        self.means.get(body as usize).copied().unwrap_or(Velocity::ZERO)
    }

    /// Takes over the forces of the last evaluation.
    fn take_ends(&mut self, scratch: &Scratch) {
        self.pairs.iter_mut().for_each(|blend| blend.end = Touch::none(blend.pair));
        for end in touches(scratch) {
            let pair = end.pair;
            match self.pairs.binary_search_by_key(&pair, |blend| blend.pair) {
                Ok(place) => self.pairs[place].end = end,
                Err(place) => {
                    let start = Touch::none(pair);
                    self.pairs.insert(place, Blend { pair, start, end, least: 0.0, shift: 1.0 });
                }
            }
        }
    }
}

fn find(pairs: &mut [Blend], pair: (u32, u32)) -> Option<&mut Blend> {
    pairs.binary_search_by_key(&pair, |blend| blend.pair).ok().map(|place| &mut pairs[place])
}

/// `s / (s + 4)`.
fn unresolved(rates: Rates, length: f64) -> f64 {
    let s = length * length * (rates.spring + rates.damper * rates.damper);
    // Of an infinite one, too.
    1.0 - RESOLVED / (s + RESOLVED)
}

/// Forces at the moment in the scratch, friction's springs stretched by mean velocities over the part's length.
fn evaluate(part: &Part, scratch: &mut Scratch, means: &[Velocity]) {
    let Scratch { evaluation, moment, pool, .. } = scratch;
    let slip = SlipMotion { since: (means, part.length), kept: (means, part.length) };
    evaluation.evaluate(part.model, moment, part.springs, slip, pool.as_deref());
}

impl Equations for EnergyDecaying<'_> {
    fn evaluate(&mut self, scratch: &mut Scratch, velocities: &[Six]) {
        let Part { model, end, .. } = self.part;
        for (index, (body, velocity)) in model.bodies().iter().zip(velocities).enumerate() {
            let (motion, momentum) = self.end(index, velocity);
            scratch.moment.circles[index] = frame(body, &motion);
            scratch.moment.velocities[index] = Velocity { linear: motion.linear, angular: motion.angular };
            self.momenta[index] = momentum;
            let (linear, angular) = halves(velocity);
            self.means[index] = Velocity { linear, angular };
        }
        motion::place(model, end, &mut scratch.moment);
        for index in model.driven().iter().map(|driven| driven.body as usize) {
            let (base, end) = (&self.part.base[index], &scratch.moment.velocities[index]);
            let (linear, angular) = (base.linear + end.linear, base.angular + end.angular);
            self.means[index] = Velocity { linear: linear * 0.5, angular: angular * 0.5 };
        }
        evaluate(&self.part, scratch, &self.means);
        self.take_ends(scratch);
    }

    fn residual(&self, scratch: &Scratch, velocities: &[Six]) -> Vec<Six> {
        let Part { model, length, base, .. } = self.part;
        let mut lack = vec![[0.0; 6]; velocities.len()];
        for (index, (body, velocity)) in model.bodies().iter().zip(velocities).enumerate() {
            if body.pinned {
                continue;
            }
            let (v, w) = halves(velocity);
            let force = model.gravity() * body.mass_kg - v * drag(body, &v);
            let change = scratch.moment.velocities[index].linear - base[index].linear;
            let r = change * body.mass_kg - force * length;
            let turned = self.momenta[index] - base[index].angular_momentum;
            let t = turned + w * (body.axial_drag.drag * length);
            lack[index] = [r.x, r.y, r.z, t.x, t.y, t.z];
        }
        for blend in &self.pairs {
            let half = 0.5 * length * blend.factor();
            let (start, end) = (&blend.start, &blend.end);
            for (body, wrenches) in [
                (blend.pair.0, [(&start.on_a, half), (&end.on_a, half), (&end.friction_on_a, length)]),
                (blend.pair.1, [(&start.on_b, half), (&end.on_b, half), (&end.friction_on_b, length)]),
            ] {
                let body = body as usize;
                if model.bodies().get(body).is_none_or(|body| body.pinned) {
                    continue;
                }
                for (wrench, time) in wrenches {
                    let (f, t) = (wrench.force * time, wrench.torque * time);
                    for (lack, part) in lack[body].iter_mut().zip([f.x, f.y, f.z, t.x, t.y, t.z]) {
                        *lack -= part;
                    }
                }
            }
        }
        lack
    }

    fn system(&mut self, scratch: &Scratch, velocities: &[Six], iteration: usize) -> System {
        let Part { model, length, .. } = self.part;
        let mut system = self.part.masses(scratch, velocities, 2.0);
        let mut pairs = core::mem::take(&mut self.pairs);
        for blend in &mut pairs {
            if iteration < FROZEN {
                let (a, b) = (self.mean(blend.pair.0), self.mean(blend.pair.1));
                let (start, end) = (blend.start.powers(&a, &b), blend.end.powers(&a, &b));
                let lost = start.1 + end.1;
                let elastic = start.0 + end.0 - lost;
                // Damping at the velocities of the ends may push along with the mean ones.
                let demanded = blend.demanded(length, elastic + if lost > 0.0 { lost } else { 0.0 });
                let floor = if iteration < RISING { blend.least } else { blend.shift };
                blend.shift = if demanded > floor { demanded } else { floor };
            }
        }
        jacobian::add_contacts(model, scratch, &mut system, None, |pair, rates| {
            let mut weight = 1.0;
            if let Some(blend) = find(&mut pairs, pair) {
                let least = unresolved(rates, length);
                if iteration < FROZEN && least > blend.shift {
                    blend.shift = least;
                }
                weight = 0.5 * (1.0 + blend.shift);
            }
            Share {
                stiffness: weight * length * length,
                damping: 2.0 * weight * length,
                friction_stiffness: length * length,
                friction_damping: 2.0 * length,
            }
        });
        self.pairs = pairs;
        system
    }

    fn found(&mut self, scratch: &Scratch, velocities: &[Six]) -> Found {
        let model = self.part.model;
        let (mut drive, mut lost) = (0.0, 0.0);
        for blend in &self.pairs {
            let (a, b) = (self.mean(blend.pair.0), self.mean(blend.pair.1));
            let half = 0.5 * blend.factor();
            let damped = -half * (blend.start.powers(&a, &b).1 + blend.end.powers(&a, &b).1);
            lost += if damped > 0.0 { damped } else { 0.0 };
            lost -= blend.end.friction_power(&a, &b);
            let driven = |body: u32| model.bodies().get(body as usize).is_some_and(|body| body.driven);
            for (touch, share) in [(&blend.start, half), (&blend.end, half)] {
                if driven(blend.pair.0) {
                    drive -= share * touch.powers(&a, &Velocity::ZERO).0;
                }
                if driven(blend.pair.1) {
                    drive -= share * touch.powers(&Velocity::ZERO, &b).0;
                }
            }
            if driven(blend.pair.0) {
                drive -= blend.end.friction_power(&a, &Velocity::ZERO);
            }
            if driven(blend.pair.1) {
                drive -= blend.end.friction_power(&Velocity::ZERO, &b);
            }
        }
        let slowed = self.slowed(scratch);
        let mut motions = Vec::with_capacity(velocities.len());
        for (index, (body, velocity)) in model.bodies().iter().zip(velocities).enumerate() {
            let (mut motion, _) = self.end(index, velocity);
            if !body.pinned {
                let (v, w) = halves(velocity);
                lost += drag_power(body, &v, &w);
                let (slower, turn) = halves(&slowed[index]);
                motion.linear += slower;
                motion.angular += turn;
            }
            motions.push(motion);
        }
        Found { motions, lost, drive }
    }
}

impl EnergyDecaying<'_> {
    /// What the damper of unresolved contacts changes of the velocities at the end.
    fn slowed(&self, scratch: &Scratch) -> Vec<Six> {
        let Part { model, length, .. } = self.part;
        let still = vec![[0.0; 6]; model.body_count()];
        let (mut system, mut right) = (System::default(), still.clone());
        let undragged = Part { length: 0.0, ..self.part };
        system.diagonal = undragged.masses(scratch, &still, 1.0).diagonal;
        jacobian::add_contacts(model, scratch, &mut system, Some(&mut right), |_, rates| {
            let stiffness = length * length * unresolved(rates, length);
            Share { stiffness, friction_stiffness: stiffness, ..Share::default() }
        });
        system.solve(&right)
    }
}

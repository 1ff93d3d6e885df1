//! The momentum audit: what a step changes of all free bodies' momentum, against the impulses from outside.
//!
//! The one thing to know: contacts between free bodies cancel, so momentum may change only by gravity, drag, and
//! what pinned and driven bodies and planes give. The audit adds those up from the other side of each contact: not
//! the forces on the free bodies, but the opposite of those on the pinned ones, and planes' from the list of pairs.
//!
//! # What it can see
//! Newton's third law holds by construction, so in a sound program on a sound machine it never strikes; it is not a
//! measure of accuracy. It sees what breaks the construction: a force that reached one body of a pair and not the
//! other, or the wrong one, or twice (sums over threads and lanes), a torque with the wrong lever, a kick with the wrong
//! mass or step, a body moved by no force, a flipped bit in memory. It does not see a wrong force that is equal and
//! opposite along one line: that is the energy audit's.
//!
//! # Tolerance
//! Sums of `n` terms round by at most `n - 1` units in the last place of the sum of their sizes, and each body's own
//! update, which adds up its contacts and turns its axes, by [`ROUNDINGS`] more in each kick. Sizes are `m |v|` before and
//! after, and the step times all normal forces; for angular momentum about World's origin each with its lever. That is
//! 2e-13 of the momentum in motion for a thousand bodies.
//!
//! # Limits
//! Linear momentum in each step; angular momentum in the steps that end at a frame time, with `verlet` and without drag only: a Runge-Kutta method keeps it to its order, not to rounding.
//! Implicit methods keep momentum to their equations' residual and are not audited.

use crate::body::Body;
use crate::contact::Contact;
use crate::forces::{Evaluation, Moment};
use crate::state::Motion;
use crate::step::Stop;
use crate::{Model, State};
use geometry::Vec3;
use schemas::scene::Integrator;

/// Roundings of one body's momentum in a step: of up to a dozen contacts, the kick and the turn.
const ROUNDINGS: f64 = 64.0;

/// The bodies that no force moves, pinned or driven, and how heavy all others are.
#[derive(Clone, Debug)]
pub(crate) struct Holders {
    numbers: Vec<u32>,
    free_mass_kg: f64,
}

impl Holders {
    pub(crate) fn of(bodies: &[Body]) -> Holders {
        let (mut numbers, mut free_mass_kg) = (Vec::new(), 0.0);
        for (number, body) in (0..).zip(bodies) {
            if body.pinned {
                numbers.push(number);
            } else {
                free_mass_kg += body.mass_kg;
            }
        }
        Holders { numbers, free_mass_kg }
    }
}

/// Momentum of all free bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Momentum {
    /// The sum of `m v` (kg m/s).
    linear: Vec3,
    /// The sum of `x m v + I w`, about World's origin (kg m^2/s).
    angular: Vec3,
    /// Sums of the terms' sizes, for rounding.
    linear_size: f64,
    angular_size: f64,
    /// The largest distance of a body's matter from the origin (m).
    lever: f64,
}

/// What free bodies got from outside in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Impulse {
    /// N s.
    pub linear: Vec3,
    /// N m s, about World's origin.
    pub angular: Vec3,
    /// Kicks and inner steps that it was given in: each rounds.
    pub kicks: u32,
}

impl Impulse {
    pub(crate) const ZERO: Impulse =
        Impulse { linear: Vec3::new(0.0, 0.0, 0.0), angular: Vec3::new(0.0, 0.0, 0.0), kicks: 0 };

    /// Adds another one, times a weight.
    pub(crate) fn add(&mut self, other: &Impulse, weight: f64) {
        self.linear += other.linear * weight;
        self.angular += other.angular * weight;
        self.kicks += other.kicks;
    }

    fn push(&mut self, at: &Vec3, force: Vec3, torque: &Vec3) {
        self.linear += force;
        self.angular += at.cross(&force) + torque;
    }

    /// The force on all free bodies (N) and its torque (N m) from pinned and driven bodies and planes, at an
    /// evaluation.
    pub(crate) fn of_holders(model: &Model, moment: &Moment, evaluation: &Evaluation) -> Impulse {
        let mut sum = Impulse::ZERO;
        for &holder in &model.holders().numbers {
            let (wrench, circle) = (&evaluation.wrenches[holder as usize], &moment.circles[holder as usize]);
            sum.push(&circle.centre, -wrench.force, &-wrench.torque);
        }
        if !model.planes().is_empty() {
            let on_planes = evaluation.pair_forces().filter(|pair| pair.b as usize >= model.body_count());
            for pair in on_planes {
                sum.push(&moment.circles[pair.a as usize].centre, pair.on_a.force, &pair.on_a.torque);
            }
        }
        sum
    }

    /// What a kick of `verlet` gives the free bodies from outside; weight's torque only if it is asked for.
    pub(crate) fn of_kick(model: &Model, moment: &Moment, evaluation: &Evaluation, angular: bool) -> Impulse {
        let time_step = model.time().time_step_s;
        let mut sum = Impulse { kicks: 1, ..Impulse::ZERO };
        sum.add(&Impulse::of_holders(model, moment, evaluation), time_step);
        if !(angular || model.features.drag) {
            sum.linear += model.gravity() * (model.holders().free_mass_kg * time_step);
            return sum;
        }
        let free = model.bodies().iter().enumerate().filter(|(_, body)| !body.pinned);
        for (index, body) in free {
            let weight = model.gravity() * body.mass_kg;
            let mut given = weight * time_step;
            if model.features.drag {
                // A decaying velocity keeps less of itself and gains less from each force.
                let drag = &body.linear_drag;
                let force = evaluation.wrenches[index].force + weight;
                given += moment.velocities[index].linear * (body.mass_kg * (drag.keep - 1.0))
                    + force * (drag.gain - time_step);
            }
            sum.push(&moment.circles[index].centre, given, &Vec3::zeros());
        }
        sum
    }

    /// The force on all free bodies from outside at a stage of a Runge-Kutta method (N); of torques only those of
    /// holders.
    pub(crate) fn of_stage(model: &Model, moment: &Moment, evaluation: &Evaluation) -> Impulse {
        let mut sum = Impulse::of_holders(model, moment, evaluation);
        let dragged = model.features.drag || model.features.quadratic_drag;
        sum.linear += model.gravity() * model.holders().free_mass_kg;
        if dragged {
            let free = model.bodies().iter().zip(&moment.velocities).filter(|(body, _)| !body.pinned);
            for (body, velocity) in free {
                let v = velocity.linear;
                let speed = v.norm_squared().sqrt();
                sum.linear -= v * (body.linear_drag.drag + body.quadratic_drag * speed);
            }
        }
        sum
    }
}

impl Momentum {
    pub(crate) const ZERO: Momentum = Momentum {
        linear: Vec3::new(0.0, 0.0, 0.0),
        angular: Vec3::new(0.0, 0.0, 0.0),
        linear_size: 0.0,
        angular_size: 0.0,
        lever: 0.0,
    };

    /// Adds a body in motion, with its own axes.
    #[inline]
    pub(crate) fn add(
        &mut self,
        body: &Body,
        motion: &Motion,
        (u, w, normal): (&Vec3, &Vec3, &Vec3),
        angular: bool,
    ) {
        if body.pinned {
            return;
        }
        let linear = motion.linear * body.mass_kg;
        let size = extent(&linear);
        self.linear += linear;
        self.linear_size += size;
        if !angular {
            return;
        }
        let [i1, i2, i3] = body.inertia_kg_m2;
        let spin = &motion.angular;
        let own = u * (i1 * spin.dot(u)) + w * (i2 * spin.dot(w)) + normal * (i3 * spin.dot(normal));
        self.angular += motion.position.cross(&linear) + own;
        let distance = extent(&motion.position);
        self.angular_size += distance * size + extent(&own);
        let lever = distance + body.bounding_radius;
        if lever > self.lever {
            self.lever = lever;
        }
    }
}

/// A norm that is never below Euclid's: the sum of the components' sizes.
#[inline]
fn extent(v: &Vec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}

/// All free bodies' momentum (kg m/s).
pub(crate) fn linear(model: &Model, state: &State) -> Vec3 {
    let mut sum = Vec3::zeros();
    for (body, pose) in model.bodies().iter().zip(&state.bodies).filter(|(body, _)| !body.pinned) {
        sum += Vec3::from(pose.linear_velocity_m_per_s) * body.mass_kg;
    }
    sum
}

/// Why a scene's momentum is not audited; `None` where it is.
pub(crate) fn left_out(model: &Model) -> Option<&'static str> {
    model.integrator().is_implicit().then_some("an implicit method keeps momentum to its residual only")
}

/// Whether the angular momentum is audited that a step ends with.
pub(crate) fn is_angular(model: &Model, step: u64) -> bool {
    model.time().is_audited(step)
        && model.integrator() == Integrator::Verlet
        && !(model.features.drag || model.features.quadratic_drag)
}

/// A change of momentum in a step that no force explains, and what rounding may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unexplained {
    /// The step.
    pub step: u64,
    /// Change of momentum that is not explained (N s).
    pub linear_n_s: f64,
    /// What rounding explains of it at most (N s).
    pub linear_allowed_n_s: f64,
    /// The same of angular momentum about World's origin (N m s); zero where it is not audited.
    pub angular_n_m_s: f64,
    /// What rounding explains at most (N m s).
    pub angular_allowed_n_m_s: f64,
}

impl Unexplained {
    /// The balance of one step, between two sums.
    pub(crate) fn of(
        model: &Model,
        step: u64,
        [before, after]: [&Momentum; 2],
        given: &Impulse,
        contacts: &[(u32, u32, Contact)],
    ) -> Unexplained {
        let mut pressed = 0.0;
        for &(a, b, contact) in contacts {
            let friction =
                if model.features.friction { model.pair_material(a, b).friction_coefficient } else { 0.0 };
            pressed += contact.normal_force * (1.0 + friction);
        }
        let impulse = pressed * model.time().time_step_s;
        let unit = (model.body_count() as f64 + ROUNDINGS * f64::from(given.kicks)) * f64::EPSILON;
        let lever = if after.lever > before.lever { after.lever } else { before.lever };
        let (linear, angular) = (extent(&given.linear), extent(&given.angular));
        let size = before.linear_size + after.linear_size + impulse + linear;
        let angular_size = before.angular_size + after.angular_size + lever * impulse + angular;
        let is_angular = is_angular(model, step);
        let lack = |change: Vec3, given: &Vec3| extent(&(change - given));
        Unexplained {
            step,
            linear_n_s: lack(after.linear - before.linear, &given.linear),
            linear_allowed_n_s: unit * size,
            angular_n_m_s: match is_angular {
                true => lack(after.angular - before.angular, &given.angular),
                false => 0.0,
            },
            angular_allowed_n_m_s: unit * angular_size,
        }
    }

    /// Whether rounding explains it.
    ///
    /// # Errors
    ///
    /// [`Stop::MomentumGained`] if not.
    pub fn check(&self) -> Result<(), Stop> {
        let sums = [
            ("N s of momentum", self.linear_n_s, self.linear_allowed_n_s),
            ("N m s of angular momentum", self.angular_n_m_s, self.angular_allowed_n_m_s),
        ];
        for (what, gained, allowed) in sums {
            // What is not a number is told by the step itself.
            if gained > allowed {
                return Err(Stop::MomentumGained { step: self.step, what, gained, allowed });
            }
        }
        Ok(())
    }
}

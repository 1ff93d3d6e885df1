//! The classical Runge-Kutta method of fourth order on positions, quaternions and velocities.
//!
//! Four force evaluations a step. The order is four where forces are smooth; each onset of contact lowers
//! it for the step in which it happens. The quaternion leaves the unit sphere by O(h^5) a step and is
//! brought back at its end; forces are always those of the normalised quaternion.
//!
//! # Friction
//! A spring's rate is the slip velocity, so its stage values are those of the same method: stage `i` uses
//! the spring of the step's start, stretched by the slip of stage `i - 1` over the stage's time. It is kept
//! once, in the fourth stage, with the weighted mean of the four slips.
//!
//! # Source
//! W. Kutta, "Beitrag zur naeherungsweisen Integration totaler Differentialgleichungen", Z. Math. Phys. 46
//! (1901): weights 1/6, 1/3, 1/3, 1/6 at times 0, 1/2, 1/2, 1.

use crate::body::Body;
use crate::forces::{Evaluation, SlipMotion};
use crate::state::Motion;
use crate::wrench::{Velocity, Wrench};
use crate::{Model, Scratch, State, motion};
use geometry::{Circle, Vec3};
use nalgebra::{Quaternion, UnitQuaternion};

/// Working memory of this integrator; empty with another.
pub(crate) struct Rk4Scratch {
    start: Vec<Point>,
    slopes: Vec<Slope>,
    sums: Vec<Slope>,
    /// Velocities of the stage before, and their weighted mean so far.
    before: Vec<Velocity>,
    mean: Vec<Velocity>,
}

/// A body's place in phase space; the quaternion need not be unit.
#[derive(Clone, Copy)]
struct Point {
    position: Vec3,
    orientation: Quaternion<f64>,
    velocity: Velocity,
}

/// The rate of a [`Point`], and the power lost.
#[derive(Clone, Copy)]
struct Slope {
    position: Vec3,
    orientation: Quaternion<f64>,
    velocity: Velocity,
    lost: f64,
}

impl Slope {
    const ZERO: Slope = Slope {
        position: Vec3::new(0.0, 0.0, 0.0),
        orientation: Quaternion::new(0.0, 0.0, 0.0, 0.0),
        velocity: Velocity::ZERO,
        lost: 0.0,
    };

    fn add(&mut self, other: &Slope, weight: f64) {
        self.position += other.position * weight;
        self.orientation += other.orientation * weight;
        self.velocity.linear += other.velocity.linear * weight;
        self.velocity.angular += other.velocity.angular * weight;
        self.lost += other.lost * weight;
    }
}

impl Point {
    fn moved(&self, slope: &Slope, time: f64) -> Point {
        Point {
            position: self.position + slope.position * time,
            orientation: self.orientation + slope.orientation * time,
            velocity: Velocity {
                linear: self.velocity.linear + slope.velocity.linear * time,
                angular: self.velocity.angular + slope.velocity.angular * time,
            },
        }
    }

    fn unit_orientation(&self) -> UnitQuaternion<f64> {
        let q = self.orientation;
        UnitQuaternion::new_unchecked(q * (1.0 / q.norm_squared().sqrt()))
    }
}

impl Rk4Scratch {
    pub(crate) fn new(count: usize) -> Rk4Scratch {
        let point =
            Point { position: Vec3::zeros(), orientation: Quaternion::identity(), velocity: Velocity::ZERO };
        Rk4Scratch {
            start: vec![point; count],
            slopes: vec![Slope::ZERO; count],
            sums: vec![Slope::ZERO; count],
            before: vec![Velocity::ZERO; count],
            mean: vec![Velocity::ZERO; count],
        }
    }
}

/// Offset of each stage in steps, and its weight.
const STAGES: [(f64, f64); 4] = [(0.0, 1.0 / 6.0), (0.5, 1.0 / 3.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 6.0)];

/// Advances all bodies and contacts by one step; step number and time are the caller's.
pub(crate) fn advance(model: &Model, state: &mut State, scratch: &mut Scratch) {
    let time_step = model.time().time_step_s;
    let Scratch { evaluation, moment, rk4, pool, drive_work_j, .. } = scratch;
    for (point, body) in rk4.start.iter_mut().zip(&state.bodies) {
        let motion = Motion::of(body);
        let velocity = Velocity { linear: motion.linear, angular: motion.angular };
        let orientation = motion.orientation.into_inner();
        *point = Point { position: motion.position, orientation, velocity };
    }
    rk4.slopes.fill(Slope::ZERO);
    rk4.sums.fill(Slope::ZERO);
    rk4.mean.fill(Velocity::ZERO);
    let mut lost = 0.0;
    for (offset, weight) in STAGES {
        let time = offset * time_step;
        for (index, body) in model.bodies().iter().enumerate() {
            let point = rk4.start[index].moved(&rk4.slopes[index], time);
            rk4.before[index] = moment.velocities[index];
            moment.velocities[index] = point.velocity;
            rk4.mean[index].linear += point.velocity.linear * weight;
            rk4.mean[index].angular += point.velocity.angular * weight;
            moment.circles[index] =
                Circle::from_pose(point.position, &point.unit_orientation(), body.major_radius);
            // The slope's rate of the quaternion needs this stage's own.
            rk4.slopes[index].orientation = point.orientation;
        }
        motion::place(model, state.sim_time_s + time, moment);
        for driven in model.driven() {
            let index = driven.body as usize;
            let (now, start) = (&moment.velocities[index], &rk4.start[index].velocity);
            rk4.mean[index].linear += (now.linear - start.linear) * weight;
            rk4.mean[index].angular += (now.angular - start.angular) * weight;
        }
        // In the first stage no time has passed, and what `before` holds does not matter.
        let slip = SlipMotion { since: (&rk4.before, time), kept: (&rk4.mean, time_step) };
        evaluation.evaluate(model, moment, &state.contacts, slip, pool.as_ref());
        let (drive, drive_loss) = motion::power(model, moment, evaluation);
        *drive_work_j += drive * weight * time_step;
        lost += drive_loss * weight * time_step;
        for (index, body) in model.bodies().iter().enumerate() {
            if body.pinned {
                rk4.slopes[index] = Slope::ZERO;
                continue;
            }
            let stage = Stage {
                body,
                frame: &moment.circles[index],
                velocity: moment.velocities[index],
                wrench: evaluation.wrenches[index],
                lost: Evaluation::loses(model).then(|| evaluation.lost[index]),
                gravity: model.gravity(),
            };
            rk4.slopes[index] = stage.slope(&rk4.slopes[index].orientation);
            rk4.sums[index].add(&rk4.slopes[index], weight);
        }
    }
    for (index, body) in state.bodies.iter_mut().enumerate() {
        if model.bodies()[index].pinned {
            continue;
        }
        let end = rk4.start[index].moved(&rk4.sums[index], time_step);
        lost += rk4.sums[index].lost * time_step;
        let motion = Motion {
            position: end.position,
            orientation: end.unit_orientation(),
            linear: end.velocity.linear,
            angular: end.velocity.angular,
        };
        motion.store(body);
    }
    state.dissipated_energy_j += lost;
    scratch.keep_springs(&mut state.contacts);
    scratch.evaluation_age_s = 0.0;
}

/// One body in one stage.
struct Stage<'a> {
    body: &'a Body,
    /// The body's axes.
    frame: &'a Circle,
    velocity: Velocity,
    wrench: Wrench,
    lost: Option<Wrench>,
    gravity: Vec3,
}

impl Stage<'_> {
    /// Newton's and Euler's equations in World axes.
    fn slope(&self, orientation: &Quaternion<f64>) -> Slope {
        let (v, w, body) = (self.velocity.linear, self.velocity.angular, self.body);
        let spin = w.dot(&self.frame.normal);
        let across = w - self.frame.normal * spin;
        let torque = self.wrench.torque - w * body.axial_drag.drag;
        let angular = body.angular_acceleration(self.frame, &w, &torque);
        let force = self.wrench.force - v * body.linear_drag.drag;
        let drag_power = body.linear_drag.drag * v.norm_squared()
            + body.axial_drag.drag * (spin * spin + across.norm_squared());
        let contact_power = match &self.lost {
            Some(lost) => -(lost.force.dot(&v) + lost.torque.dot(&w)),
            None => 0.0,
        };
        let half_w = Quaternion::new(0.0, 0.5 * w.x, 0.5 * w.y, 0.5 * w.z);
        Slope {
            position: v,
            orientation: half_w * orientation,
            velocity: Velocity { linear: force * body.inverse_mass + self.gravity, angular },
            lost: drag_power + contact_power,
        }
    }
}

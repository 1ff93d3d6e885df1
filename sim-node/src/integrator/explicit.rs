//! Explicit Runge-Kutta methods on positions, quaternions and velocities: what `rk4` and `dopri5` share.
//!
//! The one thing to know: a method is a [`Tableau`]; [`Stages`] evaluates its stages one after the other and
//! keeps their slopes. The quaternion leaves the unit sphere by O(h^(p+1)) a step and is brought back at its
//! end; forces are always those of the normalised quaternion.
//!
//! # Friction
//! A spring's rate is the slip velocity, so its stage values are those of the same method: in stage `i` it is
//! the spring of the step's start, stretched by the slips of the stages before with the weights of row `i`. The
//! spring to keep is stretched by the slips with the weights of the whole step; only the last stage knows them
//! all, and its springs are the ones that are kept. Slips are those of the bodies' velocities in their stages
//! at the contact as it is now, so a rolling or turning contact is followed with first order.

use crate::body::Body;
use crate::forces::{Evaluation, Moment, SlipMotion};
use crate::momentum::Impulse;
use crate::state::Motion;
use crate::wrench::{Velocity, Wrench};
use crate::{Model, State, motion};
use geometry::{Circle, Vec3};
use nalgebra::{Quaternion, UnitQuaternion};
use schemas::state::ContactState;

/// The constants of a method; lower triangular.
pub(crate) struct Tableau {
    /// For each stage the weights of the slopes before it.
    pub rows: &'static [&'static [f64]],
    /// The weights of the step.
    pub weights: &'static [f64],
}

/// A body's place in phase space; the quaternion need not be unit.
#[derive(Clone, Copy)]
pub(crate) struct Point {
    pub position: Vec3,
    pub orientation: Quaternion<f64>,
    pub velocity: Velocity,
}

/// The rate of a [`Point`], and the power lost.
#[derive(Clone, Copy)]
pub(crate) struct Slope {
    pub velocity: Velocity,
    pub orientation: Quaternion<f64>,
    pub acceleration: Velocity,
    pub lost: f64,
}

impl Slope {
    pub(crate) const ZERO: Slope = Slope {
        velocity: Velocity::ZERO,
        orientation: Quaternion::new(0.0, 0.0, 0.0, 0.0),
        acceleration: Velocity::ZERO,
        lost: 0.0,
    };

    fn add(&mut self, other: &Slope, weight: f64) {
        self.velocity.linear += other.velocity.linear * weight;
        self.velocity.angular += other.velocity.angular * weight;
        self.orientation += other.orientation * weight;
        self.acceleration.linear += other.acceleration.linear * weight;
        self.acceleration.angular += other.acceleration.angular * weight;
        self.lost += other.lost * weight;
    }

    /// The difference of two slopes.
    pub(crate) fn less(&self, other: &Slope) -> Slope {
        let mut difference = *self;
        difference.add(other, -1.0);
        difference
    }
}

impl Point {
    pub(crate) fn of(body: &schemas::state::BodyState) -> Point {
        let motion = Motion::of(body);
        let velocity = Velocity { linear: motion.linear, angular: motion.angular };
        Point { position: motion.position, orientation: motion.orientation.into_inner(), velocity }
    }

    pub(crate) fn moved(&self, slope: &Slope, time: f64) -> Point {
        Point {
            position: self.position + slope.velocity.linear * time,
            orientation: self.orientation + slope.orientation * time,
            velocity: Velocity {
                linear: self.velocity.linear + slope.acceleration.linear * time,
                angular: self.velocity.angular + slope.acceleration.angular * time,
            },
        }
    }

    pub(crate) fn unit_orientation(&self) -> UnitQuaternion<f64> {
        let q = self.orientation;
        UnitQuaternion::new_unchecked(q * (1.0 / q.norm_squared().sqrt()))
    }

    fn store(&self, body: &mut schemas::state::BodyState) {
        let motion = Motion {
            position: self.position,
            orientation: self.unit_orientation(),
            linear: self.velocity.linear,
            angular: self.velocity.angular,
        };
        motion.store(body);
    }
}

/// Working memory of these integrators; empty with another.
pub(crate) struct Stages {
    /// When the step starts (s).
    pub time: f64,
    /// Where the step starts.
    pub start: Vec<Point>,
    /// One list of all bodies for each stage.
    pub slopes: Vec<Vec<Slope>>,
    /// Power of prescribed motions in each stage (W).
    pub drive: Vec<f64>,
    /// Force on all free bodies from outside in each stage.
    outside: Vec<Impulse>,
    /// Mean velocities of friction's springs up to this stage, and over the whole step.
    since: Vec<Velocity>,
    kept: Vec<Velocity>,
}

/// What an evaluation of a stage works with.
pub(crate) struct Setting<'a> {
    pub model: &'a Model,
    pub evaluation: &'a mut Evaluation,
    pub moment: &'a mut Moment,
    pub pool: Option<&'a rayon::ThreadPool>,
    /// Friction's springs at the step's start.
    pub springs: &'a [ContactState],
}

impl Stages {
    pub(crate) fn new(count: usize, stages: usize) -> Stages {
        let point =
            Point { position: Vec3::zeros(), orientation: Quaternion::identity(), velocity: Velocity::ZERO };
        Stages {
            time: 0.0,
            start: vec![point; count],
            slopes: vec![vec![Slope::ZERO; count]; stages],
            drive: vec![0.0; stages],
            outside: vec![Impulse::ZERO; stages],
            since: vec![Velocity::ZERO; count],
            kept: vec![Velocity::ZERO; count],
        }
    }

    /// The step starts at a state.
    pub(crate) fn start_at(&mut self, state: &State) {
        self.time = state.sim_time_s;
        for (point, body) in self.start.iter_mut().zip(&state.bodies) {
            *point = Point::of(body);
        }
    }

    /// The slopes of a body in the first stages, added up with weights.
    pub(crate) fn combined(&self, body: usize, weights: &[f64]) -> Slope {
        let mut sum = Slope::ZERO;
        for (slopes, &weight) in self.slopes.iter().zip(weights) {
            if weight != 0.0 {
                sum.add(&slopes[body], weight);
            }
        }
        sum
    }

    /// Evaluates one stage of a step of `time_step`; those before it have been.
    pub(crate) fn evaluate(
        &mut self,
        tableau: &Tableau,
        stage: usize,
        time_step: f64,
        setting: &mut Setting,
    ) {
        let model = setting.model;
        let springs = model.features.friction;
        let row = tableau.rows[stage];
        let weight = tableau.weights[stage];
        for (index, body) in model.bodies().iter().enumerate() {
            let sum = self.combined(index, row);
            let point = self.start[index].moved(&sum, time_step);
            if springs {
                self.since[index] = sum.velocity;
                let mut kept = self.combined(index, &tableau.weights[..stage]).velocity;
                kept.linear += point.velocity.linear * weight;
                kept.angular += point.velocity.angular * weight;
                self.kept[index] = kept;
            }
            setting.moment.velocities[index] = point.velocity;
            setting.moment.circles[index] =
                Circle::from_pose(point.position, &point.unit_orientation(), body.major_radius);
            // The slope's rate of the quaternion needs this stage's own.
            self.slopes[stage][index].orientation = point.orientation;
        }
        let share: f64 = row.iter().sum();
        motion::place(model, self.time + share * time_step, setting.moment);
        if springs {
            for index in model.driven().iter().map(|driven| driven.body as usize) {
                let (now, start) = (&setting.moment.velocities[index], &self.start[index].velocity);
                self.kept[index].linear += (now.linear - start.linear) * weight;
                self.kept[index].angular += (now.angular - start.angular) * weight;
            }
        }
        let slip = SlipMotion { since: (&self.since, time_step), kept: (&self.kept, time_step) };
        let Setting { evaluation, moment, .. } = setting;
        evaluation.evaluate(model, moment, setting.springs, slip, setting.pool);
        let loses = Evaluation::loses(model);
        for (index, body) in model.bodies().iter().enumerate() {
            let slope = &mut self.slopes[stage][index];
            if body.pinned {
                *slope = Slope::ZERO;
                continue;
            }
            let at = Stage {
                body,
                frame: &moment.circles[index],
                velocity: moment.velocities[index],
                wrench: evaluation.wrenches[index],
                lost: loses.then(|| evaluation.lost[index]),
                gravity: model.gravity(),
            };
            *slope = at.slope(&slope.orientation);
        }
        self.outside[stage] = Impulse::of_stage(model, moment, evaluation);
        self.drive[stage] = 0.0;
        for index in model.driven().iter().map(|driven| driven.body as usize) {
            let (drive, lost) = motion::power_at(index, model, moment, evaluation);
            self.drive[stage] += drive;
            self.slopes[stage][index] = Slope { velocity: moment.velocities[index], lost, ..Slope::ZERO };
        }
    }

    /// Work of prescribed motions over the step (J).
    pub(crate) fn drive_work(&self, tableau: &Tableau, time_step: f64) -> f64 {
        self.drive.iter().zip(tableau.weights).map(|(drive, weight)| drive * weight * time_step).sum()
    }

    /// Adds what free bodies get from outside over the step.
    pub(crate) fn add_impulse(&self, tableau: &Tableau, time_step: f64, sum: &mut Impulse) {
        for (outside, weight) in self.outside.iter().zip(tableau.weights) {
            sum.add(outside, weight * time_step);
        }
        sum.kicks += 1;
    }

    /// The last stage is the first one of the next step.
    pub(crate) fn reuse_last(&mut self) {
        let last = self.slopes.len() - 1;
        self.slopes.swap(0, last);
        self.drive.swap(0, last);
        self.outside.swap(0, last);
    }

    /// Moves all bodies to the end of the step. Returns the energy lost (J).
    pub(crate) fn finish(&self, tableau: &Tableau, time_step: f64, model: &Model, state: &mut State) -> f64 {
        let mut lost = 0.0;
        for (index, body) in state.bodies.iter_mut().enumerate() {
            let still = &model.bodies()[index];
            if still.pinned && !still.driven {
                continue;
            }
            let sum = self.combined(index, tableau.weights);
            lost += sum.lost * time_step;
            if !still.driven {
                self.start[index].moved(&sum, time_step).store(body);
            }
        }
        lost
    }
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
        let speed = if body.quadratic_drag > 0.0 { v.norm_squared().sqrt() } else { 0.0 };
        let linear_drag = body.linear_drag.drag + body.quadratic_drag * speed;
        let force = self.wrench.force - v * linear_drag;
        let drag_power =
            linear_drag * v.norm_squared() + body.axial_drag.drag * (spin * spin + across.norm_squared());
        let contact_power = match &self.lost {
            Some(lost) => -(lost.force.dot(&v) + lost.torque.dot(&w)),
            None => 0.0,
        };
        let half_w = Quaternion::new(0.0, 0.5 * w.x, 0.5 * w.y, 0.5 * w.z);
        Slope {
            velocity: self.velocity,
            orientation: half_w * orientation,
            acceleration: Velocity { linear: force * body.inverse_mass + self.gravity, angular },
            lost: drag_power + contact_power,
        }
    }
}

//! Memory that a step works in, made once.

use crate::forces::{Evaluation, Moment};
use crate::integrator::explicit::Stages;
use crate::integrator::verlet::VerletScratch;
use crate::integrator::{dopri5, rk4};
use crate::momentum::Impulse;
use crate::sleep::Asleep;
use crate::wrench::Velocity;
use crate::{Model, risk};
use geometry::lanes::Level;
use geometry::{Circle, Vec3};
use schemas::scene::Integrator;
use schemas::state::ContactState;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Bodies below which threads are not worth their waking up.
const PARALLEL_BODIES: usize = 1000;

/// Working memory of [`step`](crate::step): nothing in it changes a result, and a new one gives the same
/// bits.
pub struct Scratch {
    pub(crate) evaluation: Evaluation,
    pub(crate) moment: Moment,
    /// Work of prescribed motions in the last step (J).
    pub(crate) drive_work_j: f64,
    /// What free bodies got from outside in the last step.
    pub(crate) impulse: Impulse,
    /// Whether the torque of weight is among it: asked for where the step's angular momentum is audited.
    pub(crate) with_torque: bool,
    /// Time from the last force evaluation to the state (s).
    pub(crate) evaluation_age_s: f64,
    pub(crate) verlet: VerletScratch,
    /// The vector instructions of this processor; they reach no bit.
    pub(crate) level: Level,
    /// Of the explicit Runge-Kutta methods.
    pub(crate) stages: Stages,
    /// The model with a step halved so many times, where the step is subdivided, and the memory that goes
    /// with the step.
    pub(crate) parts: BTreeMap<usize, (Model, VerletScratch)>,
    pub(crate) risk: risk::Workspace,
    pub(crate) pool: Option<Arc<rayon::ThreadPool>>,
    /// Who sleeps, where the scene lets islands sleep; the evaluation is that of the others then.
    pub(crate) asleep: Option<Box<Asleep>>,
}

impl Scratch {
    /// Working memory for a model. `threads` above 1 share the work of large scenes; the result has the same
    /// bits whatever their number.
    pub fn new(model: &Model, threads: usize) -> Scratch {
        let count = model.body_count();
        let parallel = threads > 1 && count >= PARALLEL_BODIES;
        // Where no threads can be had, one does the work.
        let pool = parallel.then(|| rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok());
        let circle =
            Circle { centre: Vec3::zeros(), u: Vec3::x(), w: Vec3::y(), normal: Vec3::z(), radius: 0.0 };
        let stages = match model.integrator() {
            Integrator::Verlet | Integrator::BackwardEuler | Integrator::EnergyDecaying => 0,
            Integrator::Rk4 => rk4::TABLEAU.rows.len(),
            Integrator::Dopri5 => dopri5::TABLEAU.rows.len(),
        };
        Scratch {
            evaluation: Evaluation::new(model),
            moment: Moment {
                circles: vec![circle; count],
                velocities: vec![Velocity::ZERO; count],
                random: None,
            },
            drive_work_j: 0.0,
            impulse: Impulse::ZERO,
            with_torque: false,
            evaluation_age_s: 0.0,
            verlet: VerletScratch::of(model),
            level: Level::new(),
            stages: Stages::new(if stages > 0 { count } else { 0 }, stages),
            parts: BTreeMap::new(),
            risk: risk::Workspace::default(),
            pool: pool.flatten().map(Arc::new),
            asleep: None,
        }
    }

    /// How many times the contact forces have been evaluated with this memory: what a method's cost is
    /// counted in.
    pub fn force_evaluations(&self) -> u64 {
        self.evaluation.count
    }

    /// Forgets who sleeps.
    pub(crate) fn wake(&mut self, model: &Model) {
        if self.asleep.take().is_some() {
            let count = self.evaluation.count;
            self.evaluation = Evaluation::new(model);
            self.evaluation.count = count;
            self.verlet = VerletScratch::of(model);
            self.parts.clear();
        }
    }

    /// Takes friction's springs over into the state, in pair order.
    pub(crate) fn keep_springs(&self, contacts: &mut Vec<ContactState>) {
        contacts.clear();
        // The kernel's contacts have no springs.
        let with_springs = self.evaluation.pair_forces();
        for (pair, contact) in
            with_springs.flat_map(|pair| pair.contacts().map(move |contact| (pair, contact)))
        {
            if let Some(spring) = contact.spring {
                contacts.push(ContactState {
                    body_a: pair.a,
                    body_b: pair.b,
                    arc: contact.arc,
                    reserved: 0,
                    mid_cos: contact.mid_cos,
                    mid_sin: contact.mid_sin,
                    spring_m: (spring + Vec3::zeros()).into(),
                });
            }
        }
    }
}

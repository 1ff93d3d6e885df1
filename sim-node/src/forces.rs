//! One evaluation of all contact forces: broad phase, contacts, sum over the bodies.
//!
//! The list of neighbours is cut into chunks of a fixed size. Each chunk writes its own results, alone or
//! on any thread; then they are added up in pair order. So the sums are the same whatever the number of
//! threads.

use crate::Model;
use crate::broad::Neighbours;
use crate::contact::{Contact, PairForce};
use crate::narrow::Narrow;
use crate::wrench::{Velocity, Wrench};
use geometry::Circle;
use rayon::prelude::*;
use schemas::scene::Integrator;
use schemas::state::ContactState;

/// Pairs in a chunk. Part of nothing: any value gives the same bits.
const CHUNK_PAIRS: usize = 1024;

/// Frames and velocities of all bodies at one moment.
#[derive(Debug, Default)]
pub(crate) struct Moment {
    pub circles: Vec<Circle>,
    pub velocities: Vec<Velocity>,
}

/// By which velocities, and for how long, friction's springs have moved since they were last kept.
#[derive(Clone, Copy)]
pub(crate) struct SlipMotion<'a> {
    pub since: (&'a [Velocity], f64),
    pub kept: (&'a [Velocity], f64),
}

/// The results of one evaluation, and the neighbours that make the next one fast.
#[derive(Debug, Default)]
pub(crate) struct Evaluation {
    pub neighbours: Neighbours,
    /// Evaluations so far.
    pub count: u64,
    chunks: Vec<Chunk>,
    /// How many of the chunks are in use.
    chunk_count: usize,
    /// Contact force and torque on each body.
    pub wrenches: Vec<Wrench>,
    /// Their inelastic part; zero, and not kept up, without damping and friction.
    pub lost: Vec<Wrench>,
}

#[derive(Debug, Default)]
struct Chunk {
    candidates: Vec<(u32, u32)>,
    forces: Vec<PairForce>,
}

impl Chunk {
    /// The candidates among the pairs, and what they do to each other.
    fn collide<const DAMPED: bool, const FRICTION: bool>(&mut self, scene: &Narrow, pairs: &[(u32, u32)]) {
        self.candidates.clear();
        self.forces.clear();
        for &(a, b) in pairs {
            if scene.model.near(&scene.moment.circles, a, b) {
                self.candidates.push((a, b));
                scene.pair::<DAMPED, FRICTION>(a, b, &mut self.forces);
            }
        }
    }
}

impl Evaluation {
    pub(crate) fn new(model: &Model) -> Evaluation {
        Evaluation {
            wrenches: vec![Wrench::ZERO; model.body_count()],
            lost: vec![Wrench::ZERO; model.body_count()],
            ..Evaluation::default()
        }
    }

    /// The candidate pairs in order.
    pub(crate) fn candidates(&self) -> impl Iterator<Item = &(u32, u32)> {
        self.chunks[..self.chunk_count].iter().flat_map(|chunk| &chunk.candidates)
    }

    /// The pairs in contact, in order.
    pub(crate) fn pair_forces(&self) -> impl Iterator<Item = &PairForce> {
        self.chunks[..self.chunk_count].iter().flat_map(|chunk| &chunk.forces)
    }

    /// The contacts, in order, with their pairs.
    pub(crate) fn contacts(&self) -> impl Iterator<Item = (u32, u32, &Contact)> {
        self.pair_forces()
            .flat_map(|pair| pair.contacts[..pair.contact_count].iter().map(|c| (pair.a, pair.b, c)))
    }

    /// Whether damping or friction make part of the forces inelastic.
    pub(crate) fn loses(model: &Model) -> bool {
        model.features.damping || model.features.friction
    }

    /// Finds all contacts at a moment and sums their forces. `springs` are friction's, as the last step left
    /// them.
    pub(crate) fn evaluate(
        &mut self,
        model: &Model,
        moment: &Moment,
        springs: &[ContactState],
        slip: SlipMotion,
        pool: Option<&rayon::ThreadPool>,
    ) {
        self.count += 1;
        match (model.features.damping, model.features.friction) {
            (false, false) => self.evaluate_as::<false, false>(model, moment, springs, slip, pool),
            (true, false) => self.evaluate_as::<true, false>(model, moment, springs, slip, pool),
            (false, true) => self.evaluate_as::<false, true>(model, moment, springs, slip, pool),
            (true, true) => self.evaluate_as::<true, true>(model, moment, springs, slip, pool),
        }
    }

    fn evaluate_as<const DAMPED: bool, const FRICTION: bool>(
        &mut self,
        model: &Model,
        moment: &Moment,
        springs: &[ContactState],
        slip: SlipMotion,
        pool: Option<&rayon::ThreadPool>,
    ) {
        self.neighbours.update(model, &moment.circles);
        let half_step = match model.integrator() {
            Integrator::Verlet => 0.5 * model.time().time_step_s,
            _ => 0.0,
        };
        let scene = Narrow { model, moment, springs, slip, half_step };
        self.collide::<DAMPED, FRICTION>(&scene, pool);
        self.gather::<DAMPED, FRICTION>(model.body_count());
    }

    /// The forces of all pairs, chunk by chunk, on any thread.
    fn collide<const DAMPED: bool, const FRICTION: bool>(
        &mut self,
        scene: &Narrow,
        pool: Option<&rayon::ThreadPool>,
    ) {
        let pairs = self.neighbours.pairs();
        self.chunk_count = pairs.len().div_ceil(CHUNK_PAIRS);
        if self.chunks.len() < self.chunk_count {
            self.chunks.resize_with(self.chunk_count, Chunk::default);
        }
        let work = |(chunk, pairs): (&mut Chunk, &[(u32, u32)])| {
            chunk.collide::<DAMPED, FRICTION>(scene, pairs);
        };
        match pool {
            Some(pool) if self.chunk_count > 1 => pool.install(|| {
                self.chunks.par_iter_mut().zip(pairs.par_chunks(CHUNK_PAIRS)).for_each(work);
            }),
            _ => self.chunks.iter_mut().zip(pairs.chunks(CHUNK_PAIRS)).for_each(work),
        }
    }

    /// Adds up the pairs' forces, in pair order.
    fn gather<const DAMPED: bool, const FRICTION: bool>(&mut self, body_count: usize) {
        self.wrenches.fill(Wrench::ZERO);
        if DAMPED || FRICTION {
            self.lost.fill(Wrench::ZERO);
        }
        for chunk in &self.chunks[..self.chunk_count] {
            for pair in &chunk.forces {
                let (a, b) = (pair.a as usize, pair.b as usize);
                self.wrenches[a].add(&pair.on_a);
                if DAMPED || FRICTION {
                    self.lost[a].add(&pair.lost_on_a);
                }
                // A plane takes what it gets and does not move.
                if b < body_count {
                    self.wrenches[b].add(&pair.on_b);
                    if DAMPED || FRICTION {
                        self.lost[b].add(&pair.lost_on_b);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Model, Scratch, State, step};
    use schemas::scene::Scene;

    /// Both bodies of every contact get the same force with opposite signs, bit for bit, and about the origin
    /// the torques cancel to rounding.
    #[test]
    fn forces_are_equal_and_opposite() {
        let text = include_str!("../../scenes/ball.toml");
        let near = ["sphere.0.position_m=[0.0, -0.3, -1.0]".to_owned()];
        let (model, _) = Model::compile(&Scene::parse(text, &near).unwrap()).unwrap();
        let mut state = State::initial(&model);
        let mut scratch = Scratch::new(&model, 1);
        let (mut seen, mut worst) = (0, 0.0);
        for _ in 0..2000 {
            step(&model, &mut state, &mut scratch).unwrap();
            for pair in scratch.evaluation.pair_forces().filter(|p| (p.b as usize) < model.body_count()) {
                seen += 1;
                for (a, b) in [(&pair.on_a, &pair.on_b), (&pair.lost_on_a, &pair.lost_on_b)] {
                    assert_eq!(a.force, -b.force);
                    let circles = &scratch.moment.circles;
                    let (x_a, x_b) = (circles[pair.a as usize].centre, circles[pair.b as usize].centre);
                    let sum = a.torque + x_a.cross(&a.force) + b.torque + x_b.cross(&b.force);
                    let share = sum.norm() / (1e-300 + a.force.norm());
                    if share > worst {
                        worst = share;
                    }
                }
            }
        }
        // Levers here are of about 2 m: a few roundings of them.
        println!("{seen} pairs in contact; torque left per force {worst:e} m, allowed 4e-15");
        assert!(seen > 1000 && worst < 4e-15);
    }
}

//! One evaluation of all contact forces: broad phase, contacts, sum over the bodies.
//!
//! Pairs of rings under the default law and without friction go to the kernel, all others one at a time through
//! `narrow`. Both lists are cut into chunks of about the same work. Each chunk writes its own results, alone or on any
//! thread; then they are added up, first the kernel's in the order of its pairs, then the others in theirs. So
//! the sums are the same whatever the number of threads and the size of the chunks.

use crate::Model;
use crate::body::Body;
use crate::broad::Neighbours;
use crate::chunk::{Chunk, cut, is_searched, part};
use crate::contact::kernel::{ArcForce, MotionLine, RingScene};
use crate::contact::material::NormalLaw;
use crate::contact::{Contact, PairForce};
use crate::gather::gather;
use crate::narrow::Narrow;
use crate::team::share;
use crate::wrench::{Velocity, Wrench};
use geometry::Circle;
use geometry::lanes::{Level, Line};
use schemas::scene::{ContactLaw, Integrator};
use schemas::{state::ContactState, step::SurfaceSamples};

/// Up to which distance wires are called close, over the thinnest wire's radius: more makes lists of close pairs
/// longer, and they hold longer. Part of nothing, too.
const CLOSE_SHARE: f64 = 0.3;

/// Chunks for each thread: of pairs for the kernel, where work is known before and each chunk has groups of lanes that
/// are not full; of other pairs. Part of nothing, too.
const CHUNKS_PER_THREAD: [usize; 2] = [1, 4];

/// Frames and velocities of all bodies at one moment.
#[derive(Debug, Default)]
pub(crate) struct Moment {
    pub circles: Vec<Circle>,
    pub velocities: Vec<Velocity>,
    /// Random numbers of the step, for the contact laws that draw some.
    pub random: Option<random::Stream>,
}

/// By which velocities, and for how long, friction's springs have moved since they were last kept.
#[derive(Clone, Copy)]
pub(crate) struct SlipMotion<'a> {
    pub since: (&'a [Velocity], f64),
    pub kept: (&'a [Velocity], f64),
}

/// The results of one evaluation, and the neighbours that make the next one fast.
#[derive(Debug)]
pub(crate) struct Evaluation {
    pub neighbours: Neighbours,
    /// The neighbours, sorted out when the list was made the given time: pairs of rings for the kernel, and all
    /// others; both in order.
    ring_pairs: Vec<(u32, u32)>,
    other_pairs: Vec<(u32, u32)>,
    sorted_out: u64,
    /// Where both lists are cut into chunks.
    ring_ends: Vec<usize>,
    other_ends: Vec<usize>,
    /// Poses and velocities as the kernel reads them.
    pub(crate) lines: Vec<Line>,
    pub(crate) motions: Vec<MotionLine>,
    /// They have been written for the next evaluation.
    taken: bool,
    close_margin: f64,
    materials: Vec<u32>,
    laws: Vec<NormalLaw>,
    level: Level,
    /// Evaluations so far.
    pub count: u64,
    chunks: Vec<Chunk>,
    /// How many of the chunks are in use, the first ones with pairs of rings for the kernel.
    chunk_count: usize,
    /// Contact force and torque on each body.
    pub wrenches: Vec<Wrench>,
    /// Their inelastic part; zero, and not kept up, without damping and friction.
    pub lost: Vec<Wrench>,
}

impl Evaluation {
    pub(crate) fn new(model: &Model) -> Evaluation {
        let line = |body: &Body| Line {
            centre: [0.0, 0.0, 0.0, body.minor_radius],
            normal: [0.0, 0.0, 0.0, body.major_radius],
        };
        let motion = |body: &Body| MotionLine { linear: [0.0, 0.0, 0.0, body.mobility], angular: [0.0; 4] };
        let rings = model.bodies()[..model.ring_count()].iter();
        let thinnest = rings.map(|ring| ring.minor_radius).fold(f64::MAX, |a, b| if b < a { b } else { a });
        Evaluation {
            neighbours: Neighbours::default(),
            ring_pairs: Vec::new(),
            other_pairs: Vec::new(),
            sorted_out: 0,
            ring_ends: Vec::new(),
            other_ends: Vec::new(),
            lines: model.bodies().iter().map(line).collect(),
            motions: model.bodies().iter().map(motion).collect(),
            taken: false,
            close_margin: CLOSE_SHARE * thinnest,
            materials: model.bodies().iter().map(|body| body.material).collect(),
            laws: model.pair_materials().iter().map(|material| material.line).collect(),
            level: Level::new(),
            count: 0,
            chunks: Vec::new(),
            chunk_count: 0,
            wrenches: vec![Wrench::ZERO; model.body_count()],
            lost: vec![Wrench::ZERO; model.body_count()],
        }
    }

    /// The candidate pairs at the moment of the evaluation, in order.
    pub(crate) fn candidates<'a>(
        &'a self,
        model: &'a Model,
        moment: &'a Moment,
    ) -> impl Iterator<Item = &'a (u32, u32)> {
        self.neighbours.pairs().iter().filter(|&&(a, b)| model.near(&moment.circles, a, b))
    }

    /// The pairs in contact that were not the kernel's, in order; all pairs with friction are among them.
    pub(crate) fn pair_forces(&self) -> impl Iterator<Item = &PairForce> {
        self.chunks[..self.chunk_count].iter().flat_map(|chunk| &chunk.forces)
    }

    /// The kernel's contacts, in order.
    pub(crate) fn arc_forces(&self) -> impl Iterator<Item = &ArcForce> {
        self.chunks[..self.chunk_count].iter().flat_map(|chunk| &chunk.rings.forces)
    }

    /// The contacts, in order, with their pairs, at the moment of the evaluation.
    pub(crate) fn contacts(&self, moment: &Moment) -> Vec<(u32, u32, Contact)> {
        let mut contacts: Vec<(u32, u32, Contact)> = Vec::new();
        for arc in self.arc_forces() {
            let second = contacts.last().is_some_and(|&(a, b, _)| (a, b) == (arc.a, arc.b));
            let circles = (&moment.circles[arc.a as usize], &moment.circles[arc.b as usize]);
            contacts.push((arc.a, arc.b, arc.contact(u32::from(second), circles)));
        }
        for pair in self.pair_forces() {
            contacts.extend(pair.contacts().map(|c| (pair.a, pair.b, *c)));
        }
        contacts.sort_by_key(|&(a, b, contact)| (a, b, contact.arc));
        contacts
    }

    /// What the samples of the law `surface-integral` found.
    pub(crate) fn surface_samples(&self) -> SurfaceSamples {
        self.chunks[..self.chunk_count].iter().map(|chunk| chunk.workspace.counts).sum()
    }

    /// Whether anything touches anything.
    pub(crate) fn touches(&self) -> bool {
        self.arc_forces().next().is_some() || self.pair_forces().next().is_some()
    }

    /// Energy in all normal springs (J).
    pub(crate) fn elastic_energy(&self) -> f64 {
        let mut energy = 0.0;
        self.arc_forces().for_each(|arc| energy += arc.energy());
        self.pair_forces().for_each(|pair| energy += pair.energy);
        energy
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
        self.sort_out(model, pool.map_or(1, rayon::ThreadPool::current_num_threads));
        if !self.taken {
            self.take(moment, 0..model.body_count());
        }
        self.taken = false;
        let half_step = match model.integrator() {
            Integrator::Verlet => 0.5 * model.time().time_step_s,
            _ => 0.0,
        };
        let scene = Narrow { model, moment, springs, slip, half_step };
        self.collide::<DAMPED, FRICTION>(&scene, pool);
        let chunks = &self.chunks[..self.chunk_count];
        gather::<DAMPED, FRICTION>(chunks, &mut self.wrenches, &mut self.lost, pool);
    }

    /// Sorts out a new list of neighbours.
    fn sort_out(&mut self, model: &Model, threads: usize) {
        if self.sorted_out == self.neighbours.rebuilds {
            return;
        }
        self.sorted_out = self.neighbours.rebuilds;
        self.ring_pairs.clear();
        self.other_pairs.clear();
        for &pair in self.neighbours.pairs() {
            let list = if is_common(model, pair) { &mut self.ring_pairs } else { &mut self.other_pairs };
            list.push(pair);
        }
        let mut arcs = vec![0; model.body_count()];
        self.arc_forces().for_each(|arc| arcs[arc.a as usize] += 1);
        self.pair_forces().for_each(|pair| arcs[pair.a as usize] += 1);
        let chunks = if threads > 1 { CHUNKS_PER_THREAD.map(|chunks| chunks * threads) } else { [1; 2] };
        self.ring_ends = cut(&self.ring_pairs, &arcs, chunks[0]);
        self.other_ends = cut(&self.other_pairs, &arcs, chunks[1]);
        self.chunk_count = self.ring_ends.len() + self.other_ends.len();
        if self.chunks.len() < self.chunk_count {
            self.chunks.resize_with(self.chunk_count, Chunk::default);
        }
    }

    /// Takes poses and velocities of some bodies over for the kernel. Who has written those of the others does
    /// this before the evaluation, and it is not done again.
    pub(crate) fn take(&mut self, moment: &Moment, bodies: impl Iterator<Item = usize>) {
        self.taken = true;
        for body in bodies {
            self.lines[body].take(&moment.circles[body]);
            self.motions[body].take(&moment.velocities[body]);
        }
    }

    /// The forces of all pairs, chunk by chunk, on any thread.
    fn collide<const DAMPED: bool, const FRICTION: bool>(
        &mut self,
        scene: &Narrow,
        pool: Option<&rayon::ThreadPool>,
    ) {
        let rings = RingScene {
            lines: &self.lines,
            motions: &self.motions,
            materials: &self.materials,
            laws: &self.laws,
            material_count: scene.model.material_count(),
            half_step: scene.half_step,
            close_margin: self.close_margin,
        };
        let list = self.sorted_out;
        let (ring_pairs, ring_ends, level) = (&self.ring_pairs, &self.ring_ends, self.level);
        let (other_pairs, other_ends) = (&self.other_pairs, &self.other_ends);
        let work = |(number, chunk): (usize, &mut Chunk)| match number.checked_sub(ring_ends.len()) {
            None => {
                let pairs = part(ring_pairs, ring_ends, number);
                chunk.rings::<DAMPED, FRICTION>(level, rings, scene, (list, pairs));
            }
            Some(number) => {
                let pairs = part(other_pairs, other_ends, number);
                chunk.others::<DAMPED, FRICTION>(level, rings, scene, (list, pairs));
            }
        };
        share(pool, self.chunks[..self.chunk_count].iter_mut().enumerate(), work);
    }
}

/// Whether a pair is one for the kernel: under the default law, and without friction.
fn is_common(model: &Model, (a, b): (u32, u32)) -> bool {
    model.contact_law() == ContactLaw::CentrelineArc
        && is_searched(model, (a, b))
        && model.pair_material(a, b).friction_coefficient == 0.0
}

#[cfg(test)]
mod tests {
    use super::SlipMotion;
    use crate::contact::surface::Workspace;
    use crate::narrow::Narrow;
    use crate::wrench::Wrench;
    use crate::{Model, Scratch, State, evaluate, step};
    use geometry::Vec3;
    use geometry::lanes::Level;
    use schemas::scene::Scene;

    /// A small sheet that hangs from its first row, in motion and loaded.
    fn hanging() -> (Model, State, Scratch) {
        let text = r#"
            [time]
            duration_s = 2.0
            time_step_s = 5e-4
            [forces]
            gravity_m_per_s2 = [0.0, 9.81, 0.0]
            [material.wire]
            line_stiffness_n_per_m2 = 1e6
            damping_s_per_m = 0.3
            line_damping_n_s_per_m2 = 20.0
            [[weave]]
            pattern = "european-4-in-1"
            rows = 6
            columns = 6
            major_radius_m = 1.0
            minor_radius_m = 0.18
            ring_mass_kg = 0.63956
            material = "wire"
            pins = [[0, 0], [0, 1], [0, 2], [0, 3], [0, 4], [0, 5]]
        "#;
        let (model, _) = Model::compile(&Scene::parse(text, &[]).unwrap()).unwrap();
        let mut state = State::initial(&model);
        let mut scratch = Scratch::new(&model, 1);
        for _ in 0..2000 {
            step(&model, &mut state, &mut scratch).unwrap();
        }
        (model, state, scratch)
    }

    fn bits(wrenches: &[Wrench]) -> Vec<[u64; 6]> {
        let numbers = |w: &Wrench| {
            [w.force.x, w.force.y, w.force.z, w.torque.x, w.torque.y, w.torque.z].map(f64::to_bits)
        };
        wrenches.iter().map(numbers).collect()
    }

    /// The kernel makes the scalar code's forces, and the same bits with every instruction set.
    ///
    /// Both take the same law over the same arcs; where an arc's length lies at the border of two quadrature
    /// rules they may take different ones, of which the coarser is right to 1e-6.
    #[test]
    fn kernel_and_scalar_code_agree() {
        let (model, mut state, mut scratch) = hanging();
        let (mut arcs, mut worst) = (0, 0.0);
        for _ in 0..50 {
            step(&model, &mut state, &mut scratch).unwrap();
            evaluate(&model, &state, &mut scratch);
            let kernel = scratch.evaluation.wrenches.clone();
            let lost = scratch.evaluation.lost.clone();
            arcs += scratch.evaluation.arc_forces().count();
            let best = scratch.evaluation.level;
            for level in other_levels(best) {
                scratch.evaluation.level = level;
                evaluate(&model, &state, &mut scratch);
                assert_eq!(bits(&kernel), bits(&scratch.evaluation.wrenches), "{level:?}");
                assert_eq!(bits(&lost), bits(&scratch.evaluation.lost), "{level:?}");
            }
            scratch.evaluation.level = best;
            let (scalar, scalar_lost) = one_at_a_time(&model, &scratch);
            let size = |wrench: &Wrench| wrench.force.norm() + wrench.torque.norm();
            for (a, b) in [(&kernel, &scalar), (&lost, &scalar_lost)] {
                let scale = a.iter().map(size).fold(0.0, |largest, x| if x > largest { x } else { largest });
                for (a, b) in a.iter().zip(b) {
                    let difference = Wrench { force: a.force - b.force, torque: a.torque - b.torque };
                    let share = size(&difference) / scale;
                    worst = if share > worst { share } else { worst };
                }
            }
        }
        println!("{arcs} arcs; difference over the largest force {worst:e}, allowed 1e-6");
        assert!(arcs > 1000 && worst < 1e-6);
    }

    /// Which pairs are listed as close, and how often the list is made, changes no bit: anew in each step, or long.
    #[test]
    fn lists_of_close_pairs_change_no_bit() {
        let end = |margin: Option<f64>| {
            let (model, mut state, mut scratch) = hanging();
            let evaluation = &mut scratch.evaluation;
            evaluation.close_margin = margin.unwrap_or(evaluation.close_margin);
            for _ in 0..300 {
                step(&model, &mut state, &mut scratch).unwrap();
            }
            assert!(scratch.evaluation.arc_forces().count() > 30, "they touch");
            state
        };
        let expected = end(None);
        for margin in [0.0, 0.01, 0.6] {
            assert_eq!(end(Some(margin)), expected, "margin {margin}");
        }
    }

    /// What the kernel's pairs do, and the inelastic part, with arcs and forces of the scalar code.
    fn one_at_a_time(model: &Model, scratch: &Scratch) -> (Vec<Wrench>, Vec<Wrench>) {
        let moment = &scratch.moment;
        let still = (&moment.velocities[..], 0.0);
        let slip = SlipMotion { since: still, kept: still };
        let scene = Narrow { model, moment, springs: &[], slip, half_step: 0.5 * model.time().time_step_s };
        let mut forces = Vec::new();
        for &pair in &scratch.evaluation.ring_pairs {
            scene.pair::<true, false>(pair, None, &mut Workspace::default(), &mut forces);
        }
        let mut sums = (vec![Wrench::ZERO; model.body_count()], vec![Wrench::ZERO; model.body_count()]);
        for pair in &forces {
            let (a, b) = (pair.a as usize, pair.b as usize);
            sums.0[a].add(&pair.on_a);
            sums.0[b].add(&pair.on_b);
            sums.1[a].add(&pair.lost_on_a);
            sums.1[b].add(&pair.lost_on_b);
        }
        sums
    }

    #[cfg(target_arch = "x86_64")]
    fn other_levels(best: Level) -> Vec<Level> {
        let levels = [best.as_avx2().map(Level::Avx2), best.as_sse2().map(Level::Sse2)];
        levels.into_iter().flatten().collect()
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn other_levels(_: Level) -> Vec<Level> {
        Vec::new()
    }

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
            let circles = &scratch.moment.circles;
            let mut look = |(a, b): (u32, u32), on_a: [&[f64; 3]; 2], on_b: [&[f64; 3]; 2]| {
                seen += 1;
                let vector = |numbers: &[f64; 3]| Vec3::from(*numbers);
                assert_eq!(vector(on_a[0]), -vector(on_b[0]));
                let (x_a, x_b) = (circles[a as usize].centre, circles[b as usize].centre);
                let moment = |at: &Vec3, on: [&[f64; 3]; 2]| vector(on[1]) + at.cross(&vector(on[0]));
                let share =
                    (moment(&x_a, on_a) + moment(&x_b, on_b)).norm() / (1e-300 + vector(on_a[0]).norm());
                if share > worst {
                    worst = share;
                }
            };
            for pair in scratch.evaluation.pair_forces().filter(|p| (p.b as usize) < model.body_count()) {
                for (a, b) in [(&pair.on_a, &pair.on_b), (&pair.lost_on_a, &pair.lost_on_b)] {
                    let numbers = |wrench: &Wrench| [wrench.force.into(), wrench.torque.into()];
                    let ([f_a, t_a], [f_b, t_b]) = (numbers(a), numbers(b));
                    look((pair.a, pair.b), [&f_a, &t_a], [&f_b, &t_b]);
                }
            }
            for arc in scratch.evaluation.arc_forces() {
                let [force, torque_a, torque_b] = arc.lost;
                let sets = [(arc.force, arc.torque_a, arc.torque_b), (force, torque_a, torque_b)];
                for (force, torque_a, torque_b) in sets {
                    let three = |[x, y, z, _]: [f64; 4]| [x, y, z];
                    let (force, t_a, t_b) = (three(force), three(torque_a), three(torque_b));
                    let opposite = force.map(|component| -component);
                    look((arc.a, arc.b), [&force, &t_a], [&opposite, &t_b]);
                }
            }
        }
        // Levers here are of about 2 m: a few roundings of them.
        println!("{seen} pairs in contact; torque left per force {worst:e} m, allowed 4e-15");
        assert!(seen > 1000 && worst < 4e-15);
    }
}

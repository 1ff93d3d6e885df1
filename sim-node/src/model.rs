//! The model: a scene compiled into constants. Immutable; shared by all threads.

use crate::body::Body;
use crate::broad::{self, Method};
use crate::contact::material::{NormalLaw, PairMaterial};
use crate::contact::surface::samples::PURPOSE;
use crate::momentum::Holders;
use crate::motion::{Drive, Driven};
use crate::plan::Features;
use crate::{motion, overlap, plan, polynomials, stability};
use geometry::polynomial::Solid;
use geometry::{Circle, Vec3};
use schemas::plan::Plan;
use schemas::scene::{
    self, ContactLaw, Forces, Integrator, Material, OnRisk, Scene, SurfaceAverage, SurfaceIntegral,
    SurfaceSampler, Time,
};
use schemas::state::BodyState;

pub use crate::name::BodyName;
pub use crate::refusal::ModelError;

/// A scene, compiled: constants of bodies and pairs of materials, the starting poses, the rings that are
/// linked, and what the scene needs of the program.
#[derive(Clone, Debug)]
pub struct Model {
    bodies: Vec<Body>,
    ring_count: usize,
    /// Numbers of spheres, capsules, boxes and polynomials, which follow the rings in this order.
    other_counts: [usize; 4],
    /// The surfaces of the polynomials.
    surfaces: Vec<Solid>,
    planes: Vec<HalfSpace>,
    material_count: usize,
    pair_materials: Vec<PairMaterial>,
    initial: Vec<BodyState>,
    drives: Vec<Drive>,
    driven: Vec<Driven>,
    records_reactions: bool,
    linked_pairs: Vec<(u32, u32)>,
    holders: Holders,
    gravity: Vec3,
    time: Time,
    method: scene::Method,
    error_estimate: bool,
    seed: u64,
    broad_phase: Method,
    grid_radius: f64,
    largest_time_step_s: f64,
    covered_penetration: f64,
    pub(crate) features: Features,
}

/// A fixed half-space: the points with `normal . p < offset` are solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Unit normal, out of the solid.
    pub normal: Vec3,
    /// Signed distance of the surface from World's origin along the normal (m).
    pub offset: f64,
    pub(crate) material: u32,
}

/// How to compile a scene; the default is how runs do it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compile {
    /// Every part is taken in, needed or not. The same bits, only slower.
    pub everything_on: bool,
    /// A time step beyond the stability bound is accepted: for studies of what happens there.
    pub beyond_stability_bound: bool,
}

impl Model {
    /// Compiles a resolved scene. The plan says what the scene needs of the simulator and why.
    ///
    /// # Errors
    ///
    /// [`ModelError`] if bodies overlap at the start, or the time step is beyond the stability bound.
    pub fn compile(scene: &Scene) -> Result<(Model, Plan), ModelError> {
        Model::compile_as(scene, Compile::default())
    }

    /// The same with every part taken in, needed or not: the same bits, only slower. For tests and for
    /// measuring what leaving out saves.
    ///
    /// # Errors
    ///
    /// As [`Model::compile`].
    pub fn compile_everything_on(scene: &Scene) -> Result<(Model, Plan), ModelError> {
        Model::compile_as(scene, Compile { everything_on: true, ..Compile::default() })
    }

    /// Compiles a scene in another way than for a run.
    ///
    /// # Errors
    ///
    /// As [`Model::compile`], less what was switched off.
    pub fn compile_as(scene: &Scene, how: Compile) -> Result<(Model, Plan), ModelError> {
        const COUNT_MAX: usize = (u32::MAX / 2) as usize;
        let count = scene.body_count() + scene.planes.len();
        if count > COUNT_MAX {
            return Err(ModelError::TooManyBodies { count, largest: COUNT_MAX });
        }
        let mut model = Model::lay_out(scene)?;
        model.check_law()?;
        model.check_integrator()?;
        polynomials::refuse_pairs(&model)?;
        let (features, mut plan) = plan::make(scene, &model, how.everything_on);
        model.features = features;
        model.linked_pairs = overlap::check_and_find_links(&model)?;
        model.count_contacts();
        let bound = stability::bound(scene, &model);
        let largest_s = bound.largest_s;
        model.largest_time_step_s = largest_s;
        if scene.time.automatic {
            model = model.with_time_step(stability::automatic_step(&scene.time, largest_s));
            model.time.automatic = false;
        }
        let time_step_s = model.time.time_step_s;
        let in_parts = model.method.on_risk == OnRisk::Subdivide;
        if time_step_s > largest_s && !how.beyond_stability_bound && !in_parts {
            return Err(ModelError::TimeStep { time_step_s, largest_s, cause: bound.cause });
        }
        model.covered_penetration = stability::covered_penetration(&model, largest_s);
        plan::time_step(&model, scene.time.automatic, &bound, &mut plan);
        Ok((model, plan))
    }

    /// The same model with another time step (s), whatever its stability bound.
    pub(crate) fn with_time_step(&self, time_step_s: f64) -> Model {
        let mut model = self.clone();
        model.time.time_step_s = time_step_s;
        model.bodies.iter_mut().for_each(|body| body.take_time_step(time_step_s));
        model
    }

    /// The same model with some more bodies pinned.
    pub(crate) fn with_pins(&self, pinned: &[bool]) -> Model {
        let mut model = self.clone();
        model.bodies.iter_mut().zip(pinned).filter(|(_, pin)| **pin).for_each(|(body, _)| body.pin());
        model.holders = Holders::of(&model.bodies);
        model
    }

    /// Refuses shapes that the contact law has no answer for.
    fn check_law(&self) -> Result<(), ModelError> {
        let law = self.contact_law().name();
        if self.contact_law() != ContactLaw::CentrelineArc && self.round_count() < self.body_count() {
            return Err(ModelError::Law { law, body: self.body_name(self.round_count() as u32) });
        }
        Ok(())
    }

    /// Refuses what the implicit integrators have no Jacobian for.
    fn check_integrator(&self) -> Result<(), ModelError> {
        let integrator = self.integrator();
        let refused = |what| Err(ModelError::Integrator { integrator: integrator.name(), what });
        if !integrator.is_implicit() {
            return Ok(());
        }
        if self.contact_law() == ContactLaw::SurfaceIntegral {
            return refused("contact law but centreline-arc and centreline-minima");
        }
        if self.round_count() < self.body_count() {
            return refused("bodies but rings, spheres and planes");
        }
        Ok(())
    }

    /// Each body's mobility, once its links are known.
    fn count_contacts(&mut self) {
        let mut counts = vec![1.0; self.bodies.len()];
        for &(a, b) in &self.linked_pairs {
            counts[a as usize] += 1.0;
            counts[b as usize] += 1.0;
        }
        for (body, count) in self.bodies.iter_mut().zip(counts) {
            body.mobility = body.mobility_at(body.bounding_radius) * count;
        }
    }

    fn lay_out(scene: &Scene) -> Result<Model, ModelError> {
        let time_step = scene.time.time_step_s;
        let Forces { gravity_m_per_s2, .. } = scene.forces;
        let names: Vec<&String> = scene.materials.keys().collect();
        let materials: Vec<&Material> = scene.materials.values().collect();
        let material = |name: &String| {
            names.binary_search(&name).expect("a resolved scene names existing materials") as u32
        };
        let rings =
            scene.rings.iter().map(|r| Body::ring(r, material(&r.material), &scene.forces, time_step));
        let spheres = scene.spheres.iter().map(|s| Body::sphere(s, material(&s.material), time_step));
        let capsules = scene.capsules.iter().map(|c| Body::capsule(c, material(&c.material), time_step));
        let boxes = scene.boxes.iter().map(|b| Body::cuboid(b, material(&b.material), time_step));
        let mut bodies: Vec<Body> = rings.chain(spheres).chain(capsules).chain(boxes).collect();
        let mut initial = scene.initial_bodies();
        let surfaces = polynomials::compile(scene, &mut initial)?;
        for ((number, polynomial), solid) in (0..).zip(&scene.polynomials).zip(&surfaces) {
            let material = material(&polynomial.material);
            bodies.push(Body::polynomial(polynomial, (solid, number), material, time_step));
        }
        let mut pair_materials = Vec::with_capacity(materials.len() * materials.len());
        for a in &materials {
            pair_materials.extend(materials.iter().map(|b| PairMaterial::new(a, b)));
        }
        let plane = |plane: &schemas::scene::Plane| HalfSpace {
            normal: Vec3::from(plane.normal),
            offset: plane.offset_m,
            material: material(&plane.material),
        };
        let mut grid_radius = 0.0;
        let in_grid = if scene.rings.is_empty() { &bodies[..] } else { &bodies[..scene.rings.len()] };
        for body in in_grid {
            if body.bounding_radius > grid_radius {
                grid_radius = body.bounding_radius;
            }
        }
        let (drives, driven) = motion::compile(scene, &mut initial);
        Ok(Model {
            ring_count: scene.rings.len(),
            other_counts: [
                scene.spheres.len(),
                scene.capsules.len(),
                scene.boxes.len(),
                scene.polynomials.len(),
            ],
            surfaces,
            planes: scene.planes.iter().map(plane).collect(),
            material_count: materials.len(),
            pair_materials,
            initial,
            drives,
            driven,
            records_reactions: scene.record.reactions,
            linked_pairs: Vec::new(),
            holders: Holders::of(&bodies),
            gravity: Vec3::from(gravity_m_per_s2),
            time: scene.time.clone(),
            method: scene.method.clone(),
            error_estimate: scene.record.error_estimate,
            seed: scene.seed,
            broad_phase: broad::choose(scene.method.broad_phase, bodies.len()).0,
            grid_radius,
            largest_time_step_s: f64::INFINITY,
            covered_penetration: f64::INFINITY,
            features: Features::default(),
            bodies,
        })
    }

    /// The bodies' constants: rings, spheres, capsules, boxes, polynomials.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// All bodies but planes.
    pub fn body_count(&self) -> usize {
        self.bodies.len()
    }

    /// Rings.
    pub fn ring_count(&self) -> usize {
        self.ring_count
    }

    /// Rings, spheres and capsules, the first bodies: symmetric tops about their own z axes. Boxes and
    /// polynomials follow.
    pub(crate) fn top_count(&self) -> usize {
        let [spheres, capsules, ..] = self.other_counts;
        self.ring_count + spheres + capsules
    }

    /// Rings and spheres, the first bodies: those that need no carrier or field of `contact::shapes`.
    pub(crate) fn round_count(&self) -> usize {
        self.ring_count + self.other_counts[0]
    }

    /// The surface of a polynomial body.
    pub(crate) fn solid(&self, number: u32) -> &Solid {
        &self.surfaces[number as usize]
    }

    /// The fixed half-spaces; in pairs they are numbered after the bodies.
    pub fn planes(&self) -> &[HalfSpace] {
        &self.planes
    }

    /// The poses and velocities before the first step; pinned bodies are at rest.
    pub fn initial_bodies(&self) -> &[BodyState] {
        &self.initial
    }

    /// The motions that the scene prescribes, by name.
    pub(crate) fn drives(&self) -> &[Drive] {
        &self.drives
    }

    /// The bodies that follow them, in order.
    pub(crate) fn driven(&self) -> &[Driven] {
        &self.driven
    }

    /// Whether step records tell what pins and motions bear.
    pub(crate) fn records_reactions(&self) -> bool {
        self.records_reactions
    }

    /// The pairs of rings that are linked at the start, in order.
    pub fn linked_pairs(&self) -> &[(u32, u32)] {
        &self.linked_pairs
    }

    /// The bodies that no force moves.
    pub(crate) fn holders(&self) -> &Holders {
        &self.holders
    }

    /// Acceleration of gravity (m/s^2), World.
    pub fn gravity(&self) -> Vec3 {
        self.gravity
    }

    /// Simulated time: duration, step, frames.
    pub fn time(&self) -> &Time {
        &self.time
    }

    /// The largest time step that the scene allows (s), as an estimate on the safe side; infinite where
    /// nothing sets a bound. How it is found is told where it is made, in the module `stability`.
    pub fn largest_time_step_s(&self) -> f64 {
        self.largest_time_step_s
    }

    /// How deep two rings' wires may press into each other with this time step, as a share of both their radii
    /// together: up to there the step is within the bound that the depth has. Infinite where nothing sets one.
    pub fn covered_penetration(&self) -> f64 {
        self.covered_penetration
    }

    /// The integrator.
    pub fn integrator(&self) -> Integrator {
        self.method.integrator
    }

    /// The integrator with its settings, and the law of contact.
    pub fn method(&self) -> &scene::Method {
        &self.method
    }

    /// Whether records hold an estimate of a step's error.
    pub fn estimates_error(&self) -> bool {
        self.error_estimate
    }

    /// The contact law.
    pub fn contact_law(&self) -> ContactLaw {
        self.method.contact_law
    }

    /// How the law `surface-integral` takes its integral.
    pub(crate) fn surface(&self) -> &SurfaceIntegral {
        &self.method.surface
    }

    /// The random numbers of a step, if the contact law draws some.
    pub(crate) fn random_of_step(&self, step: u64) -> Option<random::Stream> {
        let draws = self.contact_law() == ContactLaw::SurfaceIntegral
            && self.surface().sampler != SurfaceSampler::Quadrature;
        draws.then(|| random::Stream::new(self.seed, step, PURPOSE))
    }

    /// The law of the normal force of a contact whose first body is this one.
    #[inline]
    pub(crate) fn normal_law<'a>(&self, material: &'a PairMaterial, a: u32) -> &'a NormalLaw {
        match self.contact_law() {
            // Rings, and capsules and boxes.
            ContactLaw::CentrelineArc
                if (a as usize) < self.ring_count || (a as usize) >= self.round_count() =>
            {
                &material.line
            }
            ContactLaw::CentrelineArc | ContactLaw::CentrelineMinima => &material.point,
            ContactLaw::SurfaceIntegral => match self.surface().average {
                SurfaceAverage::Area => &material.surface,
                SurfaceAverage::AllSamples => &material.point,
            },
        }
    }

    /// The name of a body or plane by its number in pairs.
    pub fn body_name(&self, number: u32) -> BodyName {
        let mut rest = number as usize;
        if rest < self.ring_count {
            return BodyName::Ring(rest);
        }
        rest -= self.ring_count;
        let names = [BodyName::Sphere, BodyName::Capsule, BodyName::Box, BodyName::Polynomial];
        for (count, name) in self.other_counts.into_iter().zip(names) {
            if rest < count {
                return name(rest);
            }
            rest -= count;
        }
        BodyName::Plane(rest)
    }

    /// How near pairs are found.
    pub(crate) fn broad_phase(&self) -> Method {
        self.broad_phase
    }

    /// Bounding radius for which the grid of the broad phase is made (m).
    pub(crate) fn grid_radius(&self) -> f64 {
        self.grid_radius
    }

    /// Whether contact between two bodies can move anything.
    pub(crate) fn interacts(&self, a: u32, b: u32) -> bool {
        !(self.bodies[a as usize].pinned && self.bodies[b as usize].pinned)
    }

    /// Whether a pair is a candidate: the bounding spheres overlap, or one of them a half-space.
    #[inline]
    pub(crate) fn near(&self, circles: &[Circle], a: u32, b: u32) -> bool {
        let (a, b) = (a as usize, b as usize);
        match self.bodies.get(b) {
            Some(body_b) => {
                let reach = self.bodies[a].bounding_radius + body_b.bounding_radius;
                (circles[a].centre - circles[b].centre).norm_squared() < reach * reach
            }
            None => {
                let plane = &self.planes[b - self.bodies.len()];
                plane.normal.dot(&circles[a].centre) - plane.offset < self.bodies[a].bounding_radius
            }
        }
    }

    /// The two bodies of a pair, the one that carries the contact arc first: a ring before a sphere, the
    /// smaller major radius, then the lower number.
    pub(crate) fn ordered(&self, a: u32, b: u32) -> (u32, u32) {
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        let both_rings = (high as usize) < self.ring_count;
        let radius = |body: u32| self.bodies[body as usize].major_radius;
        if both_rings && radius(high) < radius(low) { (high, low) } else { (low, high) }
    }

    /// The constants of a pair of bodies, or of a body and a plane.
    #[inline]
    pub(crate) fn pair_material(&self, a: u32, b: u32) -> &PairMaterial {
        let material = |number: u32| {
            let number = number as usize;
            match self.bodies.get(number) {
                Some(body) => body.material,
                None => self.planes[number - self.bodies.len()].material,
            }
        };
        &self.pair_materials[material(a) as usize * self.material_count + material(b) as usize]
    }

    /// Number of materials.
    pub(crate) fn material_count(&self) -> usize {
        self.material_count
    }

    /// The constants of all pairs of materials: a row for each first one.
    pub(crate) fn pair_materials(&self) -> &[PairMaterial] {
        &self.pair_materials
    }

    /// The constants of all pairs of materials that bodies and planes have.
    pub(crate) fn materials_that_meet(&self) -> impl Iterator<Item = &PairMaterial> {
        let mut of_bodies = vec![false; self.material_count];
        let mut of_planes = vec![false; self.material_count];
        self.bodies.iter().for_each(|body| of_bodies[body.material as usize] = true);
        self.planes.iter().for_each(|plane| of_planes[plane.material as usize] = true);
        (0..self.material_count * self.material_count)
            .filter(move |index| {
                let (a, b) = (index / self.material_count, index % self.material_count);
                of_bodies[a] && (of_bodies[b] || of_planes[b])
            })
            .map(|index| &self.pair_materials[index])
    }

    /// The frames of all bodies in some poses; a sphere's has no radius.
    pub(crate) fn circles(&self, poses: &[BodyState]) -> Vec<Circle> {
        let circle = |(state, body): (&BodyState, &Body)| {
            let motion = crate::state::Motion::of(state);
            Circle::from_pose(motion.position, &motion.orientation, body.major_radius)
        };
        poses.iter().zip(&self.bodies).map(circle).collect()
    }
}

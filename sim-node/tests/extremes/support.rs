//! Scenes and runs that the tests share.

use schemas::Hash;
use schemas::scene::{Integrator, Scene};
use sim_node::{Compile, Model, Records, Scratch, State, Stop, evaluate, step};

pub use geometry::Vec3;

/// All integrators, and those whose step has a bound.
pub const INTEGRATORS: [&str; 3] = ["verlet", "rk4", "dopri5"];
pub const BOUNDED: [&str; 2] = ["verlet", "rk4"];

/// A compiled scene, its state and diary.
pub struct Run {
    pub model: Model,
    pub state: State,
    pub scratch: Scratch,
    pub records: Records,
}

impl Run {
    /// A scene that can be simulated.
    #[track_caller]
    pub fn new(scene: &Scene) -> Run {
        let (model, _) = Model::compile(scene).unwrap_or_else(|error| panic!("{error}"));
        Run::of(model)
    }

    /// A scene whose time step is set to a share of its bound; of that for `verlet` where it has none.
    #[track_caller]
    pub fn at_bound(scene: &Scene, share: f64) -> Run {
        let mut scene = scene.clone();
        let mut largest = bound(&scene);
        if largest.is_infinite() {
            let mut explicit = scene.clone();
            explicit.method.integrator = Integrator::Verlet;
            largest = bound(&explicit);
        }
        scene.time.time_step_s = share * largest;
        Run::beyond(&scene)
    }

    /// The same for any time step.
    #[track_caller]
    pub fn beyond(scene: &Scene) -> Run {
        let how = Compile { beyond_stability_bound: true, ..Compile::default() };
        Run::of(Model::compile_as(scene, how).unwrap_or_else(|error| panic!("{error}")).0)
    }

    fn of(model: Model) -> Run {
        let (state, scratch) = (State::initial(&model), Scratch::new(&model, 1));
        Run { model, state, scratch, records: Records::after(Hash::default()) }
    }

    pub fn time_step(&self) -> f64 {
        self.model.time().time_step_s
    }

    pub fn step(&mut self) {
        step(&self.model, &mut self.state, &mut self.scratch).unwrap_or_else(|stop| panic!("{stop}"));
    }

    pub fn steps(&mut self, count: u64) {
        (0..count).for_each(|_| self.step());
    }

    /// Steps with the checks that a run makes, links at each of them.
    pub fn guarded(&mut self, count: u64) -> Result<(), Stop> {
        if self.state.step == 0 {
            evaluate(&self.model, &self.state, &mut self.scratch);
            let first = self.records.record(&self.model, &self.state, &self.scratch);
            self.records.check_energy(&first)?;
        }
        for _ in 0..count {
            step(&self.model, &mut self.state, &mut self.scratch)?;
            let record = self.records.record(&self.model, &self.state, &self.scratch);
            self.records.check_momentum()?;
            self.records.check_energy(&record)?;
            sim_node::check_audit(&self.model, &self.state, &sim_node::audit(&self.model, &self.state))?;
        }
        Ok(())
    }

    /// Energy in the contacts at the state (J).
    pub fn contact_energy(&mut self) -> f64 {
        let mut scratch = Scratch::new(&self.model, 1);
        evaluate(&self.model, &self.state, &mut scratch);
        Records::after(Hash::default()).record(&self.model, &self.state, &scratch).contact_energy_j
    }

    pub fn kinetic_energy(&self) -> f64 {
        sim_node::mechanical_energy(&self.model, &self.state).0
    }

    pub fn position(&self, body: usize) -> Vec3 {
        Vec3::from(self.state.bodies[body].position_m)
    }

    pub fn velocity(&self, body: usize) -> Vec3 {
        Vec3::from(self.state.bodies[body].linear_velocity_m_per_s)
    }

    pub fn spin(&self, body: usize) -> Vec3 {
        Vec3::from(self.state.bodies[body].angular_velocity_rad_per_s)
    }
}

/// The largest time step that a scene allows (s).
#[track_caller]
pub fn bound(scene: &Scene) -> f64 {
    let how = Compile { beyond_stability_bound: true, ..Compile::default() };
    Model::compile_as(scene, how).unwrap_or_else(|error| panic!("{error}")).0.largest_time_step_s()
}

#[track_caller]
pub fn parse(text: &str) -> Scene {
    Scene::parse(text, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Time, an integrator, and a material `wire` with a line stiffness and what else is said of it.
pub fn head(time_step_s: f64, integrator: &str, stiffness: f64, wire: &str) -> String {
    format!(
        "[time]\n duration_s = {:?}\n time_step_s = {time_step_s:?}\n frames_per_second = {:?}\n\
         [method]\n integrator = \"{integrator}\"\n\
         [material.wire]\n line_stiffness_n_per_m2 = {stiffness:?}\n {wire}\n",
        1e5 * time_step_s,
        1e-4 / time_step_s,
    )
}

/// A ring of the material `wire`.
pub fn ring(radii: [f64; 2], mass: f64, position: [f64; 3], more: &str) -> String {
    let [major, minor] = radii;
    format!(
        "[[ring]]\n major_radius_m = {major:?}\n minor_radius_m = {minor:?}\n mass_kg = {mass:?}\n \
         material = \"wire\"\n position_m = {position:?}\n {more}\n"
    )
}

/// Turns a ring's axis from z to x.
pub const ACROSS: &str = "orientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]";

/// Prints a measured value beside what is allowed, and checks it.
#[track_caller]
pub fn check(what: &str, measured: f64, allowed: f64) {
    println!("{what}: {measured:.3e}, allowed {allowed:.1e}");
    assert!(measured <= allowed, "{what}: {measured:e}, allowed {allowed:e}");
}

//! Scenes and runs that the tests share.

use schemas::scene::Scene;
use sim_node::{Model, Scratch, State, step};

/// A compiled scene, its first state and working memory.
pub struct Run {
    pub model: Model,
    pub state: State,
    pub scratch: Scratch,
}

impl Run {
    pub fn new(text: &str) -> Run {
        Run::with(text, &[])
    }

    pub fn with(text: &str, overrides: &[String]) -> Run {
        let scene = Scene::parse(text, overrides).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let (model, _) = Model::compile(&scene).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let state = State::initial(&model);
        let scratch = Scratch::new(&model, 1);
        Run { model, state, scratch }
    }

    pub fn step(&mut self) {
        step(&self.model, &mut self.state, &mut self.scratch).expect("the run goes on");
    }

    pub fn steps(&mut self, count: u64) {
        for _ in 0..count {
            self.step();
        }
    }

    /// To the end of the scene's duration.
    pub fn finish(&mut self) {
        self.steps(self.model.time().step_count() - self.state.step);
    }
}

/// One ring of the standard shape (R 1 m, r 0.18 m, 1 kg), free, with the given time and forces; the rest of
/// the ring's table and of the file can follow.
pub fn one_ring(time_step_s: f64, duration_s: f64, integrator: &str, head: &str, ring: &str) -> String {
    format!(
        r#"
        [time]
        duration_s = {duration_s:?}
        time_step_s = {time_step_s:?}
        [method]
        integrator = "{integrator}"
        {head}
        [[ring]]
        major_radius_m = 1.0
        minor_radius_m = 0.18
        mass_kg = 1.0
        material = "wire"
        {ring}
        "#
    )
}

/// Observed order of convergence from two errors, the second with half the step.
pub fn order(coarse: f64, fine: f64) -> f64 {
    libm::log2(coarse / fine)
}

/// Prints a measured value beside what is allowed, and checks it.
#[track_caller]
pub fn check(what: &str, measured: f64, allowed: f64) {
    println!("{what}: {measured:.3e}, allowed {allowed:.1e}");
    assert!(measured <= allowed, "{what}: {measured:e}, allowed {allowed:e}");
}

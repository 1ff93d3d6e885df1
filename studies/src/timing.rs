//! Runs for the error and runs for the time.

use rustix::time::{ClockId, clock_gettime};
use schemas::scene::Scene;
use sim_node::{Compile, Model, Scratch, State, evaluate, step};

/// Smallest, median and largest of some times (s).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Times {
    pub low: f64,
    pub median: f64,
    pub high: f64,
}

impl Times {
    /// Of a thing done again and again: once to warm up, then `repetitions` times. Each is as many calls as take
    /// `least` seconds together.
    pub(crate) fn of(repetitions: usize, least: f64, mut call: impl FnMut()) -> Times {
        call();
        let mut calls = 1_u32;
        let mut times = Vec::new();
        while times.len() < repetitions {
            let before = processor_seconds();
            (0..calls).for_each(|_| call());
            let spent = processor_seconds() - before;
            if spent < least && calls < 1 << 20 {
                calls *= 2;
                times.clear();
            } else {
                times.push(spent / f64::from(calls));
            }
        }
        times.sort_by(f64::total_cmp);
        Times { low: times[0], median: times[times.len() / 2], high: times[times.len() - 1] }
    }
}

/// Seconds of this thread's processor time so far, so that other work on the machine counts little.
pub(crate) fn processor_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// A scene as it was run to its end.
pub(crate) struct Finished {
    pub model: Model,
    pub state: State,
    pub evaluations: u64,
}

/// Compiles a scene, at any time step.
pub(crate) fn compile(text: &str) -> Result<Model, String> {
    let scene = Scene::parse(text, &[]).map_err(|error| error.to_string())?;
    compile_scene(&scene)
}

/// The same for a scene.
pub(crate) fn compile_scene(scene: &Scene) -> Result<Model, String> {
    let how = Compile { beyond_stability_bound: true, ..Compile::default() };
    Model::compile_as(scene, how).map(|(model, _)| model).map_err(|error| error.to_string())
}

/// Runs a scene to its end.
pub(crate) fn finish(model: Model) -> Result<Finished, String> {
    let mut state = State::initial(&model);
    let mut scratch = Scratch::new(&model, 1);
    for _ in 0..model.time().step_count() {
        step(&model, &mut state, &mut scratch).map_err(|stop| stop.to_string())?;
    }
    let evaluations = scratch.force_evaluations();
    Ok(Finished { model, state, evaluations })
}

/// The time of a whole run (s of one core).
pub(crate) fn time(model: &Model, repetitions: usize) -> Times {
    Times::of(repetitions, 2e-3, || {
        let mut state = State::initial(model);
        let mut scratch = Scratch::new(model, 1);
        evaluate(model, &state, &mut scratch);
        for _ in 0..model.time().step_count() {
            if step(model, &mut state, &mut scratch).is_err() {
                break;
            }
        }
    })
}

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
        Run::of(&Scene::parse(text, overrides).unwrap_or_else(|error| panic!("{error}\n{text}")))
    }

    /// A resolved scene.
    pub fn of(scene: &Scene) -> Run {
        let (model, _) = Model::compile(scene).unwrap_or_else(|error| panic!("{error}"));
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

/// A ball of 1 kg that falls 0.5 m onto a plane with a linear spring and damper that never pull; gravity 9.81.
pub struct Drop {
    /// N/m.
    pub stiffness: f64,
    /// Damping ratio `c / (2 sqrt(k m))`, below 1.
    pub ratio: f64,
}

const GRAVITY: f64 = 9.81;
const FALL_M: f64 = 0.5;

impl Drop {
    /// The scene; the ball's centre starts at `0.3 + 0.5` m.
    pub fn scene(&self, integrator: &str, method: &str, time_step_s: f64, duration_s: f64) -> String {
        let damping = 2.0 * self.ratio * self.stiffness.sqrt();
        format!(
            r#"
            [time]
            duration_s = {duration_s:?}
            time_step_s = {time_step_s:?}
            frames_per_second = 1.0
            [method]
            integrator = "{integrator}"
            {method}
            [forces]
            gravity_m_per_s2 = [0.0, 0.0, -{GRAVITY}]
            [material.rubber]
            point_stiffness_n_per_m = {:?}
            point_damping_n_s_per_m = {damping:?}
            [[sphere]]
            radius_m = 0.3
            mass_kg = 1.0
            material = "rubber"
            position_m = [0.0, 0.0, {:?}]
            [[plane]]
            normal = [0.0, 0.0, 1.0]
            offset_m = 0.0
            material = "rubber"
            "#,
            self.stiffness,
            0.3 + FALL_M
        )
    }

    /// Height of the centre at a time: flight, contact and flight again, each in closed form. In contact the
    /// depth is `g/w^2 + exp(-a t) (A cos(b t) + B sin(b t))`; the end, where the force is zero, by bisection.
    pub fn height_at(&self, time_s: f64) -> f64 {
        let omega_squared = self.stiffness;
        let decay = self.ratio * self.stiffness.sqrt();
        let omega = (omega_squared - decay * decay).sqrt();
        let rest = GRAVITY / omega_squared;
        let (mut time, mut height, mut speed) = (0.0, FALL_M, 0.0);
        loop {
            let flight = (speed + (speed * speed + 2.0 * GRAVITY * height).sqrt()) / GRAVITY;
            if time + flight >= time_s {
                let t = time_s - time;
                return 0.3 + height + speed * t - 0.5 * GRAVITY * t * t;
            }
            time += flight;
            let touch = GRAVITY * flight - speed;
            let (a, b) = (-rest, (touch - decay * rest) / omega);
            let depth = |t: f64| {
                let (cos, sin) = (libm::cos(omega * t), libm::sin(omega * t));
                let shrink = libm::exp(-decay * t);
                let rate = (b * omega - a * decay) * cos - (a * omega + b * decay) * sin;
                (rest + shrink * (a * cos + b * sin), shrink * rate)
            };
            let force = |t: f64| {
                let (depth, rate) = depth(t);
                omega_squared * depth + 2.0 * decay * rate
            };
            // Positive at the deepest point, a quarter of a turn in, and negative after half a turn.
            let half_turn = core::f64::consts::PI / omega;
            let (mut low, mut high) = (0.5 * half_turn, 1.3 * half_turn);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if force(middle) > 0.0 { low = middle } else { high = middle }
            }
            if time + low >= time_s {
                return 0.3 - depth(time_s - time).0;
            }
            time += low;
            (height, speed) = (-depth(low).0, -depth(low).1);
        }
    }
}

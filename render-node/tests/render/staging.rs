//! Scenes, states and random numbers for the tests.

use geometry::Vec3;
use random::Stream;
use render_node::{Film, RenderModel, render};
use schemas::scene::Scene;
use std::num::NonZeroUsize;

/// A scene of no duration with the materials `a`, `b` and `white` (which reflects everything), and what is appended.
pub fn scene(text: &str) -> Scene {
    let head = "
        time = { duration_s = 0.0, time_step_s = 0.001 }
        material.a = {}
        material.b = {}
        material.white = {}
        render.look.white.albedo = [1.0, 1.0, 1.0]
    ";
    Scene::parse(&format!("{head}\n{text}"), &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

pub fn threads(count: usize) -> NonZeroUsize {
    NonZeroUsize::new(count).expect("at least one thread")
}

/// The first frame of a scene's initial state.
pub fn film(scene: &Scene) -> Film {
    let (model, _) = RenderModel::compile(scene);
    render(&model, &scene.initial_bodies(), 0, scene.seed, threads(2)).expect("the state is the scene's")
}

/// Random numbers for the tests, the same in every run.
pub struct Dice(Stream);

impl Dice {
    pub fn new(seed: u64) -> Dice {
        Dice(Stream::new(seed, 0, b"chainmail's dice"))
    }

    /// Uniform from 0 to 1.
    pub fn unit(&mut self) -> f64 {
        let bits = u64::from(self.0.word()) << 32 | u64::from(self.0.word());
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in a cube about the origin with this half side.
    pub fn in_cube(&mut self, half: f64) -> Vec3 {
        Vec3::new(self.unit() - 0.5, self.unit() - 0.5, self.unit() - 0.5) * (2.0 * half)
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.in_cube(1.0);
            if v.norm_squared() <= 1.0 && v.norm_squared() > 1e-6 {
                return v.normalize();
            }
        }
    }

    /// Uniform among rotations.
    pub fn quaternion(&mut self) -> [f64; 4] {
        loop {
            let q = [0; 4].map(|_| 2.0 * self.unit() - 1.0);
            let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            if norm <= 1.0 && norm > 1e-3 {
                return q.map(|x| x / norm);
            }
        }
    }
}

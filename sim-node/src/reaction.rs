//! What holds the mail and what it bears: the reactions of pins and of prescribed motions.

use crate::wrench::Wrench;
use crate::{Model, Scratch, State};
use geometry::Vec3;
use schemas::step::{MotionReaction, PinReaction, Reactions};

/// The reactions of the last force evaluation: contact forces and weight, without the inertia of driven bodies.
pub(crate) fn reactions(model: &Model, state: &State, scratch: &Scratch) -> Reactions {
    let time = state.sim_time_s - scratch.evaluation_age_s;
    let wrench = |body: usize| {
        let mut wrench = scratch.evaluation.wrenches[body];
        wrench.force += model.gravity() * model.bodies()[body].mass_kg;
        wrench
    };
    // A sign without meaning is taken from zeros.
    let plain = |vector: Vec3| -> [f64; 3] { (vector + Vec3::zeros()).into() };
    let pins =
        model.bodies().iter().enumerate().filter(|(_, body)| body.pinned && !body.driven).map(|(body, _)| {
            let Wrench { force, torque } = wrench(body);
            PinReaction { body: body as u32, force_n: plain(force), torque_n_m: plain(torque) }
        });
    let mut sums = vec![Wrench::ZERO; model.drives().len()];
    for driven in model.driven() {
        let drive = &model.drives()[driven.drive as usize];
        let lever = model.prescribed(driven, time).position - drive.pivot_at(time);
        let Wrench { force, torque } = wrench(driven.body as usize);
        let sum = &mut sums[driven.drive as usize];
        sum.torque += torque;
        sum.push(&lever, force);
    }
    let motions = model.drives().iter().zip(sums).map(|(drive, sum)| {
        let place = drive.at(time);
        MotionReaction {
            motion: drive.name.clone(),
            translation_m: plain(place.translation),
            angle_rad: place.angle + 0.0,
            force_n: plain(sum.force),
            torque_n_m: plain(sum.torque),
        }
    });
    Reactions { pins: pins.collect(), motions: motions.collect() }
}

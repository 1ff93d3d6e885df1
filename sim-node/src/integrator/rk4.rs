//! The classical Runge-Kutta method of fourth order.
//!
//! Four force evaluations a step. The order is four where forces are smooth; each onset of contact lowers
//! it for the step in which it happens. What it shares with `dopri5`, friction among it, is in `explicit`.
//!
//! # Source
//! W. Kutta, "Beitrag zur naeherungsweisen Integration totaler Differentialgleichungen", Z. Math. Phys. 46
//! (1901): weights 1/6, 1/3, 1/3, 1/6 at times 0, 1/2, 1/2, 1.

use super::explicit::{Setting, Tableau};
use crate::{Model, Scratch, State};

pub(crate) const TABLEAU: Tableau = Tableau {
    rows: &[&[], &[0.5], &[0.0, 0.5], &[0.0, 0.0, 1.0]],
    weights: &[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
};

/// Advances all bodies and contacts by one step; step number and time are the caller's.
pub(crate) fn advance(model: &Model, state: &mut State, scratch: &mut Scratch) {
    let time_step = model.time().time_step_s;
    let Scratch { evaluation, moment, stages, pool, drive_work_j, impulse, .. } = scratch;
    stages.start_at(state);
    let mut setting = Setting { model, evaluation, moment, pool: pool.as_ref(), springs: &state.contacts };
    for stage in 0..TABLEAU.rows.len() {
        stages.evaluate(&TABLEAU, stage, time_step, &mut setting);
    }
    *drive_work_j = stages.drive_work(&TABLEAU, time_step);
    stages.add_impulse(&TABLEAU, time_step, impulse);
    state.dissipated_energy_j += stages.finish(&TABLEAU, time_step, model, state);
    scratch.keep_springs(&mut state.contacts);
    scratch.evaluation_age_s = 0.0;
}

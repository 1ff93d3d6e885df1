//! How wrong one step is, by making it twice: in one piece and in two halves.

use crate::state::Motion;
use crate::{Model, Scratch, State, step};

/// The largest distance (m) between where one time step and two half steps put a body, from the same state;
/// NaN where one of them cannot be made. With order `p` of the local error, which is one more than the
/// method's, the error of the step itself is `1 / (1 - 2^(1 - p))` times that.
///
/// Memory is made anew, so it costs three steps and new lists of neighbours.
pub(crate) fn step_error(model: &Model, state: &State) -> f64 {
    let after = |model: &Model, steps: u32| {
        // Half steps are counted in halves, so that prescribed motions are asked for the right time.
        let mut state = State { step: state.step * u64::from(steps), ..state.clone() };
        let mut scratch = Scratch::new(model, 1);
        (0..steps).try_for_each(|_| step(model, &mut state, &mut scratch)).ok().map(|()| state)
    };
    let half = model.with_time_step(0.5 * model.time().time_step_s);
    let (Some(coarse), Some(fine)) = (after(model, 1), after(&half, 2)) else {
        return f64::NAN;
    };
    let mut largest = 0.0;
    for (coarse, fine) in coarse.bodies.iter().zip(&fine.bodies) {
        let distance = (Motion::of(coarse).position - Motion::of(fine).position).norm_squared().sqrt();
        if distance > largest {
            largest = distance;
        }
    }
    largest
}

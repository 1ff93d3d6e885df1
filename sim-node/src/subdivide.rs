//! Steps in equal parts, as short as the state asks for: `method.on_risk = "subdivide"`.
//!
//! The one thing to know: a step of length `h` is made of parts of `h / 2^n` that lie on the grid of their own
//! length; before each part `n` is taken anew from the state, so that a part is neither longer than
//! half the method's stability bound nor than what `risk` allows. Nothing but the state decides.
//!
//! # Limits
//! The finest part is `h / 2^20`. What `risk` cannot promise (a material too soft to hold) is not held here
//! either; the audit of links sees it.

use crate::integrator::verlet::VerletScratch;
use crate::step::{Stop, advance, check_finite};
use crate::{Model, Scratch, State, motion, risk, stability};

/// Halvings at most.
const DEPTH_MAX: usize = 20;

/// Advances by one whole step; step number and time are the caller's. All numbers are finite then.
pub(crate) fn advance_in_parts(
    model: &Model,
    state: &mut State,
    scratch: &mut Scratch,
) -> Result<bool, Stop> {
    const WHOLE: u64 = 1 << DEPTH_MAX;
    let stable = stability::AUTO_SHARE * model.largest_time_step_s();
    let longest = if stable < model.time().time_step_s { stable } else { model.time().time_step_s };
    let (start, mut drive_work) = (state.sim_time_s, 0.0);
    let mut done = 0;
    while done < WHOLE {
        let limit = risk::longest_step(model, &state.bodies, longest, &mut scratch.risk);
        let mut depth = 0;
        while depth < DEPTH_MAX && !(done % (WHOLE >> depth) == 0 && part(model, depth) <= limit) {
            depth += 1;
        }
        let finite = if depth == 0 {
            advance(model, state, scratch)?
        } else {
            let (finer, mut memory) = scratch.parts.remove(&depth).unwrap_or_else(|| {
                let finer = model.with_time_step(part(model, depth));
                let memory = VerletScratch::of(&finer);
                (finer, memory)
            });
            std::mem::swap(&mut scratch.verlet, &mut memory);
            let made = advance(&finer, state, scratch);
            std::mem::swap(&mut scratch.verlet, &mut memory);
            scratch.parts.insert(depth, (finer, memory));
            made?
        };
        if !finite {
            check_finite(model, state)?;
        }
        done += WHOLE >> depth;
        drive_work += scratch.drive_work_j;
        // What is prescribed goes on from where the part ends.
        state.sim_time_s = start + model.time().time_step_s * (done as f64 / WHOLE as f64);
        motion::store(model, state.sim_time_s, &mut state.bodies);
    }
    scratch.drive_work_j = drive_work;
    Ok(true)
}

/// Length of a part after so many halvings (s).
fn part(model: &Model, depth: usize) -> f64 {
    model.time().time_step_s / (1_u64 << depth) as f64
}

//! Extreme and degenerate scenes. Each test belongs to one of three classes: the run goes on and an invariant
//! holds; the scene is refused before its first step; or the run stops with a diagnostic. None may panic,
//! hang, or let a number that is not finite into a state.

mod contacts;
mod frames;
mod methods;
mod motion;
mod overlap;
mod sizes;
mod start;
mod stops;
mod support;

//! The geometry against brute force: dense sampling, double sums and twice the precision.
//!
//! Every test prints what it measured beside the tolerance (`cargo test -p geometry -- --nocapture`).

mod arcs;
mod bernstein;
mod bits;
mod closest;
mod double_double;
mod lanes;
mod link;
mod minima;
mod patch;
mod polynomial;
mod properties;
mod quadrature;
mod quartic_sets;
mod random;
mod rays;
mod shapes;
mod solids;
mod strips;
mod sturm;
mod torus;

//! The point of a surface nearest to a given one.
//!
//! # Method
//! A nearest point `q` of `F = 0` to `p` meets Lagrange's conditions `q - p + l grad F(q) = 0`, `F(q) = 0`. They are
//! solved by Newton's method in the form of sequential quadratic programming: a step towards the surface along the
//! gradient, and a step within the tangent plane with the curvature of surface and distance, `1 + l F''`, of whose
//! eigenvalues the sizes are taken: where one is negative (the point is no minimum) the step leaves the saddle. A step
//! is brought back to the surface, and cut in halves, until `|q - p| + 2 |F| / |grad F|` falls. A single solution need not be the
//! nearest one, so several starts are tried, from a table made once: see [`super::Solid`].

use super::{Jet, Polynomial};
use crate::Vec3;

/// Newton steps, at most: far more than a start near the solution needs.
const STEPS_MAX: u32 = 40;
/// Least curvature by which a step is divided: near the centre of curvature a step would be without bounds.
const BEND_MIN: f64 = 1e-8;
/// Halvings of a step, at most.
const HALVINGS_MAX: u32 = 12;

/// A stationary point of the distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stationary {
    pub point: Vec3,
    /// Unit, along the gradient; zero where there is no gradient.
    pub normal: Vec3,
    pub distance: f64,
    pub converged: bool,
}

impl Polynomial {
    /// A point of the surface at which the distance from `p` has a local minimum, from a start near the surface. Converged
    /// means: on the surface, and the rest of `p - q` along the surface is zero, both within `tolerance`.
    pub(super) fn closest_from(&self, p: &Vec3, start: &Vec3, tolerance: f64, step_max: f64) -> Stationary {
        let mut q = *start;
        let mut jet = self.jet(&q);
        let mut converged = false;
        let merit = |point: &Vec3, value: f64, gradient: &Vec3| {
            (point - p).norm_squared().sqrt() + 2.0 * value.abs() / gradient.norm_squared().sqrt()
        };
        for _ in 0..STEPS_MAX {
            let g = jet.gradient;
            let g_squared = g.norm_squared();
            if !(g_squared > 0.0) {
                break;
            }
            let apart = p - q;
            let to_surface = g * (-jet.value / g_squared);
            let along = apart - g * (apart.dot(&g) / g_squared);
            if to_surface.norm_squared() <= tolerance * tolerance
                && along.norm_squared() <= tolerance * tolerance
            {
                converged = true;
                break;
            }
            let mut step = to_surface + tangential(&jet, &apart, &along, &to_surface);
            let length = step.norm_squared().sqrt();
            if length > step_max {
                step *= step_max / length;
            }
            let before = merit(&q, jet.value, &g);
            let mut taken = false;
            // At the bottom the merit cannot fall by more than its rounding.
            let falls =
                |point: &Vec3, jet: &Jet| merit(point, jet.value, &jet.gradient) <= before * (1.0 + 1e-14);
            for _ in 0..HALVINGS_MAX {
                let mut next = q + step;
                let mut next_jet = self.jet(&next);
                if !falls(&next, &next_jet) {
                    // A good step along a curved surface leaves it: back to it before it is judged.
                    let g = next_jet.gradient;
                    next -= g * (next_jet.value / g.norm_squared());
                    next_jet = self.jet(&next);
                }
                if falls(&next, &next_jet) {
                    (q, jet, taken) = (next, next_jet, true);
                    break;
                }
                step *= 0.5;
            }
            if !taken {
                break;
            }
        }
        let length = jet.gradient.norm_squared().sqrt();
        let normal = if length > 0.0 { jet.gradient * (1.0 / length) } else { Vec3::zeros() };
        Stationary { point: q, normal, distance: (q - p).norm_squared().sqrt(), converged }
    }
}

/// The step within the tangent plane.
fn tangential(jet: &Jet, apart: &Vec3, along: &Vec3, to_surface: &Vec3) -> Vec3 {
    let g = &jet.gradient;
    let multiplier = apart.dot(g) / g.norm_squared();
    // Two axes of the tangent plane, across the axis least along the gradient.
    let mut least = 0;
    for axis in 1..3 {
        if g[axis].abs() < g[least].abs() {
            least = axis;
        }
    }
    let mut axis = Vec3::zeros();
    axis[least] = 1.0;
    let u = axis.cross(g);
    let u = u * (1.0 / u.norm_squared().sqrt());
    let w = g.cross(&u) * (1.0 / g.norm_squared().sqrt());
    let (bent_u, bent_w) = (jet.second_times(&u) * multiplier, jet.second_times(&w) * multiplier);
    let (a, b, c) = (1.0 + bent_u.dot(&u), bent_u.dot(&w), 1.0 + bent_w.dot(&w));
    // The step to the surface turns the gradient, too.
    let rest = along - jet.second_times(to_surface) * multiplier;
    let (r_u, r_w) = (rest.dot(&u), rest.dot(&w));
    // Eigenvalues and the first one's direction, of length `norm`.
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let root = (half * half + b * b).sqrt();
    let (x, y) = if half < 0.0 { (b, root - half) } else { (root + half, b) };
    let norm = (x * x + y * y).sqrt();
    let (x, y) = if norm > 0.0 { (x / norm, y / norm) } else { (1.0, 0.0) };
    // By its size alone: along a direction in which the distance falls to both sides, away from the saddle.
    let inverse = |eigenvalue: f64| {
        let size = eigenvalue.abs();
        1.0 / if size > BEND_MIN { size } else { BEND_MIN }
    };
    let first = (r_u * x + r_w * y) * inverse(mean + root);
    let second = (r_w * x - r_u * y) * inverse(mean - root);
    u * (first * x - second * y) + w * (first * y + second * x)
}

//! A sieve for four bodies at once, in `f32`: which of them may a ray meet?
//!
//! A ring lies within a ball, between two planes and outside a hole. A ray whose part within the ball and the planes
//! lies in the hole, or behind the ray's start, or beyond a limit, misses it. Everything is widened by more than all
//! rounding, so no body that is met falls through.

use crate::lanes::{LANES, Lanes};
use geometry::Vec3;

/// Widening of a body in parts of D, the half diagonal of the tree's bounds.
///
/// With `u = 2^-24`, and the ray's origin at most 1.4 D from the middle: a centre carries an error of `u D`, the origin of
/// `1.4 u D`, their difference m of `2.4 u D`, and the direction moves a point 2.4 D away by `2.4 u D`. So the distance s of
/// the closest approach is wrong by at most 15 u D, the vector q there by 11 u D, and as q is not quite perpendicular to the
/// direction, the part of the ray within the ball is shifted by 16 u D. 64 u D = 3.8e-6 D covers each of them four times.
const MARGIN: f64 = 4e-6;

/// A body as the sieve sees it. World frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outline {
    pub centre: Vec3,
    /// Unit normal of the two planes.
    pub normal: Vec3,
    /// Radius of the ball.
    pub outer_radius: f64,
    /// Distance of the planes from the centre; infinite for a ball.
    pub half_height: f64,
    /// Radius of the cylinder about the normal that is free; negative for none.
    pub hole_radius: f64,
}

/// Four bodies.
#[derive(Clone, Debug)]
pub(crate) struct Sieve {
    centre: [Lanes; 3],
    normal: [Lanes; 3],
    outer_squared: Lanes,
    half_height: Lanes,
    hole_squared: Lanes,
}

/// What the sieve needs of a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SievedRay {
    /// Relative to the middle of the tree's bounds.
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    /// Widening of bodies, as [`margin`] says.
    pub margin: f32,
}

/// Widening of bodies in a tree whose bounds have this half diagonal.
pub(crate) fn margin(half_diagonal: f64) -> f64 {
    MARGIN * half_diagonal
}

impl Sieve {
    /// The sieve of up to four bodies; `middle` and `margin` are those of the tree.
    pub(crate) fn new(outlines: &[Outline], middle: &Vec3, margin: f64) -> Sieve {
        let lanes = |field: &dyn Fn(&Outline) -> f64, missing: f32| {
            let one = |lane| outlines.get(lane).map_or(missing, |outline| field(outline) as f32);
            Lanes::from(std::array::from_fn(one))
        };
        let square = |x: f64| x * x;
        Sieve {
            centre: std::array::from_fn(|axis| lanes(&|body| body.centre[axis] - middle[axis], 0.0)),
            normal: std::array::from_fn(|axis| lanes(&|body| body.normal[axis], 0.0)),
            // Of a body that is missing nothing is met.
            outer_squared: lanes(&|body| square(body.outer_radius + margin), f32::NEG_INFINITY),
            half_height: lanes(&|body| body.half_height + margin, 0.0),
            hole_squared: lanes(
                &|body| {
                    let free = if body.hole_radius > 0.0 { square(body.hole_radius) } else { -1.0 };
                    free - 4.0 * margin * body.outer_radius
                },
                -1.0,
            ),
        }
    }

    /// Bit k is set if the ray may meet body k at a distance up to `limit`.
    #[inline(always)]
    pub(crate) fn candidates(&self, ray: &SievedRay, limit: f32) -> u32 {
        let [ox, oy, oz] = ray.origin.map(Lanes::all);
        let [dx, dy, dz] = ray.direction.map(Lanes::all);
        let margin = Lanes::all(ray.margin);
        let (mx, my, mz) = (self.centre[0] - ox, self.centre[1] - oy, self.centre[2] - oz);
        // Closest approach to the centre: its distance s, and the vector q from the centre to it.
        let s = mx * dx + my * dy + mz * dz;
        let (qx, qy, qz) = (dx * s - mx, dy * s - my, dz * s - mz);
        let q_squared = qx * qx + qy * qy + qz * qz;
        let within_ball = self.outer_squared - q_squared;
        // NaN where the ray misses the ball: it then fails the last comparison.
        let half_chord = within_ball.sqrt() + margin;
        let mut start = (-half_chord).or_larger(-s - margin);
        let mut end = half_chord.or_smaller(Lanes::all(limit) - s + margin);
        // Between the planes: |height + slope u| <= half_height.
        let height = qx * self.normal[0] + qy * self.normal[1] + qz * self.normal[2];
        let slope = dx * self.normal[0] + dy * self.normal[1] + dz * self.normal[2];
        let one = (-self.half_height - height) / slope;
        let other = (self.half_height - height) / slope;
        start = start.or_larger(one.or_smaller(other) - margin);
        end = end.or_smaller(one.or_larger(other) + margin);
        // Distance from the axis, squared, at the two ends.
        let (z_start, z_end) = (height + slope * start, height + slope * end);
        let axial_start = q_squared + start * start - z_start * z_start;
        let axial_end = q_squared + end * end - z_end * z_end;
        let farthest = axial_start.or_larger(axial_end);
        let missed =
            start.larger(end) | self.hole_squared.larger(farthest) | Lanes::all(0.0).larger(within_ball);
        !missed & ((1 << LANES) - 1)
    }
}

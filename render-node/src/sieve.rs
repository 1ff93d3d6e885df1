//! A sieve for eight bodies at once, in `f32`: which of them may a ray meet?
//!
//! A ring lies within a ball, between two planes and outside a hole. A ray whose part within the ball and the planes
//! lies in the hole, or behind the ray's start, or beyond a limit, misses it. Everything is widened by more than all
//! rounding, so no body that is met falls through. Machines differ in what comes out of a comparison with NaN, so a NaN
//! means "do not know": a body is left out where a comparison says so, never where none does.

use fearless_simd::f32x8;
use geometry::Vec3;
use geometry::lanes::{Simd, SimdBase, SimdFloat, SimdMask};

/// Bodies in a sieve: as many `f32` as the registers of most x86-64 hold.
pub(crate) const WIDTH: usize = 8;

/// Widening of a body in parts of D, the half diagonal of the tree's bounds.
///
/// With `u = 2^-24`, and the ray's origin at most 1.4 D from the middle: a centre carries an error of `u D`, the origin of
/// `1.4 u D`, their difference m of `2.4 u D`, and the direction moves a point 2.4 D away by `2.4 u D`. So the distance s of
/// the closest approach is wrong by at most 15 u D, the vector q there by 11 u D, and as q is not quite perpendicular to the
/// direction, the part of the ray within the ball is shifted by 16 u D. The ray parameters at the planes are quotients whose
/// numerator is wrong by 12 u D, which moves the plane, and carry 3 u of themselves, at most 2.4 D where it matters.
/// 64 u D = 3.8e-6 D covers each of them four times.
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

/// Eight bodies.
#[derive(Clone, Debug)]
pub(crate) struct Sieve {
    /// Relative to the middle of the tree's bounds.
    centre: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
    outer_squared: [f32; WIDTH],
    half_height: [f32; WIDTH],
    hole_squared: [f32; WIDTH],
}

/// Widening of bodies in a tree whose bounds have this half diagonal.
pub(crate) fn margin(half_diagonal: f64) -> f64 {
    MARGIN * half_diagonal
}

/// The larger of each two; where `other` is NaN, `one` or NaN.
#[inline(always)]
pub(crate) fn or_larger<S: Simd>(one: f32x8<S>, other: f32x8<S>) -> f32x8<S> {
    other.max(one)
}

/// The smaller of each two; where `other` is NaN, `one` or NaN.
#[inline(always)]
pub(crate) fn or_smaller<S: Simd>(one: f32x8<S>, other: f32x8<S>) -> f32x8<S> {
    other.min(one)
}

impl Sieve {
    /// The sieve of no body.
    pub(crate) const NONE: Sieve = Sieve {
        centre: [[0.0; WIDTH]; 3],
        normal: [[0.0; WIDTH]; 3],
        // Of a body that is missing nothing is met.
        outer_squared: [f32::NEG_INFINITY; WIDTH],
        half_height: [0.0; WIDTH],
        hole_squared: [-1.0; WIDTH],
    };

    /// Puts a body into a lane; `middle` and `margin` are those of the tree.
    #[inline(always)]
    pub(crate) fn put(&mut self, lane: usize, body: &Outline, middle: &Vec3, margin: f64) {
        for axis in 0..3 {
            self.centre[axis][lane] = (body.centre[axis] - middle[axis]) as f32;
            self.normal[axis][lane] = body.normal[axis] as f32;
        }
        let outer = body.outer_radius + margin;
        self.outer_squared[lane] = (outer * outer) as f32;
        self.half_height[lane] = (body.half_height + margin) as f32;
        let free = if body.hole_radius > 0.0 { body.hole_radius * body.hole_radius } else { -1.0 };
        self.hole_squared[lane] = (free - 4.0 * margin * body.outer_radius) as f32;
    }

    /// Bit k is set if the ray may meet body k at a distance up to `limit`. Origin relative to the tree's middle; `margin` as
    /// [`margin`] says.
    #[inline(always)]
    pub(crate) fn candidates<S: Simd>(
        &self,
        simd: S,
        origin: &[f32; 3],
        direction: &[f32; 3],
        limit: f32,
        margin: f32,
    ) -> u32 {
        let all = |x: f32| f32x8::splat(simd, x);
        let row = |row: &[f32; WIDTH]| f32x8::load_array_ref(simd, row);
        let [dx, dy, dz] = [all(direction[0]), all(direction[1]), all(direction[2])];
        let margin = all(margin);
        let (mx, my, mz) = (
            row(&self.centre[0]) - all(origin[0]),
            row(&self.centre[1]) - all(origin[1]),
            row(&self.centre[2]) - all(origin[2]),
        );
        let (nx, ny, nz) = (row(&self.normal[0]), row(&self.normal[1]), row(&self.normal[2]));
        // Closest approach to the centre: its distance s, and the vector q from the centre to it.
        let s = mx * dx + my * dy + mz * dz;
        let (qx, qy, qz) = (dx * s - mx, dy * s - my, dz * s - mz);
        let q_squared = qx * qx + qy * qy + qz * qz;
        let within_ball = row(&self.outer_squared) - q_squared;
        // NaN where the ray misses the ball: it then fails the last comparison.
        let half_chord = within_ball.sqrt() + margin;
        let start = or_larger(-half_chord, -s - margin);
        let end = or_smaller(half_chord, all(limit) - s + margin);
        // Between the planes: |height + slope u| <= half_height.
        let height = qx * nx + qy * ny + qz * nz;
        let slope = dx * nx + dy * ny + dz * nz;
        let inverse = all(1.0) / slope;
        let half_height = row(&self.half_height);
        let one = (-half_height - height) * inverse;
        let other = (half_height - height) * inverse;
        let start = or_larger(start, or_smaller(one, other) - margin);
        let end = or_smaller(end, or_larger(one, other) + margin);
        // Distance from the axis, squared, at the two ends.
        let (z_start, z_end) = (height + slope * start, height + slope * end);
        let axial_start = q_squared + start * start - z_start * z_start;
        let axial_end = q_squared + end * end - z_end * z_end;
        let farthest = or_larger(axial_start, axial_end);
        let missed =
            start.simd_gt(end) | row(&self.hole_squared).simd_gt(farthest) | all(0.0).simd_gt(within_ball);
        !missed.to_bitmask() as u32 & ((1 << WIDTH) - 1)
    }
}

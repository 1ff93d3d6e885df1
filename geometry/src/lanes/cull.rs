//! Which pairs of rings can touch at all, with wires that are thicker by a margin: each ring against the slab of the
//! other's plane, and A against the cylinder shells about B's centre.
//!
//! A pair is dropped only where the gap is beyond rounding: the squared amplitudes are taken [`SLACK`] larger
//! than they are.

use super::{LANES, Line, PairLanes, Simd};
use crate::each_lane;

/// Added to a square of a sine, in units of the squares that it is made from: some tens of their roundings.
const SLACK: f64 = 1e-14;

/// Writes the numbers of the pairs that are left to `near`, in order, and returns how many.
#[inline(always)]
pub(super) fn cull<S: Simd>(
    simd: S,
    lines: &[Line],
    pairs: &[(u32, u32)],
    margin: f64,
    near: &mut Vec<u32>,
) -> usize {
    if near.len() < pairs.len() + LANES {
        near.resize(pairs.len() + LANES, 0);
    }
    let near = near.as_mut_slice();
    let mut count = 0;
    let mut groups = pairs.chunks_exact(LANES);
    let mut first = 0;
    for group in &mut groups {
        let mut keep = kept(simd, lines, margin, each_lane!(lane => group[lane]));
        for lane in 0..LANES as u32 {
            near[count] = first + lane;
            count += (keep & 1) as usize;
            keep >>= 1;
        }
        first += LANES as u32;
    }
    let rest = groups.remainder();
    if let Some(&last) = rest.last() {
        let pair = |lane: usize| *rest.get(lane).unwrap_or(&last);
        let mut keep = kept(simd, lines, margin, each_lane!(lane => pair(lane)));
        for lane in 0..rest.len() as u32 {
            near[count] = first + lane;
            count += (keep & 1) as usize;
            keep >>= 1;
        }
    }
    count
}

/// A bit for each pair that may touch; also for one with a NaN.
#[inline(always)]
fn kept<S: Simd>(simd: S, lines: &[Line], margin: f64, pairs: [(u32, u32); LANES]) -> u32 {
    let pairs = PairLanes::load(simd, lines, pairs);
    let (d, reach) = (&pairs.from_b, pairs.reach + margin);
    let (a, b) = (pairs.radius_a, pairs.radius_b);
    let (a_squared, b_squared) = (a * a, b * b);
    let over_b = d.dot(&pairs.normal_b);
    let over_a = d.dot(&pairs.normal_a);
    let cos = pairs.normal_a.dot(&pairs.normal_b);
    let squared = d.dot(d);
    let sin_squared = (1.0 + SLACK) - cos * cos;
    let zero = super::Lanes::splat(simd, 0.0);
    // Heights over a plane: the mean, beyond the reach, against the amplitude.
    let beyond_b = over_b.abs() - reach;
    let beyond_a = over_a.abs() - reach;
    let far_b = beyond_b.simd_gt(zero) & (beyond_b * beyond_b).simd_gt(a_squared * sin_squared);
    let far_a = beyond_a.simd_gt(zero) & (beyond_a * beyond_a).simd_gt(b_squared * sin_squared);
    // The squared distance of A's points from B's centre, against those of the torus of radius `reach`.
    let mean = squared + a_squared;
    let amplitude_squared = (4.0 * a_squared) * ((1.0 + SLACK) * squared - over_a * over_a);
    let (outer, inner) = (b + reach, b - reach);
    let outside = mean - outer * outer;
    let inside = inner * inner - mean;
    let far_out = outside.simd_gt(zero) & (outside * outside).simd_gt(amplitude_squared);
    let far_in = inner.simd_gt(zero) & inside.simd_gt(zero) & (inside * inside).simd_gt(amplitude_squared);
    !((far_a | far_b) | (far_out | far_in)).to_bitmask()
}

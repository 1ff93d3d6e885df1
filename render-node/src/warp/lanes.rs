//! The same for sixteen at once: each lane has the bits of the function for one.

use core::f64::consts::FRAC_PI_2;
use geometry::lanes::{Lanes, Simd, Vectors};

/// [`circle_point`](super::circle_point): cosines and sines.
#[inline(always)]
pub(crate) fn circle_points<S: Simd>(turns: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
    let simd = turns.simd();
    let quarters = 4.0 * turns;
    // The nearest quarter, from 0 to 4.
    let above = quarters + 0.5;
    let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
    let (first, second) = (above.simd_ge(one), above.simd_ge(Lanes::splat(simd, 2.0)));
    let (third, fourth) = (above.simd_ge(Lanes::splat(simd, 3.0)), above.simd_ge(Lanes::splat(simd, 4.0)));
    let nearest = (first.select(one, zero) + second.select(one, zero))
        + (third.select(one, zero) + fourth.select(one, zero));
    let angle = (quarters - nearest) * FRAC_PI_2;
    let x = angle * angle;
    let sine = angle
        * (1.0
            + x * (-1.0 / 6.0
                + x * (1.0 / 120.0
                    + x * (-1.0 / 5_040.0
                        + x * (1.0 / 362_880.0
                            + x * (-1.0 / 39_916_800.0
                                + x * (1.0 / 6_227_020_800.0 - x * (1.0 / 1_307_674_368_000.0))))))));
    let cosine = 1.0
        + x * (-0.5
            + x * (1.0 / 24.0
                + x * (-1.0 / 720.0
                    + x * (1.0 / 40_320.0
                        + x * (-1.0 / 3_628_800.0
                            + x * (1.0 / 479_001_600.0 - x * (1.0 / 87_178_291_200.0)))))));
    // Odd quarters change them over; the cosine is negative in the two of the left, the sine in the two below.
    let odd = (first & !second) | (third & !fourth);
    let (c, s) = (odd.select(sine, cosine), odd.select(cosine, sine));
    ((first & !third).select(-c, c), (second & !fourth).select(-s, s))
}

/// [`cosine_hemisphere`](super::cosine_hemisphere).
#[inline(always)]
pub(crate) fn cosine_hemispheres<S: Simd>(u: Lanes<S>, v: Lanes<S>) -> Vectors<S> {
    let (cosine, sine) = circle_points(v);
    let radius = u.sqrt();
    Vectors([radius * cosine, radius * sine, (1.0 - u).sqrt()])
}

/// [`Frame`](super::Frame)s.
#[derive(Clone, Copy)]
pub(crate) struct Frames<S: Simd> {
    x: Vectors<S>,
    y: Vectors<S>,
    z: Vectors<S>,
}

impl<S: Simd> Frames<S> {
    /// The frames of unit vectors.
    #[inline(always)]
    pub(crate) fn about(axis: &Vectors<S>) -> Frames<S> {
        let [x, y, z] = axis.0;
        let one = Lanes::splat(x.simd(), 1.0);
        let sign = one.copysign(z);
        let a = -one / (sign + z);
        let b = x * y * a;
        Frames {
            x: Vectors([1.0 + sign * x * x * a, sign * b, -sign * x]),
            y: Vectors([b, sign + y * y * a, -y]),
            z: *axis,
        }
    }

    /// Vectors of the frames in World.
    #[inline(always)]
    pub(crate) fn world(&self, local: &Vectors<S>) -> Vectors<S> {
        let [x, y, z] = local.0;
        self.x.times(x).plus(&self.y.times(y)).plus(&self.z.times(z))
    }

    /// Vectors of World in the frames.
    #[inline(always)]
    pub(crate) fn local(&self, world: &Vectors<S>) -> Vectors<S> {
        Vectors([self.x.dot(world), self.y.dot(world), self.z.dot(world)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp;
    use geometry::Vec3;
    use geometry::lanes::{LANES, Level, dispatch};

    /// Every lane has the bits of the function for one, at the edges of quarters and where the frame changes its sign, too.
    #[test]
    fn lanes_have_the_bits_of_one() {
        const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;
        let places = [
            0.0, 1e-300, 0.124_999, 0.125, 0.25, 0.374_999, 0.375, 0.5, 0.625, 0.7, 0.874_999, 0.875,
            BELOW_ONE,
        ];
        let mut compared = 0;
        for (row, &first) in places.iter().enumerate() {
            let u: [f64; LANES] = core::array::from_fn(|lane| places[(row + lane) % places.len()]);
            let v: [f64; LANES] =
                core::array::from_fn(|lane| places[(3 * row + 5 * lane) % places.len()] * first + 0.0);
            let axis = |lane: usize| {
                let (cosine, sine) = warp::circle_point(v[lane]);
                let height = 2.0 * u[lane] - 1.0;
                let across = (1.0 - height * height).sqrt();
                let height = if lane == 3 { -0.0 } else { height };
                Vec3::new(across * cosine, across * sine, height)
            };
            let mut found = [[0.0; LANES]; 11];
            let axes: [Vec3; LANES] = core::array::from_fn(axis);
            dispatch!(Level::new(), simd => {
                let column = |of: &dyn Fn(usize) -> f64| Lanes::load_array(simd, core::array::from_fn(of));
                let (cosine, sine) = circle_points(column(&|lane| v[lane]));
                let local = cosine_hemispheres(column(&|lane| u[lane]), column(&|lane| v[lane]));
                let frames = Frames::about(&Vectors([
                    column(&|lane| axes[lane].x),
                    column(&|lane| axes[lane].y),
                    column(&|lane| axes[lane].z),
                ]));
                let (world, back) = (frames.world(&local), frames.local(&local));
                let [a, b, c] = local.0;
                let [d, e, f] = world.0;
                let [g, h, i] = back.0;
                for (row, column) in found.iter_mut().zip([cosine, sine, a, b, c, d, e, f, g, h, i]) {
                    column.store_array(row);
                }
            });
            for (lane, axis) in axes.iter().enumerate() {
                let (cosine, sine) = warp::circle_point(v[lane]);
                let local = warp::cosine_hemisphere((u[lane], v[lane]));
                let frame = warp::Frame::about(axis);
                let (world, back) = (frame.world(&local), frame.local(&local));
                let expected = [cosine, sine].into_iter();
                let expected = expected.chain(local.iter().chain(&world).chain(&back).copied());
                for (row, expected) in found.iter().zip(expected) {
                    assert_eq!(row[lane].to_bits(), expected.to_bits(), "{} against {expected}", row[lane]);
                    compared += 1;
                }
            }
        }
        println!("{compared} numbers of the same bits");
    }
}

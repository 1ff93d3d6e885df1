//! Volume, centre and second moments of `F < 0` within a cube.

use super::Polynomial;
use crate::Vec3;

/// Integrals over a body: of 1, of the coordinates, and of their products xx, yy, zz, xy, xz, yz.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(super) struct Moments {
    pub volume: f64,
    pub first: Vec3,
    pub second: [f64; 6],
}

impl Polynomial {
    /// Integrals over `F < 0` in the cube of this half width: exact along lines parallel to z, whose pieces inside end at
    /// certified roots, and by the midpoint rule in x and y with `lines` by `lines` of them.
    ///
    /// # Accuracy
    /// At the outline of the body the length inside falls to 0 like a root, in places that differ from row to row: the error
    /// falls about with the square of the lines' distance (measured in `tests/oracles/polynomial.rs`).
    pub(super) fn moments(&self, half_width: f64, lines: u32) -> Moments {
        let step = 2.0 * half_width / f64::from(lines);
        let mut sums = Moments::default();
        for i in 0..lines {
            let x = half_width * (f64::from(2 * i + 1) / f64::from(lines) - 1.0);
            for j in 0..lines {
                let y = half_width * (f64::from(2 * j + 1) / f64::from(lines) - 1.0);
                let (z0, z1, z2) = self.pieces_along_z(x, y, half_width);
                sums.volume += z0;
                sums.first += Vec3::new(x * z0, y * z0, z1);
                let second = [x * x * z0, y * y * z0, z2, x * y * z0, x * z1, y * z1];
                for (sum, one) in sums.second.iter_mut().zip(second) {
                    *sum += one;
                }
            }
        }
        let area = step * step;
        sums.volume *= area;
        sums.first *= area;
        sums.second.iter_mut().for_each(|sum| *sum *= area);
        sums
    }

    /// Integrals of 1, z and z^2 over the pieces of a line that are inside.
    fn pieces_along_z(&self, x: f64, y: f64, half_width: f64) -> (f64, f64, f64) {
        let (start, end) = (Vec3::new(x, y, -half_width), Vec3::new(x, y, half_width));
        let mut inside = self.value(&start) < 0.0;
        let mut from = -half_width;
        let mut sums = (0.0, 0.0, 0.0);
        let mut take = |from: f64, to: f64| {
            sums.0 += to - from;
            sums.1 += 0.5 * (to * to - from * from);
            sums.2 += (to * to * to - from * from * from) / 3.0;
        };
        self.find_root(&start, &end, |s| {
            let z = half_width * (2.0 * s - 1.0);
            if inside {
                take(from, z);
            }
            (inside, from) = (!inside, z);
            false
        });
        if inside {
            take(from, half_width);
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::Polynomial;

    /// The volume of a torus (R = 2, r = 1) against `2 pi^2 R r^2`: second order in the lines' distance.
    #[test]
    fn the_volume_of_a_torus_converges_with_the_square_of_the_distance() {
        let torus = Polynomial::parse("(x^2 + y^2 + z^2 + 3)^2 - 16*(x^2 + y^2)").expect("a formula");
        let exact = 4.0 * core::f64::consts::PI * core::f64::consts::PI;
        for lines in [32, 64, 128, 256] {
            let off = (torus.moments(3.1, lines).volume / exact - 1.0).abs();
            let allowed = 8.0 / (f64::from(lines) * f64::from(lines));
            println!("{lines} lines: volume off {off:e}, allowed {allowed:e}");
            assert!(off < allowed);
        }
    }
}

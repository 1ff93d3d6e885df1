//! Bodies bounded by a polynomial in x, y and z, `F < 0` inside, and surfaces `F = 0` to look at.
//!
//! A formula is read by [`Polynomial::parse`], within limits that a hostile one cannot exceed. Along a straight line it
//! becomes a polynomial in one variable, in Bernstein form, whose roots [`crate::bernstein`] isolates with proof
//! ([`Polynomial::first_root`]). [`Solid`] adds what a rigid body needs: mass properties, closest points,
//! rays, in the frame of its principal axes. [`Surface`] is a sheet to look at, which need not be closed.

mod closest;
mod line;
mod mass;
mod parse;
mod solid;
mod surface;

pub use parse::{DEGREE_MAX, FormulaError};
pub use solid::{Solid, SolidError};
pub use surface::{Bounds, Surface, SurfaceError};

use crate::Vec3;

/// Value, gradient and matrix of second derivatives (xx, yy, zz, xy, xz, yz) at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// The value.
    pub value: f64,
    /// First derivatives.
    pub gradient: Vec3,
    /// Second derivatives: xx, yy, zz, xy, xz, yz.
    pub second: [f64; 6],
}

impl Jet {
    /// The matrix of second derivatives times a vector.
    #[inline]
    pub fn second_times(&self, v: &Vec3) -> Vec3 {
        let [xx, yy, zz, xy, xz, yz] = self.second;
        Vec3::new(
            xx * v.x + xy * v.y + xz * v.z,
            xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z,
        )
    }
}

/// One term `coefficient x^i y^j z^k`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Term {
    coefficient: f64,
    powers: [u8; 3],
}

/// A polynomial in x, y and z of a total degree of at most [`DEGREE_MAX`]. Terms are kept in one order, by their
/// powers of x, then y, then z, and none is zero; sums run in that order.
#[derive(Clone, Debug, PartialEq)]
pub struct Polynomial {
    terms: Vec<Term>,
    degree: usize,
}

/// Powers 0 to DEGREE_MAX of a number, with two zeros before them: `powers[n + 2]` is `x^n`.
type Powers = [f64; DEGREE_MAX + 3];

fn powers(x: f64) -> Powers {
    let mut powers = [0.0; DEGREE_MAX + 3];
    powers[2] = 1.0;
    for n in 3..powers.len() {
        powers[n] = powers[n - 1] * x;
    }
    powers
}

impl Polynomial {
    /// The largest sum of powers of a term.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Number of terms.
    pub fn term_count(&self) -> usize {
        self.terms.len()
    }

    /// The value at a point.
    pub fn value(&self, point: &Vec3) -> f64 {
        let [x, y, z] = [powers(point.x), powers(point.y), powers(point.z)];
        let mut sum = 0.0;
        for Term { coefficient, powers: [i, j, k] } in &self.terms {
            sum += coefficient * (x[*i as usize + 2] * y[*j as usize + 2] * z[*k as usize + 2]);
        }
        sum
    }

    /// Value and gradient at a point.
    pub fn value_and_gradient(&self, point: &Vec3) -> (f64, Vec3) {
        let jet = self.jet(point);
        (jet.value, jet.gradient)
    }

    /// Value, first and second derivatives at a point.
    pub fn jet(&self, point: &Vec3) -> Jet {
        let [x, y, z] = [powers(point.x), powers(point.y), powers(point.z)];
        let (mut value, mut gradient, mut second) = (0.0, Vec3::zeros(), [0.0; 6]);
        for Term { coefficient, powers } in &self.terms {
            let [i, j, k] = powers.map(usize::from);
            let [fi, fj, fk] = powers.map(f64::from);
            let c = *coefficient;
            // Each factor with its first and second derivative; the zeros in front stand for x^-1 and x^-2.
            let (x0, x1, x2) = (x[i + 2], fi * x[i + 1], fi * (fi - 1.0) * x[i]);
            let (y0, y1, y2) = (y[j + 2], fj * y[j + 1], fj * (fj - 1.0) * y[j]);
            let (z0, z1, z2) = (z[k + 2], fk * z[k + 1], fk * (fk - 1.0) * z[k]);
            let (yz, xz) = (c * (y0 * z0), c * (x0 * z0));
            let xy = c * (x0 * y0);
            value += xy * z0;
            gradient += Vec3::new(yz * x1, xz * y1, xy * z1);
            second[0] += yz * x2;
            second[1] += xz * y2;
            second[2] += xy * z2;
            second[3] += c * (x1 * y1) * z0;
            second[4] += c * (x1 * z1) * y0;
            second[5] += c * (y1 * z1) * x0;
        }
        Jet { value, gradient, second }
    }
}

//! A polynomial along a straight line.

use super::{DEGREE_MAX, Polynomial, Term, powers};
use crate::{RootFinder, Vec3, bernstein, companion};

/// Rounding error of a Bernstein coefficient or a value over the sum of the terms' absolute values: two for each of sixteen
/// products and as many sums, at half a unit in the last place each, and four times that.
const ROUNDING: f64 = 1.0 / (1u64 << 46) as f64;

/// Coefficients of a polynomial in one variable, up to the largest degree.
pub(super) type Coefficients = [f64; DEGREE_MAX + 1];

/// Binomial coefficients: row n holds C(n, 0..=n).
const BINOMIALS: [Coefficients; DEGREE_MAX + 1] = {
    let mut rows = [[0.0; DEGREE_MAX + 1]; DEGREE_MAX + 1];
    let mut n = 0;
    while n <= DEGREE_MAX {
        rows[n][0] = 1.0;
        let mut k = 1;
        while k <= n {
            rows[n][k] = rows[n - 1][k - 1] + rows[n - 1][k];
            k += 1;
        }
        n += 1;
    }
    rows
};

/// A homogeneous polynomial in `1 - s` and `s`: coefficients of `(1 - s)^(n - k) s^k`, and `n`.
#[derive(Clone, Copy)]
struct Form {
    coefficients: Coefficients,
    degree: usize,
}

impl Form {
    const ZERO: Form = Form { coefficients: [0.0; DEGREE_MAX + 1], degree: 0 };

    /// Multiplies by `start (1 - s) + end s`.
    #[inline]
    fn times(&mut self, (start, end): (f64, f64)) {
        let c = &mut self.coefficients;
        c[self.degree + 1] = c[self.degree] * end;
        for k in (1..=self.degree).rev() {
            c[k] = c[k] * start + c[k - 1] * end;
        }
        c[0] *= start;
        self.degree += 1;
    }

    /// Adds a number, as a form of the same degree: the number times `((1 - s) + s)^n`.
    #[inline]
    fn add_number(&mut self, number: f64) {
        let row = &BINOMIALS[self.degree];
        for (c, binomial) in self.coefficients.iter_mut().zip(row).take(self.degree + 1) {
            *c += number * binomial;
        }
    }

    #[inline]
    fn add(&mut self, other: &Form) {
        for (c, o) in self.coefficients.iter_mut().zip(&other.coefficients).take(self.degree + 1) {
            *c += o;
        }
    }
}

impl Polynomial {
    /// Bernstein coefficients, of the polynomial's own degree, of its values from `start` (0) to `end` (1).
    ///
    /// Horner's rule with forms in `1 - s` and `s` instead of numbers: each coordinate is the form
    /// `start (1 - s) + end s`, each constant is lifted to the degree it stands at by a row of binomials. All is sums
    /// and products, so an error is a few roundings of the sum of the terms' absolute values.
    pub(super) fn along(&self, start: &Vec3, end: &Vec3) -> Coefficients {
        let degree = self.degree;
        let [x, y, z] = [0, 1, 2].map(|axis| (start[axis], end[axis]));
        // Terms come in ascending order of the powers of x, y, z; Horner's rule wants them descending.
        let mut terms = self.terms.iter().rev().peekable();
        let mut in_x = Form::ZERO;
        for i in (0..=degree as u8).rev() {
            if i < degree as u8 {
                in_x.times(x);
            }
            if terms.peek().is_none_or(|term| term.powers[0] != i) {
                continue;
            }
            let of_y = degree as u8 - i;
            let mut in_y = Form::ZERO;
            for j in (0..=of_y).rev() {
                if j < of_y {
                    in_y.times(y);
                }
                if terms.peek().is_none_or(|term| term.powers[..2] != [i, j]) {
                    continue;
                }
                let of_z = of_y - j;
                let mut in_z = Form::ZERO;
                for k in (0..=of_z).rev() {
                    if k < of_z {
                        in_z.times(z);
                    }
                    if let Some(term) = terms.next_if(|term| term.powers == [i, j, k]) {
                        in_z.add_number(term.coefficient);
                    }
                }
                in_y.add(&in_z);
            }
            in_x.add(&in_y);
        }
        let mut bernstein = in_x.coefficients;
        for (c, binomial) in bernstein.iter_mut().zip(&BINOMIALS[degree]).take(degree + 1) {
            *c /= binomial;
        }
        bernstein
    }

    /// Passes the roots on the way from `start` (0) to `end` (1), changes of sign strictly between the two, to `accept` in
    /// ascending order, and returns the first one for which it says true. What counts as a root is told in
    /// [`crate::bernstein`].
    pub fn find_root(&self, start: &Vec3, end: &Vec3, accept: impl FnMut(f64) -> bool) -> Option<f64> {
        self.find_root_by(RootFinder::Bernstein, start, end, accept)
    }

    /// The same by another root finder.
    #[inline]
    fn find_root_by(
        &self,
        finder: RootFinder,
        start: &Vec3,
        end: &Vec3,
        accept: impl FnMut(f64) -> bool,
    ) -> Option<f64> {
        let coefficients = self.along(start, end);
        macro_rules! of_degree {
            ($($n:literal)*) => {
                match self.degree {
                    $($n => {
                        let exact: &[f64; $n + 1] =
                            coefficients.first_chunk().expect("there are as many as the largest degree has");
                        match finder {
                            RootFinder::Bernstein => bernstein::find_root(exact, accept),
                            RootFinder::Companion => companion::find_root(exact, accept),
                        }
                    })*
                    // A constant has no roots.
                    _ => None,
                }
            };
        }
        of_degree!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16)
    }

    /// The first crossing beyond `t_min` along `origin + t direction` up to the bounds, with two Newton steps on the formula
    /// itself.
    ///
    /// # Double roots
    /// Where `F` touches 0 and turns back there is no crossing; but rounding may make two of it. So a root counts alone only
    /// if `F` certainly gets beyond its rounding error between it and the next: by the parabola there, to the depth
    /// `F'^2 / (2 |F''|)`. Of roots in a row that do not, each two cancel out: a double or fourfold root is none, a triple one is
    /// a crossing, at any rounding.
    pub fn first_root(
        &self,
        origin: &Vec3,
        direction: &Vec3,
        (start, end): (f64, f64),
        t_min: f64,
        finder: RootFinder,
    ) -> Option<f64> {
        let at = |t: f64| origin + direction * t;
        let (from, to) = (at(start), at(end));
        let (mut crossing, mut doubtful) = (None, None);
        self.find_root_by(finder, &from, &to, |s| {
            let t = start + s * (end - start);
            let jet = self.jet(&at(t));
            let (slope, bend) = (jet.gradient.dot(direction), jet.second_times(direction).dot(direction));
            let is_doubtful = slope * slope <= 2.0 * bend.abs() * self.rounding(&from, &to);
            // Newton's steps lead away from a double root.
            let step_max = if is_doubtful { 0.0 } else { 1e-6 * (end - start) };
            let t = self.polished(origin, direction, t - corrected(jet.value / slope, step_max), step_max);
            if !(t > t_min) {
                return false;
            }
            if is_doubtful {
                doubtful = if doubtful.is_none() { Some(t) } else { None };
                return false;
            }
            crossing = Some(t);
            true
        });
        // One that is left over lies before any crossing that is certain.
        doubtful.or(crossing)
    }

    /// What rounding may do to a value between two points: a part of the sum of the terms' largest absolute values there.
    fn rounding(&self, from: &Vec3, to: &Vec3) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let (a, b) = (from[axis].abs(), to[axis].abs());
            powers(if a > b { a } else { b })
        });
        let term = |term: &Term| {
            let [i, j, k] = term.powers.map(|power| usize::from(power) + 2);
            term.coefficient.abs() * (x[i] * y[j] * z[k])
        };
        ROUNDING * self.terms.iter().map(term).sum::<f64>()
    }

    /// Another Newton step.
    fn polished(&self, origin: &Vec3, direction: &Vec3, t: f64, step_max: f64) -> f64 {
        let (value, gradient) = self.value_and_gradient(&(origin + direction * t));
        t - corrected(value / gradient.dot(direction), step_max)
    }
}

/// A step, or none if it is too large to be a correction.
fn corrected(step: f64, step_max: f64) -> f64 {
    if step < step_max && step > -step_max { step } else { 0.0 }
}

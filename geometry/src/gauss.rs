//! Gauss-Legendre quadrature on `[-1, 1]` for integrals over contact arcs.

/// Number of points of a Gauss-Legendre rule; a rule of `n` points integrates polynomials of degree
/// `2 n - 1` exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum GaussRule {
    /// 2 points, exact to degree 3.
    Two,
    /// 3 points, exact to degree 5.
    Three,
    /// 4 points, exact to degree 7.
    Four,
    /// 6 points, exact to degree 11.
    Six,
    /// 8 points, exact to degree 15.
    Eight,
}

impl GaussRule {
    /// The points and weights `(x, weight)` in ascending order of `x`; the weights sum to 2.
    #[inline]
    pub fn nodes(self) -> &'static [(f64, f64)] {
        match self {
            GaussRule::Two => &TWO,
            GaussRule::Three => &THREE,
            GaussRule::Four => &FOUR,
            GaussRule::Six => &SIX,
            GaussRule::Eight => &EIGHT,
        }
    }
}

const TWO: [(f64, f64); 2] = [(-0.5773502691896257, 1.0), (0.5773502691896257, 1.0)];
const THREE: [(f64, f64); 3] = [
    (-0.7745966692414834, 0.5555555555555556),
    (0.0, 0.8888888888888888),
    (0.7745966692414834, 0.5555555555555556),
];
const FOUR: [(f64, f64); 4] = [
    (-0.8611363115940526, 0.34785484513745385),
    (-0.33998104358485626, 0.6521451548625461),
    (0.33998104358485626, 0.6521451548625461),
    (0.8611363115940526, 0.34785484513745385),
];
const SIX: [(f64, f64); 6] = [
    (-0.932469514203152, 0.17132449237917036),
    (-0.6612093864662645, 0.3607615730481386),
    (-0.2386191860831969, 0.46791393457269104),
    (0.2386191860831969, 0.46791393457269104),
    (0.6612093864662645, 0.3607615730481386),
    (0.932469514203152, 0.17132449237917036),
];
const EIGHT: [(f64, f64); 8] = [
    (-0.9602898564975363, 0.10122853629037626),
    (-0.7966664774136267, 0.22238103445337448),
    (-0.525532409916329, 0.31370664587788727),
    (-0.1834346424956498, 0.362683783378362),
    (0.1834346424956498, 0.362683783378362),
    (0.525532409916329, 0.31370664587788727),
    (0.7966664774136267, 0.22238103445337448),
    (0.9602898564975363, 0.10122853629037626),
];

//! All local minima of the distance from one circle to another, inside their contact arcs.
//!
//! With `X` the squared distance of a point of A from B's centre, `rho` its distance from B's axis and
//! `D^2 = X + R_B^2 - 2 R_B rho`, the slope of `D^2 / 2` along A is `X'/2 - R_B rho'`. It vanishes where
//!
//! ```text
//! (X'/2)^2 rho^2 - R_B^2 (rho rho')^2 = 0
//! ```
//!
//! which is a polynomial of degree eight in the tangent of half the angle (the other roots belong to the farthest
//! point of B). Its Bernstein coefficients on a piece of an arc bound the number of roots from above, so the piece
//! is cut until each part holds one at most; a part at whose ends the slope goes from falling to rising holds a
//! minimum. So none is missed, and a connected arc has at least one.
//!
//! # Source
//! The degree-eight polynomial: Neff, "Finding the distance between two circles in three-dimensional space", IBM J.
//! Res. Dev. 34(5), 1990. Deviation: isolated by Bernstein sign changes, and on contact arcs only.

use crate::{
    Circle, Vec3,
    arc::{Arc, Arcs, Wave},
    bernstein,
    closest::Distance,
};

/// Parts of a piece narrower than this are not cut further: two minima that close are taken as one.
const WIDTH_MIN: f64 = 1.0 / (1u64 << 24) as f64;

/// Where a part is cut: not in the middle, where symmetric poses have their roots.
const CUT: f64 = 0.4831;

/// The iteration ends at a step below this, in the tangent of half the angle: the next would be of its square's size, 1e-12.
const STEP_MIN: f64 = 1e-6;

/// Below this share of `R_A (R_A + R_B)` in slope and curvature, `D^2 / 2` is taken as flat: rounding makes 1e-16 of it.
const FLAT: f64 = 1e-13;

/// A local minimum of the distance, by its angle on circle A.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Minimum {
    /// Cosine of the angle.
    pub cos: f64,
    /// Sine of the angle.
    pub sin: f64,
    /// The connected arc it lies in: 0 or 1.
    pub connected: u8,
    /// Its share: 1, but 1/4 for each of the four points, a quarter turn apart, that stand for a distance that is
    /// the same all round.
    pub share: f64,
}

/// The minima found, in the order of the arcs: at most four, as many as the polynomial's degree allows.
#[derive(Debug, Clone, Copy)]
pub struct Minima {
    found: [Minimum; 4],
    count: usize,
}

impl Minima {
    const NONE: Minima =
        Minima { found: [Minimum { cos: 1.0, sin: 0.0, connected: 0, share: 1.0 }; 4], count: 0 };

    /// The minima.
    pub fn as_slice(&self) -> &[Minimum] {
        &self.found[..self.count]
    }

    /// How many of them lie in a connected arc.
    pub fn count_in(&self, connected: u8) -> usize {
        self.as_slice().iter().filter(|minimum| minimum.connected == connected).count()
    }

    /// Four points a quarter turn apart, for a distance that is the same all round.
    fn flat() -> Minima {
        let mut minima = Minima::NONE;
        for (cos, sin) in [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)] {
            minima.found[minima.count] = Minimum { cos, sin, connected: 0, share: 0.25 };
            minima.count += 1;
        }
        minima
    }

    /// The one minimum of a wave on its only arc; flat if the wave does not change.
    fn of_wave(cos: f64, sin: f64, scale: f64) -> Minima {
        let amplitude = (cos * cos + sin * sin).sqrt();
        if !(amplitude > FLAT * scale) {
            return Minima::flat();
        }
        let mut minima = Minima::NONE;
        minima.add(-cos / amplitude, -sin / amplitude, 0);
        minima
    }

    fn add(&mut self, cos: f64, sin: f64, connected: u8) {
        // Found from both sides of a border between two pieces: the angle between them is below 1e-7.
        let again =
            |other: &Minimum| other.connected == connected && other.cos * cos + other.sin * sin > 1.0 - 5e-15;
        if self.count < self.found.len() && !self.as_slice().iter().any(again) {
            self.found[self.count] = Minimum { cos, sin, connected, share: 1.0 };
            self.count += 1;
        }
    }
}

/// The minima of the distance from circle `a` to circle `b` within the contact arcs of `a`, as
/// [`circle_circle_arcs`](crate::arc::circle_circle_arcs) gives them for any reach.
pub fn circle_circle_minima(a: &Circle, b: &Circle, arcs: &Arcs) -> Minima {
    let distance = Distance::new(a, b);
    let mut minima = Minima::NONE;
    let flat = FLAT * a.radius * (a.radius + b.radius);
    let still = |cos: f64, sin: f64| {
        let (first, second) = distance.derivatives(cos, sin);
        first.abs() < flat && second.abs() < flat
    };
    let pieces = arcs.as_slice();
    let Some((first, last)) = pieces.first().zip(pieces.last()) else { return minima };
    let (start, end) = (first.at(-first.half_tangent), last.at(last.half_tangent));
    let closed =
        arcs.connected_count() == 1 && pieces.len() > 3 && start.0 * end.0 + start.1 * end.1 > 1.0 - 1e-12;
    if closed && pieces.iter().all(|piece| still(piece.mid_cos, piece.mid_sin)) {
        return Minima::flat();
    }
    // The distance falls where an arc begins; round a whole circle it goes on as it ended.
    let mut slope = if closed { distance.slope(last, last.half_tangent) } else { -1.0 };
    let mut connected = first.connected;
    for (index, piece) in pieces.iter().enumerate() {
        if piece.connected != connected {
            (slope, connected) = (-1.0, piece.connected);
        }
        let alone = !closed && pieces.iter().filter(|other| other.connected == connected).count() == 1;
        if alone && convex(&distance, piece) {
            // Falling where it begins and rising where it ends, with one minimum in between.
            let (low, high) = (-piece.half_tangent, piece.half_tangent);
            let (cos, sin) = distance.bracketed(piece, low, high, STEP_MIN);
            minima.add(cos, sin, connected);
            continue;
        }
        let before = slope;
        let begins = distance.slope(piece, -piece.half_tangent);
        if before < 0.0 && begins >= 0.0 {
            let (cos, sin) = piece.at(-piece.half_tangent);
            minima.add(cos, sin, connected);
        }
        search(&distance, piece, begins, &mut minima);
        slope = distance.slope(piece, piece.half_tangent);
        let arc_ends = pieces.get(index + 1).is_none_or(|next| next.connected != connected);
        // Rounding at the ends of an arc of no length.
        if arc_ends && minima.count_in(connected) == 0 {
            minima.add(piece.mid_cos, piece.mid_sin, connected);
        }
    }
    minima
}

/// The point of circle `a` closest to a point, as a minimum; all round for a point on its axis.
pub fn circle_point_minima(a: &Circle, point: &Vec3) -> Minima {
    let d = a.centre - point;
    Minima::of_wave(d.dot(&a.u), d.dot(&a.w), a.radius + d.norm_squared().sqrt())
}

/// The lowest point of circle `a` over a plane with this normal, as a minimum; all round for a circle that lies flat.
pub fn circle_plane_minima(a: &Circle, plane_normal: &Vec3) -> Minima {
    Minima::of_wave(a.u.dot(plane_normal), a.w.dot(plane_normal), 1.0)
}

/// Adds the minima inside one piece; `begins` is the slope at its start.
fn search(distance: &Distance, piece: &Arc, begins: f64, minima: &mut Minima) {
    let coefficients = critical(distance, piece);
    let changes = bernstein::sign_changes(&coefficients);
    if changes > 1 {
        return search_parts(distance, piece, begins, coefficients, minima);
    }
    let (low, high) = (-piece.half_tangent, piece.half_tangent);
    if changes > 0 && begins < 0.0 && distance.slope(piece, high) >= 0.0 {
        let (cos, sin) = distance.bracketed(piece, low, high, STEP_MIN);
        minima.add(cos, sin, piece.connected);
    }
}

/// The same for a piece on which there may be more than one.
#[cold]
fn search_parts(distance: &Distance, piece: &Arc, begins: f64, coefficients: [f64; 9], minima: &mut Minima) {
    // Parts still to be looked at, the next one last: start, end (from 0 to 1 on the piece), coefficients.
    let mut parts = [(0.0, 1.0, [0.0; 9]); 32];
    parts[0].2 = coefficients;
    let mut count = 1;
    let mut slope = begins;
    while count > 0 {
        count -= 1;
        let (start, end, coefficients) = parts[count];
        let changes = bernstein::sign_changes(&coefficients);
        if changes > 1 && end - start > WIDTH_MIN && count + 2 <= parts.len() {
            let (left, right) = bernstein::parts(&coefficients, CUT);
            let cut = start + CUT * (end - start);
            parts[count] = (cut, end, right);
            parts[count + 1] = (start, cut, left);
            count += 2;
            continue;
        }
        let tau = |x: f64| piece.half_tangent * (2.0 * x - 1.0);
        let after = distance.slope(piece, tau(end));
        if changes > 0 && slope < 0.0 && after >= 0.0 {
            let (cos, sin) = distance.bracketed(piece, tau(start), tau(end), STEP_MIN);
            minima.add(cos, sin, piece.connected);
        }
        slope = after;
    }
}

/// Bernstein coefficients, times the binomials, of a wave times `1 + tau^2` on a piece: so a product's coefficients are a
/// plain convolution.
#[inline]
fn on(piece: &Arc, wave: &Wave) -> [f64; 3] {
    let square = piece.half_tangent * piece.half_tangent;
    let along = wave[1] * piece.mid_cos + wave[2] * piece.mid_sin;
    let across = 2.0 * piece.half_tangent * (wave[2] * piece.mid_cos - wave[1] * piece.mid_sin);
    let ends = wave[0] * (1.0 + square) + along * (1.0 - square);
    let middle = wave[0] * (1.0 - square) + along * (1.0 + square);
    [ends - across, 2.0 * middle, ends + across]
}

/// First and second derivative of a wave.
#[inline]
fn derivatives(wave: &Wave) -> [Wave; 2] {
    [[0.0, wave[2], -wave[1]], [0.0, -wave[1], -wave[2]]]
}

/// Whether the slope's numerator `g = X'/2 rho - R_B rho rho'` surely rises all along a piece, so that there is one minimum
/// at most: `rho g' = X''/2 rho^2 + X'/2 (rho rho') - R_B (rho rho')' rho` is a polynomial of degree six but for the last
/// `rho`, for which its bounds on the piece are taken. A quick proof for most contacts, and one that holds where the
/// farthest point of B has its extremum at the same place, which makes a double root of the other polynomial.
fn convex(distance: &Distance, piece: &Arc) -> bool {
    let [x, y] = [0, 1].map(|axis| on(piece, &distance.across[axis]));
    let [[x_1, x_2], [y_1, y_2]] =
        [0, 1].map(|axis| derivatives(&distance.across[axis]).map(|wave| on(piece, &wave)));
    let [half_x_1, half_x_2] = derivatives(&distance.half_x).map(|wave| on(piece, &wave));
    let one = on(piece, &[1.0, 0.0, 0.0]);
    let (mut rho_squared, mut first, mut second) = ([0.0; 5], [0.0; 5], [0.0; 5]);
    for i in 0..3 {
        for j in 0..3 {
            rho_squared[i + j] += x[i] * x[j] + y[i] * y[j];
            first[i + j] += x[i] * x_1[j] + y[i] * y_1[j];
            second[i + j] += (x_1[i] * x_1[j] + y_1[i] * y_1[j]) + (x[i] * x_2[j] + y[i] * y_2[j]);
        }
    }
    const INVERSE_BINOMIALS: [f64; 5] = [1.0, 0.25, 1.0 / 6.0, 0.25, 1.0];
    let (mut least, mut largest) = (f64::INFINITY, 0.0);
    for (coefficient, inverse) in rho_squared.iter().zip(INVERSE_BINOMIALS) {
        let value = coefficient * inverse;
        least = if value < least { value } else { least };
        largest = if value > largest { value } else { largest };
    }
    if !(least > 0.0) {
        return false;
    }
    let widest = 1.0 + piece.half_tangent * piece.half_tangent;
    let bounds = [least.sqrt() / widest, largest.sqrt()].map(|rho| rho * distance.radius);
    let mut sums = [[0.0; 7]; 2];
    for i in 0..3 {
        for j in 0..5 {
            let common = half_x_2[i] * rho_squared[j] + half_x_1[i] * first[j];
            for (sum, bound) in sums.iter_mut().zip(bounds) {
                sum[i + j] += common - bound * (one[i] * second[j]);
            }
        }
    }
    sums.iter().flatten().all(|coefficient| *coefficient > 0.0)
}

/// Bernstein coefficients of the module's polynomial on a piece.
fn critical(distance: &Distance, piece: &Arc) -> [f64; 9] {
    let [x, y] = [0, 1].map(|axis| on(piece, &distance.across[axis]));
    let [x_1, y_1] = [0, 1].map(|axis| on(piece, &derivatives(&distance.across[axis])[0]));
    let half_x_1 = on(piece, &derivatives(&distance.half_x)[0]);
    let (mut rho_squared, mut rho_rho_1, mut slope_squared) = ([0.0; 5], [0.0; 5], [0.0; 5]);
    for i in 0..3 {
        for j in 0..3 {
            rho_squared[i + j] += x[i] * x[j] + y[i] * y[j];
            rho_rho_1[i + j] += x[i] * x_1[j] + y[i] * y_1[j];
            slope_squared[i + j] += half_x_1[i] * half_x_1[j];
        }
    }
    let radius_squared = distance.radius * distance.radius;
    let mut product = [0.0; 9];
    for i in 0..5 {
        for j in 0..5 {
            product[i + j] +=
                slope_squared[i] * rho_squared[j] - radius_squared * (rho_rho_1[i] * rho_rho_1[j]);
        }
    }
    const INVERSE_BINOMIALS: [f64; 9] =
        [1.0, 1.0 / 8.0, 1.0 / 28.0, 1.0 / 56.0, 1.0 / 70.0, 1.0 / 56.0, 1.0 / 28.0, 1.0 / 8.0, 1.0];
    for (coefficient, inverse) in product.iter_mut().zip(INVERSE_BINOMIALS) {
        *coefficient *= inverse;
    }
    product
}

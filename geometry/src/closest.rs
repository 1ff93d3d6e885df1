//! Closest points of two circles: descend, then prove.

use crate::{
    Circle, Vec3,
    arc::{Arc, circle_circle_arcs},
};

/// The closest points of two circles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestPoints {
    /// Distance between the two points (m), never negative; minus both minor radii it is the gap of two
    /// rings.
    pub distance: f64,
    /// The point on the first circle.
    pub point_a: Vec3,
    /// The point on the second circle.
    pub point_b: Vec3,
}

/// Below the best distance by this part of `R_A + R_B + |c_A - c_B|`, the contact arcs must be empty. It
/// stands above the arcs' own rounding (about 2e-16 of the same); a larger value would let a second
/// minimum hide that is lower by as much.
const PROOF_MARGIN: f64 = 1e-14;

/// Each round ends at a lower local minimum, of which there are at most four (a polynomial of degree
/// eight); the limit only guards against rounding.
const ROUNDS_MAX: u32 = 16;

/// The globally closest points of two circles.
///
/// From the best of eight points the distance is descended to a local minimum; then the contact arcs for a
/// reach just below it are asked for. No arc proves that the minimum is global (to 1e-14 of the circles'
/// size and distance); otherwise the search goes on inside the arcs. Where many points are equally close
/// (coaxial circles, or a circle through the other's axis) any one of them is returned, always the same for
/// the same arguments. Exchanging the circles gives the same distance but for rounding.
pub fn closest_points(a: &Circle, b: &Circle) -> ClosestPoints {
    const H: f64 = core::f64::consts::FRAC_1_SQRT_2;
    const STARTS: [(f64, f64); 8] =
        [(1.0, 0.0), (H, H), (0.0, 1.0), (-H, H), (-1.0, 0.0), (-H, -H), (0.0, -1.0), (H, -H)];
    let mut best = at(a, b, 1.0, 0.0);
    for (cos, sin) in &STARTS[1..] {
        let other = at(a, b, *cos, *sin);
        if other.distance < best.distance {
            best = other;
        }
    }
    let margin = PROOF_MARGIN * (a.radius + b.radius + (a.centre - b.centre).norm());
    let distance = Distance::new(a, b);
    for _ in 0..ROUNDS_MAX {
        let reach = best.distance - margin;
        if !(reach > 0.0) {
            break;
        }
        let before = best.distance;
        for arc in circle_circle_arcs(a, b, reach).iter() {
            let (cos, sin) = distance.minimum(arc);
            let other = at(a, b, cos, sin);
            if other.distance < best.distance {
                best = other;
            }
        }
        if !(best.distance < before) {
            break;
        }
    }
    best
}

fn at(a: &Circle, b: &Circle, cos: f64, sin: f64) -> ClosestPoints {
    let point_a = a.point(cos, sin);
    let point_b = b.closest_point(&point_a);
    ClosestPoints { distance: (point_a - point_b).norm(), point_a, point_b }
}

/// Half the squared distance from a point of A to B, as a function of A's angle `t`:
/// `(X + R_B^2) / 2 - R_B rho`, with `X` the squared distance from B's centre, `h` the height over B's
/// plane and `rho = sqrt(X - h^2)`.
pub(crate) struct Distance {
    /// Coefficients of 1, cos(t) and sin(t) in half `X`.
    pub half_x: [f64; 3],
    /// The same in `h`.
    h: [f64; 3],
    /// The same in the two coordinates across B's axis.
    pub across: [[f64; 3]; 2],
    pub radius: f64,
}

impl Distance {
    pub(crate) fn new(a: &Circle, b: &Circle) -> Distance {
        let d = a.centre - b.centre;
        let wave = |axis: &Vec3| [d.dot(axis), a.radius * a.u.dot(axis), a.radius * a.w.dot(axis)];
        Distance {
            half_x: [
                0.5 * (d.norm_squared() + a.radius * a.radius),
                a.radius * d.dot(&a.u),
                a.radius * d.dot(&a.w),
            ],
            h: wave(&b.normal),
            across: [wave(&b.u), wave(&b.w)],
            radius: b.radius,
        }
    }

    /// First and second derivative by `t`.
    #[inline(always)]
    pub(crate) fn derivatives(&self, cos: f64, sin: f64) -> (f64, f64) {
        let value = |c: &[f64; 3]| c[0] + c[1] * cos + c[2] * sin;
        let first = |c: &[f64; 3]| c[2] * cos - c[1] * sin;
        let second = |c: &[f64; 3]| -(c[1] * cos + c[2] * sin);
        let (x, y) = (value(&self.across[0]), value(&self.across[1]));
        let (x_1, y_1) = (first(&self.across[0]), first(&self.across[1]));
        let rho = (x * x + y * y).sqrt();
        if !(rho > 0.0) {
            // On B's axis the distance has a ridge or is flat: no slope of its own.
            return (first(&self.half_x), second(&self.half_x));
        }
        let rho_1 = (x * x_1 + y * y_1) / rho;
        let h = value(&self.h);
        let h_1 = first(&self.h);
        let rho_2 = (second(&self.half_x) - h_1 * h_1 - h * second(&self.h) - rho_1 * rho_1) / rho;
        (first(&self.half_x) - self.radius * rho_1, second(&self.half_x) - self.radius * rho_2)
    }

    /// First derivative at the point `tau = tan((t - mid) / 2)` of an arc.
    pub(crate) fn slope(&self, arc: &Arc, tau: f64) -> f64 {
        let (cos, sin) = arc.at(tau);
        self.derivatives(cos, sin).0
    }

    /// `(cos, sin)` of a minimum on the arc: inside where the slope changes from falling to rising, else
    /// the lower end.
    fn minimum(&self, arc: &Arc) -> (f64, f64) {
        let (low, high) = (-arc.half_tangent, arc.half_tangent);
        if self.slope(arc, low) >= 0.0 {
            return arc.at(low);
        }
        if self.slope(arc, high) <= 0.0 {
            return arc.at(high);
        }
        self.bracketed(arc, low, high, 1e-15)
    }

    /// `(cos, sin)` of the minimum between two values of `tau` at which the slope falls and rises; the iteration ends
    /// at a step below `step_min`.
    pub(crate) fn bracketed(&self, arc: &Arc, low: f64, high: f64, step_min: f64) -> (f64, f64) {
        let (mut low, mut high) = (low, high);
        let mut tau = 0.5 * (low + high);
        for _ in 0..64 {
            let (cos, sin) = arc.at(tau);
            let (first, second) = self.derivatives(cos, sin);
            if first < 0.0 {
                low = tau;
            } else {
                high = tau;
            }
            let mut next = tau - first / (second * 2.0 / (1.0 + tau * tau));
            if !(next > low && next < high) {
                next = 0.5 * (low + high);
            }
            let step = next - tau;
            tau = next;
            if step < step_min && step > -step_min {
                break;
            }
        }
        arc.at(tau)
    }
}

//! First hits of rays with tori, sixteen rays with a torus each side by side.
//!
//! The one thing to know: a lane's answer is a function of its ray and its torus alone, with the same bits on every
//! instruction set. What is rare (a ray that runs along the wire, a root that the start of the ray forbids) is answered by
//! [`ray_torus`](torus::ray_torus), one at a time; which lanes those are is a function of ray and torus, too.
//!
//! # Method
//! That of [`crate::torus`] up to the quartic `f = y^2 + z^2 - r^2` in Bernstein form on the part of the ray within the
//! enclosing sphere and slab. No sign change is a certain miss. With more than one the part is cut, first near the
//! extremum of the parabola through the values at its ends and middle, until a part with one sign change comes before all
//! others that have any. Within that part the root is found by Newton's method on `g = (rho - R)^2 + z^2 - r^2`,
//! which has the sign of `f` everywhere, with a bracket that shrinks with every evaluation.
//!
//! # Accuracy
//! Newton's error after a step is about `k step^2`, with `k` the curvature over the slope, and `k` is about `step / before^2`
//! with the step before. So a lane stops when `step^3 < 2^-50 w before^2` and `step < 2^-25 w`, with `w` the length of the part:
//! the error left is below `2^-48 w`. It stops, too, where `g` is below `2^-50 r R`, twice its own rounding error, which moves the
//! hit by less than `2^-50 R` over the cosine of the ray to the normal.

use super::{LANES, Lanes, Level, Mask, Simd, Vectors, dispatch, larger};
use crate::{Vec3, torus};

/// As in [`crate::torus`].
const MARGIN: f64 = 1e-6;
/// As in `crate::shift`.
const FAR: f64 = 64.0;
/// A part that is not isolated after so many cuts is looked at one by one.
const CUTS_MAX: usize = 6;
/// Enough for bisection alone.
const STEPS_MAX: usize = 64;
/// The search starts at least this far from the ends of its part: another root may lie on a cut.
const START_MIN: f64 = 1.0 / 16.0;
/// Adding and subtracting this rounds a number near 1 to a multiple of 1/256.
const ROUND: f64 = 1.5 * (1u64 << 44) as f64;
/// See the module's page.
const STEP_MAX: f64 = 1.0 / (1u64 << 25) as f64;
const ERROR_MAX: f64 = 1.0 / (1u64 << 50) as f64;
const NOISE: f64 = 1.0 / (1u64 << 50) as f64;

/// Rows: from the torus' centre to the ray's origin, direction of the ray, axis of the torus, R, r.
const ROWS: usize = 11;

/// Rays and tori, one of each in a lane.
#[derive(Clone, Debug)]
pub struct RaysAndTori {
    rows: [[f64; LANES]; ROWS],
}

impl Default for RaysAndTori {
    fn default() -> RaysAndTori {
        // Rays that miss: a lane that was never filled has an answer like every other.
        let mut pairs = RaysAndTori { rows: [[0.0; LANES]; ROWS] };
        for lane in 0..LANES {
            pairs.put(lane, &Vec3::new(4.0, 0.0, 0.0), &Vec3::z(), &Vec3::z(), [1.0, 0.5]);
        }
        pairs
    }
}

impl RaysAndTori {
    /// Fills a lane: `from_centre` leads from the torus' centre to the ray's origin; `direction` of the ray and `axis` of
    /// the torus are unit vectors; `radii` are R and r, with `0 < r <= R`. Any frame, lengths in metres.
    #[inline(always)]
    pub fn put(&mut self, lane: usize, from_centre: &Vec3, direction: &Vec3, axis: &Vec3, radii: [f64; 2]) {
        let numbers = [
            from_centre.x,
            from_centre.y,
            from_centre.z,
            direction.x,
            direction.y,
            direction.z,
            axis.x,
            axis.y,
            axis.z,
            radii[0],
            radii[1],
        ];
        for (row, number) in self.rows.iter_mut().zip(numbers) {
            row[lane] = number;
        }
    }

    /// Ray parameters (m) of the first crossings beyond `t_min`; NaN where there is none.
    pub fn first_hits(&self, level: Level, t_min: f64) -> [f64; LANES] {
        let mut hits = [f64::NAN; LANES];
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.first_hits_with(simd, t_min, &mut hits)
        ));
        hits
    }

    #[inline(always)]
    fn first_hits_with<S: Simd>(&self, simd: S, t_min: f64, hits: &mut [f64; LANES]) {
        let none = Lanes::splat(simd, f64::NAN);
        let (found, mut irregular) = match Clipped::new(simd, &self.rows, t_min) {
            None => (none, 0),
            Some(clipped) => clipped.first_root(simd, t_min),
        };
        found.store_array(hits);
        while irregular != 0 {
            let lane = irregular.trailing_zeros() as usize & (LANES - 1);
            irregular &= irregular - 1;
            hits[lane] = self.one_by_one(lane, t_min);
        }
    }

    #[cold]
    #[inline(never)]
    fn one_by_one(&self, lane: usize, t_min: f64) -> f64 {
        let vector =
            |row: usize| Vec3::new(self.rows[row][lane], self.rows[row + 1][lane], self.rows[row + 2][lane]);
        let (origin, direction, z) = (vector(0), vector(3), vector(6));
        // Any two axes that are perpendicular to the third.
        let least = if z.x * z.x < 0.5 { Vec3::x() } else { Vec3::y() };
        let x = (least - z * z.dot(&least)).normalize();
        let y = z.cross(&x);
        let local = |v: &Vec3| Vec3::new(x.dot(v), y.dot(v), z.dot(v));
        let [major_radius, minor_radius] = [self.rows[9][lane], self.rows[10][lane]];
        torus::ray_torus(&local(&origin), &local(&direction), major_radius, minor_radius, t_min)
            .unwrap_or(f64::NAN)
    }
}

/// Rays cut to where they may meet their tori, and the quartics there.
struct Clipped<S: Simd> {
    /// Lanes whose rays have a part left.
    left: u32,
    /// Ray parameter of the point of closest approach; `u = t - s` counts from there.
    s: Lanes<S>,
    start: Lanes<S>,
    length: Lanes<S>,
    quartic: Quartic<S>,
    line: Line<S>,
}

/// Rays within the frames of their tori: across and along the axes.
struct Line<S: Simd> {
    across: Vectors<S>,
    across_direction: Vectors<S>,
    height: Lanes<S>,
    slope: Lanes<S>,
    major: Lanes<S>,
    minor: Lanes<S>,
}

#[inline(always)]
fn load<S: Simd>(simd: S, rows: &[[f64; LANES]; ROWS], row: usize) -> Lanes<S> {
    Lanes::load_array_ref(simd, &rows[row])
}

#[inline(always)]
fn vectors<S: Simd>(simd: S, rows: &[[f64; LANES]; ROWS], row: usize) -> Vectors<S> {
    Vectors([load(simd, rows, row), load(simd, rows, row + 1), load(simd, rows, row + 2)])
}

impl<S: Simd> Clipped<S> {
    #[inline(always)]
    fn new(simd: S, rows: &[[f64; LANES]; ROWS], t_min: f64) -> Option<Clipped<S>> {
        let (origin, direction, axis) =
            (vectors(simd, rows, 0), vectors(simd, rows, 3), vectors(simd, rows, 6));
        let (major, minor) = (load(simd, rows, 9), load(simd, rows, 10));
        let zero = Lanes::splat(simd, 0.0);
        let outer = (major + minor) * (1.0 + MARGIN);
        let s = -origin.dot(&direction);
        let p = closest(&origin, &direction, s, outer * FAR);
        let (squared, linear) = (p.dot(&p), p.dot(&direction));
        let (height, slope) = (p.dot(&axis), direction.dot(&axis));

        let discriminant = outer * outer - squared;
        let in_ball = discriminant.simd_gt(zero);
        let half_chord = in_ball.select(discriminant, zero).sqrt();
        let (start, end) = (larger(-half_chord, t_min - s), half_chord);
        let half_height = minor * (1.0 + MARGIN);
        let (z_start, z_end) = (height + slope * start, height + slope * end);
        let above = z_start.simd_gt(half_height) & z_end.simd_gt(half_height);
        let below = z_start.simd_lt(-half_height) & z_end.simd_lt(-half_height);
        let left = in_ball & start.simd_lt(end) & !(above | below);
        if left.to_bitmask() == 0 {
            return None;
        }
        // Where the slope is zero nothing is cut.
        let inverse_slope = 1.0 / slope;
        let (z_start, start) = cut(z_start, start, half_height, height, inverse_slope);
        let (z_end, end) = cut(z_end, end, half_height, height, inverse_slope);
        // Both ends within the hole, a convex cylinder: so is all between.
        let hole = larger((major - minor) * (1.0 - MARGIN), zero);
        let (ends_squared, twice) = (hole * hole, linear + linear);
        let (x_start, x_end) = (squared + start * (twice + start), squared + end * (twice + end));
        let in_hole = (x_start - z_start * z_start).simd_lt(ends_squared)
            & (x_end - z_end * z_end).simd_lt(ends_squared);
        let left = (left & !in_hole).to_bitmask();
        if left == 0 {
            return None;
        }

        let r_squared = minor * minor;
        let (radii, scale) = (major * major + r_squared, 0.5 / major);
        let y = [
            (x_start - radii) * scale,
            (squared + linear * (start + end) + start * end - radii) * scale,
            (x_end - radii) * scale,
        ];
        let q = [z_start * z_start - r_squared, z_start * z_end - r_squared, z_end * z_end - r_squared];
        let quartic = Quartic([
            y[0] * y[0] + q[0],
            y[0] * y[1] + 0.5 * (q[0] + q[1]),
            (y[0] * y[2] + 2.0 * y[1] * y[1]) * (1.0 / 3.0) + (q[0] + 4.0 * q[1] + q[2]) * (1.0 / 6.0),
            y[1] * y[2] + 0.5 * (q[1] + q[2]),
            y[2] * y[2] + q[2],
        ]);
        let across = less(&p, &axis, height);
        let across_direction = less(&direction, &axis, slope);
        let line = Line { across, across_direction, height, slope, major, minor };
        Some(Clipped { left, s, start, length: end - start, quartic, line })
    }

    /// Ray parameters of the first roots, NaN where there is none, and the lanes that have to be looked at one by one.
    #[inline(always)]
    fn first_root(&self, simd: S, t_min: f64) -> (Lanes<S>, u32) {
        let nan = Lanes::splat(simd, f64::NAN);
        let signs = self.quartic.signs();
        let mut irregular = self.left & signs.odd;
        let mut isolated = self.left & signs.one;
        let mut several = self.left & signs.several;
        if (isolated | several | irregular) == 0 {
            return (nan, 0);
        }
        let mut part =
            Part { quartic: self.quartic, start: Lanes::splat(simd, 0.0), width: Lanes::splat(simd, 1.0) };
        for count in 0..CUTS_MAX {
            if several == 0 {
                break;
            }
            let (left, right) = part.cut(simd, count % 2 == 0);
            let (in_left, in_right) = (left.quartic.signs(), right.quartic.signs());
            // A root may lie on the cut itself; that is a zero, and so odd.
            let odd = several & (in_left.odd | in_right.odd);
            let go_right = several & !odd & in_left.none;
            let go_left = several & !odd & (in_left.one | in_left.several & in_right.none);
            let missed = go_right & in_right.none;
            irregular |= several & !(go_left | go_right);
            isolated |= go_left & in_left.one | go_right & in_right.one;
            let (to_left, to_right) = (Mask::from_bitmask(simd, go_left), Mask::from_bitmask(simd, go_right));
            part = part.replaced(to_left, &left).replaced(to_right, &right);
            several = (go_left & in_left.several | go_right & in_right.several) & !missed;
        }
        irregular |= several;
        if isolated == 0 {
            return (nan, irregular);
        }
        let hit = self.s + self.newton(simd, &part, isolated);
        let beyond = hit.simd_gt(Lanes::splat(simd, t_min)).to_bitmask();
        // A root too near to the start: a later one may be the first that counts.
        irregular |= isolated & !beyond;
        (Mask::from_bitmask(simd, isolated & beyond).select(hit, nan), irregular)
    }

    /// The root of `g` in parts of the rays in which it changes sign once.
    #[inline(always)]
    fn newton(&self, simd: S, part: &Part<S>, isolated: u32) -> Lanes<S> {
        let zero = Lanes::splat(simd, 0.0);
        let width = self.length * part.width;
        let mut low = self.start + self.length * part.start;
        let mut high = low + width;
        let starts_inside = part.quartic.0[0].simd_lt(zero);
        let mut u = low + width * part.quartic.parabola_root(simd);
        let mut before = width;
        let (step_max, error_max) = (width * STEP_MAX, width * ERROR_MAX);
        let noise = self.line.major * self.line.minor * NOISE;
        let mut open = isolated;
        for _ in 0..STEPS_MAX {
            let (value, half_slope) = self.line.value(u);
            let value_inside = value.simd_lt(zero);
            let running = Mask::from_bitmask(simd, open);
            // On the starting side of the root.
            let same_side = !(value_inside ^ starts_inside);
            low = same_side.select(u, low);
            high = same_side.select(high, u);
            let newton = u - 0.5 * value / half_slope;
            // False for NaN, too.
            let inside = newton.simd_ge(low) & newton.simd_le(high);
            let next = inside.select(newton, 0.5 * (low + high));
            let step = (next - u).abs();
            let settled =
                step.simd_le(step_max) & (step * step * step).simd_le(error_max * (before * before));
            let done = settled | value.abs().simd_le(noise);
            u = running.select(next, u);
            before = step;
            open &= !done.to_bitmask();
            if open == 0 {
                break;
            }
        }
        u
    }
}

impl<S: Simd> Line<S> {
    /// `g` at `u`, and half its derivative.
    #[inline(always)]
    fn value(&self, u: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
        let [x, y, z] = self.across.0;
        let [dx, dy, dz] = self.across_direction.0;
        let place = Vectors([x + u * dx, y + u * dy, z + u * dz]);
        let height = self.height + u * self.slope;
        let rho = place.dot(&place).sqrt();
        let beyond = rho - self.major;
        let value = beyond * beyond + height * height - self.minor * self.minor;
        (value, beyond * place.dot(&self.across_direction) / rho + height * self.slope)
    }
}

/// Points of the rays nearest to the centres; in twice the precision where the origin is far away.
#[inline(always)]
fn closest<S: Simd>(origin: &Vectors<S>, direction: &Vectors<S>, s: Lanes<S>, far: Lanes<S>) -> Vectors<S> {
    let ([a, b, c], [x, y, z]) = (origin.0, direction.0);
    let plain = [a + s * x, b + s * y, c + s * z];
    let is_far = s.abs().simd_gt(far);
    if is_far.to_bitmask() == 0 {
        return Vectors(plain);
    }
    let exact = [sum_of_product(a, s, x), sum_of_product(b, s, y), sum_of_product(c, s, z)];
    let [x, y, z] = plain;
    Vectors([is_far.select(exact[0], x), is_far.select(exact[1], y), is_far.select(exact[2], z)])
}

/// `a - b factor`.
#[inline(always)]
fn less<S: Simd>(a: &Vectors<S>, b: &Vectors<S>, factor: Lanes<S>) -> Vectors<S> {
    Vectors([a.0[0] - b.0[0] * factor, a.0[1] - b.0[1] * factor, a.0[2] - b.0[2] * factor])
}

/// `a + b * c`, as in `crate::shift`.
#[inline(always)]
fn sum_of_product<S: Simd>(a: Lanes<S>, b: Lanes<S>, c: Lanes<S>) -> Lanes<S> {
    let ((b_high, b_low), (c_high, c_low)) = (split(b), split(c));
    let product = b * c;
    let product_error = ((b_high * c_high - product) + b_high * c_low + b_low * c_high) + b_low * c_low;
    let sum = a + product;
    let virtual_product = sum - a;
    let sum_error = (a - (sum - virtual_product)) + (product - virtual_product);
    sum + (sum_error + product_error)
}

/// Veltkamp's split into two halves of 26 bits.
#[inline(always)]
fn split<S: Simd>(a: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
    let scaled = a * 134_217_729.0;
    let high = scaled - (scaled - a);
    (high, a - high)
}

/// An end of a ray's part, moved to the face of the slab that it lies beyond.
#[inline(always)]
fn cut<S: Simd>(
    z: Lanes<S>,
    u: Lanes<S>,
    half_height: Lanes<S>,
    height: Lanes<S>,
    inverse_slope: Lanes<S>,
) -> (Lanes<S>, Lanes<S>) {
    let (above, below) = (z.simd_gt(half_height), z.simd_lt(-half_height));
    let face = above.select(half_height, -half_height);
    let beyond = above | below;
    (beyond.select(face, z), beyond.select((face - height) * inverse_slope, u))
}

/// Bernstein coefficients.
#[derive(Clone, Copy)]
struct Quartic<S: Simd>([Lanes<S>; 5]);

/// How often coefficients change sign: not at all, once, more often; or they hold a zero or a NaN. A bit for each lane.
struct Signs {
    none: u32,
    one: u32,
    several: u32,
    odd: u32,
}

impl<S: Simd> Quartic<S> {
    #[inline(always)]
    fn signs(&self) -> Signs {
        let zero = Lanes::splat(self.0[0].simd(), 0.0);
        let (mut negative, mut plain) = ([0; 5], u32::MAX);
        for (bits, coefficient) in negative.iter_mut().zip(&self.0) {
            *bits = coefficient.simd_lt(zero).to_bitmask();
            plain &= *bits | coefficient.simd_gt(zero).to_bitmask();
        }
        let (mut any, mut several) = (0, 0);
        for i in 0..4 {
            let change = negative[i] ^ negative[i + 1];
            several |= any & change;
            any |= change;
        }
        Signs { none: !any & plain, one: any & !several & plain, several: several & plain, odd: !plain }
    }

    #[inline(always)]
    fn middle_value(&self) -> Lanes<S> {
        let [a, b, c, d, e] = self.0;
        ((a + e) + 4.0 * (b + d) + 6.0 * c) * 0.0625
    }

    /// As in [`crate::bernstein`]: the root of the parabola through the values at 0, 1/2 and 1.
    #[inline(always)]
    fn parabola_root(&self, simd: S) -> Lanes<S> {
        let (first, last) = (self.0[0], self.0[4]);
        let control = 2.0 * self.middle_value() - 0.5 * (first + last);
        let root = (control * control - first * last).sqrt();
        let signed = first.simd_lt(Lanes::splat(simd, 0.0)).select(-root, root);
        let x = first / (first - control + signed);
        let least = Lanes::splat(simd, START_MIN);
        let most = Lanes::splat(simd, 1.0 - START_MIN);
        // NaN goes to the least.
        let x = x.simd_gt(least).select(x, least);
        x.simd_gt(most).select(most, x)
    }
}

/// Parts of rays, in parts of the whole from 0 to 1, and the quartics there.
#[derive(Clone, Copy)]
struct Part<S: Simd> {
    quartic: Quartic<S>,
    start: Lanes<S>,
    width: Lanes<S>,
}

impl<S: Simd> Part<S> {
    /// The parts before and after a cut: in the middle, or near the extremum of the parabola through the values at both
    /// ends and the middle, at a multiple of 1/256 so that widths are exact.
    #[inline(always)]
    fn cut(&self, simd: S, aim: bool) -> (Part<S>, Part<S>) {
        let half = Lanes::splat(simd, 0.5);
        let [a, b, c, d, e] = self.quartic.0;
        let x = if aim {
            let x = 0.5 + 0.25 * (a - e) / (a - 2.0 * self.quartic.middle_value() + e);
            let (least, most) = (Lanes::splat(simd, 0.125), Lanes::splat(simd, 0.875));
            let x = x.simd_gt(least).select(x, least);
            let x = x.simd_gt(most).select(most, x);
            (x + ROUND) - ROUND
        } else {
            half
        };
        let rest = 1.0 - x;
        let (ab, bc, cd, de) = (rest * a + x * b, rest * b + x * c, rest * c + x * d, rest * d + x * e);
        let (abc, bcd, cde) = (rest * ab + x * bc, rest * bc + x * cd, rest * cd + x * de);
        let (abcd, bcde) = (rest * abc + x * bcd, rest * bcd + x * cde);
        let middle = rest * abcd + x * bcde;
        let left =
            Part { quartic: Quartic([a, ab, abc, abcd, middle]), start: self.start, width: self.width * x };
        let right = Part {
            quartic: Quartic([middle, bcde, cde, de, e]),
            start: self.start + left.width,
            width: self.width * rest,
        };
        (left, right)
    }

    #[inline(always)]
    fn replaced(&self, here: Mask<S>, other: &Part<S>) -> Part<S> {
        let mut part = *self;
        for i in 0..5 {
            part.quartic.0[i] = here.select(other.quartic.0[i], part.quartic.0[i]);
        }
        part.start = here.select(other.start, part.start);
        part.width = here.select(other.width, part.width);
        part
    }
}

//! A rigid body bounded by a polynomial surface.

use super::closest::Stationary;
use super::{FormulaError, Polynomial};
use crate::shift::closest_approach;
use crate::{RootFinder, Vec3};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// Lines along which mass properties are integrated, in each of two directions.
const MASS_LINES: u32 = 256;
/// Lines along which points of the surface are looked for, in each of two directions, for each of three axes.
const SAMPLE_LINES: u32 = 32;
/// Cells of the table of starts along each axis.
const CELLS: usize = 24;
/// Starts that are tried for one closest point, at most.
const STARTS_MAX: usize = 4;
/// A closest point meets its conditions within this part of the bounding radius.
const TOLERANCE: f64 = 1e-12;
/// A centre or product of inertia below this part of its size is taken as zero: it is rounding of a symmetric body.
const SYMMETRIC: f64 = 1e-9;

/// A rigid body `F < 0`, in metres, in the frame of its centre of mass and principal axes.
///
/// # Closest points
/// Newton's method from up to four starts: points of the surface next to the corners of the table's cell around the
/// query. Each solution meets Lagrange's conditions within 1e-12 of the bounding radius. Failure modes: where two
/// sheets are about equally near, less than a cell (a twelfth of the bounding radius) apart in distance, the farther
/// one may be found; a sheet thinner than a sixteenth of the radius may have no start; at a cusp or a double
/// point, where the gradient vanishes, the conditions cannot be met, and the best point that was reached is taken.
#[derive(Clone, Debug)]
pub struct Solid {
    polynomial: Polynomial,
    /// Metres per unit of the formula.
    scale: f64,
    /// Bounding radius about the formula's origin, in the formula's units.
    bound: f64,
    /// The centre of mass, in the formula's units.
    centre: Vec3,
    /// From body axes to the formula's.
    rotation: Rotation3<f64>,
    volume: f64,
    /// Moments of inertia for a density of 1.
    inertia: [f64; 3],
    bounding_radius: f64,
    half_extents: Vec3,
    /// Points of the surface, in the formula's units.
    samples: Vec<Vec3>,
    /// For each corner of the table's cells the number of the sample nearest to it.
    nearest: Vec<u32>,
}

/// A formula that does not describe a body.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum SolidError {
    /// It cannot be read.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// There is nothing inside.
    #[error("no point with F < 0 was found within bounding_radius_m = {bounding_radius_m:?} of the origin")]
    Empty {
        /// The radius as given.
        bounding_radius_m: f64,
    },
    /// The body sticks out.
    #[error(
        "F is {value:e} at {point_m:?} m, on the sphere of bounding_radius_m = {bounding_radius_m:?}: it must be \
         positive on all of it; take a larger radius, or turn the formula's sign round"
    )]
    Unbounded {
        /// The radius as given.
        bounding_radius_m: f64,
        /// Where.
        point_m: [f64; 3],
        /// The value there.
        value: f64,
    },
}

impl Solid {
    /// A body from its formula, the metres that one unit of the formula's coordinates has, and the radius of a ball about the
    /// formula's origin that holds all of it (m).
    ///
    /// # Errors
    ///
    /// [`SolidError`] if the formula cannot be read, or is not that of a body within the ball.
    pub fn new(formula: &str, scale: f64, bounding_radius_m: f64) -> Result<Solid, SolidError> {
        let polynomial = Polynomial::parse(formula)?;
        let bound = bounding_radius_m / scale;
        check_bound(&polynomial, bound, scale, bounding_radius_m)?;
        let samples = surface_points(&polynomial, bound);
        let moments = polynomial.moments(bound, MASS_LINES);
        if samples.is_empty() || !(moments.volume > 0.0) {
            return Err(SolidError::Empty { bounding_radius_m });
        }
        let centre =
            (moments.first / moments.volume).map(|c| if c.abs() < SYMMETRIC * bound { 0.0 } else { c });
        let (rotation, inertia) = principal(&moments, &centre);
        let s5 = scale * scale * scale * scale * scale;
        let mut solid = Solid {
            nearest: nearest_samples(&samples, bound),
            polynomial,
            scale,
            bound,
            centre,
            rotation,
            volume: moments.volume * scale * scale * scale,
            inertia: inertia.map(|moment| moment * s5),
            bounding_radius: 0.0,
            half_extents: Vec3::zeros(),
            samples,
        };
        solid.measure();
        Ok(solid)
    }

    /// The ball and the box about the centre of mass that hold all samples, and a little more: between samples the surface
    /// may stand out by about the square of their distance over the ball's diameter.
    fn measure(&mut self) {
        let spacing = 2.0 * self.bound / f64::from(SAMPLE_LINES) * self.scale;
        let (mut radius_squared, mut half) = (0.0, Vec3::zeros());
        for sample in &self.samples {
            let local = self.formula_to_body(sample);
            let squared = local.norm_squared();
            radius_squared = if squared > radius_squared { squared } else { radius_squared };
            half = half.zip_map(&local, |a, b| if b.abs() > a { b.abs() } else { a });
        }
        let whole = self.bound * self.scale + self.centre.norm() * self.scale;
        let grown = radius_squared.sqrt() + spacing;
        self.bounding_radius = if grown < whole { grown } else { whole };
        self.half_extents = half.map(|h| if h + spacing < whole { h + spacing } else { whole });
    }

    /// Volume (m^3).
    pub fn volume_m3(&self) -> f64 {
        self.volume
    }

    /// Principal moments of inertia for a mass (kg m^2).
    pub fn inertia(&self, mass_kg: f64) -> [f64; 3] {
        self.inertia.map(|moment| moment * (mass_kg / self.volume))
    }

    /// Radius of a ball about the centre of mass that holds the body (m).
    pub fn bounding_radius_m(&self) -> f64 {
        self.bounding_radius
    }

    /// Half extents, along the principal axes, of a box about the centre of mass that holds the body (m).
    pub fn half_extents_m(&self) -> Vec3 {
        self.half_extents
    }

    /// Where the centre of mass lies in the formula's frame (m), and the rotation from principal axes to it.
    pub fn place(&self) -> (Vec3, UnitQuaternion<f64>) {
        (self.centre * self.scale, UnitQuaternion::from_rotation_matrix(&self.rotation))
    }

    fn body_to_formula(&self, point: &Vec3) -> Vec3 {
        self.rotation * (point / self.scale) + self.centre
    }

    fn formula_to_body(&self, point: &Vec3) -> Vec3 {
        self.rotation.inverse_transform_vector(&(point - self.centre)) * self.scale
    }

    /// Whether a point is inside.
    pub fn contains(&self, point: &Vec3) -> bool {
        self.polynomial.value(&self.body_to_formula(point)) < 0.0
    }

    /// The outward unit normal at the nearest point of the surface, and the signed distance from it: negative inside (m).
    pub fn distance(&self, point: &Vec3) -> (Vec3, f64) {
        let p = self.body_to_formula(point);
        let nearest = self.nearest_to(&p);
        let inside = self.polynomial.value(&p) < 0.0;
        let distance = nearest.distance * self.scale;
        let normal = self.rotation.inverse_transform_vector(&nearest.normal);
        (normal, if inside { -distance } else { distance })
    }

    /// The nearest point of the surface, and whether it meets the conditions within the tolerance.
    pub fn closest_point(&self, point: &Vec3) -> (Vec3, bool) {
        let nearest = self.nearest_to(&self.body_to_formula(point));
        (self.formula_to_body(&nearest.point), nearest.converged)
    }

    fn nearest_to(&self, p: &Vec3) -> Stationary {
        let spacing = 2.0 * self.bound / f64::from(SAMPLE_LINES);
        let (starts, count) = self.starts(p, spacing);
        let tolerance = TOLERANCE * self.bound;
        let mut best: Option<Stationary> = None;
        for start in &starts[..count] {
            let found = self.polynomial.closest_from(p, start, tolerance, 4.0 * spacing);
            let better = match &best {
                None => true,
                Some(best) if best.converged != found.converged => found.converged,
                Some(best) => found.distance < best.distance,
            };
            if better {
                best = Some(found);
            }
        }
        let mut best = best.expect("a body has samples, and each cell has a nearest one");
        let apart = (starts[0] - p).norm_squared().sqrt();
        if !best.converged || apart < best.distance {
            if apart < best.distance {
                best = Stationary { point: starts[0], distance: apart, ..best };
            }
            // Near a double point the gradient says nothing: the normal is along the way from the point.
            let inside = self.polynomial.value(p) < 0.0;
            let away = if inside { best.point - p } else { p - best.point };
            if best.distance > tolerance {
                best.normal = away * (1.0 / best.distance);
            } else if best.normal == Vec3::zeros() {
                best.normal = Vec3::x();
            }
        }
        best
    }

    /// Points of the surface from which to look for the one nearest to `p`: those next to the corners of its cell that
    /// may lead to it, and no two of them together.
    fn starts(&self, p: &Vec3, spacing: f64) -> ([Vec3; STARTS_MAX], usize) {
        let cell = p.map(|coordinate| {
            let cell = libm::floor((coordinate / self.bound + 1.0) * 0.5 * CELLS as f64);
            if !(cell > 0.0) { 0 } else { (cell as usize).min(CELLS - 1) }
        });
        let mut near: [(f64, Vec3); 8] = core::array::from_fn(|corner| {
            let at = |axis: usize| cell[axis] + (corner >> axis & 1);
            let sample = self.samples[self.nearest[node(at(0), at(1), at(2))] as usize];
            ((sample - p).norm_squared().sqrt(), sample)
        });
        // Nearest first; equal ones stay in the order of the corners.
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut starts = [near[0].1; STARTS_MAX];
        let mut count = 1;
        for (distance, sample) in &near[1..] {
            let apart =
                starts[..count].iter().all(|start| (start - sample).norm_squared() > 4.0 * spacing * spacing);
            if count < STARTS_MAX && apart && *distance < near[0].0 + 2.0 * spacing {
                starts[count] = *sample;
                count += 1;
            }
        }
        (starts, count)
    }

    /// Ray parameter of the first crossing of the surface beyond `t_min` (m), or `None`; from inside it is the exit. Body
    /// frame; `direction` is a unit vector.
    pub fn ray(&self, origin: &Vec3, direction: &Vec3, t_min: f64) -> Option<f64> {
        self.ray_by(RootFinder::Bernstein, origin, direction, t_min)
    }

    /// The same by another root finder.
    pub fn ray_by(&self, finder: RootFinder, origin: &Vec3, direction: &Vec3, t_min: f64) -> Option<f64> {
        let direction = self.rotation * direction;
        let origin = self.rotation * (origin / self.scale) + self.centre;
        // Counted from the closest approach to the formula's origin, for origins far away.
        let (s, near) = closest_approach(&origin, &direction, self.bound);
        let inside = self.bound * self.bound - near.norm_squared();
        if !(inside > 0.0) {
            return None;
        }
        let half = inside.sqrt();
        let least = t_min / self.scale - s;
        let start = if least > -half { least } else { -half };
        if !(start < half) {
            return None;
        }
        let hit = self.polynomial.first_root(&near, &direction, (start, half), least, finder)?;
        Some((hit + s) * self.scale)
    }

    /// Outward unit normal at a point of the surface.
    pub fn normal(&self, point: &Vec3) -> Vec3 {
        let (_, gradient) = self.polynomial.value_and_gradient(&self.body_to_formula(point));
        let length = gradient.norm_squared().sqrt();
        let unit = if length > 0.0 { gradient * (1.0 / length) } else { Vec3::x() };
        self.rotation.inverse_transform_vector(&unit)
    }
}

/// F must be positive on the bounding sphere: looked at along 64 circles of latitude.
fn check_bound(polynomial: &Polynomial, bound: f64, scale: f64, given: f64) -> Result<(), SolidError> {
    const CIRCLES: u32 = 64;
    for i in 0..CIRCLES {
        let z = f64::from(2 * i + 1) / f64::from(CIRCLES) - 1.0;
        let rho = (1.0 - z * z).sqrt();
        for j in 0..2 * CIRCLES {
            let (sin, cos) = libm::sincos(core::f64::consts::PI * f64::from(j) / f64::from(CIRCLES));
            let point = Vec3::new(rho * cos, rho * sin, z) * bound;
            let value = polynomial.value(&point);
            if !(value > 0.0) {
                let point_m = (point * scale).into();
                return Err(SolidError::Unbounded { bounding_radius_m: given, point_m, value });
            }
        }
    }
    Ok(())
}

/// Points of the surface on lines along all three axes.
fn surface_points(polynomial: &Polynomial, bound: f64) -> Vec<Vec3> {
    let mut points = Vec::new();
    let at = |index: u32| bound * (f64::from(2 * index + 1) / f64::from(SAMPLE_LINES) - 1.0);
    for axis in 0..3 {
        for i in 0..SAMPLE_LINES {
            for j in 0..SAMPLE_LINES {
                let mut start = Vec3::zeros();
                start[(axis + 1) % 3] = at(i);
                start[(axis + 2) % 3] = at(j);
                let mut end = start;
                (start[axis], end[axis]) = (-bound, bound);
                polynomial.find_root(&start, &end, |s| {
                    let mut point = start;
                    point[axis] = bound * (2.0 * s - 1.0);
                    points.push(point);
                    false
                });
            }
        }
    }
    points
}

/// Number of a corner of the table's cells.
fn node(i: usize, j: usize, k: usize) -> usize {
    (i * (CELLS + 1) + j) * (CELLS + 1) + k
}

/// The sample nearest to each corner, of equally near ones the first.
fn nearest_samples(samples: &[Vec3], bound: f64) -> Vec<u32> {
    let at = |index: usize| bound * (2.0 * index as f64 / CELLS as f64 - 1.0);
    let mut nearest = Vec::with_capacity((CELLS + 1) * (CELLS + 1) * (CELLS + 1));
    for i in 0..=CELLS {
        for j in 0..=CELLS {
            for k in 0..=CELLS {
                let corner = Vec3::new(at(i), at(j), at(k));
                let mut best = (f64::INFINITY, 0);
                for (index, sample) in samples.iter().enumerate() {
                    let apart = (sample - corner).norm_squared();
                    if apart < best.0 {
                        best = (apart, index as u32);
                    }
                }
                nearest.push(best.1);
            }
        }
    }
    nearest
}

/// Principal axes, as a rotation from them to the formula's axes, and the moments about them, for a density of 1.
///
/// The axes are found by Jacobi's rotations in a fixed order, which leave axes alone that are principal already: a
/// body with the symmetry of its axes keeps them.
fn principal(moments: &super::mass::Moments, centre: &Vec3) -> (Rotation3<f64>, [f64; 3]) {
    let [xx, yy, zz, xy, xz, yz] = moments.second;
    let volume = moments.volume;
    let (c, v) = (centre, volume);
    let about = |second: f64, a: f64, b: f64| second - v * a * b;
    let (xx, yy, zz) = (about(xx, c.x, c.x), about(yy, c.y, c.y), about(zz, c.z, c.z));
    let (xy, xz, yz) = (about(xy, c.x, c.y), about(xz, c.x, c.z), about(yz, c.y, c.z));
    let mut matrix = Matrix3::new(yy + zz, -xy, -xz, -xy, xx + zz, -yz, -xz, -yz, xx + yy);
    let size = matrix.trace();
    let mut axes = Matrix3::identity();
    for _ in 0..16 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = matrix[(p, q)];
            if !(off.abs() > SYMMETRIC * size) {
                matrix[(p, q)] = 0.0;
                matrix[(q, p)] = 0.0;
                continue;
            }
            // The smaller root of t^2 + 2 theta t - 1 = 0.
            let theta = (matrix[(q, q)] - matrix[(p, p)]) / (2.0 * off);
            let root = theta.abs() + (theta * theta + 1.0).sqrt();
            let t = if theta < 0.0 { -1.0 / root } else { 1.0 / root };
            let cos = 1.0 / (t * t + 1.0).sqrt();
            let sin = t * cos;
            let mut turn = Matrix3::identity();
            (turn[(p, p)], turn[(q, q)]) = (cos, cos);
            (turn[(p, q)], turn[(q, p)]) = (sin, -sin);
            matrix = turn.transpose() * matrix * turn;
            axes *= turn;
        }
    }
    let mut inertia = [matrix[(0, 0)], matrix[(1, 1)], matrix[(2, 2)]];
    // Moments that differ by rounding and quadrature alone are one.
    for (a, b) in [(0, 1), (1, 2), (0, 2)] {
        if (inertia[a] - inertia[b]).abs() < SYMMETRIC * size {
            inertia[b] = inertia[a];
        }
    }
    (Rotation3::from_matrix_unchecked(axes), inertia)
}

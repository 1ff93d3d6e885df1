//! Surfaces as images of plane coordinates: about a point for quadrature, and as a whole for sampling.

use super::Solid;
use crate::Vec3;

const TURN: f64 = 2.0 * core::f64::consts::PI;

/// Coordinates `(x, y)` about a point of a surface, in metres along two tangents there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chart {
    kind: Kind,
    /// The point at (0, 0).
    pub foot: Vec3,
    /// The tangents.
    pub x: Vec3,
    pub y: Vec3,
    /// The surface's own curvature there, as a quadratic form on the tangents (diagonal) (1/m).
    pub curvature: [f64; 2],
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    /// `x` runs along the ring and `y` around the wire, each as twice the tangent of half an angle.
    Ring {
        centre: Vec3,
        radial: Vec3,
        tangent: Vec3,
        axis: Vec3,
        major: f64,
        minor: f64,
        cos: f64,
        sin: f64,
        rho: f64,
    },
    /// Stereographic projection from the opposite point.
    Sphere { centre: Vec3, outward: Vec3, radius: f64 },
}

impl Chart {
    /// The chart about the point of a surface in a direction: for a ring from the point of its centreline at
    /// `(cos, sin)`, for a sphere from its centre. A plane has none.
    pub(super) fn about(surface: &Solid, (cos, sin): (f64, f64), direction: &Vec3) -> Option<Chart> {
        match surface {
            Solid::Ring { circle, minor_radius } => {
                let radial = circle.u * cos + circle.w * sin;
                let tangent = circle.w * cos - circle.u * sin;
                let axis = circle.normal;
                let (along, up) = (direction.dot(&radial), direction.dot(&axis));
                let norm = (along * along + up * up).sqrt();
                if !(norm > 0.0) {
                    return None;
                }
                let (cos, sin) = (along / norm, up / norm);
                let rho = circle.radius + minor_radius * cos;
                let outward = radial * cos + axis * sin;
                Some(Chart {
                    foot: circle.centre + radial * circle.radius + outward * *minor_radius,
                    x: tangent,
                    y: axis * cos - radial * sin,
                    curvature: [cos / rho, 1.0 / minor_radius],
                    kind: Kind::Ring {
                        centre: circle.centre,
                        radial,
                        tangent,
                        axis,
                        major: circle.radius,
                        minor: *minor_radius,
                        cos,
                        sin,
                        rho,
                    },
                })
            }
            Solid::Sphere { centre, radius } => {
                let (x, y) = tangents(direction);
                Some(Chart {
                    foot: centre + direction * *radius,
                    x,
                    y,
                    curvature: [1.0 / radius, 1.0 / radius],
                    kind: Kind::Sphere { centre: *centre, outward: *direction, radius: *radius },
                })
            }
            Solid::Plane { .. } => None,
        }
    }

    /// The points at some coordinates, and the area for each unit of coordinate area.
    #[inline(always)]
    pub(super) fn points<const N: usize>(&self, x: &[f64; N], y: &[f64; N]) -> ([[f64; N]; 3], [f64; N]) {
        let mut point = [[0.0; N]; 3];
        let mut area = [0.0; N];
        match &self.kind {
            Kind::Ring { centre, radial, tangent, axis, major, minor, cos, sin, rho } => {
                let (half_x, half_y) = (0.5 / rho, 0.5 / minor);
                let inverse_rho = 1.0 / rho;
                for i in 0..N {
                    let (s, t) = (x[i] * half_x, y[i] * half_y);
                    let (s_1, t_1) = (1.0 / (1.0 + s * s), 1.0 / (1.0 + t * t));
                    let (turn_cos, turn_sin) = ((1.0 - s * s) * s_1, 2.0 * s * s_1);
                    let (wire_cos, wire_sin) = ((1.0 - t * t) * t_1, 2.0 * t * t_1);
                    let out = major + minor * (cos * wire_cos - sin * wire_sin);
                    let up = minor * (sin * wire_cos + cos * wire_sin);
                    let (along, aside) = (out * turn_cos, out * turn_sin);
                    for a in 0..3 {
                        point[a][i] = centre[a] + (radial[a] * along + tangent[a] * aside + axis[a] * up);
                    }
                    area[i] = out * inverse_rho * (s_1 * t_1);
                }
            }
            Kind::Sphere { centre, outward, radius } => {
                let half = 0.5 / radius;
                for i in 0..N {
                    let (s, t) = (x[i] * half, y[i] * half);
                    let square = s * s + t * t;
                    let inverse = 1.0 / (1.0 + square);
                    let (up, s, t) = (
                        radius * (1.0 - square) * inverse,
                        radius * 2.0 * s * inverse,
                        radius * 2.0 * t * inverse,
                    );
                    for a in 0..3 {
                        point[a][i] = centre[a] + (outward[a] * up + self.x[a] * s + self.y[a] * t);
                    }
                    area[i] = inverse * inverse;
                }
            }
        }
        (point, area)
    }
}

/// Two unit vectors that make a right-handed frame with a unit vector.
pub(super) fn tangents(direction: &Vec3) -> (Vec3, Vec3) {
    let d = direction;
    let least = if d.x * d.x <= d.y * d.y && d.x * d.x <= d.z * d.z {
        Vec3::x()
    } else if d.y * d.y <= d.z * d.z {
        Vec3::y()
    } else {
        Vec3::z()
    };
    let x = d.cross(&least);
    let x = x * (1.0 / x.norm_squared().sqrt());
    (x, d.cross(&x))
}

/// How a point of the unit square becomes a point of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Both angles uniform: around the ring and around its wire; longitude and polar angle of a sphere.
    Angles,
    /// Uniform by area.
    Area,
}

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The point (m).
    pub point: Vec3,
    /// Area for each unit of area of the square (m^2); its mean is the surface's area.
    pub area: f64,
}

/// The point of a ring at a place of its centreline and a fraction of the wire's turn, under a measure.
#[inline]
pub fn ring_point(
    ring: &crate::Circle,
    minor: f64,
    (cos, sin): (f64, f64),
    wire: f64,
    measure: Measure,
) -> SurfacePoint {
    let ratio = minor / ring.radius;
    // From the inner equator once around.
    let uniform = TURN * (wire - 0.5);
    let angle = match measure {
        Measure::Angles => uniform,
        Measure::Area => wire_angle(uniform, ratio),
    };
    let (wire_sin, wire_cos) = libm::sincos(angle);
    let out = ring.radius + minor * wire_cos;
    let radial = ring.u * cos + ring.w * sin;
    let area = TURN
        * TURN
        * minor
        * match measure {
            Measure::Angles => out,
            Measure::Area => ring.radius,
        };
    SurfacePoint { point: ring.centre + radial * out + ring.normal * (minor * wire_sin), area }
}

/// The angle `t` with `t + ratio sin t = mean`, for a mean from -pi to pi and a ratio below 1: Kepler's equation with
/// the other sign, by Newton's method from the outer side, where it never overshoots.
fn wire_angle(mean: f64, ratio: f64) -> f64 {
    const PI: f64 = core::f64::consts::PI;
    let target = if mean < 0.0 { -mean } else { mean };
    // On [0, pi] the left side is concave, so from below Newton's method stays below.
    let mut angle = target / (1.0 + ratio);
    for _ in 0..64 {
        let (sin, cos) = libm::sincos(angle);
        let step = (target - angle - ratio * sin) / (1.0 + ratio * cos);
        angle += step;
        if angle > PI {
            angle = PI;
        }
        if step.abs() < 1e-15 {
            break;
        }
    }
    if mean < 0.0 { -angle } else { angle }
}

/// The point of a sphere at a point of the unit square, under a measure; poles on the z axis.
#[inline]
pub fn sphere_point(
    centre: &Vec3,
    radius: f64,
    (first, second): (f64, f64),
    measure: Measure,
) -> SurfacePoint {
    let (sin, cos) = libm::sincos(TURN * first);
    let (across, up, area) = match measure {
        Measure::Angles => {
            let (s, c) = libm::sincos(0.5 * TURN * second);
            (s, c, 0.5 * TURN * TURN * radius * radius * s)
        }
        Measure::Area => {
            let up = 1.0 - 2.0 * second;
            (2.0 * (second * (1.0 - second)).sqrt(), up, 2.0 * TURN * radius * radius)
        }
    };
    SurfacePoint { point: centre + Vec3::new(across * cos, across * sin, up) * radius, area }
}

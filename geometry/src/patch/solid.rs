//! A body as its inside: how deep a point is in it, and which part of a circle.

use super::{Lane, WIDTH};
use crate::arc::{circle_circle_arcs, circle_plane_arcs, circle_point_arcs};
use crate::{Arcs, Circle, Vec3};

/// A ring, a sphere or a half-space. Place the origin near the contact: rounding is relative to the coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Solid {
    /// A ring: wire of a radius around a circle.
    Ring {
        /// Its centreline.
        circle: Circle,
        /// Radius of the wire (m), less than the circle's.
        minor_radius: f64,
    },
    /// A sphere.
    Sphere {
        /// Its centre (m).
        centre: Vec3,
        /// Its radius (m).
        radius: f64,
    },
    /// The points with `normal . p < offset`.
    Plane {
        /// Unit normal, out of the solid.
        normal: Vec3,
        /// Signed distance of the surface from the origin (m).
        offset: f64,
    },
}

impl Solid {
    /// Area of the whole surface (m^2); infinite for a plane.
    pub fn area(&self) -> f64 {
        const PI: f64 = core::f64::consts::PI;
        match self {
            Solid::Ring { circle, minor_radius } => 4.0 * PI * PI * circle.radius * minor_radius,
            Solid::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Solid::Plane { .. } => f64::INFINITY,
        }
    }

    /// Depth of a point below the surface (m, negative outside) and the outward normal there. On a ring's centreline
    /// or a sphere's centre, where every direction is as good, the normal is 0.
    #[inline]
    pub fn depth(&self, point: &Vec3) -> (f64, Vec3) {
        let (depth, normal) = self.depths(&[[point.x; 1], [point.y; 1], [point.z; 1]]);
        (depth[0], Vec3::new(normal[0][0], normal[1][0], normal[2][0]))
    }

    /// The same for several points at once: the same bits for each.
    #[inline(always)]
    pub(super) fn depths<const N: usize>(&self, point: &[[f64; N]; 3]) -> ([f64; N], [[f64; N]; 3]) {
        let mut depth = [0.0; N];
        let mut normal = [[0.0; N]; 3];
        match self {
            Solid::Ring { circle, minor_radius } => {
                let (c, n, major) = (circle.centre, circle.normal, circle.radius);
                for i in 0..N {
                    let d = [point[0][i] - c.x, point[1][i] - c.y, point[2][i] - c.z];
                    let height = d[0] * n.x + d[1] * n.y + d[2] * n.z;
                    let up = [height * n.x, height * n.y, height * n.z];
                    let across = [d[0] - up[0], d[1] - up[1], d[2] - up[2]];
                    let rho = (across[0] * across[0] + across[1] * across[1] + across[2] * across[2]).sqrt();
                    let outward = rho - major;
                    let share = if rho > 0.0 { outward / rho } else { 0.0 };
                    let distance = (outward * outward + height * height).sqrt();
                    let inverse = if distance > 0.0 { 1.0 / distance } else { 0.0 };
                    depth[i] = minor_radius - distance;
                    for axis in 0..3 {
                        normal[axis][i] = (up[axis] + across[axis] * share) * inverse;
                    }
                }
            }
            Solid::Sphere { centre: c, radius } => {
                for i in 0..N {
                    let d = [point[0][i] - c.x, point[1][i] - c.y, point[2][i] - c.z];
                    let distance = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
                    let inverse = if distance > 0.0 { 1.0 / distance } else { 0.0 };
                    depth[i] = radius - distance;
                    for axis in 0..3 {
                        normal[axis][i] = d[axis] * inverse;
                    }
                }
            }
            Solid::Plane { normal: n, offset } => {
                for i in 0..N {
                    depth[i] = offset - (point[0][i] * n.x + point[1][i] * n.y + point[2][i] * n.z);
                    for axis in 0..3 {
                        normal[axis][i] = n[axis];
                    }
                }
            }
        }
        (depth, normal)
    }

    /// Depths alone.
    #[inline(always)]
    pub(super) fn depths_only(&self, point: &[Lane; 3]) -> Lane {
        let mut depth = [0.0; WIDTH];
        let Solid::Ring { circle, minor_radius } = self else { return self.depths(point).0 };
        let (c, n, major) = (circle.centre, circle.normal, circle.radius);
        for i in 0..WIDTH {
            let d = [point[0][i] - c.x, point[1][i] - c.y, point[2][i] - c.z];
            let height = d[0] * n.x + d[1] * n.y + d[2] * n.z;
            let across = [d[0] - height * n.x, d[1] - height * n.y, d[2] - height * n.z];
            let rho = (across[0] * across[0] + across[1] * across[1] + across[2] * across[2]).sqrt();
            let outward = rho - major;
            depth[i] = minor_radius - (outward * outward + height * height).sqrt();
        }
        depth
    }

    /// The part of a circle that is inside.
    pub(super) fn section(&self, circle: &Circle) -> Arcs {
        match self {
            Solid::Ring { circle: other, minor_radius } => circle_circle_arcs(circle, other, *minor_radius),
            Solid::Sphere { centre, radius } => circle_point_arcs(circle, centre, *radius),
            Solid::Plane { normal, offset } => circle_plane_arcs(circle, normal, *offset, 0.0),
        }
    }

    /// Curvature of the depth's level surface through a point inside, as a quadratic form on the two tangents: twice
    /// the rate at which the surface bends away towards the outside (1/m).
    pub(super) fn bending(&self, point: &Vec3, x: &Vec3, y: &Vec3) -> [f64; 3] {
        match self {
            Solid::Ring { circle, .. } => {
                let d = point - circle.centre;
                let height = d.dot(&circle.normal);
                let across = d - circle.normal * height;
                let rho = across.norm_squared().sqrt();
                let outward = rho - circle.radius;
                let distance = (outward * outward + height * height).sqrt();
                let radial = across * (1.0 / rho);
                let along = circle.normal.cross(&radial);
                let up = (radial * outward + circle.normal * height) * (1.0 / distance);
                let meridian = along.cross(&up);
                // Principal curvatures: 1 / distance around the wire, cos / rho along the ring.
                let (around, round) = (1.0 / distance, outward / (distance * rho));
                let (ax, ay) = (along.dot(x), along.dot(y));
                let (mx, my) = (meridian.dot(x), meridian.dot(y));
                [
                    around * mx * mx + round * ax * ax,
                    around * mx * my + round * ax * ay,
                    around * my * my + round * ay * ay,
                ]
            }
            Solid::Sphere { centre, .. } => {
                let inverse = 1.0 / (point - centre).norm_squared().sqrt();
                [inverse * x.norm_squared(), inverse * x.dot(y), inverse * y.norm_squared()]
            }
            Solid::Plane { .. } => [0.0; 3],
        }
    }
}

//! The cap of a sphere inside another sphere or a half-space.
//!
//! Equal steps along the axis of a cap hold equal areas (Archimedes), so Gauss points are taken along the axis and
//! eight points around it.

use super::chart::tangents;
use super::{Block, Nodes, Solid, WIDTH};
use crate::{GaussRule, Vec3};

const H: f64 = core::f64::consts::FRAC_1_SQRT_2;
const AROUND: [[f64; WIDTH]; 2] = [[1.0, H, 0.0, -H, -1.0, -H, 0.0, H], [0.0, H, 1.0, H, 0.0, -H, -1.0, -H]];
const TURN: f64 = 2.0 * core::f64::consts::PI;

/// Adds the points of the sphere's cap in a sphere or plane, each with its area times `share`; nothing for a ring.
///
/// Exact for a plane. For a sphere the depth is a square root along the axis: six points leave less than 1e-6 of the
/// force while the cap is at most half of the sphere and the centres are apart by the sphere's radius or more.
pub fn cap(centre: &Vec3, radius: f64, solid: &Solid, share: f64, nodes: &mut Nodes) {
    // The axis, towards the solid, and the cap's height over the radius.
    let (axis, height) = match solid {
        Solid::Plane { normal, offset } => (-normal, (offset - normal.dot(centre) + radius) / radius),
        Solid::Sphere { centre: other, radius: other_radius } => {
            let d = other - centre;
            let distance = d.norm_squared().sqrt();
            if distance > 0.0 {
                let reach = (radius + other_radius - distance) * (other_radius + distance - radius);
                (d * (1.0 / distance), reach / (2.0 * radius * distance))
            } else {
                (Vec3::z(), if radius < *other_radius { 2.0 } else { 0.0 })
            }
        }
        Solid::Ring { .. } => return,
    };
    if !(height > 0.0) {
        return;
    }
    let height = if height < 2.0 { height } else { 2.0 };
    let (x, y) = tangents(&axis);
    let area = share * TURN * radius * radius * height / WIDTH as f64;
    for &(node, gauss) in GaussRule::Six.nodes() {
        let down = 0.5 * height * (1.0 + node);
        let along = radius * (1.0 - down);
        let aside = radius * (down * (2.0 - down)).sqrt();
        let mut point = [[0.0; WIDTH]; 3];
        for i in 0..WIDTH {
            let (s, t) = (aside * AROUND[0][i], aside * AROUND[1][i]);
            for a in 0..3 {
                point[a][i] = centre[a] + (axis[a] * along + x[a] * s + y[a] * t);
            }
        }
        let (depth, normal) = solid.depths(&point);
        nodes.push_block(Block { point, normal, depth, area: [0.5 * gauss * area; WIDTH] });
    }
}

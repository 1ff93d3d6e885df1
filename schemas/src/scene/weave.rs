//! Weaves: patches of linked rings, laid out so that neighbours are linked and nothing overlaps.

use super::bodies::Ring;
use serde::{Deserialize, Serialize};

/// A patch of woven rings.
///
/// The patch lies in its own x-y plane with ring (0, 0) at `position_m`; rows run along y, columns along x.
/// `rotation_rad` then turns it about `position_m`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weave {
    /// How the rings are linked.
    pub pattern: Pattern,
    /// Number of rows.
    pub rows: u32,
    /// Rings in each row.
    pub columns: u32,
    /// From a ring's centre to the centreline of its wire, in metres.
    pub major_radius_m: f64,
    /// Radius of the wire, in metres.
    pub minor_radius_m: f64,
    /// Mass of one ring, in kilograms.
    pub ring_mass_kg: f64,
    /// Name of the rings' material.
    pub material: String,
    /// Centre of ring (0, 0), in metres.
    #[serde(default)]
    pub position_m: [f64; 3],
    /// Rotation vector (axis times angle) that turns the patch about `position_m`, in radians.
    #[serde(default)]
    pub rotation_rad: [f64; 3],
    /// Rings that never move, as `[row, column]`.
    #[serde(default)]
    pub pins: Vec<[u32; 2]>,
}

/// A pattern of linked rings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pattern {
    /// Each inner ring is linked with four others: two of the row above and two of the row below.
    #[serde(rename = "european-4-in-1")]
    European4In1,
    /// Rows of separate chains: each ring is linked with the next along its row, axes crossed.
    #[serde(rename = "chain")]
    Chain,
}

/// Tilt of a ring's axis about the patch's y axis in European 4-in-1, alternating in sign from row to row.
///
/// 0.6 rad with pitches of 1.25 R keeps every two centrelines at least 0.5 R apart (found by a search over
/// pitches and tilts), so any wire thinner than 0.25 R starts without overlap.
const EUROPEAN_TILT_RAD: f64 = 0.6;
/// Pitch of rows and columns in European 4-in-1, in major radii.
const EUROPEAN_PITCH: f64 = 1.25;

impl Weave {
    /// The rings of the patch, row by row.
    pub(super) fn rings(&self) -> Vec<Ring> {
        let turn = rotation(self.rotation_rad);
        let mut rings = Vec::with_capacity(self.rows as usize * self.columns as usize);
        for row in 0..self.rows {
            for column in 0..self.columns {
                let (centre, orientation) = self.place(row, column);
                let centre = rotate(turn, centre);
                rings.push(Ring {
                    major_radius_m: self.major_radius_m,
                    minor_radius_m: self.minor_radius_m,
                    mass_kg: self.ring_mass_kg,
                    material: self.material.clone(),
                    position_m: std::array::from_fn(|axis| self.position_m[axis] + centre[axis]),
                    orientation: product(turn, orientation),
                    linear_velocity_m_per_s: [0.0; 3],
                    angular_velocity_rad_per_s: [0.0; 3],
                    pinned: self.pins.contains(&[row, column]),
                });
            }
        }
        rings
    }

    /// Centre and orientation of a ring in the patch's own frame.
    fn place(&self, row: u32, column: u32) -> ([f64; 3], [f64; 4]) {
        let (i, j, radius) = (f64::from(row), f64::from(column), self.major_radius_m);
        let odd = row % 2 == 1;
        match self.pattern {
            Pattern::European4In1 => {
                let shift = if odd { 0.5 * EUROPEAN_PITCH } else { 0.0 };
                let tilt = if odd { -EUROPEAN_TILT_RAD } else { EUROPEAN_TILT_RAD };
                let centre = [radius * (EUROPEAN_PITCH * j + shift), radius * EUROPEAN_PITCH * i, 0.0];
                (centre, rotation([0.0, tilt, 0.0]))
            }
            Pattern::Chain => {
                // Axes alternate between z and y. Neighbours touch where the pitch is 2 R - 2 r; a tenth of
                // the wire's room keeps them apart. Chains of a patch stand 3 R apart.
                let pitch = 2.0 * radius - 2.2 * self.minor_radius_m;
                let quarter = std::f64::consts::FRAC_PI_2;
                let turn = if column % 2 == 1 { [quarter, 0.0, 0.0] } else { [0.0; 3] };
                ([pitch * j, 3.0 * radius * i, 0.0], rotation(turn))
            }
        }
    }
}

/// The unit quaternion of a rotation vector.
fn rotation(vector: [f64; 3]) -> [f64; 4] {
    let angle = (vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]).sqrt();
    if angle == 0.0 {
        return [0.0, 0.0, 0.0, 1.0];
    }
    let scale = libm::sin(0.5 * angle) / angle;
    [vector[0] * scale, vector[1] * scale, vector[2] * scale, libm::cos(0.5 * angle)]
}

/// The Hamilton product `a b`: first `b`, then `a`.
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    let [ax, ay, az, aw] = a;
    let [bx, by, bz, bw] = b;
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

fn rotate(q: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let [x, y, z, _] = product(product(q, [v[0], v[1], v[2], 0.0]), [-q[0], -q[1], -q[2], q[3]]);
    [x, y, z]
}

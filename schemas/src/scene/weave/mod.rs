//! Weaves: patches of linked rings, laid out so that neighbours are linked and nothing overlaps.
//!
//! Every pattern is a layout in units of the major radius, found once by a search and checked by brute force
//! in `tests/weave.rs`: exactly the promised pairs are linked, and no two wires are nearer than promised.

mod japanese;
mod limits;

use super::bodies::{Drag, Ring};
use crate::Hash;
use japanese::{Grid, Japanese};
use serde::{Deserialize, Serialize};

/// A patch of woven rings.
///
/// The patch lies in its own x-y plane with ring (0, 0) at `position_m`; rows run along y, columns along x.
/// `rotation_rad` then turns it about `position_m`. Rings are numbered row by row; the connectors of a
/// Japanese pattern follow after all rings of the grid.
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
    /// Radius of the wire, in metres. Each pattern has a largest one: see [`Pattern`].
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
    /// Rows of rings that never move.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pin_rows: Vec<u32>,
    /// The rings' own drag, instead of what `forces` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drag: Option<Drag>,
    /// Rings that follow a motion.
    #[serde(default, rename = "grip", skip_serializing_if = "Vec::is_empty")]
    pub grips: Vec<Grip>,
    /// Share of the rings that is left out, from 0 up to but not 1: as many as that is, to the nearest ring,
    /// chosen at random from the scene's seed. Pinned and gripped rings stay.
    #[serde(default)]
    pub remove_share: f64,
    /// Japanese patterns: from a connector's centre to the centreline of its wire, in metres. Without it,
    /// what leaves a tenth of the wires' radii between them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub connector_major_radius_m: Option<f64>,
    /// Japanese patterns: radius of a connector's wire, in metres. Without it, `minor_radius_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub connector_minor_radius_m: Option<f64>,
    /// Japanese patterns: mass of a connector, in kilograms. Without it, that of the same metal as the ring's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub connector_mass_kg: Option<f64>,
}

/// Rings of a weave that follow a motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grip {
    /// Name of the motion.
    pub motion: String,
    /// Whole rows.
    #[serde(default)]
    pub rows: Vec<u32>,
    /// Whole columns.
    #[serde(default)]
    pub columns: Vec<u32>,
    /// Single rings, as `[row, column]`.
    #[serde(default)]
    pub rings: Vec<[u32; 2]>,
}

impl Grip {
    fn holds(&self, [row, column]: [u32; 2]) -> bool {
        self.rows.contains(&row) || self.columns.contains(&column) || self.rings.contains(&[row, column])
    }
}

/// A pattern of linked rings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pattern {
    /// Each inner ring is linked with four others: two of the row above and two of the row below. Wires
    /// thinner than 0.25 major radii.
    #[serde(rename = "european-4-in-1")]
    European4In1,
    /// Each inner ring is linked with six others: three of the row above and three of the row below. Wires
    /// thinner than 0.185 major radii.
    #[serde(rename = "european-6-in-1")]
    European6In1,
    /// Level rings on a square grid, each joined to its four neighbours by two upright connectors: eight
    /// connectors in a ring, two rings in a connector. With connectors of the same wire, wires up to 0.2022
    /// major radii.
    #[serde(rename = "japanese-8-in-2")]
    Japanese8In2,
    /// Level rings on a triangular grid, each joined to its six neighbours by two upright connectors: twelve
    /// connectors in a ring, two rings in a connector. With connectors of the same wire, wires up to 0.1597
    /// major radii.
    #[serde(rename = "japanese-12-in-2")]
    Japanese12In2,
    /// Rows of separate chains: each ring is linked with the next along its row, axes crossed. Wires up to
    /// 0.3125 major radii.
    #[serde(rename = "chain")]
    Chain,
}

impl Pattern {
    /// The pattern's name in a scene.
    pub fn name(&self) -> &'static str {
        match self {
            Pattern::European4In1 => "european-4-in-1",
            Pattern::European6In1 => "european-6-in-1",
            Pattern::Japanese8In2 => "japanese-8-in-2",
            Pattern::Japanese12In2 => "japanese-12-in-2",
            Pattern::Chain => "chain",
        }
    }

    /// The grid of a Japanese pattern.
    fn grid(&self) -> Option<Grid> {
        match self {
            Pattern::Japanese8In2 => Some(Grid::Square),
            Pattern::Japanese12In2 => Some(Grid::Triangular),
            _ => None,
        }
    }
}

/// Layout of a European pattern, in major radii: every second row is shifted, and rings are tilted about the
/// patch's y axis, alternating in sign from row to row.
///
/// Both layouts were found by a random search and hill climbing over pitches, shift, height of every second
/// row, and two tilts for each of the two rows: the largest least distance between any two centrelines while
/// the right pairs are linked. The best found are 0.5024 (4-in-1) and 0.3724 (6-in-1) major radii; those
/// kept are rounded.
struct European {
    /// From one ring of a row to the next.
    column_pitch: f64,
    /// From row to row.
    row_pitch: f64,
    /// By how much every second row is shifted.
    shift: f64,
    /// Tilt (rad).
    tilt_rad: f64,
}

/// Any two centrelines are at least 0.5 major radii apart.
const EUROPEAN_4_IN_1: European =
    European { column_pitch: 1.25, row_pitch: 1.25, shift: 0.5 * 1.25, tilt_rad: 0.6 };
/// Any two centrelines are at least 0.37 major radii apart.
const EUROPEAN_6_IN_1: European =
    European { column_pitch: 0.89, row_pitch: 1.185, shift: 0.0, tilt_rad: 0.57 };

/// A ring's place in the patch's own frame.
struct Place {
    centre: [f64; 3],
    orientation: [f64; 4],
    /// Row and column; a connector has none.
    grid: Option<[u32; 2]>,
}

impl Weave {
    /// Number of rings before any is left out.
    pub(super) fn ring_count(&self) -> u64 {
        let (rows, columns) = (u64::from(self.rows), u64::from(self.columns));
        let connectors =
            self.pattern.grid().map_or(0, |grid| grid.edge_count(rows, columns).saturating_mul(2));
        (rows * columns).saturating_add(connectors)
    }

    /// The rings of the patch, row by row, connectors last. `seed` and the weave's number in the scene decide
    /// which are left out.
    pub(super) fn rings(&self, seed: u64, number: usize) -> Vec<Ring> {
        let turn = rotation(self.rotation_rad);
        let pins = self.sorted_pins();
        let pinned = |place: [u32; 2]| self.is_pinned(&pins, place);
        let motion = |place: [u32; 2]| {
            self.grips.iter().find(|grip| grip.holds(place)).map(|grip| grip.motion.clone())
        };
        let mut rings: Vec<Ring> = self
            .places()
            .into_iter()
            .map(|place| {
                let centre = rotate(turn, place.centre);
                let (major_radius_m, minor_radius_m, mass_kg) = match place.grid {
                    Some(_) => (self.major_radius_m, self.minor_radius_m, self.ring_mass_kg),
                    None => self.connector(),
                };
                Ring {
                    major_radius_m,
                    minor_radius_m,
                    mass_kg,
                    material: self.material.clone(),
                    position_m: std::array::from_fn(|axis| self.position_m[axis] + centre[axis]),
                    orientation: product(turn, place.orientation),
                    linear_velocity_m_per_s: [0.0; 3],
                    angular_velocity_rad_per_s: [0.0; 3],
                    pinned: place.grid.is_some_and(pinned),
                    drag: self.drag,
                    motion: place.grid.and_then(motion),
                }
            })
            .collect();
        self.leave_out(&mut rings, seed, number);
        rings
    }

    fn sorted_pins(&self) -> Vec<[u32; 2]> {
        let mut pins = self.pins.clone();
        pins.sort_unstable();
        pins
    }

    fn is_pinned(&self, sorted_pins: &[[u32; 2]], place: [u32; 2]) -> bool {
        self.pin_rows.contains(&place[0]) || sorted_pins.binary_search(&place).is_ok()
    }

    /// Takes out the share of rings that is to be left out: those with the smallest hash of seed, weave and
    /// ring.
    fn leave_out(&self, rings: &mut Vec<Ring>, seed: u64, number: usize) {
        if self.remove_share == 0.0 {
            return;
        }
        let draw = |ring: usize| {
            let numbers = [seed, number as u64, ring as u64].map(u64::to_le_bytes);
            Hash::of_parts(&[b"weave.remove_share", &numbers[0], &numbers[1], &numbers[2]]).0
        };
        let mut draws: Vec<_> = (0..rings.len())
            .filter(|&ring| !rings[ring].pinned && rings[ring].motion.is_none())
            .map(|ring| (draw(ring), ring))
            .collect();
        draws.sort_unstable();
        let count = libm::floor(self.remove_share * rings.len() as f64 + 0.5) as usize;
        let mut gone = vec![false; rings.len()];
        draws.iter().take(count).for_each(|&(_, ring)| gone[ring] = true);
        let mut index = 0;
        rings.retain(|_| {
            index += 1;
            !gone[index - 1]
        });
    }

    fn places(&self) -> Vec<Place> {
        let mut places = Vec::with_capacity(self.ring_count() as usize);
        let japanese = self.japanese();
        for row in 0..self.rows {
            for column in 0..self.columns {
                let (centre, orientation) = match (&japanese, self.pattern) {
                    (Some(japanese), _) => (japanese.centre(row, column), rotation([0.0; 3])),
                    (None, Pattern::European6In1) => self.european(&EUROPEAN_6_IN_1, row, column),
                    (None, Pattern::Chain) => self.chain(row, column),
                    (None, _) => self.european(&EUROPEAN_4_IN_1, row, column),
                };
                places.push(Place { centre, orientation, grid: Some([row, column]) });
            }
        }
        if let Some(japanese) = japanese {
            places.extend(japanese.connectors(self.rows, self.columns));
        }
        places
    }

    fn european(&self, layout: &European, row: u32, column: u32) -> ([f64; 3], [f64; 4]) {
        let (i, j, radius) = (f64::from(row), f64::from(column), self.major_radius_m);
        let odd = row % 2 == 1;
        let shift = if odd { layout.shift } else { 0.0 };
        let tilt = if odd { -layout.tilt_rad } else { layout.tilt_rad };
        let centre = [radius * (layout.column_pitch * j + shift), radius * layout.row_pitch * i, 0.0];
        (centre, rotation([0.0, tilt, 0.0]))
    }

    fn chain(&self, row: u32, column: u32) -> ([f64; 3], [f64; 4]) {
        let (i, j, radius) = (f64::from(row), f64::from(column), self.major_radius_m);
        // Axes alternate between z and y. Neighbours touch where the pitch is 2 R - 2 r; a tenth of the
        // wire's room keeps them apart. The next but one is 4 R - 4.4 r away and needs 2 R + 2 r: from there
        // the largest wire, 2 / 6.4 of R. Chains of a patch stand 3 R apart.
        let pitch = 2.0 * radius - 2.2 * self.minor_radius_m;
        let quarter = std::f64::consts::FRAC_PI_2;
        let turn = if column % 2 == 1 { [quarter, 0.0, 0.0] } else { [0.0; 3] };
        ([pitch * j, 3.0 * radius * i, 0.0], rotation(turn))
    }

    /// Major radius, minor radius and mass of a connector.
    fn connector(&self) -> (f64, f64, f64) {
        let minor = self.connector_minor_radius_m.unwrap_or(self.minor_radius_m);
        let major = self.japanese().map_or(0.0, |japanese| japanese.connector_radius);
        // A torus has the volume 2 pi^2 R r^2.
        let volume =
            (major / self.major_radius_m) * (minor / self.minor_radius_m) * (minor / self.minor_radius_m);
        (major, minor, self.connector_mass_kg.unwrap_or(self.ring_mass_kg * volume))
    }

    /// The layout, if the pattern is a Japanese one.
    fn japanese(&self) -> Option<Japanese> {
        let minor = self.connector_minor_radius_m.unwrap_or(self.minor_radius_m);
        self.pattern.grid().map(|grid| {
            let radii = (self.major_radius_m, self.minor_radius_m);
            Japanese::new(grid, radii, self.connector_major_radius_m, minor)
        })
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

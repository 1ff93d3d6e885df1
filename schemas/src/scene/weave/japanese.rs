//! Japanese weaves: level rings on a grid, joined by upright connectors, two for each pair of neighbours.
//!
//! # Layout
//! Level rings of radius `R` and wire `r` stand `P = 2 R + 2.2 r` apart. A pair of connectors (radius `C`, wire
//! `c`) stands upright over the middle between two of them, at `y = +-1.1 c` beside the line of centres: so no
//! two wires of either kind are nearer than 2.2 of their radii. A connector reaches into each ring up to
//! `rho = P/2 - C` from its centre, so its wire's centreline is `R - sqrt(rho^2 + y^2)` from the ring's. Two
//! connectors of neighbouring edges, `2 alpha` apart about the ring's centre, lie mirrored about the line
//! between, which they miss by `rho sin alpha - y cos alpha`. The first must be `r + c` at least, the second
//! `c`: from there the range of `C`. Without a given one the first is 1.1 (r + c).

use super::{Place, product, rotation};

/// Wires that do not touch keep this share of their radii together from centreline to centreline.
const ROOM: f64 = 1.1;

/// How the level rings stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grid {
    /// Four neighbours.
    Square,
    /// Six neighbours.
    Triangular,
}

impl Grid {
    /// Sine and cosine of half the angle between neighbouring edges.
    fn half_angle(self) -> (f64, f64) {
        match self {
            Grid::Square => (std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2),
            Grid::Triangular => (0.5, 0.5 * 3.0_f64.sqrt()),
        }
    }

    /// Pairs of neighbours in a patch.
    pub(super) fn edge_count(self, rows: u64, columns: u64) -> u64 {
        let along = rows.saturating_mul(columns.saturating_sub(1));
        let across = match self {
            Grid::Square => columns,
            Grid::Triangular => (2 * columns).saturating_sub(1),
        };
        along.saturating_add(rows.saturating_sub(1).saturating_mul(across))
    }
}

/// The layout of a Japanese weave (m).
pub(super) struct Japanese {
    grid: Grid,
    major_radius: f64,
    minor_radius: f64,
    connector_minor_radius: f64,
    /// From the centre of one level ring to the next.
    pitch: f64,
    /// From a connector's plane to the line of centres.
    aside: f64,
    pub(super) connector_radius: f64,
}

impl Japanese {
    pub(super) fn new(
        grid: Grid,
        (major, minor): (f64, f64),
        given: Option<f64>,
        connector_minor: f64,
    ) -> Japanese {
        let pitch = 2.0 * (major + ROOM * minor);
        let aside = ROOM * connector_minor;
        let inner = major - ROOM * (minor + connector_minor);
        let connector_radius = given.unwrap_or(0.5 * pitch - (inner * inner - aside * aside).sqrt());
        Japanese {
            grid,
            major_radius: major,
            minor_radius: minor,
            connector_minor_radius: connector_minor,
            pitch,
            aside,
            connector_radius,
        }
    }

    /// The range of the connector's radius in which nothing overlaps (m); empty, first above last, if there
    /// is none.
    pub(super) fn connector_range(&self) -> (f64, f64) {
        let (sine, cosine) = self.grid.half_angle();
        let inner = self.major_radius - self.minor_radius - self.connector_minor_radius;
        let rho_max = (inner * inner - self.aside * self.aside).sqrt();
        let rho_min = (self.connector_minor_radius + self.aside * cosine) / sine;
        (0.5 * self.pitch - rho_max, 0.5 * self.pitch - rho_min)
    }

    /// The thickest connector wire for which the layout without a given radius has room (m).
    pub(super) fn connector_wire_max(&self) -> f64 {
        (self.major_radius - ROOM * self.minor_radius) / (ROOM + self.grid.wires_to_wrap())
    }

    /// The largest ratio of wire to ring with connectors of the same wire and no given radius.
    pub(super) fn ratio_max(grid: Grid) -> f64 {
        1.0 / (2.0 * ROOM + grid.wires_to_wrap())
    }

    /// Centre of a level ring.
    pub(super) fn centre(&self, row: u32, column: u32) -> [f64; 3] {
        let (i, j) = (f64::from(row), f64::from(column));
        match self.grid {
            Grid::Square => [self.pitch * j, self.pitch * i, 0.0],
            Grid::Triangular => {
                let shift = if row % 2 == 1 { 0.5 } else { 0.0 };
                [self.pitch * (j + shift), self.pitch * 0.5 * 3.0_f64.sqrt() * i, 0.0]
            }
        }
    }

    /// The connectors, in the order of the level rings: for each of them the edges to its right, then up.
    pub(super) fn connectors(&self, rows: u32, columns: u32) -> Vec<Place> {
        let mut places = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let odd = row % 2 == 1;
                let up: &[i64] = match (self.grid, odd) {
                    (Grid::Square, _) => &[0],
                    (Grid::Triangular, false) => &[-1, 0],
                    (Grid::Triangular, true) => &[0, 1],
                };
                let right = (row, i64::from(column) + 1);
                let above = up.iter().map(|shift| (row + 1, i64::from(column) + shift));
                for (other_row, other_column) in std::iter::once(right).chain(above) {
                    if other_row < rows && (0..i64::from(columns)).contains(&other_column) {
                        self.join([row, column], [other_row, other_column as u32], &mut places);
                    }
                }
            }
        }
        places
    }

    /// The two connectors of two neighbours.
    fn join(&self, a: [u32; 2], b: [u32; 2], places: &mut Vec<Place>) {
        let (from, to) = (self.centre(a[0], a[1]), self.centre(b[0], b[1]));
        let along = [(to[0] - from[0]) / self.pitch, (to[1] - from[1]) / self.pitch];
        // A ring's axis is its z: first laid along -y, then turned with the edge about the patch's z.
        let upright = rotation([std::f64::consts::FRAC_PI_2, 0.0, 0.0]);
        let heading = rotation([0.0, 0.0, libm::atan2(along[1], along[0])]);
        for side in [-self.aside, self.aside] {
            let centre =
                [0.5 * (from[0] + to[0]) - side * along[1], 0.5 * (from[1] + to[1]) + side * along[0], 0.0];
            places.push(Place { centre, orientation: product(heading, upright), grid: None });
        }
    }
}

impl Grid {
    /// How many connector wires' radii the distance from a ring's centre to the connectors in it must hold
    /// at least: `sqrt(rho^2 + y^2) / c` where two connectors of neighbouring edges touch.
    fn wires_to_wrap(self) -> f64 {
        let (sine, cosine) = self.half_angle();
        let rho = (1.0 + ROOM * cosine) / sine;
        (rho * rho + ROOM * ROOM).sqrt()
    }
}

//! Broad phase: which pairs of bodies can touch.
//!
//! The one thing to know: the list kept here is a superset, and it only saves time. The *candidate pairs*
//! of a step are those of it whose bounding spheres overlap at that moment, which is a function of the
//! state alone; when the list was made, and how, never reaches a bit of the result.

use crate::Model;
use geometry::{Circle, Vec3};

/// Pairs that stay apart until some body has moved by half the skin.
#[derive(Debug, Default)]
pub(crate) struct Neighbours {
    /// Ordered by (first, second). The first body of a pair carries the contact arc.
    pairs: Vec<(u32, u32)>,
    /// Where the bodies were when the list was made.
    anchors: Vec<Vec3>,
    cells: Vec<(Cell, u32)>,
    pub(crate) rebuilds: u64,
}

type Cell = [i64; 3];

/// Skin in bounding radii of the largest ring. Wider: fewer rebuilds, more pairs to look at. The result
/// does not depend on it.
const SKIN_SHARE: f64 = 0.25;

impl Neighbours {
    pub(crate) fn pairs(&self) -> &[(u32, u32)] {
        &self.pairs
    }

    /// Makes the list anew if some body has moved too far for the old one.
    pub(crate) fn update(&mut self, model: &Model, circles: &[Circle]) {
        let limit = 0.5 * model.grid_radius() * SKIN_SHARE;
        let limit_squared = limit * limit;
        let moved = |(circle, anchor): (&Circle, &Vec3)| {
            // Written so that a NaN counts as moved.
            !((circle.centre - anchor).norm_squared() <= limit_squared)
        };
        if self.anchors.len() == circles.len() && !circles.iter().zip(&self.anchors).any(moved) {
            return;
        }
        self.rebuild(model, circles);
    }

    fn rebuild(&mut self, model: &Model, circles: &[Circle]) {
        self.rebuilds += 1;
        self.anchors.clear();
        self.anchors.extend(circles.iter().map(|circle| circle.centre));
        self.pairs.clear();
        let skin = model.grid_radius() * SKIN_SHARE;
        let width = 2.0 * model.grid_radius() + skin;
        let bodies = model.bodies();
        let wide = |body: usize| 2.0 * bodies[body].bounding_radius > width;
        self.cells.clear();
        for (body, centre) in self.anchors.iter().enumerate() {
            if !wide(body) {
                self.cells.push((cell(centre, width), body as u32));
            }
        }
        self.cells.sort_unstable();
        let (cells, anchors, pairs) = (&self.cells, &self.anchors, &mut self.pairs);
        let mut meet = |a: u32, b: u32| {
            let reach = bodies[a as usize].bounding_radius + bodies[b as usize].bounding_radius + skin;
            let apart = (anchors[a as usize] - anchors[b as usize]).norm_squared();
            if apart < reach * reach && model.interacts(a, b) {
                pairs.push(model.ordered(a, b));
            }
        };
        for (index, &(here, body)) in cells.iter().enumerate() {
            // The rest of the own row of three cells, then the four rows after it: half of all 27.
            for &(other, neighbour) in &cells[index + 1..] {
                if other[0] != here[0] || other[1] != here[1] || other[2] > here[2] + 1 {
                    break;
                }
                meet(body, neighbour);
            }
            for [dx, dy] in [[0, 1], [1, -1], [1, 0], [1, 1]] {
                let row = [here[0] + dx, here[1] + dy, here[2] - 1];
                let start = cells.partition_point(|(cell, _)| *cell < row);
                for &(other, neighbour) in &cells[start..] {
                    if other[0] != row[0] || other[1] != row[1] || other[2] > here[2] + 1 {
                        break;
                    }
                    meet(body, neighbour);
                }
            }
        }
        // Bodies too wide for the grid (a ball among small rings) meet everyone.
        for a in (0..bodies.len()).filter(|&body| wide(body)) {
            for b in (0..bodies.len()).filter(|&b| !wide(b) || b > a) {
                meet(a as u32, b as u32);
            }
        }
        for (index, plane) in model.planes().iter().enumerate() {
            for (body, centre) in self.anchors.iter().enumerate() {
                let height = plane.normal.dot(centre) - plane.offset;
                if height < bodies[body].bounding_radius + skin && !bodies[body].pinned {
                    self.pairs.push((body as u32, (bodies.len() + index) as u32));
                }
            }
        }
        self.pairs.sort_unstable();
    }
}

/// The cell of a point; a cast saturates, so the far ends of space share a cell.
fn cell(point: &Vec3, width: f64) -> Cell {
    let index = |coordinate: f64| {
        let cell = libm::floor(coordinate / width);
        // Room for the neighbouring cells' numbers.
        if cell.abs() < 1e18 { cell as i64 } else { 0 }
    };
    [index(point.x), index(point.y), index(point.z)]
}

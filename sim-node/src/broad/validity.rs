//! How long a list of neighbours holds: until two bodies that are not on it have moved towards each other by
//! the skin.
//!
//! The one thing to know: only motion *relative* to each other counts, so a sheet that falls as a whole keeps
//! its list. Bodies are taken by blocks of consecutive numbers, which lie together in a weave. Of each block
//! there is one box of displacements since the list was made, and two blocks can move towards each other by no
//! more than their boxes tell. Where consecutive bodies lie anywhere, the boxes say little and the list is made
//! anew earlier; it is never kept too long.

use crate::model::HalfSpace;
use geometry::Vec3;

/// Bodies in a block.
const BLOCK: usize = 32;

/// Blocks farther apart than this many skins, beyond their bodies' reach, are not looked at one pair at a time:
/// no two bodies of the scene may come closer by as much. More: longer lists of blocks, fewer rebuilds.
const FAR_SKINS: f64 = 8.0;

/// Pairs of blocks for each block up to which they are looked at.
const PAIRS_PER_BLOCK: usize = 48;

/// Share of each allowance that is given up to rounding of the displacements.
const ROUNDING: f64 = 1e-6;

/// An axis-parallel box of points or of displacements (m).
#[derive(Clone, Copy, Debug)]
struct Span {
    low: [f64; 3],
    high: [f64; 3],
}

impl Span {
    const EMPTY: Span = Span { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    #[inline]
    fn add(&mut self, point: &Vec3) {
        for axis in 0..3 {
            let x = point[axis];
            self.low[axis] = if x < self.low[axis] { x } else { self.low[axis] };
            self.high[axis] = if x > self.high[axis] { x } else { self.high[axis] };
        }
    }

    fn join(&mut self, other: &Span) {
        self.add(&Vec3::from(other.low));
        self.add(&Vec3::from(other.high));
    }

    /// Square of the largest distance of a point of one from a point of the other.
    #[inline]
    fn farthest_squared(&self, other: &Span) -> f64 {
        let mut sum = 0.0;
        for axis in 0..3 {
            let (up, down) = (self.high[axis] - other.low[axis], other.high[axis] - self.low[axis]);
            let most = if up > down { up } else { down };
            sum += most * most;
        }
        sum
    }

    /// The smallest distance of a point of one from a point of the other.
    fn gap(&self, other: &Span) -> f64 {
        let mut sum = 0.0;
        for axis in 0..3 {
            let (up, down) = (self.low[axis] - other.high[axis], other.low[axis] - self.high[axis]);
            let apart = if up > down { up } else { down };
            if apart > 0.0 {
                sum += apart * apart;
            }
        }
        sum.sqrt()
    }
}

/// Two blocks, or one with itself, and the square of the relative displacement that its bodies may have (m^2).
#[derive(Clone, Copy, Debug)]
struct BlockPair {
    a: u32,
    b: u32,
    allowed_squared: f64,
}

/// A block and a plane, and how far the block's bodies may sink (m).
#[derive(Clone, Copy, Debug)]
struct BlockPlane {
    block: u32,
    plane: u32,
    allowed: f64,
}

/// What is known of the time when the list was made, and of the motion since.
#[derive(Debug, Default)]
pub(super) struct Validity {
    skin_squared: f64,
    /// Square of the relative displacement up to which blocks that are no pair need no look (m^2).
    far_squared: f64,
    pairs: Vec<BlockPair>,
    planes: Vec<BlockPlane>,
    displacements: Vec<Span>,
}

impl Validity {
    /// Takes note of the bodies as a new list was made of them. `plane_slack` is the height of a body over a
    /// plane less its radius, if that pair is not on the list (m).
    pub(super) fn start(
        &mut self,
        anchors: &[Vec3],
        radii: &[f64],
        skin: f64,
        planes: &[HalfSpace],
        plane_slack: impl Fn(usize, usize) -> Option<f64>,
    ) {
        let keep = 1.0 - ROUNDING;
        self.skin_squared = skin * skin * keep;
        let blocks = anchors.len().div_ceil(BLOCK);
        self.displacements.clear();
        self.displacements.resize(blocks, Span::EMPTY);
        self.planes.clear();
        for plane in 0..planes.len() {
            for block in 0..blocks {
                let end =
                    if (block + 1) * BLOCK < anchors.len() { (block + 1) * BLOCK } else { anchors.len() };
                let mut allowed = f64::INFINITY;
                for slack in (block * BLOCK..end).filter_map(|body| plane_slack(body, plane)) {
                    allowed = if slack < allowed { slack } else { allowed };
                }
                self.planes.push(BlockPlane {
                    block: block as u32,
                    plane: plane as u32,
                    allowed: allowed * keep,
                });
            }
        }
        self.pair_blocks(anchors, radii, skin);
    }

    /// The pairs of blocks that have to be looked at: a sweep along the axis of the widest spread.
    fn pair_blocks(&mut self, anchors: &[Vec3], radii: &[f64], skin: f64) {
        struct Block {
            span: Span,
            radius: f64,
            number: u32,
        }
        let largest = |radii: &[f64]| radii.iter().fold(0.0, |most, &r| if r > most { r } else { most });
        let mut all = Span::EMPTY;
        let mut blocks = Vec::with_capacity(self.displacements.len());
        for (number, (points, radii)) in anchors.chunks(BLOCK).zip(radii.chunks(BLOCK)).enumerate() {
            let mut span = Span::EMPTY;
            points.iter().for_each(|point| span.add(point));
            all.join(&span);
            blocks.push(Block { span, radius: largest(radii), number: number as u32 });
        }
        let spread = |axis: usize| all.high[axis] - all.low[axis];
        let axis = if spread(0) >= spread(1) && spread(0) >= spread(2) {
            0
        } else if spread(1) >= spread(2) {
            1
        } else {
            2
        };
        blocks.sort_by(|a, b| a.span.low[axis].total_cmp(&b.span.low[axis]));
        let (far, reach) = (FAR_SKINS * skin, largest(radii));
        self.far_squared = far * far * (1.0 - ROUNDING);
        self.pairs.clear();
        for (index, a) in blocks.iter().enumerate() {
            let own = BlockPair { a: a.number, b: a.number, allowed_squared: self.skin_squared };
            self.pairs.push(own);
            for b in &blocks[index + 1..] {
                if b.span.low[axis] - a.span.high[axis] > far + a.radius + reach {
                    break;
                }
                let beyond = a.span.gap(&b.span) - a.radius - b.radius;
                if beyond < far {
                    let allowed = if beyond > skin { beyond } else { skin };
                    let allowed_squared = allowed * allowed * (1.0 - ROUNDING);
                    self.pairs.push(BlockPair { a: a.number, b: b.number, allowed_squared });
                }
            }
            if self.pairs.len() > PAIRS_PER_BLOCK * blocks.len() {
                // The blocks lie all over each other: only the motion of everyone tells.
                self.pairs.clear();
                self.far_squared = self.skin_squared;
                return;
            }
        }
    }

    /// Whether the list still holds, with the bodies' centres now.
    pub(super) fn holds(
        &mut self,
        anchors: &[Vec3],
        planes: &[HalfSpace],
        centre: impl Fn(usize) -> Vec3,
    ) -> bool {
        let mut all = Span::EMPTY;
        let mut sum = 0.0;
        for (block, (points, span)) in anchors.chunks(BLOCK).zip(&mut self.displacements).enumerate() {
            *span = Span::EMPTY;
            for (index, anchor) in points.iter().enumerate() {
                let moved = centre(block * BLOCK + index) - anchor;
                sum += moved.x + moved.y + moved.z;
                span.add(&moved);
            }
            all.join(span);
        }
        // A NaN is in no box.
        if !sum.is_finite() {
            return false;
        }
        let most = all.farthest_squared(&all);
        let sunk = |pair: &BlockPlane| {
            let (normal, span) =
                (&planes[pair.plane as usize].normal, &self.displacements[pair.block as usize]);
            let mut lowest = 0.0;
            for axis in 0..3 {
                let (low, high) = (normal[axis] * span.low[axis], normal[axis] * span.high[axis]);
                lowest += if low < high { low } else { high };
            }
            // Also where nothing is known of it (an infinite box has no product with 0).
            !(lowest >= -pair.allowed)
        };
        let close = |pair: &BlockPair| {
            let (a, b) = (&self.displacements[pair.a as usize], &self.displacements[pair.b as usize]);
            a.farthest_squared(b) > pair.allowed_squared
        };
        let bodies_hold =
            most <= self.skin_squared || (most <= self.far_squared && !self.pairs.iter().any(close));
        bodies_hold && !self.planes.iter().any(sunk)
    }
}

#[cfg(test)]
mod tests {
    use super::Validity;
    use geometry::Vec3;

    fn row(count: usize) -> Vec<Vec3> {
        (0..count).map(|index| Vec3::new(3.0 * index as f64, 0.0, 0.0)).collect()
    }

    fn holds(anchors: &[Vec3], skin: f64, moved: impl Fn(usize) -> Vec3) -> bool {
        let radii = vec![1.0; anchors.len()];
        let mut validity = Validity::default();
        validity.start(anchors, &radii, skin, &[], |_, _| None);
        validity.holds(anchors, &[], |body| anchors[body] + moved(body))
    }

    #[test]
    fn a_row_that_moves_as_a_whole_keeps_its_list() {
        assert!(holds(&row(1000), 0.5, |_| Vec3::new(70.0, -80.0, 90.0)));
    }

    #[test]
    fn a_row_that_stretches_evenly_keeps_its_list_longer_than_one_skin() {
        // Over a block the stretch is below the skin; over the row it is 1.5 of them.
        let stretch = |body: usize| Vec3::new(0.00075 * body as f64, 0.0, 0.0);
        assert!(holds(&row(1000), 0.5, stretch));
        assert!(!holds(&row(1000), 0.5, |body| stretch(body) * 100.0));
    }

    #[test]
    fn two_bodies_that_approach_by_the_skin_end_it() {
        let toward = |share: f64| {
            move |body: usize| match body {
                500 => Vec3::new(0.25 * share, 0.0, 0.0),
                501 => Vec3::new(-0.25 * share, 0.0, 0.0),
                _ => Vec3::zeros(),
            }
        };
        assert!(holds(&row(1000), 0.5, toward(0.99)));
        assert!(!holds(&row(1000), 0.5, toward(1.0)));
    }

    #[test]
    fn a_body_from_afar_ends_it_before_it_arrives() {
        let points = row(1000);
        // Body 0 flies to body 900 and stops short of touching it by 0.6.
        let flight = points[900] - points[0] - Vec3::new(2.6, 0.0, 0.0);
        assert!(!holds(&points, 0.5, |body| if body == 0 { flight } else { Vec3::zeros() }));
    }

    #[test]
    fn what_is_not_a_number_ends_it() {
        let lost = |body: usize| if body == 7 { Vec3::new(f64::NAN, 0.0, 0.0) } else { Vec3::zeros() };
        assert!(!holds(&row(40), 0.5, lost));
    }
}

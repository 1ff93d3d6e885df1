//! The part of one body's surface that lies inside another body, as points for numerical integration.
//!
//! The integrals wanted are of `d n dA` and the like: depth `d` inside the other body, the direction `n` in which
//! that body pushes, and the area `dA`. Four ways to place the points:
//!
//! - [`polar`]: about the deepest point, out to the patch's edge on each of a few rays. For patches that are
//!   star-shaped about it, exponentially accurate; it says so when a patch is not.
//! - [`strips`]: cross-sections of a ring's wire, eight side by side. For shallow patches that are long and narrow or have
//!   two deepest points; it says so when a patch is not.
//! - [`slices`]: cross-sections of the wire, each cut exactly by root isolation. For any patch: annular (a ring lying
//!   flat, coaxial rings), with two deepest points, or deep.
//! - [`cap`]: sphere against sphere or plane.
//!
//! Or at points of the whole surface that are given as pairs of numbers in the unit square ([`chart`]), for sampling.

pub mod cap;
pub mod chart;
pub mod pair;
pub mod polar;
pub mod slices;
pub mod strips;

mod rings;
mod solid;

pub use solid::Solid;

use crate::Vec3;

/// Points in a [`Block`].
pub const WIDTH: usize = 8;

/// One number for each point of a block.
pub type Lane = [f64; WIDTH];

/// Eight points of a surface inside a body, one array for each quantity.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    /// The points (m).
    pub point: [Lane; 3],
    /// Outward unit normals of the body that the points are in: it pushes them that way.
    pub normal: [Lane; 3],
    /// Depths of the points below the surface of that body (m).
    pub depth: Lane,
    /// Area that each point stands for (m^2); 0 in an unused place.
    pub area: Lane,
}

impl Block {
    /// No point.
    pub const EMPTY: Block = Block {
        point: [[0.0; WIDTH]; 3],
        normal: [[0.0; WIDTH]; 3],
        depth: [0.0; WIDTH],
        area: [0.0; WIDTH],
    };

    /// One of the points: place, normal, depth, area.
    #[inline]
    pub fn at(&self, lane: usize) -> (Vec3, Vec3, f64, f64) {
        let vector = |v: &[Lane; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
        (vector(&self.point), vector(&self.normal), self.depth[lane], self.area[lane])
    }
}

/// A growing list of points, kept between uses so that it need not be allocated again.
#[derive(Debug, Clone, Default)]
pub struct Nodes {
    /// Blocks, in use and from earlier uses.
    blocks: Vec<Block>,
    /// How many are in use, the first ones.
    used: usize,
    /// Places of the last block in use that are taken; `WIDTH` if there is none.
    taken: usize,
    deepest: f64,
}

impl Nodes {
    /// Forgets all points.
    pub fn clear(&mut self) {
        self.truncate(0);
        self.deepest = 0.0;
    }

    /// The points, in the order in which they were added; unused places have no area.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks[..self.used]
    }

    /// How many points there are.
    pub fn count(&self) -> u64 {
        let whole = self.used as u64 * WIDTH as u64;
        whole - if self.used == 0 { 0 } else { (WIDTH - self.taken) as u64 }
    }

    /// The largest depth that was noted (m); 0 if none was.
    pub fn deepest(&self) -> f64 {
        self.deepest
    }

    /// Notes a depth: that of a patch's deepest point, where none of the points is.
    #[inline]
    pub fn note_depth(&mut self, depth: f64) {
        if depth > self.deepest {
            self.deepest = depth;
        }
    }

    /// Forgets the blocks after the first `count`.
    pub fn truncate(&mut self, count: usize) {
        self.used = if count < self.used { count } else { self.used };
        self.taken = WIDTH;
    }

    /// The blocks from `first` on, to be changed.
    pub fn blocks_from(&mut self, first: usize) -> &mut [Block] {
        self.taken = WIDTH;
        &mut self.blocks[first..self.used]
    }

    /// A further block, full, with any numbers in it: all of them are to be written.
    #[inline(always)]
    pub fn next_block(&mut self) -> &mut Block {
        if self.used == self.blocks.len() {
            self.blocks.push(Block::EMPTY);
        }
        self.used += 1;
        self.taken = WIDTH;
        &mut self.blocks[self.used - 1]
    }

    /// Adds a full block.
    #[inline(always)]
    pub fn push_block(&mut self, block: Block) {
        *self.next_block() = block;
    }

    /// Adds one point.
    #[inline]
    pub fn push(&mut self, point: &Vec3, normal: &Vec3, depth: f64, area: f64) {
        if self.taken == WIDTH || self.used == 0 {
            self.push_block(Block::EMPTY);
            self.taken = 0;
        }
        let block = &mut self.blocks[self.used - 1];
        let lane = self.taken;
        for axis in 0..3 {
            block.point[axis][lane] = point[axis];
            block.normal[axis][lane] = normal[axis];
        }
        block.depth[lane] = depth;
        block.area[lane] = area;
        self.taken += 1;
        self.note_depth(depth);
    }
}

//! A tree of boxes over the bodies, eight children to a node, eight bodies to a leaf.
//!
//! The tree only culls: its boxes and [sieves](crate::sieve) are in `f32` and wider than the bodies by more than all
//! rounding, and bodies are asked for exact hits. So neither its shape nor the order of traversal changes a bit of a
//! picture, and a tree that was made for other places of the bodies, with its boxes made anew, serves as well.

mod build;
mod probe;
mod trace;

use crate::sieve::{self, Sieve, WIDTH};
use crate::world::Bodies;
use geometry::{Aabb, Vec3};

pub(crate) use trace::Reach;
pub use trace::Tracer;

/// Widening of a box in parts of D, the half diagonal of all bodies' bounds.
///
/// All places are relative to the middle of the bounds. A probe that meets a body begins at most `sqrt(2) D` from there.
/// With `u = 2^-24`, a bound carries an error of `u D`, the probe's origin of `1.4 u D`, their difference of `2.4 u D`, and
/// the inverse direction and the product add `3 u` of 2.4 D: together 12 u D = 7.3e-7 D.
const MARGIN: f64 = 2e-6;

/// A tree whose boxes have grown so much since it was built, by the sum of areas that a ray is likely to meet, is built
/// anew.
const COST_GROWTH_MAX: f64 = 1.3;

/// Marks a child that is a leaf; the other bits are its number, or that of a node.
const LEAF: u32 = 1 << 31;
/// No child and no body.
const NONE: u32 = u32::MAX;

#[derive(Clone, Debug)]
#[repr(align(32))]
struct Node {
    /// Lower and upper bounds of the children: x, y, z, and the same again.
    bounds: [[f32; WIDTH]; 6],
    /// Nodes or [leaves](LEAF), or [`NONE`].
    children: [u32; WIDTH],
}

#[derive(Clone, Debug)]
#[repr(align(32))]
struct Leaf {
    sieve: Sieve,
    /// Numbers of the bodies, or [`NONE`].
    bodies: [u32; WIDTH],
}

/// Bounds, relative to the tree's middle and widened: x, y and z of the lower corner, and the same of the upper.
type Box32 = [f32; 6];

/// Bounds that no ray runs through.
const EMPTY: Box32 =
    [f32::INFINITY, f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY];

#[inline(always)]
fn union(a: &Box32, b: &Box32) -> Box32 {
    let lower = |i: usize| if b[i] < a[i] { b[i] } else { a[i] };
    let upper = |i: usize| if b[i] > a[i] { b[i] } else { a[i] };
    [lower(0), lower(1), lower(2), upper(3), upper(4), upper(5)]
}

/// Half of the area of a box's six faces; of one that holds nothing it is no number or not finite.
#[inline(always)]
fn half_area(bounds: &Box32) -> f32 {
    let size = [bounds[3] - bounds[0], bounds[4] - bounds[1], bounds[5] - bounds[2]];
    size[0] * size[1] + size[1] * size[2] + size[2] * size[0]
}

/// Where the tree's `f32` numbers count from, and by how much they are widened.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// The middle of the bounds of all bodies.
    middle: Vec3,
    half_diagonal: f64,
    margin: f64,
    sieve_margin: f64,
}

impl Place {
    fn of(boxes: &[Aabb]) -> Place {
        let bounds = boxes.iter().fold(Aabb::EMPTY, |all, one| all.union(one));
        let (middle, half_diagonal) = if boxes.is_empty() {
            (Vec3::zeros(), 0.0)
        } else {
            (bounds.centre(), 0.5 * (bounds.max - bounds.min).norm())
        };
        let (margin, sieve_margin) = (MARGIN * half_diagonal, sieve::margin(half_diagonal));
        Place { middle, half_diagonal, margin, sieve_margin }
    }

    #[inline(always)]
    fn widened(&self, bounds: &Aabb) -> Box32 {
        let lower = |axis: usize| (bounds.min[axis] - self.middle[axis] - self.margin) as f32;
        let upper = |axis: usize| (bounds.max[axis] - self.middle[axis] + self.margin) as f32;
        [lower(0), lower(1), lower(2), upper(0), upper(1), upper(2)]
    }
}

/// The tree.
#[derive(Clone, Debug)]
pub(crate) struct Bvh {
    /// Every node stands before its children.
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    place: Place,
    /// [`Bvh::cost`] when the tree was built.
    built_cost: f64,
    body_count: usize,
}

impl Bvh {
    /// The tree over the bodies.
    pub(crate) fn new(bodies: &Bodies) -> Bvh {
        let boxes = bodies.boxes();
        let place = Place::of(&boxes);
        let widened: Vec<_> = boxes.iter().map(|bounds| place.widened(bounds)).collect();
        let (nodes, leaves) = build::build(&widened);
        let mut tree = Bvh { nodes, leaves, place, built_cost: 0.0, body_count: boxes.len() };
        tree.fill(bodies);
        tree.built_cost = tree.cost();
        tree
    }

    /// The tree over the same bodies in other places: the boxes of this tree made anew, or, where they would have grown
    /// too much, another tree. Which of the two is a function of this tree and the places.
    pub(crate) fn moved(mut self, bodies: &Bodies) -> Bvh {
        if self.body_count != bodies.count() as usize {
            return Bvh::new(bodies);
        }
        let boxes = bodies.boxes();
        self.place = Place::of(&boxes);
        self.refit(bodies, &boxes);
        if self.cost() <= COST_GROWTH_MAX * self.built_cost { self } else { Bvh::new(bodies) }
    }

    /// Sieves of all leaves.
    fn fill(&mut self, bodies: &Bodies) {
        for leaf in &mut self.leaves {
            leaf.fill(bodies, &self.place);
        }
    }

    /// Boxes and sieves from the bodies' places, from the leaves to the root.
    fn refit(&mut self, bodies: &Bodies, boxes: &[Aabb]) {
        let mut of_leaves = Vec::with_capacity(self.leaves.len());
        for leaf in &mut self.leaves {
            leaf.fill(bodies, &self.place);
            let here = leaf.bodies.iter().filter(|&&body| body != NONE);
            let widened = here.map(|&body| self.place.widened(&boxes[body as usize]));
            of_leaves.push(widened.fold(EMPTY, |all, one| union(&all, &one)));
        }
        let mut of_nodes = vec![EMPTY; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            let node = &mut self.nodes[index];
            let mut all = EMPTY;
            for lane in 0..WIDTH {
                let child = node.children[lane];
                if child == NONE {
                    continue;
                }
                let bounds = if child & LEAF != 0 {
                    of_leaves[(child & !LEAF) as usize]
                } else {
                    of_nodes[child as usize]
                };
                node.put(lane, child, &bounds);
                all = union(&all, &bounds);
            }
            of_nodes[index] = all;
        }
    }

    /// Areas of all children's boxes, over that of the whole: about how many of them a ray meets.
    fn cost(&self) -> f64 {
        let mut sum = 0.0;
        let mut whole = EMPTY;
        for (index, node) in self.nodes.iter().enumerate() {
            for lane in 0..WIDTH {
                if node.children[lane] == NONE {
                    continue;
                }
                let bounds = core::array::from_fn(|i| node.bounds[i][lane]);
                sum += f64::from(half_area(&bounds));
                if index == 0 {
                    whole = union(&whole, &bounds);
                }
            }
        }
        sum / f64::from(half_area(&whole))
    }

    /// Memory of the tree (bytes).
    pub(crate) fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>() + self.leaves.len() * size_of::<Leaf>()
    }
}

impl Node {
    const EMPTY: Node = Node {
        bounds: [
            [EMPTY[0]; WIDTH],
            [EMPTY[1]; WIDTH],
            [EMPTY[2]; WIDTH],
            [EMPTY[3]; WIDTH],
            [EMPTY[4]; WIDTH],
            [EMPTY[5]; WIDTH],
        ],
        children: [NONE; WIDTH],
    };

    #[inline(always)]
    fn put(&mut self, lane: usize, child: u32, bounds: &Box32) {
        self.children[lane] = child;
        for (row, bound) in self.bounds.iter_mut().zip(bounds) {
            row[lane] = *bound;
        }
    }
}

impl Leaf {
    fn fill(&mut self, bodies: &Bodies, place: &Place) {
        for (lane, &body) in self.bodies.iter().enumerate() {
            if body != NONE {
                self.sieve.put(lane, &bodies.outline(body), &place.middle, place.sieve_margin);
            }
        }
    }
}

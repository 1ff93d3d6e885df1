//! Building a tree: cuts by the surface area heuristic over bins.
//!
//! # Source
//! Wald, "On fast construction of SAH-based bounding volume hierarchies", IEEE Symposium on Interactive Ray Tracing 2007.
//! Deviation: eight children to a node, as the largest child is cut until there are eight; the cost of a part is its area
//! times the leaves that it needs.

use super::{Box32, EMPTY, LEAF, Leaf, NONE, Node, half_area, union};
use crate::sieve::{Sieve, WIDTH};

/// Bins of the search for the best cut.
const BINS: usize = 16;
/// Below this level, ranges are cut by the surface area heuristic; from it on in equal halves, so that the tree has
/// a bounded height, whatever the places.
const HEURISTIC_LEVELS: u32 = 16;
/// An axis along which the bodies' middles spread less than this part of the widest spread is not looked at.
const SPREAD_MIN: f32 = 0.25;

/// A body and its box.
#[derive(Clone, Copy)]
struct Item {
    bounds: Box32,
    body: u32,
}

impl Item {
    /// Twice the middle of the box.
    #[inline(always)]
    fn middle(&self) -> [f32; 3] {
        let b = &self.bounds;
        [b[0] + b[3], b[1] + b[4], b[2] + b[5]]
    }
}

/// Some bodies: a range of the items, and what holds them.
#[derive(Clone, Copy)]
struct Part {
    first: usize,
    count: usize,
    bounds: Box32,
    /// Bounds of the items' middles.
    middles: Box32,
}

/// Nodes and leaves over boxes, without the leaves' sieves.
pub(super) fn build(boxes: &[Box32]) -> (Vec<Node>, Vec<Leaf>) {
    let mut builder =
        Builder { items: Vec::with_capacity(boxes.len()), nodes: Vec::new(), leaves: Vec::new() };
    let mut whole = Part { first: 0, count: boxes.len(), bounds: EMPTY, middles: EMPTY };
    for (body, bounds) in (0..).zip(boxes.iter()) {
        let item = Item { bounds: *bounds, body };
        whole.add(&item);
        builder.items.push(item);
    }
    if !boxes.is_empty() {
        builder.node(&whole, 0);
    }
    (builder.nodes, builder.leaves)
}

impl Part {
    #[inline(always)]
    fn add(&mut self, item: &Item) {
        let [x, y, z] = item.middle();
        self.bounds = union(&self.bounds, &item.bounds);
        self.middles = union(&self.middles, &[x, y, z, x, y, z]);
    }
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Box32,
    count: u32,
}

struct Builder {
    items: Vec<Item>,
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
}

impl Builder {
    /// Builds the node over a part, and returns its number.
    fn node(&mut self, whole: &Part, level: u32) -> u32 {
        let mut parts = [*whole; WIDTH];
        let mut count = 1;
        // Cut the child with the largest area until there are enough children.
        while count < WIDTH {
            let mut largest: Option<(usize, f32)> = None;
            for (child, part) in parts[..count].iter().enumerate().filter(|(_, part)| part.count > WIDTH) {
                let area = half_area(&part.bounds);
                if largest.is_none_or(|(_, most)| area > most) {
                    largest = Some((child, area));
                }
            }
            let Some((child, _)) = largest else { break };
            let (left, right) = self.cut(&parts[child], level);
            parts[child] = left;
            parts[count] = right;
            count += 1;
        }
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        for (lane, part) in parts[..count].iter().enumerate() {
            let child = if part.count <= WIDTH { self.leaf(part) } else { self.node(part, level + 1) };
            self.nodes[index].put(lane, child, &part.bounds);
        }
        index as u32
    }

    fn leaf(&mut self, part: &Part) -> u32 {
        let items = &self.items[part.first..part.first + part.count];
        let bodies = core::array::from_fn(|lane| items.get(lane).map_or(NONE, |item| item.body));
        self.leaves.push(Leaf { sieve: Sieve::NONE, bodies });
        LEAF | (self.leaves.len() - 1) as u32
    }

    /// Orders the items of a part so that a good first part and the rest can be cut apart. Neither is empty.
    ///
    /// The cut has the least sum of area times leaves among the borders of equal bins along each axis; of equal sums the
    /// first is taken. Where no border parts the bodies (all in one place), it halves them.
    fn cut(&mut self, part: &Part, level: u32) -> (Part, Part) {
        let items = &mut self.items[part.first..part.first + part.count];
        let best = if level < HEURISTIC_LEVELS { best_border(items, &part.middles) } else { None };
        let first_count = match best {
            None => items.len() / 2,
            Some((axis, border)) => {
                let binning = Binning::new(&part.middles, axis);
                let (mut low, mut high) = (0, items.len());
                while low < high {
                    if binning.bin(&items[low]) < border {
                        low += 1;
                    } else {
                        high -= 1;
                        items.swap(low, high);
                    }
                }
                low
            }
        };
        let of = |first: usize, items: &[Item]| {
            let mut part = Part { first, count: items.len(), bounds: EMPTY, middles: EMPTY };
            items.iter().for_each(|item| part.add(item));
            part
        };
        let (left, right) = items.split_at(first_count);
        (of(part.first, left), of(part.first + first_count, right))
    }
}

/// Which bin an item's middle lies in along one axis.
struct Binning {
    axis: usize,
    low: f32,
    scale: f32,
}

impl Binning {
    #[inline(always)]
    fn new(middles: &Box32, axis: usize) -> Binning {
        let low = middles[axis];
        Binning { axis, low, scale: BINS as f32 / (middles[axis + 3] - low) }
    }

    #[inline(always)]
    fn bin(&self, item: &Item) -> usize {
        let bin = ((item.bounds[self.axis] + item.bounds[self.axis + 3] - self.low) * self.scale) as i32;
        (bin as usize).min(BINS - 1)
    }
}

/// Axis and border of the best cut; `None` where no border parts the items.
fn best_border(items: &[Item], middles: &Box32) -> Option<(usize, usize)> {
    let spread = |axis: usize| middles[axis + 3] - middles[axis];
    let widest = (0..3).fold(0.0, |most, axis| if spread(axis) > most { spread(axis) } else { most });
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| spread(axis) > 0.0 && spread(axis) >= SPREAD_MIN * widest) {
        let binning = Binning::new(middles, axis);
        let mut bins = [Bin { bounds: EMPTY, count: 0 }; BINS];
        for item in items {
            let bin = &mut bins[binning.bin(item)];
            bin.bounds = union(&bin.bounds, &item.bounds);
            bin.count += 1;
        }
        // Costs of what lies right of each border, then of both sides.
        let mut right_costs = [0.0; BINS];
        let mut all = Bin { bounds: EMPTY, count: 0 };
        for border in (1..BINS).rev() {
            all = all.with(&bins[border]);
            right_costs[border] = all.cost();
        }
        let mut all = Bin { bounds: EMPTY, count: 0 };
        for border in 1..BINS {
            all = all.with(&bins[border - 1]);
            let parts = all.count > 0 && (all.count as usize) < items.len();
            let cost = all.cost() + right_costs[border];
            if parts && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, border));
            }
        }
    }
    best.map(|(_, axis, border)| (axis, border))
}

impl Bin {
    #[inline(always)]
    fn with(&self, other: &Bin) -> Bin {
        Bin { bounds: union(&self.bounds, &other.bounds), count: self.count + other.count }
    }

    fn cost(&self) -> f32 {
        half_area(&self.bounds) * self.count.div_ceil(WIDTH as u32) as f32
    }
}

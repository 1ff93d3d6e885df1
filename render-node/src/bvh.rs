//! A tree of boxes over the bodies, four children to a node, four bodies to a leaf.
//!
//! The tree only culls: its boxes and [sieves](crate::sieve) are in `f32` and wider than the bodies by more than all
//! rounding, and bodies are asked for exact hits. So neither its shape nor the order of traversal changes a bit of a
//! picture.

use crate::lanes::{LANES, Lanes};
use crate::ray::Ray;
use crate::sieve::{self, Outline, Sieve, SievedRay};
use crate::world::{Bodies, Hit, nearer};
use geometry::{Aabb, Vec3};

/// Bins of the search for the best cut.
const BINS: usize = 16;
/// Below this level, ranges are cut by the surface area heuristic; from it on in equal halves, so that the tree has
/// at most 12 + 12 levels for 4^12 bodies, whatever their places.
const HEURISTIC_LEVELS: u32 = 12;
/// Entries that wait while one child is visited: three a level.
const STACK_SIZE: usize = 3 * 26;

/// Widening of a box in parts of D, the half diagonal of all bodies' bounds.
///
/// All places are relative to the middle of the bounds. A probe that meets a body begins at most `sqrt(2) D` from there.
/// With `u = 2^-24`, a bound carries an error of `u D`, the probe's origin of `1.4 u D`, their difference of `2.4 u D`, and
/// the inverse direction and the product add `3 u` of 2.4 D: together 12 u D = 7.3e-7 D.
const MARGIN: f64 = 2e-6;

/// Marks a child that is a leaf; the other bits are its number, or that of a node.
const LEAF: u32 = 1 << 31;

#[derive(Clone, Debug)]
struct Node {
    /// Lower and upper bounds of the children: x, y, z, and the same again.
    bounds: [[f32; LANES]; 6],
    children: [u32; LANES],
}

#[derive(Clone, Debug)]
struct Leaf {
    sieve: Sieve,
    /// Numbers of the bodies.
    bodies: [u32; LANES],
}

/// The tree.
#[derive(Debug)]
pub(crate) struct Bvh {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    /// Boxes and sieves are relative to this point, the middle of the bounds of all bodies.
    middle: Vec3,
    half_diagonal: f64,
    margin: f64,
    sieve_margin: f64,
}

/// A ray, prepared for `f32`; it begins where it comes near the bodies.
struct Probe {
    sieved: SievedRay,
    inverse: [f32; 3],
    /// Which of the bounds is the nearer one, for each axis.
    near: [usize; 3],
    /// Ray parameter of the probe's origin.
    entry: f64,
}

impl Bvh {
    /// The tree over bodies with these boxes and outlines.
    pub(crate) fn new(boxes: &[Aabb], outlines: &[Outline]) -> Bvh {
        let bounds = boxes.iter().fold(Aabb::EMPTY, |all, one| all.union(one));
        let (middle, half_diagonal) = if boxes.is_empty() {
            (Vec3::zeros(), 0.0)
        } else {
            (bounds.centre(), 0.5 * (bounds.max - bounds.min).norm())
        };
        let (margin, sieve_margin) = (MARGIN * half_diagonal, sieve::margin(half_diagonal));
        let mut tree =
            Bvh { nodes: Vec::new(), leaves: Vec::new(), middle, half_diagonal, margin, sieve_margin };
        if !boxes.is_empty() {
            let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
            Builder { boxes, outlines, tree: &mut tree }.build(&mut order, 0);
        }
        tree
    }

    /// The nearest of `best` and the first hits of all bodies.
    pub(crate) fn closest(&self, bodies: &Bodies, ray: &Ray, best: Option<Hit>) -> Option<Hit> {
        let Some(probe) = self.probe(ray) else { return best };
        let limit = |best: &Option<Hit>| best.map_or(f32::MAX, |hit| self.limit(&probe, hit.distance));
        let mut best = best;
        self.traverse(&probe, limit(&best), |body| {
            best = nearer(best, bodies.hit(body, ray), body);
            limit(&best)
        });
        best
    }

    /// Whether any body is hit before a distance.
    pub(crate) fn any(&self, bodies: &Bodies, ray: &Ray, distance: f64) -> bool {
        let Some(probe) = self.probe(ray) else { return false };
        let limit = self.limit(&probe, distance);
        let mut found = false;
        self.traverse(&probe, limit, |body| {
            found = found || bodies.hit(body, ray).is_some_and(|t| t < distance);
            if found { f32::NEG_INFINITY } else { limit }
        });
        found
    }

    /// The ray's probe; `None` if it does not come near the bodies.
    #[inline]
    fn probe(&self, ray: &Ray) -> Option<Probe> {
        // In f64 to where the ray comes within D of its point nearest to the middle: so far from all bodies that none
        // is met before, and so near that f32 can tell them apart.
        let to_middle = self.middle - ray.origin;
        let nearest = to_middle.dot(&ray.direction);
        let passed = nearest < -1.01 * self.half_diagonal;
        // The distance of that point from the middle is wrong by at most 5e-16 of the origin's, e say; and
        // (D + e)^2 is at most 1.01 D^2 + 101 e^2.
        let miss_squared = (ray.direction * nearest - to_middle).norm_squared();
        let reach_squared = 1.01 * self.half_diagonal * self.half_diagonal + 1e-28 * to_middle.norm_squared();
        if passed || miss_squared > reach_squared || self.nodes.is_empty() {
            return None;
        }
        let entry = if nearest > self.half_diagonal { nearest - self.half_diagonal } else { 0.0 };
        let origin = ray.direction * entry - to_middle;
        let single = |v: &Vec3| [v.x as f32, v.y as f32, v.z as f32];
        let direction = single(&ray.direction);
        let inverse = direction.map(|component| 1.0 / component);
        let near = std::array::from_fn(|axis| if inverse[axis] < 0.0 { axis + 3 } else { axis });
        let sieved = SievedRay { origin: single(&origin), direction, margin: self.sieve_margin as f32 };
        Some(Probe { sieved, inverse, near, entry })
    }

    /// A distance along the ray as a limit of boxes: no box that holds a hit up to it begins beyond.
    #[inline]
    fn limit(&self, probe: &Probe, distance: f64) -> f32 {
        let limit = ((distance - probe.entry) * (1.0 + 1e-6) + self.margin) as f32;
        // Finite, so that a child that is missed, with its infinite entry, is always beyond.
        if limit < f32::MAX { limit } else { f32::MAX }
    }

    /// Visits the bodies that the ray may meet before a limit, roughly from near to far. A visit returns the limit from
    /// then on.
    #[inline(always)]
    fn traverse(&self, probe: &Probe, mut limit: f32, mut visit: impl FnMut(u32) -> f32) {
        let mut stack = [(0_u32, 0.0_f32); STACK_SIZE];
        let mut height = 0;
        let mut child = 0;
        loop {
            if child & LEAF == 0 {
                let node = &self.nodes[child as usize];
                let (entries, mut met) = node.entries(probe, limit);
                if met.count_ones() == 1 {
                    child = node.children[met.trailing_zeros() as usize];
                    continue;
                }
                // The children that are met, farthest first.
                let entries = entries.to_array();
                let base = height;
                while met != 0 {
                    let lane = met.trailing_zeros() as usize;
                    met &= met - 1;
                    let entry = entries[lane];
                    let mut place = height;
                    while place > base && stack[place - 1].1 < entry {
                        stack[place] = stack[place - 1];
                        place -= 1;
                    }
                    stack[place] = (node.children[lane], entry);
                    height += 1;
                }
            } else {
                let leaf = &self.leaves[(child & !LEAF) as usize];
                let mut candidates = leaf.sieve.candidates(&probe.sieved, limit);
                while candidates != 0 {
                    limit = visit(leaf.bodies[candidates.trailing_zeros() as usize]);
                    candidates &= candidates - 1;
                }
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                let (waiting, entry) = stack[height];
                if !(entry > limit) {
                    child = waiting;
                    break;
                }
            }
        }
    }
}

impl Node {
    /// Where the ray enters the children, and which of them it meets up to the limit (bit k for child k).
    #[inline(always)]
    fn entries(&self, probe: &Probe, limit: f32) -> (Lanes, u32) {
        let (mut start, mut end) = (Lanes::all(0.0), Lanes::all(limit));
        for axis in 0..3 {
            let near = probe.near[axis];
            let far = if near < 3 { near + 3 } else { near - 3 };
            let (origin, inverse) = (Lanes::all(probe.sieved.origin[axis]), Lanes::all(probe.inverse[axis]));
            // A NaN (origin on a bound, ray along it) sets no bound.
            start = start.or_larger((Lanes::from(self.bounds[near]) - origin) * inverse);
            end = end.or_smaller((Lanes::from(self.bounds[far]) - origin) * inverse);
        }
        (start, !start.larger(end) & ((1 << LANES) - 1))
    }
}

struct Builder<'a> {
    boxes: &'a [Aabb],
    outlines: &'a [Outline],
    tree: &'a mut Bvh,
}

impl Builder<'_> {
    /// Builds the node over a range of bodies, and returns its number.
    fn build(&mut self, order: &mut [u32], level: u32) -> u32 {
        // Cut the child with the largest area until there are enough children.
        let mut cuts = vec![0, order.len()];
        while cuts.len() <= LANES {
            let area = |child: usize| self.bounds(&order[cuts[child]..cuts[child + 1]]).surface_area();
            let cuttable = (0..cuts.len() - 1).filter(|&child| cuts[child + 1] - cuts[child] > LANES);
            let areas = cuttable.map(|child| (child, area(child)));
            let largest = areas.reduce(|best, one| if one.1 > best.1 { one } else { best });
            let Some((child, _)) = largest else { break };
            let left = self.cut(&mut order[cuts[child]..cuts[child + 1]], level);
            cuts.insert(child + 1, cuts[child] + left);
        }
        let index = self.tree.nodes.len();
        self.tree.nodes.push(Node { bounds: EMPTY_BOUNDS, children: [0; LANES] });
        for child in 0..cuts.len() - 1 {
            let range = &mut order[cuts[child]..cuts[child + 1]];
            let bounds = self.bounds(range);
            let reference =
                if range.len() <= LANES { self.leaf(range) } else { self.build(range, level + 1) };
            let node = &mut self.tree.nodes[index];
            node.children[child] = reference;
            for axis in 0..3 {
                let relative = |bound: f64| bound - self.tree.middle[axis];
                node.bounds[axis][child] = (relative(bounds.min[axis]) - self.tree.margin) as f32;
                node.bounds[axis + 3][child] = (relative(bounds.max[axis]) + self.tree.margin) as f32;
            }
        }
        index as u32
    }

    fn leaf(&mut self, range: &[u32]) -> u32 {
        let outlines: Vec<Outline> = range.iter().map(|&body| self.outlines[body as usize]).collect();
        let sieve = Sieve::new(&outlines, &self.tree.middle, self.tree.sieve_margin);
        let bodies = std::array::from_fn(|lane| range.get(lane).copied().unwrap_or(u32::MAX));
        self.tree.leaves.push(Leaf { sieve, bodies });
        LEAF | (self.tree.leaves.len() - 1) as u32
    }

    fn bounds(&self, range: &[u32]) -> Aabb {
        range.iter().fold(Aabb::EMPTY, |all, &body| all.union(&self.boxes[body as usize]))
    }

    /// Orders a range so that a good first part and the rest can be cut apart; returns the length of the first part,
    /// which is neither none nor all.
    ///
    /// The cut has the least sum of area times number of bodies among the borders of equal bins along each axis;
    /// of equal sums the first is taken. Where no border parts the bodies (all in one place), it halves them.
    fn cut(&self, range: &mut [u32], level: u32) -> usize {
        let half = range.len() / 2;
        if level >= HEURISTIC_LEVELS {
            return half;
        }
        let centre = |body: u32| self.boxes[body as usize].centre();
        let (mut low, mut high) = (centre(range[0]), centre(range[0]));
        for &body in &*range {
            low = low.zip_map(&centre(body), |a, b| if b < a { b } else { a });
            high = high.zip_map(&centre(body), |a, b| if b > a { b } else { a });
        }
        let bin = |axis: usize, body: u32| {
            let share = (centre(body)[axis] - low[axis]) / (high[axis] - low[axis]);
            ((share * BINS as f64) as usize).min(BINS - 1)
        };
        let mut best: Option<(f64, usize, usize)> = None;
        for axis in (0..3).filter(|&axis| high[axis] > low[axis]) {
            let mut bins = [(Aabb::EMPTY, 0_usize); BINS];
            for &body in &*range {
                let (bounds, count) = &mut bins[bin(axis, body)];
                *bounds = bounds.union(&self.boxes[body as usize]);
                *count += 1;
            }
            for (border, cost) in costs(&bins) {
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, border));
                }
            }
        }
        let Some((_, axis, border)) = best else { return half };
        let (left, right): (Vec<u32>, Vec<u32>) = range.iter().partition(|&&body| bin(axis, body) < border);
        let count = left.len();
        range[..count].copy_from_slice(&left);
        range[count..].copy_from_slice(&right);
        count
    }
}

/// Borders between bins with bodies on both sides, and the sums of area times number of bodies there.
fn costs(bins: &[(Aabb, usize); BINS]) -> impl Iterator<Item = (usize, f64)> {
    let weight = |bins: &mut dyn Iterator<Item = &(Aabb, usize)>| {
        let (bounds, count) = bins.fold((Aabb::EMPTY, 0), |all, one| (all.0.union(&one.0), all.1 + one.1));
        (bounds.surface_area() * count as f64, count)
    };
    let both = (1..BINS)
        .map(move |border| (border, weight(&mut bins[..border].iter()), weight(&mut bins[border..].iter())));
    both.filter(|(_, left, right)| left.1 > 0 && right.1 > 0)
        .map(|(border, left, right)| (border, left.0 + right.0))
}

/// Bounds that no ray runs through.
const EMPTY_BOUNDS: [[f32; LANES]; 6] = {
    let (low, high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    [low, low, low, high, high, high]
};

//! Layered range tree: which of a set of points lie in a box.
//!
//! A tree over the points in order of their first coordinate; each of its nodes holds a tree over the same
//! points in order of the second; each node of that holds the same points in order of the third. A box is
//! cut into nodes that lie wholly inside its first two ranges, and in those the third range is one slice.
//!
//! The one thing to know: nothing is searched twice. The places of the box's ends in the second and third
//! order are found once, for all points; from a node to its children they follow by *fractional cascading*:
//! beside each entry stands how many entries before it go to the left child. All trees are implicit (a node
//! is a range of places that is halved) and lie in a few flat arrays that are used again by the next build.
//!
//! # Cost
//! With `n` points: `O(n log^2 n)` memory and time to build, `O(log^2 n + k)` for a query that finds `k`.
//! Nodes of few points have no tree below them and are looked through instead.
//!
//! # Source
//! Bentley, *CACM* 23 (1980); Lueker (1978) and Willard (1985) for the layers; de Berg, Cheong, van Kreveld
//! and Overmars, *Computational Geometry*, chapter 5. Deviations: places instead of coordinates below the
//! root, so that ties need no care; cascading down the first tree too, for both other coordinates; a node
//! in which one range holds a handful of points is not taken apart further.

use geometry::Vec3;

/// Points in a leaf of the first tree: they are looked through.
const LEAF: usize = 32;
/// Points in a leaf of the second trees.
const INNER_LEAF: usize = 16;
/// So many points in one range of a node are looked through at once.
const FEW: u32 = 24;

/// A set of points, made to answer which of them lie in a box. How it works stands at the top of this file.
#[derive(Debug, Default)]
pub struct RangeTree {
    /// World axes in the order in which the tree takes them: the widest spread first.
    axes: [usize; 3],
    /// The points' coordinates along those axes, and their numbers, by *rank*: place in the first order.
    points: Vec<[f64; 3]>,
    numbers: Vec<u32>,
    /// The three coordinates, each in its own order.
    sorted: [Vec<f64>; 3],
    /// Levels of the first tree below its root; all its leaves lie on the last.
    height: u32,
    /// For each level, ranks in the second order within each node.
    seconds: Vec<u32>,
    /// For each level, how many before a place go to the left child: in the second and in the third order.
    second_left: Vec<u32>,
    third_left: Vec<u32>,
    /// The second tree of each node above the leaves; the root's children are 1 and 2, and so on.
    nodes: Vec<Node>,
    /// For each second tree, level by level: ranks in the third order within each of its nodes.
    thirds: Vec<u32>,
    /// The same cascade for them.
    inner_left: Vec<u32>,
    build: Build,
}

/// Where a second tree lies.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    thirds: u32,
    left: u32,
}

/// Memory of the build.
#[derive(Debug, Default)]
struct Build {
    order: Vec<(u64, u32)>,
    third: Vec<u32>,
    next: Vec<u32>,
    place: Vec<u32>,
}

/// A node while a query goes down: its number, its places, and where the box's ranges lie in it.
#[derive(Clone, Copy)]
struct At {
    level: u32,
    index: usize,
    start: usize,
    end: usize,
    second: (u32, u32),
    third: (u32, u32),
}

/// A box, in the tree's order of axes, and its range of ranks.
struct Query {
    low: [f64; 3],
    high: [f64; 3],
    ranks: (usize, usize),
}

impl RangeTree {
    /// An empty set.
    pub fn new() -> RangeTree {
        RangeTree::default()
    }

    /// Takes other points, numbered from 0; a point that is not finite is in no box.
    ///
    /// # Panics
    /// If there are more than 2^31 points.
    pub fn build(&mut self, points: &[Vec3]) {
        let finite = |&number: &u32| points[number as usize].iter().all(|value| value.is_finite());
        let numbers: Vec<u32> = (0..points.len() as u32).filter(finite).collect();
        self.build_from(points, &numbers);
    }

    /// The same for some of the points, all of them finite, under their own numbers.
    pub(super) fn build_from(&mut self, points: &[Vec3], numbers: &[u32]) {
        assert!(numbers.len() <= 1 << 31, "{} points", numbers.len());
        self.axes = axes_by_spread(points, numbers);
        self.sort_points(points, numbers);
        let count = numbers.len();
        self.height = height(count, LEAF);
        let (height, levels) = (self.height as usize, self.height as usize + 1);
        self.seconds.resize(levels * count, 0);
        self.second_left.clear();
        self.second_left.resize(cascade(count, height), 0);
        self.third_left.clear();
        self.third_left.resize(cascade(count, height), 0);
        self.nodes.clear();
        self.thirds.clear();
        self.inner_left.clear();
        for level in 0..height {
            let (done, open) = self.seconds.split_at_mut((level + 1) * count);
            let (second, below) = (&done[level * count..], &mut open[..count]);
            self.build.next.resize(count, 0);
            let mut start = 0;
            for index in 0..1_usize << level {
                // The places of a node follow from its number alone.
                let end = node_end(count, level, index);
                let middle = (start + end) / 2;
                self.nodes
                    .push(Node { thirds: self.thirds.len() as u32, left: self.inner_left.len() as u32 });
                let nodes = (&second[start..end], &self.build.third[start..end]);
                layer(nodes, &mut self.build.place, &mut self.thirds, &mut self.inner_left);
                let at = cascade(count, level) + start + index;
                let goes_left = |rank: u32| (rank as usize) < middle;
                let half = middle - start;
                split(nodes.0, half, goes_left, &mut below[start..end], &mut self.second_left[at..]);
                let next = &mut self.build.next[start..end];
                split(nodes.1, half, goes_left, next, &mut self.third_left[at..]);
                start = end;
            }
            std::mem::swap(&mut self.build.third, &mut self.build.next);
        }
        assert!(self.thirds.len() <= u32::MAX as usize, "{count} points");
    }

    fn sort_points(&mut self, points: &[Vec3], numbers: &[u32]) {
        let count = numbers.len();
        let Build { order, third, .. } = &mut self.build;
        let [first_axis, ..] = self.axes;
        let mut sort = |coordinate: &dyn Fn(usize) -> f64| {
            order.clear();
            order.extend((0..count).map(|place| (ordered_bits(coordinate(place)), place as u32)));
            order.sort_unstable();
            order.iter().map(|&(_, place)| place).collect::<Vec<_>>()
        };
        let by_first = sort(&|place| points[numbers[place] as usize][first_axis]);
        self.numbers.clear();
        self.numbers.extend(by_first.iter().map(|&place| numbers[place as usize]));
        let axes = self.axes;
        self.points.clear();
        self.points
            .extend(self.numbers.iter().map(|&number| axes.map(|axis| points[number as usize][axis] + 0.0)));
        let ranked = &self.points;
        let by_second = sort(&|rank| ranked[rank][1]);
        let by_third = sort(&|rank| ranked[rank][2]);
        for (axis, by) in [None, Some(&by_second), Some(&by_third)].into_iter().enumerate() {
            self.sorted[axis].clear();
            let ranked = &self.points;
            match by {
                None => self.sorted[axis].extend(ranked.iter().map(|point| point[axis])),
                Some(by) => self.sorted[axis].extend(by.iter().map(|&rank| ranked[rank as usize][axis])),
            }
        }
        self.seconds.clear();
        self.seconds.extend_from_slice(&by_second);
        *third = by_third;
    }

    /// Appends the numbers of all points with `low <= p <= high` in each coordinate, in an order that the
    /// points and the box determine.
    pub fn query(&self, low: [f64; 3], high: [f64; 3], found: &mut Vec<u32>) {
        let [first, ..] = self.axes;
        let ranks = self.places(0, low[first], high[first]);
        self.query_ranks(low, high, ranks, found);
    }

    /// The same among the points after a rank, and up to the upper bound on the first axis.
    pub(super) fn query_after(&self, rank: usize, low: [f64; 3], high: [f64; 3], found: &mut Vec<u32>) {
        let [first, ..] = self.axes;
        let rest = &self.sorted[0][rank + 1..];
        let end = rank + 1 + rest.partition_point(|&value| value <= high[first]);
        self.query_ranks(low, high, (rank as u32 + 1, end as u32), found);
    }

    /// Points in the set.
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Whether the set is empty.
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// The number of the point with a rank.
    pub(super) fn number(&self, rank: usize) -> u32 {
        self.numbers[rank]
    }

    /// Memory that the tree holds, in bytes, with that of its build.
    pub fn memory_bytes(&self) -> usize {
        let of_u32 = [&self.numbers, &self.seconds, &self.second_left, &self.third_left, &self.thirds]
            .into_iter()
            .chain([&self.inner_left, &self.build.third, &self.build.next])
            .chain([&self.build.place])
            .map(|values| 4 * values.capacity());
        let of_f64 = self.sorted.iter().map(|values| 8 * values.capacity());
        of_u32.chain(of_f64).sum::<usize>()
            + 24 * self.points.capacity()
            + 8 * self.nodes.capacity()
            + 16 * self.build.order.capacity()
    }

    /// The places of the values from `low` to `high` in one order.
    fn places(&self, axis: usize, low: f64, high: f64) -> (u32, u32) {
        let sorted = &self.sorted[axis];
        let start = sorted.partition_point(|&value| value < low);
        let end = start + sorted[start..].partition_point(|&value| value <= high);
        (start as u32, end as u32)
    }

    fn query_ranks(&self, low: [f64; 3], high: [f64; 3], ranks: (u32, u32), found: &mut Vec<u32>) {
        let (low, high) = (self.axes.map(|axis| low[axis]), self.axes.map(|axis| high[axis]));
        if ranks.0 >= ranks.1 {
            return;
        }
        let second = self.places(1, low[1], high[1]);
        let third = self.places(2, low[2], high[2]);
        let query = Query { low, high, ranks: (ranks.0 as usize, ranks.1 as usize) };
        let root = At { level: 0, index: 0, start: 0, end: self.numbers.len(), second, third };
        self.descend(&query, &root, found);
    }

    /// All points of a node that meets the range of ranks.
    fn descend(&self, query: &Query, at: &At, found: &mut Vec<u32>) {
        let &At { level, index, start, end, second, third } = at;
        if second.0 >= second.1 || third.0 >= third.1 {
            return;
        }
        let count = self.numbers.len();
        if second.1 - second.0 <= FEW {
            let base = level as usize * count + start;
            for &rank in &self.seconds[base + second.0 as usize..base + second.1 as usize] {
                self.test(query, rank as usize, found);
            }
            return;
        }
        let (first, last) = query.ranks;
        if level == self.height {
            let from = if first > start { first } else { start };
            let to = if last < end { last } else { end };
            (from..to).for_each(|rank| self.test(query, rank, found));
            return;
        }
        if first <= start && end <= last {
            let node = self.nodes[(1 << level) - 1 + index];
            let inner = Inner {
                thirds: &self.thirds[node.thirds as usize..],
                left: &self.inner_left[node.left as usize..],
                count: end - start,
                height: height(end - start, INNER_LEAF),
                second,
            };
            let root = At { level: 0, index: 0, start: 0, end: end - start, second, third };
            self.descend_inner(query, &inner, &root, found);
            return;
        }
        let middle = (start + end) / 2;
        let base = cascade(count, level as usize) + start + index;
        let follow = |left: &[u32], (from, to): (u32, u32)| {
            let (a, b) = (left[base + from as usize], left[base + to as usize]);
            ((a, b), (from - a, to - b))
        };
        let (second_left, second_right) = follow(&self.second_left, second);
        let (third_left, third_right) = follow(&self.third_left, third);
        let level = level + 1;
        if first < middle {
            let left =
                At { level, index: 2 * index, start, end: middle, second: second_left, third: third_left };
            self.descend(query, &left, found);
        }
        if last > middle {
            let (second, third) = (second_right, third_right);
            let right = At { level, index: 2 * index + 1, start: middle, end, second, third };
            self.descend(query, &right, found);
        }
    }

    /// All points of a second tree's node; its places are those of the second order.
    fn descend_inner(&self, query: &Query, inner: &Inner, at: &At, found: &mut Vec<u32>) {
        let &At { level, index, start, end, third, .. } = at;
        let (first, last) = (inner.second.0 as usize, inner.second.1 as usize);
        if third.0 >= third.1 {
            return;
        }
        let base = level as usize * inner.count + start;
        let slice = &inner.thirds[base + third.0 as usize..base + third.1 as usize];
        if first <= start && end <= last {
            found.extend(slice.iter().map(|&rank| self.numbers[rank as usize]));
            return;
        }
        if level == inner.height || slice.len() <= FEW as usize {
            slice.iter().for_each(|&rank| self.test(query, rank as usize, found));
            return;
        }
        let middle = (start + end) / 2;
        let base = cascade(inner.count, level as usize) + start + index;
        let (a, b) = (inner.left[base + third.0 as usize], inner.left[base + third.1 as usize]);
        let level = level + 1;
        if first < middle {
            let left = At { level, index: 2 * index, end: middle, third: (a, b), ..*at };
            self.descend_inner(query, inner, &left, found);
        }
        if last > middle {
            let third = (third.0 - a, third.1 - b);
            let right = At { level, index: 2 * index + 1, start: middle, third, ..*at };
            self.descend_inner(query, inner, &right, found);
        }
    }

    #[inline]
    fn test(&self, query: &Query, rank: usize, found: &mut Vec<u32>) {
        let point = &self.points[rank];
        let inside = |axis: usize| (query.low[axis] <= point[axis]) & (point[axis] <= query.high[axis]);
        let (first, last) = query.ranks;
        if (first <= rank) & (rank < last) & inside(1) & inside(2) {
            found.push(self.numbers[rank]);
        }
    }
}

/// A second tree, and the places of the box in the second order of its points.
struct Inner<'a> {
    thirds: &'a [u32],
    left: &'a [u32],
    count: usize,
    height: u32,
    second: (u32, u32),
}

/// Appends the second tree over points given in second and third order.
fn layer(
    (second, third): (&[u32], &[u32]),
    place: &mut Vec<u32>,
    thirds: &mut Vec<u32>,
    left: &mut Vec<u32>,
) {
    let count = second.len();
    let height = height(count, INNER_LEAF) as usize;
    let (thirds_base, left_base) = (thirds.len(), left.len());
    thirds.extend_from_slice(third);
    thirds.resize(thirds_base + (height + 1) * count, 0);
    left.resize(left_base + cascade(count, height), 0);
    let lowest = second.iter().fold(u32::MAX, |lowest, &rank| if rank < lowest { rank } else { lowest });
    // The ranks of a node of the first tree follow each other: their places fit an array of its size.
    place.resize(count, 0);
    for (at, &rank) in second.iter().enumerate() {
        place[(rank - lowest) as usize] = at as u32;
    }
    for level in 0..height {
        let (done, below) = thirds[thirds_base..].split_at_mut((level + 1) * count);
        let here = &done[level * count..];
        let mut start = 0;
        for index in 0..1_usize << level {
            let end = node_end(count, level, index);
            let middle = (start + end) / 2;
            let at = left_base + cascade(count, level) + start + index;
            let goes_left = |rank: u32| (place[(rank - lowest) as usize] as usize) < middle;
            split(&here[start..end], middle - start, goes_left, &mut below[start..end], &mut left[at..]);
            start = end;
        }
    }
}

/// Deals entries out to two children, each in the old order, and counts before each place, and after the
/// last, how many went to the left one.
#[inline]
fn split(entries: &[u32], half: usize, goes_left: impl Fn(u32) -> bool, below: &mut [u32], left: &mut [u32]) {
    let below = &mut below[..entries.len()];
    let counts = &mut left[..entries.len() + 1];
    let (mut to_left, mut to_right) = (0, half);
    for (place, &entry) in entries.iter().enumerate() {
        counts[place] = to_left as u32;
        let goes = goes_left(entry);
        below[if goes { to_left } else { to_right }] = entry;
        to_left += usize::from(goes);
        to_right += usize::from(!goes);
    }
    counts[entries.len()] = to_left as u32;
}

/// Where a node ends: each node is halved, the left half takes the smaller part.
fn node_end(count: usize, level: usize, index: usize) -> usize {
    let (mut start, mut end) = (0, count);
    for bit in (0..level).rev() {
        let middle = (start + end) / 2;
        if index >> bit & 1 == 0 { end = middle } else { start = middle }
    }
    end
}

/// Numbers before a level of a cascade: each level has one for each point, and one more for each node.
fn cascade(count: usize, level: usize) -> usize {
    level * count + (1 << level) - 1
}

/// How often a range is halved until no part has more than `leaf` points.
fn height(count: usize, leaf: usize) -> u32 {
    let mut height = 0;
    while count.div_ceil(1 << height) > leaf {
        height += 1;
    }
    height
}

/// A number that is ordered as the value is; both zeros are one.
fn ordered_bits(value: f64) -> u64 {
    let bits = (value + 0.0).to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

fn axes_by_spread(points: &[Vec3], numbers: &[u32]) -> [usize; 3] {
    let mut spread = [0.0, 1.0, 2.0].map(|axis| (0.0_f64, axis as usize));
    for (value, axis) in &mut spread {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &number in numbers {
            let coordinate = points[number as usize][*axis];
            if coordinate < low {
                low = coordinate;
            }
            if coordinate > high {
                high = coordinate;
            }
        }
        *value = high - low;
    }
    spread.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    spread.map(|(_, axis)| axis)
}

//! Bodies of one size at a time: the grid and the range tree look for points within one distance, which a
//! ball among small rings would stretch for all.
//!
//! Bodies are dealt out by size, a factor of two to a *level*. Each level finds its own near pairs with the
//! reach of its largest body; each body of the wider levels asks it once for what lies around.

use super::grid::Grid;
use super::pairs::{Bodies, Found, Method, Workspace, widened};
use super::range_tree::RangeTree;

/// The bodies of each level, widest first.
#[derive(Debug, Default)]
pub(super) struct Levels {
    /// Level and number of each body, in order.
    members: Vec<(u32, u32)>,
    numbers: Vec<u32>,
    around: Vec<u32>,
}

/// What is kept of one level to answer questions.
enum Index<'a> {
    Grid(&'a mut Grid),
    Tree(&'a mut RangeTree),
}

pub(super) fn gather(method: Method, bodies: &Bodies, workspace: &mut Workspace, found: &mut Found) {
    let Workspace { grid, tree, levels, numbers, .. } = workspace;
    let mut largest = 0.0;
    for &number in numbers.iter() {
        let radius = bodies.radii[number as usize];
        largest = if radius > largest { radius } else { largest };
    }
    let level = |number: u32| {
        let ratio: f64 = largest / bodies.radii[number as usize];
        // The exponent of the ratio: its logarithm to base 2, rounded down.
        (ratio.to_bits() >> 52) as u32
    };
    let Levels { members, numbers: sorted, around } = levels;
    members.clear();
    members.extend(numbers.iter().map(|&number| (level(number), number)));
    if members.windows(2).any(|pair| pair[0].0 > pair[1].0) {
        members.sort_unstable();
    }
    sorted.clear();
    sorted.extend(members.iter().map(|&(_, number)| number));
    let mut start = 0;
    while start < members.len() {
        let level = members[start].0;
        let end = start + members[start..].partition_point(|member| member.0 == level);
        let (wider, own) = (&sorted[..start], &sorted[start..end]);
        let mut radius = 0.0;
        for &number in own {
            let other = bodies.radii[number as usize];
            radius = if other > radius { other } else { radius };
        }
        let reach = widened(2.0 * radius + bodies.skin);
        let index = if method == Method::Grid && grid.build(bodies, own, reach) {
            Index::Grid(grid)
        } else {
            tree.build_from(bodies.centres, own);
            Index::Tree(tree)
        };
        index.own_pairs(bodies, reach, around, found);
        for &number in wider {
            let reach = widened(bodies.radii[number as usize] + radius + bodies.skin);
            let centre = &bodies.centres[number as usize];
            let (low, high) = (centre.add_scalar(-reach).into(), centre.add_scalar(reach).into());
            around.clear();
            match &index {
                Index::Grid(grid) => grid.query(low, high, around),
                Index::Tree(tree) => tree.query(low, high, around),
            }
            around.iter().for_each(|&other| found.offer(bodies, number, other));
        }
        start = end;
    }
}

impl Index<'_> {
    fn own_pairs(&self, bodies: &Bodies, reach: f64, around: &mut Vec<u32>, found: &mut Found) {
        match self {
            Index::Grid(grid) => grid.pairs(bodies.skin, found),
            Index::Tree(tree) => {
                for rank in 0..tree.len() {
                    let number = tree.number(rank);
                    let centre = &bodies.centres[number as usize];
                    let (low, high) = (centre.add_scalar(-reach).into(), centre.add_scalar(reach).into());
                    around.clear();
                    // Pairs are found from their first body in the tree's order.
                    tree.query_after(rank, low, high, around);
                    around.iter().for_each(|&other| found.offer(bodies, number, other));
                }
            }
        }
    }
}

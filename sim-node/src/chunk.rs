//! Pairs that one thread takes at a time, and what they do to each other.
//!
//! The one thing to know: a chunk reads what all share and writes only its own, so chunks can be done in any order.

use crate::Model;
use crate::broad::CloseList;
use crate::contact::PairForce;
use crate::contact::kernel::{RingChunk, RingScene};
use crate::contact::surface::Workspace;
use crate::narrow::Narrow;
use geometry::lanes::{Level, arcs_on};
use schemas::step::SurfaceSamples;

/// Pairs in a chunk, at least and at most. Part of nothing, as all of these: any values give the same bits.
const CHUNK_PAIRS: [usize; 2] = [512, 4096];
/// The work of an arc over that of a pair that is on the list only.
const ARC_WORK: usize = 10;

/// The results of some pairs.
#[derive(Debug, Default)]
pub(crate) struct Chunk {
    /// Which pairs of rings are close, and the kernel's arcs and forces of them.
    close: CloseList,
    pub rings: RingChunk,
    /// One pair at a time: those that the kernel left, or all.
    pub forces: Vec<PairForce>,
    pub workspace: Workspace,
    /// The least and the greatest number of a body or plane of its pairs.
    pub bodies: [u32; 2],
    /// Of the list with this number: the pairs whose arcs are searched in lanes, and the others.
    list: u64,
    searched: Vec<(u32, u32)>,
    rest: Vec<(u32, u32)>,
}

impl Chunk {
    /// Pairs that are the kernel's.
    pub(crate) fn rings<const DAMPED: bool, const FRICTION: bool>(
        &mut self,
        level: Level,
        rings: RingScene,
        scene: &Narrow,
        (list, pairs): (u64, &[(u32, u32)]),
    ) {
        self.is_new(list, pairs);
        let (chunk, close) = (&mut self.rings, &mut self.close);
        close.update(level, rings.lines, list, pairs, rings.close_margin);
        chunk.collide::<DAMPED>(level, rings, &close.pairs);
        self.forces.clear();
        for &number in &self.rings.search.irregular {
            let pair = self.close.pairs[number as usize];
            scene.pair::<DAMPED, FRICTION>(pair, None, &mut self.workspace, &mut self.forces);
        }
    }

    /// Takes note of a list of pairs; whether it is a new one.
    fn is_new(&mut self, list: u64, pairs: &[(u32, u32)]) -> bool {
        if self.list == list {
            return false;
        }
        self.list = list;
        self.bodies = [u32::MAX, 0];
        for body in pairs.iter().flat_map(|&(a, b)| [a, b]) {
            let [least, greatest] = self.bodies;
            self.bodies =
                [if body < least { body } else { least }, if body > greatest { body } else { greatest }];
        }
        true
    }

    /// Pairs that are not. Where two rings touch is found in lanes all the same; what they do to each other is not.
    pub(crate) fn others<const DAMPED: bool, const FRICTION: bool>(
        &mut self,
        level: Level,
        rings: RingScene,
        scene: &Narrow,
        (list, pairs): (u64, &[(u32, u32)]),
    ) {
        self.rings.forces.clear();
        self.forces.clear();
        self.workspace.counts = SurfaceSamples::default();
        if self.is_new(list, pairs) {
            let searched = |&pair: &(u32, u32)| is_searched(scene.model, pair);
            (self.searched, self.rest) = pairs.iter().partition(|&pair| searched(pair));
        }
        let circles = &scene.moment.circles;
        let (close, search) = (&mut self.close, &mut self.rings.search);
        close.update(level, rings.lines, list, &self.searched, rings.close_margin);
        search.find(level, rings.lines, &close.pairs);
        // Both lists are in order, and so is what comes out.
        let mut rest = self.rest.iter().filter(|&&(a, b)| scene.model.near(circles, a, b)).peekable();
        for (number, arcs) in search.touching() {
            let pair = close.pairs[number];
            while let Some(&before) = rest.next_if(|&&before| before < pair) {
                scene.pair::<DAMPED, FRICTION>(before, None, &mut self.workspace, &mut self.forces);
            }
            let found = arcs_on(&circles[pair.0 as usize], &circles[pair.1 as usize], arcs);
            let arcs = (!arcs.is_empty()).then_some(&found);
            scene.pair::<DAMPED, FRICTION>(pair, arcs, &mut self.workspace, &mut self.forces);
        }
        for &pair in rest {
            scene.pair::<DAMPED, FRICTION>(pair, None, &mut self.workspace, &mut self.forces);
        }
    }
}

/// Whether the lanes search a pair's arcs: that of two rings whose wires together are thinner than B's major radius.
pub(crate) fn is_searched(model: &Model, (a, b): (u32, u32)) -> bool {
    let rings = &model.bodies()[..model.ring_count()];
    match (rings.get(a as usize), rings.get(b as usize)) {
        (Some(a), Some(b)) => a.minor_radius + b.minor_radius < b.major_radius,
        _ => false,
    }
}

/// Where a list of pairs is cut into chunks of about the same work: the places of their ends. `arcs` is how many contacts
/// each body was the first of when it was last looked; the ring chunks of a thread have as much to do as another's.
pub(crate) fn cut(pairs: &[(u32, u32)], arcs: &[u32], chunks: usize) -> Vec<usize> {
    let [least, most] = CHUNK_PAIRS;
    let chunks = chunks.min(pairs.len().div_ceil(least)).max(pairs.len().div_ceil(most));
    let mut before = u32::MAX;
    let mut done = 0;
    // The work up to each pair and with it.
    let work: Vec<usize> = pairs
        .iter()
        .map(|&(a, _)| {
            done += 1 + if a == before { 0 } else { ARC_WORK * arcs[a as usize] as usize };
            before = a;
            done
        })
        .collect();
    (1..=chunks).map(|chunk| work.partition_point(|&work| work * chunks <= done * chunk)).collect()
}

/// A chunk's part of a list of pairs.
pub(crate) fn part<'a>(pairs: &'a [(u32, u32)], ends: &[usize], number: usize) -> &'a [(u32, u32)] {
    &pairs[if number > 0 { ends[number - 1] } else { 0 }..ends[number]]
}

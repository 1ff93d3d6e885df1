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

/// Pairs in a chunk, at least and at most, and chunks for each thread. Part of nothing: any value gives the same bits.
const CHUNK_PAIRS: [usize; 2] = [512, 4096];
const CHUNKS_PER_THREAD: usize = 4;

/// The results of some pairs.
#[derive(Debug, Default)]
pub(crate) struct Chunk {
    /// Which pairs of rings are close, and the kernel's arcs and forces of them.
    close: CloseList,
    pub rings: RingChunk,
    /// One pair at a time: those that the kernel left, or all.
    pub forces: Vec<PairForce>,
    pub workspace: Workspace,
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
        let (chunk, close) = (&mut self.rings, &mut self.close);
        close.update(level, rings.lines, list, pairs, rings.close_margin);
        chunk.collide::<DAMPED>(level, rings, &close.pairs);
        self.forces.clear();
        for &number in &self.rings.search.irregular {
            let pair = self.close.pairs[number as usize];
            scene.pair::<DAMPED, FRICTION>(pair, None, &mut self.workspace, &mut self.forces);
        }
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
        if self.list != list {
            self.list = list;
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

/// How many pairs a chunk has: the same as long as the lists and the threads are.
pub(crate) fn chunk_pairs(pairs: usize, threads: usize) -> usize {
    let [least, most] = CHUNK_PAIRS;
    if threads == 1 {
        return most;
    }
    pairs.div_ceil(threads * CHUNKS_PER_THREAD).clamp(least, most)
}

/// A chunk's part of a list of pairs.
pub(crate) fn part(pairs: &[(u32, u32)], size: usize, number: usize) -> &[(u32, u32)] {
    let end = (number + 1) * size;
    &pairs[number * size..if end < pairs.len() { end } else { pairs.len() }]
}

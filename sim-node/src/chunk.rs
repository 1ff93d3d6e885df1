//! Pairs that one thread takes at a time, and what they do to each other.
//!
//! The one thing to know: a chunk reads what all share and writes only its own, so chunks can be done in any order.

use crate::broad::CloseList;
use crate::contact::PairForce;
use crate::contact::kernel::{RingChunk, RingScene};
use crate::contact::surface::Workspace;
use crate::narrow::Narrow;
use geometry::lanes::Level;
use schemas::step::SurfaceSamples;

/// Pairs in a chunk, at least and at most, and chunks for each thread. Part of nothing: any value gives the same bits.
const CHUNK_PAIRS: [usize; 2] = [512, 4096];
const CHUNKS_PER_THREAD: usize = 4;

/// The results of some pairs.
#[derive(Debug, Default)]
pub(crate) struct Chunk {
    /// Which pairs are close, and the kernel's results, if these are pairs of rings for it.
    close: CloseList,
    pub rings: RingChunk,
    /// One pair at a time: those that the kernel left, or all.
    pub forces: Vec<PairForce>,
    pub workspace: Workspace,
}

impl Chunk {
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
            let (a, b) = self.close.pairs[number as usize];
            scene.pair::<DAMPED, FRICTION>(a, b, &mut self.workspace, &mut self.forces);
        }
    }

    pub(crate) fn others<const DAMPED: bool, const FRICTION: bool>(
        &mut self,
        scene: &Narrow,
        pairs: &[(u32, u32)],
    ) {
        self.rings.forces.clear();
        self.forces.clear();
        self.workspace.counts = SurfaceSamples::default();
        for &(a, b) in pairs {
            if scene.model.near(&scene.moment.circles, a, b) {
                scene.pair::<DAMPED, FRICTION>(a, b, &mut self.workspace, &mut self.forces);
            }
        }
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

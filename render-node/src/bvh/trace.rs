//! Many rays through the tree at once.
//!
//! The one thing to know: rays walk through the tree as lists. A node deals its list out to the lists of its children, a
//! leaf to the rings that may be met; what may be met waits until there are as many pairs of ray and ring as the
//! processor works on at once. So no step waits for the outcome of a comparison, and vector lanes are full.
//!
//! What is found is the nearest of all hits, each a function of one ray and one body alone; lists, their order and what
//! waits decide only how soon a ray learns that it need not look farther.

use super::probe::Probe;
use super::{Bvh, LEAF, Leaf, Node};
use crate::ray::Ray;
use crate::sieve::{WIDTH, or_larger, or_smaller};
use crate::world::{Bodies, Hit};
use fearless_simd::{f32x8, u32x8};
use geometry::lanes::{LANES, Level, RaysAndTori, Simd, SimdBase, SimdMask, dispatch};

/// A list that is thrown away: that of the children that are not there.
const NOWHERE: u32 = WIDTH as u32;

/// What is known of a ray's first hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// Its distance: that of the nearest hit so far. Where it is asked whether anything is met before a distance, that
    /// distance.
    pub distance: f64,
    /// The surface that is met, or any number once it is known that something is; [`Reach::NOTHING`] for none.
    pub surface: u32,
    /// Ray parameter of the probe's origin.
    pub(super) entry: f64,
}

impl Reach {
    /// Nothing is met.
    pub(crate) const NOTHING: u32 = u32::MAX;

    /// The nearest hit is asked for, and this one is known; [`Reach::NOTHING`] at infinity for none.
    #[inline(always)]
    pub(crate) fn at(distance: f64, surface: u32) -> Reach {
        Reach { distance, surface, entry: 0.0 }
    }

    /// It is asked whether anything is met before a distance, and may be known already.
    #[inline(always)]
    pub(crate) fn before(distance: f64, known: bool) -> Reach {
        Reach { distance, surface: if known { 0 } else { Reach::NOTHING }, entry: 0.0 }
    }

    /// The hit, if there is one.
    pub(crate) fn hit(&self) -> Option<Hit> {
        (self.surface != Reach::NOTHING).then_some(Hit { distance: self.distance, surface: self.surface })
    }
}

/// A ray in a list, and where it enters the list's box.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    ray: u32,
    start: f32,
}

/// A list that waits for its node or leaf.
#[derive(Clone, Copy, Debug)]
struct Visit {
    child: u32,
    first: usize,
    count: usize,
    /// What lies beyond in the memory of lists is free when this one is taken up.
    top: usize,
}

/// A ray that may meet a ring.
#[derive(Clone, Copy, Debug, Default)]
struct Candidate {
    ray: u32,
    body: u32,
}

/// Memory for tracing many rays; what is in it between two calls means nothing.
#[derive(Debug)]
pub struct Tracer {
    /// The instruction set.
    pub(crate) level: Level,
    /// Kept for who traces.
    pub(crate) reaches: Vec<Reach>,
    probes: Vec<Probe>,
    lists: Vec<Entry>,
    visits: Vec<Visit>,
    alive: Vec<u32>,
    waiting: Vec<Candidate>,
    pairs: RaysAndTori,
}

impl Default for Tracer {
    fn default() -> Tracer {
        Tracer::new(Level::new())
    }
}

impl Tracer {
    /// `level` is the instruction set to be used; no bit depends on it.
    pub fn new(level: Level) -> Tracer {
        Tracer {
            level,
            reaches: Vec::new(),
            probes: Vec::new(),
            lists: Vec::new(),
            visits: Vec::new(),
            alive: Vec::new(),
            waiting: Vec::new(),
            pairs: RaysAndTori::default(),
        }
    }

    /// Finds the first hits of rays, as far as they are nearer than `reaches` says: there it puts them.
    pub(crate) fn closest(&mut self, bvh: &Bvh, bodies: &Bodies, rays: &[Ray], reaches: &mut [Reach]) {
        dispatch!(self.level, simd => simd.vectorize(
            #[inline(always)]
            || self.trace::<_, false>(simd, bvh, bodies, rays, reaches)
        ));
    }

    /// Finds out whether rays meet anything before the distance of their `reaches`, as far as that is not known.
    pub(crate) fn any(&mut self, bvh: &Bvh, bodies: &Bodies, rays: &[Ray], reaches: &mut [Reach]) {
        dispatch!(self.level, simd => simd.vectorize(
            #[inline(always)]
            || self.trace::<_, true>(simd, bvh, bodies, rays, reaches)
        ));
    }

    #[inline(always)]
    fn trace<S: Simd, const ANY: bool>(
        &mut self,
        simd: S,
        bvh: &Bvh,
        bodies: &Bodies,
        rays: &[Ray],
        reaches: &mut [Reach],
    ) {
        if bvh.nodes.is_empty() {
            return;
        }
        self.begin::<S, ANY>(simd, bvh, rays, reaches);
        let mut waiting = 0;
        while let Some(visit) = self.visits.pop() {
            if visit.child & LEAF == 0 {
                self.deal(simd, &bvh.nodes[visit.child as usize], visit);
                continue;
            }
            let leaf = &bvh.leaves[(visit.child & !LEAF) as usize];
            self.sift::<S, ANY>(simd, leaf, visit, &mut waiting, bvh, bodies, rays, reaches);
            while waiting >= LANES {
                waiting -= LANES;
                self.meet::<ANY>(waiting, LANES, bvh, bodies, rays, reaches);
            }
        }
        if waiting > 0 {
            self.meet::<ANY>(0, waiting, bvh, bodies, rays, reaches);
        }
    }

    /// Prepares the rays and puts those that come near the bodies into the root's list.
    #[inline(always)]
    fn begin<S: Simd, const ANY: bool>(&mut self, simd: S, bvh: &Bvh, rays: &[Ray], reaches: &mut [Reach]) {
        self.probes.resize(rays.len(), Probe::default());
        if self.lists.len() < rays.len() {
            self.lists.resize(rays.len(), Entry::default());
        }
        let mut count = 0;
        for first in (0..rays.len()).step_by(LANES) {
            let last = if rays.len() - first < LANES { rays.len() } else { first + LANES };
            let reaches = &mut reaches[first..last];
            let probes = &mut self.probes[first..last];
            let near = bvh.probes(simd, &rays[first..last], reaches, probes);
            for (lane, reach) in reaches.iter().enumerate() {
                self.lists[count] = Entry { ray: (first + lane) as u32, start: 0.0 };
                let asked = !ANY || reach.surface == Reach::NOTHING;
                count += usize::from((near >> lane & 1 == 1) & asked);
            }
        }
        self.visits.clear();
        if count > 0 {
            self.visits.push(Visit { child: 0, first: 0, count, top: count });
        }
    }

    /// Deals a node's list out to its children.
    #[inline(always)]
    fn deal<S: Simd>(&mut self, simd: S, node: &Node, visit: Visit) {
        let Visit { first, count, top, .. } = visit;
        // Of the list that is thrown away only one place is used.
        let size = WIDTH * count + 1;
        if self.lists.len() < top + size {
            self.lists.resize(2 * (top + size), Entry::default());
        }
        let (lists, dealt) = self.lists.split_at_mut(top);
        let dealt = &mut dealt[..size];
        let mut counts = [0; WIDTH + 1];
        let mut starts = [0.0; WIDTH + 1];
        for entry in &lists[first..first + count] {
            let probe = &self.probes[entry.ray as usize];
            let (entries, met) = node.entries(simd, probe);
            entries.store_array((&mut starts[..WIDTH]).try_into().expect("as many as children"));
            let mut met = if entry.start > probe.limit { 0 } else { met };
            let mut put = |met: &mut u32| {
                let child = (*met | 1 << NOWHERE).trailing_zeros() as usize;
                let place = child * count + counts[child];
                dealt[place] = Entry { ray: entry.ray, start: starts[child] };
                counts[child] += usize::from(*met != 0);
                *met &= met.wrapping_sub(1);
            };
            // Most rays meet one or two children: they are put without a look.
            put(&mut met);
            put(&mut met);
            while met != 0 {
                put(&mut met);
            }
        }
        // Nearest first, by where the first ray of each list enters; the stack takes the farthest first.
        let end = top + size;
        let base = self.visits.len();
        for child in 0..WIDTH {
            if counts[child] == 0 {
                continue;
            }
            let start = dealt[child * count].start;
            let visit = Visit {
                child: node.children[child],
                first: top + child * count,
                count: counts[child],
                top: end,
            };
            self.visits.push(visit);
            let mut place = self.visits.len() - 1;
            while place > base && dealt[self.visits[place - 1].first - top].start < start {
                self.visits.swap(place - 1, place);
                place -= 1;
            }
        }
    }

    /// Sifts a leaf's list: rays that may meet its rings wait for that, other bodies are met at once.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn sift<S: Simd, const ANY: bool>(
        &mut self,
        simd: S,
        leaf: &Leaf,
        visit: Visit,
        waiting: &mut usize,
        bvh: &Bvh,
        bodies: &Bodies,
        rays: &[Ray],
        reaches: &mut [Reach],
    ) {
        let list = &self.lists[visit.first..visit.first + visit.count];
        if self.alive.len() < list.len() {
            self.alive.resize(list.len(), 0);
        }
        let mut count = 0;
        for entry in list {
            self.alive[count] = entry.ray;
            count += usize::from(!(entry.start > self.probes[entry.ray as usize].limit));
        }
        if self.waiting.len() < *waiting + WIDTH * count + 1 {
            self.waiting.resize(2 * (*waiting + WIDTH * count + 1), Candidate::default());
        }
        let margin = bvh.place.sieve_margin as f32;
        let mut others = 0;
        for (lane, &body) in leaf.bodies.iter().enumerate() {
            others |= u32::from(body >= bodies.ring_count()) << lane;
        }
        let numbers = u32x8::load_array_ref(simd, &leaf.bodies);
        for &ray in &self.alive[..count] {
            let probe = &self.probes[ray as usize];
            let sieve = &leaf.sieve;
            let mut left = sieve.candidates(simd, &probe.origin, &probe.direction, probe.limit, margin);
            left &= !numbers.simd_eq(u32x8::splat(simd, probe.leaves)).to_bitmask() as u32;
            if others & left != 0 {
                meet_others::<ANY>(&mut self.probes, ray, leaf, left & others, bvh, bodies, rays, reaches);
                left &= !others;
            }
            let mut put = |left: &mut u32| {
                let lane = left.trailing_zeros() as usize & (WIDTH - 1);
                self.waiting[*waiting] = Candidate { ray, body: leaf.bodies[lane] };
                *waiting += usize::from(*left != 0);
                *left &= left.wrapping_sub(1);
            };
            put(&mut left);
            put(&mut left);
            while left != 0 {
                put(&mut left);
            }
        }
    }

    /// Meets waiting rays with their rings.
    #[inline(never)]
    #[allow(clippy::too_many_arguments)]
    fn meet<const ANY: bool>(
        &mut self,
        first: usize,
        count: usize,
        bvh: &Bvh,
        bodies: &Bodies,
        rays: &[Ray],
        reaches: &mut [Reach],
    ) {
        let candidates = &self.waiting[first..first + count];
        for (lane, candidate) in candidates.iter().enumerate() {
            let (ray, ring) = (&rays[candidate.ray as usize], bodies.ring(candidate.body));
            let radii = [ring.major_radius, ring.minor_radius];
            self.pairs.put(lane, &(ray.origin - ring.centre), &ray.direction, &ring.normal, radii);
        }
        let hits = self.pairs.first_hits(self.level, bodies.ray_start());
        for (candidate, distance) in candidates.iter().zip(hits) {
            let (reach, probe) =
                (&mut reaches[candidate.ray as usize], &mut self.probes[candidate.ray as usize]);
            found::<ANY>(bvh, reach, probe, distance, candidate.body);
        }
    }
}

/// Meets a ray with bodies that are not rings, one by one.
#[inline(never)]
#[allow(clippy::too_many_arguments)]
fn meet_others<const ANY: bool>(
    probes: &mut [Probe],
    ray: u32,
    leaf: &Leaf,
    mut left: u32,
    bvh: &Bvh,
    bodies: &Bodies,
    rays: &[Ray],
    reaches: &mut [Reach],
) {
    while left != 0 {
        let body = leaf.bodies[left.trailing_zeros() as usize & (WIDTH - 1)];
        left &= left - 1;
        let distance = bodies.hit(body, &rays[ray as usize]).unwrap_or(f64::NAN);
        found::<ANY>(bvh, &mut reaches[ray as usize], &mut probes[ray as usize], distance, body);
    }
}

/// Takes note of a hit; NaN is none.
#[inline(always)]
fn found<const ANY: bool>(bvh: &Bvh, reach: &mut Reach, probe: &mut Probe, distance: f64, body: u32) {
    if ANY {
        let blocked = distance < reach.distance;
        reach.surface = if blocked { body } else { reach.surface };
        probe.limit = if blocked { f32::NEG_INFINITY } else { probe.limit };
    } else {
        let nearer = distance < reach.distance || (distance == reach.distance && body < reach.surface);
        reach.distance = if nearer { distance } else { reach.distance };
        reach.surface = if nearer { body } else { reach.surface };
        probe.limit = if nearer { bvh.limit(reach) } else { probe.limit };
    }
}

impl Node {
    /// Where the ray enters the children, and which of them it meets up to its limit (bit k for child k).
    #[inline(always)]
    fn entries<S: Simd>(&self, simd: S, probe: &Probe) -> (f32x8<S>, u32) {
        let (mut start, mut end) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, probe.limit));
        for axis in 0..3 {
            let (near, far) = if probe.down >> axis & 1 == 0 { (axis, axis + 3) } else { (axis + 3, axis) };
            let origin = f32x8::splat(simd, probe.origin[axis]);
            let inverse = f32x8::splat(simd, probe.inverse[axis]);
            let bound = |row: usize| f32x8::load_array_ref(simd, &self.bounds[row]);
            // A NaN (origin on a bound, ray along it) sets no bound.
            start = or_larger(start, (bound(near) - origin) * inverse);
            end = or_smaller(end, (bound(far) - origin) * inverse);
        }
        (start, !start.simd_gt(end).to_bitmask() as u32 & ((1 << WIDTH) - 1))
    }
}

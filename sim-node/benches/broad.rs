//! Broad phases: time to find all near pairs, and the range tree's own figures.
//!
//! `cargo bench -p sim-node --bench broad` prints one line a layout and size: milliseconds to find all pairs
//! in order, for each method (best of several calls with the same memory), and the number of pairs. Then for
//! the range tree: milliseconds to build, microseconds for a query around a point, points found, and
//! megabytes. Give a largest number of bodies as an argument to stop earlier.

use geometry::Vec3;
use sim_node::broad::{Method, RangeTree, Workspace, find_pairs};
use std::hint::black_box;
use std::time::Instant;

/// Largest number for which looking at every pair is timed.
const BRUTE_COUNT_MAX: usize = 10_000;

/// Numbers from 0 to 1 (Steele's SplitMix64).
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut bits = *seed;
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

fn layout(name: &str, count: usize) -> Vec<Vec3> {
    let mut seed = count as u64;
    let columns = (count as f64).sqrt() as usize;
    let side = 2.0 * libm::cbrt(count as f64);
    (0..count)
        .map(|index| {
            let (row, column) = (index / columns, index % columns);
            let jitter = Vec3::from([0; 3].map(|_| 1e-3 * random(&mut seed)));
            let (x, y) = (1.25 * column as f64 + 0.625 * (row % 2) as f64, 1.25 * row as f64);
            match name {
                "sheet" => Vec3::new(x, y, 0.0) + jitter,
                "tilted sheet" => Vec3::new(x, 0.6 * y, 0.8 * y) + jitter,
                _ => Vec3::from([0; 3].map(|_| side * random(&mut seed))),
            }
        })
        .collect()
}

/// The best time of some calls, in seconds.
fn best(calls: usize, mut call: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..calls {
        let start = Instant::now();
        call();
        let seconds = start.elapsed().as_secs_f64();
        best = if seconds < best { seconds } else { best };
    }
    best
}

fn main() {
    let count_max = std::env::args().filter_map(|argument| argument.parse().ok()).next();
    let sizes = [10, 20, 30, 40, 50, 64, 80, 100, 200, 1000, 10_000, 100_000];
    for count in sizes.into_iter().filter(|&count| count <= count_max.unwrap_or(usize::MAX)) {
        for name in ["sheet", "tilted sheet", "cube"] {
            let centres = layout(name, count);
            let (radii, skin) = (vec![1.18; count], 0.295);
            let mut workspace = Workspace::default();
            let mut pairs = Vec::new();
            print!("{count:6} {name:12}");
            for method in [Method::Grid, Method::RangeTree, Method::SweepAndPrune, Method::Brute] {
                if method == Method::Brute && count > BRUTE_COUNT_MAX {
                    continue;
                }
                let calls = if count <= 1000 { 200 } else { 7 };
                let seconds =
                    best(calls, || find_pairs(method, &centres, &radii, skin, &mut workspace, &mut pairs));
                print!(" {method:?} {:.4} ms,", 1e3 * seconds);
            }
            println!(" {} pairs", pairs.len());
            range_tree(&centres);
        }
    }
}

fn range_tree(centres: &[Vec3]) {
    let mut tree = RangeTree::new();
    let build = best(5, || tree.build(centres));
    let mut found = Vec::new();
    let (half, queries) = (0.92 * 2.5, 2000);
    let mut hits = 0;
    let mut seed = 3;
    let around: Vec<_> =
        (0..queries).map(|_| centres[(random(&mut seed) * centres.len() as f64) as usize]).collect();
    let query = best(5, || {
        hits = 0;
        for centre in &around {
            found.clear();
            tree.query(centre.add_scalar(-half).into(), centre.add_scalar(half).into(), &mut found);
            hits += black_box(&found).len();
        }
    });
    println!(
        "       range tree: build {:.3} ms, query {:.3} us, {:.1} found, {:.2} MB",
        1e3 * build,
        1e6 * query / f64::from(queries),
        hits as f64 / f64::from(queries),
        1e-6 * tree.memory_bytes() as f64
    );
}

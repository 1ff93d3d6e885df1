//! Every broad phase finds the pairs that looking at all of them finds, and no bit of a run depends on which
//! one is taken.

use crate::support::Run;
use geometry::Vec3;
use proptest::prelude::*;
use schemas::{Hash, state};
use sim_node::Records;
use sim_node::broad::{Method, RangeTree, Workspace, find_pairs};

const METHODS: [Method; 4] = [Method::Grid, Method::RangeTree, Method::SweepAndPrune, Method::Brute];

/// Numbers from 0 to 1 that only the seed determines (Steele's SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn vector(&mut self, size: [f64; 3]) -> Vec3 {
        Vec3::from(size.map(|size| size * self.next()))
    }
}

/// Layouts of about one body for each unit of volume or area; radii of about 1.
fn layouts(count: usize) -> Vec<(&'static str, Vec<Vec3>, Vec<f64>)> {
    let mut random = Random(count as u64);
    let (side, edge) = (libm::cbrt(count as f64), (count as f64).sqrt());
    let mut all: Vec<(&'static str, Vec<Vec3>, Vec<f64>)> = Vec::new();
    let points = |make: &mut dyn FnMut(usize) -> Vec3| (0..count).map(make).collect::<Vec<_>>();
    let same = vec![0.6; count];
    all.push(("cube", points(&mut |_| random.vector([side; 3])), same.clone()));
    let columns = edge as usize + 1;
    let in_sheet = |index: usize| {
        let (row, column) = (index / columns, index % columns);
        Vec3::new(1.25 * column as f64 + 0.625 * (row % 2) as f64, 1.25 * row as f64, 0.0)
    };
    all.push(("sheet with exact ties", points(&mut |index| in_sheet(index)), vec![1.18; count]));
    let jitter = &mut |index| in_sheet(index) + random.vector([1e-3; 3]);
    all.push(("sheet with jitter", points(jitter), vec![1.18; count]));
    let tilted = &mut |index| {
        let flat = in_sheet(index) + random.vector([1e-3; 3]);
        Vec3::new(flat.x, 0.6 * flat.y, 0.8 * flat.y)
    };
    all.push(("tilted sheet", points(tilted), vec![1.18; count]));
    let clustered = &mut |index: usize| {
        let centre = Vec3::new((index % 7) as f64 * 1e4, (index % 3) as f64 * 1e3, 0.0);
        centre + random.vector([side, side, 0.1 * side])
    };
    all.push(("clusters far apart", points(clustered), same.clone()));
    let on_a_lattice = &mut |_| random.vector([side; 3]).map(libm::floor);
    all.push(("lattice with ties and coincidences", points(on_a_lattice), vec![0.5; count]));
    let far = &mut |_| random.vector([side; 3]).add_scalar(1e7);
    all.push(("far from the origin", points(far), same.clone()));
    let line = &mut |_| Vec3::new(0.0, random.next() * count as f64, -0.0);
    all.push(("line", points(line), same.clone()));
    let radii = (0..count).map(|_| 0.01 + 0.6 * random.next() * random.next() * random.next()).collect();
    all.push(("mixed radii", points(&mut |_| random.vector([side; 3])), radii));
    let mut with_balls = same;
    with_balls.iter_mut().step_by(1 + count / 3).for_each(|radius| *radius = 0.3 * side);
    all.push(("a few balls", points(&mut |_| random.vector([side; 3])), with_balls));
    let two_ends = &mut |index: usize| {
        let end = if index.is_multiple_of(2) { 0.0 } else { 1e12 };
        random.vector([side; 3]).add_scalar(end)
    };
    all.push(("ends of space", points(two_ends), vec![0.6; count]));
    all
}

/// The partners of some bodies with higher numbers, by looking at all.
fn brute(centres: &[Vec3], radii: &[f64], skin: f64, a: usize) -> Vec<(u32, u32)> {
    let near = |&b: &usize| {
        let (apart, reach) = (centres[a] - centres[b], radii[a] + radii[b] + skin);
        apart.x * apart.x + apart.y * apart.y + apart.z * apart.z < reach * reach
    };
    (a + 1..centres.len()).filter(near).map(|b| (a as u32, b as u32)).collect()
}

#[track_caller]
fn conform(name: &str, centres: &[Vec3], radii: &[f64], skin: f64, workspace: &mut Workspace) -> usize {
    let count = centres.len();
    // All of them, or a sample of a few hundred that takes in the first and the last.
    let stride = if count <= 2000 { 1 } else { count / 300 };
    let sample: Vec<_> = (0..count).step_by(stride).chain(count.checked_sub(1)).collect();
    let expected: Vec<_> = sample.iter().map(|&a| brute(centres, radii, skin, a)).collect();
    let mut sizes = Vec::new();
    for method in METHODS {
        // Both are meant for fewer bodies, and sweeping for flat layouts.
        let quadratic = method == Method::Brute
            || method == Method::SweepAndPrune && !name.contains("sheet") && name != "line";
        if quadratic && count > 20_000 {
            continue;
        }
        let mut pairs = vec![(7, 7)];
        find_pairs(method, centres, radii, skin, workspace, &mut pairs);
        assert!(pairs.is_sorted_by(|a, b| a < b), "{method:?}, {name}, {count}: in order, none twice");
        for (&a, expected) in sample.iter().zip(&expected) {
            let start = pairs.partition_point(|pair| (pair.0 as usize) < a);
            let end = pairs.partition_point(|pair| pair.0 as usize <= a);
            assert_eq!(pairs[start..end], *expected, "{method:?}, {name}, {count}: pairs of {a}");
        }
        sizes.push(pairs.len());
    }
    assert!(sizes.windows(2).all(|pair| pair[0] == pair[1]), "{name}, {count}: {sizes:?} pairs");
    sizes[0]
}

#[test]
fn all_broad_phases_find_the_same_pairs_in_the_same_order() {
    let mut workspace = Workspace::default();
    for count in [0, 1, 2, 3, 10, 33, 45, 100, 1000, 4000, 100_000] {
        for (name, centres, radii) in layouts(count) {
            let skin = if count % 2 == 0 { 0.0 } else { 0.2 };
            let pairs = conform(name, &centres, &radii, skin, &mut workspace);
            println!("{count} bodies, {name}: {pairs} pairs");
            assert!(count < 100 || pairs > 0, "{count} bodies, {name}: no pair, nothing was tested");
        }
    }
}

#[test]
fn bodies_in_one_place_are_all_near_each_other() {
    let mut workspace = Workspace::default();
    for count in [2, 64, 700] {
        let (centres, radii) = (vec![Vec3::new(3.0, -0.0, 1e7); count], vec![1.0; count]);
        let pairs = conform("coincident", &centres, &radii, 0.0, &mut workspace);
        assert_eq!(pairs, count * (count - 1) / 2);
    }
}

#[test]
fn bodies_that_are_nowhere_are_near_none() {
    let mut workspace = Workspace::default();
    let mut centres = vec![Vec3::zeros(); 6];
    (centres[1].x, centres[2].y, centres[3].z) = (f64::NAN, f64::INFINITY, f64::NEG_INFINITY);
    centres[4].x = 1e300;
    for method in METHODS {
        let mut pairs = Vec::new();
        find_pairs(method, &centres, &[1.0; 6], 0.0, &mut workspace, &mut pairs);
        assert_eq!(pairs, [(0, 5)], "{method:?}");
    }
}

#[test]
fn range_tree_answers_any_box() {
    let mut random = Random(1);
    let mut tree = RangeTree::new();
    for count in [0, 1, 2, 31, 32, 33, 64, 65, 500, 4000] {
        for (name, centres, _) in layouts(count) {
            tree.build(&centres);
            assert_eq!((tree.len(), tree.is_empty()), (count, count == 0));
            let side =
                centres.iter().flat_map(|p| [p.x, p.y, p.z]).fold(1.0, |a, b| if b > a { b } else { a });
            for _ in 0..60 {
                // Of all sizes, and in each coordinate now and then exactly through a point, empty or unbounded.
                let size = side * random.next() * random.next();
                let mut low: [f64; 3] = random.vector([side; 3]).into();
                let mut high = low.map(|low| low + size * random.next());
                for axis in 0..3 {
                    let at = (random.next() * count as f64) as usize;
                    match (random.next() * 8.0) as u32 {
                        0 if count > 0 => low[axis] = centres[at][axis],
                        1 if count > 0 => high[axis] = centres[at][axis],
                        2 => (low[axis], high[axis]) = (f64::NEG_INFINITY, f64::INFINITY),
                        _ => {}
                    }
                }
                let inside = |point: &Vec3| (0..3).all(|i| low[i] <= point[i] && point[i] <= high[i]);
                let expected: Vec<_> =
                    (0..count as u32).filter(|&number| inside(&centres[number as usize])).collect();
                let mut found = Vec::new();
                tree.query(low, high, &mut found);
                found.sort_unstable();
                assert_eq!(found, expected, "{name}, {count} points, {low:?} to {high:?}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Coordinates from a small set of values: ties in each of them, and bodies in one place.
    #[test]
    fn ties_are_no_trouble(
        cells in prop::collection::vec((0..6_i32, 0..6_i32, 0..3_i32, 0..3_usize), 0..200),
        skin in prop::sample::select(vec![0.0, 0.25, 1.0]),
    ) {
        let centres: Vec<_> =
            cells.iter().map(|&(x, y, z, _)| 0.5 * Vec3::new(f64::from(x), f64::from(y), -f64::from(z))).collect();
        let radii: Vec<_> = cells.iter().map(|cell| [0.125, 0.25, 1.0][cell.3]).collect();
        conform("ties", &centres, &radii, skin, &mut Workspace::default());
    }
}

/// The chained hash over all states and step records of a short run.
fn chained_hash(text: &str, overrides: &[String], steps: u64) -> (Hash, Hash) {
    let mut run = Run::with(text, overrides);
    let mut records = Records::after(Hash::default());
    for _ in 0..steps {
        run.step();
        records.record(&run.model, &run.state, &run.scratch);
    }
    let mut message = Vec::new();
    let last = state::encode(&run.state.header(), &run.state.bodies, &run.state.contacts, &mut message);
    (records.chained_hash(), last)
}

#[test]
fn no_bit_of_a_run_depends_on_the_broad_phase() {
    let near = "sphere.0.position_m=[0.0, -0.3, -1.0]";
    for (name, text, set) in [
        ("two-rings", include_str!("../../../scenes/two-rings.toml"), None),
        ("drop", include_str!("../../../scenes/drop.toml"), None),
        ("ball", include_str!("../../../scenes/ball.toml"), Some(near)),
    ] {
        let hash = |choice: &str| {
            let choice = format!("method.broad_phase={choice}");
            let overrides: Vec<_> = set.into_iter().map(str::to_owned).chain([choice]).collect();
            chained_hash(text, &overrides, 400)
        };
        let auto = hash("auto");
        for choice in ["grid", "range-tree", "sweep-and-prune", "brute"] {
            assert_eq!(hash(choice), auto, "{name} with {choice}");
        }
    }
}

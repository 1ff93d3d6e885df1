//! Contact arcs in lanes against the scalar ones: nothing missed, nothing invented, the same bits on every
//! instruction set.

use crate::random::{Random, degenerate_pairs};
use geometry::arc::{Arc, circle_circle_arcs};
use geometry::lanes::{ArcSearch, LaneArc, Level, Line, arcs_on};
use geometry::{Arcs, Circle, Vec3, point_circle_distance};

fn line(circle: &Circle, minor_radius: f64) -> Line {
    let (c, n) = (circle.centre, circle.normal);
    Line { centre: [c.x, c.y, c.z, minor_radius], normal: [n.x, n.y, n.z, circle.radius] }
}

fn search(level: Level, lines: &[Line], pairs: &[(u32, u32)]) -> ArcSearch {
    let mut search = ArcSearch::default();
    search.find(level, lines, pairs);
    search
}

/// The ends and the middle of an arc in space.
fn points(arc: &Arc, a: &Circle) -> [Vec3; 3] {
    let square = arc.half_tangent * arc.half_tangent;
    let (cos, sin) = ((1.0 - square) / (1.0 + square), 2.0 * arc.half_tangent / (1.0 + square));
    [(cos, -sin), (cos, sin), (1.0, 0.0)].map(|(cos, sin)| {
        let (c, s) = (arc.mid_cos * cos - arc.mid_sin * sin, arc.mid_sin * cos + arc.mid_cos * sin);
        a.point(c, s)
    })
}

/// Pairs in which a contact is likely: B is put near a point of A.
fn near_pair(random: &mut Random) -> (Circle, Circle, f64) {
    let radius_a = random.uniform(0.3, 1.0);
    let a = random.circle(0.5, radius_a);
    let reach = random.log_uniform(2e-3, 0.7);
    let angle = random.uniform(0.0, core::f64::consts::TAU);
    let point = a.point(libm::cos(angle), libm::sin(angle));
    let b = Circle::from_pose(Vec3::zeros(), &random.orientation(), 1.0);
    let angle = random.uniform(0.0, core::f64::consts::TAU);
    let wire = b.point(libm::cos(angle), libm::sin(angle));
    let apart = random.direction() * (reach * random.uniform(0.9, 1.3));
    (a, Circle { centre: point + apart - wire, ..b }, reach)
}

#[derive(Default)]
struct Tally {
    pairs: u64,
    irregular: u64,
    arcs: u64,
    doubtful: u64,
    worst: f64,
}

impl Tally {
    /// Checks the lanes' answer for pair `index` against the scalar one.
    fn check(&mut self, found: &ArcSearch, index: usize, (a, b, reach): &(Circle, Circle, f64)) {
        self.pairs += 1;
        let touching: Vec<&[LaneArc]> =
            found.touching().filter(|&(pair, _)| pair == index).map(|(_, arcs)| arcs).collect();
        assert!(touching.len() < 2, "a pair comes once: {index}");
        let lanes = touching.first().map_or(Arcs::NONE, |lanes| arcs_on(a, b, lanes));
        if found.irregular.binary_search(&(index as u32)).is_ok() {
            self.irregular += 1;
            assert!(lanes.is_empty() && touching.len() == 1, "an irregular pair is answered: {index}");
            return;
        }
        assert!(touching.is_empty() || !lanes.is_empty());
        let arcs = circle_circle_arcs(a, b, *reach);
        for arc in lanes.iter() {
            self.arcs += 1;
            let [start, end, middle] = points(arc, a);
            let depth = |point: &Vec3| reach - point_circle_distance(point, b);
            for end in [start, end] {
                let error = depth(&end).abs();
                if error > self.worst {
                    self.worst = error;
                }
            }
            assert!(depth(&middle) > -1e-14, "{index}: {arc:?} is not in contact");
        }
        if arcs.connected_count() != lanes.connected_count() {
            // Only contacts that rounding decides may differ.
            let length: f64 = arcs.iter().map(|arc| arc.half_tangent).sum::<f64>()
                + lanes.iter().map(|arc| arc.half_tangent).sum::<f64>();
            self.doubtful += 1;
            assert!(length < 1e-6, "{index}: {a:?} {b:?} {reach}: {:?} and {lanes:?}", arcs.as_slice());
        }
        for arc in lanes.iter() {
            let [.., middle] = points(arc, a);
            let same = arcs.iter().any(|other| {
                let point = a.point(other.mid_cos, other.mid_sin);
                (point - middle).norm() < 1e-6 * (1.0 + a.radius)
                    && (other.half_tangent - arc.half_tangent).abs() < 1e-6
            });
            assert!(
                same || arcs.iter().count() > lanes.iter().count() || arc.half_tangent < 1e-6,
                "{index}: {arc:?}"
            );
        }
    }
}

/// Nothing is missed and nothing invented: 200,000 random pairs near contact.
///
/// An arc's end is where the depth is 0. The quartic moves the reach by less than `e`, the bound at
/// [`circle_circle_arcs`], and the iteration leaves 6e-11 of the half width `w` times the slope, which for a
/// depth `p` below 0.7 is about `2 p / w`; ten times that for arcs that are far from a parabola.
#[test]
fn lanes_find_the_scalar_arcs() {
    let mut random = Random(7);
    let cases: Vec<_> = (0..200_000).map(|_| near_pair(&mut random)).collect();
    let mut lines = Vec::new();
    let mut pairs = Vec::new();
    for (a, b, reach) in &cases {
        let share = random.uniform(0.1, 0.9);
        pairs.push((lines.len() as u32, lines.len() as u32 + 1));
        lines.extend([line(a, share * reach), line(b, (1.0 - share) * reach)]);
    }
    let mut tally = Tally::default();
    let level = Level::new();
    for (chunk, cases) in pairs.chunks(1001).zip(cases.chunks(1001)) {
        let found = search(level, &lines, chunk);
        for (index, case) in cases.iter().enumerate() {
            let (a, b) = chunk[index];
            let reach = lines[a as usize].centre[3] + lines[b as usize].centre[3];
            tally.check(&found, index, &(case.0, case.1, reach));
        }
    }
    let Tally { pairs, irregular, arcs, doubtful, worst } = tally;
    println!("{pairs} pairs, {irregular} irregular, {arcs} arcs, {doubtful} that rounding decides");
    println!("depth at an arc's end: {worst:e}, allowed 1e-9");
    assert!(worst < 1e-9 && arcs > 50_000 && irregular < pairs / 5 && doubtful < 100);
}

/// Degenerate poses are answered as the scalar code answers them, or handed back.
#[test]
fn lanes_are_right_or_silent_in_degenerate_poses() {
    let mut tally = Tally::default();
    for radius in [0.25, 0.9, 1.0] {
        let cases: Vec<_> = degenerate_pairs(radius).into_iter().map(|(_, a, b)| (a, b, 0.36)).collect();
        let lines: Vec<_> =
            cases.iter().flat_map(|(a, b, reach)| [line(a, 0.5 * reach), line(b, 0.5 * reach)]).collect();
        let pairs: Vec<_> = (0..cases.len() as u32).map(|i| (2 * i, 2 * i + 1)).collect();
        let found = search(Level::new(), &lines, &pairs);
        cases.iter().enumerate().for_each(|(index, case)| tally.check(&found, index, case));
    }
    println!("{} pairs, {} irregular, worst {:e}, allowed 1e-9", tally.pairs, tally.irregular, tally.worst);
    assert!(tally.worst < 1e-9);
}

/// The same bits with every instruction set that this machine has.
#[test]
fn instruction_sets_agree_bit_for_bit() {
    let mut random = Random(11);
    let mut lines = Vec::new();
    for _ in 0..20_000 {
        let (a, b, reach) = near_pair(&mut random);
        lines.extend([line(&a, 0.5 * reach), line(&b, 0.5 * reach)]);
    }
    lines[0].normal[1] = f64::NAN;
    lines[77].centre[0] = f64::INFINITY;
    let pairs: Vec<_> = (0..19_999).map(|i| (2 * i, 2 * i + 1)).collect();
    let best = Level::new();
    let expected = search(best, &lines, &pairs);
    let levels = other_levels(best);
    println!("{best:?} against {levels:?}: {} arcs", expected.arcs.len());
    for level in levels {
        let found = search(level, &lines, &pairs);
        assert_eq!(found.irregular, expected.irregular, "{level:?}");
        assert_eq!(found.arcs.len(), expected.arcs.len(), "{level:?}");
        for (arc, other) in found.arcs.iter().zip(&expected.arcs) {
            assert_eq!(arc.numbers.map(f64::to_bits), other.numbers.map(f64::to_bits), "{level:?}");
        }
    }
}

#[cfg(target_arch = "x86_64")]
fn other_levels(best: Level) -> Vec<Level> {
    [best.as_avx2().map(Level::Avx2), best.as_sse4_2().map(Level::Sse4_2), best.as_sse2().map(Level::Sse2)]
        .into_iter()
        .flatten()
        .collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn other_levels(best: Level) -> Vec<Level> {
    vec![best]
}

//! Sixteen rays and tori side by side: the same bits on every instruction set, and the scalar solver's hits.

use crate::staging::Dice;
use geometry::lanes::{LANES, Level, RaysAndTori};
use geometry::{Vec3, torus};

/// A ray in a torus' frame, and R, r and the start.
struct Case {
    origin: Vec3,
    direction: Vec3,
    radii: [f64; 2],
    start: f64,
}

const CLASSES: [&str; 11] = [
    "hits",
    "mixed",
    "grazing",
    "in plane",
    "axis",
    "thin 1e-3",
    "thin 1e-4",
    "far 1e3",
    "far 1e6",
    "surface 1e-6",
    "surface 1e-9",
];

/// A point of the surface, and the outward normal there.
fn surface(dice: &mut Dice, [major, minor]: [f64; 2]) -> (Vec3, Vec3) {
    let (sine, cosine) = libm::sincos(core::f64::consts::TAU * dice.unit());
    let (height, across) = libm::sincos(core::f64::consts::TAU * dice.unit());
    let normal = Vec3::new(across * cosine, across * sine, height);
    (Vec3::new(cosine, sine, 0.0) * major + normal * minor, normal)
}

fn case(dice: &mut Dice, class: usize) -> Case {
    let radii = match class {
        5 => [1.0, 1e-3],
        6 => [1.0, 1e-4],
        _ => [1.0, 0.18],
    };
    let away = match class {
        7 => 1e3,
        8 => 1e6,
        _ => 4.0,
    };
    let (point, normal) = surface(dice, radii);
    let towards = |direction: Vec3, point: Vec3| (point - direction * away, direction);
    let (origin, direction) = match class {
        0 | 5..=8 => towards(dice.direction(), point),
        1 => towards(dice.direction(), dice.in_cube(1.3)),
        2 => {
            // Along the surface, and from it by up to 1e-5 to either side.
            let along = normal.cross(&dice.direction()).normalize();
            towards(along, point + normal * (2e-5 * (dice.unit() - 0.5)))
        }
        3 => {
            let along = Vec3::new(dice.unit() - 0.5, dice.unit() - 0.5, 0.0).normalize();
            let target = Vec3::new(dice.unit() - 0.5, dice.unit() - 0.5, 0.0) * 2.4;
            towards(along, target)
        }
        4 => {
            let place = Vec3::new(dice.unit() - 0.5, dice.unit() - 0.5, 0.0) * 2.4;
            towards(Vec3::z(), place)
        }
        _ => {
            let direction = dice.direction();
            (point, if direction.dot(&normal) < 0.0 { -direction } else { direction })
        }
    };
    let start = match class {
        9 => 1e-6,
        10 => 1e-9,
        _ => 0.0,
    };
    Case { origin, direction, radii, start }
}

/// The same in a frame that is turned and moved.
fn put(pairs: &mut RaysAndTori, lane: usize, case: &Case) {
    pairs.put(lane, &case.origin, &case.direction, &Vec3::z(), case.radii);
}

fn levels() -> Vec<Level> {
    let best = Level::new();
    let mut levels = vec![best, Level::baseline()];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    levels.extend([best.as_avx2().map(Level::Avx2), best.as_sse2().map(Level::Sse2)].into_iter().flatten());
    levels
}

#[test]
fn every_instruction_set_gives_the_scalar_solvers_hits_with_the_same_bits() {
    let mut dice = Dice::new(11);
    for (class, name) in CLASSES.iter().enumerate() {
        let (mut hits, mut other, mut worst) = (0, 0, 0.0);
        let rays = 20_000;
        for _ in 0..rays / LANES {
            let cases: [Case; LANES] = core::array::from_fn(|_| case(&mut dice, class));
            let mut pairs = RaysAndTori::default();
            cases.iter().enumerate().for_each(|(lane, case)| put(&mut pairs, lane, case));
            let found = pairs.first_hits(levels()[0], cases[0].start);
            for level in levels() {
                let bits = |hits: [f64; LANES]| hits.map(f64::to_bits);
                assert_eq!(bits(pairs.first_hits(level, cases[0].start)), bits(found), "{name}, {level:?}");
            }
            // A lane does not know of its neighbours.
            let mut alone = RaysAndTori::default();
            put(&mut alone, 5, &cases[3]);
            assert_eq!(alone.first_hits(Level::new(), cases[0].start)[5].to_bits(), found[3].to_bits());
            for (case, t) in cases.iter().zip(found) {
                let Case { origin, direction, radii: [major, minor], start } = case;
                let expected = torus::ray_torus(origin, direction, *major, *minor, *start);
                hits += usize::from(expected.is_some());
                let Some(expected) = expected.filter(|_| !t.is_nan()) else {
                    other += usize::from(expected.is_some() == t.is_nan());
                    continue;
                };
                // Both stop where the surface's value is rounding, 2^-50 r R in the lanes; the ray turns that into a distance
                // by its slope. Far away the distance itself has no more digits.
                let slope = torus::gradient(&(origin + direction * expected), *major).dot(direction).abs();
                let allowed = 2e-14 * major * minor / slope + 4e-16 * expected;
                let error = (t - expected).abs() / allowed;
                worst = if error > worst { error } else { worst };
            }
        }
        println!(
            "{name}: {hits} of {rays} rays hit, {other} with another answer, largest error {worst:.2} of what is allowed"
        );
        assert!(hits > 0 || name.starts_with("surface"));
        // A ray that grazes by less than rounding has no right answer.
        assert!(other <= if *name == "grazing" { 4 } else { 0 }, "{name}: {other}");
        assert!(worst < 1.0, "{name}: {worst}");
    }
}

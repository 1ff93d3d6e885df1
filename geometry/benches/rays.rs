//! Ray-torus solvers by class of rays: time, error and wrong answers, as the table of docs/rendering.md.
//!
//! `cargo bench -p geometry --bench rays`. The reference has twice the precision and another method. Times may differ;
//! a wrong answer of `bernstein`, or an error beyond the limits below, ends the program with exit code 1.

// The same classes and the same reference as in the tests.
#[allow(dead_code)]
#[path = "../tests/oracles/double_double.rs"]
mod double_double;
#[allow(dead_code)]
#[path = "../tests/oracles/random.rs"]
mod random;
#[allow(dead_code)]
#[path = "../tests/oracles/rays.rs"]
mod rays;

use geometry::Vec3;
use geometry::companion::real_roots;
use geometry::lanes::{LANES, Level, RaysAndTori};
use geometry::torus::{normal, ray_torus, ray_torus_by_companion};
use random::Random;
use rays::{Ray, crossings, make};
use std::hint::black_box;
use std::time::Instant;

const COUNT: usize = 20_000;

/// Classes with the largest errors of `bernstein` that are allowed, in units of R: 99.9 % of the rays, and the worst.
const CLASSES: [(&str, f64, f64); 11] = rays::CLASSES;

type Solver = fn(&Ray) -> Option<f64>;

/// The paper's program: the quartic in the ray's own parameter, with no shift and no clipping.
fn unshifted_companion(ray: &Ray) -> Option<f64> {
    let (o, d) = (&ray.origin, &ray.direction);
    let a = [o.norm_squared() + 1.0 - ray.minor_radius * ray.minor_radius, 2.0 * o.dot(d), d.norm_squared()];
    let b = [o.x * o.x + o.y * o.y, 2.0 * (o.x * d.x + o.y * d.y), d.x * d.x + d.y * d.y];
    let power = [
        a[0] * a[0] - 4.0 * b[0],
        2.0 * a[0] * a[1] - 4.0 * b[1],
        2.0 * a[0] * a[2] + a[1] * a[1] - 4.0 * b[2],
        2.0 * a[1] * a[2],
        a[2] * a[2],
    ];
    let (roots, count) = real_roots(&power);
    let beyond = roots[..count].iter().copied().filter(|&t| t > ray.t_min);
    beyond.reduce(|first, t| if t < first { t } else { first })
}

/// Nanoseconds a ray: the best of five passes.
fn nanoseconds(solver: Solver, rays: &[Ray]) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        for ray in rays {
            black_box(solver(black_box(ray)));
        }
        let time = start.elapsed().as_secs_f64() / rays.len() as f64;
        best = if time < best { time } else { best };
    }
    best * 1e9
}

/// The same and the answers, sixteen rays side by side.
fn side_by_side(rays: &[Ray]) -> (f64, Vec<Option<f64>>) {
    let batches: Vec<RaysAndTori> = rays
        .chunks(LANES)
        .map(|rays| {
            let mut batch = RaysAndTori::default();
            for (lane, ray) in rays.iter().enumerate() {
                batch.put(lane, &ray.origin, &ray.direction, &Vec3::z(), [1.0, ray.minor_radius]);
            }
            batch
        })
        .collect();
    let (level, t_min) = (Level::new(), rays[0].t_min);
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        for batch in &batches {
            black_box(black_box(batch).first_hits(level, t_min));
        }
        let time = start.elapsed().as_secs_f64() / rays.len() as f64;
        best = if time < best { time } else { best };
    }
    let hits = batches.iter().flat_map(|batch| batch.first_hits(level, t_min));
    (best * 1e9, hits.take(rays.len()).map(|t| (!t.is_nan()).then_some(t)).collect())
}

#[derive(Default)]
struct Tally {
    errors: Vec<f64>,
    /// How far off the surface the points are that errors of the ray parameter lead to.
    off: Vec<f64>,
    missed: u32,
    false_hits: u32,
    other_root: u32,
}

impl Tally {
    /// Errors count where the right crossing was found: the nearest of all of them.
    fn of(answers: &[Option<f64>], rays: &[Ray], references: &[Vec<f64>]) -> Tally {
        let mut tally = Tally::default();
        for ((&answer, ray), crossings) in answers.iter().zip(rays).zip(references) {
            match (answer, crossings.first()) {
                (None, None) => {}
                (None, Some(_)) => tally.missed += 1,
                (Some(_), None) => tally.false_hits += 1,
                (Some(t), Some(&first)) => {
                    let error = (t - first).abs();
                    if error < 0.1 && crossings[1..].iter().all(|other| error <= (t - other).abs()) {
                        tally.errors.push(error);
                        let outward = normal(&(ray.origin + ray.direction * first), 1.0);
                        tally.off.push(error * outward.dot(&ray.direction).abs());
                    } else {
                        tally.other_root += 1;
                    }
                }
            }
        }
        tally.errors.sort_by(f64::total_cmp);
        tally.off.sort_by(f64::total_cmp);
        tally
    }

    fn wrong(&self) -> u32 {
        self.missed + self.false_hits + self.other_root
    }

    fn at(&self, part: f64) -> f64 {
        share(&self.errors, part)
    }
}

/// What this part of some numbers in order is not beyond.
fn share(numbers: &[f64], part: f64) -> f64 {
    numbers.get(((numbers.len().max(1) - 1) as f64 * part) as usize).copied().unwrap_or(0.0)
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{:.1e} / {:.1e}", self.at(0.999), self.at(1.0))?;
        for (letter, count) in [("m", self.missed), ("f", self.false_hits), ("w", self.other_root)] {
            if count > 0 {
                write!(f, " **{letter}{count}**")?;
            }
        }
        Ok(())
    }
}

fn main() {
    let solvers: [(&str, Solver); 3] = [
        ("bernstein", |ray| ray_torus(&ray.origin, &ray.direction, 1.0, ray.minor_radius, ray.t_min)),
        ("companion", |ray| {
            ray_torus_by_companion(&ray.origin, &ray.direction, 1.0, ray.minor_radius, ray.t_min)
        }),
        ("companion, not shifted", unshifted_companion),
    ];
    println!("{COUNT} rays a class, R = 1; error in R: 99.9 % of the rays / the worst.");
    println!(
        "m, f, w: crossings missed, false ones, another crossing than the first (none shown where 0).\n"
    );
    println!("off: how far such a point is off the surface: the error times the sine of the angle to it.\n");
    let mut header = "| rays | hits | side by side: ns | error | off".to_owned();
    let mut rule = "|--|--|--|--|--".to_owned();
    for (name, _) in solvers {
        header += &format!(" | {name}: ns | error");
        rule += "|--|--";
    }
    println!("{header} |\n{rule}|");
    let mut good = true;
    for (seed, (class, most, worst)) in CLASSES.into_iter().enumerate() {
        let mut random = Random(100 + seed as u64);
        let rays: Vec<Ray> = (0..COUNT).map(|_| make(class, &mut random)).collect();
        let references: Vec<Vec<f64>> = rays.iter().map(|ray| crossings(ray, 1.0)).collect();
        let mut line = format!("| {class} | {}", references.iter().filter(|found| !found.is_empty()).count());
        let within = |tally: &Tally| tally.wrong() == 0 && tally.at(0.999) <= most && tally.at(1.0) <= worst;
        let (time, answers) = side_by_side(&rays);
        let tally = Tally::of(&answers, &rays, &references);
        line += &format!(
            " | {time:.0} | {tally} | {:.1e} / {:.1e}",
            share(&tally.off, 0.999),
            share(&tally.off, 1.0)
        );
        // Off the surface by the rounding of a point's coordinates and no more, but where the parameter has no more digits.
        good &= tally.wrong() == 0 && (share(&tally.off, 1.0) <= 1e-15 || tally.at(1.0) <= worst);
        for (name, solver) in solvers {
            let answers: Vec<_> = rays.iter().map(solver).collect();
            let tally = Tally::of(&answers, &rays, &references);
            line += &format!(" | {:.0} | {tally}", nanoseconds(solver, &rays));
            good &= name != "bernstein" || within(&tally);
        }
        println!("{line} |");
    }
    if !good {
        println!("\nbernstein answered wrongly, or its error is beyond its limits");
        std::process::exit(1);
    }
}

//! The ray-torus test by outcome.

use crate::{Dice, core_seconds};
use geometry::lanes::{LANES, Level, RaysAndTori};
use geometry::{Vec3, torus::ray_torus};
use std::hint::black_box;

/// Nanoseconds of one ray-torus test, by outcome: sixteen side by side, and the scalar one.
pub fn measure() {
    let mut dice = Dice(7);
    let mut classes: [(&str, Vec<(Vec3, Vec3)>); 3] =
        [("missed", vec![]), ("hit", vec![]), ("mixed", vec![])];
    while classes.iter().any(|(_, rays)| rays.len() < 1 << 14) {
        let mut point =
            |size: f64| (Vec3::new(dice.unit(), dice.unit(), dice.unit()) * 2.0).add_scalar(-1.0) * size;
        let (target, from) = (point(1.2), point(1.0));
        let origin = from.normalize() * 8.0;
        let direction = (target - origin).normalize();
        let hit = ray_torus(&origin, &direction, 1.0, 0.18, 0.18e-6).is_some();
        for class in [usize::from(hit), 2] {
            if classes[class].1.len() < 1 << 14 {
                classes[class].1.push((origin, direction));
            }
        }
    }
    println!("ray-torus test, R = 1, r = 0.18, ns: sixteen side by side | scalar");
    for (name, rays) in &classes {
        let batches: Vec<_> = rays
            .chunks(LANES)
            .map(|rays| {
                let mut pairs = RaysAndTori::default();
                for (lane, (origin, direction)) in rays.iter().enumerate() {
                    pairs.put(lane, origin, direction, &Vec3::z(), [1.0, 0.18]);
                }
                pairs
            })
            .collect();
        let (mut lanes, mut scalar) = (f64::INFINITY, f64::INFINITY);
        let (mut met, mut worst) = (0, 0.0);
        for _ in 0..200 {
            let begin = core_seconds();
            for pairs in &batches {
                black_box(pairs.first_hits(Level::new(), 0.18e-6));
            }
            let middle = core_seconds();
            for (origin, direction) in rays {
                black_box(ray_torus(origin, direction, 1.0, 0.18, 0.18e-6));
            }
            let end = core_seconds();
            lanes = if middle - begin < lanes { middle - begin } else { lanes };
            scalar = if end - middle < scalar { end - middle } else { scalar };
        }
        for (pairs, rays) in batches.iter().zip(rays.chunks(LANES)) {
            for (t, (origin, direction)) in pairs.first_hits(Level::new(), 0.18e-6).iter().zip(rays) {
                let expected = ray_torus(origin, direction, 1.0, 0.18, 0.18e-6);
                assert_eq!(expected.is_some(), !t.is_nan());
                let error = expected.map_or(0.0, |expected| (t - expected).abs());
                met += usize::from(!t.is_nan());
                worst = if error > worst { error } else { worst };
            }
        }
        let each = 1e9 / rays.len() as f64;
        println!(
            "  {name:7} {:6.1} | {:6.1}   ({met} of {} hit, largest difference {worst:.1e})",
            lanes * each,
            scalar * each,
            rays.len()
        );
    }
}

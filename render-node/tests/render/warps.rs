//! Chi-squared tests: directions come with the density that is claimed.

use core::f64::consts::TAU;
use geometry::Vec3;
use render_node::{Sampler, warp};

/// Bins of equal share of the turn about z, by bins of the height.
const TURNS: usize = 16;
const HEIGHTS: usize = 12;
const SAMPLES: u32 = 60_000;

/// Draws directions, one from each pixel of a sampler, and compares the counts of bins with what is expected from
/// the cumulative distribution of the height.
fn check(what: &str, draw: impl Fn((f64, f64)) -> Vec3, low: f64, below: impl Fn(f64) -> f64) {
    let mut counts = [[0_u32; TURNS]; HEIGHTS];
    let mut sampler = Sampler::new(5, 6, Default::default());
    for pixel in 0..SAMPLES {
        sampler.start(u64::from(pixel), pixel % 7);
        let direction = draw(sampler.pair(1));
        assert!((direction.norm() - 1.0).abs() < 1e-15 * 8.0 && direction.z >= low * (1.0 - 1e-15));
        let turn = libm::atan2(direction.y, direction.x) / TAU + 0.5;
        let height = (direction.z - low) / (1.0 - low);
        let bin = |share: f64, bins: usize| ((share * bins as f64) as usize).min(bins - 1);
        counts[bin(height, HEIGHTS)][bin(turn, TURNS)] += 1;
    }
    let border = |index: usize| low + (1.0 - low) * index as f64 / HEIGHTS as f64;
    let mut chi_squared = 0.0;
    for (index, row) in counts.iter().enumerate() {
        let share = (below(border(index + 1)) - below(border(index))) / TURNS as f64;
        let expected = share * f64::from(SAMPLES);
        assert!(expected > 5.0, "bin {index} is too small for the test");
        chi_squared += row
            .iter()
            .map(|&n| (f64::from(n) - expected) * (f64::from(n) - expected) / expected)
            .sum::<f64>();
    }
    // 191 degrees of freedom: mean 191, standard deviation 19.5; five deviations above the mean.
    println!("{what}: chi-squared {chi_squared:.1}, limit 290");
    assert!(chi_squared < 290.0, "{what}: {chi_squared}");
}

#[test]
fn cosine_hemisphere_has_its_density() {
    check("cosine", warp::cosine_hemisphere, 0.0, |z| z * z);
}

#[test]
fn uniform_cone_has_its_density() {
    for one_minus_cos_max in [2.0, 1.0, 0.3, 1e-3] {
        let low = 1.0 - one_minus_cos_max;
        check(
            "cone",
            |square| warp::uniform_cone(square, one_minus_cos_max),
            low,
            |z| (z - low) / one_minus_cos_max,
        );
    }
}

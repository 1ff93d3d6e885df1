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

/// A chi-squared test of counts in bins of equal share.
fn check_equal(what: &str, counts: &[u32]) {
    let expected = f64::from(counts.iter().sum::<u32>()) / counts.len() as f64;
    assert!(expected > 20.0, "the bins are too small for the test");
    let off = |&count: &u32| (f64::from(count) - expected) * (f64::from(count) - expected) / expected;
    let chi_squared: f64 = counts.iter().map(off).sum();
    // Five deviations of chi-squared above its mean.
    let degrees = counts.len() as f64 - 1.0;
    let limit = degrees + 5.0 * (2.0 * degrees).sqrt();
    println!("{what}: chi-squared {chi_squared:.1} of {degrees} degrees, limit {limit:.1}");
    assert!(chi_squared < limit, "{what}: {chi_squared}");
}

/// The filters' samples, by what turns their densities into equal shares: the cumulative distributions.
#[test]
fn filters_have_their_densities() {
    let mut sampler = Sampler::new(7, 8, Default::default());
    let (mut tents, mut discs) = ([0_u32; 64], [0_u32; TURNS * HEIGHTS]);
    for pixel in 0..SAMPLES {
        sampler.start(u64::from(pixel), pixel % 5);
        let (u, v) = sampler.pair(0);
        let x = warp::tent(u);
        assert!((-1.0..=1.0).contains(&x));
        // Half the square of the distance from the nearer end.
        let below = if x < 0.0 { 0.5 * (1.0 + x) * (1.0 + x) } else { 1.0 - 0.5 * (1.0 - x) * (1.0 - x) };
        tents[((below * 64.0) as usize).min(63)] += 1;
        let (x, y) = warp::gaussian_disc((u, v));
        let squared = x * x + y * y;
        assert!(squared <= 1.0 + 1e-12);
        // The share within a radius: 1 - exp(-r^2 / (2 sigma^2)), over that within 1.
        let within = (1.0 - libm::exp(-2.0 * squared)) / (1.0 - libm::exp(-2.0));
        let turn = libm::atan2(y, x) / TAU + 0.5;
        let bin = |share: f64, bins: usize| ((share * bins as f64) as usize).min(bins - 1);
        discs[bin(within, HEIGHTS) * TURNS + bin(turn, TURNS)] += 1;
    }
    check_equal("tent", &tents);
    check_equal("Gaussian disc", &discs);
}

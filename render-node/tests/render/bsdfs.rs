//! Are surfaces what they claim? Densities, energy, reciprocity, and what is known in closed form.

use crate::staging::Dice;
use core::f64::consts::TAU;
use geometry::Vec3;
use render_node::bsdf::{Bsdf, ComplexIndex, Ggx, Plastic, RoughConductor};
use schemas::scene::render::{Look, Metal};

const POLAR: usize = 10;
const TURNS: usize = 16;
const SAMPLES: u32 = 200_000;

fn look(bsdf: schemas::scene::render::Bsdf, roughness: f64) -> Look {
    Look { bsdf, roughness: Some(roughness), ..Default::default() }
}

fn kinds() -> Vec<(String, Bsdf)> {
    use schemas::scene::render::Bsdf::{Conductor, Lambertian, Plastic};
    let mut kinds = vec![("lambertian".to_owned(), Bsdf::new(&look(Lambertian, 0.5), [0.7, 0.5, 0.2]))];
    for roughness in [0.25, 0.5, 1.0] {
        kinds.push((format!("conductor {roughness}"), Bsdf::new(&look(Conductor, roughness), [0.5; 3])));
        kinds.push((format!("plastic {roughness}"), Bsdf::new(&look(Plastic, roughness), [0.7, 0.5, 0.2])));
    }
    kinds
}

fn views() -> [Vec3; 4] {
    [[0.0, 0.0], [0.5, 0.2], [1.2, -2.0], [1.5, 3.0]].map(|[polar, turn]| {
        let (sine, cosine) = libm::sincos(polar);
        Vec3::new(sine * libm::cos(turn), sine * libm::sin(turn), cosine)
    })
}

/// A direction by its height and turn.
fn direction(height: f64, turn: f64) -> Vec3 {
    let radius = (1.0 - height * height).sqrt();
    Vec3::new(radius * libm::cos(turn), radius * libm::sin(turn), height)
}

/// The integral of a function over the part of the upper hemisphere with heights and turns in two intervals, by the
/// midpoint rule.
fn integral(heights: (f64, f64), turns: (f64, f64), parts: (u32, u32), f: &dyn Fn(&Vec3) -> f64) -> f64 {
    let mut sum = 0.0;
    let middle = |(low, high): (f64, f64), k: u32, parts: u32| {
        low + (high - low) * (f64::from(k) + 0.5) / f64::from(parts)
    };
    for k in 0..parts.0 {
        for l in 0..parts.1 {
            sum += f(&direction(middle(heights, k, parts.0), middle(turns, l, parts.1)));
        }
    }
    sum * (heights.1 - heights.0) * (turns.1 - turns.0) / (f64::from(parts.0) * f64::from(parts.1))
}

/// A chi-squared test of `sample` against `pdf`, over bins of height and turn and one for what is absorbed or went to a
/// mirror's direction.
#[test]
fn directions_come_with_the_density_that_is_claimed() {
    let mut dice = Dice::new(31);
    for (name, bsdf) in kinds() {
        for wo in views() {
            let mut counts = vec![0_u32; POLAR * TURNS + 1];
            for _ in 0..SAMPLES {
                let bin = match bsdf.sample(&wo, (dice.unit(), dice.unit())) {
                    None => POLAR * TURNS,
                    Some(sample) => {
                        let pdf = bsdf.pdf(&wo, &sample.wi);
                        let claimed = sample.pdf.expect("these have no mirror");
                        assert!((claimed / pdf - 1.0).abs() < 1e-9, "{name}: {claimed} against {pdf}");
                        let weight = bsdf.eval(&wo, &sample.wi) / pdf;
                        assert!((weight - sample.weight).norm() < 1e-9 * (1.0 + weight.norm()), "{name}");
                        let turn = libm::atan2(sample.wi.y, sample.wi.x) / TAU + 0.5;
                        let bin = |share: f64, bins: usize| ((share * bins as f64) as usize).min(bins - 1);
                        bin(sample.wi.z, POLAR) * TURNS + bin(turn, TURNS)
                    }
                };
                counts[bin] += 1;
            }
            let mut expected: Vec<f64> = (0..POLAR * TURNS)
                .map(|bin| {
                    let (row, column) = ((bin / TURNS) as f64, (bin % TURNS) as f64);
                    let heights = (row / POLAR as f64, (row + 1.0) / POLAR as f64);
                    let turn = |column: f64| (column / TURNS as f64 - 0.5) * TAU;
                    let turns = (turn(column), turn(column + 1.0));
                    // A narrow lobe needs fine parts, above all of the height near the pole.
                    let parts = match name.contains("0.25") {
                        true if heights.1 == 1.0 => (600, 100),
                        true => (150, 100),
                        false => (60, 32),
                    };
                    let share = integral(heights, turns, parts, &|wi| bsdf.pdf(&wo, wi));
                    share * f64::from(SAMPLES)
                })
                .collect();
            let above: f64 = expected.iter().sum();
            assert!(above < f64::from(SAMPLES) * (1.0 + 1e-3), "{name}: the density adds up to {above}");
            expected.push(f64::from(SAMPLES) - above);
            // Bins where too few are expected are tested together.
            let (mut chi_squared, mut degrees, mut rest) = (0.0, -1.0, (0.0, 0.0));
            for (&count, &expected) in counts.iter().zip(&expected) {
                if expected < 20.0 {
                    rest = (rest.0 + f64::from(count), rest.1 + expected);
                } else {
                    chi_squared += (f64::from(count) - expected) * (f64::from(count) - expected) / expected;
                    degrees += 1.0;
                }
            }
            if rest.1 > 20.0 {
                chi_squared += (rest.0 - rest.1) * (rest.0 - rest.1) / rest.1;
                degrees += 1.0;
            }
            // Five deviations of chi-squared above its mean.
            let limit = degrees + 5.0 * (2.0_f64 * degrees).sqrt() + 10.0;
            println!(
                "{name} from height {:.2}: chi-squared {chi_squared:.1} of {degrees} degrees, limit {limit:.1}",
                wo.z
            );
            assert!(chi_squared < limit, "{name} from {wo:?}");
        }
    }
}

/// The weak furnace: facets that are white mirrors and hide, but do not shadow, reflect all light. It holds that
/// the distribution, the masking and the sampling are one.
#[test]
fn visible_facets_are_the_whole_surface() {
    for alpha in [0.05, 0.3, 1.0] {
        let facets = Ggx { alpha };
        for wo in views() {
            // Over all directions, also those below the surface, the density of reflected directions is that of visible
            // facets: integrated over the facets' normals, where the Jacobian is 4 (wo . normal).
            let visible = |normal: &Vec3| {
                let cosine = wo.dot(normal);
                let masking =
                    2.0 / (1.0 + (1.0 + alpha * alpha * (1.0 - wo.z * wo.z) / (wo.z * wo.z)).sqrt());
                if cosine > 0.0 { facets.density(normal) * cosine * masking / wo.z } else { 0.0 }
            };
            // Heights as 1 - s^4, so that a narrow peak is met.
            let mut sum = 0.0;
            const PARTS: u32 = 1500;
            for k in 0..PARTS {
                let s = (f64::from(k) + 0.5) / f64::from(PARTS);
                let height = 1.0 - s * s * s * s;
                let ring: f64 = (0..240)
                    .map(|l| visible(&direction(height, TAU * (f64::from(l) + 0.5) / 240.0)))
                    .sum::<f64>()
                    * TAU
                    / 240.0;
                sum += ring * 4.0 * s * s * s / f64::from(PARTS);
            }
            println!("alpha {alpha} from height {:.2}: {sum:.6}, expected 1, tolerance 2e-3", wo.z);
            assert!((sum - 1.0).abs() < 2e-3);
        }
    }
}

/// No surface gives more light than it gets, and a polished plastic with a white body gives all of it back.
#[test]
fn no_surface_makes_light() {
    let white = |facets| Bsdf::Plastic(Plastic::new(Vec3::repeat(1.0), 1.5, facets));
    let mut all = kinds();
    all.push(("white plastic, rough".to_owned(), white(Some(Ggx { alpha: 0.1 }))));
    for (name, bsdf) in all {
        for wo in views() {
            let mut dice = Dice::new(5);
            let mut sum = Vec3::zeros();
            for _ in 0..40_000 {
                if let Some(sample) = bsdf.sample(&wo, (dice.unit(), dice.unit())) {
                    sum += sample.weight;
                }
            }
            let reflected = sum / 40_000.0;
            println!("{name} from height {:.2}: reflects {:.4}", wo.z, reflected.max());
            // A rough coating lets light through as a polished one does, so its sum is not exact.
            let limit = if name.contains("white plastic") { 1.05 } else { 1.0 + 1e-2 };
            assert!(reflected.max() < limit, "{name}: {reflected:?}");
        }
    }
    for wo in views() {
        let polished = white(None);
        let coating = polished.sample(&wo, (1e-12, 0.5)).expect("a reflection");
        assert_eq!(coating.pdf, None);
        let body = integral((0.0, 1.0), (0.0, TAU), (4000, 1), &|wi| polished.eval(&wo, wi).x);
        // The coating's share of the samples times what one of them weighs.
        let share = polished_share(&polished, &wo);
        let all = body + coating.weight.x * share;
        println!(
            "polished white plastic from height {:.2}: reflects {all:.6}, expected 1, tolerance 1e-4",
            wo.z
        );
        assert!((all - 1.0).abs() < 1e-4);
    }
}

/// The share of samples that a polished coating takes, by bisection of the first random number.
fn polished_share(bsdf: &Bsdf, wo: &Vec3) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let coating = bsdf.sample(wo, (middle, 0.5)).is_some_and(|sample| sample.pdf.is_none());
        (low, high) = if coating { (middle, high) } else { (low, middle) };
    }
    0.5 * (low + high)
}

/// A metal without loss sends all light back, however rough: integrated over all directions.
#[test]
fn white_metal_is_white_at_any_roughness() {
    let white = ComplexIndex { eta: Vec3::repeat(1e-9), k: Vec3::repeat(10.0) };
    assert!((white.reflectance(0.3) - Vec3::repeat(1.0)).norm() < 1e-9);
    for alpha in [1e-3, 0.09, 0.25, 0.5, 1.0] {
        let metal = Bsdf::RoughConductor(Box::new(RoughConductor::new(white, Ggx { alpha })));
        for wo in views() {
            let mut dice = Dice::new(9);
            let (mut sum, mut squares) = (0.0, 0.0);
            const COUNT: u32 = 100_000;
            for _ in 0..COUNT {
                let weight =
                    metal.sample(&wo, (dice.unit(), dice.unit())).map_or(0.0, |sample| sample.weight.x);
                sum += weight;
                squares += weight * weight;
            }
            let mean = sum / f64::from(COUNT);
            let variance = squares / f64::from(COUNT) - mean * mean;
            let error = if variance > 0.0 { (variance / f64::from(COUNT)).sqrt() } else { 0.0 };
            // The table's: midpoints of 1152 strata and straight lines between 33 heights.
            println!(
                "alpha {alpha} from height {:.2}: {mean:.4} +- {error:.4}, expected 1, tolerance 0.005",
                wo.z
            );
            assert!((mean - 1.0).abs() < 4.5 * error + 0.005);
        }
    }
}

#[test]
fn light_takes_the_same_way_back() {
    let mut dice = Dice::new(8);
    for (name, bsdf) in kinds() {
        let mut worst: f64 = 0.0;
        for _ in 0..2_000 {
            let upper = |v: Vec3| Vec3::new(v.x, v.y, v.z.abs());
            let (a, b) = (upper(dice.direction()), upper(dice.direction()));
            let there = bsdf.eval(&a, &b) / b.z;
            let back = bsdf.eval(&b, &a) / a.z;
            let difference = (there - back).norm() / (1e-9 + there.norm());
            worst = if difference > worst { difference } else { worst };
        }
        println!("{name}: largest relative difference {worst:e}, tolerance 1e-10");
        assert!(worst < 1e-10, "{name}");
    }
}

/// What polished metals reflect straight down, in percent, as one knows them: silver and aluminium bright and grey,
/// steel dull and grey, gold, brass and copper red to yellow.
#[test]
fn metals_have_their_colours() {
    let reflectance = |metal| ComplexIndex::measured(metal).reflectance(1.0);
    for (metal, low, high) in [
        (Metal::Silver, [0.98, 0.97, 0.97], [1.0, 1.0, 1.0]),
        (Metal::Aluminium, [0.89, 0.90, 0.90], [0.93, 0.93, 0.93]),
        (Metal::Steel, [0.55, 0.54, 0.53], [0.66, 0.63, 0.60]),
        (Metal::Gold, [0.93, 0.75, 0.35], [0.97, 0.85, 0.45]),
        (Metal::Brass, [0.85, 0.75, 0.40], [0.92, 0.83, 0.50]),
        (Metal::Copper, [0.92, 0.58, 0.50], [0.95, 0.65, 0.58]),
    ] {
        let found = reflectance(metal);
        println!("{metal:?}: {:.3} {:.3} {:.3}", found.x, found.y, found.z);
        for channel in 0..3 {
            let inside = found[channel] >= low[channel] && found[channel] <= high[channel];
            assert!(inside, "{metal:?} {found:?}");
        }
    }
}

/// A polished and a hardly rough metal look the same from all sides but the last degrees.
#[test]
fn a_rough_metal_becomes_a_mirror() {
    use schemas::scene::render::Bsdf::Conductor;
    let polished = Bsdf::new(&look(Conductor, 0.0), [0.5; 3]);
    let rough = Bsdf::new(&look(Conductor, 0.04), [0.5; 3]);
    for wo in &views()[..3] {
        let mirror = polished.sample(wo, (0.5, 0.5)).expect("a mirror reflects");
        let mut dice = Dice::new(4);
        for _ in 0..500 {
            // The last hundredth of the distribution's long tail goes far.
            let square = (0.99 * dice.unit(), dice.unit());
            let sample = rough.sample(wo, square).expect("a narrow lobe stays above");
            // Ten times alpha at twice the angle of the facet, stretched by the view's slant.
            let apart = (sample.wi - mirror.wi).norm();
            assert!(apart < 2.0 * 10.0 * 0.04 * 0.04 / wo.z, "{apart} from {wo:?}");
            assert!((sample.weight - mirror.weight).norm() < 0.02, "{:?} {:?}", sample.weight, mirror.weight);
        }
    }
    assert!(polished.is_mirror() && !rough.is_mirror());
}

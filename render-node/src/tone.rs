//! From linear radiance to what a screen shows: tone mapping.

use geometry::Vec3;
use schemas::scene::render::ToneMapping;

/// Linear light of the screen (red, green, blue; 1 is white) for linear radiance times exposure.
pub fn tone_map(rgb: &Vec3, mapping: ToneMapping) -> Vec3 {
    match mapping {
        ToneMapping::Srgb => *rgb,
        ToneMapping::Aces => aces(rgb),
        ToneMapping::Agx => agx(rgb),
    }
}

/// # Source
/// Stephen Hill's fit of the ACES reference rendering and output transforms, as published with "Baking Lab" (MIT licence):
/// the matrices are between linear sRGB and the space in which the curve works.
fn aces(rgb: &Vec3) -> Vec3 {
    const INTO: [[f64; 3]; 3] =
        [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    const OUT: [[f64; 3]; 3] =
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    let curve =
        |v: f64| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    times(&OUT, &times(&INTO, rgb).map(curve))
}

/// # Source
/// Troy Sobotka's AgX, in the fit of Benjamin Wrensch, "Minimal AgX Implementation", 2023 (MIT licence): logarithm to the
/// base 2 between 2^-12.47393 and 2^4.026069, a polynomial of degree 6 for the curve, a power of 2.2 to linear light.
fn agx(rgb: &Vec3) -> Vec3 {
    const INTO: [[f64; 3]; 3] = [
        [0.842_479_062_253_094, 0.078_433_599_999_999_2, 0.079_223_745_147_764_3],
        [0.042_328_242_261_012_3, 0.878_468_636_469_772, 0.079_166_127_460_543_4],
        [0.042_375_654_905_705_1, 0.078_433_6, 0.879_142_973_793_104],
    ];
    const OUT: [[f64; 3]; 3] = [
        [1.196_879_005_120_17, -0.098_020_881_140_136_8, -0.099_029_744_079_720_5],
        [-0.052_896_851_757_456_2, 1.151_903_129_904_17, -0.098_961_176_844_843_3],
        [-0.052_971_635_514_443_8, -0.098_043_450_117_124_1, 1.151_073_672_641_16],
    ];
    const LEAST: f64 = -12.473_93;
    const MOST: f64 = 4.026_069;
    let curve = |v: f64| {
        let stops = if v > 1e-10 { libm::log2(v) } else { LEAST };
        let x = within((stops - LEAST) / (MOST - LEAST));
        let x2 = x * x;
        let x4 = x2 * x2;
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.002_32
    };
    times(&OUT, &times(&INTO, rgb).map(curve)).map(|encoded| libm::pow(within(encoded), 2.2))
}

/// The nearest number from 0 to 1.
fn within(value: f64) -> f64 {
    if !(value > 0.0) {
        0.0
    } else if value < 1.0 {
        value
    } else {
        1.0
    }
}

fn times(rows: &[[f64; 3]; 3], v: &Vec3) -> Vec3 {
    let row = |row: &[f64; 3]| row[0] * v.x + row[1] * v.y + row[2] * v.z;
    Vec3::new(row(&rows[0]), row(&rows[1]), row(&rows[2]))
}

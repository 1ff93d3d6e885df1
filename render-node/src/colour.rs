//! Bodies in colours that mean something: speed, penetration, number.

use crate::bsdf::Bsdf;

use geometry::{Aabb, Circle, Vec3, closest_points};
use schemas::scene::render::{ColourBy, Colouring};
use schemas::state::BodyState;

/// The colour map viridis at nine equally spaced places, as 8-bit sRGB.
///
/// # Source
/// Smith and van der Walt, "A Better Default Colormap for Matplotlib", SciPy 2015; in the public domain (CC0).
const VIRIDIS: [[u8; 3]; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2d, 0x7b],
    [0x3b, 0x52, 0x8b],
    [0x2c, 0x72, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x28, 0xae, 0x80],
    [0x5e, 0xc9, 0x62],
    [0xad, 0xdc, 0x30],
    [0xfd, 0xe7, 0x25],
];

/// A ring as the penetrations see it.
pub(crate) struct Wire {
    pub circle: Circle,
    pub minor_radius: f64,
    pub bounds: Aabb,
}

/// The surface of each body; none if looks are what is asked for.
pub(crate) fn surfaces(colouring: &Colouring, bodies: &[BodyState], wires: &[Wire]) -> Vec<Bsdf> {
    let coloured = |value: f64| Bsdf::Lambertian { albedo: viridis(value) };
    match colouring.by {
        ColourBy::Look => Vec::new(),
        ColourBy::Speed => {
            let max = colouring.max.unwrap_or(1.0);
            let speed = |body: &BodyState| Vec3::from(body.linear_velocity_m_per_s).norm();
            bodies.iter().map(|body| coloured(speed(body) / max)).collect()
        }
        ColourBy::Penetration => {
            let max = colouring.max.unwrap_or(0.05);
            let mut depths = penetrations(wires);
            depths.resize(bodies.len(), 0.0);
            depths.into_iter().map(|depth| coloured(depth / max)).collect()
        }
        ColourBy::Number => {
            (0..bodies.len()).map(|number| Bsdf::Lambertian { albedo: hue(number) }).collect()
        }
    }
}

/// How deep each ring is in another one, at most, over the diameter of the thinner wire.
fn penetrations(wires: &[Wire]) -> Vec<f64> {
    let mut deepest = vec![0.0; wires.len()];
    let mut order: Vec<usize> = (0..wires.len()).collect();
    order.sort_by(|&a, &b| wires[a].bounds.min.x.total_cmp(&wires[b].bounds.min.x).then(a.cmp(&b)));
    for (place, &a) in order.iter().enumerate() {
        for &b in &order[place + 1..] {
            let (first, second) = (&wires[a], &wires[b]);
            if second.bounds.min.x > first.bounds.max.x {
                break;
            }
            let apart = |axis: usize| {
                first.bounds.min[axis] > second.bounds.max[axis]
                    || second.bounds.min[axis] > first.bounds.max[axis]
            };
            if apart(1) || apart(2) {
                continue;
            }
            let distance = closest_points(&first.circle, &second.circle).distance;
            let (r, s) = (first.minor_radius, second.minor_radius);
            let share = (r + s - distance) / (2.0 * if r < s { r } else { s });
            for ring in [a, b] {
                if share > deepest[ring] {
                    deepest[ring] = share;
                }
            }
        }
    }
    deepest
}

/// The linear colour of a value from 0 to 1; what lies beyond has the last colour.
pub(crate) fn viridis(value: f64) -> Vec3 {
    let last = VIRIDIS.len() - 1;
    let scaled = if value > 0.0 { value * last as f64 } else { 0.0 };
    let index = (scaled as usize).min(last - 1);
    let share = if scaled < last as f64 { scaled - index as f64 } else { 1.0 };
    let [low, high] = [index, index + 1].map(|index| Vec3::from(VIRIDIS[index].map(linear)));
    low + (high - low) * share
}

/// A colour of its own for a number: hues that turn by the golden ratio.
fn hue(number: usize) -> Vec3 {
    let turns = number as f64 * 0.618_033_988_749_894_9;
    let turn = turns - libm::floor(turns);
    let channel = |shift: f64| {
        let (cosine, _) =
            crate::warp::circle_point(if turn + shift < 1.0 { turn + shift } else { turn + shift - 1.0 });
        0.45 + 0.4 * cosine
    };
    Vec3::new(channel(0.0), channel(1.0 / 3.0), channel(2.0 / 3.0))
}

/// The linear value of an 8-bit sRGB code.
fn linear(code: u8) -> f64 {
    let encoded = f64::from(code) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

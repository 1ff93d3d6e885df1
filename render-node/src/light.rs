//! Lights: where a ray meets them, and how a point is lit by them.

use crate::environment::EnvironmentMap;
use crate::flat::{all_lanes, meet_plane};
use crate::ray::{Ray, RayLanes};
use crate::warp::{self, Frame};
use core::f64::consts::PI;
use geometry::lanes::{LANES, Lanes, Simd, Vectors};
use geometry::{Vec3, plane, sphere};
use schemas::scene::render::{self, Light};
use std::sync::Arc;

/// An area light, compiled. A light reflects nothing and stops every ray.
#[derive(Clone, Debug)]
pub(crate) struct AreaLight {
    shape: LightShape,
    /// Emitted radiance (red, green, blue).
    radiance: Vec3,
}

#[derive(Clone, Debug)]
enum LightShape {
    Sphere { centre: Vec3, radius: f64 },
    Rectangle(Rectangle),
}

#[derive(Clone, Debug)]
struct Rectangle {
    corner: Vec3,
    edge_u: Vec3,
    edge_v: Vec3,
    normal: Vec3,
    /// Height of the plane along the normal.
    offset: f64,
    area: f64,
    /// The vectors whose products with `edge_u s + edge_v t` are s and t.
    inverse: [Vec3; 2],
}

/// One direction in which light may come from a light.
pub(crate) struct LightSample {
    /// Unit vector to the light.
    pub direction: Vec3,
    /// How far away the light is in that direction.
    pub distance: f64,
    /// Radiance that comes from there.
    pub radiance: Vec3,
    /// Density of the direction per solid angle.
    pub pdf: f64,
}

/// The same from sixteen points.
#[derive(Clone, Copy)]
pub(crate) struct LightSamples<S: Simd> {
    pub direction: Vectors<S>,
    pub distance: Lanes<S>,
    pub radiance: Vectors<S>,
    pub pdf: Lanes<S>,
    /// A bit for each point that the light may shine to.
    pub lit: u32,
}

impl<S: Simd> LightSamples<S> {
    /// No light to any point.
    #[inline(always)]
    pub(crate) fn none(simd: S) -> LightSamples<S> {
        let zero = Lanes::splat(simd, 0.0);
        let zeros = Vectors([zero; 3]);
        LightSamples { direction: zeros, distance: zero, radiance: zeros, pdf: zero, lit: 0 }
    }
}

impl AreaLight {
    /// The light, if it is one with an area.
    pub(crate) fn new(light: &Light) -> Option<AreaLight> {
        match light {
            Light::Sun { .. } | Light::Point { .. } => None,
            Light::Sphere { position_m, radius_m, radiance } => Some(AreaLight {
                shape: LightShape::Sphere { centre: Vec3::from(*position_m), radius: *radius_m },
                radiance: Vec3::from(*radiance),
            }),
            Light::Rectangle { corner_m, edge_u_m, edge_v_m, radiance } => {
                let (edge_u, edge_v) = (Vec3::from(*edge_u_m), Vec3::from(*edge_v_m));
                let cross = edge_u.cross(&edge_v);
                let area = cross.norm();
                let normal = cross / area;
                let inverse = [edge_v.cross(&normal) / area, normal.cross(&edge_u) / area];
                let corner = Vec3::from(*corner_m);
                let offset = normal.dot(&corner);
                let rectangle = Rectangle { corner, edge_u, edge_v, normal, offset, area, inverse };
                let shape = LightShape::Rectangle(rectangle);
                Some(AreaLight { shape, radiance: Vec3::from(*radiance) })
            }
        }
    }

    /// Whether the light shines at all.
    pub(crate) fn is_lit(&self) -> bool {
        self.radiance != Vec3::zeros()
    }

    /// Distance to the first hit beyond `t_min`.
    #[inline]
    pub(crate) fn hit(&self, ray: &Ray, t_min: f64) -> Option<f64> {
        match &self.shape {
            LightShape::Sphere { centre, radius } => {
                sphere::ray_sphere(&ray.origin, &ray.direction, centre, *radius, t_min)
            }
            LightShape::Rectangle(rectangle) => {
                let Rectangle { corner, normal, offset, inverse, .. } = rectangle;
                let t = plane::ray_plane(&ray.origin, &ray.direction, normal, *offset, t_min)?;
                let from_corner = ray.origin + ray.direction * t - corner;
                let (u, v) = (from_corner.dot(&inverse[0]), from_corner.dot(&inverse[1]));
                ((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)).then_some(t)
            }
        }
    }

    /// [`AreaLight::hit`] of up to sixteen rays, which are given in both ways; NaN where they do not meet it.
    #[inline(always)]
    pub(crate) fn hit_each<S: Simd>(
        &self,
        simd: S,
        rays: &[Ray],
        lanes: &RayLanes<S>,
        t_min: f64,
    ) -> Lanes<S> {
        let LightShape::Rectangle(rectangle) = &self.shape else {
            return Lanes::load_array(simd, self.hit_one_by_one(rays, t_min));
        };
        let Rectangle { corner, normal, offset, inverse, .. } = rectangle;
        let t = meet_plane(simd, lanes, normal, *offset, t_min);
        let from_corner = lanes.origin.plus(&lanes.direction.times(t)).minus(&all_lanes(simd, corner));
        let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let u = from_corner.dot(&all_lanes(simd, &inverse[0]));
        let v = from_corner.dot(&all_lanes(simd, &inverse[1]));
        let met = u.simd_ge(zero) & u.simd_le(one) & v.simd_ge(zero) & v.simd_le(one);
        met.select(t, Lanes::splat(simd, f64::NAN))
    }

    /// [`AreaLight::hit`] of up to sixteen rays.
    #[inline(never)]
    fn hit_one_by_one(&self, rays: &[Ray], t_min: f64) -> [f64; LANES] {
        let mut hits = [f64::NAN; LANES];
        for (hit, ray) in hits.iter_mut().zip(rays) {
            *hit = self.hit(ray, t_min).unwrap_or(f64::NAN);
        }
        hits
    }

    /// Radiance that is emitted against a ray that hits the light.
    pub(crate) fn emitted(&self, direction: &Vec3) -> Vec3 {
        match &self.shape {
            LightShape::Rectangle(rectangle) if rectangle.normal.dot(direction) >= 0.0 => Vec3::zeros(),
            _ => self.radiance,
        }
    }

    /// A direction from a point to the light; `None` where the light cannot shine to.
    ///
    /// A sphere is sampled uniformly in solid angle, a rectangle uniformly in area.
    #[inline]
    pub(crate) fn sample(&self, point: &Vec3, square: (f64, f64)) -> Option<LightSample> {
        match &self.shape {
            LightShape::Sphere { centre, radius } => {
                let to_centre = centre - point;
                let squared = to_centre.norm_squared();
                let sine_squared = radius * radius / squared;
                if !(sine_squared < 1.0) {
                    return self.sample_around(point, square);
                }
                let one_minus_cos_max = sine_squared / (1.0 + (1.0 - sine_squared).sqrt());
                let local = warp::uniform_cone(square, one_minus_cos_max);
                let distance = squared.sqrt();
                let axis = to_centre / distance;
                let direction = warp::Frame::about(&axis).world(&local);
                // Half a chord of the sphere; at the rim rounding may take it below zero.
                let offset_squared = squared * (local.x * local.x + local.y * local.y);
                let half_chord_squared = radius * radius - offset_squared;
                let half_chord = if half_chord_squared > 0.0 { half_chord_squared.sqrt() } else { 0.0 };
                Some(LightSample {
                    direction,
                    distance: distance * local.z - half_chord,
                    radiance: self.radiance,
                    pdf: 1.0 / (2.0 * PI * one_minus_cos_max),
                })
            }
            LightShape::Rectangle(rectangle) => {
                let Rectangle { corner, edge_u, edge_v, normal, area, .. } = rectangle;
                let to_light = corner + edge_u * square.0 + edge_v * square.1 - point;
                let squared = to_light.norm_squared();
                let distance = squared.sqrt();
                let direction = to_light / distance;
                let cosine = -direction.dot(normal);
                (cosine > 0.0).then(|| LightSample {
                    direction,
                    distance,
                    radiance: self.radiance,
                    pdf: squared / (area * cosine),
                })
            }
        }
    }

    /// [`AreaLight::sample`] from sixteen points, with the same bits; `None` for a kind that is asked one by one.
    #[inline(always)]
    pub(crate) fn sample_each<S: Simd>(
        &self,
        simd: S,
        point: &Vectors<S>,
        square: (Lanes<S>, Lanes<S>),
    ) -> Option<LightSamples<S>> {
        let LightShape::Rectangle(rectangle) = &self.shape else { return None };
        let edges = (all_lanes(simd, &rectangle.edge_u), all_lanes(simd, &rectangle.edge_v));
        let corner = all_lanes(simd, &rectangle.corner);
        let on_light = corner.plus(&edges.0.times(square.0)).plus(&edges.1.times(square.1));
        let to_light = on_light.minus(point);
        let squared = to_light.dot(&to_light);
        let distance = squared.sqrt();
        let [x, y, z] = to_light.0;
        let direction = Vectors([x / distance, y / distance, z / distance]);
        let cosine = -direction.dot(&all_lanes(simd, &rectangle.normal));
        Some(LightSamples {
            direction,
            distance,
            radiance: all_lanes(simd, &self.radiance),
            pdf: squared / (rectangle.area * cosine),
            lit: cosine.simd_gt(Lanes::splat(simd, 0.0)).to_bitmask(),
        })
    }

    /// From within a glowing sphere: all directions alike.
    #[cold]
    fn sample_around(&self, point: &Vec3, square: (f64, f64)) -> Option<LightSample> {
        let direction = warp::uniform_cone(square, 2.0);
        let distance = self.hit(&Ray::new(*point, direction), 0.0)?;
        Some(LightSample { direction, distance, radiance: self.radiance, pdf: 1.0 / (4.0 * PI) })
    }

    /// Density per solid angle with which `sample` chooses, from a point, a direction in which the light is this far away.
    #[inline]
    pub(crate) fn pdf(&self, point: &Vec3, direction: &Vec3, distance: f64) -> f64 {
        match &self.shape {
            LightShape::Sphere { centre, radius } => {
                let sine_squared = radius * radius / (centre - point).norm_squared();
                if !(sine_squared < 1.0) {
                    return 1.0 / (4.0 * PI);
                }
                let one_minus_cos_max = sine_squared / (1.0 + (1.0 - sine_squared).sqrt());
                1.0 / (2.0 * PI * one_minus_cos_max)
            }
            LightShape::Rectangle(rectangle) => {
                distance * distance / (rectangle.area * direction.dot(&rectangle.normal).abs())
            }
        }
    }
}

/// A point that shines, compiled.
#[derive(Clone, Debug)]
pub(crate) struct PointLight {
    position: Vec3,
    /// Radiant intensity.
    pub intensity: Vec3,
}

impl PointLight {
    /// The light, if it is one without size.
    pub(crate) fn new(light: &Light) -> Option<PointLight> {
        let Light::Point { position_m, intensity } = light else { return None };
        Some(PointLight { position: Vec3::from(*position_m), intensity: Vec3::from(*intensity) })
    }

    /// The one direction to it from each of sixteen points. Its `radiance` is the irradiance of a surface that faces it, as of a
    /// light of one steradian with a density of 1.
    #[inline(always)]
    pub(crate) fn sample_each<S: Simd>(&self, simd: S, point: &Vectors<S>) -> LightSamples<S> {
        let to_light = all_lanes(simd, &self.position).minus(point);
        let squared = to_light.dot(&to_light);
        let distance = squared.sqrt();
        let [x, y, z] = to_light.0;
        let share = 1.0 / squared;
        LightSamples {
            direction: Vectors([x / distance, y / distance, z / distance]),
            distance,
            radiance: all_lanes(simd, &self.intensity).times(share),
            pdf: Lanes::splat(simd, 1.0),
            // At the light itself there is no direction to it.
            lit: squared.simd_gt(Lanes::splat(simd, 0.0)).to_bitmask(),
        }
    }
}

/// A disc at infinity, compiled.
#[derive(Clone, Debug)]
pub(crate) struct Sun {
    frame: Frame,
    one_minus_cos_max: f64,
    /// Radiance of the disc.
    pub radiance: Vec3,
    /// Density per solid angle with which directions to it are chosen.
    pub pdf: f64,
}

impl Sun {
    /// The sun, if the light is one.
    pub(crate) fn new(light: &Light) -> Option<Sun> {
        let Light::Sun { direction, angular_radius_rad, irradiance } = light else { return None };
        let (sine, cosine) = libm::sincos(*angular_radius_rad);
        let one_minus_cos_max = sine * sine / (1.0 + cosine);
        Some(Sun {
            frame: Frame::about(&Vec3::from(*direction).normalize()),
            one_minus_cos_max,
            // The integral of the cosine over the disc is pi sin^2.
            radiance: Vec3::from(*irradiance) / (PI * sine * sine),
            pdf: 1.0 / (2.0 * PI * one_minus_cos_max),
        })
    }

    /// Whether it stands in a direction.
    #[inline]
    pub(crate) fn stands_at(&self, direction: &Vec3) -> bool {
        // Half the square of the distance from the axis' end is 1 - cos; near the axis it keeps its digits.
        0.5 * (direction - self.frame.z).norm_squared() <= self.one_minus_cos_max
    }

    pub(crate) fn sample(&self, square: (f64, f64)) -> LightSample {
        let direction = self.frame.world(&warp::uniform_cone(square, self.one_minus_cos_max));
        LightSample { direction, distance: f64::INFINITY, radiance: self.radiance, pdf: self.pdf }
    }
}

/// An environment map in its place.
#[derive(Clone, Debug)]
pub(crate) struct Environment {
    map: Arc<EnvironmentMap>,
    frame: Frame,
    scale: f64,
}

impl Environment {
    /// `axes` are two level axes.
    pub(crate) fn new(
        settings: &render::Environment,
        up: Vec3,
        axes: [Vec3; 2],
        map: EnvironmentMap,
    ) -> Environment {
        let (sine, cosine) = libm::sincos(settings.turn_rad);
        let x = axes[0] * cosine + axes[1] * sine;
        let frame = Frame { x, y: up.cross(&x), z: up };
        Environment { map: Arc::new(map), frame, scale: settings.scale }
    }

    /// Radiance from a direction, and the density with which it is chosen.
    pub(crate) fn eval(&self, direction: &Vec3) -> (Vec3, f64) {
        let (radiance, pdf) = self.map.eval(&self.frame.local(direction));
        (radiance * self.scale, pdf)
    }

    pub(crate) fn sample(&self, square: (f64, f64)) -> LightSample {
        let sample = self.map.sample(square);
        LightSample {
            direction: self.frame.world(&sample.direction),
            distance: f64::INFINITY,
            radiance: sample.radiance * self.scale,
            pdf: sample.pdf,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use random::Stream;

    fn unit(stream: &mut Stream) -> f64 {
        let bits = u64::from(stream.word()) << 32 | u64::from(stream.word());
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A chi-squared test of `sample` against `pdf`: directions from a point, counted in bins of the sphere, against the
    /// sum of the density over directions that meet the light, evenly spread over each bin.
    #[test]
    fn area_lights_are_sampled_with_the_density_that_is_claimed() {
        const POLAR: usize = 12;
        const TURNS: usize = 24;
        const SAMPLES: u32 = 100_000;
        const PARTS: u32 = 48;
        let ball = |position_m, radius_m| Light::Sphere { position_m, radius_m, radiance: [1.0; 3] };
        let sheet = |corner_m, edge_u_m, edge_v_m| Light::Rectangle {
            corner_m,
            edge_u_m,
            edge_v_m,
            radiance: [1.0; 3],
        };
        let point = Vec3::new(0.2, -0.1, 0.3);
        for (name, light) in [
            ("ball", ball([1.0, 1.5, 2.0], 1.2)),
            ("ball around the point", ball([0.0, 0.5, 0.0], 1.5)),
            ("parallelogram", sheet([-1.0, -2.0, 1.5], [0.5, 2.5, 0.3], [2.0, 0.2, -0.4])),
            ("slanting parallelogram", sheet([1.0, -1.0, -0.5], [0.0, 0.3, 2.0], [-0.1, 2.5, 0.0])),
        ] {
            let light = AreaLight::new(&light).expect("it has an area");
            let mut stream = Stream::new(3, 0, b"chainmail's test");
            let bin = |direction: &Vec3| {
                let place = |share: f64, bins: usize| ((share * bins as f64) as usize).min(bins - 1);
                let turn = libm::atan2(direction.y, direction.x) / (2.0 * PI) + 0.5;
                place(0.5 * (direction.z + 1.0), POLAR) * TURNS + place(turn, TURNS)
            };
            let mut counts = vec![0_u32; POLAR * TURNS];
            let mut turned_away = 0;
            for _ in 0..SAMPLES {
                let Some(sample) = light.sample(&point, (unit(&mut stream), unit(&mut stream))) else {
                    turned_away += 1;
                    continue;
                };
                let pdf = light.pdf(&point, &sample.direction, sample.distance);
                assert!((sample.pdf / pdf - 1.0).abs() < 1e-9, "{name}: {} against {pdf}", sample.pdf);
                counts[bin(&sample.direction)] += 1;
            }
            assert_eq!(turned_away, 0, "{name} shines to the point");
            let mut expected = vec![0.0; POLAR * TURNS];
            for k in 0..POLAR as u32 * PARTS {
                let z = 2.0 * (f64::from(k) + 0.5) / f64::from(POLAR as u32 * PARTS) - 1.0;
                for l in 0..TURNS as u32 * PARTS {
                    let turn = (f64::from(l) + 0.5) / f64::from(TURNS as u32 * PARTS) - 0.5;
                    let (sine, cosine) = libm::sincos(2.0 * PI * turn);
                    let radius = (1.0 - z * z).sqrt();
                    let direction = Vec3::new(radius * cosine, radius * sine, z);
                    if let Some(distance) = light.hit(&Ray::new(point, direction), 0.0) {
                        expected[bin(&direction)] += light.pdf(&point, &direction, distance);
                    }
                }
            }
            let cell = 4.0 * PI / (POLAR * TURNS) as f64 / f64::from(PARTS * PARTS);
            let whole = expected.iter().sum::<f64>() * cell;
            // Bins where too few are expected are tested together.
            let (mut chi_squared, mut degrees, mut rest) = (0.0, -1.0, (0.0, 0.0));
            let mut test = |count: f64, expected: f64| {
                chi_squared += (count - expected) * (count - expected) / expected;
                degrees += 1.0;
            };
            for (&count, &density) in counts.iter().zip(&expected) {
                let (count, expected) = (f64::from(count), density * cell * f64::from(SAMPLES));
                if expected < 50.0 {
                    rest = (rest.0 + count, rest.1 + expected);
                } else {
                    test(count, expected);
                }
            }
            if rest.1 > 50.0 {
                test(rest.0, rest.1);
            }
            // Five deviations of chi-squared above its mean, and what the sum over the light's edge is wrong by: cells of 1/48
            // of a bin's side, along an edge through a few bins, some thousandths of the count there.
            let limit = degrees + 5.0 * (2.0_f64 * degrees).sqrt() + 10.0;
            println!(
                "{name}: chi-squared {chi_squared:.1} of {degrees} degrees, limit {limit:.1}; density adds up to {whole:.4}"
            );
            assert!(chi_squared < limit && (whole - 1.0).abs() < 5e-3, "{name}");
        }
    }
}

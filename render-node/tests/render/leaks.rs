//! Rays from a surface: none meets where it starts, and none that goes into a body stays there.
//!
//! Also part of `examples/leaks.rs`, which asks ten million of them.

use crate::staging::{Dice, scene};
use geometry::polynomial::Polynomial;
use geometry::{Vec3, capsule, cuboid, torus};
use nalgebra::{Quaternion, UnitQuaternion};
use render_node::{Ray, RenderModel, World, initial_states};

/// What was found. A ray away from a body that meets it again at once is a self-hit; a ray into a body that meets nothing
/// is a leak.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub outward: u64,
    /// Outward rays that met the body again, elsewhere: it bends.
    pub again: u64,
    pub self_hits: u64,
    pub inward: u64,
    pub leaks: u64,
}

impl Counts {
    pub fn add(&mut self, other: &Counts) {
        self.outward += other.outward;
        self.again += other.again;
        self.self_hits += other.self_hits;
        self.inward += other.inward;
        self.leaks += other.leaks;
    }
}

/// Signed distance and direction outward at a point, both good near the surface.
type Outward = dyn Fn(&Vec3) -> (f64, Vec3);

/// A body of size 1: the scene's keys for it at a scale, and what is outward, in its own frame.
pub struct Kind {
    pub name: &'static str,
    keys: fn(f64) -> String,
    outward: Box<Outward>,
}

fn ring(name: &'static str, minor: f64, keys: fn(f64) -> String) -> Kind {
    let outward = move |p: &Vec3| {
        let (value, normal) = (torus::value(p, 1.0, minor), torus::normal(p, 1.0));
        (0.5 * value / minor, normal)
    };
    Kind { name, keys, outward: Box::new(outward) }
}

fn polynomial(name: &'static str, formula: &'static str, unit: f64, keys: fn(f64) -> String) -> Kind {
    let f = Polynomial::parse(formula).expect("a formula");
    let outward = move |p: &Vec3| {
        let (value, gradient) = f.value_and_gradient(&(p / unit));
        (unit * value / gradient.norm(), gradient.normalize())
    };
    Kind { name, keys, outward: Box::new(outward) }
}

const TORUS: &str = "(x^2 + y^2 + z^2 + 3)^2 - 16*(x^2 + y^2)";
const TANGLE: &str = "x^4 - 5*x^2 + y^4 - 5*y^2 + z^4 - 5*z^2 + 11.8";

/// Bodies of all shapes: rings most of all, and one of them as a polynomial.
pub fn kinds() -> Vec<Kind> {
    fn wire(scale: f64, minor: f64) -> String {
        format!("[[ring]]\nmajor_radius_m = {scale:?}\nminor_radius_m = {:?}\n", scale * minor)
    }
    let core = Vec3::new(0.6, 0.4, 0.2);
    vec![
        ring("ring 0.18", 0.18, |scale| wire(scale, 0.18)),
        ring("ring 0.5", 0.5, |scale| wire(scale, 0.5)),
        ring("ring 0.02", 0.02, |scale| wire(scale, 0.02)),
        ring("ring 0.001", 0.001, |scale| wire(scale, 0.001)),
        Kind {
            name: "sphere",
            keys: |scale| format!("[[sphere]]\nradius_m = {scale:?}\n"),
            outward: Box::new(|p| (p.norm() - 1.0, p.normalize())),
        },
        Kind {
            name: "capsule",
            keys: |scale| {
                format!("[[capsule]]\nradius_m = {:?}\nhalf_length_m = {:?}\n", 0.3 * scale, 0.7 * scale)
            },
            outward: Box::new(|p| {
                let (normal, distance) = capsule::segment_distance(p, 0.7);
                (distance - 0.3, normal)
            }),
        },
        Kind {
            name: "box, rounded",
            keys: |scale| {
                let half = [0.7, 0.5, 0.3].map(|half| half * scale);
                format!("[[box]]\nhalf_extents_m = {half:?}\nedge_radius_m = {:?}\n", 0.1 * scale)
            },
            outward: Box::new(move |p| {
                let (normal, distance) = cuboid::core_distance(p, &core);
                (distance - 0.1, normal)
            }),
        },
        polynomial("torus by formula", TORUS, 0.4, |scale| {
            let (unit, bound) = (0.4 * scale, 1.25 * scale);
            format!(
                "[[polynomial]]\nformula = \"{TORUS}\"\nscale_m = {unit:?}\nbounding_radius_m = {bound:?}\n"
            )
        }),
        polynomial("tangle", TANGLE, 0.3, |scale| {
            let (unit, bound) = (0.3 * scale, 1.1 * scale);
            format!(
                "[[polynomial]]\nformula = \"{TANGLE}\"\nscale_m = {unit:?}\nbounding_radius_m = {bound:?}\n"
            )
        }),
    ]
}

/// Rays from the points of one body where others met it, half of them outward, half inward.
pub fn rays(kind: &Kind, scale: f64, rays: u64, dice: &mut Dice) -> Counts {
    let place = dice.in_cube(3.0 * scale);
    let [x, y, z, w] = dice.quaternion();
    let turned = kind.name != "sphere";
    let pose = if turned { format!("orientation = {:?}\n", [x, y, z, w]) } else { String::new() };
    let scene = scene(&format!(
        "{}{pose}position_m = {:?}\nmass_kg = 1.0\nmaterial = \"a\"\n",
        (kind.keys)(scale),
        [place.x, place.y, place.z]
    ));
    let (model, _) = RenderModel::compile(&scene);
    let states = initial_states(&scene).expect("the formulas are those of bodies");
    let world = World::new(&model, &states).expect("the state is the scene's");
    let turn = if turned { Quaternion::new(w, x, y, z) } else { Quaternion::identity() };
    let turn = UnitQuaternion::new_normalize(turn);
    // Signed distance and outward normal at a point of World.
    let outward = |point: &Vec3| {
        let local = turn.inverse_transform_vector(&(point - place)) / scale;
        let (distance, normal) = (kind.outward)(&local);
        (distance * scale, turn.transform_vector(&normal))
    };
    let mut counts = Counts::default();
    while counts.outward + counts.inward < rays {
        let target = place + dice.direction() * (1.2 * scale * dice.unit());
        let eye = target + dice.direction() * (scale * (3.0 + 17.0 * dice.unit()));
        let sight = Ray::new(eye, (target - eye).normalize());
        let Some(hit) = world.closest(&sight) else { continue };
        let point = sight.origin + sight.direction * hit.distance;
        let (_, normal) = outward(&point);
        let leaving = (counts.outward + counts.inward) % 2 == 0;
        let side = if leaving { normal } else { -normal };
        let direction = (side + dice.direction()).normalize();
        let met = world.closest(&Ray::new(point, direction));
        // Half way to a crossing that is one, the ray is clearly on its side of the surface.
        let far_side = met.map(|hit| outward(&(point + direction * (0.5 * hit.distance))).0);
        if leaving {
            counts.outward += 1;
            counts.again += u64::from(met.is_some());
            counts.self_hits +=
                u64::from(far_side.is_some_and(|distance| distance <= 1e-14 * scale || distance.is_nan()));
        } else {
            counts.inward += 1;
            counts.leaks += u64::from(!far_side.is_some_and(|distance| distance < 0.0));
        }
    }
    counts
}

#[test]
fn rays_from_surfaces_of_all_sizes_neither_meet_themselves_nor_leak() {
    let mut dice = Dice::new(40);
    for kind in kinds() {
        let mut all = Counts::default();
        for exponent in [-6, -3, 0, 3, 6] {
            let scale = libm::pow(10.0, f64::from(exponent)) * (0.3 + 0.7 * dice.unit());
            let counts = rays(&kind, scale, 2_000, &mut dice);
            assert_eq!(
                (counts.self_hits, counts.leaks),
                (0, 0),
                "{} of size {scale:e} m: {counts:?}",
                kind.name
            );
            all.add(&counts);
        }
        println!("{}: {all:?}", kind.name);
        assert!(all.outward == 5_000 && all.inward == 5_000);
    }
}

//! Weaves: exactly the promised rings are linked, and no two wires are nearer than promised.

use geometry::circle::{closest_points, linked};
use schemas::scene::Scene;
use sim_node::{Model, ModelError};
use std::collections::BTreeSet;

struct Weave {
    pattern: &'static str,
    rows: u32,
    columns: u32,
    major_radius: f64,
    ratio: f64,
    more: &'static str,
}

impl Weave {
    fn scene(&self) -> Scene {
        let Weave { pattern, rows, columns, major_radius, ratio, more } = self;
        let text = format!(
            r#"
            [time]
            duration_s = 1.0
            time_step_s = 1e-9
            [material.wire]
            [[weave]]
            pattern = "{pattern}"
            rows = {rows}
            columns = {columns}
            major_radius_m = {major_radius:?}
            minor_radius_m = {:?}
            ring_mass_kg = 1.0
            material = "wire"
            position_m = [0.3, -0.7, 0.2]
            rotation_rad = [0.4, 1.1, -0.3]
            {more}
            "#,
            ratio * major_radius
        );
        Scene::parse(&text, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
    }
}

/// Looks at all pairs: the pairs that are linked, and the smallest gap between any two wires over the
/// smaller wire's radius.
fn look(scene: &Scene) -> (BTreeSet<(u32, u32)>, f64) {
    let (model, _) = Model::compile(scene).expect("the weave can be simulated");
    let circles: Vec<_> = scene
        .rings
        .iter()
        .map(|ring| {
            let [x, y, z, w] = ring.orientation;
            let q = nalgebra::UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
            geometry::Circle::from_pose(ring.position_m.into(), &q, ring.major_radius_m)
        })
        .collect();
    let (mut links, mut least) = (BTreeSet::new(), f64::INFINITY);
    for (a, ring_a) in scene.rings.iter().enumerate() {
        for (b, ring_b) in scene.rings.iter().enumerate().skip(a + 1) {
            if linked(&circles[a], &circles[b]) {
                links.insert((a as u32, b as u32));
            }
            let wires = ring_a.minor_radius_m + ring_b.minor_radius_m;
            let gap = (closest_points(&circles[a], &circles[b]).distance - wires) / wires;
            if gap < least {
                least = gap;
            }
        }
    }
    let found: BTreeSet<_> =
        model.linked_pairs().iter().map(|&(a, b)| if a < b { (a, b) } else { (b, a) }).collect();
    assert_eq!(found, links, "the model's links are those of all pairs");
    (links, least)
}

/// The pairs that a pattern promises.
fn promised(weave: &Weave) -> BTreeSet<(u32, u32)> {
    let (rows, columns) = (i64::from(weave.rows), i64::from(weave.columns));
    let number = |row: i64, column: i64| (row * columns + column) as u32;
    let mut links = BTreeSet::new();
    let mut connectors = rows * columns;
    for row in 0..rows {
        for column in 0..columns {
            let aslant = if row % 2 == 0 { [-1, 0] } else { [0, 1] };
            let others: Vec<(i64, i64)> = match weave.pattern {
                "european-4-in-1" => aslant.map(|shift| (1, shift)).to_vec(),
                "european-6-in-1" => vec![(1, -1), (1, 0), (1, 1)],
                "chain" => vec![(0, 1)],
                "japanese-8-in-2" => vec![(0, 1), (1, 0)],
                _ => vec![(0, 1), (1, aslant[0]), (1, aslant[1])],
            };
            for (up, along) in others {
                let (up, along) = (row + up, column + along);
                if up >= rows || !(0..columns).contains(&along) {
                    continue;
                }
                let (a, b) = (number(row, column), number(up, along));
                if weave.pattern.starts_with("japanese") {
                    for _ in 0..2 {
                        links.extend([(a, connectors as u32), (b, connectors as u32)]);
                        connectors += 1;
                    }
                } else {
                    links.insert((a, b));
                }
            }
        }
    }
    links
}

#[test]
fn exactly_the_promised_rings_are_linked_and_nothing_overlaps() {
    // Largest ratio of each pattern, less a hair.
    let patterns = [
        ("european-4-in-1", 0.2499),
        ("european-6-in-1", 0.1849),
        ("chain", 0.3124),
        ("japanese-8-in-2", 0.2022),
        ("japanese-12-in-2", 0.1597),
    ];
    for (pattern, largest) in patterns {
        let mut least_of_all = f64::INFINITY;
        for (rows, columns) in [(1, 1), (1, 5), (5, 1), (2, 2), (5, 6), (6, 5)] {
            for (major_radius, ratio) in [(1.0, 0.01), (0.4, 0.15), (3e-3, largest), (1e3, largest)] {
                let weave = Weave { pattern, rows, columns, major_radius, ratio, more: "" };
                let (links, least) = look(&weave.scene());
                assert_eq!(
                    links,
                    promised(&weave),
                    "{pattern} {rows}x{columns} R {major_radius} r/R {ratio}"
                );
                if least < least_of_all {
                    least_of_all = least;
                }
            }
        }
        println!("{pattern}: smallest gap {least_of_all:.2e} of both wires' radii, allowed: above 0");
        assert!(least_of_all > 0.0, "{pattern}: {least_of_all}");
    }
}

#[test]
fn connectors_may_have_any_size_that_fits() {
    for more in [
        "connector_minor_radius_m = 0.02\nconnector_mass_kg = 0.5",
        "connector_minor_radius_m = 0.05\nconnector_major_radius_m = 0.42",
        "connector_minor_radius_m = 0.02\nconnector_major_radius_m = 0.9",
    ] {
        for pattern in ["japanese-8-in-2", "japanese-12-in-2"] {
            let weave = Weave { pattern, rows: 4, columns: 4, major_radius: 1.0, ratio: 0.12, more };
            let scene = weave.scene();
            let (links, least) = look(&scene);
            assert_eq!(links, promised(&weave), "{pattern} {more}");
            let connector = scene.rings.last().unwrap();
            println!("{pattern}: connectors of {} m, smallest gap {least:.2e}", connector.major_radius_m);
            assert!(least > 0.0);
        }
    }
    // Without a mass of its own a connector is of the same metal: mass over R r^2 is the same.
    let weave =
        Weave { pattern: "japanese-12-in-2", rows: 2, columns: 2, major_radius: 0.4, ratio: 0.1, more: "" };
    let scene = weave.scene();
    let density = |ring: &schemas::scene::Ring| {
        ring.mass_kg / (ring.major_radius_m * ring.minor_radius_m * ring.minor_radius_m)
    };
    let (first, last) = (density(&scene.rings[0]), density(scene.rings.last().unwrap()));
    assert!((first / last - 1.0).abs() < 1e-14, "{first} {last}");
}

/// What the schemas allow, the overlap check allows too; one step beyond, and it would not.
#[test]
fn a_wire_beyond_the_patterns_room_would_overlap() {
    for (pattern, ratio) in [("european-4-in-1", 0.2499), ("european-6-in-1", 0.1849)] {
        let weave = Weave { pattern, rows: 6, columns: 6, major_radius: 1.0, ratio, more: "" };
        let mut scene = weave.scene();
        scene.rings.iter_mut().for_each(|ring| ring.minor_radius_m *= 1.002);
        let refused = Model::compile(&scene).expect_err("the wires are too thick");
        assert!(matches!(refused, ModelError::Overlap { .. }), "{refused}");
    }
}

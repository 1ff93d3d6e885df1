//! All minima of the distance along contact arcs against dense sampling.

use crate::random::{Random, angles, degenerate_pairs};
use geometry::arc::circle_circle_arcs;
use geometry::circle::point_circle_distance;
use geometry::minima::{Minima, circle_circle_minima};
use geometry::{Arcs, Circle};

/// Minima by sampling: lower than both neighbours, and below the reach.
fn sampled(a: &Circle, b: &Circle, reach: f64, table: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let at: Vec<f64> = table.iter().map(|&(c, s)| point_circle_distance(&a.point(c, s), b)).collect();
    let n = at.len();
    (0..n)
        .filter(|&i| at[i] < at[(i + n - 1) % n] && at[i] <= at[(i + 1) % n] && at[i] < reach)
        .map(|i| table[i])
        .collect()
}

fn found(a: &Circle, b: &Circle, reach: f64) -> (Arcs, Minima) {
    let arcs = circle_circle_arcs(a, b, reach);
    (arcs, circle_circle_minima(a, b, &arcs))
}

#[test]
fn no_minimum_is_missed_and_none_invented() {
    let table = angles(4000, 0.3);
    let mut random = Random(77);
    let (mut pairs, mut with_two, mut in_one_arc, mut nearly) = (0, 0, 0, 0);
    let mut worst: f64 = 0.0;
    while pairs < 20_000 {
        let (a, b) = (random.circle(1.2, random_radius(pairs)), random.circle(1.2, 1.0));
        let (arcs, minima) = found(&a, &b, 0.36);
        if arcs.is_empty() {
            continue;
        }
        pairs += 1;
        for connected in 0..arcs.connected_count() {
            assert!(minima.count_in(connected as u8) > 0, "an arc without a minimum: {a:?} {b:?}");
        }
        let expected = sampled(&a, &b, 0.36, &table);
        for (c, s) in &expected {
            let nearest = minima.as_slice().iter().map(|m| 1.0 - (m.cos * c + m.sin * s)).fold(2.0, smaller);
            // Half a sample apart, 8e-4 rad, is 3e-7; where the distance is very flat the samples' choice is rounding.
            worst = if nearest > worst { nearest } else { worst };
            assert!(nearest < 2e-6, "missed by {nearest:e}: {a:?} {b:?}");
        }
        // More than the samples show: two minima between three samples.
        nearly += i32::from(minima.as_slice().len() > expected.len());
        with_two += i32::from(minima.as_slice().len() > 1);
        in_one_arc += i32::from(minima.count_in(0) > 1);
    }
    println!(
        "{pairs} pairs in contact, {with_two} with two minima, {in_one_arc} with two in one arc, {nearly} with more than \
         4000 samples show; farthest 1 - cos {worst:.1e}, allowed 2e-6"
    );
    assert!(nearly <= 20, "{nearly} minima that sampling does not show");
    assert!(with_two > 1000 && in_one_arc > 100);
}

fn random_radius(index: i32) -> f64 {
    [1.0, 0.7, 0.4][index as usize % 3]
}

fn smaller(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

#[test]
fn flat_distances_have_four_quarters() {
    for (name, a, b) in degenerate_pairs(1.0) {
        let (arcs, minima) = found(&a, &b, 0.37);
        let share: f64 = minima.as_slice().iter().map(|minimum| minimum.share).sum();
        println!(
            "{name}: {} arcs, {} minima, shares {share}",
            arcs.connected_count(),
            minima.as_slice().len()
        );
        assert_eq!(arcs.is_empty(), minima.as_slice().is_empty(), "{name}");
        let flat = name.starts_with("identical") || (name.starts_with("coaxial 0") && !arcs.is_empty());
        if flat {
            assert_eq!((minima.as_slice().len(), share), (4, 1.0), "{name}");
        }
    }
}

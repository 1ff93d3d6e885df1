//! Ten million rays from surfaces: do any meet the place where they start, or get lost in a body?
//!
//! `cargo run --release -p render-node --example leaks [-- RAYS]`. Bodies of all shapes and of sizes from 1e-6 m to 1e6 m, each
//! in a random pose; the rays start where other rays met the body, as a path's do. Prints counts and ends with exit
//! code 1 if there is one self-hit or one leak.

#[path = "../tests/render/leaks.rs"]
#[allow(dead_code)]
mod leaks;
#[path = "../tests/render/staging.rs"]
#[allow(dead_code)]
mod staging;

use leaks::{Counts, kinds, rays};
use staging::Dice;
use std::process::ExitCode;

/// Rays with one body, until it is put elsewhere with another size.
const BATCH: u64 = 10_000;

fn main() -> ExitCode {
    let wanted = std::env::args().nth(1).map_or(10_000_000, |text| text.parse().expect("a number of rays"));
    let mut dice = Dice::new(41);
    let kinds = kinds();
    // Every other body is a ring.
    let (rings, others): (Vec<_>, Vec<_>) = kinds.iter().partition(|kind| kind.name.starts_with("ring"));
    let mut counts = vec![Counts::default(); kinds.len()];
    let batches = u64::max(wanted / BATCH, 1);
    for batch in 0..batches {
        let group = if batch % 2 == 0 { &rings } else { &others };
        let kind = group[(batch / 2) as usize % group.len()];
        let scale = libm::pow(10.0, 12.0 * dice.unit() - 6.0);
        let index = kinds.iter().position(|other| other.name == kind.name).expect("one of them");
        counts[index].add(&rays(kind, scale, BATCH, &mut dice));
    }
    println!("sizes from 1e-6 m to 1e6 m\n");
    println!("| body | outward rays | that meet it elsewhere | self-hits | inward rays | leaks |");
    println!("|--|--|--|--|--|--|");
    let mut all = Counts::default();
    for (kind, own) in kinds.iter().zip(&counts) {
        all.add(own);
        print(kind.name, own);
    }
    print("all", &all);
    if all.self_hits + all.leaks > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

fn print(name: &str, counts: &Counts) {
    let Counts { outward, again, self_hits, inward, leaks } = counts;
    println!("| {name} | {outward} | {again} | {self_hits} | {inward} | {leaks} |");
}

//! Writes the seeds of the fuzz targets into `corpus/`: `cargo run --release --bin seeds`.

#[path = "../recorder/tests/sample/mod.rs"]
mod sample;

use sample::Run;
use std::path::Path;

const FORMULAS: [&str; 10] = [
    "x^2 + y^2 + z^2 - 1",
    "(x^2 + y^2 + z^2 + 0.3)^2 - 4*(x^2 + y^2)",
    "-x*y*z + 1e-3*x^6",
    "x",
    "2.5e2*(x - 1)*(y + .5)^3",
    "((((z))))",
    "x^2/4 - 1",
    "1 - x**2",
    "x^16 + y^16 + z^16 - 1",
    "x^99999999999",
];

fn main() -> std::io::Result<()> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    for folder in ["log", "polynomial", "scene"] {
        std::fs::create_dir_all(corpus.join(folder))?;
    }
    for (number, formula) in FORMULAS.iter().enumerate() {
        std::fs::write(corpus.join(format!("polynomial/seed-{number}")), formula)?;
    }
    let small = Run { rings: 0, steps_planned: 0, steps: 0, renderer: false, ..Run::default() };
    let runs = [small, Run { rings: 1, steps_planned: 3, steps: 3, ..small }, Run { steps: 2, ..Run::default() }];
    for (number, run) in runs.iter().enumerate() {
        for flag in [0, 1] {
            let mut bytes = run.log_bytes();
            bytes.push(flag);
            std::fs::write(corpus.join(format!("log/seed-{number}-{flag}")), bytes)?;
        }
    }
    Ok(())
}

//! Time of a step against the number of rings and threads.

use crate::Effort;
use crate::accuracy::slope;
use crate::report::{Axis, Figure, Plot, Point, Section, Series, Table};
use crate::timing::compile;
use schemas::state;
use sim_node::broad::{self, Method};
use sim_node::{Model, Scratch, State, step};
use std::time::Instant;

const BROAD_PHASES: [(&str, Method); 4] = [
    ("grid", Method::Grid),
    ("range-tree", Method::RangeTree),
    ("sweep-and-prune", Method::SweepAndPrune),
    ("brute", Method::Brute),
];

/// Radius of a sphere around a ring (m).
const REACH: f64 = 1.18;

/// Above this many rings looking at every pair takes too long to show.
const BRUTE_MOST: usize = 10_000;

fn sizes(effort: Effort) -> Vec<(u32, u32)> {
    let mut sizes = vec![(5, 2), (10, 10), (32, 32), (100, 100)];
    if effort == Effort::Full {
        sizes.extend([(100, 316), (316, 317)]);
    }
    sizes
}

pub(crate) fn parts(effort: Effort) -> usize {
    sizes(effort).len()
}

/// A hanging sheet.
fn scene(rows: u32, columns: u32) -> Result<Model, String> {
    let pins: Vec<String> = (0..columns).map(|column| format!("[0, {column}]")).collect();
    compile(&format!(
        "[time]\nduration_s = 10.0\ntime_step_s = 1e-3\n[forces]\ngravity_m_per_s2 = [0.0, 9.81, 0.0]\n[material.wire]\n\
         line_stiffness_n_per_m2 = 3.8e5\ndamping_s_per_m = 0.3\n[[weave]]\npattern = \"european-4-in-1\"\nrows = {rows}\ncolumns = {columns}\n\
         major_radius_m = 1.0\nminor_radius_m = 0.18\nring_mass_kg = 0.63956\nmaterial = \"wire\"\npins = [{}]\n",
        pins.join(", ")
    ))
}

pub(crate) fn study(effort: Effort, part: &mut dyn FnMut(&str)) -> Section {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = if threads > 1 { vec![1, 2] } else { vec![1] };
    let mut steps: Vec<Series> = threads
        .iter()
        .enumerate()
        .map(|(colour, threads)| Series {
            name: format!("a step, {threads} threads"),
            colour,
            points: Vec::new(),
        })
        .collect();
    let mut pairs: Vec<Series> = BROAD_PHASES
        .iter()
        .enumerate()
        .map(|(colour, (name, _))| Series { name: (*name).to_owned(), colour, points: Vec::new() })
        .collect();
    let mut rows = Vec::new();
    let mut faults = Vec::new();
    for (height, width) in sizes(effort) {
        let rings = height as usize * width as usize;
        part(&format!("a sheet of {rings} rings"));
        let Ok(model) = scene(height, width) else { continue };
        let start = settled(&model, effort.pick(50, 400));
        let mut hashes = Vec::new();
        let mut row = vec![rings.to_string()];
        for (series, &threads) in steps.iter_mut().zip(&threads) {
            let (times, hash) = time_of_a_step(&model, &start, threads, effort);
            let ns = 1e9 * times[1] / rings as f64;
            let label =
                format!("{rings} rings, {threads} threads: {:.3e} s a step, {ns:.0} ns a ring", times[1]);
            let mut point = Point::at(rings as f64, times[1], label);
            point.y_interval = Some([times[0], times[2]]);
            series.points.push(point);
            hashes.push(hash);
            row.push(format!("{ns:.0}"));
        }
        let same = hashes.iter().all(|hash| *hash == hashes[0]);
        if !same {
            faults.push(format!(
                "scaling: {rings} rings have other bits with other numbers of threads: {hashes:?}"
            ));
        }
        row.push(if same { "same" } else { "DIFFERENT" }.to_owned());
        let centres: Vec<_> = start.bodies.iter().map(|body| body.position_m.into()).collect();
        let radii = vec![REACH; rings];
        let mut workspace = broad::Workspace::default();
        let mut found = Vec::new();
        for (series, &(name, method)) in pairs.iter_mut().zip(&BROAD_PHASES) {
            if method == Method::Brute && rings > BRUTE_MOST {
                continue;
            }
            let mut best = f64::INFINITY;
            for _ in 0..effort.pick(3, 7) {
                let begin = Instant::now();
                broad::find_pairs(method, &centres, &radii, 0.0, &mut workspace, &mut found);
                let spent = begin.elapsed().as_secs_f64();
                best = if spent < best { spent } else { best };
            }
            let label = format!("{name}, {rings} rings: {:.3e} s, {} pairs", best, found.len());
            series.points.push(Point::at(rings as f64, best, label));
        }
        rows.push(row);
    }
    let mut exponents: Vec<Vec<String>> = Vec::new();
    for series in steps.iter().chain(&pairs) {
        let logs: Vec<(f64, f64)> = series
            .points
            .iter()
            .filter(|point| point.x >= 100.0)
            .map(|point| (libm::log(point.x), libm::log(point.y)))
            .collect();
        let exponent = slope(&logs).map_or_else(|| "-".to_owned(), |slope| format!("{slope:.2}"));
        exponents.push(vec![series.name.clone(), exponent]);
    }
    let mut head = vec!["rings".to_owned()];
    head.extend(threads.iter().map(|threads| format!("ns a ring and step, {threads} threads")));
    head.push("bits".to_owned());
    let plot = |id: &str, title: &str, caption: &str, series: Vec<Series>| {
        Figure::Plot(Plot {
            id: id.to_owned(),
            title: title.to_owned(),
            caption: caption.to_owned(),
            x: Axis::log("rings"),
            y: Axis::log("time (s)"),
            series,
            levels: Vec::new(),
        })
    };
    let table = |id: &str, title: &str, caption: &str, head: Vec<String>, rows: Vec<Vec<String>>| {
        Figure::Table(Table {
            id: id.to_owned(),
            title: title.to_owned(),
            caption: caption.to_owned(),
            head,
            rows,
        })
    };
    Section {
        faults,
        id: "scaling",
        title: "Scaling".to_owned(),
        text: vec!["Hanging sheets of 4-in-1, falling into their first row, steps of 1 ms.".to_owned()],
        figures: vec![
            plot(
                "scaling-steps",
                "Time of a step",
                "Wall time of one step, the median of several rounds; bars: fastest and slowest round.",
                steps,
            ),
            plot(
                "scaling-broad",
                "Finding the near pairs anew",
                "Wall time, the best of several. A step does it only when something has moved far enough.",
                pairs,
            ),
            table(
                "scaling-table",
                "A ring's share of a step",
                "The same bits whatever the number of threads.",
                head,
                rows,
            ),
            table(
                "scaling-exponents",
                "Fitted exponents",
                "Time grows as this power of the number of rings, from 100 rings on.",
                ["what", "exponent"].map(str::to_owned).to_vec(),
                exponents,
            ),
        ],
    }
}

fn settled(model: &Model, steps: u64) -> State {
    let mut state = State::initial(model);
    let mut scratch = Scratch::new(model, 1);
    for _ in 0..steps {
        if step(model, &mut state, &mut scratch).is_err() {
            break;
        }
    }
    state
}

/// Smallest, median and largest wall time of a step (s), and the hash of the last state.
fn time_of_a_step(model: &Model, start: &State, threads: usize, effort: Effort) -> ([f64; 3], String) {
    let mut scratch = Scratch::new(model, threads);
    let mut state = start.clone();
    let steps = (effort.pick(100_000, 400_000) / model.ring_count() + 2).clamp(5, 400);
    let mut times = Vec::new();
    for round in 0..=effort.pick(3, 5) {
        let begin = Instant::now();
        for _ in 0..steps {
            if step(model, &mut state, &mut scratch).is_err() {
                break;
            }
        }
        // The first round warms up.
        if round > 0 {
            times.push(begin.elapsed().as_secs_f64() / steps as f64);
        }
    }
    times.sort_by(f64::total_cmp);
    let hash = state::encode(&state.header(), &state.bodies, &state.contacts, &mut Vec::new());
    ([times[0], times[times.len() / 2], times[times.len() - 1]], hash.short())
}

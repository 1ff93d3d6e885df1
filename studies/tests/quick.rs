//! The quick report: what it must show on any machine.

use schemas::scene::Scene;
use studies::{Effort, Figure, NamedScene, Report, Study, Table};

fn report(studies: &[Study]) -> Report {
    let scenes = [("two-rings", include_str!("../../scenes/two-rings.toml"))].map(|(name, text)| {
        NamedScene { name: name.to_owned(), scene: Scene::parse(text, &[]).expect("a shipped scene") }
    });
    let mut seen = Vec::new();
    let report = studies::run(studies, Effort::Quick, &scenes, None, &mut |done, total, _| {
        seen.push((done, total));
    });
    let total = seen[0].1;
    let expected: Vec<_> = (0..=total).map(|done| (done, total)).collect();
    assert_eq!(seen, expected, "progress counts every part once");
    report
}

fn table<'a>(report: &'a Report, id: &str) -> &'a Table {
    let figures = report.sections.iter().flat_map(|section| &section.figures);
    let tables = figures.filter_map(|figure| match figure {
        Figure::Table(table) => Some(table),
        _ => None,
    });
    tables.into_iter().find(|table| table.id == id).expect("the table is in the report")
}

/// A row of the table of orders: the order, the smallest error, the force evaluations of the finest run.
fn order<'a>(report: &'a Report, problem: &str, integrator: &str) -> [&'a str; 3] {
    let rows = &table(report, "orders").rows;
    let row = rows.iter().find(|row| row[0] == problem && row[1] == integrator).expect("each has a row");
    [&row[2], &row[3], &row[4]]
}

fn written(report: &Report, name: &str) -> String {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    let page = studies::write(report, &folder).expect("the report can be written");
    for figure in report.sections.iter().flat_map(|section| &section.figures) {
        let csv =
            std::fs::read_to_string(folder.join(format!("{}.csv", figure.id()))).expect("a CSV of each");
        let records = match figure {
            Figure::Plot(plot) => plot.series.iter().map(|series| series.points.len()).sum(),
            Figure::Map(map) => map.cells.len(),
            Figure::Table(table) => table.rows.len(),
        };
        assert_eq!(csv.lines().count(), records + 1, "{}", figure.id());
    }
    std::fs::read_to_string(page).expect("the page is there")
}

/// The methods' own orders, where contacts neither open nor close: fitted over four runs whose next term is a tenth.
#[test]
fn observed_orders_and_error_ceilings() {
    let report = report(&[Study::Accuracy]);
    table(&report, "orders").rows.iter().for_each(|row| println!("{row:?}"));
    let expected = [
        ("Torque-free top", "rk4", 4.0),
        ("Torque-free top", "energy-decaying", 2.0),
        ("Throw with linear drag", "verlet", 2.0),
        ("Throw with linear drag", "rk4", 4.0),
        ("Throw with linear drag", "backward-euler", 1.0),
        ("Throw with linear drag", "energy-decaying", 2.0),
        ("Bounce without damping", "backward-euler", 1.0),
    ];
    for (problem, integrator, order_expected) in expected {
        let observed: f64 = order(&report, problem, integrator)[0].parse().expect("an order");
        assert!((observed - order_expected).abs() < 0.3, "{problem}, {integrator}: {observed}");
    }
    assert_eq!(order(&report, "Torque-free top", "verlet")[0], "exact to rounding");
    // Measured, with room for half as much again; the counts are the cost.
    let ceilings = [
        ("Torque-free top", "rk4", 6e-7, 1280),
        ("Throw with linear drag", "verlet", 2e-3, 64),
        ("Throw with linear drag", "rk4", 8e-8, 256),
        ("Bounce without damping", "verlet", 1e-5, 1280),
        ("Sheet of 4 by 4 rings", "verlet", 6e-6, 1200),
        ("Sheet of 4 by 4 rings", "rk4", 6e-7, 4800),
    ];
    for (problem, integrator, error, evaluations) in ceilings {
        let [_, measured, count] = order(&report, problem, integrator);
        let (measured, count): (f64, u64) =
            (measured.parse().expect("an error"), count.parse().expect("a count"));
        assert!(measured <= error && count == evaluations, "{problem}, {integrator}: {measured:e}, {count}");
    }
    let page = written(&report, "accuracy");
    assert!(page.contains("<svg") && !page.contains("NaN") && !page.contains("inf"), "numbers have places");
}

/// Below the predicted limit nothing blows up and no link is lost; an implicit method, which has no limit, never does.
#[test]
fn stability_limits() {
    let report = report(&[Study::Stability]);
    let figures = report.sections.iter().flat_map(|section| &section.figures);
    let (mut below, mut beyond) = (0, [0; 2]);
    for figure in figures {
        let Figure::Map(map) = figure else { panic!("a section of maps") };
        let columns = map.x.1.len();
        for (index, (outcome, label)) in map.cells.iter().enumerate() {
            let (x, limit) = (map.x.1[index % columns], map.limit[index / columns]);
            if x <= limit {
                below += 1;
                assert!(*outcome < 2, "{}: limit {limit}, {label}", map.id);
            } else if x > 4.0 * limit {
                beyond[usize::from(*outcome >= 2)] += 1;
            }
        }
    }
    println!("{below} runs below the limit; beyond four times it {beyond:?} went well and badly");
    assert!(below > 200 && beyond[1] > 10, "the maps show both sides");
    let page = written(&report, "stability");
    assert!(page.contains("predicted limit") && !page.contains("NaN"));
}

/// The slopes that theory says, and one set of bits for plans and threads.
#[test]
fn forces_energy_scaling_and_plans() {
    let report = report(&[Study::Contact, Study::Energy, Study::Scaling, Study::LeftOut]);
    let slope = |sampler: &str| {
        let rows = &table(&report, "contact-slopes").rows;
        let row = rows.iter().find(|row| row[0] == "10 %" && row[1] == sampler).expect("each has a row");
        row[2].parse::<f64>().expect("a slope")
    };
    for sampler in ["uniform-angles", "uniform", "stratified", "sobol", "patch"] {
        println!("{sampler}: {}", slope(sampler));
    }
    // The root of the mean square of 16 draws is uncertain by a sixth, and so is the slope over a factor of 64 by a tenth.
    assert!((slope("uniform") + 0.5).abs() < 0.15 && slope("sobol") < -0.75 && slope("patch") < -0.9);
    let rows = &table(&report, "energy-table").rows;
    let largest: f64 = rows[0][5].parse().expect("a drift");
    println!("verlet: {largest:e} of the largest kinetic energy");
    // The sheet is chaotic and the step half the bound: forces that differed by rounding gave 1.1e-2 and 2.0e-2. It falls
    // with the square of the step.
    assert!(largest < 0.04);
    let faults: Vec<_> = report.sections.iter().flat_map(|section| &section.faults).collect();
    assert!(faults.is_empty(), "{faults:?}");
    let page = written(&report, "rest");
    assert!(page.contains("Time of a step") && !page.contains("DIFFERENT"));
}

//! What a report is made of.

use crate::Effort;
use serde::Serialize;

/// All that was measured.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of the program.
    pub version: &'static str,
    /// Processor, cores and instruction set of the machine.
    pub machine: String,
    /// Whether this is the quick report.
    pub quick: bool,
    /// One for each study.
    pub sections: Vec<Section>,
}

impl Report {
    pub(crate) fn new(effort: Effort) -> Report {
        Report {
            version: env!("CARGO_PKG_VERSION"),
            machine: machine(),
            quick: effort == Effort::Quick,
            sections: Vec::new(),
        }
    }
}

/// What one study found.
#[derive(Clone, Debug, Serialize)]
pub struct Section {
    /// A word for links and file names.
    pub id: &'static str,
    /// The heading.
    pub title: String,
    /// What was done, and how to read it: paragraphs.
    pub text: Vec<String>,
    /// What came out.
    pub figures: Vec<Figure>,
    /// What must not be: bits that differ where they have to be the same.
    pub faults: Vec<String>,
}

/// A picture or a table.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Figure {
    /// Points and lines.
    Plot(Plot),
    /// Outcomes over a plane of two settings.
    Map(Map),
    /// Words and numbers.
    Table(Table),
}

impl Figure {
    /// The figure's word for links and file names.
    pub fn id(&self) -> &str {
        match self {
            Figure::Plot(plot) => &plot.id,
            Figure::Map(map) => &map.id,
            Figure::Table(table) => &table.id,
        }
    }
}

/// One axis.
#[derive(Clone, Debug, Serialize)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Logarithmic or linear.
    pub logarithmic: bool,
}

impl Axis {
    /// A logarithmic axis.
    pub fn log(label: &str) -> Axis {
        Axis { label: label.to_owned(), logarithmic: true }
    }

    /// A linear axis.
    pub fn linear(label: &str) -> Axis {
        Axis { label: label.to_owned(), logarithmic: false }
    }
}

/// Points and lines.
#[derive(Clone, Debug, Serialize)]
pub struct Plot {
    /// A word for links and file names.
    pub id: String,
    /// The heading.
    pub title: String,
    /// Below the plot: what it shows, and how to make it again.
    pub caption: String,
    /// Along.
    pub x: Axis,
    /// Up.
    pub y: Axis,
    /// One colour each.
    pub series: Vec<Series>,
    /// Horizontal lines with a name, such as the error of the reference.
    pub levels: Vec<(String, f64)>,
}

/// Points of one method, joined by a line.
#[derive(Clone, Debug, Serialize)]
pub struct Series {
    /// The method.
    pub name: String,
    /// Which colour: the same method has the same in every plot.
    pub colour: usize,
    /// In the order of the line.
    pub points: Vec<Point>,
}

/// One point.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    /// Along.
    pub x: f64,
    /// Up; not a number where the run failed.
    pub y: f64,
    /// Smallest and largest of what `x` is the median of.
    pub x_spread: Option<[f64; 2]>,
    /// A 95 % interval of `y`.
    pub y_interval: Option<[f64; 2]>,
    /// What is told on hover.
    pub label: String,
    /// Why there is no value: the point is drawn at the edge.
    pub failed: Option<String>,
}

impl Point {
    /// A point that came out.
    pub fn at(x: f64, y: f64, label: String) -> Point {
        Point { x, y, x_spread: None, y_interval: None, label, failed: None }
    }

    /// A point that did not.
    pub fn failed(x: f64, label: String, reason: String) -> Point {
        Point { x, y: f64::NAN, x_spread: None, y_interval: None, label, failed: Some(reason) }
    }
}

/// Outcomes over a plane of two settings.
#[derive(Clone, Debug, Serialize)]
pub struct Map {
    /// A word for links and file names.
    pub id: String,
    /// The heading.
    pub title: String,
    /// Below the map.
    pub caption: String,
    /// Along: the label, and the middle of each column.
    pub x: (Axis, Vec<f64>),
    /// Up: the label, and the middle of each row.
    pub y: (Axis, Vec<f64>),
    /// Row by row, from the lowest: the outcome's number and what is told on hover.
    pub cells: Vec<(usize, String)>,
    /// The names of the outcomes.
    pub outcomes: Vec<String>,
    /// The predicted limit: a value of `x` for each row.
    pub limit: Vec<f64>,
}

/// Words and numbers.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    /// A word for links and file names.
    pub id: String,
    /// The heading.
    pub title: String,
    /// Below the table.
    pub caption: String,
    /// The columns' names.
    pub head: Vec<String>,
    /// The rows.
    pub rows: Vec<Vec<String>>,
}

/// Processor, number of threads, architecture.
fn machine() -> String {
    let processor = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let processor = processor.unwrap_or_else(|| "processor unknown".to_owned());
    format!("{processor}, {threads} threads, {}", std::env::consts::ARCH)
}

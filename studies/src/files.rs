//! A report as files: `report.html`, `report.json`, and a CSV and an SVG of each figure.

use crate::page::page;
use crate::report::{Figure, Report};
use crate::svg;
use std::path::{Path, PathBuf};

/// A file of the report that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// By the system.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A table as CSV.
    #[error("{}: {source}", path.display())]
    Csv {
        /// The file.
        path: PathBuf,
        /// What was wrong.
        source: csv::Error,
    },
    /// The report as JSON.
    #[error("the report as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// Writes a report into a folder that exists; returns the page's path.
///
/// # Errors
///
/// [`WriteError`] for the first file that cannot be written.
pub fn write(report: &Report, folder: &Path) -> Result<PathBuf, WriteError> {
    let put = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|source| WriteError::File { path: path.clone(), source })?;
        Ok::<PathBuf, WriteError>(path)
    };
    put("report.json", &(serde_json::to_string_pretty(report)? + "\n"))?;
    for figure in report.sections.iter().flat_map(|section| &section.figures) {
        let id = figure.id();
        let path = folder.join(format!("{id}.csv"));
        write_csv(figure, &path).map_err(|source| WriteError::Csv { path, source })?;
        match figure {
            Figure::Plot(plot) => put(&format!("{id}.svg"), &svg::plot(plot, true)).map(drop)?,
            Figure::Map(map) => put(&format!("{id}.svg"), &svg::map(map, true)).map(drop)?,
            Figure::Table(_) => {}
        }
    }
    put("report.html", &page(report))
}

fn write_csv(figure: &Figure, path: &Path) -> Result<(), csv::Error> {
    let mut out = csv::Writer::from_path(path)?;
    match figure {
        Figure::Plot(plot) => {
            out.write_record(["series", "x", "y", "x_low", "x_high", "y_low", "y_high", "failed", "label"])?;
            let number = |value: f64| if value.is_finite() { format!("{value:e}") } else { String::new() };
            let end = |ends: Option<[f64; 2]>, index: usize| {
                ends.map_or_else(String::new, |ends| number(ends[index]))
            };
            for series in &plot.series {
                for point in &series.points {
                    out.write_record([
                        series.name.as_str(),
                        &number(point.x),
                        &number(point.y),
                        &end(point.x_spread, 0),
                        &end(point.x_spread, 1),
                        &end(point.y_interval, 0),
                        &end(point.y_interval, 1),
                        point.failed.as_deref().unwrap_or_default(),
                        &point.label,
                    ])?;
                }
            }
        }
        Figure::Map(map) => {
            out.write_record(["x", "y", "limit", "outcome", "label"])?;
            for (index, (outcome, label)) in map.cells.iter().enumerate() {
                let (row, column) = (index / map.x.1.len(), index % map.x.1.len());
                out.write_record([
                    &format!("{:e}", map.x.1[column]),
                    &format!("{:e}", map.y.1[row]),
                    &format!("{:e}", map.limit[row]),
                    &map.outcomes[*outcome],
                    label,
                ])?;
            }
        }
        Figure::Table(table) => {
            out.write_record(&table.head)?;
            for row in &table.rows {
                out.write_record(row)?;
            }
        }
    }
    out.flush()?;
    Ok(())
}

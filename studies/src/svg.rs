//! Plots and maps as SVG.
//!
//! The one thing to know: colours are classes, so that one style sheet, [`STYLE`], serves light and dark; every mark has
//! a `title`, which browsers show on hover.

use crate::report::{Axis, Map, Plot, Point};
use std::fmt::Write;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 74.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 48.0;
/// Height of a line of the legend.
const LINE: f64 = 20.0;
/// Colours of series.
const COLOURS: usize = 8;

/// The style sheet of all plots. The colours are those of Okabe and Ito, told apart by nearly all eyes.
pub(crate) const STYLE: &str = "
svg.plot{--ink:#222;--faint:#ddd;--paper:#fff}
svg.plot text{font:13px system-ui,sans-serif;fill:var(--ink)}
svg.plot .axis{stroke:var(--ink);fill:none}
svg.plot .grid{stroke:var(--faint);fill:none}
svg.plot .level{stroke:var(--ink);stroke-dasharray:5 4;fill:none}
svg.plot .limit{stroke:var(--ink);stroke-width:3;fill:none}
svg.plot .line{fill:none;stroke-width:1.6}
svg.plot .bar{fill:none;stroke-width:1}
svg.plot .cross{fill:none;stroke-width:2.4}
svg.plot .k0{color:#0072b2}svg.plot .k1{color:#d55e00}svg.plot .k2{color:#009e73}svg.plot .k3{color:#cc79a7}
svg.plot .k4{color:#b8860b}svg.plot .k5{color:#56b4e9}svg.plot .k6{color:#7a5195}svg.plot .k7{color:#888}
svg.plot .o0{fill:#009e73}svg.plot .o1{fill:#e6c84b}svg.plot .o2{fill:#d55e00}svg.plot .o3{fill:#5b2a6e}
@media (prefers-color-scheme:dark){svg.plot{--ink:#ddd;--faint:#444;--paper:#181818}
svg.plot .k0{color:#4da3e0}svg.plot .k6{color:#b48cd0}}
";

/// One direction of a plot: from values to places.
struct Scale {
    low: f64,
    high: f64,
    logarithmic: bool,
    places: (f64, f64),
}

impl Scale {
    /// A scale that shows all of some values.
    fn over(axis: &Axis, values: impl Iterator<Item = f64>, places: (f64, f64)) -> Scale {
        let logarithmic = axis.logarithmic;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|value| value.is_finite() && (!logarithmic || *value > 0.0)) {
            let value = if logarithmic { libm::log10(value) } else { value };
            low = if value < low { value } else { low };
            high = if value > high { value } else { high };
        }
        if !(low <= high) {
            (low, high) = (0.0, 1.0);
        }
        let pad = if high > low { 0.04 * (high - low) } else { 0.5 };
        Scale { low: low - pad, high: high + pad, logarithmic, places }
    }

    /// The place of a value; what is beyond the scale lies at its end.
    fn place(&self, value: f64) -> f64 {
        let value = match (self.logarithmic, value > 0.0) {
            (true, true) => libm::log10(value),
            (true, false) => self.low,
            (false, _) => value,
        };
        let share = (value - self.low) / (self.high - self.low);
        let share = if share > 1.0 { 1.0 } else { share };
        let share = if share > 0.0 { share } else { 0.0 };
        self.places.0 + share * (self.places.1 - self.places.0)
    }

    /// Round values with their places and names.
    fn ticks(&self) -> Vec<(f64, String)> {
        let span = self.high - self.low;
        let at = |value: f64, name: String| {
            (self.places.0 + (value - self.low) / span * (self.places.1 - self.places.0), name)
        };
        let mut ticks = Vec::new();
        if self.logarithmic {
            // Every so many decades; within few of them 2 and 5 as well, or tenths of a decade.
            let every = libm::ceil(span / 8.0);
            let every = if every > 1.0 { every } else { 1.0 };
            let between: &[f64] = match span {
                wide if wide > 3.0 => &[1.0],
                some if some > 0.7 => &[1.0, 2.0, 5.0],
                _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
            };
            let mut decade = libm::floor(self.low / every) * every;
            while decade <= self.high {
                for &factor in between {
                    let value = decade + libm::log10(factor);
                    if value >= self.low && value <= self.high {
                        ticks.push(at(value, format!("{factor}e{:.0}", decade + 0.0)));
                    }
                }
                decade += every;
            }
        } else {
            let rough = span / 6.0;
            let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
            let step = [1.0, 2.0, 5.0, 10.0].iter().map(|n| n * power).find(|step| *step >= rough);
            let step = step.unwrap_or(rough);
            let mut number = libm::ceil(self.low / step);
            while number * step <= self.high {
                let value = number * step + 0.0;
                let name = if step < 1e-3 {
                    format!("{value:.1e}")
                } else {
                    format!("{}", libm::round(value * 1e6) / 1e6)
                };
                ticks.push(at(value, name));
                number += 1.0;
            }
        }
        ticks
    }
}

/// Text as it may stand in HTML and SVG.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn places() -> ((f64, f64), (f64, f64)) {
    ((LEFT, WIDTH - RIGHT), (HEIGHT - BOTTOM, TOP))
}

fn open(out: &mut String, height: f64, title: &str, style: bool) {
    let style = if style { format!("<style>{STYLE}</style>") } else { String::new() };
    let _ = write!(
        out,
        "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\">{style}",
        escaped(title)
    );
    if !style.is_empty() {
        let _ = write!(out, "<rect width=\"{WIDTH}\" height=\"{height}\" style=\"fill:var(--paper)\"/>");
    }
}

fn axes(out: &mut String, (x, y): (&Scale, &Scale), (x_axis, y_axis): (&Axis, &Axis)) {
    let ((left, right), (bottom, top)) = places();
    for (place, name) in x.ticks() {
        let _ = write!(
            out,
            "<path class=\"grid\" d=\"M{place:.1} {bottom}V{top}\"/><text x=\"{place:.1}\" y=\"{}\" text-anchor=\"middle\">{name}</text>",
            bottom + 17.0
        );
    }
    for (place, name) in y.ticks() {
        let _ = write!(
            out,
            "<path class=\"grid\" d=\"M{left} {place:.1}H{right}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{name}</text>",
            left - 6.0,
            place + 4.5
        );
    }
    let _ = write!(
        out,
        "<path class=\"axis\" d=\"M{left} {top}V{bottom}H{right}\"/><text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
         <text transform=\"translate(15 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        0.5 * (left + right),
        bottom + 37.0,
        escaped(&x_axis.label),
        0.5 * (top + bottom),
        escaped(&y_axis.label)
    );
}

/// Names in rows, each with a mark; returns how many rows.
fn legend(out: &mut String, names: &[(String, String)], draw: bool) -> usize {
    let (mut x, mut row) = (LEFT, 0);
    for (name, mark) in names {
        let width = 30.0 + 7.2 * name.chars().count() as f64;
        if x > LEFT && x + width > WIDTH - RIGHT {
            (x, row) = (LEFT, row + 1);
        }
        if draw {
            let y = HEIGHT + LINE * row as f64 + 8.0;
            let _ = write!(
                out,
                "<g transform=\"translate({x:.1} {y:.1})\">{mark}<text x=\"22\" y=\"4.5\">{}</text></g>",
                escaped(name)
            );
        }
        x += width;
    }
    row + 1
}

fn titled(class: &str, shape: &str, label: &str) -> String {
    format!("<g class=\"{class}\">{shape}<title>{}</title></g>", escaped(label))
}

/// A plot; with its style sheet, to stand alone, or without.
pub(crate) fn plot(plot: &Plot, style: bool) -> String {
    let (xs, ys) = places();
    let points = || plot.series.iter().flat_map(|series| &series.points);
    let spread = |point: &Point| point.x_spread.unwrap_or([point.x; 2]).into_iter().chain([point.x]);
    let interval = |point: &Point| point.y_interval.unwrap_or([point.y; 2]).into_iter().chain([point.y]);
    let x = Scale::over(&plot.x, points().flat_map(spread), xs);
    let levels = plot.levels.iter().map(|level| level.1);
    let y = Scale::over(&plot.y, points().flat_map(interval).chain(levels), ys);
    let names: Vec<_> = plot
        .series
        .iter()
        .map(|series| {
            let mark = format!(
                "<path class=\"line k{}\" stroke=\"currentColor\" d=\"M0 0H16\"/>",
                series.colour % COLOURS
            );
            (series.name.clone(), mark)
        })
        .collect();
    let height = HEIGHT + LINE * legend(&mut String::new(), &names, false) as f64;
    let mut out = String::new();
    open(&mut out, height, &plot.title, style);
    axes(&mut out, (&x, &y), (&plot.x, &plot.y));
    for (name, level) in &plot.levels {
        let place = y.place(*level);
        let _ = write!(
            out,
            "<path class=\"level\" d=\"M{} {place:.1}H{}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            xs.0,
            xs.1,
            xs.1 - 4.0,
            place - 4.0,
            escaped(name)
        );
    }
    let mut unplaced = 0.0;
    for series in &plot.series {
        let class = format!("k{}", series.colour % COLOURS);
        let line: Vec<String> = series
            .points
            .iter()
            .filter(|point| point.failed.is_none())
            .map(|point| format!("{:.1} {:.1}", x.place(point.x), y.place(point.y)))
            .collect();
        if line.len() > 1 {
            let _ = write!(
                out,
                "<path class=\"line {class}\" stroke=\"currentColor\" d=\"M{}\"/>",
                line.join("L")
            );
        }
        for point in &series.points {
            let shape = match &point.failed {
                Some(_) => {
                    let place = if point.x.is_finite() {
                        x.place(point.x)
                    } else {
                        unplaced += 12.0;
                        xs.1 - unplaced
                    };
                    let (low, high) = (ys.1 - 13.0, ys.1 - 3.0);
                    format!(
                        "<path class=\"cross\" stroke=\"currentColor\" d=\"M{:.1} {low}L{:.1} {high}M{:.1} {high}L{:.1} {low}\"/>",
                        place - 5.0,
                        place + 5.0,
                        place - 5.0,
                        place + 5.0
                    )
                }
                None => mark(point, &x, &y, series.points.len() > 60),
            };
            let label = match &point.failed {
                Some(reason) => format!("{}: {reason}", point.label),
                None => point.label.clone(),
            };
            out.push_str(&titled(&class, &shape, &label));
        }
    }
    legend(&mut out, &names, true);
    out.push_str("</svg>");
    out
}

/// A dot, with bars where its place has a spread.
fn mark(point: &Point, x: &Scale, y: &Scale, small: bool) -> String {
    let (px, py) = (x.place(point.x), y.place(point.y));
    let radius = if small { 1.5 } else { 4.0 };
    let mut shape = format!("<circle fill=\"currentColor\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"{radius}\"/>");
    let mut bar = |path: String| {
        let _ = write!(shape, "<path class=\"bar\" stroke=\"currentColor\" d=\"{path}\"/>");
    };
    if let Some([low, high]) = point.x_spread {
        bar(format!("M{:.1} {py:.1}H{:.1}", x.place(low), x.place(high)));
    }
    if let Some([low, high]) = point.y_interval {
        bar(format!("M{px:.1} {:.1}V{:.1}", y.place(low), y.place(high)));
    }
    shape
}

/// A map; with its style sheet, to stand alone, or without.
pub(crate) fn map(map: &Map, style: bool) -> String {
    let ((left, right), (bottom, top)) = places();
    let (columns, rows) = (map.x.1.len(), map.y.1.len());
    let (wide, high) = ((right - left) / columns as f64, (bottom - top) / rows as f64);
    // Half a cell beyond the outer middles, whatever the spacing.
    let scale = |axis: &Axis, values: &[f64], places: (f64, f64)| {
        let value = |v: f64| if axis.logarithmic { libm::log10(v) } else { v };
        let (first, last) = (value(values[0]), value(values[values.len() - 1]));
        let half = if values.len() > 1 { 0.5 * (last - first) / (values.len() - 1) as f64 } else { 0.5 };
        Scale { low: first - half, high: last + half, logarithmic: axis.logarithmic, places }
    };
    let x = scale(&map.x.0, &map.x.1, (left, right));
    let y = scale(&map.y.0, &map.y.1, (bottom, top));
    let names: Vec<_> = map
        .outcomes
        .iter()
        .enumerate()
        .map(|(number, name)| {
            (name.clone(), format!("<rect class=\"o{number}\" y=\"-7\" width=\"16\" height=\"14\"/>"))
        })
        .chain([("predicted limit".to_owned(), "<path class=\"limit\" d=\"M0 0H16\"/>".to_owned())])
        .collect();
    let height = HEIGHT + LINE * legend(&mut String::new(), &names, false) as f64;
    let mut out = String::new();
    open(&mut out, height, &map.title, style);
    for (index, (outcome, label)) in map.cells.iter().enumerate() {
        let (row, column) = (index / columns, index % columns);
        let shape = format!(
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
            left + wide * column as f64 + 0.5,
            bottom - high * (row + 1) as f64 + 0.5,
            wide - 1.0,
            high - 1.0
        );
        let name = map.outcomes.get(*outcome).map_or("", String::as_str);
        out.push_str(&titled(&format!("o{outcome}"), &shape, &format!("{name}: {label}")));
    }
    axes(&mut out, (&x, &y), (&map.x.0, &map.y.0));
    for (row, limit) in map.limit.iter().enumerate() {
        if limit.is_finite() {
            let place = x.place(*limit);
            let (low, up) = (bottom - high * row as f64, bottom - high * (row + 1) as f64);
            let _ = write!(out, "<path class=\"limit\" d=\"M{place:.1} {low:.1}V{up:.1}\"/>");
        }
    }
    legend(&mut out, &names, true);
    out.push_str("</svg>");
    out
}

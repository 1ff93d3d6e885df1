//! A report as one HTML page that needs nothing else.

use crate::report::{Figure, Report, Section, Table};
use crate::svg::{self, escaped};
use std::fmt::Write;

const STYLE: &str = "
:root{color-scheme:light dark;--ink:#222;--paper:#fff;--faint:#ddd;--link:#0072b2}
@media (prefers-color-scheme:dark){:root{--ink:#ddd;--paper:#181818;--faint:#444;--link:#6cb6ff}}
body{margin:0 auto;max-width:70rem;padding:1rem;font:16px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper)}
h1{font-size:1.6rem}h2{margin-top:2.5rem;border-top:1px solid var(--faint);padding-top:1rem}
a{color:var(--link)}nav ul{columns:2 16rem;padding-left:1.2rem}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,30rem),1fr));gap:1.5rem}
figure{margin:0;min-width:0}figure.wide{grid-column:1/-1}
figure>div{overflow-x:auto}figure h3{margin:.2rem 0}figcaption{font-size:.9rem}
svg.plot{width:100%;min-width:26rem;height:auto}
table{border-collapse:collapse;font-size:.9rem}th,td{padding:.15rem .6rem;border-bottom:1px solid var(--faint);text-align:left}
td{font-variant-numeric:tabular-nums}
@media print{body{max-width:none}figure{break-inside:avoid}nav{display:none}.figures{display:block}}
";

/// The whole page.
pub(crate) fn page(report: &Report) -> String {
    let mut out = String::new();
    let effort = if report.quick { "quick" } else { "full" };
    let _ = write!(
        out,
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <title>chainmail: studies</title><link rel=\"icon\" href=\"data:,\"><style>{STYLE}{}</style></head><body><h1>Error against run time, stability, scaling</h1>\
         <p>chainmail {}, {effort} report, on {}. Times are of this machine; errors and counts are the same on every one. Beside this page lie \
         <code>report.json</code> with every number, and a CSV and an SVG of each figure. Hover over a point for its numbers.</p><nav><ul>",
        svg::STYLE,
        report.version,
        escaped(&report.machine)
    );
    for section in &report.sections {
        let _ = write!(out, "<li><a href=\"#{}\">{}</a></li>", section.id, escaped(&section.title));
    }
    out.push_str("</ul></nav>");
    for section in &report.sections {
        write_section(&mut out, section, report.quick);
    }
    out.push_str("</body></html>\n");
    out
}

fn write_section(out: &mut String, section: &Section, quick: bool) {
    let _ = write!(out, "<h2 id=\"{}\">{}</h2>", section.id, escaped(&section.title));
    for paragraph in &section.text {
        let _ = write!(out, "<p>{}</p>", escaped(paragraph));
    }
    let quick = if quick { " --quick" } else { "" };
    let _ = write!(
        out,
        "<p>To make this section again: <code>chainmail study {}{quick} --out DIR</code>.</p><div class=\"figures\">",
        section.id
    );
    for figure in &section.figures {
        let (class, title, caption, body) = match figure {
            Figure::Plot(plot) => ("", &plot.title, &plot.caption, svg::plot(plot, false)),
            Figure::Map(map) => ("", &map.title, &map.caption, svg::map(map, false)),
            Figure::Table(table) => (" class=\"wide\"", &table.title, &table.caption, rows(table)),
        };
        let _ = write!(
            out,
            "<figure id=\"{}\"{class}><h3>{}</h3><div>{body}</div><figcaption>{}</figcaption></figure>",
            figure.id(),
            escaped(title),
            escaped(caption)
        );
    }
    out.push_str("</div>");
}

fn rows(table: &Table) -> String {
    let mut out = "<table><thead><tr>".to_owned();
    for name in &table.head {
        let _ = write!(out, "<th scope=\"col\">{}</th>", escaped(name));
    }
    out.push_str("</tr></thead><tbody>");
    for row in &table.rows {
        out.push_str("<tr>");
        for cell in row {
            let _ = write!(out, "<td>{}</td>", escaped(cell));
        }
        out.push_str("</tr>");
    }
    out.push_str("</tbody></table>");
    out
}

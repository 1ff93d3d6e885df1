//! The comparison as one HTML page that needs nothing else: no script, no other file, no network.

use super::{Diff, DifferencePicture, Growth, KeyDifference, Verdict};
use std::fmt::Write as _;

/// Width and height of the plot, and the margins left of and below its axes, in pixels.
const PLOT_PX: [f64; 2] = [720.0, 320.0];
const MARGIN_PX: [f64; 2] = [70.0, 40.0];

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}\
     table{border-collapse:collapse;margin:.5em 0}td,th{border:1px solid #ccc;padding:.2em .6em;text-align:left;\
     vertical-align:top}th{background:#f3f3f3}code,td.n{font-family:ui-monospace,monospace}img{max-width:100%}\
     .differs{color:#b00}.same{color:#070}pre{background:#f6f6f6;padding:.7em;overflow:auto}";

/// Writes the page. `pictures` are differences of frames, by their numbers, to be shown in it.
pub fn html(diff: &Diff, pictures: &[(usize, DifferencePicture)]) -> String {
    let mut page = String::new();
    let [a, b] = diff.files.each_ref().map(|file| escaped(file));
    page.push_str("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Difference of two logs</title>");
    let _ = write!(page, "<style>{STYLE}</style></head><body>\n<h1>Difference of two logs</h1>\n");
    let _ = writeln!(page, "<p>A: <code>{a}</code><br>B: <code>{b}</code></p>");
    let (class, verdict) = match diff.verdict {
        Verdict::Same => ("same", "same"),
        Verdict::Differs => ("differs", "they differ"),
        Verdict::Incomparable => ("differs", "they cannot be compared"),
        Verdict::Damaged => ("differs", "damaged"),
    };
    let _ = writeln!(page, "<p>Verdict: <strong class=\"{class}\">{verdict}</strong></p>");
    for note in &diff.notes {
        let _ = writeln!(page, "<p class=\"differs\">{}</p>", escaped(note));
    }
    first(&mut page, diff);
    growth(&mut page, &diff.growth);
    let keys: Vec<_> = diff.scene.iter().chain(&diff.render).chain(&diff.plan).collect();
    if !keys.is_empty() {
        page.push_str("<h2>Scene and plan</h2>\n");
        key_table(&mut page, &keys);
    }
    frames(&mut page, diff, pictures);
    let _ = write!(page, "<h2>In words</h2>\n<pre>{}</pre>\n</body></html>\n", escaped(&diff.to_string()));
    page
}

fn first(page: &mut String, diff: &Diff) {
    let Some(first) = &diff.first else { return };
    let _ = write!(page, "<h2>First difference: step {}", first.step);
    if let Some(stage) = first.stage {
        let _ = write!(page, ", stage {stage}");
    }
    page.push_str("</h2>\n");
    if !first.stages_before.is_empty() {
        let _ = writeln!(page, "<p>Stages before it agree: {}.</p>", first.stages_before.join(", "));
    }
    if let Some(state) = &first.state {
        let _ = writeln!(
            page,
            "<p>State of step {}: {} fields differ, {} of {} bodies.</p>",
            state.step, state.fields_differing, state.bodies_differing, state.bodies[0]
        );
        page.push_str("<table><tr><th>Where</th><th>Field</th><th>A</th><th>B</th><th>Bits of A</th><th>Bits of B</th><th>ULP</th></tr>\n");
        for field in &state.fields {
            let dot = if field.component.is_empty() { "" } else { "." };
            let ulp = field.ulp.map_or("-".to_owned(), |ulp| ulp.to_string());
            let _ = writeln!(
                page,
                "<tr><td>{}</td><td>{}{dot}{}</td><td class=n>{:?}</td><td class=n>{:?}</td><td class=n>{}</td>\
                 <td class=n>{}</td><td class=n>{ulp}</td></tr>",
                escaped(&field.owner),
                field.field,
                field.component,
                field.a,
                field.b,
                field.a_bits,
                field.b_bits
            );
        }
        page.push_str("</table>\n");
    }
    let record: Vec<_> = first.record.iter().collect();
    if !record.is_empty() {
        page.push_str("<p>Fields of the step record:</p>\n");
        key_table(page, &record);
    }
}

fn key_table(page: &mut String, keys: &[&KeyDifference]) {
    let value = |value: &Option<serde_json::Value>| {
        value.as_ref().map_or("not there".to_owned(), |value| escaped(&value.to_string()))
    };
    page.push_str("<table><tr><th>Key</th><th>A</th><th>B</th></tr>\n");
    for KeyDifference { key, a, b } in keys {
        let (key, a, b) = (escaped(key), value(a), value(b));
        let _ = writeln!(page, "<tr><td>{key}</td><td class=n>{a}</td><td class=n>{b}</td></tr>");
    }
    page.push_str("</table>\n");
}

fn growth(page: &mut String, growth: &[Growth]) {
    let Some(first) = growth.first() else { return };
    page.push_str("<h2>Growth</h2>\n");
    plot(page, growth);
    page.push_str(
        "<table><tr><th>Step</th><th>Steps later</th><th>Time (s)</th><th>Positions apart (m)</th><th>Farthest</th>\
         <th>Velocities apart (m/s)</th><th>Bodies that differ</th></tr>\n",
    );
    for point in growth {
        let later = point.step - first.step;
        if later > 0 && !later.is_power_of_two() && Some(point) != growth.last() {
            continue;
        }
        let body = point.body.as_deref().map_or("-".to_owned(), escaped);
        let _ = writeln!(
            page,
            "<tr><td class=n>{}</td><td class=n>{later}</td><td class=n>{}</td><td class=n>{:.3e}</td><td>{body}</td>\
             <td class=n>{:.3e}</td><td class=n>{}</td></tr>",
            point.step,
            point.sim_time_s,
            point.position_max_m,
            point.velocity_max_m_per_s,
            point.bodies_differing
        );
    }
    page.push_str("</table>\n");
}

/// Both curves over simulated time, on a logarithmic axis; a difference of 0 has no place on it and is left out.
fn plot(page: &mut String, growth: &[Growth]) {
    let curve = |value: fn(&Growth) -> f64| -> Vec<(f64, f64)> {
        let points = growth.iter().map(|point| (point.sim_time_s, value(point)));
        points
            .filter(|(_, value)| value.is_finite() && *value > 0.0)
            .map(|(t, v)| (t, libm::log10(v)))
            .collect()
    };
    let curves = [
        ("#1560bd", "positions (m)", curve(|point| point.position_max_m)),
        ("#c8501e", "velocities (m/s)", curve(|point| point.velocity_max_m_per_s)),
    ];
    let all = || curves.iter().flat_map(|(_, _, points)| points);
    let extent = |axis: fn(&(f64, f64)) -> f64| {
        all().map(axis).fold(None, |extent: Option<(f64, f64)>, value| {
            let (low, high) = extent.unwrap_or((value, value));
            Some((if value < low { value } else { low }, if value > high { value } else { high }))
        })
    };
    let (Some((time_low, time_high)), Some((low, high))) = (extent(|p| p.0), extent(|p| p.1)) else {
        page.push_str("<p>Positions and velocities are nowhere apart by a finite amount.</p>\n");
        return;
    };
    let (low, mut high) = (low.floor(), high.ceil());
    if high == low {
        high += 1.0;
    }
    let span = if time_high > time_low { time_high - time_low } else { 1.0 };
    let [width, height] = PLOT_PX;
    let [left, below] = MARGIN_PX;
    let x = |time: f64| left + (time - time_low) / span * (width - left - 10.0);
    let y = |decade: f64| 10.0 + (high - decade) / (high - low) * (height - below - 10.0);
    let _ = writeln!(
        page,
        "<svg viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" role=\"img\" \
         aria-label=\"growth of the difference\" font-size=\"12\">"
    );
    // At most eight lines, each at a whole decade.
    let decades = (high - low) as i32;
    let every = (decades / 8 + 1) as usize;
    for decade in (0..=decades).step_by(every).map(|k| low + f64::from(k)) {
        let _ = writeln!(
            page,
            "<line x1=\"{left}\" x2=\"{}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#ddd\"/><text x=\"{}\" \
             y=\"{:.1}\" text-anchor=\"end\">1e{decade}</text>",
            width - 10.0,
            left - 6.0,
            y(decade) + 4.0,
            at = y(decade)
        );
    }
    for part in 0..=4 {
        let time = time_low + span * f64::from(part) / 4.0;
        let _ = writeln!(
            page,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{time:.4} s</text>",
            x(time),
            height - below + 20.0
        );
    }
    for (number, (colour, name, points)) in curves.iter().enumerate() {
        let path: Vec<_> = points.iter().map(|&(time, v)| format!("{:.2},{:.2}", x(time), y(v))).collect();
        let _ = writeln!(
            page,
            "<polyline fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\" points=\"{}\"/>",
            path.join(" ")
        );
        for point in &path {
            let (x, y) = point.split_once(',').unwrap_or_default();
            let _ = write!(page, "<circle cx=\"{x}\" cy=\"{y}\" r=\"2\" fill=\"{colour}\"/>");
        }
        let _ = writeln!(
            page,
            "<text x=\"{}\" y=\"{}\" fill=\"{colour}\">{name}</text>",
            left + 10.0,
            26 + 16 * number
        );
    }
    page.push_str("</svg>\n");
}

fn frames(page: &mut String, diff: &Diff, pictures: &[(usize, DifferencePicture)]) {
    let Some(frames) = diff.frames.as_ref().filter(|frames| frames.differs()) else { return };
    let _ = writeln!(
        page,
        "<h2>Frames</h2>\n<p>{} of {} differ; A has {}, B has {}.</p>",
        frames.differing, frames.compared, frames.counts[0], frames.counts[1]
    );
    for (frame, picture) in pictures {
        let _ = writeln!(
            page,
            "<p>Frame {frame}: A, B, and their difference times {}.<br><img alt=\"frame {frame}\" \
             src=\"data:image/png;base64,{}\"></p>",
            picture.gain,
            base64(&picture.png)
        );
    }
    page.push_str("<table><tr><th>Frame</th><th>Mean error (of 255)</th><th>Largest error</th></tr>\n");
    for error in &frames.errors {
        let (mean, max) = match error.error {
            Some(error) => (format!("{:.4}", error.mean), error.max.to_string()),
            None => ("-".to_owned(), "-".to_owned()),
        };
        let _ = writeln!(
            page,
            "<tr><td class=n>{}</td><td class=n>{mean}</td><td class=n>{max}</td></tr>",
            error.frame
        );
    }
    page.push_str("</table>\n");
}

/// Text as it stands between tags and in attributes.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for part in bytes.chunks(3) {
        let [a, b, c] = [0, 1, 2].map(|index| part.get(index).copied().map_or(0, u32::from));
        let bits = a << 16 | b << 8 | c;
        for (digit, shift) in [18, 12, 6, 0].into_iter().enumerate() {
            let value = (bits >> shift & 63) as usize;
            text.push(if digit <= part.len() { char::from(DIGITS[value]) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples of RFC 4648, section 10.
    #[test]
    fn base64_as_the_standard_has_it() {
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn text_is_no_tag() {
        assert_eq!(escaped("<a href=\"x\">&"), "&lt;a href=&quot;x&quot;&gt;&amp;");
    }
}

//! Where a function along a curve is negative, and how small it gets: certified by bounds on its slope, for the
//! functions that have no closed form.
//!
//! The function is a signed distance `f(t)` along a curve with the arc length `t`, less a reach. A distance
//! changes by at most the way one goes: `|f'| <= 1`. The signed distance from a *convex* body is a convex
//! function of the place, so along a circle of radius R, whose points bend away from the tangent by `t^2 / 2R`,
//! `f'' >= -1/R`, kinks included; along a straight line `f'' >= 0`. With either bound a piece of the curve is
//! proved free of contact, or proved to hold exactly one change of sign, or cut in two.

/// A value and its derivative along the curve.
pub type Slope = (f64, f64);

/// What is known of a function along a curve besides `|f'| <= 1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bend {
    /// `f'' >= -bend` with this bend (1/m): the distance from a convex body along a circle of radius `1/bend`,
    /// or along a line (0).
    AtLeast(f64),
    /// Nothing: the distance from any body.
    Unknown,
}

/// Pieces of `[start, end]` in which a function is negative, in order: at most [`Spans::CAPACITY`] of them; more
/// are joined to the last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spans {
    spans: [(f64, f64); Spans::CAPACITY],
    count: usize,
}

impl Spans {
    /// Largest number of pieces.
    pub const CAPACITY: usize = 8;

    const NONE: Spans = Spans { spans: [(0.0, 0.0); Spans::CAPACITY], count: 0 };

    /// The pieces as (start, end).
    pub fn as_slice(&self) -> &[(f64, f64)] {
        &self.spans[..self.count]
    }

    fn push(&mut self, start: f64, end: f64) {
        if self.count < Self::CAPACITY {
            self.spans[self.count] = (start, end);
            self.count += 1;
        } else {
            self.spans[self.count - 1].1 = end;
        }
    }

    /// For a closed curve of this length: a piece that ends where the curve does and one that begins where it
    /// begins are one.
    pub fn closed(mut self, start: f64, length: f64) -> Spans {
        if self.count > 1 && self.spans[0].0 == start && self.spans[self.count - 1].1 == start + length {
            self.count -= 1;
            self.spans[0].0 = self.spans[self.count].0 - length;
        }
        self
    }
}

/// Finds the pieces of `[start, end]` in which `f` is negative.
///
/// Pieces are cut down to `width_min`. With a known bend nothing is missed but a dip narrower than that and
/// shallower than `bend width_min^2 / 8`; without one a dip of at most `width_min^2 / 8` of its own curvature. An end
/// of a piece is found to about 1e-13 of its bracket.
pub fn negative_spans(start: f64, end: f64, bend: Bend, width_min: f64, f: impl Fn(f64) -> Slope) -> Spans {
    let at = |t: f64| (t, f(t));
    // Halving the curve once before anything is asked keeps a whole circle's ends apart.
    let middle = 0.5 * (start + end);
    let (a, m, b) = (at(start), at(middle), at(end));
    let mut search = Search { f, bend, width_min, spans: Spans::NONE, inside: None };
    search.piece(a, m);
    search.piece(m, b);
    if let Some(open) = search.inside {
        search.spans.push(open, end);
    }
    search.spans
}

/// A place and what the function is there.
type At = (f64, Slope);

struct Search<F: Fn(f64) -> Slope> {
    f: F,
    bend: Bend,
    width_min: f64,
    spans: Spans,
    /// Where the piece began that the search is in.
    inside: Option<f64>,
}

impl<F: Fn(f64) -> Slope> Search<F> {
    fn piece(&mut self, a: At, b: At) {
        let width = b.0 - a.0;
        if lower_bound(&a, &b, self.bend) >= 0.0 {
            self.outside(a.0);
            return;
        }
        // From the lower end the function can rise by the width at most, and from both ends to half of it.
        if a.1.0 + b.1.0 + width <= 0.0 {
            self.within(a.0);
            return;
        }
        if width <= self.width_min || is_monotonous(&a, &b, self.bend) {
            match (a.1.0 < 0.0, b.1.0 < 0.0) {
                (true, true) => self.within(a.0),
                (false, false) => self.outside(a.0),
                (true, false) => {
                    self.within(a.0);
                    let root = self.root(a, b);
                    self.outside(root);
                }
                (false, true) => {
                    self.outside(a.0);
                    let root = self.root(a, b);
                    self.within(root);
                }
            }
            return;
        }
        let t = 0.5 * (a.0 + b.0);
        let middle = (t, (self.f)(t));
        self.piece(a, middle);
        self.piece(middle, b);
    }

    fn within(&mut self, from: f64) {
        self.inside.get_or_insert(from);
    }

    fn outside(&mut self, from: f64) {
        if let Some(start) = self.inside.take() {
            self.spans.push(start, from);
        }
    }

    /// The place of the change of sign: Newton's method inside a bracket, its middle where that would leave it.
    fn root(&self, a: At, b: At) -> f64 {
        let (mut low, mut high, falling) = (a.0, b.0, a.1.0 >= 0.0);
        let tolerance = 1e-13 * (high - low);
        let mut t = low + (high - low) * (a.1.0 / (a.1.0 - b.1.0));
        for _ in 0..60 {
            let (value, slope) = (self.f)(t);
            if (value < 0.0) == falling {
                high = t
            } else {
                low = t
            }
            let newton = t - value / slope;
            // False for NaN, too.
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - t).abs() <= tolerance {
                return next;
            }
            t = next;
        }
        t
    }
}

/// No value between two places is below this.
fn lower_bound(a: &At, b: &At, bend: Bend) -> f64 {
    let width = b.0 - a.0;
    // |f'| <= 1 from both ends: they meet at the mean of the values less half the width.
    let straight = 0.5 * (a.1.0 + b.1.0 - width);
    let Bend::AtLeast(bend) = bend else { return straight };
    // With s from 0 to the width w, g = f - bend s (w - s) / 2 is convex, is f at both ends and below f in between;
    // it lies above its tangents at the ends, which are least where they cross.
    let (slope_a, slope_b) = (a.1.1 - 0.5 * bend * width, b.1.1 + 0.5 * bend * width);
    let curved = if slope_a >= 0.0 {
        a.1.0
    } else if slope_b <= 0.0 {
        b.1.0
    } else {
        let cross = (b.1.0 - a.1.0 - slope_b * width) / (slope_a - slope_b);
        a.1.0 + slope_a * cross
    };
    if curved > straight { curved } else { straight }
}

/// Whether the function is proved to rise or to fall all the way between two places.
fn is_monotonous(a: &At, b: &At, bend: Bend) -> bool {
    let Bend::AtLeast(bend) = bend else { return false };
    let turn = bend * (b.0 - a.0);
    a.1.1 > turn || b.1.1 < -turn
}

/// The least value of `f` on `[start, end]` and its place, to within `tolerance`, where the bounds above allow
/// it; the curve is not cut below `width_min`.
pub fn least(
    start: f64,
    end: f64,
    bend: Bend,
    width_min: f64,
    tolerance: f64,
    f: impl Fn(f64) -> Slope,
) -> (f64, f64) {
    const PARTS: u32 = 8;
    let mut best = (f64::INFINITY, start);
    let at = |t: f64| (t, f(t));
    let mut a = at(start);
    take(&mut best, &a);
    for part in 1..=PARTS {
        let b = at(start + (end - start) * f64::from(part) / f64::from(PARTS));
        take(&mut best, &b);
        descend(&a, &b, bend, width_min, tolerance, &f, &mut best);
        a = b;
    }
    polish(start, end, width_min, &f, best)
}

fn take(best: &mut (f64, f64), at: &At) {
    if at.1.0 < best.0 {
        *best = (at.1.0, at.0);
    }
}

fn descend(
    a: &At,
    b: &At,
    bend: Bend,
    width_min: f64,
    tolerance: f64,
    f: &impl Fn(f64) -> Slope,
    best: &mut (f64, f64),
) {
    let width = b.0 - a.0;
    if width <= width_min || lower_bound(a, b, bend) >= best.0 - tolerance {
        return;
    }
    let t = 0.5 * (a.0 + b.0);
    let middle = (t, f(t));
    take(best, &middle);
    // The half with the lower end first: what it finds spares the other.
    if a.1.0 < b.1.0 {
        descend(a, &middle, bend, width_min, tolerance, f, best);
        descend(&middle, b, bend, width_min, tolerance, f, best);
    } else {
        descend(&middle, b, bend, width_min, tolerance, f, best);
        descend(a, &middle, bend, width_min, tolerance, f, best);
    }
}

/// Follows the slope to the bottom of the dip that was found.
fn polish(start: f64, end: f64, width: f64, f: &impl Fn(f64) -> Slope, mut best: (f64, f64)) -> (f64, f64) {
    let (mut low, mut high) = (best.1 - width, best.1 + width);
    if low < start {
        low = start;
    }
    if high > end {
        high = end;
    }
    for _ in 0..40 {
        let t = 0.5 * (low + high);
        let (value, slope) = f(t);
        take(&mut best, &(t, (value, slope)));
        if slope < 0.0 { low = t } else { high = t }
    }
    best
}

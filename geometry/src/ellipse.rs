//! The contact arcs of two circles: an ellipse and a disc.
//!
//! Let the points of circle A be at height `h` over the plane of B and at the squared distance `X` from
//! B's centre. With `y = (X - R_B^2 - s^2) / (2 R_B)` and `s` the reach, a point is closer to B than `s`
//! exactly when
//!
//! ```text
//! f = y^2 + h^2 - s^2 < 0
//! ```
//!
//! since `4 R_B^2 f = (D^2 - s^2) (D_far^2 - s^2)`, where `D` and `D_far` are the distances to the
//! nearest and the farthest point of B. Both `y` and `h` are of the form `c_0 + c_1 cos(t) + c_2 sin(t)`:
//! in the plane `(y, h)` circle A is an ellipse, the contact arcs are what it cuts from a disc of radius
//! `s`, and so there are at most two. (With `s` above `R_B` the sign of `f` is positive again where both
//! distances are below `s`; such stretches are told apart by `X + R_B^2 < s^2`.) First the ellipse is cut by the strip `|h| < s` (closed form), then
//! what is left goes, in pieces of at most a quarter turn, into [`crate::bernstein`] as a quartic in the
//! tangent of half the angle. No case is special: for coaxial circles the ellipse is a point, and the
//! sign there decides for the whole circle.
//!
//! # Source
//! The quartic is the implicit torus of major radius `R_B` and minor radius `s` along circle A; its form
//! as ellipse and disc, free of the quartic's cancellation between terms of the order of `R^4`, was
//! derived for this crate.

use crate::{
    Circle,
    arc::{Arc, Arcs, HALF_TANGENT_MAX, Wave, always_above, squared_amplitude},
    bernstein,
};

/// The part of circle `a` that is closer than `reach` to circle `b` (m).
///
/// Where the distance is exactly `reach` there is no contact, so circles that only touch give no arc or
/// one of zero length. `reach` up to `b.radius` is the fast case (two wires whose radii sum to less than
/// the major radius); any positive reach is right. No pose is special: for coaxial circles the result is
/// the whole circle or nothing.
///
/// # Rounding
/// The arcs are those of a reach that is wrong by less than `e = 2e-15 R (1 + R / reach)` (measured in
/// `tests/oracles/arcs.rs`, for major radii near `R`). An arc's end moves by `e` over the slope of the depth
/// there: for a contact of depth `p`, whose depth is quadratic about its deepest point, by the part
/// `e / (2 p)` of the arc's half length. The depth vanishes at the ends, so the force over the arc changes by
/// a part of the order of `e / p`: 4e-8 for a contact 1e-6 of the minor radius deep (`R = 1`, `r = 0.18`),
/// and the energy by less.
#[inline]
pub fn circle_circle_arcs(a: &Circle, b: &Circle, reach: f64) -> Arcs {
    let d = a.centre - b.centre;
    let squared = d.norm_squared();
    let far = a.radius + b.radius + reach;
    if squared >= far * far {
        return Arcs::NONE;
    }
    let h: Wave = [d.dot(&b.normal), a.radius * a.u.dot(&b.normal), a.radius * a.w.dot(&b.normal)];
    if always_above(&h, reach) || always_above(&[-h[0], h[1], h[2]], reach) {
        return Arcs::NONE;
    }
    let scale = 0.5 / b.radius;
    let y: Wave = [
        (squared + a.radius * a.radius - b.radius * b.radius - reach * reach) * scale,
        a.radius / b.radius * d.dot(&a.u),
        a.radius / b.radius * d.dot(&a.w),
    ];
    let ellipse = Ellipse { y, h, reach, spindle: reach > b.radius, radius: b.radius };
    if always_above(&y, reach) || (!ellipse.spindle && always_above(&[-y[0], y[1], y[2]], reach)) {
        return Arcs::NONE;
    }
    ellipse.arcs()
}

/// Circle A in the plane `(y, h)` of the module's page, and the disc of radius `reach` about 0.
struct Ellipse {
    y: Wave,
    h: Wave,
    reach: f64,
    /// The reach exceeds B's radius: points may be near both sides of B, where `f` is positive again.
    spindle: bool,
    /// B's radius.
    radius: f64,
}

impl Ellipse {
    fn arcs(&self) -> Arcs {
        let mut arcs = Arcs::NONE;
        self.find(Found { arcs: &mut arcs, connected: 0, inside: false, began_inside: false });
        arcs
    }

    fn find(&self, mut found: Found<'_>) {
        let [h, ..] = self.h;
        let squared = squared_amplitude(&self.h);
        let amplitude = squared.sqrt();
        // Angle from the ellipse's highest point: the strip's upper edge is at angle_1, its lower edge at
        // angle_2 = pi - angle_1 (level: h = 0); cos(angle / 2)^2 and sin(angle / 2)^2 of each, times
        // 2 * amplitude.
        let above = (amplitude + self.reach - h, amplitude - self.reach + h);
        let below = (amplitude - self.reach - h, amplitude + self.reach + h);
        let (cut_above, cut_below) = (above.1 > 0.0, below.0 > 0.0);
        if !(cut_above || cut_below) {
            found.visit(self, Arcs::whole().as_slice());
            found.close();
            return;
        }
        let top = Arc {
            mid_cos: self.h[1] / amplitude,
            mid_sin: self.h[2] / amplitude,
            half_tangent: 0.0,
            connected: 0,
        };
        if cut_above && cut_below {
            let half = 0.5 / amplitude;
            let (cos_1, sin_1) = ((above.0 * half).sqrt(), (above.1 * half).sqrt());
            let (cos_2, sin_2) = ((below.0 * half).sqrt(), (below.1 * half).sqrt());
            let (mid_cos, mid_sin) = (cos_1 * cos_2 - sin_1 * sin_2, sin_1 * cos_2 + cos_1 * sin_2);
            let half_tangent = (sin_2 * cos_1 - cos_2 * sin_1) / (1.0 + (cos_1 * cos_2 + sin_1 * sin_2));
            for side in [mid_sin, -mid_sin] {
                let (mid_cos, mid_sin) = top.turned(mid_cos, side);
                found.visit_split(self, Arc { mid_cos, mid_sin, half_tangent, connected: 0 });
            }
        } else if cut_below {
            found.visit_split(self, Arc { half_tangent: (below.1 / below.0).sqrt(), ..top });
        } else {
            let bottom = Arc {
                mid_cos: -top.mid_cos,
                mid_sin: -top.mid_sin,
                half_tangent: (above.0 / above.1).sqrt(),
                connected: 0,
            };
            found.visit_split(self, bottom);
        }
        found.finish();
    }

    /// Bernstein coefficients of a wave on a chart, times `1 + tau^2`.
    #[inline]
    fn on(wave: &Wave, chart: &Arc, square: f64) -> [f64; 3] {
        let along = wave[1] * chart.mid_cos + wave[2] * chart.mid_sin;
        let across = 2.0 * chart.half_tangent * (wave[2] * chart.mid_cos - wave[1] * chart.mid_sin);
        let ends = wave[0] * (1.0 + square) + along * (1.0 - square);
        let middle = wave[0] * (1.0 - square) + along * (1.0 + square);
        [ends - across, middle, ends + across]
    }

    /// Bernstein coefficients of `f (1 + tau^2)^2` on a chart; `None` if `y` alone shows that there is
    /// no contact.
    #[inline]
    fn quartic(&self, chart: &Arc) -> Option<[f64; 5]> {
        let square = chart.half_tangent * chart.half_tangent;
        let y = Self::on(&self.y, chart, square);
        let edge = self.reach * (1.0 + square);
        let middle = self.reach * (1.0 - square);
        if (y[0] > edge && y[1] > middle && y[2] > edge)
            || (!self.spindle && y[0] < -edge && y[1] < -middle && y[2] < -edge)
        {
            return None;
        }
        let h = Self::on(&self.h, chart, square);
        const THIRD: f64 = 1.0 / 3.0;
        Some([
            y[0] * y[0] + h[0] * h[0] - edge * edge,
            y[0] * y[1] + h[0] * h[1] - edge * middle,
            ((y[0] * y[2] + h[0] * h[2] - edge * edge) + 2.0 * (y[1] * y[1] + h[1] * h[1] - middle * middle))
                * THIRD,
            y[1] * y[2] + h[1] * h[2] - edge * middle,
            y[2] * y[2] + h[2] * h[2] - edge * edge,
        ])
    }

    /// Whether the point at `tau` of a chart is closer than the reach (for a spindle torus, where the
    /// sign of `f` alone does not tell).
    fn within(&self, chart: &Arc, tau: f64) -> bool {
        let inverse = 1.0 / (1.0 + tau * tau);
        let (cos, sin) = chart.turned((1.0 - tau * tau) * inverse, 2.0 * tau * inverse);
        let y = self.y[0] + self.y[1] * cos + self.y[2] * sin;
        let h = self.h[0] + self.h[1] * cos + self.h[2] * sin;
        // y < -R_B says X + R_B^2 < s^2: the nearest and farthest distances' mean square is below s^2.
        y * y + h * h < self.reach * self.reach || y < -self.radius
    }
}

/// The arcs found so far while the charts are visited in the order of `t`.
struct Found<'a> {
    arcs: &'a mut Arcs,
    connected: u8,
    /// The last chart ended inside a contact.
    inside: bool,
    /// The first chart began inside a contact.
    began_inside: bool,
}

impl Found<'_> {
    /// Visits the charts of an arc of any length that does not touch those visited before.
    #[inline]
    fn visit_split(&mut self, ellipse: &Ellipse, arc: Arc) {
        self.inside = false;
        if arc.half_tangent <= HALF_TANGENT_MAX {
            self.visit_chart(ellipse, &arc);
        } else {
            let mut charts = Arcs::NONE;
            charts.push_split(arc);
            self.visit(ellipse, charts.as_slice());
        }
    }

    fn visit(&mut self, ellipse: &Ellipse, charts: &[Arc]) {
        for chart in charts {
            self.visit_chart(ellipse, chart);
        }
    }

    #[inline]
    fn visit_chart(&mut self, ellipse: &Ellipse, chart: &Arc) {
        let Some(quartic) = ellipse.quartic(chart) else {
            self.inside = false;
            return;
        };
        let mut bounds = [-chart.half_tangent; 6];
        let mut last = 0;
        bernstein::for_each_root(&quartic, |x| {
            // Never more than four, which the bound check must be told.
            if last < 4 {
                last += 1;
                bounds[last] = chart.half_tangent * (2.0 * x - 1.0);
            }
        });
        last += 1;
        bounds[last] = chart.half_tangent;
        let negative = bernstein::sign_at_start(&quartic) < 0.0;
        if ellipse.spindle {
            self.add_within(ellipse, chart, &bounds, last);
            return;
        }
        // The sign alternates from root to root.
        let mut start = usize::from(!negative);
        let mut inside = false;
        while start < last {
            inside = start + 1 == last;
            self.add(chart, &bounds, start, start + 1, last);
            start += 2;
        }
        self.inside = inside;
    }

    /// Adds the stretches between the bounds on which the distance is below the reach, for a spindle torus:
    /// neighbours may both be inside, with the far side of B passing the reach in between.
    #[cold]
    fn add_within(&mut self, ellipse: &Ellipse, chart: &Arc, bounds: &[f64; 6], last: usize) {
        let mut start = None;
        for i in 0..last {
            let inside = ellipse.within(chart, 0.5 * (bounds[i] + bounds[i + 1]));
            if inside && start.is_none() {
                start = Some(i);
            }
            if let Some(first) = start
                && !inside
            {
                self.add(chart, bounds, first, i, last);
                start = None;
            }
        }
        if let Some(first) = start {
            self.add(chart, bounds, first, last, last);
        }
        self.inside = start.is_some();
    }

    #[inline]
    fn add(&mut self, chart: &Arc, bounds: &[f64; 6], first: usize, end: usize, last: usize) {
        let goes_on = first == 0 && self.inside;
        if first == 0 && self.arcs.count == 0 {
            self.began_inside = true;
        }
        let mut piece =
            if first == 0 && end == last { *chart } else { chart.between(bounds[first], bounds[end]) };
        if goes_on {
            let previous = &mut self.arcs.pieces[self.arcs.count - 1];
            if let Some(joined) = previous.joined(&piece) {
                *previous = joined;
                return;
            }
        } else if self.arcs.count > 0 {
            self.connected += 1;
        }
        piece.connected = self.connected;
        self.arcs.push(piece);
    }

    /// The end, where the charts do not close the circle.
    fn finish(&mut self) {
        if self.connected > 1 {
            self.limit_connected();
        }
    }

    /// The end, where the charts cover the whole circle: an arc across the seam is one arc.
    fn close(&mut self) {
        if self.began_inside && self.inside && self.arcs.count > 1 {
            let count = self.arcs.count;
            let seam = self.connected;
            let pieces = &mut self.arcs.pieces[..count];
            // The pieces before the seam go to the front, where the arc that they belong to begins.
            let before = pieces.iter().filter(|piece| piece.connected == seam).count();
            if before < count {
                pieces.rotate_right(before);
            }
            for piece in &mut pieces[..before] {
                piece.connected = 0;
            }
            if before < count
                && let Some(joined) = pieces[before - 1].joined(&pieces[before])
            {
                pieces[before] = joined;
                pieces.copy_within(before.., before - 1);
                self.arcs.count -= 1;
            }
        }
        self.finish();
    }

    /// More than two arcs can only be rounding noise of a distance that equals the reach everywhere.
    #[cold]
    fn limit_connected(&mut self) {
        let count = self.arcs.count;
        for piece in &mut self.arcs.pieces[..count] {
            if piece.connected > 1 {
                piece.connected = 1;
            }
        }
    }
}

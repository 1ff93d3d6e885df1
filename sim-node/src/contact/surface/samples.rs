//! Random points on the surfaces of two bodies.
//!
//! The numbers are a function of (seed, step, pair, body, index): hashes of the index or scrambled Sobol points, with
//! keys from ChaCha8. They are the same in all stages of a step, so that the force is one and the same function of the pose
//! throughout it.
//!
//! # What is left out
//! A point of A's surface inside B is closer to B's centreline than B's wire is thick, so the point of A's centreline
//! next to it lies in a contact arc. Samples at other angles need not be made into points: they are outside, for
//! certain, and count as such.

use super::Surfaces;
use geometry::arc::circle_circle_arcs;
use geometry::minima::{circle_circle_minima, circle_plane_minima, circle_point_minima};
use geometry::patch::chart::{Measure, SurfacePoint, ring_point, sphere_point};
use geometry::patch::pair::{connected_at, deepest_points};
use geometry::patch::polar::{Deepest, PatchBox};
use geometry::patch::{Nodes, Solid};
use geometry::{Arcs, Circle, Vec3};
use random::{Hashed, Scrambled, Stream, unit};
use schemas::scene::{SurfaceAverage, SurfaceSampler};

/// Separates these random numbers from those that other parts draw from the same seed.
pub(crate) const PURPOSE: &[u8; 16] = b"chainmail forces";

const TURN: f64 = 2.0 * core::f64::consts::PI;
/// Words in a turn.
const WORDS: f64 = 4_294_967_296.0;

impl Surfaces<'_> {
    /// Adds the samples that are inside: those of A's surface, then those of B's, each with its body's share.
    pub(super) fn sample(
        &self,
        (a, b): (u32, u32),
        arcs: &Arcs,
        shares: [f64; 2],
        mut random: Stream,
        nodes: &mut [Nodes; 2],
    ) {
        // Bodies and planes are fewer than 2^31.
        let stream = u64::from(a) << 33 | u64::from(b) << 1;
        if self.settings.sampler == SurfaceSampler::Patch
            && self.in_boxes(stream, arcs, shares, &mut random, nodes)
        {
            return;
        }
        let sets = [(&self.a, &self.b, 1.0), (&self.b, &self.a, -1.0)];
        for (side, (surface, solid, sign)) in sets.into_iter().enumerate() {
            if shares[side] == 0.0 {
                continue;
            }
            random.go_to(stream + side as u64);
            let turned;
            let own_arcs = match (surface, solid, side) {
                (Solid::Ring { .. }, _, 0) => Some(arcs),
                (
                    Solid::Ring { circle, minor_radius },
                    Solid::Ring { circle: other, minor_radius: other_minor },
                    _,
                ) => {
                    turned = circle_circle_arcs(circle, other, minor_radius + other_minor);
                    Some(&turned)
                }
                _ => None,
            };
            let spans = own_arcs.map(Spans::new);
            self.whole_surface(surface, shares[side], spans.as_ref(), &mut random, |at| {
                let (depth, normal) = solid.depth(&at.point);
                if depth > 0.0 {
                    let contact = self.contact(arcs, &at.point);
                    nodes[contact].push(&at.point, &(normal * sign), depth, at.area);
                }
            });
        }
    }

    /// Which contact of A a point belongs to.
    fn contact(&self, arcs: &Arcs, point: &Vec3) -> usize {
        match &self.a {
            Solid::Ring { circle, .. } => connected_at(circle, arcs, point),
            _ => 0,
        }
    }

    /// Visits the samples of a surface, with the area (or share of samples) that each stands for.
    fn whole_surface(
        &self,
        surface: &Solid,
        share: f64,
        spans: Option<&Spans>,
        random: &mut Stream,
        mut visit: impl FnMut(SurfacePoint),
    ) {
        let samples = self.settings.samples;
        let measure = match self.settings.sampler {
            SurfaceSampler::UniformAngles => Measure::Angles,
            _ => Measure::Area,
        };
        // Few samples pass, so the second number is only made for those.
        let mut weighted = |count: u32, first: u32, second: &dyn Fn() -> u32| {
            if spans.is_some_and(|spans| !spans.hold(first)) {
                return;
            }
            let mut at = point(surface, (unit(first), unit(second())), measure);
            at.area = match self.settings.average {
                SurfaceAverage::Area => at.area * share / f64::from(count),
                SurfaceAverage::AllSamples => share / f64::from(count),
            };
            visit(at);
        };
        match self.settings.sampler {
            SurfaceSampler::Sobol | SurfaceSampler::Patch => {
                let points = Scrambled::from_stream(random);
                for index in 0..samples {
                    let digits = points.digits(index);
                    weighted(samples, points.first(digits), &|| points.second(digits));
                }
            }
            SurfaceSampler::Stratified => {
                let (columns, rows) = cells(surface, samples);
                let words = Hashed::from_stream(random);
                let in_cell = |cell: u32, of: u32, word: u32| {
                    ((u64::from(cell) << 32 | u64::from(word)) / u64::from(of)) as u32
                };
                for index in 0..columns * rows {
                    let (column, row) = (index / rows, index % rows);
                    let (first, second) = words.words(index);
                    weighted(columns * rows, in_cell(column, columns, first), &|| in_cell(row, rows, second));
                }
            }
            SurfaceSampler::UniformAngles | SurfaceSampler::Uniform | SurfaceSampler::Quadrature => {
                let words = Hashed::from_stream(random);
                for index in 0..samples {
                    let (first, second) = words.words(index);
                    weighted(samples, first, &|| second);
                }
            }
        }
    }

    /// Samples in a box round each patch; false, and nothing added, where a patch is not fit for one.
    fn in_boxes(
        &self,
        stream: u64,
        arcs: &Arcs,
        shares: [f64; 2],
        random: &mut Stream,
        nodes: &mut [Nodes; 2],
    ) -> bool {
        let mut boxes: [[Option<PatchBox>; 2]; 2] = [[None; 2]; 2];
        let contacts = self.deepest(arcs);
        if contacts.iter().flatten().count() == 0 {
            return false;
        }
        for (boxes, deepest) in boxes.iter_mut().zip(&contacts) {
            let Some(deepest) = deepest else { continue };
            // An arc of no length has no patch.
            if deepest[0].depth <= 0.0 {
                continue;
            }
            boxes[0] = PatchBox::around(&self.a, &self.b, &deepest[0]);
            if shares[1] > 0.0 {
                boxes[1] = PatchBox::around(&self.b, &self.a, &deepest[1]);
            }
            if boxes[0].is_none() || (shares[1] > 0.0 && boxes[1].is_none()) {
                return false;
            }
        }
        let sets = [(&self.a, &self.b, 1.0), (&self.b, &self.a, -1.0)];
        for (side, (surface, solid, sign)) in sets.into_iter().enumerate() {
            random.go_to(stream + side as u64);
            let share = match self.settings.average {
                SurfaceAverage::Area => shares[side],
                SurfaceAverage::AllSamples => shares[side] / surface.area(),
            };
            let share = share / f64::from(self.settings.samples);
            for (contact, boxes) in boxes.iter().enumerate() {
                let points = Scrambled::from_stream(random);
                let Some(patch_box) = boxes[side] else { continue };
                for index in 0..self.settings.samples {
                    let at = patch_box.point(points.point(index));
                    let (depth, normal) = solid.depth(&at.point);
                    if depth > 0.0 {
                        nodes[contact].push(&at.point, &(normal * sign), depth, at.area * share);
                    }
                }
            }
        }
        true
    }

    /// For each contact the deepest points of both surfaces; none at all where a contact has more than one.
    fn deepest(&self, arcs: &Arcs) -> [Option<[Deepest; 2]>; 2] {
        let minima = match (&self.a, &self.b) {
            (Solid::Ring { circle, .. }, Solid::Ring { circle: other, .. }) => {
                circle_circle_minima(circle, other, arcs)
            }
            (Solid::Ring { circle, .. }, Solid::Sphere { centre, .. }) => circle_point_minima(circle, centre),
            (Solid::Ring { circle, .. }, Solid::Plane { normal, .. }) => circle_plane_minima(circle, normal),
            (Solid::Sphere { centre, .. }, b) => {
                let core =
                    Circle { centre: *centre, u: Vec3::x(), w: Vec3::y(), normal: Vec3::z(), radius: 0.0 };
                return [Some(deepest_points(&self.a, b, &core, (1.0, 0.0))), None];
            }
            (Solid::Plane { .. }, _) => return [None; 2],
        };
        let mut contacts = [None; 2];
        if minima.as_slice().len() != arcs.connected_count() {
            return contacts;
        }
        if let Solid::Ring { circle, .. } = &self.a {
            for minimum in minima.as_slice() {
                let place = (minimum.cos, minimum.sin);
                contacts[usize::from(minimum.connected)] =
                    Some(deepest_points(&self.a, &self.b, circle, place));
            }
        }
        contacts
    }
}

/// The point of a surface for a point of the unit square. A plane has none: it is never asked for.
fn point(surface: &Solid, (first, second): (f64, f64), measure: Measure) -> SurfacePoint {
    match surface {
        Solid::Ring { circle, minor_radius } => {
            let (sin, cos) = libm::sincos(TURN * first);
            ring_point(circle, *minor_radius, (cos, sin), second, measure)
        }
        Solid::Sphere { centre, radius } => sphere_point(centre, *radius, (first, second), measure),
        Solid::Plane { normal, offset } => SurfacePoint { point: normal * *offset, area: 0.0 },
    }
}

/// Columns around the ring and rows around the wire of about square cells: together at most as many as asked for.
fn cells(surface: &Solid, samples: u32) -> (u32, u32) {
    let ratio = match surface {
        Solid::Ring { circle, minor_radius } => circle.radius / minor_radius,
        _ => 2.0,
    };
    let columns = libm::floor((f64::from(samples) * ratio).sqrt() + 0.5) as u32;
    let columns = if columns > samples { samples } else { columns };
    let columns = if columns == 0 { 1 } else { columns };
    (columns, samples / columns)
}

/// The angles of contact arcs as ranges of words.
struct Spans {
    spans: [(u32, u32); Arcs::CAPACITY],
    count: usize,
}

impl Spans {
    fn new(arcs: &Arcs) -> Spans {
        let mut spans = [(0, 0); Arcs::CAPACITY];
        for (span, piece) in spans.iter_mut().zip(arcs.iter()) {
            let half = piece.half_angle();
            let start = (piece.mid_angle() - half) / TURN;
            // Wider by a few words on both sides than the arc as rounded; a quarter turn is far below all words.
            let first = (start - libm::floor(start)) * WORDS;
            let length = 2.0 * half / TURN * WORDS + 16.0;
            *span = ((first as u64 as u32).wrapping_sub(8), length as u32);
        }
        Spans { spans, count: arcs.as_slice().len() }
    }

    #[inline]
    fn hold(&self, word: u32) -> bool {
        self.spans[..self.count].iter().any(|&(first, length)| word.wrapping_sub(first) <= length)
    }
}

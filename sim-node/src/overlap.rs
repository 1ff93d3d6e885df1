//! What must hold before the first step: nothing overlaps; and which rings are linked.

use crate::Model;
use crate::broad::Neighbours;
use crate::contact::shapes::pairs::{self, Placed};
use crate::model::ModelError;
use geometry::arc::circle_circle_arcs;
use geometry::circle::{closest_points, linked};
use geometry::{Circle, Vec3};

/// An overlap of less than this share of the smaller bounding radius is rounding of a touching pose.
const TOUCH_SHARE: f64 = 1e-9;

/// Refuses bodies that overlap; returns the pairs of rings that are linked, in order.
pub(crate) fn check_and_find_links(model: &Model) -> Result<Vec<(u32, u32)>, ModelError> {
    let circles = model.circles(model.initial_bodies());
    let mut neighbours = Neighbours::default();
    neighbours.update(model, &circles);
    let mut links = Vec::new();
    for &(a, b) in neighbours.pairs() {
        let rings = model.ring_count() as u32;
        if b < rings && linked(&circles[a as usize], &circles[b as usize]) {
            links.push((a, b));
        }
        let radius = |body: u32| match model.bodies().get(body as usize) {
            Some(body) => body.bounding_radius,
            None => f64::INFINITY,
        };
        let smaller = if radius(a) < radius(b) { radius(a) } else { radius(b) };
        let touching = -TOUCH_SHARE * smaller;
        if !may_overlap(model, &circles, a, b) {
            continue;
        }
        let gap_m = gap(model, &circles, a, b);
        if gap_m < touching {
            return Err(ModelError::Overlap { a: model.body_name(a), b: model.body_name(b), gap_m });
        }
    }
    Ok(links)
}

/// A quick answer for most pairs of rings: without contact arcs there is no overlap.
fn may_overlap(model: &Model, circles: &[Circle], a: u32, b: u32) -> bool {
    let rings = model.ring_count() as u32;
    if b >= rings {
        return true;
    }
    let reach = model.bodies()[a as usize].minor_radius + model.bodies()[b as usize].minor_radius;
    !circle_circle_arcs(&circles[a as usize], &circles[b as usize], reach).is_empty()
}

/// The signed distance of two surfaces (m), exact for each pair of shapes: negative is penetration.
pub(crate) fn gap(model: &Model, circles: &[Circle], a: u32, b: u32) -> f64 {
    let (body_a, circle_a) = (&model.bodies()[a as usize], &circles[a as usize]);
    let rings = model.ring_count() as u32;
    let Some(body_b) = model.bodies().get(b as usize) else {
        let plane = &model.planes()[b as usize - model.body_count()];
        if a as usize >= model.round_count() {
            return pairs::plane_gap(Placed { model, body: body_a, frame: circle_a }, plane);
        }
        let height = plane.normal.dot(&circle_a.centre) - plane.offset;
        // A circle reaches below its centre by its radius times the sine of its axis' angle to the normal.
        let sine = circle_a.normal.cross(&plane.normal).norm_squared().sqrt();
        return height - circle_a.radius * sine - body_a.minor_radius;
    };
    let circle_b = &circles[b as usize];
    if b as usize >= model.round_count() {
        let placed = |body, frame| Placed { model, body, frame };
        return pairs::gap(placed(body_a, circle_a), placed(body_b, circle_b));
    }
    let wires = body_a.minor_radius + body_b.minor_radius;
    if b < rings {
        closest_points(circle_a, circle_b).distance - wires
    } else if a < rings {
        geometry::circle::point_circle_distance(&circle_b.centre, circle_a) - wires
    } else {
        let apart: Vec3 = circle_a.centre - circle_b.centre;
        apart.norm_squared().sqrt() - wires
    }
}

//! How far a contact extends under each contact law: what its stiffness is multiplied with.

use crate::body::Body;
use crate::model::Model;
use schemas::scene::{ContactLaw, SurfaceAverage};

const PI: f64 = core::f64::consts::PI;

/// The extent of a contact with an arc of a length (1 for a point) and a patch of an area on a body's surface.
pub(super) fn of(model: &Model, length: f64, area: f64, body: &Body) -> f64 {
    match model.contact_law() {
        ContactLaw::CentrelineArc => length,
        ContactLaw::CentrelineMinima => 1.0,
        ContactLaw::SurfaceIntegral => match model.surface().average {
            SurfaceAverage::Area => area,
            // The share of the samples: uniform angles favour a ring's inner side.
            SurfaceAverage::AllSamples if body.major_radius > 0.0 => {
                let whole = 4.0 * PI * PI * body.major_radius * body.minor_radius;
                area / (whole * (1.0 - body.minor_radius / body.major_radius))
            }
            SurfaceAverage::AllSamples => area / (4.0 * PI * body.minor_radius * body.minor_radius),
        },
    }
}

/// The area inside of two crossed wires that touch at their inner sides: `2 pi d / kappa`.
pub(super) fn crossed_area(a: &Body, b: &Body, penetration: f64) -> f64 {
    let bending = |around: &Body, along: &Body| {
        1.0 / around.minor_radius - 1.0 / (along.major_radius - along.minor_radius)
    };
    let product = bending(a, b) * bending(b, a);
    let round = resting_area(a, penetration);
    let crossed = 2.0 * PI * penetration / product.sqrt();
    if product > 0.0 && crossed < round { crossed } else { round }
}

/// The area inside of a body on a plane: a strip all round a ring that lies flat, or a sphere's cap.
pub(super) fn resting_area(body: &Body, penetration: f64) -> f64 {
    let width = 2.0 * (2.0 * penetration * body.minor_radius).sqrt();
    if body.major_radius > 0.0 {
        2.0 * PI * body.major_radius * width
    } else {
        2.0 * PI * body.minor_radius * penetration
    }
}

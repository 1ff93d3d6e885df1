//! Polynomial bodies in a model: their surfaces, where they start, and which pairs have no law of contact.

use crate::BodyName;
use crate::body::Shape;
use crate::model::{Model, ModelError};
use crate::state::Motion;
use geometry::polynomial::Solid;
use schemas::scene::Scene;
use schemas::state::BodyState;

/// Compiles the surfaces of a scene's polynomials, and moves their starting poses, the last ones, from the formula's frame
/// to the centre of mass and the principal axes.
pub(crate) fn compile(scene: &Scene, initial: &mut [BodyState]) -> Result<Vec<Solid>, ModelError> {
    let first = initial.len() - scene.polynomials.len();
    let mut surfaces = Vec::with_capacity(scene.polynomials.len());
    for ((index, body), state) in scene.polynomials.iter().enumerate().zip(&mut initial[first..]) {
        let solid = Solid::new(&body.formula, body.scale_m, body.bounding_radius_m)
            .map_err(|cause| ModelError::Surface { body: BodyName::Polynomial(index), cause })?;
        let mut motion = Motion::of(state);
        let (centre, axes) = solid.place();
        motion.position += motion.orientation * centre;
        motion.orientation *= axes;
        motion.store(state);
        surfaces.push(solid);
    }
    Ok(surfaces)
}

/// Refuses pairs of shapes without a law of contact, unless neither body can move.
pub(crate) fn refuse_pairs(model: &Model) -> Result<(), ModelError> {
    let is_polynomial = |shape: &Shape| matches!(shape, Shape::Polynomial { .. });
    let bodies = model.bodies();
    // Polynomials are the last bodies, so the other of a pair has a lower number, or is a plane.
    let first = bodies.iter().position(|body| is_polynomial(&body.shape)).unwrap_or(bodies.len());
    for (number, body) in bodies.iter().enumerate().skip(first) {
        let name = |number: usize| model.body_name(number as u32);
        if !body.pinned && !model.planes().is_empty() {
            return Err(ModelError::Shapes {
                a: name(number),
                b: name(bodies.len()),
                reason: "a plane has no law of contact with a polynomial surface, of which any part may be lowest",
                pins: "the polynomial",
            });
        }
        for (other, other_body) in bodies.iter().enumerate().take(number) {
            let angular = matches!(other_body.shape, Shape::Box { .. } | Shape::Polynomial { .. });
            if angular && !(body.pinned && other_body.pinned) {
                return Err(ModelError::Shapes {
                    a: name(other),
                    b: name(number),
                    reason: "contact with a polynomial surface is carried by a centreline or a centre, which only \
                             rings, spheres and capsules have",
                    pins: "both",
                });
            }
        }
    }
    Ok(())
}

//! Capsules, boxes and polynomial bodies: what a ray meets there.

use crate::sieve::Outline;
use geometry::polynomial::{Solid, SolidError};
use geometry::{Aabb, Vec3, capsule, cuboid, rotation, sphere};
use nalgebra::{Quaternion, UnitQuaternion};
use schemas::scene::Scene;
use schemas::state::BodyState;
use std::sync::Arc;

/// The shape of a solid, in the body's own frame.
#[derive(Clone, Debug)]
pub(crate) enum SolidShape {
    Capsule { half_length: f64, radius: f64 },
    Box { core: Vec3, edge_radius: f64 },
    Polynomial(Arc<Solid>),
}

impl SolidShape {
    /// The shapes of a scene's solids with the names of their materials, in the order of a state.
    ///
    /// # Errors
    ///
    /// [`SolidError`] if a formula is not that of a body.
    pub(crate) fn of(scene: &Scene) -> Result<Vec<(SolidShape, &str)>, SolidError> {
        let capsules = scene.capsules.iter().map(|capsule| {
            let (half_length, radius) = (capsule.half_length_m, capsule.radius_m);
            Ok((SolidShape::Capsule { half_length, radius }, capsule.material.as_str()))
        });
        let boxes = scene.boxes.iter().map(|cuboid| {
            let core = Vec3::from(cuboid.half_extents_m).add_scalar(-cuboid.edge_radius_m);
            Ok((SolidShape::Box { core, edge_radius: cuboid.edge_radius_m }, cuboid.material.as_str()))
        });
        let polynomials = scene.polynomials.iter().map(|body| {
            let solid = Solid::new(&body.formula, body.scale_m, body.bounding_radius_m)?;
            Ok((SolidShape::Polynomial(Arc::new(solid)), body.material.as_str()))
        });
        capsules.chain(boxes).chain(polynomials).collect()
    }

    /// The size of the smallest thing to see on it (m): the start of rays is a millionth of it.
    pub(crate) fn detail(&self) -> f64 {
        match self {
            SolidShape::Capsule { radius, .. } => *radius,
            SolidShape::Box { core, edge_radius } => {
                let least = if core.x < core.y { core.x } else { core.y };
                edge_radius + if core.z < least { core.z } else { least }
            }
            SolidShape::Polynomial(solid) => 0.1 * solid.bounding_radius_m(),
        }
    }
}

/// A solid in its place: its axes in World.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SolidFrame {
    centre: Vec3,
    axes: [Vec3; 3],
}

impl SolidFrame {
    pub(crate) fn new(state: &BodyState) -> SolidFrame {
        let [x, y, z, w] = state.orientation;
        let (u, v, n) = rotation::axes(&UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)));
        SolidFrame { centre: Vec3::from(state.position_m), axes: [u, v, n] }
    }

    fn local(&self, vector: &Vec3) -> Vec3 {
        Vec3::new(self.axes[0].dot(vector), self.axes[1].dot(vector), self.axes[2].dot(vector))
    }

    fn world(&self, local: &Vec3) -> Vec3 {
        self.axes[0] * local.x + self.axes[1] * local.y + self.axes[2] * local.z
    }

    /// Distance to the first hit beyond `start`.
    pub(crate) fn hit(&self, shape: &SolidShape, origin: &Vec3, direction: &Vec3, start: f64) -> Option<f64> {
        let (origin, direction) = (self.local(&(origin - self.centre)), self.local(direction));
        match shape {
            SolidShape::Capsule { half_length, radius } => {
                capsule::ray_capsule(&origin, &direction, *half_length, *radius, start)
            }
            SolidShape::Box { core, edge_radius } => {
                cuboid::ray_cuboid(&origin, &direction, core, *edge_radius, start)
            }
            SolidShape::Polynomial(solid) => solid.ray(&origin, &direction, start),
        }
    }

    /// Outward unit normal at a point of the surface, and whether the tangent plane there has the whole body on one side.
    pub(crate) fn outward(&self, shape: &SolidShape, point: &Vec3) -> (Vec3, bool) {
        let local = self.local(&(point - self.centre));
        let (normal, bulges) = match shape {
            SolidShape::Capsule { half_length, .. } => {
                (capsule::segment_distance(&local, *half_length).0, true)
            }
            SolidShape::Box { core, edge_radius } => (cuboid::normal(&local, core, *edge_radius), true),
            SolidShape::Polynomial(solid) => (solid.normal(&local), false),
        };
        (self.world(&normal), bulges)
    }

    pub(crate) fn bounding_box(&self, shape: &SolidShape) -> Aabb {
        match shape {
            SolidShape::Capsule { half_length, radius } => {
                capsule::bounding_box(&self.centre, &self.axes[2], *half_length, *radius)
            }
            SolidShape::Box { core, edge_radius } => {
                cuboid::bounding_box(&self.centre, &self.axes, core, *edge_radius)
            }
            SolidShape::Polynomial(solid) => {
                let ball = sphere::bounding_box(&self.centre, solid.bounding_radius_m());
                let cuboid = cuboid::bounding_box(&self.centre, &self.axes, &solid.half_extents_m(), 0.0);
                Aabb {
                    min: ball.min.zip_map(&cuboid.min, |a, b| if b > a { b } else { a }),
                    max: ball.max.zip_map(&cuboid.max, |a, b| if b < a { b } else { a }),
                }
            }
        }
    }

    /// A ball, for the sieve.
    pub(crate) fn outline(&self, shape: &SolidShape) -> Outline {
        let outer_radius = match shape {
            SolidShape::Capsule { half_length, radius } => half_length + radius,
            SolidShape::Box { core, edge_radius } => core.norm() + edge_radius,
            SolidShape::Polynomial(solid) => solid.bounding_radius_m(),
        };
        let (normal, half_height, hole_radius) = (Vec3::zeros(), f64::INFINITY, -1.0);
        Outline { centre: self.centre, normal, outer_radius, half_height, hole_radius }
    }
}

/// The states of a scene's bodies before the first step, as the simulator starts them: a polynomial's is that of its centre
/// of mass and principal axes, while the scene has that of its formula's frame.
///
/// # Errors
///
/// [`SolidError`] if a formula is not that of a body.
pub fn initial_states(scene: &Scene) -> Result<Vec<BodyState>, SolidError> {
    let mut states = scene.initial_bodies();
    let first = states.len() - scene.polynomials.len();
    let polynomials = SolidShape::of(scene)?.into_iter().filter_map(|(shape, _)| match shape {
        SolidShape::Polynomial(solid) => Some(solid),
        _ => None,
    });
    for (solid, state) in polynomials.zip(&mut states[first..]) {
        let [x, y, z, w] = state.orientation;
        let turned = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        let (centre, axes) = solid.place();
        state.position_m = (Vec3::from(state.position_m) + turned * centre).into();
        let q = turned * axes;
        state.orientation = [q.i, q.j, q.k, q.w];
    }
    Ok(states)
}

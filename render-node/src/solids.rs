//! Capsules, boxes, polynomial bodies and surfaces that are only looked at: what a ray meets there.
//!
//! With `render.root_finder = "companion"` rings and spheres are among them, too: so the rays of all other scenes never
//! ask which finder there is.

use crate::colour::Wire;
use crate::sieve::Outline;
use geometry::polynomial::{Bounds, Solid, SolidError, Surface, SurfaceError};
use geometry::shift::closest_approach;
use geometry::{Aabb, Circle, RootFinder, Vec3, capsule, cuboid, rotation, sphere, torus};
use nalgebra::{Quaternion, UnitQuaternion};
use schemas::scene::{Scene, render};
use schemas::state::BodyState;
use std::sync::Arc;

/// The shape of a solid, in the body's own frame.
#[derive(Clone, Debug)]
pub(crate) enum SolidShape {
    Capsule {
        half_length: f64,
        radius: f64,
    },
    Box {
        core: Vec3,
        edge_radius: f64,
    },
    Polynomial(Arc<Solid>, RootFinder),
    /// A ring whose hits are eigenvalues.
    Ring {
        major_radius: f64,
        minor_radius: f64,
    },
    /// A sphere beside such rings.
    Sphere {
        radius: f64,
    },
    /// Not a body: it has no state.
    Sheet(Arc<Surface>, RootFinder),
}

/// A formula that does not describe what the scene says it does.
#[derive(Debug, thiserror::Error)]
pub enum FormulaRefused {
    /// That of a body.
    #[error("polynomial[{index}].formula: {cause}")]
    Body {
        /// Number of the body among the scene's polynomials.
        index: usize,
        /// What is wrong with it.
        #[source]
        cause: SolidError,
    },
    /// That of a surface to look at.
    #[error("render.surface[{index}].formula: {cause}")]
    Surface {
        /// Number of the surface.
        index: usize,
        /// What is wrong with it.
        #[source]
        cause: SurfaceError,
    },
}

/// The root finder that a scene chooses.
pub(crate) fn finder(scene: &Scene) -> RootFinder {
    match scene.render.root_finder {
        render::RootFinder::Bernstein => RootFinder::Bernstein,
        render::RootFinder::Companion => RootFinder::Companion,
    }
}

impl SolidShape {
    /// The scene's rings and spheres as solids, with the names of their materials.
    pub(crate) fn round(scene: &Scene) -> Vec<(SolidShape, &str)> {
        let rings = scene.rings.iter().map(|ring| {
            let (major_radius, minor_radius) = (ring.major_radius_m, ring.minor_radius_m);
            (SolidShape::Ring { major_radius, minor_radius }, ring.material.as_str())
        });
        let spheres = scene.spheres.iter();
        let spheres =
            spheres.map(|sphere| (SolidShape::Sphere { radius: sphere.radius_m }, sphere.material.as_str()));
        rings.chain(spheres).collect()
    }

    /// The scene's surfaces that are only looked at, with the names of their looks, in their places.
    ///
    /// # Errors
    ///
    /// [`FormulaRefused`] if nothing of one can be seen.
    pub(crate) fn sheets(scene: &Scene) -> Result<Vec<(SolidShape, &str, SolidFrame)>, FormulaRefused> {
        scene
            .render
            .surfaces
            .iter()
            .enumerate()
            .map(|(index, surface)| {
                let bounds = match (surface.bounding_half_extents_m, surface.bounding_radius_m) {
                    (Some(half), _) => Bounds::Box(Vec3::from(half)),
                    (None, radius) => {
                        Bounds::Ball(radius.expect("a scene is checked to give one of the two"))
                    }
                };
                let sheet = Surface::new(&surface.formula, surface.scale_m, bounds)
                    .map_err(|cause| FormulaRefused::Surface { index, cause })?;
                let [x, y, z, w] = surface.orientation;
                let turned = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
                let frame = SolidFrame::at(Vec3::from(surface.position_m), &turned);
                Ok((SolidShape::Sheet(Arc::new(sheet), finder(scene)), surface.look.as_str(), frame))
            })
            .collect()
    }

    /// The shapes of a scene's solids with the names of their materials, in the order of a state.
    ///
    /// # Errors
    ///
    /// [`FormulaRefused`] if a formula is not that of a body.
    pub(crate) fn of(scene: &Scene) -> Result<Vec<(SolidShape, &str)>, FormulaRefused> {
        let capsules = scene.capsules.iter().map(|capsule| {
            let (half_length, radius) = (capsule.half_length_m, capsule.radius_m);
            Ok((SolidShape::Capsule { half_length, radius }, capsule.material.as_str()))
        });
        let boxes = scene.boxes.iter().map(|cuboid| {
            let core = Vec3::from(cuboid.half_extents_m).add_scalar(-cuboid.edge_radius_m);
            Ok((SolidShape::Box { core, edge_radius: cuboid.edge_radius_m }, cuboid.material.as_str()))
        });
        let polynomials = scene.polynomials.iter().enumerate().map(|(index, body)| {
            let solid = Solid::new(&body.formula, body.scale_m, body.bounding_radius_m)
                .map_err(|cause| FormulaRefused::Body { index, cause })?;
            Ok((SolidShape::Polynomial(Arc::new(solid), finder(scene)), body.material.as_str()))
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
            SolidShape::Polynomial(solid, _) => 0.1 * solid.bounding_radius_m(),
            SolidShape::Ring { minor_radius, .. } => *minor_radius,
            SolidShape::Sphere { radius } => *radius,
            SolidShape::Sheet(surface, _) => {
                let half = surface.half_extents_m();
                let least = if half.x < half.y { half.x } else { half.y };
                0.1 * if half.z < least { half.z } else { least }
            }
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
        let turned = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        SolidFrame::at(Vec3::from(state.position_m), &turned)
    }

    fn at(centre: Vec3, turned: &UnitQuaternion<f64>) -> SolidFrame {
        let (u, v, n) = rotation::axes(turned);
        SolidFrame { centre, axes: [u, v, n] }
    }

    fn local(&self, vector: &Vec3) -> Vec3 {
        Vec3::new(self.axes[0].dot(vector), self.axes[1].dot(vector), self.axes[2].dot(vector))
    }

    fn world(&self, local: &Vec3) -> Vec3 {
        self.axes[0] * local.x + self.axes[1] * local.y + self.axes[2] * local.z
    }

    /// Distance to the first hit beyond `start`.
    pub(crate) fn hit(&self, shape: &SolidShape, origin: &Vec3, direction: &Vec3, start: f64) -> Option<f64> {
        // From the closest approach on, since turning a place far away would cost its last digits.
        let (s, near) =
            closest_approach(&(origin - self.centre), direction, self.outline(shape).outer_radius);
        let (origin, direction, start) = (self.local(&near), self.local(direction), start - s);
        let t = match shape {
            SolidShape::Capsule { half_length, radius } => {
                capsule::ray_capsule(&origin, &direction, *half_length, *radius, start)
            }
            SolidShape::Box { core, edge_radius } => {
                cuboid::ray_cuboid(&origin, &direction, core, *edge_radius, start)
            }
            SolidShape::Polynomial(solid, finder) => solid.ray_by(*finder, &origin, &direction, start),
            SolidShape::Ring { major_radius, minor_radius } => {
                torus::ray_torus_by_companion(&origin, &direction, *major_radius, *minor_radius, start)
            }
            SolidShape::Sphere { radius } => {
                sphere::ray_sphere(&origin, &direction, &Vec3::zeros(), *radius, start)
            }
            SolidShape::Sheet(surface, finder) => surface.ray(&origin, &direction, start, *finder),
        }?;
        Some(s + t)
    }

    /// Outward unit normal at a point of the surface, and whether the tangent plane there has the whole body on one side.
    pub(crate) fn outward(&self, shape: &SolidShape, point: &Vec3) -> (Vec3, bool) {
        let local = self.local(&(point - self.centre));
        let (normal, bulges) = match shape {
            SolidShape::Capsule { half_length, .. } => {
                (capsule::segment_distance(&local, *half_length).0, true)
            }
            SolidShape::Box { core, edge_radius } => (cuboid::normal(&local, core, *edge_radius), true),
            SolidShape::Polynomial(solid, _) => (solid.normal(&local), false),
            SolidShape::Ring { major_radius, .. } => {
                let beyond = local.x * local.x + local.y * local.y >= major_radius * major_radius;
                (torus::normal(&local, *major_radius), beyond)
            }
            SolidShape::Sphere { .. } => (sphere::normal(&local, &Vec3::zeros()), true),
            SolidShape::Sheet(surface, _) => (surface.normal(&local), false),
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
            SolidShape::Polynomial(solid, _) => {
                self.box_of(solid.bounding_radius_m(), &solid.half_extents_m())
            }
            SolidShape::Sheet(surface, _) => {
                self.box_of(surface.bounding_radius_m(), &surface.half_extents_m())
            }
            SolidShape::Ring { minor_radius, .. } => {
                torus::bounding_box(&self.circle(shape).expect("a ring"), *minor_radius)
            }
            SolidShape::Sphere { radius } => sphere::bounding_box(&self.centre, *radius),
        }
    }

    /// The box around what is within a ball and a box of its own.
    fn box_of(&self, radius: f64, half_extents: &Vec3) -> Aabb {
        let ball = sphere::bounding_box(&self.centre, radius);
        let cuboid = cuboid::bounding_box(&self.centre, &self.axes, half_extents, 0.0);
        Aabb {
            min: ball.min.zip_map(&cuboid.min, |a, b| if b > a { b } else { a }),
            max: ball.max.zip_map(&cuboid.max, |a, b| if b < a { b } else { a }),
        }
    }

    /// The centreline of a ring.
    fn circle(&self, shape: &SolidShape) -> Option<Circle> {
        let SolidShape::Ring { major_radius: radius, .. } = *shape else { return None };
        let [u, w, normal] = self.axes;
        Some(Circle { centre: self.centre, u, w, normal, radius })
    }

    /// A ring as the penetrations see it.
    pub(crate) fn wire(&self, shape: &SolidShape) -> Option<Wire> {
        let SolidShape::Ring { minor_radius, .. } = *shape else { return None };
        Some(Wire { circle: self.circle(shape)?, minor_radius, bounds: self.bounding_box(shape) })
    }

    /// A ball, for the sieve.
    pub(crate) fn outline(&self, shape: &SolidShape) -> Outline {
        let outer_radius = match shape {
            SolidShape::Capsule { half_length, radius } => half_length + radius,
            SolidShape::Box { core, edge_radius } => core.norm() + edge_radius,
            SolidShape::Polynomial(solid, _) => solid.bounding_radius_m(),
            SolidShape::Ring { major_radius, minor_radius } => major_radius + minor_radius,
            SolidShape::Sphere { radius } => *radius,
            SolidShape::Sheet(surface, _) => surface.bounding_radius_m(),
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
/// [`FormulaRefused`] if a formula is not that of a body.
pub fn initial_states(scene: &Scene) -> Result<Vec<BodyState>, FormulaRefused> {
    let mut states = scene.initial_bodies();
    let first = states.len() - scene.polynomials.len();
    let polynomials = SolidShape::of(scene)?.into_iter().filter_map(|(shape, _)| match shape {
        SolidShape::Polynomial(solid, _) => Some(solid),
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

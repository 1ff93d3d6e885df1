//! The narrow phase, one pair at a time: which law and which function of `contact` a pair of shapes takes.

use crate::Model;
use crate::body::Body;
use crate::contact::friction::Slip;
use crate::contact::material::PairMaterial;
use crate::contact::minima;
use crate::contact::shapes::pairs::{self, Placed};
use crate::contact::surface::{Surfaces, Workspace};
use crate::contact::{Pair, PairForce, ring_plane, ring_ring, ring_sphere, sphere_plane, sphere_sphere};
use crate::forces::{Moment, SlipMotion};
use crate::wrench::{Velocity, relative_velocity};
use geometry::arc::circle_circle_arcs;
use geometry::patch::Solid;
use geometry::{Arcs, Circle, Vec3};
use schemas::scene::ContactLaw;
use schemas::state::ContactState;

/// What every pair reads.
pub(crate) struct Narrow<'a> {
    pub model: &'a Model,
    pub moment: &'a Moment,
    pub springs: &'a [ContactState],
    pub slip: SlipMotion<'a>,
    /// Half the time step, where damping is implicit; else 0.
    pub half_step: f64,
}

impl Narrow<'_> {
    /// If two bodies touch, or a body and a plane, what they do to each other is appended. `arcs` are the contact arcs of
    /// two rings, if they are known.
    #[inline]
    pub(crate) fn pair<const DAMPED: bool, const FRICTION: bool>(
        &self,
        (a, b): (u32, u32),
        arcs: Option<&Arcs>,
        workspace: &mut Workspace,
        forces: &mut Vec<PairForce>,
    ) {
        if (b as usize) < self.model.ring_count() {
            let body = |number: u32| &self.model.bodies()[number as usize];
            let circles = &self.moment.circles;
            let reach = body(a).minor_radius + body(b).minor_radius;
            let found;
            let arcs = match arcs {
                Some(arcs) => arcs,
                None => {
                    found = circle_circle_arcs(&circles[a as usize], &circles[b as usize], reach);
                    &found
                }
            };
            if !arcs.is_empty() {
                self.two_bodies::<DAMPED, FRICTION>(a, b, Some((arcs, reach)), workspace, forces);
            }
        } else if (b as usize) < self.model.body_count() {
            self.two_bodies::<DAMPED, FRICTION>(a, b, None, workspace, forces);
        } else {
            self.body_and_plane::<DAMPED, FRICTION>(a, b, workspace, forces);
        }
    }

    /// `arcs`: of two rings, with the sum of their minor radii.
    #[inline]
    fn two_bodies<const DAMPED: bool, const FRICTION: bool>(
        &self,
        a: u32,
        b: u32,
        arcs: Option<(&Arcs, f64)>,
        workspace: &mut Workspace,
        forces: &mut Vec<PairForce>,
    ) {
        let (body_a, body_b) = (&self.model.bodies()[a as usize], &self.model.bodies()[b as usize]);
        let (circle_a, circle_b) = (&self.moment.circles[a as usize], &self.moment.circles[b as usize]);
        let from_b = circle_a.centre - circle_b.centre;
        let material = self.model.pair_material(a, b);
        let (rings, round) = (self.model.ring_count() as u32, self.model.round_count() as u32);
        let law = *self.model.normal_law(material, a);
        let relative = if DAMPED || FRICTION {
            self.relative(&self.moment.velocities, a, Some(b), &from_b)
        } else {
            Velocity::ZERO
        };
        let pair = Pair {
            numbers: (a, b),
            a: circle_a,
            a_minor_radius: body_a.minor_radius,
            law,
            sphere_modulus: material.sphere_modulus,
            from_b,
            relative,
            implicit: self.half_step * (body_a.mobility + body_b.mobility),
        };
        let slip = self.slip_of::<FRICTION>(material, &pair, Some(b));
        match self.model.contact_law() {
            ContactLaw::CentrelineArc => {}
            ContactLaw::CentrelineMinima if a < rings => {
                if let Some(arcs) = arcs {
                    return minima::ring_ring::<DAMPED, FRICTION>(&pair, circle_b, arcs, &slip, forces);
                }
                let (centre, radius) = (&circle_b.centre, body_b.minor_radius);
                return minima::ring_sphere::<DAMPED, FRICTION>(&pair, centre, radius, &slip, forces);
            }
            // Two spheres have one contact point under either law of the centrelines.
            ContactLaw::CentrelineMinima => {}
            ContactLaw::SurfaceIntegral => {
                let solid_a = solid(body_a, circle_a, Vec3::zeros());
                let solid_b = solid(body_b, circle_b, -from_b);
                let surfaces = self.surfaces(solid_a, solid_b, arcs.map(|(arcs, _)| arcs));
                return surfaces.collide::<DAMPED, FRICTION>(&pair, &slip, workspace, forces);
            }
        }
        if b >= round {
            let placed = |body, frame| Placed { model: self.model, body, frame };
            let back = Pair {
                a: circle_b,
                a_minor_radius: body_b.minor_radius,
                from_b: -from_b,
                relative: self.relative(&self.moment.velocities, b, Some(a), &-from_b),
                ..pair
            };
            let bodies = (placed(body_a, circle_a), placed(body_b, circle_b));
            pairs::two_bodies::<DAMPED, FRICTION>(&pair, &back, bodies, material.point, &slip, forces);
        } else if let Some(arcs) = arcs {
            ring_ring::<DAMPED, FRICTION>(&pair, circle_b, arcs, &slip, forces);
        } else if a < rings {
            ring_sphere::<DAMPED, FRICTION>(&pair, &circle_b.centre, body_b.minor_radius, &slip, forces);
        } else {
            sphere_sphere::<DAMPED, FRICTION>(&pair, body_b.minor_radius, &slip, forces);
        }
    }

    #[inline]
    fn body_and_plane<const DAMPED: bool, const FRICTION: bool>(
        &self,
        a: u32,
        b: u32,
        workspace: &mut Workspace,
        forces: &mut Vec<PairForce>,
    ) {
        let body = &self.model.bodies()[a as usize];
        let circle = &self.moment.circles[a as usize];
        let plane = &self.model.planes()[b as usize - self.model.body_count()];
        let material = self.model.pair_material(a, b);
        let is_ring = (a as usize) < self.model.ring_count();
        let is_solid = a as usize >= self.model.round_count();
        let law = *self.model.normal_law(material, a);
        let from_b = Vec3::zeros();
        let relative = self.relative(&self.moment.velocities, a, None, &from_b);
        let pair = Pair {
            numbers: (a, b),
            a: circle,
            a_minor_radius: body.minor_radius,
            law,
            sphere_modulus: material.sphere_modulus,
            from_b,
            relative,
            implicit: self.half_step * body.mobility,
        };
        let slip = self.slip_of::<FRICTION>(material, &pair, None);
        match self.model.contact_law() {
            ContactLaw::CentrelineMinima if is_ring => {
                return minima::ring_plane::<DAMPED, FRICTION>(&pair, plane, &slip, forces);
            }
            ContactLaw::CentrelineArc | ContactLaw::CentrelineMinima => {}
            ContactLaw::SurfaceIntegral => {
                let offset = plane.offset - plane.normal.dot(&circle.centre);
                let solid_b = Solid::Plane { normal: plane.normal, offset };
                let surfaces = self.surfaces(solid(body, circle, Vec3::zeros()), solid_b, None);
                return surfaces.collide::<DAMPED, FRICTION>(&pair, &slip, workspace, forces);
            }
        }
        if is_solid {
            let placed = Placed { model: self.model, body, frame: circle };
            pairs::on_plane::<DAMPED, FRICTION>(&pair, placed, plane, material.point, &slip, forces);
        } else if is_ring {
            ring_plane::<DAMPED, FRICTION>(&pair, plane, &slip, forces);
        } else {
            sphere_plane::<DAMPED, FRICTION>(&pair, plane, &slip, forces);
        }
    }

    /// The law `surface-integral` between two bodies, seen from the first one's centre.
    fn surfaces<'a>(&'a self, a: Solid, b: Solid, arcs: Option<&'a Arcs>) -> Surfaces<'a> {
        Surfaces { settings: self.model.surface(), a, b, arcs, random: self.moment.random.as_ref() }
    }

    /// Velocity of A relative to B; a plane is at rest.
    #[inline]
    fn relative(&self, velocities: &[Velocity], a: u32, b: Option<u32>, from_b: &Vec3) -> Velocity {
        match b {
            Some(b) => relative_velocity(&velocities[a as usize], &velocities[b as usize], from_b),
            None => velocities[a as usize],
        }
    }

    /// The state of friction between two bodies; nothing is looked up without friction.
    #[inline]
    fn slip_of<const FRICTION: bool>(
        &self,
        material: &PairMaterial,
        pair: &Pair,
        moving_b: Option<u32>,
    ) -> Slip<'_> {
        if !FRICTION || material.friction_coefficient == 0.0 {
            return Slip::NONE;
        }
        let (a, b) = pair.numbers;
        let start = self.springs.partition_point(|spring| (spring.body_a, spring.body_b) < (a, b));
        let rest = &self.springs[start..];
        let count = rest.iter().take_while(|spring| (spring.body_a, spring.body_b) == (a, b)).count();
        let (since, kept) = (self.slip.since, self.slip.kept);
        Slip {
            old: &rest[..count],
            coefficient: material.friction_coefficient,
            stiffness: material.friction_stiffness,
            since: (self.relative(since.0, a, moving_b, &pair.from_b), since.1),
            kept: (self.relative(kept.0, a, moving_b, &pair.from_b), kept.1),
        }
    }
}

/// A ring or sphere as its inside, at a place.
fn solid(body: &Body, circle: &Circle, centre: Vec3) -> Solid {
    if body.major_radius > 0.0 {
        Solid::Ring { circle: Circle { centre, ..*circle }, minor_radius: body.minor_radius }
    } else {
        Solid::Sphere { centre, radius: body.minor_radius }
    }
}

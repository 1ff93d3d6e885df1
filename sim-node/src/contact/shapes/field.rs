//! What a point of one body is measured against: the signed distance from the core of another one.

use geometry::polynomial::Solid;
use geometry::span::Bend;
use geometry::{Circle, Vec3, capsule, cuboid};

/// The core of a body, in its own axes.
#[derive(Clone, Copy)]
pub(crate) enum Core<'a> {
    /// The segment of its z axis up to this half length.
    Segment(f64),
    /// The box with these half extents.
    Cuboid(Vec3),
    /// The half-space below the plane `normal . p + height = 0`; World axes.
    HalfSpace { normal: Vec3, height: f64 },
    /// A polynomial body.
    Surface(&'a Solid),
}

/// A core in its place.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub core: Core<'a>,
    /// The body's axes in World.
    pub frame: &'a Circle,
    /// Radius of the body around the core (m).
    pub radius: f64,
}

impl Field<'_> {
    /// The outward unit normal at the nearest point of the core, and the signed distance from the core. World
    /// axes; `from` is the point less the body's centre.
    #[inline]
    pub(crate) fn distance(&self, from: &Vec3) -> (Vec3, f64) {
        let Circle { u, w, normal, .. } = self.frame;
        let local = || Vec3::new(from.dot(u), from.dot(w), from.dot(normal));
        let world = |(n, distance): (Vec3, f64)| (u * n.x + w * n.y + normal * n.z, distance);
        match &self.core {
            Core::Segment(half_length) => world(capsule::segment_distance(&local(), *half_length)),
            Core::Cuboid(core) => world(cuboid::core_distance(&local(), core)),
            Core::HalfSpace { normal, height } => (*normal, normal.dot(from) + height),
            Core::Surface(solid) => world(solid.distance(&local())),
        }
    }

    /// What is known of the distance along a circle of this radius, or along a line (infinity).
    #[inline]
    pub(crate) fn bend(&self, radius: f64) -> Bend {
        match self.core {
            Core::Segment(_) | Core::Cuboid(_) | Core::HalfSpace { .. } => Bend::AtLeast(1.0 / radius),
            Core::Surface(_) => Bend::Unknown,
        }
    }

    /// Shortest piece that the search for contact cuts, in units of the scale. Where the bend is known the search is
    /// quick and nothing but a shallower dip than `scale 1e-8 / 2` is missed. Along a polynomial surface it costs
    /// closest points, and a dip is missed that is shallower than `scale / 1e4` and narrower than a fiftieth of it.
    #[inline]
    pub(crate) fn width_min(&self) -> f64 {
        if matches!(self.core, Core::Surface(_)) { 0.02 } else { 1e-4 }
    }

    /// The length over which the distance changes its ways (m), for a carrier with this wire's radius.
    #[inline]
    pub(crate) fn scale(&self, wire: f64) -> f64 {
        let reach = self.radius + wire;
        match self.core {
            Core::Segment(_) | Core::HalfSpace { .. } | Core::Surface(_) => reach,
            Core::Cuboid(core) => {
                // Sharp edges against a sharp box: no reach at all.
                let least = if core.x < core.y { core.x } else { core.y };
                let least = 0.25 * if core.z < least { core.z } else { least };
                if reach > least { reach } else { least }
            }
        }
    }
}

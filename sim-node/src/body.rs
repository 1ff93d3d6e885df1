//! Constants of one rigid body: mass, inertia, size, and how drag slows it within a step.

use crate::drag;
use geometry::polynomial::Solid;
use geometry::{Circle, GaussRule, Vec3, capsule, cuboid};
use schemas::scene::{Capsule, Cuboid, Drag, Forces, Polynomial, Ring, Sphere};

/// The shape of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A solid torus about its own z axis.
    Ring {
        /// From the centre to the centreline of the wire, in metres.
        major_radius_m: f64,
        /// Radius of the wire, in metres.
        minor_radius_m: f64,
    },
    /// A solid sphere.
    Sphere {
        /// Its radius, in metres.
        radius_m: f64,
    },
    /// A solid capsule about its own z axis.
    Capsule {
        /// Radius of its wall and caps, in metres.
        radius_m: f64,
        /// Half the length of its wall, in metres.
        half_length_m: f64,
    },
    /// A solid box.
    Box {
        /// Half extents of its core: without the edge radius, in metres.
        core_m: Vec3,
        /// Radius of its edges, in metres.
        edge_radius_m: f64,
    },
    /// A solid body bounded by a polynomial.
    Polynomial {
        /// Number of its surface in the model.
        surface: u32,
        /// Radius of a ball about the centre of mass that holds it, in metres.
        bounding_radius_m: f64,
        /// Half extents, along its principal axes, of a box about the centre of mass that holds it, in metres.
        half_extents_m: Vec3,
    },
}

impl Shape {
    /// Radius of the centreline, of the wire about it, and of the sphere about the centre that holds it all.
    fn radii(&self) -> (f64, f64, f64) {
        match *self {
            Shape::Ring { major_radius_m: major, minor_radius_m: minor } => (major, minor, major + minor),
            Shape::Sphere { radius_m } => (0.0, radius_m, 0.0 + radius_m),
            Shape::Capsule { radius_m, half_length_m } => (0.0, radius_m, half_length_m + radius_m),
            Shape::Box { core_m, edge_radius_m } => {
                (0.0, edge_radius_m, core_m.norm_squared().sqrt() + edge_radius_m)
            }
            Shape::Polynomial { bounding_radius_m, .. } => (0.0, 0.0, bounding_radius_m),
        }
    }

    /// Half extents along the body's own axes; `None` for rings and spheres, which need none.
    fn half_extents(&self) -> Option<Vec3> {
        match *self {
            Shape::Ring { .. } | Shape::Sphere { .. } => None,
            Shape::Capsule { radius_m, half_length_m } => {
                Some(Vec3::new(radius_m, radius_m, half_length_m + radius_m))
            }
            Shape::Box { core_m, edge_radius_m } => Some(core_m.add_scalar(edge_radius_m)),
            Shape::Polynomial { half_extents_m, .. } => Some(half_extents_m),
        }
    }
}

/// What the motion needs to know of one body; never changes after the scene is compiled.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its shape.
    pub shape: Shape,
    /// Mass in kilograms, also of a pinned body.
    pub mass_kg: f64,
    /// Principal moments of inertia, about the body's own x, y and z axes (kg m^2).
    pub inertia_kg_m2: [f64; 3],
    /// Moment of inertia about any axis through the centre and across the body's own z axis (kg m^2); the
    /// one about x of a body that is not a symmetric top.
    pub inertia_transverse_kg_m2: f64,
    /// Moment of inertia about the body's own z axis (kg m^2).
    pub inertia_axial_kg_m2: f64,
    /// No force moves it: it is pinned, or follows a prescribed motion.
    pub pinned: bool,
    /// It follows a prescribed motion.
    pub driven: bool,
    /// Number of its material in the model.
    pub(crate) material: u32,
    /// Radius of the sphere about the centre that holds the whole body (m).
    pub(crate) bounding_radius: f64,
    /// Radius of the wire, of the sphere, of the capsule, or of the box's edges (m).
    pub(crate) minor_radius: f64,
    /// Radius of the centreline; 0 for all but rings (m).
    pub(crate) major_radius: f64,
    pub(crate) inverse_mass: f64,
    pub(crate) inverse_transverse: f64,
    pub(crate) inverse_axial: f64,
    /// Inverses of the principal moments; 0 for a pinned body (1/(kg m^2)).
    pub(crate) inverse_inertia: [f64; 3],
    /// The moments about x and y differ: not a symmetric top.
    pub(crate) asymmetric: bool,
    /// `1 - I3 / I1`: the part of the axial spin that is not precession.
    pub(crate) spin_share: f64,
    /// Velocity that a unit impulse can give to a point of the surface, times the contacts that may act at
    /// once: links and one more (1/kg). For the implicit rate of damping.
    pub(crate) mobility: f64,
    /// The same for one contact at any point of the surface of a body that is neither ring nor sphere.
    anywhere: Option<f64>,
    /// Coefficient of quadratic drag (kg/m).
    pub(crate) quadratic_drag: f64,
    pub(crate) linear_drag: Decay,
    pub(crate) transverse_drag: Decay,
    pub(crate) axial_drag: Decay,
}

impl Body {
    /// A ring.
    ///
    /// # Source
    /// Moments of inertia of a solid torus: `(5/8 r^2 + 1/2 R^2) m` across its axis, `(3/4 r^2 + R^2) m`
    /// about it.
    pub(crate) fn ring(ring: &Ring, material: u32, forces: &Forces, time_step: f64) -> Body {
        let (major, minor, mass) = (ring.major_radius_m, ring.minor_radius_m, ring.mass_kg);
        let transverse = (0.625 * minor * minor + 0.5 * major * major) * mass;
        let axial = (0.75 * minor * minor + major * major) * mass;
        let shape = Shape::Ring { major_radius_m: major, minor_radius_m: minor };
        let drags = drag::of_ring(ring.drag, forces);
        Body::new(
            shape,
            mass,
            [transverse, transverse, axial],
            (ring.pinned, ring.motion.is_some()),
            material,
            drags,
            time_step,
        )
    }

    /// A sphere; without drag of its own it has none.
    pub(crate) fn sphere(sphere: &Sphere, material: u32, time_step: f64) -> Body {
        let inertia = 0.4 * sphere.mass_kg * sphere.radius_m * sphere.radius_m;
        let shape = Shape::Sphere { radius_m: sphere.radius_m };
        Body::new(
            shape,
            sphere.mass_kg,
            [inertia; 3],
            (sphere.pinned, sphere.motion.is_some()),
            material,
            sphere.drag.unwrap_or(drag::NONE),
            time_step,
        )
    }

    /// A capsule.
    pub(crate) fn capsule(capsule: &Capsule, material: u32, time_step: f64) -> Body {
        let (half_length_m, radius_m) = (capsule.half_length_m, capsule.radius_m);
        let inertia = capsule::inertia(half_length_m, radius_m, capsule.mass_kg);
        let shape = Shape::Capsule { radius_m, half_length_m };
        Body::new(shape, capsule.mass_kg, inertia, (capsule.pinned, false), material, drag::NONE, time_step)
    }

    /// A box.
    pub(crate) fn cuboid(cuboid: &Cuboid, material: u32, time_step: f64) -> Body {
        let edge_radius_m = cuboid.edge_radius_m;
        let core_m = Vec3::from(cuboid.half_extents_m).add_scalar(-edge_radius_m);
        let inertia = cuboid::inertia(&core_m, edge_radius_m, cuboid.mass_kg);
        let shape = Shape::Box { core_m, edge_radius_m };
        Body::new(shape, cuboid.mass_kg, inertia, (cuboid.pinned, false), material, drag::NONE, time_step)
    }

    /// A body bounded by a polynomial, with its surface and the number of that.
    pub(crate) fn polynomial(
        body: &Polynomial,
        (solid, surface): (&Solid, u32),
        material: u32,
        time_step: f64,
    ) -> Body {
        let mass = match (body.mass_kg, body.density_kg_per_m3) {
            (Some(mass), _) => mass,
            (None, density) => solid.volume_m3() * density.expect("a resolved scene has one of the two"),
        };
        let (bounding_radius_m, half_extents_m) = (solid.bounding_radius_m(), solid.half_extents_m());
        let shape = Shape::Polynomial { surface, bounding_radius_m, half_extents_m };
        let inertia = solid.inertia(mass);
        Body::new(shape, mass, inertia, (body.pinned, false), material, drag::NONE, time_step)
    }

    /// Velocity per impulse at a point that is at most `lever` from the centre (1/kg), in any direction.
    pub(crate) fn mobility_at(&self, lever: f64) -> f64 {
        self.anywhere.unwrap_or(self.inverse_mass + lever * lever * self.inverse_transverse)
    }

    /// Angular acceleration of the free body under a torque (rad/s^2), by Euler's equations; World axes.
    /// `frame` holds the body's axes, and of a pinned body the answer is 0.
    ///
    /// For a symmetric top with the axis `n` and `w3 = w . n`: `L = I1 w + (I3 - I1) w3 n` and
    /// `I dw/dt = torque - w x L`. Otherwise the same, component by component in the body's axes.
    #[inline]
    pub(crate) fn angular_acceleration(&self, frame: &Circle, angular: &Vec3, torque: &Vec3) -> Vec3 {
        let normal = &frame.normal;
        if !self.asymmetric {
            let spin = angular.dot(normal);
            let gyroscopic = (self.inertia_axial_kg_m2 - self.inertia_transverse_kg_m2) * spin;
            let torque = torque - angular.cross(normal) * gyroscopic;
            let about = torque.dot(normal);
            return (torque - normal * about) * self.inverse_transverse
                + normal * (about * self.inverse_axial);
        }
        let local = |v: &Vec3| Vec3::new(v.dot(&frame.u), v.dot(&frame.w), v.dot(normal));
        let (w, [i1, i2, i3]) = (local(angular), self.inertia_kg_m2);
        let momentum = Vec3::new(i1 * w.x, i2 * w.y, i3 * w.z);
        let torque = local(torque) - w.cross(&momentum);
        let [j1, j2, j3] = self.inverse_inertia;
        frame.u * (j1 * torque.x) + frame.w * (j2 * torque.y) + normal * (j3 * torque.z)
    }

    /// Kinetic energy of rotation (J); `frame` holds the body's axes.
    #[inline]
    pub(crate) fn rotational_energy(&self, frame: (&Vec3, &Vec3, &Vec3), angular: &Vec3) -> f64 {
        let (u, w, normal) = frame;
        let about = angular.dot(normal);
        if self.asymmetric {
            let [i1, i2, i3] = self.inertia_kg_m2;
            let (x, y) = (angular.dot(u), angular.dot(w));
            return 0.5 * (i1 * x * x + i2 * y * y + i3 * about * about);
        }
        let across = angular - normal * about;
        0.5 * self.inertia_transverse_kg_m2 * across.norm_squared()
            + 0.5 * self.inertia_axial_kg_m2 * about * about
    }

    /// Nothing moves it any more.
    pub(crate) fn pin(&mut self) {
        self.pinned = true;
        (self.inverse_mass, self.inverse_transverse, self.inverse_axial) = (0.0, 0.0, 0.0);
        self.inverse_inertia = [0.0; 3];
        self.mobility = 0.0;
        self.anywhere = self.anywhere.map(|_| 0.0);
    }

    /// Makes the constants of drag for another time step (s).
    pub(crate) fn take_time_step(&mut self, time_step: f64) {
        let [linear, transverse, axial] =
            [&self.linear_drag, &self.transverse_drag, &self.axial_drag].map(|decay| decay.drag);
        self.linear_drag = Decay::new(linear, self.mass_kg, time_step);
        self.transverse_drag = Decay::new(transverse, self.inertia_transverse_kg_m2, time_step);
        self.axial_drag = Decay::new(axial, self.inertia_axial_kg_m2, time_step);
    }

    fn new(
        shape: Shape,
        mass: f64,
        inertia_kg_m2: [f64; 3],
        (pinned, driven): (bool, bool),
        material: u32,
        drag: Drag,
        time_step: f64,
    ) -> Body {
        let pinned = pinned || driven;
        let (major_radius, minor_radius, bounding_radius) = shape.radii();
        let inverse = |value: f64| if pinned { 0.0 } else { 1.0 / value };
        let [transverse, second, axial] = inertia_kg_m2;
        // A unit impulse n at the point p turns with the torque p x n, whose component along x is at most the
        // root of p_y^2 + p_z^2; and so on.
        let anywhere = shape.half_extents().map(|half| {
            let lever_squared = |a: f64, b: f64| a * a + b * b;
            inverse(mass)
                + lever_squared(half.y, half.z) * inverse(transverse)
                + lever_squared(half.z, half.x) * inverse(second)
                + lever_squared(half.x, half.y) * inverse(axial)
        });
        Body {
            shape,
            mass_kg: mass,
            inertia_kg_m2,
            inertia_transverse_kg_m2: transverse,
            inertia_axial_kg_m2: axial,
            pinned,
            driven,
            material,
            bounding_radius,
            minor_radius,
            major_radius,
            inverse_mass: inverse(mass),
            inverse_transverse: inverse(transverse),
            inverse_axial: inverse(axial),
            inverse_inertia: inertia_kg_m2.map(inverse),
            asymmetric: transverse != second,
            spin_share: 1.0 - axial / transverse,
            mobility: 0.0,
            anywhere,
            quadratic_drag: drag.quadratic_kg_per_m,
            linear_drag: Decay::new(drag.linear_kg_per_s, mass, time_step),
            transverse_drag: Decay::new(drag.angular_kg_m2_per_s, transverse, time_step),
            axial_drag: Decay::new(drag.angular_kg_m2_per_s, axial, time_step),
        }
    }
}

/// One component of velocity under a constant acceleration `a` and linear drag, over one step `h`:
/// `v(t) = v exp(-l t) + a phi(t)` with `l = drag / inertia` and `phi(t) = (1 - exp(-l t)) / l`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Decay {
    /// The drag coefficient: power lost is `drag v^2`.
    pub drag: f64,
    /// `exp(-l h)`; exactly 1 without drag.
    pub keep: f64,
    /// `phi(h)`, the integral of `exp(-l t)`; exactly `h` without drag.
    pub gain: f64,
    /// Integral of `phi`; `h^2 / 2` without drag.
    pub reach: f64,
    /// Integral of `exp(-2 l t)`.
    pub keep_squared: f64,
    /// Integral of `phi^2`.
    pub gain_squared: f64,
}

impl Decay {
    pub(crate) fn new(drag: f64, inertia: f64, time_step: f64) -> Decay {
        let h = time_step;
        if drag == 0.0 {
            let (reach, gain_squared) = (0.5 * h * h, h * h * h / 3.0);
            return Decay { drag, keep: 1.0, gain: h, reach, keep_squared: h, gain_squared };
        }
        let rate = drag / inertia;
        let phi = |t: f64| -libm::expm1(-rate * t) / rate;
        // Beyond one decay time the closed forms lose nothing; before it they cancel, while the integrand
        // is so smooth that eight Gauss points are exact to rounding.
        let (reach, gain_squared) = if rate * h > 1.0 {
            let reach = (h - phi(h)) / rate;
            (reach, (reach - 0.5 * phi(h) * phi(h)) / rate)
        } else {
            let mut sums = (0.0, 0.0);
            for &(x, weight) in GaussRule::Eight.nodes() {
                let value = phi(0.5 * h * (1.0 + x));
                sums.0 += 0.5 * h * weight * value;
                sums.1 += 0.5 * h * weight * value * value;
            }
            sums
        };
        let keep_squared = -libm::expm1(-2.0 * rate * h) / (2.0 * rate);
        Decay { drag, keep: libm::exp(-rate * h), gain: phi(h), reach, keep_squared, gain_squared }
    }

    /// Energy lost to drag over the step, for a velocity and an acceleration given by their squares and
    /// their product.
    #[inline]
    pub(crate) fn loss(&self, velocity_squared: f64, product: f64, acceleration_squared: f64) -> f64 {
        // The integral of exp(-l t) phi(t) is phi(h)^2 / 2, since phi' = exp(-l t).
        self.drag
            * (self.keep_squared * velocity_squared
                + self.gain * self.gain * product
                + self.gain_squared * acceleration_squared)
    }
}

#[cfg(test)]
mod tests {
    use super::Decay;

    /// Both branches of [`Decay::new`] meet at one decay time, and small drag tends to none.
    #[test]
    fn integrals_agree_across_the_branches() {
        let h = 1e-3;
        let (below, above) = (Decay::new(1.0 / h, 1.0 + 1e-12, h), Decay::new(1.0 / h, 1.0 - 1e-12, h));
        for (a, b) in [
            (below.keep, above.keep),
            (below.gain, above.gain),
            (below.reach, above.reach),
            (below.gain_squared, above.gain_squared),
        ] {
            let difference = (a / b - 1.0).abs();
            println!("relative difference {difference:e}, allowed 2e-11");
            // The arguments differ by 2e-12; each integral is a power of at most 3 in them.
            assert!(difference < 2e-11, "{a} {b}");
        }
        let (none, little) = (Decay::new(0.0, 1.0, h), Decay::new(1e-9, 1.0, h));
        assert!((little.reach / none.reach - 1.0).abs() < 1e-12);
        assert!((little.gain_squared / none.gain_squared - 1.0).abs() < 2e-12);
    }
}

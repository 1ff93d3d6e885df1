//! Random numbers, poses and rays, the same in every run.

use geometry::{Circle, Vec3};
use nalgebra::{Quaternion, UnitQuaternion};

/// SplitMix64 (Steele, Lea, Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// Uniform in the logarithm.
    pub fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        libm::exp(self.uniform(libm::log(low), libm::log(high)))
    }

    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = Vec3::new(self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0));
            let squared = v.norm_squared();
            if squared > 1e-4 && squared < 1.0 {
                return v / squared.sqrt();
            }
        }
    }

    pub fn orientation(&mut self) -> UnitQuaternion<f64> {
        loop {
            let q = Quaternion::new(
                self.uniform(-1.0, 1.0),
                self.uniform(-1.0, 1.0),
                self.uniform(-1.0, 1.0),
                self.uniform(-1.0, 1.0),
            );
            let squared = q.norm_squared();
            if squared > 1e-4 && squared < 1.0 {
                return UnitQuaternion::new_unchecked(q / squared.sqrt());
            }
        }
    }

    /// A circle with its centre within `distance` of the origin.
    pub fn circle(&mut self, distance: f64, radius: f64) -> Circle {
        let centre = self.direction() * self.uniform(0.0, distance);
        Circle::from_pose(centre, &self.orientation(), radius)
    }
}

/// `count` angles around the circle as `(cos, sin)`, starting at `offset` steps.
pub fn angles(count: usize, offset: f64) -> Vec<(f64, f64)> {
    (0..count)
        .map(|i| {
            let t = core::f64::consts::TAU * (i as f64 + offset) / count as f64;
            (libm::cos(t), libm::sin(t))
        })
        .collect()
}

/// The degenerate relative poses of two circles, with names; B has radius 1, A as given.
pub fn degenerate_pairs(radius_a: f64) -> Vec<(&'static str, Circle, Circle)> {
    let flat = UnitQuaternion::identity();
    let quarter = core::f64::consts::FRAC_PI_2;
    let upright = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), quarter);
    let turned = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), 0.7);
    let over = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), 2.0 * quarter);
    let b = Circle::from_pose(Vec3::zeros(), &flat, 1.0);
    let a =
        |x: f64, y: f64, z: f64, q: &UnitQuaternion<f64>| Circle::from_pose(Vec3::new(x, y, z), q, radius_a);
    vec![
        ("identical", a(0.0, 0.0, 0.0, &flat), b),
        ("identical, turned about the axis", a(0.0, 0.0, 0.0, &turned), b),
        ("identical, turned over", a(0.0, 0.0, 0.0, &over), b),
        ("coaxial 0.1", a(0.0, 0.0, 0.1, &flat), b),
        ("coaxial 0.36", a(0.0, 0.0, 0.36, &flat), b),
        ("coaxial 0.36, turned over", a(0.0, 0.0, 0.36, &over), b),
        ("coaxial 3", a(0.0, 0.0, 3.0, &flat), b),
        ("coplanar crossing", a(1.5, 0.0, 0.0, &flat), b),
        ("coplanar touching", a(1.0 + radius_a, 0.0, 0.0, &flat), b),
        ("coplanar apart", a(1.2 + radius_a, 0.0, 0.0, &flat), b),
        ("coplanar inside", a(0.05, 0.0, 0.0, &flat), b),
        ("concentric orthogonal", a(0.0, 0.0, 0.0, &upright), b),
        ("orthogonal through the centre of B", a(radius_a, 0.0, 0.0, &upright), b),
        ("orthogonal, linked", a(1.0, 0.0, 0.0, &upright), b),
        ("orthogonal, touching inside", a(1.0 - 0.9, 0.0, 0.0, &upright), b),
        ("parallel, shifted across", a(0.4, 0.0, 0.3, &flat), b),
        ("parallel, almost", a(0.0, 0.0, 0.2, &UnitQuaternion::from_axis_angle(&Vec3::x_axis(), 1e-9)), b),
    ]
}

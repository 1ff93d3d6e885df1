//! Materials given by what they do: restitution, damping ratio, contact modulus; and drag.

use super::bodies::{Drag, Material, Ring};
use super::validate::{not_negative, positive, refuse_number};
use super::{Scene, SceneError};

/// Share of both wires that a crossing penetrates by where `damping_ratio` holds.
const CROSSING_PENETRATION: f64 = 0.05;

/// Checks a body's drag; `key` makes a field's path.
pub(super) fn drag(key: &dyn Fn(&str) -> String, drag: Option<&Drag>) -> Result<(), SceneError> {
    let Some(drag) = drag else { return Ok(()) };
    not_negative(&key("drag.linear_kg_per_s"), drag.linear_kg_per_s)?;
    not_negative(&key("drag.quadratic_kg_per_m"), drag.quadratic_kg_per_m)?;
    not_negative(&key("drag.angular_kg_m2_per_s"), drag.angular_kg_m2_per_s)
}

impl Material {
    /// Checks what a material may say in several ways.
    pub(super) fn validate(&self, key: &dyn Fn(&str) -> String) -> Result<(), SceneError> {
        let optional = [
            ("line_stiffness_n_per_m2", self.line_stiffness_n_per_m2),
            ("contact_modulus_pa", self.contact_modulus_pa),
            ("restitution_speed_m_per_s", self.restitution_speed_m_per_s),
        ];
        for (field, given) in optional {
            given.map_or(Ok(()), |given| positive(&key(field), given))?;
        }
        if let (Some(modulus), Some(_)) = (self.contact_modulus_pa, self.line_stiffness_n_per_m2) {
            let expected = "this or line_stiffness_n_per_m2, not both: one follows from the other";
            return Err(refuse_number(&key("contact_modulus_pa"), modulus, expected));
        }
        if let Some(restitution) = self.restitution
            && !(restitution > 1e-3 && restitution <= 1.0)
        {
            return Err(refuse_number(&key("restitution"), restitution, "more than 0.001, and at most 1"));
        }
        if let (None, Some(speed)) = (self.restitution, self.restitution_speed_m_per_s) {
            let expected = "no such key without restitution";
            return Err(refuse_number(&key("restitution_speed_m_per_s"), speed, expected));
        }
        if let Some(ratio) = self.damping_ratio {
            not_negative(&key("damping_ratio"), ratio)?;
            if self.contact_modulus_pa.is_some() {
                let expected = "a line stiffness with it: with a contact modulus no stiffness is constant; \
                                take restitution";
                return Err(refuse_number(&key("damping_ratio"), ratio, expected));
            }
        }
        let constants = [
            ("damping_s_per_m", self.damping_s_per_m),
            ("line_damping_n_s_per_m2", self.line_damping_n_s_per_m2),
            ("point_damping_n_s_per_m", self.point_damping_n_s_per_m),
        ];
        let given = [("restitution", self.restitution), ("damping_ratio", self.damping_ratio)];
        let mut ways = given.into_iter().filter_map(|(field, given)| Some((field, given?)));
        let Some((field, value)) = ways.next() else { return Ok(()) };
        let other = ways.next().or_else(|| constants.into_iter().find(|constant| constant.1 != 0.0));
        match other {
            Some((other, _)) => {
                let expected = format!("this or {other}, not both: each says all of the damping");
                Err(refuse_number(&key(field), value, &expected))
            }
            None => Ok(()),
        }
    }
}

impl Scene {
    /// Turns restitution and damping ratio into damping constants, and writes defaults out.
    pub(super) fn resolve_materials(&mut self) {
        let names: Vec<String> = self.materials.keys().cloned().collect();
        for name in names {
            let (wire, ball) = (self.lightest_ring(&name).cloned(), self.lightest_sphere(&name));
            let Some(material) = self.materials.get_mut(&name) else { continue };
            if material.contact_modulus_pa.is_none() {
                material.line_stiffness_n_per_m2 = Some(material.line_stiffness());
            }
            if let Some(restitution) = material.restitution.take() {
                let speed = material.restitution_speed_m_per_s.take().unwrap_or(1.0);
                material.damping_s_per_m = rate_damping(restitution) / speed;
            }
            if let Some(ratio) = material.damping_ratio.take() {
                let critical = |stiffness: f64, mass: f64| 2.0 * (stiffness * mass).sqrt();
                if let Some(ring) = wire {
                    let length = crossing_length(&ring);
                    let spring = material.line_stiffness() * length;
                    material.line_damping_n_s_per_m2 = ratio * critical(spring, 0.5 * ring.mass_kg) / length;
                }
                if let Some(mass) = ball {
                    material.point_damping_n_s_per_m =
                        ratio * critical(material.point_stiffness_n_per_m, mass);
                }
            }
        }
    }

    /// The lightest free ring of a material, or of all where the material has none.
    fn lightest_ring(&self, material: &str) -> Option<&Ring> {
        let free = || self.rings.iter().filter(|ring| !ring.pinned && ring.motion.is_none());
        let lighter = |a: &&Ring, b: &&Ring| a.mass_kg.total_cmp(&b.mass_kg);
        free().filter(|ring| ring.material == material).min_by(lighter).or_else(|| free().min_by(lighter))
    }

    /// Mass of the lightest free sphere of a material, or of all where the material has none (kg).
    fn lightest_sphere(&self, material: &str) -> Option<f64> {
        let free = || self.spheres.iter().filter(|sphere| !sphere.pinned && sphere.motion.is_none());
        let mass = |own: bool| {
            let those = free().filter(|sphere| !own || sphere.material == material);
            those.map(|sphere| sphere.mass_kg).min_by(f64::total_cmp)
        };
        mass(true).or_else(|| mass(false))
    }
}

/// Length of the contact arc of two such rings that cross, at the reference penetration (m): see `stability`
/// in the simulator.
fn crossing_length(ring: &Ring) -> f64 {
    let reach = 2.0 * ring.minor_radius_m;
    let curvature = 1.0 / reach - 1.0 / ring.major_radius_m;
    let whole = 2.0 * std::f64::consts::PI * ring.major_radius_m;
    let crossed = 2.0 * (2.0 * CROSSING_PENETRATION * reach / curvature).sqrt();
    // Wires nearly as thick as their ring bend around each other all the way.
    if curvature > 0.0 && crossed < whole { crossed } else { whole }
}

/// Hunt-Crossley damping times the speed of an impact that leaves the share `e` of the speed.
///
/// With the force `F(d) (1 + z d')`, `m d' dd'/(1 + z d') = -F dd`, whatever `F` is. Integrated from the impact at
/// the speed `v` to the deepest point and from there to the end at `e v`, with `a = z v`:
/// `a - ln(1 + a) = -e a - ln(1 - e a)`.
fn rate_damping(restitution: f64) -> f64 {
    let e = restitution;
    // Here both sides cancel to the third order; to the next order in 1 - e this is the root.
    if 1.0 - e < 1e-4 {
        return 1.5 * (1.0 - e);
    }
    // Positive before the root, negative after it, down to minus infinity at 1 / e.
    let balance = |a: f64| (a - libm::log1p(a)) + (e * a + libm::log1p(-e * a));
    let (mut low, mut high) = (0.0, 1.0 / e);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if balance(middle) > 0.0 || middle < 1e-5 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::rate_damping;

    /// The root fulfils its equation, and its two branches meet.
    #[test]
    fn restitution_becomes_damping() {
        for e in [0.0011, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999] {
            let a = rate_damping(e);
            let (before, after) = (a - libm::log1p(a), -e * a - libm::log1p(-e * a));
            println!("e {e}: z v = {a}, {before:e} against {after:e}");
            // Logarithms of numbers near 1: rounding of 1e-16 against a^2. For a small e the root lies so close
            // to the pole at 1 / e that one unit in a's last place changes everything: there it is the
            // neighbours that lie on both sides (beyond the pole the logarithm is not a number).
            let balance = |a: f64| (a - libm::log1p(a)) + (e * a + libm::log1p(-e * a));
            let ulps = 4.0 * f64::EPSILON * a;
            let (below, above) = (balance(a - ulps), balance(a + ulps));
            let between = below > 0.0 && (above <= 0.0 || above.is_nan());
            assert!(between || (before - after).abs() <= 1e-15 * (1.0 + a) + 1e-14 * before, "{e}");
        }
        let (below, above) = (rate_damping(1.0 - 0.99e-4), rate_damping(1.0 - 1.01e-4));
        assert!(
            (below / 0.99e-4 - 1.5).abs() < 1e-3 && (above / 1.01e-4 - 1.5).abs() < 1e-3,
            "{below} {above}"
        );
        assert_eq!(rate_damping(1.0), 0.0);
    }
}

//! What two materials do to each other in contact.

use schemas::scene::Material;

/// The law of one contact: `max(0, k d (1 + z d') + c d')` with the penetration `d` and its rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NormalLaw {
    /// Stiffness `k`: N/m^2 along an arc, N/m at a point, N/m^3 on a surface.
    pub stiffness: f64,
    /// Hunt-Crossley damping `z` (s/m).
    pub rate_damping: f64,
    /// Kelvin-Voigt damping `c`: N s/m^2 along an arc, N s/m at a point, N s/m^3 on a surface.
    pub viscous_damping: f64,
}

impl NormalLaw {
    /// Pressure (force per length) or force at a penetration and its rate; never pulls. With
    /// `implicit`, half the time step times both bodies' mobility times the arc's length, the rate is the one
    /// to which damping alone has slowed it in the middle of the step: no damping is too strong for a step
    /// then. 0 takes the rate as it is.
    #[inline]
    pub(crate) fn push(&self, penetration: f64, rate: f64, implicit: f64) -> f64 {
        let elastic = self.stiffness * penetration;
        let damping = elastic * self.rate_damping + self.viscous_damping;
        let push = elastic + damping * (rate / (1.0 + implicit * damping));
        if push > 0.0 { push } else { 0.0 }
    }

    /// Damping over stiffness at a penetration (s): friction's spring is damped in the same proportion.
    #[inline]
    pub(crate) fn damping_time(&self, penetration: f64) -> f64 {
        self.rate_damping * penetration + self.viscous_damping / self.stiffness
    }

    /// The point law at a penetration that presses as Hertz's law there: `F = 4/3 E* sqrt(r) d^1.5`, with the
    /// modulus `E*` and the effective radius `r`. The energy is 2/5 `F d`, four fifths of a spring's.
    #[inline]
    pub(crate) fn hertz(&self, modulus: f64, radius: f64, penetration: f64) -> NormalLaw {
        NormalLaw { stiffness: 4.0 / 3.0 * modulus * (radius * penetration).sqrt(), ..*self }
    }

    fn damped(&self) -> bool {
        self.rate_damping != 0.0 || self.viscous_damping != 0.0
    }
}

/// Constants of a pair of materials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PairMaterial {
    /// Along contact arcs.
    pub line: NormalLaw,
    /// At contact points.
    pub point: NormalLaw,
    /// On surfaces.
    pub surface: NormalLaw,
    /// Hertz's effective modulus of sphere against sphere or plane (Pa); 0 where the point law holds.
    pub sphere_modulus: f64,
    /// Coulomb's coefficient.
    pub friction_coefficient: f64,
    /// Stiffness of the tangential spring (N/m).
    pub friction_stiffness: f64,
}

impl PairMaterial {
    /// The pair's constants: harmonic mean of stiffnesses, arithmetic mean of dampings, geometric mean of
    /// friction coefficients (as [`Material`] promises).
    pub(crate) fn new(a: &Material, b: &Material) -> PairMaterial {
        let damping = 0.5 * (a.damping_s_per_m + b.damping_s_per_m);
        PairMaterial {
            line: NormalLaw {
                stiffness: harmonic_mean(a.line_stiffness(), b.line_stiffness()),
                rate_damping: damping,
                viscous_damping: 0.5 * (a.line_damping_n_s_per_m2 + b.line_damping_n_s_per_m2),
            },
            point: NormalLaw {
                stiffness: harmonic_mean(a.point_stiffness_n_per_m, b.point_stiffness_n_per_m),
                rate_damping: damping,
                viscous_damping: 0.5 * (a.point_damping_n_s_per_m + b.point_damping_n_s_per_m),
            },
            surface: NormalLaw {
                stiffness: harmonic_mean(a.surface_stiffness_n_per_m3, b.surface_stiffness_n_per_m3),
                rate_damping: damping,
                viscous_damping: 0.5 * (a.surface_damping_n_s_per_m3 + b.surface_damping_n_s_per_m3),
            },
            sphere_modulus: match (a.contact_modulus_pa, b.contact_modulus_pa) {
                (Some(a), Some(b)) => harmonic_mean(a, b),
                _ => 0.0,
            },
            friction_coefficient: (a.friction_coefficient * b.friction_coefficient).sqrt(),
            friction_stiffness: harmonic_mean(a.friction_stiffness_n_per_m, b.friction_stiffness_n_per_m),
        }
    }

    /// Whether any contact of this pair is damped.
    pub(crate) fn damped(&self) -> bool {
        self.line.damped() || self.point.damped() || self.surface.damped()
    }
}

fn harmonic_mean(a: f64, b: f64) -> f64 {
    // Equal values stay what they are; the quotient would round.
    if a == b { a } else { 2.0 / (1.0 / a + 1.0 / b) }
}

//! How a material looks.

use serde::{Deserialize, Serialize};

/// How a material looks. Which keys belong to it depends on `bsdf`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Look {
    /// How it scatters light.
    #[serde(skip_serializing_if = "super::is_default")]
    pub bsdf: Bsdf,
    /// `lambertian`, `plastic`, `mirror`: share of light reflected (red, green, blue), each from 0 to 1; that of a
    /// plastic is what lies under its surface. Others do not read it.
    pub albedo: [f64; 3],
    /// `lambertian`, `plastic`: a second albedo makes a checkerboard on planes, with squares of one metre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checker_albedo: Option<[f64; 3]>,
    /// `conductor`: a measured metal; steel if nothing is said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metal: Option<Metal>,
    /// `conductor`: real part of the refractive index (red, green, blue), instead of `metal`; with `k`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub eta: Option<[f64; 3]>,
    /// `conductor`: its imaginary part, the extinction coefficient; with `eta`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub k: Option<[f64; 3]>,
    /// `conductor`, `plastic`: 0 is polished, 1 as rough as can be; the width of the distribution of normals, alpha,
    /// is its square. 0.3 for a conductor and 0.2 for a plastic if nothing is said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roughness: Option<f64>,
    /// `plastic`: refractive index of the coating; 1.5 if nothing is said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refractive_index: Option<f64>,
    /// `emitter`: emitted radiance (red, green, blue).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radiance: Option<[f64; 3]>,
}

impl Default for Look {
    fn default() -> Self {
        Look {
            bsdf: Bsdf::default(),
            albedo: [0.5; 3],
            checker_albedo: None,
            metal: None,
            eta: None,
            k: None,
            roughness: None,
            refractive_index: None,
            radiance: None,
        }
    }
}

/// How a surface scatters light (its bidirectional scattering distribution function).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bsdf {
    /// The same radiance to all sides: chalk, paper.
    #[default]
    Lambertian,
    /// A metal, polished or rough (GGX).
    Conductor,
    /// A Lambertian body under a clear coating, polished or rough: plastic, varnish, glaze.
    Plastic,
    /// A perfect mirror.
    Mirror,
    /// It reflects nothing and glows. Only paths that happen to meet it see it: for small bright ones a light is better.
    Emitter,
}

impl Bsdf {
    /// Its name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Bsdf::Lambertian => "lambertian",
            Bsdf::Conductor => "conductor",
            Bsdf::Plastic => "plastic",
            Bsdf::Mirror => "mirror",
            Bsdf::Emitter => "emitter",
        }
    }
}

/// A metal whose refractive index was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Metal {
    /// Ferritic stainless steel.
    #[default]
    Steel,
    /// Brass of 70 % copper and 30 % zinc.
    Brass,
    /// Gold.
    Gold,
    /// Aluminium.
    Aluminium,
    /// Copper.
    Copper,
    /// Silver.
    Silver,
}

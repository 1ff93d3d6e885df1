//! How a surface scatters light: `eval`, `sample` and `pdf` of every kind of surface.
//!
//! The one thing to know: all directions are unit vectors in the surface's own frame, whose z axis is the normal on
//! the side that the path came from, and point away from the surface; `wo` is where the light goes, `wi` where it
//! comes from. `eval` holds the cosine of `wi`. A direction that only one ray can have (a mirror's) has no density:
//! `eval` and `pdf` leave it out, and `sample` says so by `pdf: None`.

mod fresnel;
mod ggx;
mod metal;

use crate::warp;
use core::f64::consts::FRAC_1_PI;
pub use fresnel::{ComplexIndex, dielectric_reflectance};
use geometry::Vec3;
pub use ggx::Ggx;
pub use metal::RoughConductor;
use schemas::scene::render::{self, Look};

/// A rough surface whose alpha is below this is taken for polished: its highlights would be narrower than 0.06 degrees.
const POLISHED_ALPHA: f64 = 1e-3;

/// How a surface scatters light.
#[derive(Clone, Debug)]
pub enum Bsdf {
    /// The same radiance to all sides.
    Lambertian {
        /// Share of light reflected (red, green, blue).
        albedo: Vec3,
    },
    /// A mirror that reflects the same share from all directions.
    Mirror {
        /// That share (red, green, blue).
        reflectance: Vec3,
    },
    /// A polished metal.
    PolishedConductor(ComplexIndex),
    /// A rough metal. In a box: its table would make all others large.
    RoughConductor(Box<RoughConductor>),
    /// A Lambertian body under a clear coating.
    Plastic(Plastic),
}

/// A Lambertian body under a clear coating of a refractive index.
///
/// Light that enters is reflected by the body, and again and again by body and coating from within, until it leaves.
/// With a polished coating and a white body all light comes back.
///
/// # Source
/// Weidlich and Wilkie, "Arbitrarily layered micro-facet surfaces", GRAPHITE 2007, for a coating on a Lambertian body; the
/// series of inner reflections is that of Wolff, "Diffuse-reflectance model for smooth dielectric surfaces", JOSA A 11,
/// 1994, eq. 13. Deviation: a rough coating lets light through as a polished one does.
#[derive(Clone, Debug)]
pub struct Plastic {
    /// What the body and all inner reflections let out, over pi and the square of the index.
    body: Vec3,
    /// Mean over the channels of what the body gives, for the choice between coating and body.
    body_mean: f64,
    index: f64,
    /// `None` for a polished coating.
    facets: Option<Ggx>,
}

/// A direction that light may come from.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// The direction.
    pub wi: Vec3,
    /// `eval` over `pdf`, or what a mirror reflects.
    pub weight: Vec3,
    /// Density of the direction per solid angle; `None` where it is the only one.
    pub pdf: Option<f64>,
}

impl Bsdf {
    /// The surface of a look with one of its albedos; an emitter reflects nothing.
    pub fn new(look: &Look, albedo: [f64; 3]) -> Bsdf {
        let albedo = Vec3::from(albedo);
        let alpha = |default: f64| {
            let roughness = look.roughness.unwrap_or(default);
            roughness * roughness
        };
        let facets = |alpha: f64| (alpha >= POLISHED_ALPHA).then_some(Ggx { alpha });
        match look.bsdf {
            render::Bsdf::Lambertian => Bsdf::Lambertian { albedo },
            render::Bsdf::Emitter => Bsdf::Lambertian { albedo: Vec3::zeros() },
            render::Bsdf::Mirror => Bsdf::Mirror { reflectance: albedo },
            render::Bsdf::Conductor => {
                let index = ComplexIndex::of(look);
                match facets(alpha(0.3)) {
                    None => Bsdf::PolishedConductor(index),
                    Some(facets) => Bsdf::RoughConductor(Box::new(RoughConductor::new(index, facets))),
                }
            }
            render::Bsdf::Plastic => {
                Bsdf::Plastic(Plastic::new(albedo, look.refractive_index.unwrap_or(1.5), facets(alpha(0.2))))
            }
        }
    }

    /// Whether `eval` is zero everywhere because light comes from single directions only.
    #[inline]
    pub fn is_mirror(&self) -> bool {
        matches!(self, Bsdf::Mirror { .. } | Bsdf::PolishedConductor(_))
    }

    /// The share of light that leaves along `wo` of what comes along `wi`, per solid angle of `wi`, times its cosine.
    #[inline]
    pub fn eval(&self, wo: &Vec3, wi: &Vec3) -> Vec3 {
        if !(wi.z > 0.0) {
            return Vec3::zeros();
        }
        match self {
            Bsdf::Lambertian { albedo } => albedo * (FRAC_1_PI * wi.z),
            Bsdf::Mirror { .. } | Bsdf::PolishedConductor(_) => Vec3::zeros(),
            Bsdf::RoughConductor(metal) => metal.eval(wo, wi),
            Bsdf::Plastic(plastic) => plastic.eval(wo, wi),
        }
    }

    /// Density per solid angle with which `sample` chooses `wi`.
    #[inline]
    pub fn pdf(&self, wo: &Vec3, wi: &Vec3) -> f64 {
        if !(wi.z > 0.0) {
            return 0.0;
        }
        match self {
            Bsdf::Lambertian { .. } => FRAC_1_PI * wi.z,
            Bsdf::Mirror { .. } | Bsdf::PolishedConductor(_) => 0.0,
            Bsdf::RoughConductor(metal) => metal.pdf(wo, wi),
            Bsdf::Plastic(plastic) => plastic.pdf(wo, wi),
        }
    }

    /// Chooses where light may come from; `None` where a facet throws it into the surface.
    #[inline]
    pub fn sample(&self, wo: &Vec3, square: (f64, f64)) -> Option<BsdfSample> {
        match self {
            Bsdf::Lambertian { albedo } => {
                let wi = warp::cosine_hemisphere(square);
                Some(BsdfSample { wi, weight: *albedo, pdf: Some(FRAC_1_PI * wi.z) })
            }
            Bsdf::Mirror { reflectance } => Some(mirrored(wo, *reflectance)),
            Bsdf::PolishedConductor(index) => Some(mirrored(wo, index.reflectance(wo.z))),
            Bsdf::RoughConductor(metal) => metal.sample(wo, square),
            Bsdf::Plastic(plastic) => plastic.sample(wo, square),
        }
    }

    /// What the surface reflects of light that comes straight down, or a Lambertian body's albedo: for feature images.
    pub fn albedo(&self) -> Vec3 {
        match self {
            Bsdf::Lambertian { albedo } | Bsdf::Mirror { reflectance: albedo } => *albedo,
            Bsdf::PolishedConductor(index) => index.reflectance(1.0),
            Bsdf::RoughConductor(metal) => metal.index().reflectance(1.0),
            Bsdf::Plastic(plastic) => {
                let coating = dielectric_reflectance(1.0, plastic.index);
                let through = 1.0 - coating;
                (plastic.body * (core::f64::consts::PI * through * through)).add_scalar(coating)
            }
        }
    }
}

/// The one direction that a mirror shows.
#[inline]
fn mirrored(wo: &Vec3, weight: Vec3) -> BsdfSample {
    BsdfSample { wi: Vec3::new(-wo.x, -wo.y, wo.z), weight, pdf: None }
}

impl Plastic {
    /// A body of an albedo under a coating.
    pub fn new(albedo: Vec3, index: f64, facets: Option<Ggx>) -> Plastic {
        // The share of diffuse light that the coating sends back from within (Wolff, eq. 14): what comes from outside
        // and gets in would all get out again, squeezed into the cone of total reflection.
        let inner = 1.0 - (1.0 - fresnel::diffuse_reflectance(index)) / (index * index);
        let body = albedo.map(|albedo| albedo / (1.0 - albedo * inner) * FRAC_1_PI / (index * index));
        let body_mean = albedo.sum() / 3.0;
        Plastic { body, body_mean, index, facets }
    }

    /// Probability with which `sample` takes the coating.
    #[inline]
    fn coating_share(&self, wo: &Vec3) -> f64 {
        let coating = dielectric_reflectance(wo.z, self.index);
        let body = (1.0 - coating) * self.body_mean;
        if body > 0.0 { coating / (coating + body) } else { 1.0 }
    }

    #[inline]
    fn body(&self, wo: &Vec3, wi: &Vec3) -> Vec3 {
        let into = 1.0 - dielectric_reflectance(wi.z, self.index);
        let out = 1.0 - dielectric_reflectance(wo.z, self.index);
        self.body * (into * out * wi.z)
    }

    fn eval(&self, wo: &Vec3, wi: &Vec3) -> Vec3 {
        let body = self.body(wo, wi);
        let Some(facets) = &self.facets else { return body };
        let (value, cosine) = facets.eval(wo, wi);
        body.add_scalar(value * dielectric_reflectance(cosine, self.index))
    }

    fn pdf(&self, wo: &Vec3, wi: &Vec3) -> f64 {
        let share = self.coating_share(wo);
        let body = (1.0 - share) * FRAC_1_PI * wi.z;
        self.facets.as_ref().map_or(body, |facets| body + share * facets.pdf(wo, wi))
    }

    fn sample(&self, wo: &Vec3, (u, v): (f64, f64)) -> Option<BsdfSample> {
        let share = self.coating_share(wo);
        let wi = if u < share {
            // What chose is again uniform.
            let square = (u / share, v);
            match &self.facets {
                None => {
                    let coating = dielectric_reflectance(wo.z, self.index);
                    return Some(mirrored(wo, Vec3::repeat(coating / share)));
                }
                Some(facets) => facets.sample(wo, square)?.0,
            }
        } else {
            warp::cosine_hemisphere(((u - share) / (1.0 - share), v))
        };
        let pdf = self.pdf(wo, &wi);
        (pdf > 0.0).then(|| BsdfSample { wi, weight: self.eval(wo, &wi) / pdf, pdf: Some(pdf) })
    }
}

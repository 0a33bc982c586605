//! How one point of a surface scatters: an enum of leaves, so that the inner loop calls no virtual function.

use super::{Conductor, Dielectric, Diffuse, Phong, Plastic, Principled, RoughDiffuse, ThinDielectric, Ward};
use crate::math::Vec3;
use crate::spectrum::Spectrum;

/// What a pair of directions is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluation {
    /// f · |cosθᵢ| [sr⁻¹ · 1]; for a delta lobe the coefficient of the delta [1].
    pub value: Spectrum,
    /// Density of sampling `wi` given `wo` [sr⁻¹]; for a delta lobe the probability of choosing it [1].
    pub density: f32,
}

impl Evaluation {
    /// No scattering.
    pub const NONE: Evaluation = Evaluation { value: Spectrum::BLACK, density: 0.0 };

    /// Whether it is worth nothing and never sampled. What is black but sampled still competes with other ways to the same path.
    #[inline]
    pub fn is_none(&self) -> bool {
        self.density <= 0.0 && self.value.is_black()
    }
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// Direction to go on.
    pub wi: Vec3,
    /// Its value and density.
    pub evaluation: Evaluation,
    /// Whether a delta lobe was sampled.
    pub delta: bool,
}

/// How one point of a surface scatters: numbers only, no textures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// Lambertian reflection.
    Diffuse(Diffuse),
    /// Matt facets.
    RoughDiffuse(RoughDiffuse),
    /// Smooth or rough metal.
    Conductor(Conductor),
    /// Smooth or rough boundary between two transparent media.
    Dielectric(Dielectric),
    /// Thin sheet of glass.
    ThinDielectric(ThinDielectric),
    /// Diffuse base under a smooth or rough coat.
    Plastic(Plastic),
    /// Metal, dielectric and glass, with coat and sheen.
    Principled(Principled),
    /// Phong's lobe over a diffuse base.
    Phong(Phong),
    /// Ward's lobe over a diffuse base.
    Ward(Ward),
    /// Light passes as if nothing were there.
    Null,
}

impl Bsdf {
    /// Value and density of a pair of directions; nothing for delta lobes.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        match self {
            Bsdf::Diffuse(m) => m.evaluate(wo, wi),
            Bsdf::RoughDiffuse(m) => m.evaluate(wo, wi),
            Bsdf::Conductor(m) => m.evaluate(wo, wi),
            Bsdf::Dielectric(m) => m.evaluate(wo, wi),
            Bsdf::Plastic(m) => m.evaluate(wo, wi),
            Bsdf::Principled(m) => m.evaluate(wo, wi),
            Bsdf::Phong(m) => m.evaluate(wo, wi),
            Bsdf::Ward(m) => m.evaluate(wo, wi),
            Bsdf::ThinDielectric(_) | Bsdf::Null => Evaluation::NONE,
        }
    }

    /// Value and probability of the delta lobe that reflects or transmits; nothing where there is none.
    #[inline]
    pub fn evaluate_delta(&self, wo: Vec3, transmits: bool) -> Evaluation {
        match self {
            Bsdf::Conductor(m) => m.evaluate_delta(wo, transmits),
            Bsdf::Dielectric(m) => m.evaluate_delta(wo, transmits),
            Bsdf::ThinDielectric(m) => m.evaluate_delta(wo, transmits),
            Bsdf::Plastic(m) => m.evaluate_delta(wo, transmits),
            Bsdf::Null if transmits => Evaluation { value: Spectrum::WHITE, density: 1.0 },
            _ => Evaluation::NONE,
        }
    }

    /// Probability with which [`sample`](Self::sample) picks a delta lobe: 1 where there is nothing else, 0 where there is none.
    #[inline]
    pub fn delta_probability(&self, wo: Vec3) -> f32 {
        match self {
            Bsdf::Conductor(m) => m.delta_probability(),
            Bsdf::Dielectric(m) => m.delta_probability(),
            Bsdf::Plastic(m) => m.delta_probability(wo),
            Bsdf::ThinDielectric(_) | Bsdf::Null => 1.0,
            _ => 0.0,
        }
    }

    /// Samples a direction; `choice` in [0, 1) picks among lobes: the delta lobes own what lies below
    /// [`delta_probability`](Self::delta_probability). `None` where nothing scatters.
    #[inline]
    pub fn sample(&self, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        match self {
            Bsdf::Diffuse(m) => m.sample(wo, u),
            Bsdf::RoughDiffuse(m) => m.sample(wo, u),
            Bsdf::Conductor(m) => m.sample(wo, choice, u),
            Bsdf::Dielectric(m) => m.sample(wo, choice, u),
            Bsdf::ThinDielectric(m) => m.sample(wo, choice),
            Bsdf::Plastic(m) => m.sample(wo, choice, u),
            Bsdf::Principled(m) => m.sample(wo, choice, u),
            Bsdf::Phong(m) => m.sample(wo, choice, u),
            Bsdf::Ward(m) => m.sample(wo, choice, u),
            Bsdf::Null => Some(Scatter { wi: -wo, evaluation: self.evaluate_delta(wo, true), delta: true }),
        }
    }

    /// Whether [`sample`](Self::sample) uses its number `choice`.
    #[inline]
    pub fn has_choice(&self) -> bool {
        match self {
            Bsdf::Diffuse(_) | Bsdf::RoughDiffuse(_) | Bsdf::Null => false,
            Bsdf::Conductor(m) => m.bounced.is_some(),
            _ => true,
        }
    }

    /// Roughness of the sharpest lobe that is no delta; 1 for diffuse; 0 where there are delta lobes only.
    #[inline]
    pub fn roughness(&self) -> f32 {
        match self {
            Bsdf::Diffuse(_) | Bsdf::RoughDiffuse(_) => 1.0,
            Bsdf::Conductor(m) => m.roughness(),
            Bsdf::Dielectric(m) => m.roughness(),
            Bsdf::Plastic(m) => m.roughness(),
            Bsdf::Principled(m) => m.roughness(),
            Bsdf::Phong(m) => m.roughness(),
            Bsdf::Ward(m) => m.roughness(),
            Bsdf::ThinDielectric(_) | Bsdf::Null => 0.0,
        }
    }

    /// Relative index of refraction, transmitted over incident side, for light seen from `wo`; 1 where nothing is bent.
    #[inline]
    pub fn relative_ior(&self, wo: Vec3) -> f32 {
        match self {
            Bsdf::Dielectric(m) => m.relative_ior(wo),
            Bsdf::Principled(m) => m.relative_ior(wo),
            _ => 1.0,
        }
    }

    /// Whether light may pass to the other side.
    pub fn transmits(&self) -> bool {
        match self {
            Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) | Bsdf::Null => true,
            Bsdf::Principled(m) => m.transmits(),
            _ => false,
        }
    }

    /// Whether directions along the surface matter.
    pub fn is_anisotropic(&self) -> bool {
        match self {
            Bsdf::Conductor(m) => m.facets.is_some_and(|f| f.is_anisotropic()),
            Bsdf::Dielectric(m) => m.facets.is_some_and(|f| f.is_anisotropic()),
            Bsdf::Principled(m) => m.is_anisotropic(),
            Bsdf::Ward(m) => m.alpha_u != m.alpha_v,
            _ => false,
        }
    }

    /// Reflectance for the albedo feature [1].
    pub fn albedo(&self) -> Spectrum {
        match self {
            Bsdf::Diffuse(m) => m.reflectance,
            Bsdf::RoughDiffuse(m) => m.albedo(),
            Bsdf::Conductor(m) => m.albedo(),
            Bsdf::Plastic(m) => m.albedo(),
            Bsdf::Principled(m) => m.albedo(),
            Bsdf::Phong(m) => m.albedo(),
            Bsdf::Ward(m) => m.albedo(),
            Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) | Bsdf::Null => Spectrum::WHITE,
        }
    }
}

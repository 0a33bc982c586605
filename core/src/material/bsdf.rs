//! How one point of a surface scatters: an enum of leaves, so that the inner loop calls no virtual function.

use super::{Conductor, Dielectric, Diffuse};
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
#[derive(Clone, Debug, PartialEq)]
pub enum Bsdf {
    /// Lambertian reflection.
    Diffuse(Diffuse),
    /// Smooth or rough metal.
    Conductor(Conductor),
    /// Smooth or rough boundary between two transparent media.
    Dielectric(Dielectric),
}

impl Bsdf {
    /// Value and density of a pair of directions; nothing for delta lobes.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        match self {
            Bsdf::Diffuse(m) => m.evaluate(wo, wi),
            Bsdf::Conductor(m) => m.evaluate(wo, wi),
            Bsdf::Dielectric(m) => m.evaluate(wo, wi),
        }
    }

    /// Value and probability of the delta lobe that reflects or transmits; nothing where there is none.
    #[inline]
    pub fn evaluate_delta(&self, wo: Vec3, transmits: bool) -> Evaluation {
        match self {
            Bsdf::Diffuse(_) => Evaluation::NONE,
            Bsdf::Conductor(m) => m.evaluate_delta(wo, transmits),
            Bsdf::Dielectric(m) => m.evaluate_delta(wo, transmits),
        }
    }

    /// Probability with which [`sample`](Self::sample) picks a delta lobe: 1 where there is nothing else, 0 where there is none.
    #[inline]
    pub fn delta_probability(&self, _wo: Vec3) -> f32 {
        f32::from(u8::from(self.roughness() == 0.0))
    }

    /// Samples a direction; `choice` in [0, 1) picks among lobes: the delta lobes own what lies below
    /// [`delta_probability`](Self::delta_probability). `None` where nothing scatters.
    #[inline]
    pub fn sample(&self, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        match self {
            Bsdf::Diffuse(m) => m.sample(wo, u),
            Bsdf::Conductor(m) => m.sample(wo, u),
            Bsdf::Dielectric(m) => m.sample(wo, choice, u),
        }
    }

    /// Whether [`sample`](Self::sample) uses its number `choice`.
    #[inline]
    pub fn has_choice(&self) -> bool {
        match self {
            Bsdf::Diffuse(_) | Bsdf::Conductor(_) => false,
            Bsdf::Dielectric(_) => true,
        }
    }

    /// Roughness of the sharpest lobe that is no delta; 1 for diffuse; 0 where there are delta lobes only.
    #[inline]
    pub fn roughness(&self) -> f32 {
        match self {
            Bsdf::Diffuse(_) => 1.0,
            Bsdf::Conductor(m) => m.roughness(),
            Bsdf::Dielectric(m) => m.roughness(),
        }
    }

    /// Relative index of refraction, transmitted over incident side, for light seen from `wo`; 1 where nothing is transmitted.
    #[inline]
    pub fn relative_ior(&self, wo: Vec3) -> f32 {
        match self {
            Bsdf::Dielectric(m) => m.relative_ior(wo),
            _ => 1.0,
        }
    }

    /// Reflectance for the albedo feature [1].
    pub fn albedo(&self) -> Spectrum {
        match self {
            Bsdf::Diffuse(m) => m.reflectance,
            Bsdf::Conductor(m) => m.albedo(),
            Bsdf::Dielectric(_) => Spectrum::WHITE,
        }
    }
}

//! How surfaces scatter light. An enum, so that the inner loop calls no virtual function.
//!
//! Directions are unit vectors of the local shading frame (z the shading normal of the front side), both pointing away from
//! the surface: `wo` to where the path came from (the camera's side), `wi` to where it goes on (the light's side).

mod conductor;
mod dielectric;
mod diffuse;
mod fresnel;
mod microfacet;

pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use microfacet::Ggx;

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
}

/// A surface's material.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// Lambertian reflection.
    Diffuse(Diffuse),
    /// Smooth or rough metal.
    Conductor(Conductor),
    /// Smooth or rough boundary between two transparent media.
    Dielectric(Dielectric),
}

impl Material {
    /// Value and density of a pair of directions; nothing for delta lobes.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        match self {
            Material::Diffuse(m) => m.evaluate(wo, wi),
            Material::Conductor(m) => m.evaluate(wo, wi),
            Material::Dielectric(m) => m.evaluate(wo, wi),
        }
    }

    /// Value and probability of the delta lobe that reflects or transmits; nothing where there is none.
    #[inline]
    pub fn evaluate_delta(&self, wo: Vec3, transmits: bool) -> Evaluation {
        match self {
            Material::Diffuse(_) => Evaluation::NONE,
            Material::Conductor(m) => m.evaluate_delta(wo, transmits),
            Material::Dielectric(m) => m.evaluate_delta(wo, transmits),
        }
    }

    /// Samples a direction; `choice` picks among lobes, and is drawn only where there are several. `None` where nothing scatters.
    #[inline]
    pub fn sample(&self, wo: Vec3, choice: impl FnOnce() -> f32, u: [f32; 2]) -> Option<Scatter> {
        match self {
            Material::Diffuse(m) => m.sample(wo, u),
            Material::Conductor(m) => m.sample(wo, u),
            Material::Dielectric(m) => m.sample(wo, choice(), u),
        }
    }

    /// Roughness of the sharpest lobe: 0 for delta lobes, 1 for diffuse.
    #[inline]
    pub fn roughness(&self) -> f32 {
        match self {
            Material::Diffuse(_) => 1.0,
            Material::Conductor(m) => m.roughness(),
            Material::Dielectric(m) => m.roughness(),
        }
    }

    /// Whether the material has delta lobes only.
    #[inline]
    pub fn is_delta(&self) -> bool {
        self.roughness() == 0.0
    }

    /// Relative index of refraction, transmitted over incident side, for light seen from `wo`; 1 where nothing is transmitted.
    #[inline]
    pub fn relative_ior(&self, wo: Vec3) -> f32 {
        match self {
            Material::Dielectric(m) => m.relative_ior(wo),
            _ => 1.0,
        }
    }

    /// Reflectance for the albedo feature [1].
    pub fn albedo(&self) -> Spectrum {
        match self {
            Material::Diffuse(m) => m.reflectance,
            Material::Conductor(m) => m.albedo(),
            Material::Dielectric(_) => Spectrum::WHITE,
        }
    }
}

#[cfg(test)]
mod tests;

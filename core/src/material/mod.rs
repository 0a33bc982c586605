//! How surfaces scatter light: a [`Material`] is what a shape bears, a [`Bsdf`] what it amounts to at one point.
//!
//! Directions are unit vectors of the local shading frame (z the shading normal of the front side), both pointing away from
//! the surface: `wo` to where the path came from (the camera's side), `wi` to where it goes on (the light's side).

mod albedo;
mod bounced_glass;
mod bsdf;
mod composite;
mod conductor;
mod dielectric;
mod diffuse;
mod fresnel;
mod lobe;
mod microfacet;
mod phong;
mod plastic;
mod principled;
mod relief;
mod rough_diffuse;
mod textured;
mod thin_dielectric;
mod ward;

pub use bounced_glass::{BouncedGlass, BouncedGlassTable};
pub use bsdf::{Bsdf, Evaluation, Scatter};
pub use composite::Composite;
pub use conductor::{Bounced, Conductor};
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use fresnel::diffuse_conductor;
pub use microfacet::{Distribution, Microfacets};
pub use phong::Phong;
pub use plastic::{Coat, CoatTable, Plastic};
pub use principled::{Principled, PrincipledParameters};
pub use relief::{Relief, Surface};
pub use rough_diffuse::RoughDiffuse;
pub use textured::{CoatInput, GlassBounces, PrincipledInputs, RoughInput, Textured};
pub use thin_dielectric::ThinDielectric;
pub use ward::Ward;

use crate::math::Vec3;
use crate::spectrum::Spectrum;
use crate::texture::TexturePoint;

/// A surface's material.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// The same everywhere: nothing is looked up.
    Plain(Bsdf),
    /// With inputs from textures.
    Textured(Textured),
    /// Made of others.
    Composite(Box<Composite>),
}

impl From<Composite> for Material {
    fn from(composite: Composite) -> Material {
        Material::Composite(Box::new(composite))
    }
}

impl From<Bsdf> for Material {
    fn from(bsdf: Bsdf) -> Material {
        Material::Plain(bsdf)
    }
}

impl Material {
    /// Value and density of a pair of directions; nothing for delta lobes.
    #[inline]
    pub fn evaluate(&self, at: &TexturePoint, wo: Vec3, wi: Vec3) -> Evaluation {
        match self {
            Material::Plain(bsdf) => bsdf.evaluate(wo, wi),
            Material::Textured(textured) => textured.at(at).evaluate(wo, wi),
            Material::Composite(composite) => composite.evaluate(at, wo, wi),
        }
    }

    /// Value and probability of the delta lobe that reflects or transmits; nothing where there is none.
    #[inline]
    pub fn evaluate_delta(&self, at: &TexturePoint, wo: Vec3, transmits: bool) -> Evaluation {
        match self {
            Material::Plain(bsdf) => bsdf.evaluate_delta(wo, transmits),
            Material::Textured(textured) => textured.at(at).evaluate_delta(wo, transmits),
            Material::Composite(composite) => composite.evaluate_delta(at, wo, transmits),
        }
    }

    /// Probability with which sampling picks a delta lobe.
    #[inline]
    pub fn delta_probability(&self, at: &TexturePoint, wo: Vec3) -> f32 {
        match self {
            Material::Plain(bsdf) => bsdf.delta_probability(wo),
            Material::Textured(textured) => textured.at(at).delta_probability(wo),
            Material::Composite(composite) => composite.delta_probability(at, wo),
        }
    }

    /// Samples a direction; the delta lobes own what of `choice` in [0, 1) lies below [`delta_probability`](Self::delta_probability).
    /// `None` where nothing scatters.
    #[inline]
    pub fn sample(&self, at: &TexturePoint, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        match self {
            Material::Plain(bsdf) => bsdf.sample(wo, choice, u),
            Material::Textured(textured) => textured.at(at).sample(wo, choice, u),
            Material::Composite(composite) => composite.sample(at, wo, choice, u),
        }
    }

    /// Roughness of the sharpest lobe that is no delta; 1 for diffuse; 0 where there are delta lobes only.
    #[inline]
    pub fn roughness(&self, at: &TexturePoint) -> f32 {
        match self {
            Material::Plain(bsdf) => bsdf.roughness(),
            Material::Textured(textured) => textured.at(at).roughness(),
            Material::Composite(composite) => composite.roughness(at),
        }
    }

    /// Relative index of refraction, transmitted over incident side, for light seen from `wo`; 1 where nothing is bent.
    #[inline]
    pub fn relative_ior(&self, at: &TexturePoint, wo: Vec3) -> f32 {
        match self {
            Material::Plain(bsdf) => bsdf.relative_ior(wo),
            Material::Textured(textured) => textured.at(at).relative_ior(wo),
            Material::Composite(composite) => composite.relative_ior(at, wo),
        }
    }

    /// Reflectance for the albedo feature [1].
    pub fn albedo(&self, at: &TexturePoint) -> Spectrum {
        match self {
            Material::Plain(bsdf) => bsdf.albedo(),
            Material::Textured(textured) => textured.at(at).albedo(),
            Material::Composite(composite) => composite.albedo(at),
        }
    }

    /// Whether sampling uses its number `choice`.
    #[inline]
    pub fn has_choice(&self) -> bool {
        match self {
            Material::Plain(bsdf) => bsdf.has_choice(),
            Material::Textured(_) => true,
            Material::Composite(composite) => composite.has_choice(),
        }
    }

    /// Whether a texture is looked up, so that texture coordinates and vertex colours are needed.
    #[inline]
    pub fn is_textured(&self) -> bool {
        match self {
            Material::Plain(_) => false,
            Material::Textured(_) => true,
            Material::Composite(composite) => composite.is_textured(),
        }
    }

    /// Whether directions along the surface matter, so that the shading frame must follow the texture coordinates.
    #[inline]
    pub fn needs_tangents(&self) -> bool {
        match self {
            Material::Plain(bsdf) => bsdf.is_anisotropic(),
            Material::Textured(textured) => textured.is_anisotropic(),
            Material::Composite(composite) => composite.needs_tangents(),
        }
    }

    /// How many materials there are in it that are not made of others.
    pub fn leaves(&self) -> usize {
        match self {
            Material::Plain(_) | Material::Textured(_) => 1,
            Material::Composite(composite) => composite.leaves(),
        }
    }

    /// Whether light may pass to the other side.
    pub fn transmits(&self) -> bool {
        match self {
            Material::Plain(bsdf) => bsdf.transmits(),
            Material::Textured(textured) => textured.transmits(),
            Material::Composite(composite) => composite.transmits(),
        }
    }

    /// Relative index of refraction of a delta lobe that may transmit, 1 where it lets light pass straight on; `None` where none does.
    pub fn delta_ior(&self) -> Option<f32> {
        match self {
            Material::Plain(bsdf) => bsdf.delta_ior(),
            Material::Textured(textured) => textured.delta_ior(),
            Material::Composite(composite) => composite.delta_ior(),
        }
    }

    /// Whether a relief bends the shading normal, so that [`bent`](Self::bent) must be asked for it.
    #[inline]
    pub fn bends(&self) -> bool {
        match self {
            Material::Plain(_) | Material::Textured(_) => false,
            Material::Composite(composite) => composite.bends(),
        }
    }

    /// The unit shading normal that reliefs make of the surface's own, seen from the front or from the back.
    pub fn bent(&self, at: &TexturePoint, surface: &Surface, from_front: bool) -> Vec3 {
        match self {
            Material::Plain(_) | Material::Textured(_) => surface.normal,
            Material::Composite(composite) => composite.bent(at, surface, from_front),
        }
    }
}

#[cfg(test)]
mod tests;

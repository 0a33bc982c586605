//! Materials as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::colour::Colour;
use super::metal::Metal;

/// What a surface does to light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Material {
    /// Lambert's ideal diffuse reflection.
    Diffuse(Diffuse),
    /// A metal, smooth or rough.
    Conductor(Conductor),
    /// Glass, water and their like, smooth or rough.
    Dielectric(Dielectric),
}

impl Material {
    /// GGX roughness α ≥ 0, 0 being perfectly smooth; `None` for materials that have none.
    pub fn roughness(&self) -> Option<f64> {
        match self {
            Material::Diffuse(_) => None,
            Material::Conductor(conductor) => Some(conductor.roughness),
            Material::Dielectric(dielectric) => Some(dielectric.roughness),
        }
    }
}

/// Ideal diffuse reflection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Diffuse {
    /// Fraction of light reflected, each channel in [0, 1].
    pub reflectance: Colour,
    /// Whether the back reflects too; otherwise the back is black.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub two_sided: bool,
}

/// A metal: Fresnel reflection by a complex index of refraction η + ik, named or given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Conductor {
    /// A named metal; then `eta` and `k` must be absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metal: Option<Metal>,
    /// Real part of the index of refraction relative to the outside, ≥ 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eta: Option<Colour>,
    /// Imaginary part of the index of refraction (absorption), ≥ 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub k: Option<Colour>,
    /// GGX roughness α in [0, 1]; 0 is a mirror.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub roughness: f64,
    /// Scale of the reflected light, each channel in [0, 1]; 1 is physical.
    #[serde(default = "Colour::white", skip_serializing_if = "Colour::is_white")]
    pub reflectance: Colour,
    /// Whether the back reflects too; otherwise the back is black.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub two_sided: bool,
}

impl Conductor {
    /// (η, k) per channel. `None` if neither a metal nor both numbers were given; a checked description never is.
    pub fn index_of_refraction(&self) -> Option<(Colour, Colour)> {
        match (self.metal, self.eta, self.k) {
            (Some(metal), None, None) => Some(metal.index_of_refraction()),
            (None, Some(eta), Some(k)) => Some((eta, k)),
            _ => None,
        }
    }
}

/// A transparent material: Fresnel reflection and refraction. The interior lies behind the surface, where its normal points away from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dielectric {
    /// Index of refraction inside, > 0.
    #[serde(default = "glass")]
    pub interior_ior: f64,
    /// Index of refraction outside, > 0.
    #[serde(default = "vacuum", skip_serializing_if = "is_one")]
    pub exterior_ior: f64,
    /// GGX roughness α in [0, 1]; 0 is perfectly clear.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub roughness: f64,
    /// Scale of the reflected light, each channel in [0, 1]; 1 is physical.
    #[serde(default = "Colour::white", skip_serializing_if = "Colour::is_white")]
    pub reflectance: Colour,
    /// Scale of the transmitted light, each channel in [0, 1]; 1 is physical.
    #[serde(default = "Colour::white", skip_serializing_if = "Colour::is_white")]
    pub transmittance: Colour,
}

fn yes() -> bool {
    true
}

fn is_yes(value: &bool) -> bool {
    *value
}

fn glass() -> f64 {
    1.5
}

fn vacuum() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

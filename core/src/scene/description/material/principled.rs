//! One material for most things.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::input::{ColourInput, ScalarInput};
use super::{is_yes, yes};

/// A material by parameters that artists use. It has the meaning of glTF 2.0's metallic-roughness material with its extensions
/// `KHR_materials_{ior, specular, clearcoat, sheen, anisotropy, transmission}`; roughness r gives α = r².
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Principled {
    /// Diffuse reflectance of a dielectric, reflectance at normal incidence of a metal, tint of what is transmitted; in [0, 1].
    #[serde(default = "ColourInput::white")]
    pub base_color: ColourInput,
    /// 0 is a dielectric, 1 a metal.
    #[serde(default = "ScalarInput::zero", skip_serializing_if = "ScalarInput::is_zero")]
    pub metallic: ScalarInput,
    /// Perceptual roughness r in [0, 1]; α = r².
    #[serde(default = "half")]
    pub roughness: ScalarInput,
    /// Stretch of the highlight along the first tangent (positive) or across it (negative), in [-1, 1].
    #[serde(default = "ScalarInput::zero", skip_serializing_if = "ScalarInput::is_zero")]
    pub anisotropy: ScalarInput,
    /// Index of refraction of the dielectric, ≥ 1.
    #[serde(default = "glass", skip_serializing_if = "is_glass")]
    pub ior: f64,
    /// Strength of the dielectric's reflection, in [0, 1]; 1 is physical.
    #[serde(default = "ScalarInput::one", skip_serializing_if = "ScalarInput::is_one")]
    pub specular: ScalarInput,
    /// Tint of the dielectric's reflection at normal incidence, ≥ 0.
    #[serde(default = "ColourInput::white", skip_serializing_if = "ColourInput::is_white")]
    pub specular_color: ColourInput,
    /// Strength of a clear coat of index 1.5, in [0, 1].
    #[serde(default = "ScalarInput::zero", skip_serializing_if = "ScalarInput::is_zero")]
    pub clearcoat: ScalarInput,
    /// Perceptual roughness of the coat, in [0, 1].
    #[serde(default = "ScalarInput::zero", skip_serializing_if = "ScalarInput::is_zero")]
    pub clearcoat_roughness: ScalarInput,
    /// Colour of the sheen of fabrics, in [0, 1]; black is none.
    #[serde(default = "ColourInput::black", skip_serializing_if = "ColourInput::is_black")]
    pub sheen_color: ColourInput,
    /// Perceptual roughness of the sheen, in [0, 1].
    #[serde(default = "half", skip_serializing_if = "is_half")]
    pub sheen_roughness: ScalarInput,
    /// Fraction of light that passes instead of being reflected diffusely, in [0, 1].
    #[serde(default = "ScalarInput::zero", skip_serializing_if = "ScalarInput::is_zero")]
    pub transmission: ScalarInput,
    /// Whether what is transmitted is not bent: the surface is a thin wall.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub thin: bool,
    /// Whether the back reflects too; otherwise the back is black.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub two_sided: bool,
}

impl Default for Principled {
    fn default() -> Principled {
        Principled {
            base_color: ColourInput::white(),
            metallic: ScalarInput::zero(),
            roughness: half(),
            anisotropy: ScalarInput::zero(),
            ior: glass(),
            specular: ScalarInput::one(),
            specular_color: ColourInput::white(),
            clearcoat: ScalarInput::zero(),
            clearcoat_roughness: ScalarInput::zero(),
            sheen_color: ColourInput::black(),
            sheen_roughness: half(),
            transmission: ScalarInput::zero(),
            thin: true,
            two_sided: true,
        }
    }
}

impl Principled {
    /// α of its sharpest lobe; textures count as rough.
    pub(super) fn sharpest(&self) -> f64 {
        let alpha = |input: &ScalarInput| input.constant().map_or(1.0, |r| r * r);
        if self.clearcoat.is_zero() { alpha(&self.roughness) } else { alpha(&self.roughness).min(alpha(&self.clearcoat_roughness)) }
    }
}

fn half() -> ScalarInput {
    0.5.into()
}

fn is_half(value: &ScalarInput) -> bool {
    *value == half()
}

fn glass() -> f64 {
    1.5
}

fn is_glass(value: &f64) -> bool {
    *value == glass()
}

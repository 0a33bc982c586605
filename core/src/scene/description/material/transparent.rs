//! Materials that light passes through.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::input::{ColourInput, ScalarInput};
use super::{Distribution, is_no};

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
    /// Whether the surface is a thin sheet: light that enters leaves it at the same place, in its old direction. Thin sheets are smooth.
    #[serde(default, skip_serializing_if = "is_no")]
    pub thin: bool,
    /// Roughness α in [0, 1]; 0 is perfectly clear. Along the first tangent, where `roughness_v` is given.
    #[serde(default = "ScalarInput::zero", skip_serializing_if = "ScalarInput::is_zero")]
    pub roughness: ScalarInput,
    /// Roughness α along the second tangent, where it is another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness_v: Option<ScalarInput>,
    /// The facets' distribution.
    #[serde(default, skip_serializing_if = "Distribution::is_ggx")]
    pub distribution: Distribution,
    /// Whether light that bounces between facets is kept; without it rough glass darkens.
    #[serde(default, skip_serializing_if = "is_no")]
    pub energy_conserving: bool,
    /// Scale of the reflected light, each channel in [0, 1]; 1 is physical.
    #[serde(default = "ColourInput::white", skip_serializing_if = "ColourInput::is_white")]
    pub reflectance: ColourInput,
    /// Scale of the transmitted light, each channel in [0, 1]; 1 is physical.
    #[serde(default = "ColourInput::white", skip_serializing_if = "ColourInput::is_white")]
    pub transmittance: ColourInput,
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

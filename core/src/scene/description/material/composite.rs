//! Materials made of others, which they name.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::input::{ColourInput, ScalarInput};

/// A material with holes. It may not be part of another material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mask {
    /// Name of the material between the holes.
    pub material: String,
    /// Fraction of light that meets the material, in [0, 1]; the rest passes straight on.
    pub opacity: ScalarInput,
}

/// Two materials, mixed. Each scatters its share of the light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Blend {
    /// Name of the material where `weight` is 0.
    pub first: String,
    /// Name of the material where `weight` is 1.
    pub second: String,
    /// Share of the second, in [0, 1].
    pub weight: ScalarInput,
}

/// One material on each side. The back's material sees the surface turned round, as if it were the front.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TwoSided {
    /// Name of the material on the front.
    pub front: String,
    /// Name of the material on the back.
    pub back: String,
}

/// A material whose shading normal is bent as if the surface had bumps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BumpMap {
    /// Name of the material.
    pub material: String,
    /// Height of the bumps, in units of the surface's derivatives ∂p/∂u and ∂p/∂v: a texture.
    pub height: ScalarInput,
    /// Factor on the height.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub scale: f64,
}

/// A material whose shading normal comes from a texture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NormalMap {
    /// Name of the material.
    pub material: String,
    /// Normals in the tangent frame, each channel n as (n + 1) / 2: a texture of linear encoding.
    pub normals: ColourInput,
    /// Factor on the normals' two tangential components.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

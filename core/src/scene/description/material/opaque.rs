//! Materials that only reflect.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::colour::Colour;
use super::super::input::{ColourInput, ScalarInput};
use super::super::metal::Metal;
use super::{Distribution, is_no, is_yes, yes};

/// Ideal diffuse reflection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Diffuse {
    /// Fraction of light reflected, each channel in [0, 1].
    pub reflectance: ColourInput,
    /// Whether the back reflects too; otherwise the back is black.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub two_sided: bool,
}

/// A matt surface of small facets, each ideally diffuse.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoughDiffuse {
    /// Fraction of light that each facet reflects, each channel in [0, 1].
    pub reflectance: ColourInput,
    /// Standard deviation of the facets' slope angle [rad], in [0, 1]; 0 is ideally diffuse.
    pub roughness: ScalarInput,
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
    /// Roughness α in [0, 1]; 0 is a mirror. Along the first tangent, where `roughness_v` is given.
    #[serde(default = "ScalarInput::zero", skip_serializing_if = "ScalarInput::is_zero")]
    pub roughness: ScalarInput,
    /// Roughness α along the second tangent, where it is another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness_v: Option<ScalarInput>,
    /// The facets' distribution.
    #[serde(default, skip_serializing_if = "Distribution::is_ggx")]
    pub distribution: Distribution,
    /// Whether light that bounces between facets is kept; without it rough metals darken.
    #[serde(default, skip_serializing_if = "is_no")]
    pub energy_conserving: bool,
    /// Scale of the reflected light, each channel in [0, 1]; 1 is physical.
    #[serde(default = "ColourInput::white", skip_serializing_if = "ColourInput::is_white")]
    pub reflectance: ColourInput,
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

/// A diffuse base under a dielectric coat.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plastic {
    /// Fraction of light that the base reflects, each channel in [0, 1].
    #[serde(default = "half")]
    pub diffuse: ColourInput,
    /// Scale of what the coat reflects, each channel in [0, 1]; 1 is physical.
    #[serde(default = "ColourInput::white", skip_serializing_if = "ColourInput::is_white")]
    pub specular: ColourInput,
    /// Index of refraction of the coat, > 0.
    #[serde(default = "polypropylene")]
    pub interior_ior: f64,
    /// Index of refraction outside, > 0.
    #[serde(default = "vacuum", skip_serializing_if = "is_one")]
    pub exterior_ior: f64,
    /// Whether light that the coat throws back onto the base takes its colour again.
    #[serde(default, skip_serializing_if = "is_no")]
    pub nonlinear: bool,
    /// Roughness α of the coat in [0, 1]; 0 is perfectly smooth.
    #[serde(default = "ScalarInput::zero", skip_serializing_if = "ScalarInput::is_zero")]
    pub roughness: ScalarInput,
    /// The facets' distribution.
    #[serde(default, skip_serializing_if = "Distribution::is_ggx")]
    pub distribution: Distribution,
    /// Whether the back reflects too; otherwise the back is black.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub two_sided: bool,
}

/// Phong's glossy lobe, normalised to conserve energy, over a diffuse base.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Phong {
    /// Fraction of light reflected diffusely, each channel in [0, 1]; together with `specular` at most 1.
    #[serde(default = "half")]
    pub diffuse: ColourInput,
    /// Fraction of light reflected about the mirror direction, each channel in [0, 1].
    #[serde(default = "fifth")]
    pub specular: ColourInput,
    /// The power of the cosine, ≥ 0: the larger, the sharper.
    #[serde(default = "thirty")]
    pub exponent: ScalarInput,
    /// Whether the back reflects too; otherwise the back is black.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub two_sided: bool,
}

/// Ward's anisotropic glossy lobe over a diffuse base, in the balanced form that conserves energy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ward {
    /// Fraction of light reflected diffusely, each channel in [0, 1].
    #[serde(default = "half")]
    pub diffuse: ColourInput,
    /// Fraction of light reflected glossily, each channel in [0, 1].
    #[serde(default = "fifth")]
    pub specular: ColourInput,
    /// Roughness α along the first tangent, in (0, 1].
    #[serde(default = "tenth")]
    pub roughness: ScalarInput,
    /// Roughness α along the second tangent, where it is another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness_v: Option<ScalarInput>,
    /// Whether the back reflects too; otherwise the back is black.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub two_sided: bool,
}

fn half() -> ColourInput {
    ColourInput::grey(0.5)
}

fn fifth() -> ColourInput {
    ColourInput::grey(0.2)
}

fn tenth() -> ScalarInput {
    0.1.into()
}

fn thirty() -> ScalarInput {
    30.0.into()
}

fn polypropylene() -> f64 {
    1.49
}

fn vacuum() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

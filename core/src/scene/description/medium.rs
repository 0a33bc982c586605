//! Participating media as written: what fills the space between surfaces.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::colour::Colour;

/// What fills space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Medium {
    /// The same everywhere.
    Homogeneous(Homogeneous),
}

/// A medium that is the same everywhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Homogeneous {
    /// Extinction σₜ = σₐ + σₛ [m⁻¹], each channel ≥ 0.
    pub extinction: Colour,
    /// Single-scattering albedo σₛ / σₜ, each channel in [0, 1].
    pub albedo: Colour,
    /// How it scatters.
    #[serde(default, skip_serializing_if = "Phase::is_isotropic")]
    pub phase: Phase,
}

/// A phase function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// The same in all directions.
    #[default]
    Isotropic,
    /// Henyey and Greenstein's.
    HenyeyGreenstein(HenyeyGreenstein),
}

impl Phase {
    fn is_isotropic(&self) -> bool {
        *self == Phase::Isotropic
    }

    /// Mean cosine of the angle of deflection.
    pub fn mean_cosine(&self) -> f64 {
        match self {
            Phase::Isotropic => 0.0,
            Phase::HenyeyGreenstein(phase) => phase.g,
        }
    }
}

/// Henyey and Greenstein's phase function.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HenyeyGreenstein {
    /// Mean cosine of the angle of deflection, in (-1, 1): positive scatters forward.
    pub g: f64,
}

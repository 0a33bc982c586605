//! The effects that a scene may call for, and the set of those that one does.

use std::collections::BTreeMap;
use std::fmt;

/// Something that light does in a scene and that a technique must be able to carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Effect {
    /// Light from surfaces.
    AreaLights,
    /// Light from infinitely far away.
    EnvironmentLight,
    /// Perfect mirrors and perfectly clear boundaries: paths through them cannot be joined, only followed.
    SpecularChains,
    /// Rough metal and rough glass: lobes between a mirror and a diffuse surface.
    NearSpecular,
    /// Light that passes through surfaces and changes direction.
    Refraction,
    /// Light that a mirror or a glass, clear or nearly so, may gather on a diffuse surface.
    Caustics,
    /// A lens: things out of focus are blurred.
    DepthOfField,
    /// Geometry that stands in several places but is held once.
    Instances,
}

impl Effect {
    /// Every effect.
    pub const ALL: [Effect; 8] = [
        Effect::AreaLights,
        Effect::EnvironmentLight,
        Effect::SpecularChains,
        Effect::NearSpecular,
        Effect::Refraction,
        Effect::Caustics,
        Effect::DepthOfField,
        Effect::Instances,
    ];

    /// Its name for machines.
    pub fn name(self) -> &'static str {
        match self {
            Effect::AreaLights => "area_lights",
            Effect::EnvironmentLight => "environment_light",
            Effect::SpecularChains => "specular_chains",
            Effect::NearSpecular => "near_specular",
            Effect::Refraction => "refraction",
            Effect::Caustics => "caustics",
            Effect::DepthOfField => "depth_of_field",
            Effect::Instances => "instances",
        }
    }

    /// Its name for people.
    pub fn words(self) -> &'static str {
        match self {
            Effect::AreaLights => "area lights",
            Effect::EnvironmentLight => "environment light",
            Effect::SpecularChains => "specular chains",
            Effect::NearSpecular => "near-specular reflection",
            Effect::Refraction => "refraction",
            Effect::Caustics => "caustics",
            Effect::DepthOfField => "depth of field",
            Effect::Instances => "instances",
        }
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words())
    }
}

/// A set of effects, each with what in the scene calls for it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Effects {
    found: BTreeMap<Effect, Vec<String>>,
}

impl Effects {
    /// Adds an effect and one thing that calls for it; a thing is kept once.
    pub fn add(&mut self, effect: Effect, because: impl Into<String>) {
        let because = because.into();
        let reasons = self.found.entry(effect).or_default();
        if !reasons.contains(&because) {
            reasons.push(because);
        }
    }

    /// Whether the scene calls for it.
    pub fn has(&self, effect: Effect) -> bool {
        self.found.contains_key(&effect)
    }

    /// What calls for an effect, in the order of the description; empty where nothing does.
    pub fn because(&self, effect: Effect) -> &[String] {
        self.found.get(&effect).map(Vec::as_slice).unwrap_or_default()
    }

    /// The effects in their order, each with what calls for it.
    pub fn iter(&self) -> impl Iterator<Item = (Effect, &[String])> {
        self.found.iter().map(|(effect, because)| (*effect, because.as_slice()))
    }

    /// Whether the scene calls for nothing at all.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }
}

//! The effects that a scene may call for, and the set of those that one does.

use std::collections::BTreeMap;
use std::fmt;

macro_rules! effects {
    ($($(#[$doc:meta])* $variant:ident, $name:literal, $words:literal;)*) => {
        /// Something that light does in a scene and that a technique must be able to carry.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Effect {
            $($(#[$doc])* $variant,)*
        }

        impl Effect {
            /// Every effect.
            pub const ALL: &'static [Effect] = &[$(Effect::$variant,)*];

            /// Its name for machines.
            pub fn name(self) -> &'static str {
                match self { $(Effect::$variant => $name,)* }
            }

            /// Its name for people.
            pub fn words(self) -> &'static str {
                match self { $(Effect::$variant => $words,)* }
            }
        }
    };
}

effects! {
    /// Light from surfaces.
    AreaLights, "area_lights", "area lights";
    /// Light from points, cones and single directions, which no ray finds by chance.
    ConcentratedLights, "concentrated_lights", "lights without extent";
    /// Light from infinitely far away.
    EnvironmentLight, "environment_light", "environment light";
    /// So many lights that choosing one by its power alone would waste most samples.
    ManyLights, "many_lights", "many lights";
    /// Perfect mirrors and perfectly clear boundaries: paths through them cannot be joined, only followed.
    SpecularChains, "specular_chains", "specular chains";
    /// Rough metal, rough glass and glossy coats: lobes between a mirror and a diffuse surface.
    NearSpecular, "near_specular", "near-specular reflection";
    /// Light that passes through surfaces and changes direction.
    Refraction, "refraction", "refraction";
    /// Light that a mirror or a glass, clear or nearly so, may gather on a diffuse surface.
    Caustics, "caustics", "caustics";
    /// Caustics that the camera may see through a mirror or a glass in turn: specular, diffuse, specular.
    SeenCaustics, "seen_caustics", "caustics seen through specular surfaces";
    /// Caustics of lights without extent, which paths from the camera never find.
    LostCaustics, "lost_caustics", "caustics of lights without extent";
    /// Media that absorb or scatter.
    Media, "media", "participating media";
    /// Surfaces that let part of the light pass as if they were not there.
    Holes, "holes", "surfaces with holes";
    /// Materials or lights that vary over a surface.
    Textures, "textures", "textures";
    /// Detail that is likely finer than a pixel: it makes gradients as noisy as the image.
    FineDetail, "fine_detail", "detail finer than a pixel";
    /// A lens: things out of focus are blurred.
    DepthOfField, "depth_of_field", "depth of field";
    /// Geometry that stands in several places but is held once.
    Instances, "instances", "instances";
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

    /// Adds the effects of another set that are not in this one.
    pub(super) fn join(&mut self, other: Effects) {
        for (effect, reasons) in other.found {
            self.found.entry(effect).or_insert(reasons);
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

    /// What calls for an effect, in words: the first few things, and how many more there are.
    pub fn told(&self, effect: Effect) -> String {
        const TOLD: usize = 4;
        let because = self.because(effect);
        let more = because.len().saturating_sub(TOLD);
        let mut words = because[..because.len() - more].join(", ");
        if more > 0 {
            words += &format!(", and {more} more");
        }
        words
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

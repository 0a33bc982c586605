//! What a plan leaves out, and what that saves.

use crate::effects::{Effect, Effects};

/// Code that runs only for certain effects, each with what a scene without them is spared.
const SWITCHES: &[(&[Effect], &str)] = &[
    (&[Effect::Media, Effect::Holes], "off: media and holes, so every leg of a path is a single ray and is worth 1"),
    (&[Effect::Textures], "off: textures, so materials are numbers and nothing is looked up"),
    (&[Effect::FineDetail], "off: bumps and normal maps, so shading frames follow from the geometry alone"),
    (&[Effect::EnvironmentLight], "off: environment, so rays that leave the scene end there"),
    (&[Effect::DepthOfField], "off: lens, so the camera is a point"),
    (&[Effect::Instances], "off: instances, so there is one tree over all shapes"),
    (&[Effect::ManyLights], "off: tree of lights, so a light is chosen by its power in one step"),
];

/// A sentence for each switch that the scene leaves off.
pub(super) fn off(effects: &Effects) -> impl Iterator<Item = String> {
    SWITCHES.iter().filter(|(needs, _)| !needs.iter().any(|effect| effects.has(*effect))).map(|(_, words)| (*words).to_string())
}

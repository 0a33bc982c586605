//! What the lights of a scene call for.

use super::set::{Effect, Effects};
use crate::light::TREE_FROM;
use crate::scene::SceneDescription;
use crate::scene::description::{Colour, Environment, Light, Shape};

/// Light from a surface.
pub(super) fn shape(shape: &Shape, path: &str, effects: &mut Effects) {
    let Some(emission) = shape.emission.as_ref().filter(|emission| !emission.radiance.is_black()) else { return };
    effects.add(Effect::AreaLights, path);
    if let Some(texture) = emission.radiance.texture() {
        effects.add(Effect::Textures, format!("textures.{texture} as the light of {path}"));
    }
}

/// Points, spots and parallel light.
pub(super) fn concentrated(scene: &SceneDescription, effects: &mut Effects) {
    for (index, light) in scene.lights.iter().enumerate() {
        let (kind, name, emits) = match light {
            Light::Point(light) => ("point", &light.name, light.intensity),
            Light::Spot(light) => ("spot", &light.name, light.intensity),
            Light::Directional(light) => ("directional", &light.name, light.irradiance),
        };
        if !emits.is_black() {
            let name = if name.is_empty() { String::new() } else { format!(" “{name}”") };
            effects.add(Effect::ConcentratedLights, format!("lights[{index}]{name} ({kind})"));
        }
    }
}

/// Light from infinitely far away.
pub(super) fn environment(scene: &SceneDescription, effects: &mut Effects) {
    let Some(environment) = scene.environment.as_ref().filter(|environment| !environment.is_black()) else { return };
    let what = match environment {
        Environment { image: Some(image), .. } => format!("environment.image is {}", image.file),
        Environment { sky: Some(sky), .. } => format!("environment.sky with the sun at {:?}", sky.sun_direction),
        Environment { radiance, .. } => format!("environment.radiance is {:?}", radiance.unwrap_or(Colour::WHITE).0),
    };
    effects.add(Effect::EnvironmentLight, what);
}

/// Counts the lights.
pub(super) fn many(scene: &SceneDescription, effects: &mut Effects) {
    let surfaces = scene.shapes.iter().filter(|shape| shape.emission.is_some()).count();
    let count = surfaces + scene.lights.len();
    if count >= TREE_FROM {
        effects.add(Effect::ManyLights, format!("{count} lights"));
    }
}

//! One walk over a description, which finds the effects that it calls for and why.

use std::collections::{BTreeMap, BTreeSet};

use super::set::{Effect, Effects};
use crate::scene::SceneDescription;
use crate::scene::description::{Camera, Colour, Environment, Geometry, Material, Shape};

/// Roughness up to which a metal or a glass still gathers light into something that people call a caustic.
const CAUSTIC_ROUGHNESS: f64 = 0.15;

/// Finds what a description calls for. Materials that nothing visible bears, and groups that nothing places, call for nothing.
///
/// A description that was not checked is walked all the same: names that nothing bears are passed over.
pub fn analyse(scene: &SceneDescription) -> Effects {
    let mut effects = Effects::default();
    if let Camera::Perspective(camera) = &scene.camera
        && camera.lens_radius > 0.0
    {
        effects.add(Effect::DepthOfField, format!("camera.perspective.lens_radius is {} m", camera.lens_radius));
    }
    let mut bearers = BTreeMap::new();
    let mut placed = BTreeSet::new();
    for (index, shape) in scene.shapes.iter().enumerate() {
        let path = called(&format!("shapes[{index}]"), shape);
        if shape.emission.as_ref().is_some_and(|emission| !emission.radiance.is_black()) {
            effects.add(Effect::AreaLights, &path);
        }
        if let Geometry::Instance(instance) = &shape.geometry {
            effects.add(Effect::Instances, format!("{path} places `{}`", instance.of));
        }
        visit(scene, shape, &path, &mut bearers, &mut placed);
    }
    if let Some(environment) = scene.environment.as_ref().filter(|environment| !environment.is_black()) {
        let what = match environment {
            Environment { image: Some(image), .. } => format!("environment.image is {}", image.file),
            Environment { sky: Some(sky), .. } => format!("environment.sky with the sun at {:?}", sky.sun_direction),
            Environment { radiance, .. } => format!("environment.radiance is {:?}", radiance.unwrap_or(Colour::WHITE).0),
        };
        effects.add(Effect::EnvironmentLight, what);
    }
    for (name, bearer) in &bearers {
        if let Some(material) = scene.materials.get(*name) {
            surface(name, material, bearer, &mut effects);
        }
    }
    caustics(scene, &bearers, &mut effects);
    effects
}

/// Notes the first shape that bears each material, through all groups that are placed.
fn visit<'a>(
    scene: &'a SceneDescription,
    shape: &'a Shape,
    path: &str,
    bearers: &mut BTreeMap<&'a str, String>,
    placed: &mut BTreeSet<&'a str>,
) {
    if let Some(material) = shape.material.as_deref() {
        bearers.entry(material).or_insert_with(|| path.to_string());
    }
    let Geometry::Instance(instance) = &shape.geometry else { return };
    // Each group once: this also ends the walk of a circle.
    if !placed.insert(&instance.of) {
        return;
    }
    for (index, inner) in scene.groups.get(&instance.of).into_iter().flatten().enumerate() {
        visit(scene, inner, &called(&format!("groups.{}[{index}]", instance.of), inner), bearers, placed);
    }
}

fn surface(name: &str, material: &Material, bearer: &str, effects: &mut Effects) {
    let because = |what: &str| format!("materials.{name} ({what}) on {bearer}");
    match material.roughness() {
        Some(0.0) => effects.add(Effect::SpecularChains, because("smooth")),
        Some(roughness) => effects.add(Effect::NearSpecular, because(&format!("roughness {roughness}"))),
        None => {}
    }
    if let Material::Dielectric(dielectric) = material {
        effects.add(Effect::Refraction, because(&format!("{} inside, {} outside", dielectric.interior_ior, dielectric.exterior_ior)));
    }
}

/// A caustic needs a light, something that gathers it, and something diffuse that shows it.
fn caustics(scene: &SceneDescription, bearers: &BTreeMap<&str, String>, effects: &mut Effects) {
    let lit = effects.has(Effect::AreaLights) || effects.has(Effect::EnvironmentLight);
    let material = |name: &&str| scene.materials.get(*name);
    let shown = bearers.keys().any(|name| matches!(material(name), Some(Material::Diffuse(diffuse)) if !diffuse.reflectance.is_black()));
    if !lit || !shown {
        return;
    }
    for (name, bearer) in bearers {
        if material(name).and_then(Material::roughness).is_some_and(|roughness| roughness <= CAUSTIC_ROUGHNESS) {
            effects.add(Effect::Caustics, format!("materials.{name} on {bearer}"));
        }
    }
}

/// The path, and the name that people gave the shape.
fn called(path: &str, shape: &Shape) -> String {
    if shape.name.is_empty() { path.to_string() } else { format!("{path} “{}”", shape.name) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: &str = r#""version": 1, "camera": { "perspective": { "fov": 40 LENS } }"#;
    const MATERIALS: &str = r#""materials": {
        "white": { "diffuse": { "reflectance": 0.8 } },
        "mirror": { "conductor": { "metal": "Ag" } },
        "gold": { "conductor": { "metal": "Au", "roughness": 0.3 } },
        "glass": { "dielectric": {} },
        "frosted": { "dielectric": { "roughness": 0.1 } } }"#;

    fn of(rest: &str, lens: &str) -> Effects {
        let text = format!("{{ {}, {MATERIALS}, {rest} }}", CAMERA.replace("LENS", lens));
        analyse(&SceneDescription::from_json(&text, "test.json").unwrap())
    }

    fn names(effects: &Effects) -> Vec<&str> {
        effects.iter().map(|(effect, _)| effect.name()).collect()
    }

    fn ball(material: &str) -> String {
        format!(r#"{{ "geometry": {{ "sphere": {{ "radius": 1 }} }}, "material": "{material}" }}"#)
    }

    const LIGHT: &str = r#"{ "name": "lamp", "geometry": "rectangle", "material": "white", "emission": { "radiance": 5 } }"#;

    #[test]
    fn a_scene_calls_only_for_what_it_shows() {
        assert!(of(r#""shapes": []"#, "").is_empty());
        assert_eq!(names(&of(&format!(r#""shapes": [{LIGHT}]"#), "")), ["area_lights"]);
        let unplaced = format!(r#""groups": {{ "a": [{}] }}, "shapes": []"#, ball("glass"));
        assert!(of(&unplaced, "").is_empty(), "a group that nothing places calls for nothing");
    }

    #[test]
    fn each_effect_names_what_calls_for_it() {
        let effects = of(&format!(r#""shapes": [{LIGHT}, {}]"#, ball("glass")), r#", "lens_radius": 0.1"#);
        assert_eq!(names(&effects), ["area_lights", "specular_chains", "refraction", "caustics", "depth_of_field"]);
        assert_eq!(effects.because(Effect::AreaLights), ["shapes[0] “lamp”"]);
        assert_eq!(effects.because(Effect::Refraction), ["materials.glass (1.5 inside, 1 outside) on shapes[1]"]);
        assert_eq!(effects.because(Effect::Caustics), ["materials.glass on shapes[1]"]);
        assert_eq!(effects.because(Effect::DepthOfField), ["camera.perspective.lens_radius is 0.1 m"]);
        assert!(effects.because(Effect::Instances).is_empty());
    }

    #[test]
    fn rough_metal_is_near_specular_and_makes_no_caustic() {
        let effects = of(&format!(r#""shapes": [{LIGHT}, {}]"#, ball("gold")), "");
        assert_eq!(names(&effects), ["area_lights", "near_specular"]);
        let effects = of(&format!(r#""shapes": [{LIGHT}, {}]"#, ball("frosted")), "");
        assert_eq!(names(&effects), ["area_lights", "near_specular", "refraction", "caustics"]);
    }

    #[test]
    fn a_mirror_without_light_or_screen_makes_no_caustic() {
        assert_eq!(names(&of(&format!(r#""shapes": [{}]"#, ball("mirror")), "")), ["specular_chains"]);
        let effects = of(&format!(r#""environment": {{ "radiance": 1 }}, "shapes": [{}]"#, ball("mirror")), "");
        assert_eq!(names(&effects), ["environment_light", "specular_chains"]);
    }

    #[test]
    fn instances_are_looked_into() {
        let text = format!(
            r#""groups": {{ "a": [{}], "b": [{{ "geometry": {{ "instance": {{ "of": "a" }} }} }}] }},
               "shapes": [{{ "geometry": {{ "instance": {{ "of": "b" }} }} }}]"#,
            ball("mirror")
        );
        let effects = of(&text, "");
        assert_eq!(names(&effects), ["specular_chains", "instances"]);
        assert_eq!(effects.because(Effect::SpecularChains), ["materials.mirror (smooth) on groups.a[0]"]);
        assert_eq!(effects.because(Effect::Instances), ["shapes[0] places `b`"]);
    }
}

//! One walk over a description, which finds the effects that it calls for and why.

use std::collections::{BTreeMap, BTreeSet};

use super::lights;
use super::set::{Effect, Effects};
use super::surfaces;
use crate::scene::SceneDescription;
use crate::scene::description::{Camera, Geometry, Shape};

/// Finds what a description calls for. Materials that nothing visible bears, and groups that nothing places, call for nothing.
///
/// A description that was not checked is walked all the same: names that nothing bears are passed over.
///
/// A scene that moves calls for what it calls for at any of its keys.
pub fn analyse(scene: &SceneDescription) -> Effects {
    let mut effects = instant(scene);
    for seconds in keys(scene) {
        if let Ok(still) = scene.at(seconds) {
            effects.join(instant(&still));
        }
    }
    effects
}

/// Most instants that are looked at.
const INSTANTS: usize = 64;

/// The times of the keys that may bring effects or take them away; of very many some. What only moves calls for the same at all times.
fn keys(scene: &SceneDescription) -> Vec<f64> {
    let moves =
        |target: &str| [".to_world", ".geometry"].iter().any(|part| target.contains(part)) || target.starts_with("animation.nodes.");
    let tracks = scene.animation.iter().flat_map(|animation| &animation.tracks).filter(|track| !moves(&track.target));
    let mut times: Vec<f64> = tracks.flat_map(|track| track.times.iter().copied()).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let step = times.len().div_ceil(INSTANTS).max(1);
    times.into_iter().step_by(step).collect()
}

/// What one instant calls for.
fn instant(scene: &SceneDescription) -> Effects {
    let mut effects = Effects::default();
    if let Camera::Perspective(camera) = &scene.camera
        && camera.lens_radius > 0.0
    {
        effects.add(Effect::DepthOfField, format!("camera.perspective.lens_radius is {} m", camera.lens_radius));
    }
    if let Some(medium) = &scene.medium {
        effects.add(Effect::Media, format!("media.{medium} around the camera"));
    }
    let mut bearers = BTreeMap::new();
    let mut placed = BTreeSet::new();
    for (index, shape) in scene.shapes.iter().enumerate() {
        let path = called(&format!("shapes[{index}]"), shape);
        if let Geometry::Instance(instance) = &shape.geometry {
            effects.add(Effect::Instances, format!("{path} places `{}`", instance.of));
        }
        lights::shape(shape, &path, &mut effects);
        visit(scene, shape, &path, &mut bearers, &mut placed, &mut effects);
    }
    lights::concentrated(scene, &mut effects);
    lights::environment(scene, &mut effects);
    lights::many(scene, &mut effects);
    surfaces::borne(scene, &bearers, &mut effects);
    effects
}

/// Notes the first shape that bears each material, through all groups that are placed.
fn visit<'a>(
    scene: &'a SceneDescription,
    shape: &'a Shape,
    path: &str,
    bearers: &mut BTreeMap<&'a str, String>,
    placed: &mut BTreeSet<&'a str>,
    effects: &mut Effects,
) {
    for (side, medium) in [("inside", &shape.interior), ("outside", &shape.exterior)] {
        if let Some(medium) = medium {
            effects.add(Effect::Media, format!("media.{medium} {side} {path}"));
        }
    }
    if let Some(material) = shape.material.as_deref() {
        bearers.entry(material).or_insert_with(|| path.to_string());
    }
    let Geometry::Instance(instance) = &shape.geometry else { return };
    // Each group once: this also ends the walk of a circle.
    if !placed.insert(&instance.of) {
        return;
    }
    for (index, inner) in scene.groups.get(&instance.of).into_iter().flatten().enumerate() {
        visit(scene, inner, &called(&format!("groups.{}[{index}]", instance.of), inner), bearers, placed, effects);
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
    fn a_scene_that_moves_calls_for_what_it_shows_at_any_time() {
        let track = |target: &str, values: &str| format!(r#"{{ "target": "{target}", "times": [1, 2], "values": {values} }}"#);
        let dark = LIGHT.replace('5', "0");
        let tracks = [track("shapes[0].emission.radiance", "[0, 3]"), track("camera.perspective.lens_radius", "[0.1, 0.2]")].join(", ");
        let effects = of(&format!(r#""shapes": [{dark}], "animation": {{ "tracks": [{tracks}] }}"#), "");
        assert_eq!(names(&effects), ["area_lights", "depth_of_field"]);
        assert_eq!(effects.because(Effect::DepthOfField), ["camera.perspective.lens_radius is 0.1 m"]);
        assert!(of(&format!(r#""shapes": [{dark}]"#), "").is_empty());
    }

    #[test]
    fn each_effect_names_what_calls_for_it() {
        let effects = of(&format!(r#""shapes": [{LIGHT}, {}]"#, ball("glass")), r#", "lens_radius": 0.1"#);
        let expected = ["area_lights", "specular_chains", "refraction", "caustics", "seen_caustics", "depth_of_field"];
        assert_eq!(names(&effects), expected);
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

    #[test]
    fn media_holes_and_textures_are_told_by_who_bears_them() {
        let rest = r#""media": { "fog": { "homogeneous": { "extinction": 0.1, "albedo": 0.9 } } }, "medium": "fog",
            "shapes": [{ "geometry": "cube", "material": "leaf", "interior": "fog" }, { "geometry": "cube", "material": "tiles" }]"#;
        let more = r#""materials": { "leaf": { "mask": { "material": "white", "opacity": 0.5 } },
            "tiles": { "plastic": { "diffuse": { "texture": "board" } } },"#;
        let textures = r#""textures": { "board": { "checkerboard": { "color0": 0, "color1": 1, "uv": { "scale": [40, 2] } } } },"#;
        let text = format!("{{ {}, {textures} {}, {rest} }}", CAMERA.replace("LENS", ""), MATERIALS.replacen(r#""materials": {"#, more, 1));
        let effects = analyse(&SceneDescription::from_json(&text, "test.json").unwrap());
        assert_eq!(names(&effects), ["specular_chains", "media", "holes", "textures", "fine_detail"]);
        assert_eq!(effects.because(Effect::Media), ["media.fog around the camera", "media.fog inside shapes[0]"]);
        assert_eq!(effects.because(Effect::Holes), ["materials.leaf (opacity 0.5) on shapes[0]"]);
        assert_eq!(effects.because(Effect::Textures), ["textures.board in materials.tiles on shapes[1]"]);
        assert_eq!(effects.because(Effect::FineDetail), ["textures.board (40 times over) in materials.tiles on shapes[1]"]);
    }

    #[test]
    fn caustics_of_a_point_light_are_lost() {
        let point = r#""lights": [{ "point": { "name": "bulb", "position": [0, 3, 0], "intensity": 9 } }],"#;
        let floor = r#"{ "geometry": "rectangle", "material": "white" }"#;
        let effects = of(&format!(r#"{point} "shapes": [{floor}, {}]"#, ball("glass")), "");
        assert_eq!(names(&effects), ["concentrated_lights", "specular_chains", "refraction", "lost_caustics"]);
        assert_eq!(effects.because(Effect::LostCaustics), ["materials.glass on shapes[1] under lights[0] “bulb” (point)"]);
        let effects = of(&format!(r#"{point} "shapes": [{floor}, {}]"#, ball("frosted")), "");
        assert!(!effects.has(Effect::LostCaustics), "a rough lobe is joined to the light");
    }

    #[test]
    fn many_lights_are_counted() {
        let lamps = vec![LIGHT; 40].join(", ");
        assert_eq!(of(&format!(r#""shapes": [{lamps}]"#), "").because(Effect::ManyLights), ["40 lights"]);
    }
}

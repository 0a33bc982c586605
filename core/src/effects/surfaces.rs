//! What the materials of a scene call for, each told by the first shape that bears it.

use std::collections::{BTreeMap, BTreeSet};

use super::set::{Effect, Effects};
use crate::scene::SceneDescription;
use crate::scene::description::{Material, ScalarInput, Texture};

/// Roughness up to which a surface still gathers light into something that people call a caustic.
const CAUSTIC_ROUGHNESS: f64 = 0.15;
/// Repeats of a texture over a surface from which its detail is likely finer than a pixel.
const FINE: f64 = 16.0;

/// All materials that something bears, and what they do together.
pub(super) fn borne(scene: &SceneDescription, bearers: &BTreeMap<&str, String>, effects: &mut Effects) {
    let mut parts = BTreeMap::new();
    for (name, bearer) in bearers {
        collect(scene, name, bearer, &mut parts);
    }
    for (name, bearer) in &parts {
        if let Some(material) = scene.materials.get(*name) {
            alone(scene, name, material, bearer, effects);
        }
    }
    together(scene, &parts, effects);
}

/// Notes a material and all that it is made of. Each once: this also ends the walk of a circle.
fn collect<'a>(scene: &'a SceneDescription, name: &'a str, bearer: &'a str, parts: &mut BTreeMap<&'a str, &'a str>) {
    if parts.insert(name, bearer).is_some() {
        return;
    }
    for part in scene.materials.get(name).map(Material::parts).unwrap_or_default() {
        if !parts.contains_key(part) {
            collect(scene, part, bearer, parts);
        }
    }
}

/// What one material calls for by itself.
fn alone(scene: &SceneDescription, name: &str, material: &Material, bearer: &str, effects: &mut Effects) {
    let because = |what: &str| format!("materials.{name} ({what}) on {bearer}");
    match material.roughness() {
        Some(0.0) => effects.add(Effect::SpecularChains, because("smooth")),
        Some(roughness) => effects.add(Effect::NearSpecular, because(&format!("roughness {}", rounded(roughness)))),
        None => {}
    }
    match material {
        Material::Dielectric(m) if !m.thin => {
            effects.add(Effect::Refraction, because(&format!("{} inside, {} outside", m.interior_ior, m.exterior_ior)));
        }
        Material::Principled(m) if !m.thin && !m.transmission.is_zero() => {
            effects.add(Effect::Refraction, because(&format!("transmission at an index of {}", m.ior)));
        }
        Material::Mask(mask) => {
            let what = mask.opacity.constant().map_or("opacity from a texture".to_string(), |opacity| format!("opacity {opacity}"));
            effects.add(Effect::Holes, because(&what));
        }
        Material::Null => effects.add(Effect::Holes, because("a boundary and nothing else")),
        Material::BumpMap(_) => effects.add(Effect::FineDetail, because("bumps")),
        Material::NormalMap(_) => effects.add(Effect::FineDetail, because("normals from a texture")),
        _ => {}
    }
    let mut textures = BTreeSet::new();
    material.textures().into_iter().for_each(|texture| within(scene, texture, &mut textures));
    for texture in textures {
        effects.add(Effect::Textures, format!("textures.{texture} in materials.{name} on {bearer}"));
        if let Some(repeats) = scene.textures.get(texture).and_then(repeats).filter(|repeats| *repeats >= FINE) {
            effects.add(Effect::FineDetail, format!("textures.{texture} ({repeats} times over) in materials.{name} on {bearer}"));
        }
    }
}

/// A texture and all that it is made of.
fn within<'a>(scene: &'a SceneDescription, name: &'a str, found: &mut BTreeSet<&'a str>) {
    if found.insert(name) {
        scene.textures.get(name).map(Texture::parts).unwrap_or_default().into_iter().for_each(|part| within(scene, part, found));
    }
}

/// How often a texture repeats for each unit of the texture coordinates, along the denser side.
fn repeats(texture: &Texture) -> Option<f64> {
    let uv = match texture {
        Texture::Bitmap(bitmap) => &bitmap.uv,
        Texture::Checkerboard(board) => &board.uv,
        _ => return None,
    };
    Some(uv.scale[0].abs().max(uv.scale[1].abs()))
}

/// A caustic needs a light, something that gathers it, and something diffuse that shows it.
fn together(scene: &SceneDescription, parts: &BTreeMap<&str, &str>, effects: &mut Effects) {
    let extended = effects.has(Effect::AreaLights) || effects.has(Effect::EnvironmentLight);
    let concentrated = effects.because(Effect::ConcentratedLights).join(", ");
    let shown = parts.keys().any(|name| scene.materials.get(*name).is_some_and(shows));
    let lit = extended || !concentrated.is_empty();
    if !shown || !lit {
        return;
    }
    for (name, bearer) in parts {
        let Some(roughness) = scene.materials.get(*name).and_then(Material::roughness) else { continue };
        let place = format!("materials.{name} on {bearer}");
        if extended && roughness <= CAUSTIC_ROUGHNESS {
            effects.add(Effect::Caustics, &place);
        }
        // What the camera sees it through must be clear itself.
        if extended && roughness == 0.0 {
            effects.add(Effect::SeenCaustics, &place);
        }
        if !concentrated.is_empty() && roughness == 0.0 {
            effects.add(Effect::LostCaustics, format!("{place} under {concentrated}"));
        }
    }
}

/// Whether a material scatters light widely enough to show a caustic.
fn shows(material: &Material) -> bool {
    match material {
        Material::Diffuse(m) => !m.reflectance.is_black(),
        Material::RoughDiffuse(m) => !m.reflectance.is_black(),
        Material::Plastic(m) => !m.diffuse.is_black(),
        Material::Phong(m) => !m.diffuse.is_black(),
        Material::Ward(m) => !m.diffuse.is_black(),
        Material::Principled(m) => !ScalarInput::is_one(&m.metallic),
        _ => false,
    }
}

/// Three digits are enough for people.
fn rounded(number: f64) -> f64 {
    (number * 1e3).round() / 1e3
}

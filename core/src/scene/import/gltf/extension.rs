//! glTF's extensions as far as they are honoured, or reported with their place.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::document::{Others, TextureInfo};

/// Extensions that a file may require: those that are honoured, or so approximated that the scene remains what it is.
pub(super) const KNOWN: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Extensions of the whole file.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub(super) lights: Option<Lights>,
    #[serde(flatten)]
    pub(super) others: Others,
}

/// KHR_lights_punctual.
#[derive(Debug, Deserialize)]
pub(super) struct Lights {
    pub(super) lights: Vec<Light>,
}

/// A point, spot or directional light.
#[derive(Debug, Deserialize)]
pub(super) struct Light {
    #[serde(default)]
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) color: Option<[f64; 3]>,
    pub(super) intensity: Option<f64>,
    pub(super) range: Option<f64>,
    pub(super) spot: Option<Spot>,
}

/// The cone of a spot.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Spot {
    /// [rad].
    pub(super) inner_cone_angle: Option<f64>,
    /// [rad].
    pub(super) outer_cone_angle: Option<f64>,
}

/// Extensions of nodes.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub(super) light: Option<LightReference>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(super) instancing: Option<Instancing>,
    #[serde(flatten)]
    pub(super) others: Others,
}

/// Which light stands at a node.
#[derive(Debug, Deserialize)]
pub(super) struct LightReference {
    pub(super) light: usize,
}

/// EXT_mesh_gpu_instancing: accessors of TRANSLATION, ROTATION and SCALE.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Instancing {
    pub(super) attributes: BTreeMap<String, usize>,
}

/// Extensions of textures: other image formats.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct TextureExtensions {
    #[serde(flatten)]
    pub(super) others: Others,
}

/// Extensions of textures in materials.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub(super) transform: Option<TextureTransform>,
    #[serde(flatten)]
    pub(super) others: Others,
}

/// KHR_texture_transform.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct TextureTransform {
    pub(super) offset: Option<[f64; 2]>,
    /// [rad].
    pub(super) rotation: f64,
    pub(super) scale: Option<[f64; 2]>,
    pub(super) tex_coord: Option<usize>,
}

/// Extensions of materials.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub(super) emissive_strength: Option<EmissiveStrength>,
    #[serde(rename = "KHR_materials_ior")]
    pub(super) ior: Option<Ior>,
    #[serde(rename = "KHR_materials_specular")]
    pub(super) specular: Option<Specular>,
    #[serde(rename = "KHR_materials_transmission")]
    pub(super) transmission: Option<Transmission>,
    #[serde(rename = "KHR_materials_volume")]
    pub(super) volume: Option<Volume>,
    #[serde(rename = "KHR_materials_clearcoat")]
    pub(super) clearcoat: Option<Clearcoat>,
    #[serde(rename = "KHR_materials_sheen")]
    pub(super) sheen: Option<Sheen>,
    #[serde(rename = "KHR_materials_anisotropy")]
    pub(super) anisotropy: Option<Anisotropy>,
    #[serde(rename = "KHR_materials_dispersion")]
    pub(super) dispersion: Option<IgnoredAny>,
    #[serde(rename = "KHR_materials_unlit")]
    pub(super) unlit: Option<IgnoredAny>,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub(super) specular_glossiness: Option<SpecularGlossiness>,
    #[serde(flatten)]
    pub(super) others: Others,
}

/// Light stronger than `emissiveFactor` can say.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct EmissiveStrength {
    pub(super) emissive_strength: Option<f64>,
}

/// The index of refraction.
#[derive(Debug, Deserialize)]
pub(super) struct Ior {
    pub(super) ior: Option<f64>,
}

/// Strength and tint of a dielectric's reflection.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Specular {
    pub(super) specular_factor: Option<f64>,
    pub(super) specular_texture: Option<TextureInfo>,
    pub(super) specular_color_factor: Option<[f64; 3]>,
    pub(super) specular_color_texture: Option<TextureInfo>,
}

/// Light that passes.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Transmission {
    pub(super) transmission_factor: f64,
    pub(super) transmission_texture: Option<TextureInfo>,
}

/// What lies behind a transmitting surface.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Volume {
    pub(super) thickness_factor: f64,
    pub(super) attenuation_distance: Option<f64>,
    pub(super) attenuation_color: Option<[f64; 3]>,
}

/// A clear coat.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Clearcoat {
    pub(super) clearcoat_factor: f64,
    pub(super) clearcoat_texture: Option<TextureInfo>,
    pub(super) clearcoat_roughness_factor: f64,
    pub(super) clearcoat_roughness_texture: Option<TextureInfo>,
    pub(super) clearcoat_normal_texture: Option<IgnoredAny>,
}

/// The sheen of fabrics.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Sheen {
    pub(super) sheen_color_factor: [f64; 3],
    pub(super) sheen_color_texture: Option<TextureInfo>,
    pub(super) sheen_roughness_factor: f64,
    pub(super) sheen_roughness_texture: Option<TextureInfo>,
}

/// Stretched highlights.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Anisotropy {
    pub(super) anisotropy_strength: f64,
    pub(super) anisotropy_rotation: f64,
    pub(super) anisotropy_texture: Option<IgnoredAny>,
}

/// The older model of diffuse and specular colour.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct SpecularGlossiness {
    pub(super) diffuse_factor: Option<[f64; 4]>,
    pub(super) diffuse_texture: Option<TextureInfo>,
    pub(super) specular_factor: Option<[f64; 3]>,
    pub(super) glossiness_factor: Option<f64>,
    pub(super) specular_glossiness_texture: Option<TextureInfo>,
}

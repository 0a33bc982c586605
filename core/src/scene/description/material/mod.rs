//! Materials as written: opaque ones, transparent ones, the principled one, and those made of others.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

mod composite;
mod opaque;
mod principled;
mod transparent;

pub use composite::{Blend, BumpMap, Mask, NormalMap, TwoSided};
pub use opaque::{Conductor, Diffuse, Phong, Plastic, RoughDiffuse, Ward};
pub use principled::Principled;
pub use transparent::Dielectric;

use super::input::{ColourInput, ScalarInput};

/// What a surface does to light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Material {
    /// Lambert's ideal diffuse reflection.
    Diffuse(Diffuse),
    /// A matt surface of small facets, each ideally diffuse (Oren and Nayar).
    RoughDiffuse(RoughDiffuse),
    /// A metal, smooth or rough.
    Conductor(Conductor),
    /// Glass, water and their like, smooth or rough, a boundary or a thin sheet.
    Dielectric(Dielectric),
    /// A diffuse base under a dielectric coat, smooth or rough.
    Plastic(Plastic),
    /// One material for most things, by parameters that artists use; that of glTF 2.0.
    Principled(Principled),
    /// Phong's glossy lobe over a diffuse base, for old scenes.
    Phong(Phong),
    /// Ward's anisotropic glossy lobe over a diffuse base, for old scenes.
    Ward(Ward),
    /// Another material with holes.
    Mask(Mask),
    /// Two materials, mixed.
    Blend(Blend),
    /// One material on the front, another on the back.
    TwoSided(TwoSided),
    /// Another material with bumps that bend its shading normal.
    BumpMap(BumpMap),
    /// Another material with shading normals from a texture.
    NormalMap(NormalMap),
    /// Nothing at all: light passes as if no surface were there. For the boundaries of media.
    Null,
}

/// The distribution of a rough surface's facets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// Trowbridge and Reitz's, with long tails.
    #[default]
    Ggx,
    /// Beckmann's, with short ones.
    Beckmann,
}

impl Distribution {
    fn is_ggx(&self) -> bool {
        *self == Distribution::Ggx
    }
}

impl Material {
    /// Every word that a material may be written with.
    pub fn kind(&self) -> &'static str {
        match self {
            Material::Diffuse(_) => "diffuse",
            Material::RoughDiffuse(_) => "rough_diffuse",
            Material::Conductor(_) => "conductor",
            Material::Dielectric(_) => "dielectric",
            Material::Plastic(_) => "plastic",
            Material::Principled(_) => "principled",
            Material::Phong(_) => "phong",
            Material::Ward(_) => "ward",
            Material::Mask(_) => "mask",
            Material::Blend(_) => "blend",
            Material::TwoSided(_) => "two_sided",
            Material::BumpMap(_) => "bump_map",
            Material::NormalMap(_) => "normal_map",
            Material::Null => "null",
        }
    }

    /// Names of the materials that it is made of.
    pub fn parts(&self) -> Vec<&str> {
        match self {
            Material::Mask(mask) => vec![&mask.material],
            Material::Blend(blend) => vec![&blend.first, &blend.second],
            Material::TwoSided(sides) => vec![&sides.front, &sides.back],
            Material::BumpMap(map) => vec![&map.material],
            Material::NormalMap(map) => vec![&map.material],
            _ => Vec::new(),
        }
    }

    /// Its coloured inputs, by field, each with the greatest value that a constant channel may have.
    pub fn colours(&self) -> Vec<(&'static str, &ColourInput, f64)> {
        match self {
            Material::Diffuse(m) => vec![("reflectance", &m.reflectance, 1.0)],
            Material::RoughDiffuse(m) => vec![("reflectance", &m.reflectance, 1.0)],
            Material::Conductor(m) => vec![("reflectance", &m.reflectance, 1.0)],
            Material::Dielectric(m) => vec![("reflectance", &m.reflectance, 1.0), ("transmittance", &m.transmittance, 1.0)],
            Material::Plastic(m) => vec![("diffuse", &m.diffuse, 1.0), ("specular", &m.specular, 1.0)],
            Material::Principled(m) => {
                vec![
                    ("base_color", &m.base_color, 1.0),
                    ("specular_color", &m.specular_color, f64::INFINITY),
                    ("sheen_color", &m.sheen_color, 1.0),
                ]
            }
            Material::Phong(m) => vec![("diffuse", &m.diffuse, 1.0), ("specular", &m.specular, 1.0)],
            Material::Ward(m) => vec![("diffuse", &m.diffuse, 1.0), ("specular", &m.specular, 1.0)],
            Material::NormalMap(m) => vec![("normals", &m.normals, 1.0)],
            _ => Vec::new(),
        }
    }

    /// Its numeric inputs, by field, each with the range that a constant must lie in.
    pub fn scalars(&self) -> Vec<(&'static str, &ScalarInput, [f64; 2])> {
        const UNIT: [f64; 2] = [0.0, 1.0];
        fn rough<'a>(roughness: &'a ScalarInput, v: &'a Option<ScalarInput>) -> Vec<(&'static str, &'a ScalarInput, [f64; 2])> {
            let v = v.iter().map(|v| ("roughness_v", v, UNIT));
            [("roughness", roughness, UNIT)].into_iter().chain(v).collect()
        }
        match self {
            Material::RoughDiffuse(m) => vec![("roughness", &m.roughness, UNIT)],
            Material::Conductor(m) => rough(&m.roughness, &m.roughness_v),
            Material::Dielectric(m) => rough(&m.roughness, &m.roughness_v),
            Material::Plastic(m) => rough(&m.roughness, &None),
            Material::Principled(m) => vec![
                ("metallic", &m.metallic, UNIT),
                ("roughness", &m.roughness, UNIT),
                ("anisotropy", &m.anisotropy, [-1.0, 1.0]),
                ("specular", &m.specular, UNIT),
                ("clearcoat", &m.clearcoat, UNIT),
                ("clearcoat_roughness", &m.clearcoat_roughness, UNIT),
                ("sheen_roughness", &m.sheen_roughness, UNIT),
                ("transmission", &m.transmission, UNIT),
            ],
            Material::Phong(m) => vec![("exponent", &m.exponent, [0.0, 1e9])],
            Material::Ward(m) => rough(&m.roughness, &m.roughness_v),
            Material::Mask(m) => vec![("opacity", &m.opacity, UNIT)],
            Material::Blend(m) => vec![("weight", &m.weight, UNIT)],
            Material::BumpMap(m) => vec![("height", &m.height, [f64::NEG_INFINITY, f64::INFINITY])],
            _ => Vec::new(),
        }
    }

    /// Names of the textures that it uses itself; those of its parts are theirs.
    pub fn textures(&self) -> Vec<&str> {
        let colours = self.colours().into_iter().filter_map(|(_, input, _)| input.texture());
        let scalars = self.scalars().into_iter().filter_map(|(_, input, _)| input.texture());
        colours.chain(scalars).collect()
    }

    /// Roughness α ≥ 0 of its sharpest lobe where that is known without a texture, 0 being perfectly smooth; `None` for
    /// materials without a glossy lobe and for those made of others.
    pub fn roughness(&self) -> Option<f64> {
        let sharper = |u: &ScalarInput, v: &Option<ScalarInput>| {
            // A texture may be anything: it counts as what it scales, rough.
            let number = |input: &ScalarInput| input.constant().copied().unwrap_or(1.0);
            v.as_ref().map_or(number(u), |v| number(u).min(number(v)))
        };
        match self {
            Material::Conductor(m) => Some(sharper(&m.roughness, &m.roughness_v)),
            Material::Dielectric(m) => Some(sharper(&m.roughness, &m.roughness_v)),
            Material::Plastic(m) => Some(sharper(&m.roughness, &None)),
            Material::Ward(m) => Some(sharper(&m.roughness, &m.roughness_v)),
            Material::Principled(m) => Some(m.sharpest()),
            Material::Phong(m) => Some((2.0 / (m.exponent.constant().copied().unwrap_or(30.0) + 2.0)).sqrt()),
            _ => None,
        }
    }
}

fn yes() -> bool {
    true
}

fn is_yes(value: &bool) -> bool {
    *value
}

fn is_no(value: &bool) -> bool {
    !*value
}

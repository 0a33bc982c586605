//! Materials.

use super::texture::{self, Textures};
use super::{spectrum, unsupported};
use crate::material::{Bsdf, Conductor, Dielectric, Diffuse, Ggx, Material, Textured};
use crate::scene::description::{self, Colour, ColourInput, Distribution, ScalarInput, SceneDescription};
use crate::scene::error::Error;
use crate::spectrum::Spectrum;
use crate::texture::{ColourInput as Input, ScalarInput as Number};

/// Every material, in the order of their names.
pub(super) fn compile(description: &SceneDescription, textures: &Textures) -> Result<Vec<Material>, Error> {
    description.materials.iter().map(|(name, material)| one(material, &format!("materials.{name}"), textures)).collect()
}

fn one(material: &description::Material, path: &str, textures: &Textures) -> Result<Material, Error> {
    Ok(match material {
        description::Material::Diffuse(diffuse) => match texture::colour(&diffuse.reflectance, textures) {
            Input::Constant(reflectance) => Bsdf::Diffuse(Diffuse { reflectance, two_sided: diffuse.two_sided }).into(),
            reflectance => Material::Textured(Textured::Diffuse { reflectance, two_sided: diffuse.two_sided }),
        },
        description::Material::Conductor(conductor) => {
            // A checked description always has an index; without one it is the perfect mirror.
            let (eta, k) = conductor.index_of_refraction().unwrap_or((Colour::grey(0.0), Colour::WHITE));
            let facets = (&conductor.roughness, &conductor.roughness_v, conductor.distribution, conductor.energy_conserving);
            Bsdf::Conductor(Conductor {
                eta: spectrum(eta),
                k: spectrum(k),
                reflectance: constant(&conductor.reflectance, path)?,
                ggx: ggx(facets, path, textures)?,
                two_sided: conductor.two_sided,
            })
            .into()
        }
        description::Material::Dielectric(dielectric) if !dielectric.thin => {
            let facets = (&dielectric.roughness, &dielectric.roughness_v, dielectric.distribution, dielectric.energy_conserving);
            Bsdf::Dielectric(Dielectric {
                eta: (dielectric.interior_ior / dielectric.exterior_ior) as f32,
                reflectance: constant(&dielectric.reflectance, path)?,
                transmittance: constant(&dielectric.transmittance, path)?,
                ggx: ggx(facets, path, textures)?,
            })
            .into()
        }
        other => return Err(unsupported(path, other.kind())),
    })
}

fn constant(input: &ColourInput, path: &str) -> Result<Spectrum, Error> {
    input.constant().map(|colour| spectrum(*colour)).ok_or_else(|| unsupported(path, "a texture here"))
}

fn ggx(facets: (&ScalarInput, &Option<ScalarInput>, Distribution, bool), path: &str, textures: &Textures) -> Result<Option<Ggx>, Error> {
    match facets {
        (roughness, None, Distribution::Ggx, false) => {
            let Number::Constant(roughness) = texture::scalar(roughness, textures) else { return Err(unsupported(path, "a texture here")) };
            Ok(Ggx::new(roughness))
        }
        _ => Err(unsupported(path, "facets other than plain GGX")),
    }
}

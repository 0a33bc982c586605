//! Materials.

use super::texture::{self, Textures};
use super::{spectrum, unsupported};
use crate::material::{
    BouncedGlass, BouncedGlassTable, Bsdf, Coat, CoatInput, CoatTable, Composite, Distribution, GlassBounces, Material, PrincipledInputs,
    Relief, RoughInput, Textured, diffuse_conductor,
};
use crate::scene::description::{self, Colour, ColourInput, ScalarInput, SceneDescription};
use crate::scene::error::Error;
use crate::scene::limits;
use crate::texture::{ColourInput as Input, ScalarInput as Number, TexturePoint};

/// Every material, in the order of their names.
pub(super) fn compile(description: &SceneDescription, textures: &Textures) -> Result<Vec<Material>, Error> {
    let compiler = Compiler { description, textures };
    description.materials.iter().map(|(name, material)| compiler.material(material, &format!("materials.{name}"))).collect()
}

struct Compiler<'a> {
    description: &'a SceneDescription,
    textures: &'a Textures,
}

impl Compiler<'_> {
    fn material(&self, material: &description::Material, path: &str) -> Result<Material, Error> {
        let inputs = match material {
            description::Material::Diffuse(m) => Textured::Diffuse { reflectance: self.colour(&m.reflectance), two_sided: m.two_sided },
            description::Material::RoughDiffuse(m) => Textured::RoughDiffuse {
                reflectance: self.colour(&m.reflectance),
                roughness: self.number(&m.roughness),
                two_sided: m.two_sided,
            },
            description::Material::Conductor(m) => self.conductor(m),
            description::Material::Dielectric(m) => self.dielectric(m),
            description::Material::Plastic(m) => self.plastic(m),
            description::Material::Principled(m) => self.principled(m),
            description::Material::Phong(m) => Textured::Phong {
                diffuse: self.colour(&m.diffuse),
                specular: self.colour(&m.specular),
                exponent: self.number(&m.exponent),
                two_sided: m.two_sided,
            },
            description::Material::Ward(m) => Textured::Ward {
                diffuse: self.colour(&m.diffuse),
                specular: self.colour(&m.specular),
                roughness: self.number(&m.roughness),
                roughness_v: m.roughness_v.as_ref().map(|v| self.number(v)),
                two_sided: m.two_sided,
            },
            // How much of a surface is there is its boundary's business.
            description::Material::Mask(m) => return self.named(&m.material),
            description::Material::Null => return Ok(Bsdf::Null.into()),
            description::Material::Blend(m) => return self.blend(m, path),
            description::Material::TwoSided(m) => return self.two_sided(m, path),
            description::Material::BumpMap(m) => {
                let relief = Relief::Bumps { height: self.number(&m.height), scale: m.scale as f32 };
                return Ok(Composite::Bent { material: self.named(&m.material)?, relief }.into());
            }
            description::Material::NormalMap(m) => {
                let relief = Relief::Normals { normals: self.colour(&m.normals), scale: m.scale as f32 };
                return Ok(Composite::Bent { material: self.named(&m.material)?, relief }.into());
            }
        };
        if material.textures().is_empty() {
            return Ok(Material::Plain(inputs.at(&TexturePoint::default())));
        }
        Ok(Material::Textured(inputs))
    }

    /// A part of another material. The check of the description has found its name and ruled out circles.
    fn named(&self, name: &str) -> Result<Material, Error> {
        self.material(&self.description.materials[name], &format!("materials.{name}"))
    }

    fn blend(&self, m: &description::Blend, path: &str) -> Result<Material, Error> {
        let (first, second) = (self.named(&m.first)?, self.named(&m.second)?);
        if let (Some(a), Some(b)) = (first.delta_ior(), second.delta_ior())
            && a != b
        {
            return Err(unsupported(path, &format!("a blend of smooth boundaries that bend light differently (by {a} and {b})")));
        }
        few(Composite::Blend { first, second, weight: self.number(&m.weight) }.into(), path)
    }

    fn two_sided(&self, m: &description::TwoSided, path: &str) -> Result<Material, Error> {
        let (front, back) = (self.named(&m.front)?, self.named(&m.back)?);
        if front.transmits() || back.transmits() {
            return Err(unsupported(path, "a two-sided material that transmits"));
        }
        few(Composite::TwoSided { front, back }.into(), path)
    }

    fn conductor(&self, m: &description::Conductor) -> Textured {
        // A checked description always has an index; without one it is the perfect mirror.
        let (eta, k) = m.index_of_refraction().unwrap_or((Colour::grey(0.0), Colour::WHITE));
        let (eta, k) = (spectrum(eta), spectrum(k));
        Textured::Conductor {
            eta,
            k,
            reflectance: self.colour(&m.reflectance),
            rough: self.rough(m.distribution, &m.roughness, m.roughness_v.as_ref()),
            bounces: m.energy_conserving.then(|| diffuse_conductor(eta, k)),
            two_sided: m.two_sided,
        }
    }

    fn dielectric(&self, m: &description::Dielectric) -> Textured {
        let eta = (m.interior_ior / m.exterior_ior) as f32;
        let (reflectance, transmittance) = (self.colour(&m.reflectance), self.colour(&m.transmittance));
        if m.thin {
            return Textured::ThinDielectric { eta, reflectance, transmittance };
        }
        let rough = self.rough(m.distribution, &m.roughness, m.roughness_v.as_ref());
        let bounces = match (m.energy_conserving, rough.is_constant()) {
            (false, _) => None,
            (true, true) => BouncedGlass::new(eta, rough.at(&TexturePoint::default())).map(GlassBounces::Fixed),
            (true, false) => Some(GlassBounces::Table(BouncedGlassTable::new(rough.distribution, eta))),
        };
        Textured::Dielectric { eta, reflectance, transmittance, rough, bounces: bounces.unwrap_or(GlassBounces::None) }
    }

    fn plastic(&self, m: &description::Plastic) -> Textured {
        let eta = (m.interior_ior / m.exterior_ior) as f32;
        let rough = self.rough(m.distribution, &m.roughness, None);
        let coat = if rough.is_constant() {
            CoatInput::Fixed(Coat::new(eta, rough.at(&TexturePoint::default())))
        } else {
            let table = CoatTable::new(rough.distribution, eta);
            CoatInput::Table(rough, table)
        };
        Textured::Plastic {
            diffuse: self.colour(&m.diffuse),
            specular: self.colour(&m.specular),
            coat,
            nonlinear: m.nonlinear,
            two_sided: m.two_sided,
        }
    }

    fn principled(&self, m: &description::Principled) -> Textured {
        Textured::Principled(Box::new(PrincipledInputs {
            base_color: self.colour(&m.base_color),
            metallic: self.number(&m.metallic),
            roughness: self.number(&m.roughness),
            anisotropy: self.number(&m.anisotropy),
            ior: m.ior as f32,
            specular: self.number(&m.specular),
            specular_color: self.colour(&m.specular_color),
            clearcoat: self.number(&m.clearcoat),
            clearcoat_roughness: self.number(&m.clearcoat_roughness),
            sheen_color: self.colour(&m.sheen_color),
            sheen_roughness: self.number(&m.sheen_roughness),
            transmission: self.number(&m.transmission),
            thin: m.thin,
            two_sided: m.two_sided,
        }))
    }

    fn colour(&self, input: &ColourInput) -> Input {
        texture::colour(input, self.textures)
    }

    fn number(&self, input: &ScalarInput) -> Number {
        texture::scalar(input, self.textures)
    }

    fn rough(&self, distribution: description::Distribution, u: &ScalarInput, v: Option<&ScalarInput>) -> RoughInput {
        let distribution = match distribution {
            description::Distribution::Ggx => Distribution::Ggx,
            description::Distribution::Beckmann => Distribution::Beckmann,
        };
        RoughInput { distribution, u: self.number(u), v: v.map(|v| self.number(v)) }
    }
}

/// Refuses materials of too many parts: every part costs time at every vertex, and parts of parts double it each time.
fn few(material: Material, path: &str) -> Result<Material, Error> {
    let parts = material.leaves();
    if parts > limits::MATERIAL_PARTS {
        return Err(unsupported(path, &format!("a material of {parts} parts, more than {}", limits::MATERIAL_PARTS)));
    }
    Ok(material)
}

#[cfg(test)]
mod tests;

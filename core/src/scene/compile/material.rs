//! Materials.

use super::texture::{self, Textures};
use super::{spectrum, unsupported};
use crate::material::{
    BouncedGlass, BouncedGlassTable, Bsdf, Coat, CoatInput, CoatTable, Distribution, GlassBounces, Material, PrincipledInputs, RoughInput,
    Textured, diffuse_conductor,
};
use crate::scene::description::{self, Colour, ColourInput, ScalarInput, SceneDescription};
use crate::scene::error::Error;
use crate::texture::{ColourInput as Input, ScalarInput as Number, TexturePoint};

/// Every material, in the order of their names.
pub(super) fn compile(description: &SceneDescription, textures: &Textures) -> Result<Vec<Material>, Error> {
    let compiler = Compiler { textures };
    description.materials.iter().map(|(name, material)| compiler.material(material, &format!("materials.{name}"))).collect()
}

struct Compiler<'a> {
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
            description::Material::Null => return Ok(Bsdf::Null.into()),
            other => return Err(unsupported(path, other.kind())),
        };
        if material.textures().is_empty() {
            return Ok(Material::Plain(inputs.at(&TexturePoint::default())));
        }
        Ok(Material::Textured(inputs))
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

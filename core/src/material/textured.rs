//! Materials whose numbers come from textures.

use super::{
    Bounced, BouncedGlass, BouncedGlassTable, Bsdf, Coat, CoatTable, Conductor, Dielectric, Diffuse, Distribution, Microfacets, Phong,
    Plastic, Principled, PrincipledParameters, RoughDiffuse, ThinDielectric, Ward,
};
use crate::spectrum::Spectrum;
use crate::texture::{ColourInput, ScalarInput, TexturePoint};

/// Roughness from textures.
#[derive(Clone, Debug, PartialEq)]
pub struct RoughInput {
    /// Distribution of the facets.
    pub distribution: Distribution,
    /// α along x.
    pub u: ScalarInput,
    /// α along y, where it is another one.
    pub v: Option<ScalarInput>,
}

impl RoughInput {
    /// Whether no texture is asked.
    pub fn is_constant(&self) -> bool {
        let constant = |input: &ScalarInput| matches!(input, ScalarInput::Constant(_));
        constant(&self.u) && self.v.as_ref().is_none_or(constant)
    }

    /// The facets at a point; `None` where it is smooth.
    #[inline]
    pub fn at(&self, at: &TexturePoint) -> Option<Microfacets> {
        let u = unit(&self.u, at);
        Microfacets::new(self.distribution, u, self.v.as_ref().map_or(u, |v| unit(v, at)))
    }
}

/// Light that bounces between the facets of glass.
#[derive(Clone, Debug, PartialEq)]
pub enum GlassBounces {
    /// Left out.
    None,
    /// Of one roughness.
    Fixed(BouncedGlass),
    /// Of any roughness.
    Table(BouncedGlassTable),
}

/// The coat of a plastic.
#[derive(Clone, Debug, PartialEq)]
pub enum CoatInput {
    /// The same everywhere.
    Fixed(Coat),
    /// Its roughness comes from a texture.
    Table(RoughInput, CoatTable),
}

/// The numbers of a principled material; see [`PrincipledParameters`].
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the fields are those of PrincipledParameters")]
pub struct PrincipledInputs {
    pub base_color: ColourInput,
    pub metallic: ScalarInput,
    pub roughness: ScalarInput,
    pub anisotropy: ScalarInput,
    pub ior: f32,
    pub specular: ScalarInput,
    pub specular_color: ColourInput,
    pub clearcoat: ScalarInput,
    pub clearcoat_roughness: ScalarInput,
    pub sheen_color: ColourInput,
    pub sheen_roughness: ScalarInput,
    pub transmission: ScalarInput,
    pub thin: bool,
    pub two_sided: bool,
}

/// A material with at least one input from a texture. The fields mean what those of the leaf of the same name mean.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the fields are those of the leaves")]
pub enum Textured {
    /// Lambertian reflection.
    Diffuse { reflectance: ColourInput, two_sided: bool },
    /// Matt facets; the roughness is their standard deviation [rad].
    RoughDiffuse { reflectance: ColourInput, roughness: ScalarInput, two_sided: bool },
    /// Metal; `bounces` is its diffuse reflectance where light bounces between facets.
    Conductor { eta: Spectrum, k: Spectrum, reflectance: ColourInput, rough: RoughInput, bounces: Option<Spectrum>, two_sided: bool },
    /// Boundary between transparent media.
    Dielectric { eta: f32, reflectance: ColourInput, transmittance: ColourInput, rough: RoughInput, bounces: GlassBounces },
    /// Thin sheet of glass.
    ThinDielectric { eta: f32, reflectance: ColourInput, transmittance: ColourInput },
    /// Diffuse base under a coat.
    Plastic { diffuse: ColourInput, specular: ColourInput, coat: CoatInput, nonlinear: bool, two_sided: bool },
    /// Metal, dielectric and glass, with coat and sheen.
    Principled(Box<PrincipledInputs>),
    /// Phong's lobe.
    Phong { diffuse: ColourInput, specular: ColourInput, exponent: ScalarInput, two_sided: bool },
    /// Ward's lobe.
    Ward { diffuse: ColourInput, specular: ColourInput, roughness: ScalarInput, roughness_v: Option<ScalarInput>, two_sided: bool },
}

#[inline]
fn unit(input: &ScalarInput, at: &TexturePoint) -> f32 {
    input.at(at).clamp(0.0, 1.0)
}

#[inline]
fn colour(input: &ColourInput, at: &TexturePoint) -> Spectrum {
    input.at(at).clamp(0.0, 1.0)
}

impl Textured {
    /// What it amounts to at a point. Numbers from textures are held within their domains.
    pub fn at(&self, at: &TexturePoint) -> Bsdf {
        match self {
            Textured::Diffuse { reflectance, two_sided } => {
                Bsdf::Diffuse(Diffuse { reflectance: colour(reflectance, at), two_sided: *two_sided })
            }
            Textured::RoughDiffuse { reflectance, roughness, two_sided } => {
                Bsdf::RoughDiffuse(RoughDiffuse::new(colour(reflectance, at), unit(roughness, at), *two_sided))
            }
            Textured::Conductor { eta, k, reflectance, rough, bounces, two_sided } => {
                let facets = rough.at(at);
                let bounced = bounces.and_then(|fresnel| Bounced::of(fresnel, facets));
                Bsdf::Conductor(Conductor {
                    eta: *eta,
                    k: *k,
                    reflectance: colour(reflectance, at),
                    facets,
                    bounced,
                    two_sided: *two_sided,
                })
            }
            Textured::Dielectric { eta, reflectance, transmittance, rough, bounces } => {
                let facets = rough.at(at);
                let bounced = match bounces {
                    GlassBounces::None => None,
                    GlassBounces::Fixed(bounced) => facets.map(|_| *bounced),
                    GlassBounces::Table(table) => table.at(facets),
                };
                let (reflectance, transmittance) = (colour(reflectance, at), colour(transmittance, at));
                Bsdf::Dielectric(Dielectric { eta: *eta, reflectance, transmittance, facets, bounced })
            }
            Textured::ThinDielectric { eta, reflectance, transmittance } => {
                let (reflectance, transmittance) = (colour(reflectance, at), colour(transmittance, at));
                Bsdf::ThinDielectric(ThinDielectric { eta: *eta, reflectance, transmittance })
            }
            Textured::Plastic { diffuse, specular, coat, nonlinear, two_sided } => {
                let coat = match coat {
                    CoatInput::Fixed(coat) => *coat,
                    CoatInput::Table(rough, table) => table.at(rough.at(at)),
                };
                let (diffuse, specular) = (colour(diffuse, at), colour(specular, at));
                Bsdf::Plastic(Plastic { diffuse, specular, coat, nonlinear: *nonlinear, two_sided: *two_sided })
            }
            Textured::Principled(inputs) => Bsdf::Principled(Principled::new(&inputs.at(at))),
            Textured::Phong { diffuse, specular, exponent, two_sided } => Bsdf::Phong(Phong {
                diffuse: colour(diffuse, at),
                specular: colour(specular, at),
                exponent: exponent.at(at).clamp(0.0, 1e9),
                two_sided: *two_sided,
            }),
            Textured::Ward { diffuse, specular, roughness, roughness_v, two_sided } => {
                let alpha_u = unit(roughness, at);
                let alpha_v = roughness_v.as_ref().map_or(alpha_u, |v| unit(v, at));
                Bsdf::Ward(Ward { diffuse: colour(diffuse, at), specular: colour(specular, at), alpha_u, alpha_v, two_sided: *two_sided })
            }
        }
    }

    /// Whether directions along the surface matter somewhere.
    pub fn is_anisotropic(&self) -> bool {
        match self {
            Textured::Conductor { rough, .. } | Textured::Dielectric { rough, .. } => rough.v.is_some(),
            Textured::Principled(inputs) => inputs.anisotropy != ScalarInput::Constant(0.0),
            Textured::Ward { roughness_v, .. } => roughness_v.is_some(),
            _ => false,
        }
    }

    pub(super) fn delta_ior(&self) -> Option<f32> {
        match self {
            Textured::Dielectric { eta, rough, .. } => {
                let smooth = |input: &ScalarInput| !matches!(input, ScalarInput::Constant(alpha) if *alpha > 0.0);
                (smooth(&rough.u) && rough.v.as_ref().is_none_or(smooth)).then_some(*eta)
            }
            Textured::ThinDielectric { .. } => Some(1.0),
            _ => None,
        }
    }

    /// Whether light may pass to the other side.
    pub fn transmits(&self) -> bool {
        match self {
            Textured::Dielectric { .. } | Textured::ThinDielectric { .. } => true,
            Textured::Principled(inputs) => inputs.transmission != ScalarInput::Constant(0.0),
            _ => false,
        }
    }
}

impl PrincipledInputs {
    #[inline]
    fn at(&self, at: &TexturePoint) -> PrincipledParameters {
        PrincipledParameters {
            base_color: colour(&self.base_color, at),
            metallic: unit(&self.metallic, at),
            roughness: unit(&self.roughness, at),
            anisotropy: self.anisotropy.at(at).clamp(-1.0, 1.0),
            ior: self.ior,
            specular: unit(&self.specular, at),
            specular_color: self.specular_color.at(at).clamp(0.0, f32::MAX),
            clearcoat: unit(&self.clearcoat, at),
            clearcoat_roughness: unit(&self.clearcoat_roughness, at),
            sheen_color: colour(&self.sheen_color, at),
            sheen_roughness: unit(&self.sheen_roughness, at),
            transmission: unit(&self.transmission, at),
            thin: self.thin,
            two_sided: self.two_sided,
        }
    }
}

//! Materials whose numbers come from textures.

use super::{Bsdf, Diffuse};
use crate::texture::{ColourInput, TexturePoint};

/// A material with at least one input from a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum Textured {
    /// Lambertian reflection.
    Diffuse {
        /// Albedo [1].
        reflectance: ColourInput,
        /// Whether the back reflects too.
        two_sided: bool,
    },
}

impl Textured {
    /// What it amounts to at a point. Numbers from textures are held within their domains.
    #[inline]
    pub fn at(&self, at: &TexturePoint) -> Bsdf {
        match self {
            Textured::Diffuse { reflectance, two_sided } => {
                Bsdf::Diffuse(Diffuse { reflectance: reflectance.at(at).clamp(0.0, 1.0), two_sided: *two_sided })
            }
        }
    }
}

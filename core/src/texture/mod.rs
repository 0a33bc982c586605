//! What varies over a surface: inputs of materials and lights, and the textures behind them.

mod bitmap;
mod checkerboard;
mod pixels;

pub use bitmap::{Bitmap, Wrap, decoding};
pub use checkerboard::Checkerboard;
pub use pixels::{Pixels, Texels, srgb_to_linear};

use crate::math::{Vec2, Vec3};
use crate::spectrum::Spectrum;
use std::sync::Arc;

/// Where on a surface a texture is looked up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TexturePoint {
    /// Texture coordinates.
    pub uv: Vec2,
    /// Colour of the vertices, interpolated; (1, 1, 1) where the shape has none, and unset where no texture asks for it.
    pub colour: Vec3,
}

/// A texture.
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    /// An image.
    Bitmap(Bitmap),
    /// Two colours in square fields.
    Checkerboard(Checkerboard),
    /// The vertices' colours, times a factor.
    VertexColour(Spectrum),
    /// The product of two inputs.
    Product(ColourInput, ColourInput),
    /// (1 − amount) · first + amount · second.
    Mix(ColourInput, ColourInput, ScalarInput),
}

impl Texture {
    /// Its colour at a point.
    pub fn colour(&self, at: &TexturePoint) -> Spectrum {
        match self {
            Texture::Bitmap(texture) => texture.colour(at),
            Texture::Checkerboard(texture) => texture.colour(at),
            Texture::VertexColour(scale) => Spectrum::rgb(at.colour.x, at.colour.y, at.colour.z) * *scale,
            Texture::Product(first, second) => first.at(at) * second.at(at),
            Texture::Mix(first, second, amount) => {
                let amount = amount.at(at).clamp(0.0, 1.0);
                first.at(at) * (1.0 - amount) + second.at(at) * amount
            }
        }
    }
}

/// A colour, the same everywhere or from a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum ColourInput {
    /// The same everywhere.
    Constant(Spectrum),
    /// From a texture.
    Texture(Arc<Texture>),
}

impl From<Spectrum> for ColourInput {
    fn from(colour: Spectrum) -> Self {
        ColourInput::Constant(colour)
    }
}

impl ColourInput {
    /// The colour at a point.
    #[inline]
    pub fn at(&self, at: &TexturePoint) -> Spectrum {
        match self {
            ColourInput::Constant(colour) => *colour,
            ColourInput::Texture(texture) => texture.colour(at),
        }
    }
}

/// A number, the same everywhere or from a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum ScalarInput {
    /// The same everywhere.
    Constant(f32),
    /// The mean of a texture's channels.
    Texture(Arc<Texture>),
}

impl ScalarInput {
    /// The number at a point.
    #[inline]
    pub fn at(&self, at: &TexturePoint) -> f32 {
        match self {
            ScalarInput::Constant(number) => *number,
            ScalarInput::Texture(texture) => texture.colour(at).mean(),
        }
    }
}

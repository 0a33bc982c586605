//! What varies over a surface: inputs of materials and lights, and the textures behind them.

mod checkerboard;

pub use checkerboard::Checkerboard;

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
    /// Two colours in square fields.
    Checkerboard(Checkerboard),
}

impl Texture {
    /// Its colour at a point.
    #[inline]
    pub fn colour(&self, at: &TexturePoint) -> Spectrum {
        match self {
            Texture::Checkerboard(texture) => texture.colour(at),
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

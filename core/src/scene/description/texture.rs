//! Textures as written: what varies over a surface.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::colour::Colour;
use super::input::{ColourInput, ScalarInput};

/// Something that varies over a surface, by its texture coordinates or by its vertices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Texture {
    /// An image from a file.
    Bitmap(Bitmap),
    /// Two colours in a checkerboard of 2 × 2 fields for each unit of the texture coordinates.
    Checkerboard(Checkerboard),
    /// Colours that the vertices of a mesh carry; (1, 1, 1) on shapes without.
    VertexColour(VertexColour),
    /// The product of two inputs.
    Product(Product),
    /// A blend of two inputs.
    Mix(Mix),
}

impl Texture {
    /// The file it refers to, if any.
    pub fn file(&self) -> Option<&str> {
        match self {
            Texture::Bitmap(bitmap) => Some(&bitmap.file),
            Texture::Checkerboard(_) | Texture::VertexColour(_) | Texture::Product(_) | Texture::Mix(_) => None,
        }
    }

    /// Names of the textures that it is made of.
    pub fn parts(&self) -> Vec<&str> {
        match self {
            Texture::Bitmap(_) | Texture::VertexColour(_) => Vec::new(),
            Texture::Checkerboard(c) => [c.color0.texture(), c.color1.texture()].into_iter().flatten().collect(),
            Texture::Product(p) => [p.first.texture(), p.second.texture()].into_iter().flatten().collect(),
            Texture::Mix(m) => [m.first.texture(), m.second.texture(), m.amount.texture()].into_iter().flatten().collect(),
        }
    }
}

/// An image. Its first row is at the top: texture coordinate v = 1 there, v = 0 at the bottom; u runs from left to right.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bitmap {
    /// A PNG, JPEG, OpenEXR or Radiance HDR file: name relative to the scene's folder, and inside it.
    pub file: String,
    /// How stored numbers become light.
    #[serde(default, skip_serializing_if = "is_default")]
    pub encoding: Encoding,
    /// Which channels count.
    #[serde(default, skip_serializing_if = "is_default")]
    pub channels: Channels,
    /// What lies between texel centres.
    #[serde(default, skip_serializing_if = "is_default")]
    pub filter: TextureFilter,
    /// What lies outside [0, 1]².
    #[serde(default, skip_serializing_if = "is_default")]
    pub wrap: Wrap,
    /// Applied to the texture coordinates before the look-up.
    #[serde(default, skip_serializing_if = "is_default")]
    pub uv: UvTransform,
    /// Factor on what is looked up, each channel ≥ 0.
    #[serde(default = "Colour::white", skip_serializing_if = "Colour::is_white")]
    pub scale: Colour,
}

/// How stored numbers become light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// sRGB for colours of 8 or 16 bits, linear for floating point and for single channels.
    #[default]
    Auto,
    /// The sRGB curve.
    Srgb,
    /// As stored.
    Linear,
}

/// Which channels of an image count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Channels {
    /// Red, green and blue; grey images give the same number three times.
    #[default]
    Rgb,
    /// Red alone.
    R,
    /// Green alone.
    G,
    /// Blue alone.
    B,
    /// Alpha alone, never decoded as sRGB; 1 where the image has none.
    A,
}

/// What lies between texel centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TextureFilter {
    /// A blend of the four nearest texels.
    #[default]
    Bilinear,
    /// The nearest texel.
    Nearest,
}

/// What lies outside [0, 1]².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// Its border texels.
    Clamp,
    /// Its mirror image.
    Mirror,
}

/// uv′ = offset + R(rotate) · (scale ⊙ uv), the rotation counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct UvTransform {
    /// Factors on u and v.
    pub scale: [f64; 2],
    /// Angle [degrees].
    pub rotate: f64,
    /// Added last.
    pub offset: [f64; 2],
}

impl Default for UvTransform {
    fn default() -> UvTransform {
        UvTransform { scale: [1.0, 1.0], rotate: 0.0, offset: [0.0, 0.0] }
    }
}

/// Two colours in fields of half a unit of the texture coordinates: `color0` where both fields, counted along u and v, are even or both odd.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Checkerboard {
    /// The one.
    pub color0: ColourInput,
    /// The other.
    pub color1: ColourInput,
    /// Applied to the texture coordinates before the look-up.
    #[serde(default, skip_serializing_if = "is_default")]
    pub uv: UvTransform,
}

/// Colours of the vertices, linear Rec.709.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VertexColour {
    /// Factor on them, each channel ≥ 0.
    #[serde(default = "Colour::white", skip_serializing_if = "Colour::is_white")]
    pub scale: Colour,
}

/// The product of two inputs, channel by channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Product {
    /// The one.
    pub first: ColourInput,
    /// The other.
    pub second: ColourInput,
}

/// (1 − amount) · first + amount · second.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mix {
    /// Where `amount` is 0.
    pub first: ColourInput,
    /// Where `amount` is 1.
    pub second: ColourInput,
    /// In [0, 1].
    pub amount: ScalarInput,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

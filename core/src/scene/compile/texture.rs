//! Textures, and the inputs that name them.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::spectrum;
use crate::scene::assets::Assets;
use crate::scene::description::{self, Channels, Encoding, SceneDescription, TextureFilter, UvTransform};
use crate::scene::error::Error;
use crate::scene::image;
use crate::texture::{Bitmap, Checkerboard, ColourInput, Pixels, ScalarInput, Texture, Wrap, decoding};

/// Textures by name.
pub(super) type Textures = BTreeMap<String, Arc<Texture>>;

/// Image files, read once each however often they are used.
pub(super) type Images = BTreeMap<String, Arc<Pixels>>;

/// Compiles every texture; those that others are made of come first.
pub(super) fn compile(description: &SceneDescription, assets: &dyn Assets, images: &mut Images) -> Result<Textures, Error> {
    let mut textures = Textures::new();
    // The check of the description has ruled out circles, so each round finishes at least one more.
    while textures.len() < description.textures.len() {
        for (name, texture) in &description.textures {
            if !textures.contains_key(name) && texture.parts().iter().all(|part| textures.contains_key(*part)) {
                let compiled = one(texture, &textures, images, assets)?;
                textures.insert(name.clone(), Arc::new(compiled));
            }
        }
    }
    Ok(textures)
}

fn one(texture: &description::Texture, textures: &Textures, images: &mut Images, assets: &dyn Assets) -> Result<Texture, Error> {
    Ok(match texture {
        description::Texture::Bitmap(bitmap) => {
            let pixels = match images.get(&bitmap.file) {
                Some(pixels) => pixels.clone(),
                None => {
                    let pixels = Arc::new(image::read(&assets.open(&bitmap.file)?, &bitmap.file)?);
                    images.insert(bitmap.file.clone(), pixels.clone());
                    pixels
                }
            };
            let channel = match bitmap.channels {
                Channels::Rgb => None,
                Channels::R => Some(0),
                Channels::G => Some(1),
                Channels::B => Some(2),
                Channels::A => Some(3),
            };
            let srgb = match bitmap.encoding {
                Encoding::Srgb => true,
                Encoding::Linear => false,
                Encoding::Auto => channel.is_none(),
            };
            Texture::Bitmap(Bitmap {
                pixels,
                decode: decoding(srgb),
                channel,
                bilinear: bitmap.filter == TextureFilter::Bilinear,
                wrap: match bitmap.wrap {
                    description::Wrap::Repeat => Wrap::Repeat,
                    description::Wrap::Clamp => Wrap::Clamp,
                    description::Wrap::Mirror => Wrap::Mirror,
                },
                uv: affine(&bitmap.uv),
                scale: spectrum(bitmap.scale),
            })
        }
        description::Texture::Checkerboard(checkerboard) => Texture::Checkerboard(Checkerboard {
            even: colour(&checkerboard.color0, textures),
            odd: colour(&checkerboard.color1, textures),
            uv: affine(&checkerboard.uv),
        }),
        description::Texture::VertexColour(colours) => Texture::VertexColour(spectrum(colours.scale)),
        description::Texture::Product(product) => Texture::Product(colour(&product.first, textures), colour(&product.second, textures)),
        description::Texture::Mix(mix) => {
            Texture::Mix(colour(&mix.first, textures), colour(&mix.second, textures), scalar(&mix.amount, textures))
        }
    })
}

/// Rows of (u, v, 1) → offset + R(rotate) · (scale ⊙ uv).
fn affine(uv: &UvTransform) -> [[f32; 3]; 2] {
    let (sin, cos) = libm::sincos(uv.rotate.to_radians());
    let [s, t] = uv.scale;
    [[cos * s, -sin * t, uv.offset[0]], [sin * s, cos * t, uv.offset[1]]].map(|row| row.map(|x| x as f32))
}

/// An input with its texture, whose name the check of the description has found.
pub(super) fn colour(input: &description::ColourInput, textures: &Textures) -> ColourInput {
    match input {
        description::Input::Constant(constant) => ColourInput::Constant(spectrum(*constant)),
        description::Input::Texture(name) => ColourInput::Texture(textures[name].clone()),
    }
}

/// The same for a number.
pub(super) fn scalar(input: &description::ScalarInput, textures: &Textures) -> ScalarInput {
    match input {
        description::Input::Constant(constant) => ScalarInput::Constant(*constant as f32),
        description::Input::Texture(name) => ScalarInput::Texture(textures[name].clone()),
    }
}

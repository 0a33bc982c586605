//! Textures, and the inputs that name them.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{spectrum, unsupported};
use crate::scene::assets::Assets;
use crate::scene::description::{self, SceneDescription, UvTransform};
use crate::scene::error::Error;
use crate::texture::{Checkerboard, ColourInput, ScalarInput, Texture};

/// Textures by name.
pub(super) type Textures = BTreeMap<String, Arc<Texture>>;

/// Compiles every texture; those that others are made of come first.
pub(super) fn compile(description: &SceneDescription, _assets: &dyn Assets) -> Result<Textures, Error> {
    let mut textures = Textures::new();
    // The check of the description has ruled out circles, so each round finishes at least one more.
    while textures.len() < description.textures.len() {
        for (name, texture) in &description.textures {
            if !textures.contains_key(name) && texture.parts().iter().all(|part| textures.contains_key(*part)) {
                let compiled = one(texture, &format!("textures.{name}"), &textures)?;
                textures.insert(name.clone(), Arc::new(compiled));
            }
        }
    }
    Ok(textures)
}

fn one(texture: &description::Texture, path: &str, textures: &Textures) -> Result<Texture, Error> {
    match texture {
        description::Texture::Checkerboard(checkerboard) => Ok(Texture::Checkerboard(Checkerboard {
            even: colour(&checkerboard.color0, textures),
            odd: colour(&checkerboard.color1, textures),
            uv: affine(&checkerboard.uv),
        })),
        _ => Err(unsupported(path, "this kind of texture")),
    }
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

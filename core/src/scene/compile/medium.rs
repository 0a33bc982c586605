//! Media, and the shapes that bound them or let light pass.

use super::spectrum;
use super::texture::{self, Textures};
use crate::medium::{Homogeneous, Medium, MediumId, Phase};
use crate::scene::Boundary;
use crate::scene::description::{self, Material, SceneDescription};
use crate::texture::ScalarInput;

/// Every medium, in the order of their names.
pub(super) fn compile(description: &SceneDescription) -> Vec<Medium> {
    let one = |medium: &description::Medium| {
        let description::Medium::Homogeneous(medium) = medium;
        Medium::Homogeneous(Homogeneous {
            extinction: spectrum(medium.extinction),
            albedo: spectrum(medium.albedo),
            phase: Phase { mean_cosine: medium.phase.mean_cosine() as f32 },
        })
    };
    description.media.values().map(one).collect()
}

/// The number of a medium, which the check of the description has found; vacuum where none is named.
pub(super) fn id(description: &SceneDescription, name: Option<&String>) -> MediumId {
    let place = name.and_then(|name| description.media.keys().position(|known| known == name));
    place.map_or(MediumId::VACUUM, |place| MediumId(place as u32))
}

/// What a shape is to light that passes it; `None` for plain surfaces.
pub(super) fn boundary(description: &SceneDescription, shape: &description::Shape, textures: &Textures) -> Option<Boundary> {
    let opacity = match shape.material.as_ref().and_then(|name| description.materials.get(name)) {
        Some(Material::Mask(mask)) => texture::scalar(&mask.opacity, textures),
        Some(Material::Null) => ScalarInput::Constant(0.0),
        _ => ScalarInput::Constant(1.0),
    };
    let bounds = shape.interior.is_some() || shape.exterior.is_some();
    let media = bounds.then(|| [id(description, shape.exterior.as_ref()), id(description, shape.interior.as_ref())]);
    (bounds || opacity != ScalarInput::Constant(1.0)).then_some(Boundary { opacity, media })
}

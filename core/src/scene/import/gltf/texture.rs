//! Images and the textures made of them.

use std::collections::BTreeMap;

use super::super::naming::Naming;
use super::document::{Image, TextureInfo};
use super::{Importer, Source, container, titled};
use crate::scene::assets::MadeAssets;
use crate::scene::description::{Bitmap, Channels, Colour, Encoding, Texture, TextureFilter, UvTransform, Wrap};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;

/// The textures and image files made so far.
#[derive(Default)]
pub(super) struct Textures {
    pub(super) described: BTreeMap<String, Texture>,
    pub(super) made: MadeAssets,
    /// Files of images by their index; `None` for images of a kind that cannot be read.
    files: BTreeMap<usize, Option<String>>,
    known: BTreeMap<String, String>,
    names: Naming,
    file_names: Naming,
    bytes: u64,
}

impl Importer {
    /// The texture of a material's slot, as a new name in the description; `None`, with a remark, where its image cannot be used.
    /// `place` is the slot for people, `uv_set` the set of coordinates that the mesh will carry.
    ///
    /// # Errors
    /// Indices that point to nothing, and images that cannot be read or lie outside the folder.
    pub(super) fn texture(
        &mut self,
        source: &Source<'_>,
        info: &TextureInfo,
        use_: Use,
        uv_set: usize,
        place: &str,
    ) -> Result<Option<String>, Error> {
        let path = format!("textures[{}]", info.index);
        let texture = source.get(&source.document.textures, info.index, place, "textures")?;
        for name in texture.extensions.others.keys() {
            self.note(format!("{path}: {name} is left out"));
        }
        let Some(image) = texture.source else {
            self.note(format!("{place}: left out, its texture has no PNG or JPEG image"));
            return Ok(None);
        };
        let sampler = match texture.sampler {
            Some(sampler) => Some(source.get(&source.document.samplers, sampler, &path, "samplers")?),
            None => None,
        };
        let Some(file) = self.image(source, image, &path)? else { return Ok(None) };
        if info.extensions.transform.as_ref().and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord) != uv_set {
            self.note(format!("{place}: looked up with TEXCOORD_{uv_set}, since a mesh here has one set of texture coordinates"));
        }
        for name in info.extensions.others.keys() {
            self.note(format!("{place}: {name} is left out"));
        }
        let (wrap_s, wrap_t) = sampler.map_or((None, None), |sampler| (sampler.wrap_s, sampler.wrap_t));
        if wrap_s.unwrap_or(10497) != wrap_t.unwrap_or(10497) {
            self.note(format!("{place}: wrapped along v as along u"));
        }
        let bitmap = Bitmap {
            file,
            encoding: use_.encoding,
            channels: use_.channels,
            filter: if sampler.and_then(|s| s.mag_filter) == Some(9728) { TextureFilter::Nearest } else { TextureFilter::Bilinear },
            wrap: match wrap_s {
                Some(33071) => Wrap::Clamp,
                Some(33648) => Wrap::Mirror,
                _ => Wrap::Repeat,
            },
            uv: info.extensions.transform.as_ref().map_or_else(UvTransform::default, |transform| {
                upright(transform.offset.unwrap_or([0.0; 2]), transform.rotation, transform.scale.unwrap_or([1.0; 2]))
            }),
            scale: use_.scale,
        };
        Ok(Some(self.describe(Texture::Bitmap(bitmap), place)))
    }

    /// Puts a texture into the description, or finds an equal one there. Returns its name.
    pub(super) fn describe(&mut self, texture: Texture, place: &str) -> String {
        // As text, since textures hold numbers, which have no order.
        let key = serde_json::to_string(&texture).unwrap_or_default();
        if let Some(name) = self.textures.known.get(&key) {
            return name.clone();
        }
        let name = self.textures.names.fresh(place, "texture");
        self.textures.known.insert(key, name.clone());
        self.textures.described.insert(name.clone(), texture);
        name
    }

    /// The file of an image.
    fn image(&mut self, source: &Source<'_>, index: usize, path: &str) -> Result<Option<String>, Error> {
        if let Some(known) = self.textures.files.get(&index) {
            return Ok(known.clone());
        }
        let image = source.get(&source.document.images, index, path, "images")?;
        let file = self.image_file(source, image, index)?;
        self.textures.files.insert(index, file.clone());
        Ok(file)
    }

    fn image_file(&mut self, source: &Source<'_>, image: &Image, index: usize) -> Result<Option<String>, Error> {
        let path = format!("images[{index}]");
        let place = titled("images", index, &image.name);
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                match container::data(uri).map_err(|found| source.fault(ErrorKind::Malformed, &path, found, "data:…;base64,…"))? {
                    Some(bytes) => bytes,
                    None => {
                        let file = container::file_name(uri);
                        crate::scene::assets::check_name(&file).map_err(|expected| {
                            source.fault(ErrorKind::OutsideFolder, &format!("{path}.uri"), format!("{file:?}"), expected)
                        })?;
                        let extension = file.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
                        if ["png", "jpg", "jpeg"].contains(&extension.as_str()) {
                            return Ok(Some(file));
                        }
                        self.note(format!("{place}: left out, {file:?} is no PNG or JPEG file"));
                        return Ok(None);
                    }
                }
            }
            (None, Some(view)) => {
                let length = source.get(&source.document.buffer_views, view, &path, "bufferViews")?.byte_length;
                source.view(view, 0, length, 1, &path)?.to_vec()
            }
            (None, None) => return Err(source.fault(ErrorKind::Malformed, &path, "no uri and no bufferView", "one of them")),
        };
        let extension = match &bytes[..] {
            [0x89, b'P', b'N', b'G', ..] => "png",
            [0xff, 0xd8, ..] => "jpg",
            _ => {
                self.note(format!("{place}: left out, its bytes are no PNG or JPEG image"));
                return Ok(None);
            }
        };
        self.textures.bytes = self.textures.bytes.saturating_add(bytes.len() as u64);
        if self.textures.bytes > limits::MADE_BYTES {
            let expected = format!("at most {} bytes of images", limits::MADE_BYTES);
            return Err(source.fault(ErrorKind::TooLarge, &path, "images that add up to more", expected));
        }
        let name = format!("textures/{}.{extension}", self.textures.file_names.fresh(&image.name, "image"));
        self.textures.made.insert(name.clone(), bytes);
        Ok(Some(name))
    }
}

/// What a slot of a material makes of its image.
#[derive(Clone, Copy)]
pub(super) struct Use {
    encoding: Encoding,
    channels: Channels,
    scale: Colour,
}

impl Use {
    /// A colour, multiplied by a factor.
    pub(super) fn colour(scale: [f64; 3]) -> Use {
        Use { encoding: Encoding::Srgb, channels: Channels::Rgb, scale: Colour(scale) }
    }

    /// One channel as a number, multiplied by a factor.
    pub(super) fn number(channels: Channels, factor: f64) -> Use {
        Use { encoding: Encoding::Linear, channels, scale: Colour::grey(factor) }
    }

    /// Three plain numbers.
    pub(super) fn vectors() -> Use {
        Use { encoding: Encoding::Linear, channels: Channels::Rgb, scale: Colour::WHITE }
    }
}

/// KHR_texture_transform, which counts v downwards, for coordinates that count it upwards.
///
/// There u′ = o + R(−θ)·(s ⊙ u) with R counter-clockwise as matrices go; with v ↦ 1 − v on both sides the turn changes its sense and the
/// offset takes up what the flip moves.
fn upright([offset_u, offset_v]: [f64; 2], rotation: f64, [scale_u, scale_v]: [f64; 2]) -> UvTransform {
    let (sin, cos) = libm::sincos(rotation);
    UvTransform {
        scale: [scale_u, scale_v],
        rotate: rotation.to_degrees(),
        offset: [offset_u + sin * scale_v, 1.0 - offset_v - cos * scale_v],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_of_texture_coordinates_survive_the_flip() {
        let (offset, rotation, scale) = ([0.2, -0.3], 0.7, [2.0, 0.5]);
        let found = upright(offset, rotation, scale);
        let (sin, cos) = libm::sincos(rotation);
        let (sin_found, cos_found) = libm::sincos(found.rotate.to_radians());
        for [u, v] in [[0.0, 0.0], [1.0, 0.0], [0.25, 0.75]] {
            let (su, sv) = (scale[0] * u, scale[1] * v);
            let there = [offset[0] + cos * su + sin * sv, offset[1] - sin * su + cos * sv];
            let (tu, tv) = (found.scale[0] * u, found.scale[1] * (1.0 - v));
            let here = [found.offset[0] + cos_found * tu - sin_found * tv, found.offset[1] + sin_found * tu + cos_found * tv];
            assert!((here[0] - there[0]).abs() < 1e-12 && (1.0 - here[1] - there[1]).abs() < 1e-12, "{here:?} for {there:?}");
        }
    }
}

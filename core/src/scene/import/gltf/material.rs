//! Materials: metallic-roughness and its extensions onto the principled material, with normal maps and masks around it.

use std::collections::BTreeMap;

use super::super::naming::Naming;
use super::document::{Material as Written, TextureInfo};
use super::extension::{Clearcoat, Sheen, Specular, SpecularGlossiness};
use super::texture::Use;
use super::{Importer, Source, titled};
use crate::scene::description::{
    Channels, Colour, ColourInput, Diffuse, Emission, Input, Mask, Material, NormalMap, Principled, Product, ScalarInput, Texture,
    VertexColour,
};
use crate::scene::error::{Error, ErrorKind};

/// A primitive's material as its shapes carry it.
#[derive(Clone)]
pub(super) struct Surface {
    /// Name of the material.
    pub(super) material: String,
    /// The light it gives off.
    pub(super) emission: Option<Emission>,
    /// The set of texture coordinates that its textures want.
    pub(super) uv_set: usize,
}

/// The materials made so far.
#[derive(Default)]
pub(super) struct Materials {
    pub(super) described: BTreeMap<String, Material>,
    /// By index, and whether the mesh has colours.
    known: BTreeMap<(Option<usize>, bool), Surface>,
    names: Naming,
}

/// One material while it is made.
struct Making<'a> {
    source: &'a Source<'a>,
    written: &'a Written,
    place: String,
    uv_set: usize,
    coloured: bool,
}

impl Importer {
    /// The material of a primitive, `None` being the default one; `coloured` where its vertices have colours.
    ///
    /// # Errors
    /// Indices that point to nothing, images that cannot be read.
    pub(super) fn surface(&mut self, source: &Source<'_>, index: Option<usize>, coloured: bool, path: &str) -> Result<Surface, Error> {
        if let Some(known) = self.materials.known.get(&(index, coloured)) {
            return Ok(known.clone());
        }
        let plain = Written::default();
        let (written, place) = match index {
            Some(index) => {
                let written = source.get(&source.document.materials, index, path, "materials")?;
                (written, titled("materials", index, &written.name))
            }
            None => (&plain, "default material".to_string()),
        };
        let making = Making { source, written, place, uv_set: uv_set(written), coloured };
        let surface = self.make(&making)?;
        self.materials.known.insert((index, coloured), surface.clone());
        Ok(surface)
    }

    fn make(&mut self, making: &Making<'_>) -> Result<Surface, Error> {
        let Making { source, written, place, uv_set, .. } = making;
        let extensions = &written.extensions;
        for name in extensions.others.keys() {
            self.note(format!("{place}: {name} is left out"));
        }
        let (factor, base_texture) = match &extensions.specular_glossiness {
            Some(old) => (old.diffuse_factor, &old.diffuse_texture),
            None => (written.pbr_metallic_roughness.base_color_factor, &written.pbr_metallic_roughness.base_color_texture),
        };
        let [r, g, b, alpha] = factor.unwrap_or([1.0; 4]).map(|channel| channel.clamp(0.0, 1.0));
        let tint = self.absorption(making);
        let base = [r * tint[0], g * tint[1], b * tint[2]];
        let mut base_color = self.colour(making, base_texture.as_ref(), base, "base color")?;
        if making.coloured {
            base_color = Input::Texture(self.times_vertex_colour(base_color));
        }
        if extensions.unlit.is_some() {
            self.note(format!("{place}: unlit, so its base colour shines with radiance of that value"));
            let material = self.add("unlit", Material::Diffuse(Diffuse { reflectance: ColourInput::black(), two_sided: true }));
            let emission = Some(Emission { radiance: base_color, two_sided: true });
            return Ok(Surface { material, emission, uv_set: *uv_set });
        }
        let principled = match &extensions.specular_glossiness {
            Some(old) => self.specular_glossiness(making, old, base_color)?,
            None => self.metallic_roughness(making, base_color)?,
        };
        let outer = if written.name.is_empty() { "material".to_string() } else { written.name.clone() };
        let mut name = self.add(&outer, Material::Principled(principled));
        if let Some(info) = &written.normal_texture {
            let slot = format!("{place} normals");
            if let Some(normals) = self.texture(source, info, Use::vectors(), *uv_set, &slot)? {
                let map = NormalMap { material: name, normals: Input::Texture(normals), scale: info.scale.unwrap_or(1.0) };
                name = self.add(&format!("{outer} with normals"), Material::NormalMap(map));
            }
        }
        let emission = self.emission(making)?;
        let opacity = self.opacity(making, alpha, base_texture.as_ref())?;
        if emission.is_some() && opacity.is_some() {
            self.note(format!("{place}: its holes are left out, since what gives off light has none here"));
        } else if let Some(opacity) = opacity {
            name = self.add(&format!("{outer} with holes"), Material::Mask(Mask { material: name, opacity }));
        }
        Ok(Surface { material: name, emission, uv_set: *uv_set })
    }

    /// Puts a material into the description, or finds an equal one there. Returns its name.
    fn add(&mut self, name: &str, material: Material) -> String {
        if self.materials.described.get(name) == Some(&material) {
            return name.to_string();
        }
        let name = self.materials.names.fresh(name, "material");
        self.materials.described.insert(name.clone(), material);
        name
    }

    fn metallic_roughness(&mut self, making: &Making<'_>, base_color: ColourInput) -> Result<Principled, Error> {
        let Making { written, place, .. } = making;
        let pbr = &written.pbr_metallic_roughness;
        let extensions = &written.extensions;
        let texture = pbr.metallic_roughness_texture.as_ref();
        let metallic = self.number(making, texture, Channels::B, pbr.metallic_factor.unwrap_or(1.0), "metallic")?;
        let roughness = self.number(making, texture, Channels::G, pbr.roughness_factor.unwrap_or(1.0), "roughness")?;
        let mut principled = Principled { base_color, metallic, roughness, two_sided: written.double_sided, ..Principled::default() };
        if let Some(ior) = extensions.ior.as_ref().and_then(|ior| ior.ior) {
            if ior < 1.0 {
                self.note(format!("{place}: an ior of {ior} counts as 1"));
            }
            principled.ior = ior.max(1.0);
        }
        if let Some(Specular { specular_factor, specular_texture, specular_color_factor, specular_color_texture }) = &extensions.specular {
            principled.specular =
                self.number(making, specular_texture.as_ref(), Channels::A, specular_factor.unwrap_or(1.0), "specular")?;
            let tint = specular_color_factor.unwrap_or([1.0; 3]).map(|channel| channel.max(0.0));
            principled.specular_color = self.colour(making, specular_color_texture.as_ref(), tint, "specular color")?;
        }
        if let Some(transmission) = &extensions.transmission {
            let factor = transmission.transmission_factor;
            principled.transmission =
                self.number(making, transmission.transmission_texture.as_ref(), Channels::R, factor, "transmission")?;
            principled.thin = extensions.volume.as_ref().is_none_or(|volume| volume.thickness_factor <= 0.0);
        }
        if let Some(coat) = &extensions.clearcoat {
            self.clearcoat(making, coat, &mut principled)?;
        }
        if let Some(Sheen { sheen_color_factor, sheen_color_texture, sheen_roughness_factor, sheen_roughness_texture }) = &extensions.sheen
        {
            let colour = sheen_color_factor.map(|channel| channel.clamp(0.0, 1.0));
            principled.sheen_color = self.colour(making, sheen_color_texture.as_ref(), colour, "sheen color")?;
            let roughness = sheen_roughness_texture.as_ref();
            principled.sheen_roughness = self.number(making, roughness, Channels::A, *sheen_roughness_factor, "sheen roughness")?;
        }
        if let Some(anisotropy) = &extensions.anisotropy {
            principled.anisotropy = Input::Constant(anisotropy.anisotropy_strength.clamp(0.0, 1.0));
            if anisotropy.anisotropy_rotation != 0.0 || anisotropy.anisotropy_texture.is_some() {
                self.note(format!("{place}: its anisotropy lies along u, turns and textures of it are left out"));
            }
        }
        if extensions.dispersion.is_some() {
            self.note(format!("{place}: its dispersion is left out"));
        }
        if written.occlusion_texture.is_some() {
            self.note(format!("{place}: its occlusion texture is left out, shadows are computed"));
        }
        Ok(principled)
    }

    fn clearcoat(&mut self, making: &Making<'_>, coat: &Clearcoat, principled: &mut Principled) -> Result<(), Error> {
        let (strength, roughness) = (coat.clearcoat_texture.as_ref(), coat.clearcoat_roughness_texture.as_ref());
        principled.clearcoat = self.number(making, strength, Channels::R, coat.clearcoat_factor, "clearcoat")?;
        principled.clearcoat_roughness =
            self.number(making, roughness, Channels::G, coat.clearcoat_roughness_factor, "clearcoat roughness")?;
        if coat.clearcoat_normal_texture.is_some() {
            self.note(format!("{}: the normals of its clear coat are left out", making.place));
        }
        Ok(())
    }

    /// Diffuse and specular colour: the reflectance at normal incidence is the specular colour itself.
    fn specular_glossiness(&mut self, making: &Making<'_>, old: &SpecularGlossiness, base_color: ColourInput) -> Result<Principled, Error> {
        /// Reflectance at normal incidence of a dielectric of index 1.5, which `specular_color` scales.
        const GLASS: f64 = 0.04;
        let glossiness = old.glossiness_factor.unwrap_or(1.0).clamp(0.0, 1.0);
        if old.specular_glossiness_texture.is_some() {
            self.note(format!("{}: its glossiness is {glossiness} everywhere, the alpha of its texture is left out", making.place));
        }
        let tint = old.specular_factor.unwrap_or([1.0; 3]).map(|channel| channel.clamp(0.0, 1.0) / GLASS);
        Ok(Principled {
            base_color,
            specular_color: self.colour(making, old.specular_glossiness_texture.as_ref(), tint, "specular color")?,
            roughness: Input::Constant(1.0 - glossiness),
            two_sided: making.written.double_sided,
            ..Principled::default()
        })
    }

    /// What the volume behind a transmitting surface takes from the light, put half on each of the two surfaces that light crosses.
    fn absorption(&mut self, making: &Making<'_>) -> [f64; 3] {
        let Some(volume) = making.written.extensions.volume.as_ref().filter(|volume| volume.thickness_factor > 0.0) else {
            return [1.0; 3];
        };
        let distance = volume.attenuation_distance.filter(|distance| *distance > 0.0 && distance.is_finite());
        let (Some(distance), Some(colour)) = (distance, volume.attenuation_color) else { return [1.0; 3] };
        self.note(format!("{}: what its volume absorbs is put on its surface, as over its thickness", making.place));
        colour.map(|channel| libm::pow(channel.clamp(0.0, 1.0), 0.5 * volume.thickness_factor / distance))
    }

    fn emission(&mut self, making: &Making<'_>) -> Result<Option<Emission>, Error> {
        let written = making.written;
        let strength = written.extensions.emissive_strength.as_ref().and_then(|strength| strength.emissive_strength).unwrap_or(1.0);
        let factor = written.emissive_factor.unwrap_or([0.0; 3]).map(|channel| (channel * strength).max(0.0));
        if factor == [0.0; 3] {
            return Ok(None);
        }
        let radiance = self.colour(making, written.emissive_texture.as_ref(), factor, "emission")?;
        Ok(Some(Emission { radiance, two_sided: written.double_sided }))
    }

    /// The opacity of a material that is not opaque everywhere.
    fn opacity(&mut self, making: &Making<'_>, alpha: f64, texture: Option<&TextureInfo>) -> Result<Option<ScalarInput>, Error> {
        let written = making.written;
        let cutoff = match written.alpha_mode.as_deref() {
            None | Some("OPAQUE") => return Ok(None),
            Some("BLEND") => None,
            Some("MASK") => Some(written.alpha_cutoff.unwrap_or(0.5)),
            Some(other) => {
                let expected = "OPAQUE, MASK or BLEND";
                return Err(making.source.fault(ErrorKind::Malformed, &making.place, format!("alphaMode {other:?}"), expected));
            }
        };
        let opacity = self.number(making, texture, Channels::A, alpha, "opacity")?;
        Ok(match (opacity, cutoff) {
            (Input::Constant(opacity), Some(cutoff)) if opacity >= cutoff => None,
            (Input::Constant(_), Some(_)) => Some(ScalarInput::zero()),
            (Input::Constant(1.0), None) => None,
            (opacity, Some(cutoff)) => {
                self.note(format!("{}: its edges are soft, alpha is its opacity and not cut at {cutoff}", making.place));
                Some(opacity)
            }
            (opacity, None) => Some(opacity),
        })
    }

    /// A coloured input: a factor, or a texture times a factor.
    fn colour(&mut self, making: &Making<'_>, info: Option<&TextureInfo>, factor: [f64; 3], slot: &str) -> Result<ColourInput, Error> {
        let Some(info) = info.filter(|_| factor != [0.0; 3]) else { return Ok(Input::Constant(Colour(factor))) };
        let slot = format!("{} {slot}", making.place);
        let texture = self.texture(making.source, info, Use::colour(factor), making.uv_set, &slot)?;
        Ok(texture.map_or(Input::Constant(Colour(factor)), Input::Texture))
    }

    /// A numeric input in [0, 1].
    fn number(
        &mut self,
        making: &Making<'_>,
        info: Option<&TextureInfo>,
        channels: Channels,
        factor: f64,
        slot: &str,
    ) -> Result<ScalarInput, Error> {
        let held = factor.clamp(0.0, 1.0);
        if held != factor {
            self.note(format!("{}: a factor of {factor} for {slot} counts as {held}", making.place));
        }
        let Some(info) = info.filter(|_| held != 0.0) else { return Ok(Input::Constant(held)) };
        let slot = format!("{} {slot}", making.place);
        let texture = self.texture(making.source, info, Use::number(channels, held), making.uv_set, &slot)?;
        Ok(texture.map_or(Input::Constant(held), Input::Texture))
    }

    fn times_vertex_colour(&mut self, colour: ColourInput) -> String {
        let scale = colour.constant().copied().unwrap_or(Colour::WHITE);
        let vertices = self.describe(Texture::VertexColour(VertexColour { scale }), "vertex colours");
        match colour {
            Input::Constant(_) => vertices,
            first => self.describe(Texture::Product(Product { first, second: Input::Texture(vertices) }), "base colour of vertices"),
        }
    }
}

/// The set of texture coordinates that the base colour, else the first other texture, is looked up with.
fn uv_set(written: &Written) -> usize {
    let pbr = &written.pbr_metallic_roughness;
    let old = written.extensions.specular_glossiness.as_ref();
    let slots = [
        pbr.base_color_texture.as_ref(),
        old.and_then(|old| old.diffuse_texture.as_ref()),
        pbr.metallic_roughness_texture.as_ref(),
        written.normal_texture.as_ref(),
        written.emissive_texture.as_ref(),
    ];
    let set = |info: &TextureInfo| info.extensions.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
    slots.into_iter().flatten().next().map_or(0, set)
}

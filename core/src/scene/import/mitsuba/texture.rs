//! Textures, and the inputs of materials and lights that are either a constant or a texture.
//!
//! Mitsuba looks an image up with v = 0 at its top row, the description with v = 1 there; Mitsuba turns the v of OBJ files round when it reads
//! them, others not. Textures are therefore written for shapes of OBJ files, and `mirror` makes the variants that other shapes need.

use super::super::xml::Element;
use super::context::Context;
use super::transform::Uv;
use super::values::Meaning;
use crate::scene::description::{
    Bitmap, Channels, Checkerboard, Colour, ColourInput, Encoding, Input, Product, ScalarInput, Texture, TextureFilter, UvTransform,
    VertexColour, Wrap,
};
use crate::scene::error::{Error, ErrorKind};

const KNOWN: &str = "bitmap, checkerboard, mesh_attribute, vertexcolors, scale, or a spectrum";

impl<'a> Context<'a> {
    /// A parameter that is a colour or a texture.
    pub(super) fn input(&mut self, element: &'a Element, name: &str, meaning: Meaning) -> Result<Option<ColourInput>, Error> {
        match self.parameter(element, name)? {
            Some(parameter) => self.input_of(parameter, meaning).map(Some),
            None => Ok(None),
        }
    }

    /// A parameter that is a number or a texture.
    pub(super) fn scalar(&mut self, element: &'a Element, name: &str) -> Result<Option<ScalarInput>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        if self.is(parameter, "texture") {
            return self.scalar_of(parameter).map(Some);
        }
        let Colour([r, g, b]) = self.colour_of(parameter, Meaning::Reflectance)?;
        Ok(Some(Input::Constant(if r == g && g == b { r } else { (r + g + b) / 3.0 })))
    }

    /// The texture that an element is or refers to, as a number.
    pub(super) fn scalar_of(&mut self, element: &'a Element) -> Result<ScalarInput, Error> {
        Ok(match self.input_of(element, Meaning::Number)? {
            Input::Texture(name) => Input::Texture(name),
            Input::Constant(Colour([r, g, b])) => Input::Constant((r + g + b) / 3.0),
        })
    }

    /// The colour or texture that an element is or refers to.
    pub(super) fn input_of(&mut self, element: &'a Element, meaning: Meaning) -> Result<ColourInput, Error> {
        if !self.is(element, "texture") {
            return self.colour_of(element, meaning).map(Input::Constant);
        }
        let texture = self.resolved(element, "texture")?;
        if Context::is_spectrum(texture) {
            return self.colour_of(texture, meaning).map(Input::Constant);
        }
        self.texture(texture, meaning).map(Input::Texture)
    }

    /// Reads a texture once, and gives its name.
    fn texture(&mut self, element: &'a Element, meaning: Meaning) -> Result<String, Error> {
        let name = self.name(element)?;
        if self.textures.contains_key(&name) {
            return Ok(name);
        }
        let texture = self.inside(element, &name, |context| match context.kind(element)? {
            "bitmap" => context.bitmap(element),
            "checkerboard" => context.checkerboard(element, meaning),
            "mesh_attribute" => context.attribute(element),
            "vertexcolors" => Ok(Texture::VertexColour(VertexColour { scale: Colour::WHITE })),
            "scale" => context.scaled(element, meaning),
            _ => Err(context.unsupported(element, KNOWN)),
        })?;
        self.finish(element, "what the kind of texture needs")?;
        self.textures.insert(name.clone(), texture);
        self.origins.insert(format!("textures.{name}"), element);
        Ok(name)
    }

    fn bitmap(&mut self, element: &'a Element) -> Result<Texture, Error> {
        let file = self.word(element, "filename")?;
        let file = file.ok_or_else(|| element.fault(ErrorKind::Unsupported, "no filename", "<string name=\"filename\" value=\"…\"/>"))?;
        let file = self.file_name(element, file)?;
        let encoding = self.encoding(element, &file)?;
        let filter = match self.word(element, "filter_type")? {
            None | Some("bilinear") => TextureFilter::Bilinear,
            Some("nearest") => TextureFilter::Nearest,
            Some(other @ ("ewa" | "trilinear")) => {
                self.note(element, format!("filter {other}: bilinear is used, each pixel takes many samples"));
                TextureFilter::Bilinear
            }
            Some(other) => return Err(element.fault(ErrorKind::Unsupported, format!("filter_type {other:?}"), "bilinear or nearest")),
        };
        let mut wraps = [self.word(element, "wrap_mode")?, self.word(element, "wrap_mode_u")?, self.word(element, "wrap_mode_v")?];
        if let (Some(first), Some(second)) = (wraps[1], wraps[2])
            && first != second
        {
            self.note(element, format!("another wrap mode along v: {first} is used along both"));
        }
        let wrap = match wraps.iter_mut().find_map(Option::take) {
            None | Some("repeat") => Wrap::Repeat,
            Some("clamp") => Wrap::Clamp,
            Some("mirror") => Wrap::Mirror,
            Some(other) => return Err(element.fault(ErrorKind::Unsupported, format!("wrap mode {other:?}"), "repeat, clamp or mirror")),
        };
        let channels = match self.word(element, "channel")?.map(str::to_ascii_lowercase).as_deref() {
            None => Channels::Rgb,
            Some("r") => Channels::R,
            Some("g") => Channels::G,
            Some("b") => Channels::B,
            Some("a") => Channels::A,
            Some(other) => return Err(element.fault(ErrorKind::Unsupported, format!("channel {other:?}"), "r, g, b or a")),
        };
        let why = "says how Mitsuba stores the image";
        self.leave(element, &["max_anisotropy", "cache", "format", "accel"], why)?;
        let uv = self.to_uv(element)?;
        let uv = self.described_uv(element, Uv::UPSIDE_DOWN.then(&uv).then(&Uv::UPSIDE_DOWN))?;
        Ok(Texture::Bitmap(Bitmap { file, encoding, channels, filter, wrap, uv, scale: Colour::WHITE }))
    }

    /// How the image's numbers become light: `raw` of Mitsuba 3, `gamma` of 0.x, where −1 leaves it to the file. Both take whatever is
    /// stored in 8 or 16 bits through sRGB's curve unless told otherwise, also where it is no colour.
    fn encoding(&mut self, element: &'a Element, file: &str) -> Result<Encoding, Error> {
        let gamma = if self.old { self.number(element, "gamma")? } else { None };
        let extension = file.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        let is_light = ["exr", "hdr", "rgbe", "pfm"].contains(&extension.as_str());
        Ok(match (self.boolean(element, "raw")?, gamma) {
            (Some(true), _) => Encoding::Linear,
            (_, Some(1.0)) => Encoding::Linear,
            (_, Some(gamma)) if gamma > 0.0 => {
                self.note(element, format!("gamma {gamma}: sRGB's curve is used"));
                Encoding::Srgb
            }
            _ if is_light => Encoding::Linear,
            _ => Encoding::Srgb,
        })
    }

    fn checkerboard(&mut self, element: &'a Element, meaning: Meaning) -> Result<Texture, Error> {
        let color0 = self.input(element, "color0", meaning)?.unwrap_or(ColourInput::grey(0.4));
        let color1 = self.input(element, "color1", meaning)?.unwrap_or(ColourInput::grey(0.2));
        let uv = self.to_uv(element)?;
        let uv = self.described_uv(element, Uv::UPSIDE_DOWN.then(&uv))?;
        Ok(Texture::Checkerboard(Checkerboard { color0, color1, uv }))
    }

    fn attribute(&mut self, element: &'a Element) -> Result<Texture, Error> {
        let name = self.word(element, "name")?.unwrap_or_default();
        if !["vertex_color", "vertex_colour"].contains(&name) {
            return Err(element.fault(ErrorKind::Unsupported, format!("the attribute {name:?}"), "vertex_color"));
        }
        let scale = self.number(element, "scale")?.unwrap_or(1.0);
        Ok(Texture::VertexColour(VertexColour { scale: Colour::grey(scale) }))
    }

    /// `scale` of Mitsuba 0.x: another texture times a number or a colour.
    fn scaled(&mut self, element: &'a Element, meaning: Meaning) -> Result<Texture, Error> {
        let first = match self.colour(element, "scale", meaning)? {
            Some(scale) => Some(scale),
            None => self.colour(element, "value", meaning)?,
        };
        let first = Input::Constant(first.unwrap_or(Colour::WHITE));
        let inner = self.nested_one(element, "texture")?;
        let inner = inner.ok_or_else(|| element.fault(ErrorKind::Malformed, "no texture inside", "one"))?;
        Ok(Texture::Product(Product { first, second: self.input_of(inner, meaning)? }))
    }

    fn described_uv(&self, element: &Element, uv: Uv) -> Result<UvTransform, Error> {
        uv.described().ok_or_else(|| element.fault(ErrorKind::Unsupported, "a to_uv that shears", "stretches, then turns, then moves"))
    }
}

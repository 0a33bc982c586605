//! Textures: images, checkerboards, products and blends; of patterns that are not here their mean.

use super::Importer;
use super::directive::text;
use super::parameters::Parameters;
use super::token::{Spot, Tokens};
use crate::scene::assets::check_name;
use crate::scene::description::{
    Bitmap, Channels, Checkerboard, Colour, ColourInput, Encoding, Input, Mix, Product, ScalarInput, Texture, TextureFilter, UvTransform,
    Wrap,
};
use crate::scene::error::{Error, ErrorKind};

/// What a texture yields: a colour, or a number as a grey one.
type Found = ColourInput;

impl Importer<'_> {
    /// `Texture "name" "type" "class" parameters`.
    pub(super) fn texture_directive(&mut self, tokens: &mut Tokens<'_>, spot: Spot) -> Result<(), Error> {
        let name = text(tokens, spot, "Texture")?;
        let of = text(tokens, spot, "Texture")?;
        let class = text(tokens, spot, "Texture")?;
        let parameters = Parameters::read(tokens, format!("Texture {name:?}"), spot)?;
        let is_float = match of.as_str() {
            "float" => true,
            "spectrum" | "color" => false,
            _ => return Err(parameters.fault_here(ErrorKind::Malformed, format!("type {of:?}"), "float or spectrum")),
        };
        let found = self.texture(&class, &parameters, &name, is_float)?;
        self.note_unread(&parameters);
        if is_float {
            self.float_textures.insert(name, scalar(found));
        } else {
            self.spectrum_textures.insert(name, found);
        }
        Ok(())
    }

    fn texture(&mut self, class: &str, parameters: &Parameters, name: &str, is_float: bool) -> Result<Found, Error> {
        match class {
            "constant" => self.part(parameters, "value", 1.0, is_float),
            "imagemap" => self.image(parameters, name, is_float),
            "scale" => {
                let first = self.part(parameters, "tex", 1.0, is_float)?;
                let second = match self.scalar_input(parameters, "scale")? {
                    Some(Input::Constant(scale)) => Input::Constant(Colour::grey(scale.max(0.0))),
                    Some(Input::Texture(texture)) => Input::Texture(texture),
                    None => ColourInput::white(),
                };
                Ok(match (first, second) {
                    (first, second) if second.is_white() => first,
                    (Input::Constant(a), Input::Constant(b)) => Input::Constant(Colour([0, 1, 2].map(|k| a.0[k] * b.0[k]))),
                    (first, second) => self.describe(Texture::Product(Product { first, second }), name),
                })
            }
            "mix" => {
                let (first, second) = (self.part(parameters, "tex1", 0.0, is_float)?, self.part(parameters, "tex2", 1.0, is_float)?);
                let amount = self.scalar_input(parameters, "amount")?.unwrap_or(Input::Constant(0.5));
                Ok(self.describe(Texture::Mix(Mix { first, second, amount: held(amount) }), name))
            }
            "checkerboard" => {
                if parameters.number_or("dimension", 2.0)? != 2.0 {
                    self.note(parameters, "a checkerboard of two dimensions stands for one of three");
                }
                let (color0, color1) = (self.part(parameters, "tex1", 1.0, is_float)?, self.part(parameters, "tex2", 0.0, is_float)?);
                let uv = self.mapping(parameters)?;
                // A field is one unit wide there and half a unit here.
                let half = |pair: [f64; 2]| pair.map(|x| x * 0.5);
                let uv = UvTransform { scale: half(uv.scale), offset: half(uv.offset), ..uv };
                Ok(self.describe(Texture::Checkerboard(Checkerboard { color0, color1, uv }), name))
            }
            "bilerp" => {
                self.note(parameters, "a blend of four corners counts as their mean");
                let corners = ["v00", "v01", "v10", "v11"];
                let mut sum = [0.0; 3];
                for (corner, default) in corners.into_iter().zip([0.0, 1.0, 0.0, 1.0]) {
                    let part = self.part(parameters, corner, default, is_float)?;
                    let part = part.constant().copied().unwrap_or(Colour::grey(0.5));
                    (0..3).for_each(|k| sum[k] += part.0[k] * 0.25);
                }
                Ok(Input::Constant(Colour(sum)))
            }
            "dots" => {
                self.note(parameters, "dots are left out: what lies outside them is everywhere");
                self.part(parameters, "outside", 0.0, is_float)
            }
            _ => {
                self.note(parameters, format!("a texture of class {class:?} is not here: it is 0.5 everywhere"));
                parameters.pass_over(&["octaves", "roughness", "scale", "variation"]);
                Ok(Input::Constant(Colour::grey(0.5)))
            }
        }
    }

    /// An input of a texture: of the same type as the texture itself.
    fn part(&mut self, parameters: &Parameters, name: &str, default: f64, is_float: bool) -> Result<Found, Error> {
        let found = if is_float {
            self.scalar_input(parameters, name)?.map(|input| match input {
                Input::Constant(number) => Input::Constant(Colour::grey(number.max(0.0))),
                Input::Texture(texture) => Input::Texture(texture),
            })
        } else {
            self.colour_input(parameters, name)?
        };
        Ok(found.unwrap_or(Input::Constant(Colour::grey(default))))
    }

    fn image(&mut self, parameters: &Parameters, name: &str, is_float: bool) -> Result<Found, Error> {
        let file = parameters.text("filename")?.map(str::to_string);
        let file = file.ok_or_else(|| parameters.fault_here(ErrorKind::Malformed, "no filename", "\"string filename\""))?;
        let file = file.strip_prefix("./").unwrap_or(&file).to_string();
        check_name(&file).map_err(|expected| parameters.fault_here(ErrorKind::OutsideFolder, format!("{file:?}"), expected))?;
        let uv = self.mapping(parameters)?;
        let scale = parameters.number_or("scale", 1.0)?.max(0.0);
        let invert = parameters.flag("invert")?.unwrap_or(false);
        let extension = file.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        let stored = ["png", "jpg", "jpeg"].contains(&extension.as_str());
        if !stored && !["exr", "hdr"].contains(&extension.as_str()) {
            self.note(parameters, format!("{file:?} is an image of a kind that is not here: it is 0.5 everywhere"));
            parameters.pass_over(&["filter", "wrap", "encoding", "maxanisotropy"]);
            return Ok(Input::Constant(Colour::grey(0.5)));
        }
        let encoding = match parameters.text("encoding")?.map(str::to_string) {
            _ if !stored => Encoding::Auto,
            None => Encoding::Srgb,
            Some(encoding) if encoding == "linear" => Encoding::Linear,
            Some(encoding) if encoding == "sRGB" => Encoding::Srgb,
            Some(encoding) => {
                self.note(parameters, format!("the encoding {encoding:?} counts as sRGB"));
                Encoding::Srgb
            }
        };
        let filter = match parameters.text("filter")? {
            Some("point") => TextureFilter::Nearest,
            _ => TextureFilter::Bilinear,
        };
        let wrap = match parameters.text("wrap")?.map(str::to_string).as_deref() {
            Some("clamp") => Wrap::Clamp,
            Some("octahedralsphere") | Some("black") => {
                self.note(parameters, "outside the image its border goes on");
                Wrap::Clamp
            }
            _ => Wrap::Repeat,
        };
        parameters.pass_over(&["maxanisotropy"]);
        let bitmap = Bitmap { file, encoding, channels: Channels::Rgb, filter, wrap, uv, scale: Colour::grey(scale) };
        let found = self.describe(Texture::Bitmap(bitmap), name);
        match found {
            Input::Texture(texture) if invert && is_float => {
                let inverse = Mix { first: ColourInput::white(), second: ColourInput::black(), amount: Input::Texture(texture) };
                Ok(self.describe(Texture::Mix(inverse), name))
            }
            found => {
                if invert {
                    self.note(parameters, "invert is left out for colours");
                }
                Ok(found)
            }
        }
    }

    /// `mapping`: only that of texture coordinates is here.
    fn mapping(&mut self, parameters: &Parameters) -> Result<UvTransform, Error> {
        if let Some(mapping) = parameters.text("mapping")?.filter(|mapping| *mapping != "uv").map(str::to_string) {
            self.note(parameters, format!("the mapping {mapping:?} is left out: the shape's texture coordinates count"));
            parameters.pass_over(&["v1", "v2"]);
        }
        let pair = |u: &str, v: &str, default: f64| Ok::<_, Error>([parameters.number_or(u, default)?, parameters.number_or(v, default)?]);
        Ok(UvTransform { scale: pair("uscale", "vscale", 1.0)?, rotate: 0.0, offset: pair("udelta", "vdelta", 0.0)? })
    }

    /// Puts a texture into the description.
    fn describe(&mut self, texture: Texture, name: &str) -> Found {
        let name = self.names.textures.fresh(name, "texture");
        self.described.textures.insert(name.clone(), texture);
        Input::Texture(name)
    }

    /// A coloured parameter: a texture, or a reflectance.
    pub(super) fn colour_input(&mut self, parameters: &Parameters, name: &str) -> Result<Option<ColourInput>, Error> {
        let Some(parameter) = parameters.get(name) else { return Ok(None) };
        if parameter.kind != "texture" {
            return Ok(self.reflectance(parameters, name)?.map(Input::Constant));
        }
        let texture = parameters.text(name)?.unwrap_or_default().to_string();
        match self.spectrum_textures.get(&texture) {
            Some(found) => Ok(Some(found.clone())),
            None => {
                let known: Vec<&str> = self.spectrum_textures.keys().map(String::as_str).take(12).collect();
                let expected = format!("a spectrum texture named above: {}", known.join(", "));
                Err(parameters.fault_here(ErrorKind::UnknownName, format!("the texture {texture:?}"), expected))
            }
        }
    }

    /// A numeric parameter: a texture, or a number.
    pub(super) fn scalar_input(&mut self, parameters: &Parameters, name: &str) -> Result<Option<ScalarInput>, Error> {
        let Some(parameter) = parameters.get(name) else { return Ok(None) };
        if parameter.kind != "texture" {
            return Ok(parameters.number(name)?.map(Input::Constant));
        }
        let texture = parameters.text(name)?.unwrap_or_default().to_string();
        match self.float_textures.get(&texture) {
            Some(found) => Ok(Some(found.clone())),
            None => {
                let known: Vec<&str> = self.float_textures.keys().map(String::as_str).take(12).collect();
                let expected = format!("a float texture named above: {}", known.join(", "));
                Err(parameters.fault_here(ErrorKind::UnknownName, format!("the texture {texture:?}"), expected))
            }
        }
    }
}

/// A grey colour as a number.
fn scalar(input: Found) -> ScalarInput {
    match input {
        Input::Constant(colour) => Input::Constant(colour.0[0]),
        Input::Texture(texture) => Input::Texture(texture),
    }
}

/// A number held in [0, 1].
pub(super) fn held(input: ScalarInput) -> ScalarInput {
    match input {
        Input::Constant(number) => Input::Constant(number.clamp(0.0, 1.0)),
        input => input,
    }
}

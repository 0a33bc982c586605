//! Mitsuba's parameters: numbers, colours, spectra, points and words inside a plugin's element.

use super::super::spectra::{self, Curve};
use super::super::xml::Element;
use super::context::Context;
use crate::scene::description::Colour;
use crate::scene::error::{Error, ErrorKind};

/// What a colour stands for, which decides how a spectrum becomes one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A fraction of light in [0, 1].
    Reflectance,
    /// Light.
    Radiance,
    /// Another number of each wavelength, such as an index of refraction.
    Number,
}

impl<'a> Context<'a> {
    /// A `<float>` or `<integer>`.
    pub(super) fn number(&self, element: &'a Element, name: &str) -> Result<Option<f64>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        self.expect_tag(parameter, &["float", "integer"])?;
        self.one_number(parameter, self.required(parameter, "value")?).map(Some)
    }

    /// An `<integer>`.
    pub(super) fn integer(&self, element: &'a Element, name: &str) -> Result<Option<i64>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        self.expect_tag(parameter, &["integer"])?;
        let value = self.required(parameter, "value")?;
        value.parse().map(Some).map_err(|_| parameter.fault(ErrorKind::Malformed, format!("{value:?}"), "a whole number"))
    }

    /// A `<boolean>`.
    pub(super) fn boolean(&self, element: &'a Element, name: &str) -> Result<Option<bool>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        self.expect_tag(parameter, &["boolean"])?;
        match self.required(parameter, "value")?.to_ascii_lowercase().as_str() {
            "true" => Ok(Some(true)),
            "false" => Ok(Some(false)),
            other => Err(parameter.fault(ErrorKind::Malformed, format!("{other:?}"), "true or false")),
        }
    }

    /// A `<string>`.
    pub(super) fn word(&self, element: &'a Element, name: &str) -> Result<Option<&'a str>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        self.expect_tag(parameter, &["string"])?;
        self.required(parameter, "value").map(Some)
    }

    /// A `<point>` or `<vector>`.
    pub(super) fn point(&self, element: &'a Element, name: &str) -> Result<Option<[f64; 3]>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        self.expect_tag(parameter, &["point", "vector"])?;
        self.triple(parameter, 0.0).map(Some)
    }

    /// A colour: `<rgb>`, `<srgb>`, `<float>`, `<spectrum>` or `<blackbody>`.
    pub(super) fn colour(&mut self, element: &'a Element, name: &str, meaning: Meaning) -> Result<Option<Colour>, Error> {
        match self.parameter(element, name)? {
            Some(parameter) => self.colour_of(parameter, meaning).map(Some),
            None => Ok(None),
        }
    }

    /// The colour that an element says.
    pub(super) fn colour_of(&mut self, element: &'a Element, meaning: Meaning) -> Result<Colour, Error> {
        match element.tag.as_str() {
            "rgb" | "color" => self.channels(element, self.required(element, "value")?),
            "srgb" => self.srgb(element),
            "float" | "integer" => Ok(Colour::grey(self.one_number(element, self.required(element, "value")?)?)),
            "blackbody" => self.black_body(element, self.required(element, "temperature")?, element.attribute("scale")),
            "spectrum" | "texture" if element.attribute("type").is_some() => self.typed(element, meaning),
            "spectrum" => self.spectrum(element, meaning),
            _ => Err(self.unsupported(element, "<rgb>, <float> or <spectrum>")),
        }
    }

    /// Whether an element is a spectrum in the guise of a texture.
    pub(super) fn is_spectrum(element: &Element) -> bool {
        SPECTRA.contains(&element.attribute("type").unwrap_or_default())
    }

    /// A spectrum plugin.
    fn typed(&mut self, element: &'a Element, meaning: Meaning) -> Result<Colour, Error> {
        let kind = self.kind(element)?;
        let colour = match kind {
            "uniform" | "rawconstant" => Colour::grey(self.number(element, "value")?.unwrap_or(1.0)),
            "d65" => {
                let colour = self.colour(element, "color", Meaning::Reflectance)?.unwrap_or(Colour::WHITE);
                let scale = self.number(element, "scale")?.or(self.number(element, "value")?).unwrap_or(1.0);
                Colour(colour.0.map(|channel| channel * scale))
            }
            "srgb" => self.colour(element, "color", meaning)?.unwrap_or(Colour::grey(0.5)),
            "blackbody" => {
                let kelvin = self.number(element, "temperature")?;
                let kelvin = kelvin.ok_or_else(|| element.fault(ErrorKind::Malformed, "no temperature", "one in kelvin"))?;
                self.black_body(element, &kelvin.to_string(), None)?
            }
            "irregular" => {
                let list = |context: &Self, name| {
                    let text = context.word(element, name)?;
                    text.map_or(Ok(Vec::new()), |text| context.numbers(element, text))
                };
                let (wavelengths, values) = (list(self, "wavelengths")?, list(self, "values")?);
                if wavelengths.len() != values.len() {
                    let found = format!("{} wavelengths and {} values", wavelengths.len(), values.len());
                    return Err(element.fault(ErrorKind::Malformed, found, "as many of both"));
                }
                self.curve(element, wavelengths.into_iter().zip(values).collect(), meaning)?
            }
            _ => return Err(self.unsupported(element, &SPECTRA.join(", "))),
        };
        self.finish(element, "what the kind of spectrum needs")?;
        Ok(colour)
    }

    /// `<spectrum>`: one number, pairs `wavelength:value`, or a file of pairs.
    fn spectrum(&mut self, element: &'a Element, meaning: Meaning) -> Result<Colour, Error> {
        if let Some(name) = element.attribute("filename") {
            let name = self.file_name(element, name)?;
            let bytes = self.assets.open(&name).map_err(|fault| element.fault(fault.kind, fault.to_string(), "a file of spectra"))?;
            let mut pairs = Vec::new();
            for line in String::from_utf8_lossy(&bytes).lines().filter(|line| !line.trim_start().starts_with('#')) {
                match self.numbers(element, line)?[..] {
                    [] => {}
                    [wavelength, value] => pairs.push((wavelength, value)),
                    _ => {
                        return Err(element.fault(
                            ErrorKind::Malformed,
                            format!("the line {line:?} of {name}"),
                            "a wavelength and a value",
                        ));
                    }
                }
            }
            return self.curve(element, pairs, meaning);
        }
        let value = self.required(element, "value")?;
        if !value.contains(':') {
            return match self.numbers(element, value)?[..] {
                // A flat spectrum of light is not white in this generation, which has white of D65.
                [one] if meaning == Meaning::Radiance && !self.old => Ok(spectra::flat(one)),
                [one] => Ok(Colour::grey(one)),
                // Mitsuba 0.x reads as many numbers as it was built with channels: three.
                [r, g, b] if self.old => Ok(Colour([r, g, b])),
                ref other => Err(element.fault(ErrorKind::Malformed, format!("{} numbers", other.len()), "1, or pairs wavelength:value")),
            };
        }
        let pairs = value.split([',', ' ', '\t', '\n', '\r']).filter(|pair| !pair.is_empty()).map(|pair| {
            let (wavelength, value) =
                pair.split_once(':').ok_or_else(|| element.fault(ErrorKind::Malformed, format!("{pair:?}"), "wavelength:value"))?;
            Ok((self.one_number(element, wavelength)?, self.one_number(element, value)?))
        });
        let pairs = pairs.collect::<Result<Vec<_>, Error>>()?;
        self.curve(element, pairs, meaning)
    }

    fn curve(&mut self, element: &Element, pairs: Vec<(f64, f64)>, meaning: Meaning) -> Result<Colour, Error> {
        if pairs.is_empty() || pairs.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
            return Err(element.fault(ErrorKind::Malformed, "wavelengths that do not rise", "rising wavelengths in nanometres"));
        }
        let curve = Curve(pairs);
        let colour = match meaning {
            Meaning::Reflectance => curve.reflectance(),
            Meaning::Radiance => curve.radiance(),
            Meaning::Number => curve.plain(),
        };
        self.note(element, format!("a spectrum: its colour {:.4?} is used", colour.0));
        Ok(colour)
    }

    fn black_body(&mut self, element: &Element, temperature: &str, scale: Option<&str>) -> Result<Colour, Error> {
        let kelvin = self.one_number(element, temperature.trim_end_matches(['K', 'k']).trim())?;
        if kelvin <= 0.0 {
            return Err(element.fault(ErrorKind::Invalid, format!("{kelvin} K"), "a temperature above 0"));
        }
        let scale = scale.map_or(Ok(1.0), |scale| self.one_number(element, scale))?;
        let colour = Colour(spectra::black_body(kelvin).0.map(|channel| channel * scale));
        self.note(element, format!("a black body: its colour {:.4?} is used", colour.0));
        Ok(colour)
    }

    fn channels(&self, element: &Element, value: &str) -> Result<Colour, Error> {
        match self.numbers(element, value)?[..] {
            [grey] => Ok(Colour::grey(grey)),
            [r, g, b] => Ok(Colour([r, g, b])),
            ref other => Err(element.fault(ErrorKind::Malformed, format!("{} numbers", other.len()), "1 or 3")),
        }
    }

    /// Numbers on sRGB's curve, or `#rrggbb`.
    fn srgb(&self, element: &'a Element) -> Result<Colour, Error> {
        let value = self.required(element, "value")?;
        let colour = match value.strip_prefix('#') {
            Some(hex) if hex.len() == 6 && hex.is_ascii() => {
                let channel = |k: usize| u8::from_str_radix(&hex[2 * k..2 * k + 2], 16);
                match (channel(0), channel(1), channel(2)) {
                    (Ok(r), Ok(g), Ok(b)) => Colour([r, g, b].map(|channel| f64::from(channel) / 255.0)),
                    _ => return Err(element.fault(ErrorKind::Malformed, format!("{value:?}"), "#rrggbb")),
                }
            }
            _ => self.channels(element, value)?,
        };
        Ok(Colour(colour.0.map(spectra::from_srgb)))
    }

    /// x, y and z from attributes of these names or from `value`; `absent` stands for those that are missing.
    pub(super) fn triple(&self, element: &'a Element, absent: f64) -> Result<[f64; 3], Error> {
        if element.attribute("value").is_some() {
            return match self.numbers(element, self.required(element, "value")?)?[..] {
                [x, y, z] => Ok([x, y, z]),
                [same] => Ok([same; 3]),
                ref other => Err(element.fault(ErrorKind::Malformed, format!("{} numbers", other.len()), "x, y and z")),
            };
        }
        let mut triple = [absent; 3];
        for (axis, place) in ["x", "y", "z"].iter().zip(&mut triple) {
            if let Some(value) = element.attribute(axis) {
                *place = self.one_number(element, value)?;
            }
        }
        Ok(triple)
    }

    /// Three numbers in an attribute.
    pub(super) fn triple_in(&self, element: &'a Element, attribute: &str) -> Result<[f64; 3], Error> {
        match self.numbers(element, self.required(element, attribute)?)?[..] {
            [x, y, z] => Ok([x, y, z]),
            ref other => Err(element.fault(ErrorKind::Malformed, format!("{} numbers in `{attribute}`", other.len()), "3")),
        }
    }

    /// Numbers separated by commas or spaces.
    pub(super) fn numbers(&self, element: &Element, text: &str) -> Result<Vec<f64>, Error> {
        let words = text.split([',', ' ', '\t', '\n', '\r', ';']).filter(|word| !word.is_empty());
        words.map(|word| self.one_number(element, word)).collect()
    }

    /// One finite number.
    pub(super) fn one_number(&self, element: &Element, text: &str) -> Result<f64, Error> {
        let parsed = text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
        parsed.ok_or_else(|| element.fault(ErrorKind::Malformed, format!("{text:?}"), "a finite number"))
    }

    /// A file's name as the description writes it; with `<path>`s, the first folder that holds the file counts.
    pub(super) fn file_name(&mut self, element: &Element, name: &str) -> Result<String, Error> {
        let mut name = name.trim().to_string();
        if name.contains('\\') {
            name = name.replace('\\', "/");
            self.note(element, "a name of Windows: its \\ is read as /");
        }
        let name = name.trim_start_matches("./").to_string();
        if !self.folders.is_empty() && self.assets.open(&name).is_err() {
            let inside = self.folders.iter().map(|folder| if folder.is_empty() { name.clone() } else { format!("{folder}/{name}") });
            if let Some(found) = inside.into_iter().find(|name| self.assets.open(name).is_ok()) {
                return Ok(found);
            }
        }
        Ok(name)
    }

    fn expect_tag(&self, parameter: &Element, tags: &[&str]) -> Result<(), Error> {
        if tags.contains(&parameter.tag.as_str()) {
            return Ok(());
        }
        let tags: Vec<String> = tags.iter().map(|tag| format!("<{tag}>")).collect();
        Err(self.unsupported(parameter, &tags.join(" or ")))
    }
}

/// Plugins that are spectra, whichever tag they are written with.
const SPECTRA: [&str; 6] = ["uniform", "rawconstant", "d65", "srgb", "blackbody", "irregular"];

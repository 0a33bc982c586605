//! Spectra as colours: rgb in any of pbrt's colour spaces, black bodies, sampled curves, and those that pbrt knows by name.
//!
//! pbrt-v4 scales the spectrum of every light so that its luminance is 1 and multiplies by `scale`; only `rgb` keeps its size. Numbers here
//! follow from that. Curves are seen by the CIE 1931 observer.

use super::super::spectra::{Curve, black_body};
use super::Importer;
use super::parameters::{Parameter, Parameters, Values};
use crate::scene::description::{Colour, Metal};
use crate::scene::error::Error;

/// A colour space that `rgb` stands in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Space {
    /// Rec.709, that of this program.
    #[default]
    Srgb,
    Rec2020,
    DciP3,
    Aces,
}

impl Space {
    /// By pbrt's name.
    pub(super) fn of(name: &str) -> Option<Space> {
        Some(match name {
            "srgb" => Space::Srgb,
            "rec2020" => Space::Rec2020,
            "dci-p3" => Space::DciP3,
            "aces2065-1" => Space::Aces,
            _ => return None,
        })
    }

    /// In linear Rec.709; what lies outside is clipped at 0.
    fn rec709(self, [r, g, b]: [f64; 3]) -> [f64; 3] {
        // From the primaries and whites of ITU-R BT.2020, SMPTE EG 432-1 (white D65) and SMPTE ST 2065-1 (white D60, adapted by Bradford).
        let rows = match self {
            Space::Srgb => return [r, g, b],
            Space::Rec2020 => {
                [[1.660_491, -0.587_641, -0.072_850], [-0.124_550, 1.132_900, -0.008_349], [-0.018_151, -0.100_579, 1.118_730]]
            }
            Space::DciP3 => [[1.224_940, -0.224_940, 0.0], [-0.042_057, 1.042_057, 0.0], [-0.019_638, -0.078_636, 1.098_274]],
            Space::Aces => [[2.521_649, -1.136_889, -0.384_918], [-0.275_214, 1.369_705, -0.094_392], [-0.015_925, -0.147_806, 1.163_806]],
        };
        rows.map(|[x, y, z]| (x * r + y * g + z * b).max(0.0))
    }
}

/// Index of refraction of pbrt's glasses at 587.6 nm, from Schott's data sheets.
const GLASSES: &[(&str, f64)] = &[
    ("glass-BK7", 1.5168),
    ("glass-BAF10", 1.6700),
    ("glass-FK51A", 1.4866),
    ("glass-LASF9", 1.8503),
    ("glass-F5", 1.6034),
    ("glass-SF5", 1.6727),
    ("glass-F10", 1.6231),
    ("glass-SF10", 1.7283),
    ("glass-F11", 1.6206),
    ("glass-SF11", 1.7847),
];

impl Importer<'_> {
    /// A colour of reflected or passed light, held in [0, 1].
    pub(super) fn reflectance(&mut self, parameters: &Parameters, name: &str) -> Result<Option<Colour>, Error> {
        let Some(parameter) = parameters.get(name) else { return Ok(None) };
        let colour = match (parameter.kind.as_str(), &parameter.values) {
            ("rgb", Values::Numbers(numbers)) => self.rgb(parameters, parameter, numbers)?,
            ("spectrum", Values::Numbers(numbers)) => self.curve(parameters, parameter, numbers)?.reflectance(),
            ("float", Values::Numbers(numbers)) if numbers.len() == 1 => Colour::grey(numbers[0]),
            ("blackbody", _) => Err(parameters.fault(parameter, "a black body", "a colour that a surface can have"))?,
            _ => {
                self.note(parameters, format!("{name}: its spectrum is not known here and counts as 0.5"));
                Colour::grey(0.5)
            }
        };
        let held = Colour(colour.0.map(|channel| channel.clamp(0.0, 1.0)));
        if held != colour {
            self.note(parameters, format!("{name}: {:?} is held in 0 to 1", colour.0));
        }
        Ok(Some(held))
    }

    /// A number for each channel ≥ 0, of any size: coefficients of media.
    pub(super) fn coefficients(&mut self, parameters: &Parameters, name: &str) -> Result<Option<Colour>, Error> {
        let Some(parameter) = parameters.get(name) else { return Ok(None) };
        let colour = match (parameter.kind.as_str(), &parameter.values) {
            ("rgb", Values::Numbers(numbers)) => self.rgb(parameters, parameter, numbers)?,
            ("spectrum", Values::Numbers(numbers)) => self.curve(parameters, parameter, numbers)?.plain(),
            ("float", Values::Numbers(numbers)) if numbers.len() == 1 => Colour::grey(numbers[0]),
            _ => {
                self.note(parameters, format!("{name}: its spectrum is not known here and counts as 1"));
                Colour::WHITE
            }
        };
        Ok(Some(Colour(colour.0.map(|channel| channel.max(0.0)))))
    }

    /// η or k of a metal. The named ones are those of the description.
    pub(super) fn index_of_metal(&mut self, parameters: &Parameters, name: &str) -> Result<Option<Colour>, Error> {
        if let Some(Values::Texts(texts)) = parameters.get(name).map(|parameter| &parameter.values) {
            let named = texts.first().map(String::as_str).unwrap_or_default();
            let found = metal(named);
            if found.is_none() {
                self.note(parameters, format!("{name}: the spectrum {named:?} is not known here, copper's stands for it"));
            }
            return Ok(found);
        }
        self.coefficients(parameters, name)
    }

    /// An index of refraction that is one number; glasses that spread colours have that of yellow light.
    pub(super) fn index(&mut self, parameters: &Parameters, name: &str, default: f64) -> Result<f64, Error> {
        let Some(parameter) = parameters.get(name) else { return Ok(default) };
        match &parameter.values {
            Values::Numbers(numbers) if numbers.len() == 1 => Ok(numbers[0]),
            Values::Numbers(numbers) => {
                self.note(parameters, format!("{name}: the same for all colours, that of 587.6 nm"));
                Ok(self.curve(parameters, parameter, numbers)?.at(587.6))
            }
            Values::Texts(texts) => {
                let named = texts.first().map(String::as_str).unwrap_or_default();
                match GLASSES.iter().find(|(glass, _)| *glass == named) {
                    Some((_, index)) => {
                        self.note(parameters, format!("{name}: the same for all colours, that of 587.6 nm"));
                        Ok(*index)
                    }
                    None => {
                        self.note(parameters, format!("{name}: the spectrum {named:?} is not known here and counts as {default}"));
                        Ok(default)
                    }
                }
            }
            Values::Flags(_) => Err(parameters.fault(parameter, "true or false", "an index of refraction")),
        }
    }

    /// The colour of a light, of luminance 1 unless it is `rgb`; white without the parameter.
    pub(super) fn emitted(&mut self, parameters: &Parameters, name: &str) -> Result<Colour, Error> {
        let Some(parameter) = parameters.get(name) else { return Ok(Colour::WHITE) };
        match (parameter.kind.as_str(), &parameter.values) {
            ("rgb", Values::Numbers(numbers)) => {
                let colour = self.rgb(parameters, parameter, numbers)?;
                Ok(Colour(colour.0.map(|channel| channel.max(0.0))))
            }
            ("blackbody", Values::Numbers(numbers)) => match numbers[..] {
                [kelvin, ..] if kelvin > 0.0 => Ok(of_luminance_one(black_body(kelvin))),
                _ => Err(parameters.fault(parameter, "no temperature", "a temperature > 0 [K]")),
            },
            ("spectrum", Values::Numbers(numbers)) => Ok(of_luminance_one(self.curve(parameters, parameter, numbers)?.radiance())),
            ("spectrum", Values::Texts(texts)) if texts.first().is_some_and(|name| name.starts_with("stdillum-D65")) => Ok(Colour::WHITE),
            ("spectrum", Values::Texts(texts)) if texts.first().is_some_and(|name| name == "stdillum-A") => {
                Ok(of_luminance_one(black_body(2856.0)))
            }
            ("float", Values::Numbers(numbers)) if numbers.len() == 1 => Ok(Colour::grey(numbers[0].max(0.0))),
            _ => {
                self.note(parameters, format!("{name}: its spectrum is not known here and counts as white of luminance 1"));
                Ok(Colour::WHITE)
            }
        }
    }

    fn rgb(&mut self, parameters: &Parameters, parameter: &Parameter, numbers: &[f64]) -> Result<Colour, Error> {
        match numbers {
            [r, g, b] => Ok(Colour(self.state.space.rec709([*r, *g, *b]))),
            _ => Err(parameters.fault(parameter, format!("{} numbers", numbers.len()), "3 numbers")),
        }
    }

    /// Pairs of wavelength [nm] and value.
    fn curve(&mut self, parameters: &Parameters, parameter: &Parameter, numbers: &[f64]) -> Result<Curve, Error> {
        let (pairs, rest) = numbers.as_chunks::<2>();
        let rises = pairs.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        if pairs.is_empty() || !rest.is_empty() || !rises {
            return Err(parameters.fault(
                parameter,
                format!("{} numbers", numbers.len()),
                "pairs of wavelength and value, wavelengths rising",
            ));
        }
        Ok(Curve(pairs.iter().map(|[wavelength, value]| (*wavelength, *value)).collect()))
    }
}

fn of_luminance_one(colour: Colour) -> Colour {
    let luminance = luminance(colour);
    if luminance > 0.0 { Colour(colour.0.map(|channel| channel / luminance)) } else { Colour::grey(0.0) }
}

/// Luminance of a colour in Rec.709.
pub(super) fn luminance(Colour([r, g, b]): Colour) -> f64 {
    0.212_639 * r + 0.715_169 * g + 0.072_192 * b
}

/// η or k of one of pbrt's named metals.
fn metal(name: &str) -> Option<Colour> {
    let (symbol, part) = name.strip_prefix("metal-")?.split_once('-')?;
    let (eta, k) = match symbol {
        // Brass, and two that hardly absorb: their indices in Rec.709 by the same observer.
        "CuZn" => (Colour([0.444, 0.527, 1.094]), Colour([3.695, 2.765, 1.829])),
        "MgO" => (Colour([1.735, 1.740, 1.752]), Colour::grey(0.0)),
        "TiO2" => (Colour([2.578, 2.652, 2.820]), Colour::grey(0.0)),
        _ => Metal::ALL.iter().find(|metal| metal.symbol() == symbol)?.index_of_refraction(),
    };
    match part {
        "eta" => Some(eta),
        "k" => Some(k),
        _ => None,
    }
}

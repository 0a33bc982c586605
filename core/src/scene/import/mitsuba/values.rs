//! Mitsuba's parameters: numbers, colours, points and words inside a plugin's element.

use super::super::xml::Element;
use super::context::Context;
use crate::scene::description::Colour;
use crate::scene::error::{Error, ErrorKind};

impl Context<'_> {
    /// A `<float>` or `<integer>`.
    pub(super) fn number(&self, element: &Element, name: &str) -> Result<Option<f64>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        self.expect_tag(parameter, &["float", "integer"])?;
        self.one_number(parameter, &self.required(parameter, "value")?).map(Some)
    }

    /// An `<integer>`.
    pub(super) fn integer(&self, element: &Element, name: &str) -> Result<Option<i64>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        self.expect_tag(parameter, &["integer"])?;
        let value = self.required(parameter, "value")?;
        let parsed = value.parse().map_err(|_| self.fault(parameter, ErrorKind::Malformed, format!("{value:?}"), "a whole number"));
        parsed.map(Some)
    }

    /// A `<boolean>`.
    pub(super) fn boolean(&self, element: &Element, name: &str) -> Result<Option<bool>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        self.expect_tag(parameter, &["boolean"])?;
        match self.required(parameter, "value")?.to_ascii_lowercase().as_str() {
            "true" => Ok(Some(true)),
            "false" => Ok(Some(false)),
            other => Err(self.fault(parameter, ErrorKind::Malformed, format!("{other:?}"), "true or false")),
        }
    }

    /// A `<string>`.
    pub(super) fn word(&self, element: &Element, name: &str) -> Result<Option<String>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        self.expect_tag(parameter, &["string"])?;
        self.required(parameter, "value").map(Some)
    }

    /// A `<point>` or `<vector>`.
    pub(super) fn point(&self, element: &Element, name: &str) -> Result<Option<[f64; 3]>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        self.expect_tag(parameter, &["point", "vector"])?;
        self.triple(parameter, 0.0).map(Some)
    }

    /// An `<rgb>`, a `<float>`, or a `<spectrum>` of one number.
    pub(super) fn colour(&self, element: &Element, name: &str) -> Result<Option<Colour>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        match parameter.tag.as_str() {
            "rgb" => {}
            "float" | "spectrum" => {
                let value = self.required(parameter, "value")?;
                return self.one_number(parameter, &value).map(|value| Some(Colour::grey(value)));
            }
            _ => return Err(self.unsupported(parameter, "<rgb>, <float> or <spectrum> with one number")),
        }
        match self.numbers(parameter, &self.required(parameter, "value")?)?[..] {
            [grey] => Ok(Some(Colour::grey(grey))),
            [r, g, b] => Ok(Some(Colour([r, g, b]))),
            ref other => Err(self.fault(parameter, ErrorKind::Malformed, format!("{} numbers", other.len()), "1 or 3")),
        }
    }

    /// x, y and z from attributes of these names or from `value`; `absent` stands for those that are missing.
    pub(super) fn triple(&self, element: &Element, absent: f64) -> Result<[f64; 3], Error> {
        if let Some(value) = self.attribute(element, "value")? {
            return match self.numbers(element, &value)?[..] {
                [x, y, z] => Ok([x, y, z]),
                [same] => Ok([same; 3]),
                ref other => Err(self.fault(element, ErrorKind::Malformed, format!("{} numbers", other.len()), "x, y and z")),
            };
        }
        let mut triple = [absent; 3];
        for (axis, place) in ["x", "y", "z"].iter().zip(&mut triple) {
            if let Some(value) = self.attribute(element, axis)? {
                *place = self.one_number(element, &value)?;
            }
        }
        Ok(triple)
    }

    /// Three numbers in an attribute.
    pub(super) fn triple_in(&self, element: &Element, attribute: &str) -> Result<[f64; 3], Error> {
        let value = self.required(element, attribute)?;
        match self.numbers(element, &value)?[..] {
            [x, y, z] => Ok([x, y, z]),
            ref other => Err(self.fault(element, ErrorKind::Malformed, format!("{} numbers in `{attribute}`", other.len()), "3")),
        }
    }

    /// Numbers separated by commas or spaces.
    pub(super) fn numbers(&self, element: &Element, text: &str) -> Result<Vec<f64>, Error> {
        let words = text.split([',', ' ', '\t', '\n', '\r']).filter(|word| !word.is_empty());
        words.map(|word| self.one_number(element, word)).collect()
    }

    /// One finite number.
    pub(super) fn one_number(&self, element: &Element, text: &str) -> Result<f64, Error> {
        let parsed = text.parse::<f64>().ok().filter(|value| value.is_finite());
        parsed.ok_or_else(|| self.fault(element, ErrorKind::Malformed, format!("{text:?}"), "a finite number"))
    }

    fn expect_tag(&self, parameter: &Element, tags: &[&str]) -> Result<(), Error> {
        if tags.contains(&parameter.tag.as_str()) {
            return Ok(());
        }
        let tags: Vec<String> = tags.iter().map(|tag| format!("<{tag}>")).collect();
        Err(self.unsupported(parameter, &tags.join(" or ")))
    }
}

//! Indices of refraction: numbers, or substances by name.

use super::super::super::xml::Element;
use super::super::context::Context;
use crate::scene::error::{Error, ErrorKind};

impl<'a> Context<'a> {
    /// A number, or one of Mitsuba's substances.
    pub(super) fn index_of_refraction(&self, element: &'a Element, name: &str, default: &str) -> Result<f64, Error> {
        let substance = match self.parameter(element, name)? {
            Some(parameter) if parameter.tag == "string" => self.required(parameter, "value")?,
            Some(_) => return Ok(self.number(element, name)?.unwrap_or_default()),
            None => default,
        };
        SUBSTANCES.iter().find(|(known, _)| *known == substance).map(|(_, ior)| *ior).ok_or_else(|| {
            let known: Vec<&str> = SUBSTANCES.iter().map(|(known, _)| *known).collect();
            element.fault(ErrorKind::UnknownName, format!("{name} {substance:?}"), format!("a number or one of {}", known.join(", ")))
        })
    }
}

/// Indices of refraction at optical wavelengths, as Mitsuba 3.9 reports them.
const SUBSTANCES: [(&str, f64); 23] = [
    ("vacuum", 1.0),
    ("helium", 1.000036),
    ("hydrogen", 1.000132),
    ("air", 1.000277),
    ("carbon dioxide", 1.00045),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.52045),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

//! Mitsuba's participating media.

use super::super::xml::Element;
use super::context::Context;
use super::values::Meaning;
use crate::scene::description::{Colour, HenyeyGreenstein, Homogeneous, Medium, Phase};
use crate::scene::error::{Error, ErrorKind};

impl<'a> Context<'a> {
    /// Reads a `<medium>` once, and gives its name.
    pub(super) fn medium(&mut self, element: &'a Element) -> Result<String, Error> {
        let name = self.name(element)?;
        if self.media.contains_key(&name) {
            return Ok(name);
        }
        let medium = match self.kind(element)? {
            "homogeneous" => self.homogeneous(element)?,
            "heterogeneous" => {
                let expected = "homogeneous: media that vary in space are not rendered here";
                return Err(self.unsupported(element, expected));
            }
            _ => return Err(self.unsupported(element, "homogeneous")),
        };
        self.finish(element, "albedo, sigma_t, sigma_s, sigma_a, scale and phase")?;
        self.media.insert(name.clone(), medium);
        self.origins.insert(format!("media.{name}"), element);
        Ok(name)
    }

    fn homogeneous(&mut self, element: &'a Element) -> Result<Medium, Error> {
        if let Some(material) = self.word(element, "material")? {
            return Err(element.fault(
                ErrorKind::Unsupported,
                format!("the material {material:?}"),
                "sigma_t and albedo, or sigma_s and sigma_a",
            ));
        }
        let albedo = self.coefficient(element, "albedo", Meaning::Reflectance)?;
        let extinction = self.coefficient(element, "sigma_t", Meaning::Number)?;
        let scattering = self.coefficient(element, "sigma_s", Meaning::Number)?;
        let absorption = self.coefficient(element, "sigma_a", Meaning::Number)?;
        let scale = self.number(element, "scale")?.unwrap_or(1.0);
        let (extinction, albedo) = match (extinction, albedo, scattering, absorption) {
            (None, None, Some(scattering), Some(absorption)) => {
                let sum = [0, 1, 2].map(|k| scattering.0[k] + absorption.0[k]);
                let share = [0, 1, 2].map(|k| if sum[k] > 0.0 { scattering.0[k] / sum[k] } else { 0.0 });
                (Colour(sum), Colour(share))
            }
            (extinction, albedo, None, None) => (extinction.unwrap_or(Colour::WHITE), albedo.unwrap_or(Colour::grey(0.75))),
            _ => return Err(element.fault(ErrorKind::Malformed, "both ways mixed", "sigma_t and albedo, or sigma_s and sigma_a")),
        };
        // Whether Mitsuba draws from it when it walks.
        self.leave(element, &["sample_emitters", "has_spectral_extinction", "strategy"], "says how Mitsuba samples")?;
        let phase = match self.nested_one(element, "phase")? {
            Some(phase) => self.phase(phase)?,
            None => Phase::Isotropic,
        };
        Ok(Medium::Homogeneous(Homogeneous { extinction: Colour(extinction.0.map(|sigma| sigma * scale)), albedo, phase }))
    }

    /// A coefficient, also where it is written as a volume of one value.
    fn coefficient(&mut self, element: &'a Element, name: &str, meaning: Meaning) -> Result<Option<Colour>, Error> {
        let Some(parameter) = self.parameter(element, name)? else { return Ok(None) };
        if !self.is(parameter, "volume") {
            return self.colour_of(parameter, meaning).map(Some);
        }
        let volume = self.resolved(parameter, "volume")?;
        if self.kind(volume)? != "constvolume" {
            return Err(self.unsupported(volume, "constvolume: media that vary in space are not rendered here"));
        }
        let value = self.colour(volume, "value", meaning)?;
        self.finish(volume, "value")?;
        value.map(Some).ok_or_else(|| volume.fault(ErrorKind::Malformed, "no value", "one"))
    }

    fn phase(&mut self, element: &'a Element) -> Result<Phase, Error> {
        let phase = match self.kind(element)? {
            "isotropic" => Phase::Isotropic,
            "hg" => {
                let g = self.number(element, "g")?.unwrap_or(0.8);
                if g == 0.0 { Phase::Isotropic } else { Phase::HenyeyGreenstein(HenyeyGreenstein { g }) }
            }
            "rayleigh" => {
                self.note(element, "Rayleigh's phase function: an isotropic one is used");
                Phase::Isotropic
            }
            _ => return Err(self.unsupported(element, "isotropic, hg or rayleigh")),
        };
        self.finish(element, "g")?;
        Ok(phase)
    }
}

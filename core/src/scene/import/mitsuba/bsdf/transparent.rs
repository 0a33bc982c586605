//! Mitsuba's surfaces that light passes.

use super::super::super::xml::Element;
use super::super::context::Context;
use crate::scene::description::{Dielectric, Distribution, Material, ScalarInput};
use crate::scene::error::Error;

impl<'a> Context<'a> {
    pub(super) fn dielectric(&mut self, element: &'a Element, rough: bool) -> Result<Material, Error> {
        let interior_ior = self.index_of_refraction(element, "int_ior", "bk7")?;
        let exterior_ior = self.index_of_refraction(element, "ext_ior", "air")?;
        let (roughness, roughness_v, distribution) =
            if rough { self.facets(element)? } else { (ScalarInput::zero(), None, Distribution::default()) };
        let reflectance = self.reflectance(element, &["specular_reflectance"], 1.0)?;
        let transmittance = self.reflectance(element, &["specular_transmittance"], 1.0)?;
        Ok(Material::Dielectric(Dielectric {
            interior_ior,
            exterior_ior,
            thin: false,
            roughness,
            roughness_v,
            distribution,
            energy_conserving: false,
            reflectance,
            transmittance,
        }))
    }

    pub(super) fn thin_dielectric(&mut self, element: &'a Element) -> Result<Material, Error> {
        let Material::Dielectric(boundary) = self.dielectric(element, false)? else { return Ok(Material::Null) };
        Ok(Material::Dielectric(Dielectric { thin: true, ..boundary }))
    }
}

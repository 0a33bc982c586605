//! Participating media: homogeneous ones.

use super::Importer;
use super::parameters::Parameters;
use crate::scene::description::{Colour, HenyeyGreenstein, Homogeneous, Medium, Phase};
use crate::scene::error::{Error, ErrorKind};

impl Importer<'_> {
    /// `MakeNamedMedium`. Media that vary in space are left out: what names them is empty.
    pub(super) fn make_medium(&mut self, name: &str, parameters: &Parameters) -> Result<(), Error> {
        let kind = parameters.text("type")?.unwrap_or_default().to_string();
        if kind != "homogeneous" {
            self.note(parameters, format!("left out: a medium of type {kind:?} is not here, the space is empty"));
            self.described.media.remove(name);
            self.state.forget_medium(name);
            return Ok(());
        }
        if let Some(preset) = parameters.text("preset")?.map(str::to_string) {
            self.note(parameters, format!("the preset {preset:?} is not known here, pbrt's default coefficients stand for it"));
        }
        let scale = parameters.number_or("scale", 1.0)?.max(0.0);
        let absorption = self.coefficients(parameters, "sigma_a")?.unwrap_or(Colour([0.0011, 0.0024, 0.014]));
        let scattering = self.coefficients(parameters, "sigma_s")?.unwrap_or(Colour([2.55, 3.21, 3.77]));
        if parameters.get("Le").is_some() {
            self.note(parameters, "Le is left out: the medium does not glow");
        }
        parameters.pass_over(&["Lescale"]);
        let extinction = [0, 1, 2].map(|k| (absorption.0[k] + scattering.0[k]) * scale);
        let albedo = [0, 1, 2].map(|k| {
            let whole = absorption.0[k] + scattering.0[k];
            if whole > 0.0 { scattering.0[k] / whole } else { 0.0 }
        });
        let g = parameters.number_or("g", 0.0)?;
        let phase = if g == 0.0 { Phase::Isotropic } else { Phase::HenyeyGreenstein(HenyeyGreenstein { g }) };
        let medium = Medium::Homogeneous(Homogeneous { extinction: Colour(extinction), albedo: Colour(albedo), phase });
        self.described.media.insert(name.to_string(), medium);
        self.note_unread(parameters);
        Ok(())
    }

    /// The medium that `MediumInterface` names; the empty name, and media that were left out, are none.
    pub(super) fn medium_named(&mut self, name: &str, at: &Parameters) -> Result<Option<String>, Error> {
        if name.is_empty() || self.state.is_forgotten(name) {
            return Ok(None);
        }
        if self.described.media.contains_key(name) {
            return Ok(Some(name.to_string()));
        }
        Err(at.fault_here(ErrorKind::UnknownName, format!("{name:?}"), "a medium named above"))
    }
}

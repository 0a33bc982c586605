//! Disney's principled surface as Mitsuba has it, in the words of ours, which is glTF's: an approximation.

use super::super::super::xml::Element;
use super::super::context::Context;
use super::super::values::Meaning;
use crate::scene::description::{Colour, ColourInput, Input, Material, Principled, ScalarInput};
use crate::scene::error::Error;

impl<'a> Context<'a> {
    pub(super) fn principled(&mut self, element: &'a Element, thin: bool) -> Result<Material, Error> {
        self.note(element, "approximated by glTF's principled surface: other forms of sheen, clear coat and transmission");
        let base_color = self.reflectance(element, &["base_color"], 0.5)?;
        let mut scalar = |name: &str, default: f64| self.scalar(element, name).map(|given| given.unwrap_or(default.into()));
        let (metallic, roughness) = (scalar("metallic", 0.0)?, scalar("roughness", 0.5)?);
        let (clearcoat, gloss) = (scalar("clearcoat", 0.0)?, scalar("clearcoat_gloss", 0.0)?);
        let transmission = scalar("spec_trans", 0.0)?;
        let (stretch, sheen, tint) = (scalar("anisotropic", 0.0)?, scalar("sheen", 0.0)?, scalar("sheen_tint", 0.0)?);
        let spec_tint = scalar("spec_tint", 0.0)?;
        let ior = self.principled_index(element)?;
        self.leave(element, &["flatness", "diff_trans"], "there is no such parameter here")?;
        for rate in
            ["main_specular", "clearcoat", "diffuse_reflectance", "specular_reflectance", "diffuse_transmittance", "specular_transmittance"]
        {
            // Says how to sample, not what there is.
            self.number(element, &format!("{rate}_sampling_rate"))?;
        }
        // What depends on the colour needs the colour: a texture is taken as grey.
        let hue = base_color.constant().map_or([1.0; 3], |Colour(channels)| {
            let most = channels.iter().fold(1e-9f64, |most, channel| most.max(*channel));
            channels.map(|channel| channel / most)
        });
        let tinted = |strength: f64, tint: f64| Colour(hue.map(|hue| (strength * (1.0 + tint * (hue - 1.0))).clamp(0.0, 1.0)));
        let number = |input: &ScalarInput| input.constant().copied().unwrap_or(0.5);
        Ok(Material::Principled(Principled {
            metallic,
            roughness,
            anisotropy: match stretch {
                // Disney's aspect is √(1 − 0.9 a), with α·aspect across and α/aspect along.
                Input::Constant(a) => a.clamp(0.0, 1.0).into(),
                texture => texture,
            },
            ior,
            specular: ScalarInput::one(),
            specular_color: ColourInput::Constant(tinted(1.0, number(&spec_tint))),
            clearcoat: match clearcoat {
                // Disney's coat has a quarter of its parameter as strength.
                Input::Constant(c) => (0.25 * c).clamp(0.0, 1.0).into(),
                texture => texture,
            },
            // α from 0.1 down to 0.001; ours is the square of a roughness.
            clearcoat_roughness: (0.1 + number(&gloss).clamp(0.0, 1.0) * (0.001 - 0.1)).sqrt().into(),
            sheen_color: ColourInput::Constant(tinted(number_or_zero(&sheen), number(&tint))),
            sheen_roughness: 0.5.into(),
            transmission,
            thin,
            two_sided: false,
            base_color,
        }))
    }

    /// From `eta`, or from `specular`, which is the reflectance at normal incidence over 0.08.
    fn principled_index(&mut self, element: &'a Element) -> Result<f64, Error> {
        let eta = self.colour(element, "eta", Meaning::Number)?.map(|Colour([r, g, b])| (r + g + b) / 3.0);
        let specular = self.number(element, "specular")?.unwrap_or(0.5);
        let root = (0.08 * specular.clamp(0.0, 1.0)).sqrt();
        Ok(eta.unwrap_or((1.0 + root) / (1.0 - root)).max(1.0))
    }
}

fn number_or_zero(input: &ScalarInput) -> f64 {
    input.constant().copied().unwrap_or(0.0)
}

//! Mitsuba's surfaces. Each becomes a named material; those made of others name them.

use super::super::xml::Element;
use super::context::Context;
use super::values::Meaning;
use crate::scene::description::{ColourInput, Diffuse, Distribution, Material, ScalarInput};
use crate::scene::error::{Error, ErrorKind};

mod composite;
mod index;
mod opaque;
mod principled;
mod transparent;

const KNOWN: &str = "diffuse, roughdiffuse, conductor, roughconductor, dielectric, thindielectric, roughdielectric, plastic, roughplastic, \
                     principled, principledthin, phong, ward, mask, blendbsdf, mixturebsdf, twosided, bumpmap, normalmap, coating, \
                     roughcoating, difftrans or null";

/// What Mitsuba gives a shape that names no surface.
pub(super) fn default_material() -> Material {
    Material::Diffuse(Diffuse { reflectance: ColourInput::grey(0.5), two_sided: false })
}

impl<'a> Context<'a> {
    /// Reads a `<bsdf>` once, stores it under its id or a name of its own, and gives that name.
    pub(super) fn material(&mut self, element: &'a Element) -> Result<String, Error> {
        let name = self.name(element)?;
        if self.materials.contains_key(&name) {
            return Ok(name);
        }
        let material = self.inside(element, &name, |context| context.bsdf(element))?;
        self.finish(element, "what the kind of bsdf needs")?;
        self.materials.insert(name.clone(), material);
        self.origins.insert(format!("materials.{name}"), element);
        Ok(name)
    }

    fn bsdf(&mut self, element: &'a Element) -> Result<Material, Error> {
        match self.kind(element)? {
            "diffuse" => self.diffuse(element),
            "roughdiffuse" => self.rough_diffuse(element),
            "conductor" => self.conductor(element, false),
            "roughconductor" => self.conductor(element, true),
            "dielectric" => self.dielectric(element, false),
            "roughdielectric" => self.dielectric(element, true),
            "thindielectric" => self.thin_dielectric(element),
            "plastic" => self.plastic(element, false),
            "roughplastic" => self.plastic(element, true),
            "principled" => self.principled(element, false),
            "principledthin" => self.principled(element, true),
            "phong" => self.phong(element),
            "ward" => self.ward(element),
            "mask" => self.mask(element),
            "blendbsdf" => self.blend(element),
            "mixturebsdf" => self.mixture(element),
            "twosided" => self.two_sided(element),
            "bumpmap" => self.bump_map(element),
            "normalmap" => self.normal_map(element),
            "coating" => self.coating(element, false),
            "roughcoating" => self.coating(element, true),
            "null" => Ok(Material::Null),
            _ => Err(self.unsupported(element, KNOWN)),
        }
    }

    /// The one surface inside another.
    fn inner(&self, element: &'a Element) -> Result<&'a Element, Error> {
        let inner = self.nested_one(element, "bsdf")?;
        inner.ok_or_else(|| element.fault(ErrorKind::Malformed, "no bsdf inside", "one"))
    }

    /// A reflectance under either of its names.
    fn reflectance(&mut self, element: &'a Element, names: &[&str], default: f64) -> Result<ColourInput, Error> {
        for name in names {
            if let Some(input) = self.input(element, name, Meaning::Reflectance)? {
                return Ok(input);
            }
        }
        Ok(ColourInput::grey(default))
    }

    /// α of a rough surface along both tangents, and its distribution.
    fn facets(&mut self, element: &'a Element) -> Result<(ScalarInput, Option<ScalarInput>, Distribution), Error> {
        // Says how to sample, not what there is.
        self.boolean(element, "sample_visible")?;
        let distribution = match self.word(element, "distribution")? {
            None | Some("beckmann") => Distribution::Beckmann,
            Some("ggx") => Distribution::Ggx,
            Some(other @ ("phong" | "as")) if self.old => {
                self.note(element, format!("the distribution {other}: Beckmann's of the same alpha is used"));
                Distribution::Beckmann
            }
            Some(other) => return Err(element.fault(ErrorKind::Unsupported, format!("the distribution {other}"), "beckmann or ggx")),
        };
        let both = self.scalar(element, "alpha")?;
        let (u, v) = (self.scalar(element, "alpha_u")?, self.scalar(element, "alpha_v")?);
        let (roughness, across) = match (both, u, v) {
            (alpha, None, None) => (alpha.unwrap_or(0.1.into()), None),
            (None, Some(u), Some(v)) if u == v => (u, None),
            (None, Some(u), Some(v)) => (u, Some(v)),
            _ => return Err(element.fault(ErrorKind::Malformed, "only part of them", "either alpha, or alpha_u and alpha_v")),
        };
        // Mitsuba's own floor: smoother it does not compute.
        let floor = |input: ScalarInput| match input.constant() {
            Some(alpha) => alpha.clamp(1e-4, 1.0).into(),
            None => input,
        };
        Ok((floor(roughness), across.map(floor), distribution))
    }
}

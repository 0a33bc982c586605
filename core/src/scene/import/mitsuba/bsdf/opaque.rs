//! Mitsuba's surfaces that only reflect.

use super::super::super::xml::Element;
use super::super::context::Context;
use super::super::values::Meaning;
use crate::scene::description::{
    Colour, ColourInput, Conductor, Diffuse, Distribution, Material, Metal, Phong, Plastic, RoughDiffuse, ScalarInput, Ward,
};
use crate::scene::error::{Error, ErrorKind};

/// Where surfaces that only reflect get their two sides from: a `twosided` around them.
const ONE_SIDED: bool = false;

impl<'a> Context<'a> {
    pub(super) fn diffuse(&mut self, element: &'a Element) -> Result<Material, Error> {
        let reflectance = self.reflectance(element, &["reflectance", "diffuse_reflectance"], 0.5)?;
        Ok(Material::Diffuse(Diffuse { reflectance, two_sided: ONE_SIDED }))
    }

    /// α of Mitsuba's plugin is the deviation of the slope, Oren and Nayar's σ is that of the angle; √2 stands in Mitsuba's own conversion.
    pub(super) fn rough_diffuse(&mut self, element: &'a Element) -> Result<Material, Error> {
        let reflectance = self.reflectance(element, &["reflectance", "diffuse_reflectance"], 0.5)?;
        let roughness = match self.scalar(element, "alpha")?.unwrap_or(0.2.into()) {
            ScalarInput::Constant(alpha) => (alpha * std::f64::consts::FRAC_1_SQRT_2).clamp(0.0, 1.0).into(),
            texture => {
                self.note(element, "alpha from a texture: taken as the angle's deviation");
                texture
            }
        };
        if self.boolean(element, "use_fast_approx")? != Some(true) {
            self.note(element, "Oren and Nayar's short formula is used, without light between facets");
        }
        Ok(Material::RoughDiffuse(RoughDiffuse { reflectance, roughness, two_sided: ONE_SIDED }))
    }

    pub(super) fn conductor(&mut self, element: &'a Element, rough: bool) -> Result<Material, Error> {
        let material = self.word(element, "material")?;
        let eta = self.colour(element, "eta", Meaning::Number)?;
        let k = self.colour(element, "k", Meaning::Number)?;
        // Mitsuba 0.x made what said nothing of copper; since 2 it is a mirror that loses nothing, which is also called "none".
        let material = if self.old && material.is_none() && eta.is_none() && k.is_none() { Some("Cu") } else { material };
        let (metal, eta, k) = match (material, eta, k) {
            (None, Some(eta), Some(k)) => (None, Some(eta), Some(k)),
            (None | Some("none"), None, None) => (None, Some(Colour::grey(0.0)), Some(Colour::WHITE)),
            (Some(symbol), None, None) => (Some(self.metal(element, symbol)?), None, None),
            _ => return Err(element.fault(ErrorKind::Malformed, "material, eta and k mixed", "either material, or eta and k")),
        };
        let outside = if self.old { self.index_of_refraction(element, "ext_eta", "air")? } else { 1.0 };
        let (metal, eta, k) = relative(metal, eta, k, outside);
        let (roughness, roughness_v, distribution) =
            if rough { self.facets(element)? } else { (ScalarInput::zero(), None, Distribution::default()) };
        let reflectance = self.reflectance(element, &["specular_reflectance"], 1.0)?;
        Ok(Material::Conductor(Conductor {
            metal,
            eta,
            k,
            roughness,
            roughness_v,
            distribution,
            energy_conserving: false,
            reflectance,
            two_sided: ONE_SIDED,
        }))
    }

    fn metal(&mut self, element: &'a Element, symbol: &str) -> Result<Metal, Error> {
        let plain = symbol.trim_end_matches("_palik");
        Metal::ALL.iter().find(|metal| metal.symbol() == plain).copied().ok_or_else(|| {
            let known: Vec<&str> = Metal::ALL.iter().map(|metal| metal.symbol()).collect();
            element.fault(ErrorKind::UnknownName, format!("the material {symbol:?}"), format!("none, {}", known.join(", ")))
        })
    }

    pub(super) fn plastic(&mut self, element: &'a Element, rough: bool) -> Result<Material, Error> {
        let diffuse = self.reflectance(element, &["diffuse_reflectance"], 0.5)?;
        let specular = self.reflectance(element, &["specular_reflectance"], 1.0)?;
        let interior_ior = self.index_of_refraction(element, "int_ior", "polypropylene")?;
        let exterior_ior = self.index_of_refraction(element, "ext_ior", "air")?;
        let nonlinear = self.boolean(element, "nonlinear")?.unwrap_or(false);
        let (roughness, across, distribution) =
            if rough { self.facets(element)? } else { (ScalarInput::zero(), None, Distribution::default()) };
        if across.is_some() {
            self.note(element, "alpha_v: alpha_u is used in both directions");
        }
        Ok(Material::Plastic(Plastic {
            diffuse,
            specular,
            interior_ior,
            exterior_ior,
            nonlinear,
            roughness,
            distribution,
            two_sided: ONE_SIDED,
        }))
    }

    pub(super) fn phong(&mut self, element: &'a Element) -> Result<Material, Error> {
        let diffuse = self.reflectance(element, &["diffuse_reflectance"], 0.5)?;
        let specular = self.reflectance(element, &["specular_reflectance"], 0.2)?;
        let exponent = self.scalar(element, "exponent")?.unwrap_or(30.0.into());
        Ok(Material::Phong(Phong { diffuse, specular, exponent, two_sided: ONE_SIDED }))
    }

    pub(super) fn ward(&mut self, element: &'a Element) -> Result<Material, Error> {
        let diffuse = self.reflectance(element, &["diffuse_reflectance"], 0.5)?;
        let specular = self.reflectance(element, &["specular_reflectance"], 0.2)?;
        match self.word(element, "variant")? {
            None | Some("balanced") => {}
            Some(other) => self.note(element, format!("the variant {other}: the balanced one is used, which conserves energy")),
        }
        let both = self.scalar(element, "alpha")?;
        let (u, v) = (self.scalar(element, "alpha_u")?, self.scalar(element, "alpha_v")?);
        let or = |given: Option<ScalarInput>| given.or_else(|| both.clone()).unwrap_or(0.1.into());
        let (roughness, across) = (or(u), or(v));
        let roughness_v = (across != roughness).then_some(across);
        Ok(Material::Ward(Ward { diffuse, specular, roughness, roughness_v, two_sided: ONE_SIDED }))
    }

    /// Light through a sheet that scatters it evenly. There is no such material here.
    pub(super) fn coating(&mut self, element: &'a Element, rough: bool) -> Result<Material, Error> {
        let inner = self.inner(element)?;
        let interior = self.index_of_refraction(element, "int_ior", "bk7")?;
        let exterior = self.index_of_refraction(element, "ext_ior", "air")?;
        let specular = self.reflectance(element, &["specular_reflectance"], 1.0)?;
        let (roughness, _, distribution) = if rough { self.facets(element)? } else { (ScalarInput::zero(), None, Distribution::default()) };
        self.leave(element, &["thickness", "sigma_a"], "the coat absorbs nothing here")?;
        // Over a diffuse base a coat is what plastic is; over anything else the coat is left out.
        let name = self.material(inner)?;
        match self.materials.get(&name).cloned() {
            Some(Material::Diffuse(base)) => {
                self.note(element, "a coat over a diffuse surface: taken as plastic");
                Ok(Material::Plastic(Plastic {
                    diffuse: base.reflectance,
                    specular,
                    interior_ior: interior,
                    exterior_ior: exterior,
                    nonlinear: true,
                    roughness,
                    distribution,
                    two_sided: ONE_SIDED,
                }))
            }
            Some(base) => {
                self.note(element, "a coat: left out, the surface under it is shown");
                Ok(base)
            }
            None => Err(self.unsupported(inner, "a surface to coat")),
        }
    }
}

/// The index of refraction seen from a medium of index `outside`.
fn relative(metal: Option<Metal>, eta: Option<Colour>, k: Option<Colour>, outside: f64) -> (Option<Metal>, Option<Colour>, Option<Colour>) {
    // Air's 1.0003 changes less than the sixth digit of measured metals.
    if (outside - 1.0).abs() < 1e-3 {
        return (metal, eta, k);
    }
    let over = |colour: Colour| Colour(colour.0.map(|channel| channel / outside));
    match metal.map(Metal::index_of_refraction) {
        Some((eta, k)) => (None, Some(over(eta)), Some(over(k))),
        None => (None, eta.map(over), k.map(over)),
    }
}

/// A leaf made to reflect on both sides; `None` for materials that have no such choice.
pub(super) fn on_both_sides(material: &Material) -> Option<Material> {
    let mut material = material.clone();
    let side = match &mut material {
        Material::Diffuse(m) => &mut m.two_sided,
        Material::RoughDiffuse(m) => &mut m.two_sided,
        Material::Conductor(m) => &mut m.two_sided,
        Material::Plastic(m) => &mut m.two_sided,
        Material::Principled(m) => &mut m.two_sided,
        Material::Phong(m) => &mut m.two_sided,
        Material::Ward(m) => &mut m.two_sided,
        _ => return None,
    };
    *side = true;
    Some(material)
}

/// Whether light may pass a material.
pub(super) fn passes(material: &Material) -> bool {
    match material {
        Material::Dielectric(_) | Material::Null | Material::Mask(_) => true,
        Material::Principled(m) => !m.transmission.is_zero(),
        _ => false,
    }
}

/// Black, for sides that reflect nothing.
pub(super) fn black() -> Material {
    Material::Diffuse(Diffuse { reflectance: ColourInput::black(), two_sided: ONE_SIDED })
}

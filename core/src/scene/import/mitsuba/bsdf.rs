//! Mitsuba's surfaces: diffuse, conductor, dielectric, the rough ones with a GGX distribution, and `twosided` around them.

use super::super::xml::Element;
use super::context::Context;
use crate::scene::description::{Colour, Conductor, Dielectric, Diffuse, Distribution, Material, Metal};
use crate::scene::error::{Error, ErrorKind};

/// What Mitsuba gives a shape that names no surface.
pub(super) fn default_material() -> Material {
    Material::Diffuse(Diffuse { reflectance: Colour::grey(0.5).into(), two_sided: false })
}

/// Reads a `<bsdf>`.
pub(super) fn read(context: &mut Context<'_>, element: &Element) -> Result<Material, Error> {
    if context.kind(element)? != "twosided" {
        return plain(context, element);
    }
    let inner = context.tagged(element, "bsdf");
    let [one] = inner[..] else {
        let found = format!("{} surfaces", inner.len());
        return Err(context.fault(element, ErrorKind::Unsupported, found, "one <bsdf>, the same on both sides"));
    };
    let mut material = plain(context, one)?;
    match &mut material {
        Material::Diffuse(diffuse) => diffuse.two_sided = true,
        Material::Conductor(conductor) => conductor.two_sided = true,
        _ => return Err(context.fault(one, ErrorKind::Invalid, "a transparent surface", "one that only reflects")),
    }
    context.finish(element, "one bsdf")?;
    Ok(material)
}

fn plain(context: &mut Context<'_>, element: &Element) -> Result<Material, Error> {
    let kind = context.kind(element)?;
    let material = match kind.as_str() {
        "diffuse" => {
            let reflectance = context.colour(element, "reflectance")?.unwrap_or(Colour::grey(0.5));
            Material::Diffuse(Diffuse { reflectance: reflectance.into(), two_sided: false })
        }
        "conductor" | "roughconductor" => Material::Conductor(conductor(context, element, kind == "roughconductor")?),
        "dielectric" | "roughdielectric" => Material::Dielectric(dielectric(context, element, kind == "roughdielectric")?),
        _ => {
            let expected = "diffuse, conductor, roughconductor, dielectric, roughdielectric or twosided";
            return Err(context.unsupported(element, expected));
        }
    };
    let expected = match kind.as_str() {
        "diffuse" => "reflectance",
        "conductor" => "material, eta, k and specular_reflectance",
        "roughconductor" => "material, eta, k, specular_reflectance, distribution and alpha",
        "dielectric" => "int_ior, ext_ior, specular_reflectance and specular_transmittance",
        _ => "int_ior, ext_ior, specular_reflectance, specular_transmittance, distribution and alpha",
    };
    context.finish(element, expected)?;
    Ok(material)
}

fn conductor(context: &Context<'_>, element: &Element, rough: bool) -> Result<Conductor, Error> {
    let material = context.word(element, "material")?;
    let (eta, k) = (context.colour(element, "eta")?, context.colour(element, "k")?);
    let (metal, eta, k) = match (material.as_deref(), eta, k) {
        (None, Some(eta), Some(k)) => (None, Some(eta), Some(k)),
        // "none" is Mitsuba's word, and its default, for a mirror that loses nothing.
        (None | Some("none"), None, None) => (None, Some(Colour::grey(0.0)), Some(Colour::WHITE)),
        (Some(symbol), None, None) => {
            let plain = symbol.trim_end_matches("_palik");
            let metal = Metal::ALL.iter().find(|metal| metal.symbol() == plain).ok_or_else(|| {
                let known: Vec<&str> = Metal::ALL.iter().map(|metal| metal.symbol()).collect();
                context.fault(element, ErrorKind::UnknownName, format!("the material {symbol:?}"), format!("none, {}", known.join(", ")))
            })?;
            (Some(*metal), None, None)
        }
        _ => return Err(context.fault(element, ErrorKind::Malformed, "material, eta and k mixed", "either material, or eta and k")),
    };
    let roughness = if rough { roughness(context, element)? } else { 0.0 };
    let reflectance = context.colour(element, "specular_reflectance")?.unwrap_or(Colour::WHITE);
    Ok(Conductor {
        metal,
        eta,
        k,
        roughness: roughness.into(),
        roughness_v: None,
        distribution: Distribution::Ggx,
        energy_conserving: false,
        reflectance: reflectance.into(),
        two_sided: false,
    })
}

fn dielectric(context: &Context<'_>, element: &Element, rough: bool) -> Result<Dielectric, Error> {
    let interior_ior = index_of_refraction(context, element, "int_ior", "bk7")?;
    let exterior_ior = index_of_refraction(context, element, "ext_ior", "air")?;
    let roughness = if rough { roughness(context, element)? } else { 0.0 };
    let reflectance = context.colour(element, "specular_reflectance")?.unwrap_or(Colour::WHITE);
    let transmittance = context.colour(element, "specular_transmittance")?.unwrap_or(Colour::WHITE);
    Ok(Dielectric {
        interior_ior,
        exterior_ior,
        thin: false,
        roughness: roughness.into(),
        roughness_v: None,
        distribution: Distribution::Ggx,
        energy_conserving: false,
        reflectance: reflectance.into(),
        transmittance: transmittance.into(),
    })
}

/// α of a GGX distribution. Mitsuba's default is Beckmann's, which has other tails and is not here.
fn roughness(context: &Context<'_>, element: &Element) -> Result<f64, Error> {
    let distribution = context.word(element, "distribution")?.unwrap_or_else(|| "beckmann".to_string());
    if distribution != "ggx" {
        return Err(context.fault(element, ErrorKind::Unsupported, format!("the distribution {distribution}"), "ggx"));
    }
    // Says how to sample, not what there is.
    context.boolean(element, "sample_visible")?;
    let (u, v) = (context.number(element, "alpha_u")?, context.number(element, "alpha_v")?);
    match (context.number(element, "alpha")?, u, v) {
        (alpha, None, None) => Ok(alpha.unwrap_or(0.1)),
        (None, Some(u), Some(v)) if u == v => Ok(u),
        _ => Err(context.fault(element, ErrorKind::Unsupported, "alpha_u and alpha_v", "one alpha for both directions")),
    }
}

/// A number, or one of Mitsuba's substances.
fn index_of_refraction(context: &Context<'_>, element: &Element, name: &str, default: &str) -> Result<f64, Error> {
    let substance = match context.parameter(element, name)? {
        Some(parameter) if parameter.tag == "string" => context.required(parameter, "value")?,
        Some(_) => return Ok(context.number(element, name)?.unwrap_or_default()),
        None => default.to_string(),
    };
    SUBSTANCES.iter().find(|(known, _)| *known == substance).map(|(_, ior)| *ior).ok_or_else(|| {
        let known: Vec<&str> = SUBSTANCES.iter().map(|(known, _)| *known).collect();
        context.fault(element, ErrorKind::UnknownName, format!("{name} {substance:?}"), format!("a number or one of {}", known.join(", ")))
    })
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

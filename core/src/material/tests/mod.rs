//! Laws that every material keeps: sampling matches density, energy is not created, scattering is reciprocal, nothing breaks at the limits.

mod energy;
mod inputs;
mod limits;
mod mitsuba;
mod reciprocity;
mod sampling;

use super::*;
use crate::sampling::{Dimension, SampleKey, SampleStream};
use crate::spectrum::Spectrum;
use crate::texture::{ScalarInput, TexturePoint};

/// A material at a point.
#[derive(Clone, Debug)]
struct Subject(Material);

impl<T: Into<Material>> From<T> for Subject {
    fn from(material: T) -> Self {
        Self(material.into())
    }
}

impl Subject {
    fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        self.0.evaluate(&TexturePoint::default(), wo, wi)
    }

    fn evaluate_delta(&self, wo: Vec3, transmits: bool) -> Evaluation {
        self.0.evaluate_delta(&TexturePoint::default(), wo, transmits)
    }

    fn delta_probability(&self, wo: Vec3) -> f32 {
        self.0.delta_probability(&TexturePoint::default(), wo)
    }

    fn sample(&self, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        self.0.sample(&TexturePoint::default(), wo, choice, u)
    }

    fn relative_ior(&self, wo: Vec3) -> f32 {
        self.0.relative_ior(&TexturePoint::default(), wo)
    }
}

/// A material under test.
struct Case {
    /// What to call it.
    name: &'static str,
    bsdf: Subject,
    /// Bounds of its albedo for white parameters, over all views, after undoing the compression of radiance on crossing.
    albedo: [f64; 2],
}

fn stream(k: u32) -> SampleStream {
    SampleStream::open(SampleKey { seed: 5, frame: 0, x: k, y: 0, index: k % 1024 })
}

/// Samples by the numbers of stream `k`.
fn sample(bsdf: &Subject, wo: Vec3, k: u32) -> Option<Scatter> {
    let s = stream(k);
    bsdf.sample(wo, s.number(Dimension::lobe(9)), s.pair(Dimension::direction(9)))
}

fn views() -> [Vec3; 4] {
    [Vec3::new(0.3, -0.2, 0.9), Vec3::new(0.8, 0.3, 0.25), Vec3::new(-0.4, 0.5, -0.7), Vec3::new(0.7, 0.6, -0.15)].map(Vec3::normalize)
}

fn metal(facets: Option<Microfacets>, conserving: bool) -> Bsdf {
    let (eta, k) = (Spectrum::rgb(0.14, 0.37, 1.44), Spectrum::rgb(3.98, 2.39, 1.6));
    let bounced = if conserving { Bounced::new(eta, k, facets) } else { None };
    Bsdf::Conductor(Conductor { eta, k, reflectance: Spectrum::WHITE, facets, bounced, two_sided: true })
}

/// A metal that absorbs nothing.
fn white_metal(facets: Option<Microfacets>) -> Bsdf {
    let (eta, k) = (Spectrum::BLACK, Spectrum::WHITE);
    Bsdf::Conductor(Conductor { eta, k, reflectance: Spectrum::WHITE, facets, bounced: Bounced::new(eta, k, facets), two_sided: true })
}

fn glass(eta: f32, facets: Option<Microfacets>, conserving: bool) -> Bsdf {
    let bounced = if conserving { BouncedGlass::new(eta, facets) } else { None };
    Bsdf::Dielectric(Dielectric { eta, reflectance: Spectrum::WHITE, transmittance: Spectrum::WHITE, facets, bounced })
}

fn plastic(eta: f32, diffuse: Spectrum, facets: Option<Microfacets>, nonlinear: bool) -> Plastic {
    Plastic { diffuse, specular: Spectrum::WHITE, coat: Coat::new(eta, facets), nonlinear, two_sided: true }
}

const PRINCIPLED: PrincipledParameters = PrincipledParameters {
    base_color: Spectrum::WHITE,
    metallic: 0.0,
    roughness: 0.5,
    anisotropy: 0.0,
    ior: 1.5,
    specular: 1.0,
    specular_color: Spectrum::WHITE,
    clearcoat: 0.0,
    clearcoat_roughness: 0.4,
    sheen_color: Spectrum::BLACK,
    sheen_roughness: 0.5,
    transmission: 0.0,
    thin: false,
    two_sided: true,
};

fn principled(change: impl Fn(&mut PrincipledParameters)) -> Bsdf {
    let mut parameters = PRINCIPLED;
    change(&mut parameters);
    Bsdf::Principled(Principled::new(&parameters))
}

/// Every leaf, in each of its forms.
fn leaves() -> Vec<Case> {
    use Distribution::{Beckmann, Ggx};
    let facets = Microfacets::new;
    let case = |name, bsdf: Bsdf, albedo| Case { name, bsdf: bsdf.into(), albedo };
    let (white, kept) = (Spectrum::WHITE, [0.998, 1.002]);
    let matt = |sigma| Bsdf::RoughDiffuse(RoughDiffuse::new(white, sigma, true));
    let phong = |d: f32, s: f32, exponent| {
        Bsdf::Phong(Phong { diffuse: Spectrum::grey(d), specular: Spectrum::grey(s), exponent, two_sided: true })
    };
    let ward = |d: f32, s: f32, alpha_u, alpha_v| {
        Bsdf::Ward(Ward { diffuse: Spectrum::grey(d), specular: Spectrum::grey(s), alpha_u, alpha_v, two_sided: true })
    };
    let coated = |eta, f, nonlinear| Bsdf::Plastic(plastic(eta, white, f, nonlinear));
    let dull = |eta, f| Bsdf::Plastic(plastic(eta, Spectrum::rgb(0.6, 0.3, 0.1), f, false));
    vec![
        case("diffuse", Bsdf::Diffuse(Diffuse { reflectance: white, two_sided: true }), [0.999, 1.0001]),
        case("rough diffuse 0.2", matt(0.2), kept),
        case("rough diffuse 1", matt(1.0), [0.994, 1.002]),
        case("metal ggx 0.2", metal(facets(Ggx, 0.2, 0.2), false), [0.8, 1.0]),
        case("metal ggx 0.7", metal(facets(Ggx, 0.7, 0.7), false), [0.48, 1.0]),
        case("metal ggx 0.1 0.5", metal(facets(Ggx, 0.1, 0.5), false), [0.74, 1.0]),
        case("metal beckmann 0.3", metal(facets(Beckmann, 0.3, 0.3), false), [0.8, 1.0]),
        case("metal beckmann 0.4 0.15", metal(facets(Beckmann, 0.4, 0.15), false), [0.8, 1.0]),
        case("metal conserving ggx 0.8", metal(facets(Ggx, 0.8, 0.8), true), [0.9, 1.0]),
        case("white metal ggx 0.3", white_metal(facets(Ggx, 0.3, 0.3)), [0.99, 1.01]),
        case("white metal ggx 1", white_metal(facets(Ggx, 1.0, 1.0)), [0.99, 1.01]),
        case("white metal beckmann 0.6", white_metal(facets(Beckmann, 0.6, 0.6)), [0.99, 1.01]),
        case("mirror", metal(None, false), [0.8, 1.0]),
        case("glass ggx 0.15", glass(1.5, facets(Ggx, 0.15, 0.15), false), [0.82, 1.0001]),
        case("glass ggx 0.5", glass(1.5, facets(Ggx, 0.5, 0.5), false), [0.6, 1.0001]),
        case("glass ggx 0.4 0.1", glass(1.5, facets(Ggx, 0.4, 0.1), false), [0.7, 1.0001]),
        case("glass beckmann 0.2", glass(1.33, facets(Beckmann, 0.2, 0.2), false), [0.9, 1.0001]),
        case("bubble ggx 0.3", glass(1.0 / 1.33, facets(Ggx, 0.3, 0.3), false), [0.7, 1.0001]),
        case("glass conserving ggx 0.3", glass(1.5, facets(Ggx, 0.3, 0.3), true), [0.99, 1.01]),
        case("glass conserving ggx 1", glass(1.5, facets(Ggx, 1.0, 1.0), true), [0.985, 1.015]),
        case("glass conserving beckmann 0.5", glass(1.8, facets(Beckmann, 0.5, 0.5), true), [0.99, 1.01]),
        case("clear glass", glass(1.5, None, false), [0.9999, 1.0001]),
        case("sheet", Bsdf::ThinDielectric(ThinDielectric { eta: 1.5, reflectance: white, transmittance: white }), [0.9999, 1.0001]),
        case("plastic", dull(1.5, None), [0.3, 1.0]),
        case("white plastic", coated(1.5, None, false), kept),
        case("white plastic nonlinear", coated(1.5, None, true), kept),
        case("plastic ggx 0.2", dull(1.5, facets(Ggx, 0.2, 0.2)), [0.3, 1.0]),
        case("white plastic ggx 0.15", coated(1.49, facets(Ggx, 0.15, 0.15), false), [0.8, 1.001]),
        case("white plastic beckmann 0.4", coated(1.6, facets(Beckmann, 0.4, 0.4), true), [0.75, 1.001]),
        case("phong 30", phong(0.5, 0.5, 30.0), [0.59, 1.0001]),
        case("phong 2", phong(0.2, 0.8, 2.0), [0.3, 1.0001]),
        case("ward 0.2", ward(0.5, 0.5, 0.2, 0.2), [0.5, 1.0001]),
        case("ward 0.1 0.4", ward(0.3, 0.7, 0.1, 0.4), [0.3, 1.0001]),
        case("principled", principled(|_| ()), [0.95, 1.002]),
        case("principled polished", principled(|p| p.roughness = 0.3), [0.95, 1.002]),
        case("principled metal", principled(|p| (p.metallic, p.anisotropy) = (1.0, 0.6)), [0.7, 1.002]),
        case("principled half metal", principled(|p| (p.metallic, p.anisotropy) = (0.5, -0.5)), [0.8, 1.002]),
        case("principled coated", principled(|p| p.clearcoat = 1.0), [0.69, 1.002]),
        case("principled coated roughly", principled(|p| (p.clearcoat, p.clearcoat_roughness) = (1.0, 1.0)), [0.53, 1.002]),
        case("principled cloth", principled(|p| p.sheen_color = Spectrum::grey(1.0)), [0.6, 1.002]),
        case("principled silk", principled(|p| (p.sheen_color, p.sheen_roughness) = (Spectrum::rgb(1.0, 0.5, 0.2), 0.2)), [0.6, 1.002]),
        case("principled glass", principled(|p| (p.transmission, p.roughness) = (1.0, 0.4)), [0.8, 1.002]),
        case("principled wall", principled(|p| (p.transmission, p.thin) = (0.7, true)), [0.8, 1.002]),
        case(
            "principled everything",
            principled(|p| {
                (p.metallic, p.transmission, p.clearcoat, p.anisotropy) = (0.2, 0.5, 0.7, 0.3);
                (p.sheen_color, p.specular, p.base_color) = (Spectrum::grey(0.4), 0.6, Spectrum::rgb(0.9, 0.5, 0.2));
            }),
            [0.2, 1.002],
        ),
        case("null", Bsdf::Null, [0.9999, 1.0001]),
    ]
}

/// Materials made of others.
fn composites() -> Vec<Case> {
    let case = |name, composite: Composite, albedo| Case { name, bsdf: composite.into(), albedo };
    let blend = |first: Material, second: Material, weight| Composite::Blend { first, second, weight: ScalarInput::Constant(weight) };
    let matt = |two_sided| Material::from(Bsdf::Diffuse(Diffuse { reflectance: Spectrum::WHITE, two_sided }));
    let (mirror, brushed) = (Material::from(metal(None, false)), Material::from(metal(Microfacets::ggx(0.3), true)));
    let (clear, frosted) = (Material::from(glass(1.5, None, false)), Material::from(glass(1.5, Microfacets::ggx(0.4), true)));
    let coated = |facets| Material::from(Bsdf::Plastic(plastic(1.5, Spectrum::WHITE, facets, false)));
    let nested = blend(mirror.clone(), coated(None), 0.6).into();
    vec![
        case("blend of mirror and diffuse", blend(mirror.clone(), matt(true), 0.3), [0.9, 1.0001]),
        case("blend of plastics", blend(coated(None), coated(Microfacets::ggx(0.2)), 0.5), [0.8, 1.002]),
        case("blend of mirror and glass", blend(mirror, clear, 0.5), [0.9, 1.0001]),
        case("blend of frosted glass and metal", blend(frosted, brushed.clone(), 0.25), [0.95, 1.01]),
        case("blend of blends", blend(nested, brushed.clone(), 0.4), [0.8, 1.002]),
        case("blend with nothing", blend(Bsdf::Null.into(), matt(true), 0.7), [0.999, 1.0001]),
        case("blend of one", blend(matt(true), brushed.clone(), 1.0), [0.85, 1.002]),
        case("two sides", Composite::TwoSided { front: matt(false), back: brushed }, [0.85, 1.0001]),
        case("two coated sides", Composite::TwoSided { front: coated(None), back: coated(None) }, [0.998, 1.002]),
    ]
}

/// Every material under test.
fn all() -> Vec<Case> {
    leaves().into_iter().chain(composites()).collect()
}

/// Factor by which a value counts more: radiance is compressed on crossing into a denser medium, which is no loss.
fn crossing(bsdf: &Subject, wo: Vec3, wi: Vec3) -> f32 {
    if wo.z * wi.z < 0.0 { bsdf.relative_ior(wo).powi(2) } else { 1.0 }
}

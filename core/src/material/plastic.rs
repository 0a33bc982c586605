//! Plastics: a diffuse base under a dielectric coat, smooth or rough.

use super::albedo::{ByRoughness, Profile, dielectric_transmittance, mean_dielectric_reflectance};
use super::bsdf::{Evaluation, Scatter};
use super::fresnel;
use super::lobe::{diffuse, diffuse_density, facing, reflects, scattered, split, upper};
use super::microfacet::{Distribution, Microfacets};
use crate::math::Vec3;
use crate::spectrum::Spectrum;

/// A diffuse base under a coat. What the coat throws back onto the base is summed up.
///
/// # Source
/// The model of Mitsuba 3's `plastic` and `roughplastic`, after Weidlich and Wilkie, "Arbitrarily Layered Micro-Facet Surfaces",
/// GRAPHITE 2007.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    /// Albedo of the base [1].
    pub diffuse: Spectrum,
    /// Factor on what the coat reflects [1].
    pub specular: Spectrum,
    /// The coat.
    pub coat: Coat,
    /// Whether light that the coat throws back takes the colour of the base again.
    pub nonlinear: bool,
    /// Whether the back reflects too.
    pub two_sided: bool,
}

/// A dielectric coat, and the light that it lets through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Index of the coat over that outside.
    eta: f32,
    /// Roughness; `None` is smooth.
    facets: Option<Microfacets>,
    /// Fraction let through from outside, for rough coats.
    passed: Profile,
    /// Fraction of diffuse light from below that is thrown back.
    inside: f32,
}

impl Coat {
    /// Of this relative index and roughness.
    pub fn new(eta: f32, facets: Option<Microfacets>) -> Self {
        let mean = |f: Microfacets| Microfacets::new(f.kind(), f.mean_alpha(), f.mean_alpha());
        match facets.and_then(mean) {
            None => Self {
                eta,
                facets: None,
                passed: Profile::new(|cos| 1.0 - fresnel::dielectric(cos, eta).0),
                inside: fresnel::diffuse_dielectric(1.0 / eta),
            },
            Some(round) => {
                let inside = mean_dielectric_reflectance(round, 1.0 / eta);
                Self { eta, facets, passed: dielectric_transmittance(round, eta), inside }
            }
        }
    }

    /// Fraction of light let through at cosθ from outside.
    #[inline]
    fn transmitted(&self, cos: f32) -> f32 {
        match self.facets {
            None => 1.0 - fresnel::dielectric(cos.min(1.0), self.eta).0,
            Some(_) => self.passed.at(cos).clamp(0.0, 1.0),
        }
    }
}

/// Coats of every roughness, for plastics whose roughness comes from a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatTable(Coat, ByRoughness<Coat>);

impl CoatTable {
    /// Of this relative index and distribution. Takes some tens of milliseconds.
    pub fn new(distribution: Distribution, eta: f32) -> Self {
        Self(Coat::new(eta, None), ByRoughness::new(|alpha| Coat::new(eta, Microfacets::new(distribution, alpha, alpha))))
    }

    /// The coat of these facets.
    #[inline]
    pub fn at(&self, facets: Option<Microfacets>) -> Coat {
        let Some(found) = facets else { return self.0 };
        let mix = |a: &Coat, b: &Coat, t: f32| Coat {
            eta: a.eta,
            facets,
            passed: Profile::mix(&a.passed, &b.passed, t),
            inside: a.inside + (b.inside - a.inside) * t,
        };
        self.1.at(found.mean_alpha(), mix)
    }
}

impl Plastic {
    /// Probability of sampling the coat.
    #[inline]
    fn coat_probability(&self, transmitted: f32) -> f32 {
        let (s, d) = (self.specular.mean(), self.diffuse.mean());
        let (coat, base) = ((1.0 - transmitted) * s, transmitted * d);
        if coat + base > 0.0 { coat / (coat + base) } else { 0.0 }
    }

    /// The base seen through the coat, for directions of the upper hemisphere.
    #[inline]
    fn base(&self, transmitted: f32, wi: Vec3) -> Spectrum {
        let Coat { eta, inside, .. } = self.coat;
        let colour = self.diffuse.map(|rho| rho / (1.0 - if self.nonlinear { rho * inside } else { inside }));
        colour * (diffuse_density(wi) * transmitted * self.coat.transmitted(wi.z) / (eta * eta))
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        let Some((wo, wi)) = facing(wo, wi, self.two_sided) else { return Evaluation::NONE };
        let transmitted = self.coat.transmitted(wo.z);
        let p = self.coat_probability(transmitted);
        let base = Evaluation { value: self.base(transmitted, wi), density: (1.0 - p) * diffuse_density(wi) };
        match self.coat.facets.and_then(|facets| facets.reflect(wo, wi)) {
            None => base,
            Some(coat) => {
                let (f, _) = fresnel::dielectric(coat.cos.min(1.0), self.coat.eta);
                Evaluation { value: base.value + self.specular * (f * coat.value), density: base.density + p * coat.density }
            }
        }
    }

    #[inline]
    pub(super) fn delta_probability(&self, wo: Vec3) -> f32 {
        if self.coat.facets.is_some() || !reflects(wo, self.two_sided) {
            return 0.0;
        }
        self.coat_probability(self.coat.transmitted(wo.z.abs()))
    }

    #[inline]
    pub(super) fn evaluate_delta(&self, wo: Vec3, transmits: bool) -> Evaluation {
        if transmits || self.coat.facets.is_some() || !reflects(wo, self.two_sided) {
            return Evaluation::NONE;
        }
        let transmitted = self.coat.transmitted(wo.z.abs());
        Evaluation { value: self.specular * (1.0 - transmitted), density: self.coat_probability(transmitted) }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        if !reflects(wo, self.two_sided) {
            return None;
        }
        let up = upper(wo, wo);
        let (coat, _) = split(choice, self.coat_probability(self.coat.transmitted(up.z)));
        let wi = match (coat, self.coat.facets) {
            (true, None) => {
                let evaluation = self.evaluate_delta(wo, false);
                return Some(Scatter { wi: Vec3::new(-wo.x, -wo.y, wo.z), evaluation, delta: true });
            }
            (true, Some(facets)) => facets.sample_reflection(up, u)?,
            (false, _) => diffuse(u)?,
        };
        let wi = upper(wi, wo);
        scattered(wi, self.evaluate(wo, wi))
    }

    pub(super) fn roughness(&self) -> f32 {
        self.coat.facets.map_or(1.0, |f| f.alpha())
    }

    pub(super) fn albedo(&self) -> Spectrum {
        self.diffuse
    }
}

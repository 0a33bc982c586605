//! Metals, smooth and rough.

use super::albedo::facet_albedo;
use super::bsdf::{Evaluation, Scatter};
use super::fresnel;
use super::lobe::{diffuse, diffuse_density, facing, reflects, scattered, split, upper};
use super::microfacet::Microfacets;
use crate::math::Vec3;
use crate::spectrum::Spectrum;

/// A metal with complex index of refraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// Real part of the index, relative to the outside.
    pub eta: Spectrum,
    /// Imaginary part (absorption).
    pub k: Spectrum,
    /// Factor on the reflectance [1].
    pub reflectance: Spectrum,
    /// Roughness; `None` is a mirror.
    pub facets: Option<Microfacets>,
    /// Light that bounces between facets; `None` leaves it out.
    pub bounced: Option<Bounced>,
    /// Whether the back reflects too.
    pub two_sided: bool,
}

/// The light that leaves a rough metal after several bounces between its facets, as a wide lobe that makes up for what the first bounce loses.
///
/// # Source
/// Kulla and Conty, "Revisiting Physically Based Shading at Imageworks", SIGGRAPH 2017 course; tint with the factor F̄² of Hill, "A
/// Multi-Faceted Exploration", 2018.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounced {
    /// Fraction of the lost light that comes back.
    tint: Spectrum,
    /// Mean fraction lost.
    lost: f32,
}

impl Bounced {
    /// For a metal of these facets; `None` for a mirror and for facets so flat that they lose less than 0.2 %.
    pub fn new(eta: Spectrum, k: Spectrum, facets: Option<Microfacets>) -> Option<Self> {
        Self::of(fresnel::diffuse_conductor(eta, k), facets)
    }

    /// The same by the fraction of diffuse light that the metal reflects.
    #[inline]
    pub fn of(fresnel: Spectrum, facets: Option<Microfacets>) -> Option<Self> {
        let kept = facet_albedo(&facets?, None).white;
        let tint = fresnel.map(|f| f * f * kept / (1.0 - f * (1.0 - kept)));
        (kept < 0.998).then_some(Self { tint, lost: 1.0 - kept })
    }
}

/// Fraction of light that the first bounce loses for a white metal.
#[inline]
fn lost(facets: &Microfacets, w: Vec3) -> f32 {
    1.0 - facet_albedo(facets, Some(w.z)).white
}

impl Conductor {
    #[inline]
    fn fresnel(&self, cos: f32) -> Spectrum {
        fresnel::conductor(cos.min(1.0), self.eta, self.k) * self.reflectance
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        let (Some(facets), Some((wo, wi))) = (self.facets, facing(wo, wi, self.two_sided)) else { return Evaluation::NONE };
        let Some(first) = facets.reflect(wo, wi) else { return Evaluation::NONE };
        let once = Evaluation { value: self.fresnel(first.cos) * first.value, density: first.density };
        let Some(bounced) = self.bounced else { return once };
        let (out, back) = (lost(&facets, wo), lost(&facets, wi));
        let wide = diffuse_density(wi);
        let value = once.value + self.reflectance * bounced.tint * (wide * out * back / bounced.lost);
        Evaluation { value, density: once.density * (1.0 - out) + wide * out }
    }

    #[inline]
    pub(super) fn evaluate_delta(&self, wo: Vec3, transmits: bool) -> Evaluation {
        if self.facets.is_some() || transmits || !reflects(wo, self.two_sided) {
            return Evaluation::NONE;
        }
        Evaluation { value: self.fresnel(wo.z.abs()), density: 1.0 }
    }

    #[inline]
    pub(super) fn delta_probability(&self) -> f32 {
        if self.facets.is_none() { 1.0 } else { 0.0 }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        if !reflects(wo, self.two_sided) {
            return None;
        }
        let Some(facets) = self.facets else {
            return Some(Scatter { wi: Vec3::new(-wo.x, -wo.y, wo.z), evaluation: self.evaluate_delta(wo, false), delta: true });
        };
        let up = upper(wo, wo);
        let wide = self.bounced.is_some() && split(choice, lost(&facets, up)).0;
        let wi = if wide { diffuse(u)? } else { facets.sample_reflection(up, u)? };
        let wi = upper(wi, wo);
        scattered(wi, self.evaluate(wo, wi))
    }

    pub(super) fn roughness(&self) -> f32 {
        self.facets.map_or(0.0, |f| f.alpha())
    }

    pub(super) fn albedo(&self) -> Spectrum {
        self.fresnel(1.0)
    }
}

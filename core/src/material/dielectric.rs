//! Boundaries between transparent media, smooth and rough.

use super::bounced_glass::BouncedGlass;
use super::bsdf::{Evaluation, Scatter};
use super::fresnel;
use super::lobe::{diffuse, diffuse_density, scattered, split};
use super::microfacet::Microfacets;
use crate::math::Vec3;
use crate::spectrum::Spectrum;

/// A dielectric boundary. Radiance is scaled by the squared relative index when it crosses (Veach 1997, section 5.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index inside (behind the front) over index outside.
    pub eta: f32,
    /// Factor on what is reflected [1].
    pub reflectance: Spectrum,
    /// Factor on what is transmitted [1].
    pub transmittance: Spectrum,
    /// Roughness; `None` is smooth.
    pub facets: Option<Microfacets>,
    /// Light that bounces between facets; `None` leaves it out.
    pub bounced: Option<BouncedGlass>,
}

impl Dielectric {
    #[inline]
    pub(super) fn relative_ior(&self, wo: Vec3) -> f32 {
        if wo.z >= 0.0 { self.eta } else { 1.0 / self.eta }
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        let Some(facets) = self.facets else { return Evaluation::NONE };
        if wo.z == 0.0 || wi.z == 0.0 {
            return Evaluation::NONE;
        }
        let once = self.once(facets, wo, wi);
        let Some(bounced) = &self.bounced else { return once };
        let transmits = wo.z * wi.z < 0.0;
        let (lost, coupled) = bounced.coupling(wo, wi);
        let share = if transmits { 1.0 - bounced.reflected(wo) } else { bounced.reflected(wo) };
        let wide = diffuse_density(wi) * share;
        let tint = if transmits { self.transmittance / (self.relative_ior(wo) * self.relative_ior(wo)) } else { self.reflectance };
        Evaluation { value: once.value + tint * (wide * coupled), density: once.density * (1.0 - lost) + wide * lost }
    }

    /// Light that meets one facet.
    #[inline]
    fn once(&self, facets: Microfacets, wo: Vec3, wi: Vec3) -> Evaluation {
        let eta = self.relative_ior(wo);
        let transmits = wo.z * wi.z < 0.0;
        // The half vector of refraction is wo + η wi (Walter et al. 2007, eq. 16); both point to the side of wo here.
        let raw = if transmits { wo + wi * eta } else { wo + wi };
        let length2 = raw.length_squared();
        if length2 == 0.0 {
            return Evaluation::NONE;
        }
        let mut h = raw / length2.sqrt();
        if h.z * wo.z < 0.0 {
            h = -h;
        }
        let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
        // A microfacet seen from its back carries no light.
        if cos_o <= 0.0 || cos_i * wi.z * wo.z <= 0.0 {
            return Evaluation::NONE;
        }
        let up = |w: Vec3| if wo.z < 0.0 { -w } else { w };
        let (f, _) = fresnel::dielectric(cos_o.min(1.0), eta);
        let normal_density = facets.density(up(wo), up(h));
        let shadow = facets.visible(wi);
        if transmits {
            let denominator = cos_o + eta * cos_i;
            let jacobian = cos_i.abs() * eta * eta / (denominator * denominator);
            let density = (1.0 - f) * normal_density * jacobian;
            if !density.is_finite() {
                return Evaluation::NONE;
            }
            Evaluation { value: self.transmittance * (density * shadow / (eta * eta)), density }
        } else {
            let density = f * normal_density / (4.0 * cos_o);
            Evaluation { value: self.reflectance * (density * shadow), density }
        }
    }

    #[inline]
    pub(super) fn evaluate_delta(&self, wo: Vec3, transmits: bool) -> Evaluation {
        if self.facets.is_some() {
            return Evaluation::NONE;
        }
        let eta = self.relative_ior(wo);
        let (f, _) = fresnel::dielectric(wo.z.abs().min(1.0), eta);
        if transmits {
            Evaluation { value: self.transmittance * ((1.0 - f) / (eta * eta)), density: 1.0 - f }
        } else {
            Evaluation { value: self.reflectance * f, density: f }
        }
    }

    #[inline]
    pub(super) fn delta_probability(&self) -> f32 {
        if self.facets.is_none() { 1.0 } else { 0.0 }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        if wo.z == 0.0 {
            return None;
        }
        let mut choice = choice;
        if let Some(bounced) = &self.bounced {
            let (wide, rest) = split(choice, bounced.lost(wo));
            if wide {
                let (stays, _) = split(rest, bounced.reflected(wo));
                let up = diffuse(u)?;
                let wi = if (wo.z > 0.0) == stays { up } else { -up };
                return scattered(wi, self.evaluate(wo, wi));
            }
            choice = rest;
        }
        let eta = self.relative_ior(wo);
        let up = if wo.z < 0.0 { -wo } else { wo };
        let h = self.facets.map_or(Vec3::Z, |facets| facets.sample(up, u));
        let cos_o = up.dot(h).min(1.0);
        if cos_o <= 0.0 {
            return None;
        }
        let (f, cos_t) = fresnel::dielectric(cos_o, eta);
        let transmits = choice >= f;
        let wi = if transmits { h * (cos_o / eta - cos_t) - up / eta } else { h * (2.0 * cos_o) - up };
        if (wi.z < 0.0) != transmits || wi.z == 0.0 {
            return None;
        }
        let wi = if wo.z < 0.0 { -wi } else { wi };
        let delta = self.facets.is_none();
        let evaluation = if delta { self.evaluate_delta(wo, transmits) } else { self.evaluate(wo, wi) };
        (evaluation.density > 0.0).then_some(Scatter { wi, evaluation, delta })
    }

    pub(super) fn roughness(&self) -> f32 {
        self.facets.map_or(0.0, |f| f.alpha())
    }
}

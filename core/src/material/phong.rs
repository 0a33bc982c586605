//! Phong's glossy lobe over a diffuse base, for old scenes.

use super::bsdf::{Evaluation, Scatter};
use super::lobe::{diffuse, diffuse_density, facing, reflects, scattered, split, upper};
use crate::math::{Frame, INV_PI, PI, Vec3, sin_cos};
use crate::spectrum::Spectrum;

/// The modified Phong model, normalised so that it conserves energy where diffuse and specular sum to 1 or less.
///
/// # Source
/// Lafortune and Willems, "Using the Modified Phong Reflectance Model for Physically Based Rendering", KU Leuven CW 197, 1994.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    /// Fraction reflected diffusely [1].
    pub diffuse: Spectrum,
    /// Fraction reflected about the mirror direction, at normal incidence [1].
    pub specular: Spectrum,
    /// The power n ≥ 0 of the cosine.
    pub exponent: f32,
    /// Whether the back reflects too.
    pub two_sided: bool,
}

impl Phong {
    #[inline]
    fn glossy_probability(&self) -> f32 {
        let (s, d) = (self.specular.mean(), self.diffuse.mean());
        if s + d > 0.0 { s / (s + d) } else { 0.0 }
    }

    /// cosⁿ of the angle to the mirror direction. The angle comes from the chord, which keeps its digits where the lobe is sharp.
    #[inline]
    fn power(&self, wo: Vec3, wi: Vec3) -> f32 {
        let versine = 0.5 * (Vec3::new(-wo.x, -wo.y, wo.z) - wi).length_squared();
        if versine >= 1.0 { 0.0 } else { libm::expf(self.exponent * libm::log1pf(-versine)) }
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        let Some((wo, wi)) = facing(wo, wi, self.two_sided) else { return Evaluation::NONE };
        let power = self.power(wo, wi) * (0.5 * INV_PI);
        let (p, wide) = (self.glossy_probability(), diffuse_density(wi));
        let value = self.diffuse * wide + self.specular * ((self.exponent + 2.0) * power * wi.z);
        Evaluation { value, density: (1.0 - p) * wide + p * (self.exponent + 1.0) * power }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        if !reflects(wo, self.two_sided) {
            return None;
        }
        let up = upper(wo, wo);
        let wi = if split(choice, self.glossy_probability()).0 {
            let versine = -libm::expm1f(libm::logf(1.0 - u[0]) / (self.exponent + 1.0));
            let r = (versine * (2.0 - versine)).max(0.0).sqrt();
            let (s, c) = sin_cos(2.0 * PI * u[1]);
            let wi = Frame::from_normal(Vec3::new(-up.x, -up.y, up.z)).to_world(Vec3::new(r * c, r * s, 1.0 - versine));
            if wi.z <= 0.0 {
                return None;
            }
            wi
        } else {
            diffuse(u)?
        };
        let wi = upper(wi, wo);
        scattered(wi, self.evaluate(wo, wi))
    }

    /// Roughness α of the Beckmann lobe of the same width.
    pub(super) fn roughness(&self) -> f32 {
        if self.specular.is_black() { 1.0 } else { (2.0 / (self.exponent + 2.0)).sqrt() }
    }

    pub(super) fn albedo(&self) -> Spectrum {
        self.diffuse + self.specular
    }
}

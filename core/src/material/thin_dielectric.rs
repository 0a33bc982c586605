//! Thin sheets of glass.

use super::bsdf::{Evaluation, Scatter};
use super::fresnel;
use crate::math::Vec3;
use crate::spectrum::Spectrum;

/// A smooth sheet so thin that light leaves it where it entered, in its old direction. All reflections inside are summed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    /// Index of the sheet over that around it.
    pub eta: f32,
    /// Factor on what is reflected [1].
    pub reflectance: Spectrum,
    /// Factor on what is transmitted [1].
    pub transmittance: Spectrum,
}

impl ThinDielectric {
    /// Fraction reflected: R + T R T + T R³ T + … = 2R/(1 + R), with the reflectance R of one boundary.
    #[inline]
    fn reflected(&self, wo: Vec3) -> f32 {
        let (f, _) = fresnel::dielectric(wo.z.abs().min(1.0), self.eta);
        2.0 * f / (1.0 + f)
    }

    #[inline]
    pub(super) fn evaluate_delta(&self, wo: Vec3, transmits: bool) -> Evaluation {
        let reflected = self.reflected(wo);
        if transmits {
            Evaluation { value: self.transmittance * (1.0 - reflected), density: 1.0 - reflected }
        } else {
            Evaluation { value: self.reflectance * reflected, density: reflected }
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, choice: f32) -> Option<Scatter> {
        if wo.z == 0.0 {
            return None;
        }
        let transmits = choice >= self.reflected(wo);
        let wi = if transmits { -wo } else { Vec3::new(-wo.x, -wo.y, wo.z) };
        let evaluation = self.evaluate_delta(wo, transmits);
        (evaluation.density > 0.0).then_some(Scatter { wi, evaluation, delta: true })
    }
}

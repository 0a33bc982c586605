//! Metals, smooth and rough.

use super::fresnel;
use super::microfacet::Ggx;
use super::{Evaluation, Scatter};
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
    pub ggx: Option<Ggx>,
    /// Whether the back reflects too.
    pub two_sided: bool,
}

impl Conductor {
    #[inline]
    fn reflects(&self, wo: Vec3) -> bool {
        wo.z > 0.0 || (wo.z < 0.0 && self.two_sided)
    }

    #[inline]
    fn fresnel(&self, cos: f32) -> Spectrum {
        fresnel::conductor(cos, self.eta, self.k) * self.reflectance
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        let Some(ggx) = self.ggx else { return Evaluation::NONE };
        if wo.z * wi.z <= 0.0 || !self.reflects(wo) {
            return Evaluation::NONE;
        }
        let (wo, wi) = (upper(wo, wo), upper(wi, wo));
        let h = (wo + wi).normalize();
        let d = ggx.distribution(h);
        let visible = ggx.visible(wo);
        let common = d * visible / (4.0 * wo.z);
        Evaluation { value: self.fresnel(wo.dot(h)) * (common * ggx.visible(wi)), density: common }
    }

    #[inline]
    pub(super) fn evaluate_delta(&self, wo: Vec3, transmits: bool) -> Evaluation {
        if self.ggx.is_some() || transmits || !self.reflects(wo) {
            return Evaluation::NONE;
        }
        Evaluation { value: self.fresnel(wo.z.abs()), density: 1.0 }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<Scatter> {
        if !self.reflects(wo) {
            return None;
        }
        match self.ggx {
            None => Some(Scatter { wi: Vec3::new(-wo.x, -wo.y, wo.z), evaluation: self.evaluate_delta(wo, false), delta: true }),
            Some(ggx) => {
                let up = upper(wo, wo);
                let h = ggx.sample(up, u);
                let wi = h * (2.0 * up.dot(h)) - up;
                let wi = upper(wi, wo);
                let evaluation = self.evaluate(wo, wi);
                (evaluation.density > 0.0).then_some(Scatter { wi, evaluation, delta: false })
            }
        }
    }

    pub(super) fn roughness(&self) -> f32 {
        self.ggx.map_or(0.0, |g| g.alpha())
    }

    pub(super) fn albedo(&self) -> Spectrum {
        self.fresnel(1.0)
    }
}

/// `w` mirrored at the surface if `side` lies below it.
#[inline]
fn upper(w: Vec3, side: Vec3) -> Vec3 {
    if side.z < 0.0 { Vec3::new(w.x, w.y, -w.z) } else { w }
}

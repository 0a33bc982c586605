//! Lambertian reflection.

use super::{Evaluation, Scatter};
use crate::math::{INV_PI, Vec3};
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_density};
use crate::spectrum::Spectrum;

/// Reflects equally in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Albedo [1], 0..=1 to conserve energy.
    pub reflectance: Spectrum,
    /// Whether the back reflects too.
    pub two_sided: bool,
}

impl Diffuse {
    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        if wo.z * wi.z <= 0.0 || (wo.z < 0.0 && !self.two_sided) {
            return Evaluation::NONE;
        }
        let cos = wi.z.abs();
        Evaluation { value: self.reflectance * (INV_PI * cos), density: cosine_hemisphere_density(cos) }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<Scatter> {
        if wo.z == 0.0 || (wo.z < 0.0 && !self.two_sided) {
            return None;
        }
        let mut wi = cosine_hemisphere(u);
        let density = cosine_hemisphere_density(wi.z);
        if density <= 0.0 {
            return None;
        }
        wi.z = wi.z.copysign(wo.z);
        Some(Scatter { wi, evaluation: Evaluation { value: self.reflectance * density, density }, delta: false })
    }
}

//! Matt surfaces of small facets, each ideally diffuse.

use super::bsdf::{Evaluation, Scatter};
use super::lobe::{diffuse, diffuse_density, facing, reflects, scattered, upper};
use crate::math::{INV_PI, PI, Vec3};
use crate::spectrum::Spectrum;

/// Oren and Nayar's surface in a form that keeps all light: white stays white at every roughness.
///
/// # Source
/// Portsmouth, Kutz and Hill, "EON: A Practical Energy-Preserving Rough Diffuse BRDF", JCGT 14(1), 2025.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDiffuse {
    /// Albedo of each facet [1].
    reflectance: Spectrum,
    /// The paper's r in [0, 1].
    roughness: f32,
    /// Whether the back reflects too.
    two_sided: bool,
}

/// ½ − 2/(3π).
const FLAT: f32 = 0.5 - 2.0 / (3.0 * PI);
/// ⅔ − 28/(15π).
const MEAN: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

impl RoughDiffuse {
    /// Of facets whose slope angle has the standard deviation `sigma` [rad].
    ///
    /// The paper's roughness weighs the second term against the first, as B/A does in Oren and Nayar's qualitative model
    /// (SIGGRAPH 1994, eq. 30): r = B/A.
    pub fn new(reflectance: Spectrum, sigma: f32, two_sided: bool) -> Self {
        let s2 = sigma * sigma;
        let (a, b) = (1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09));
        Self { reflectance, roughness: (b / a).clamp(0.0, 1.0), two_sided }
    }

    /// Albedo of white facets by one bounce; the polynomial is the paper's, to 0.1 %.
    #[inline]
    fn once(&self, cos: f32) -> f32 {
        let x = 1.0 - cos.min(1.0);
        let g = x * (0.057_108_53 + x * (0.491_881_87 + x * (-0.332_181_44 + x * 0.071_443)));
        (1.0 + self.roughness * g) / (1.0 + FLAT * self.roughness)
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        let Some((wo, wi)) = facing(wo, wi, self.two_sided) else { return Evaluation::NONE };
        let flat = 1.0 / (1.0 + FLAT * self.roughness);
        let s = wo.dot(wi) - wo.z * wi.z;
        let retro = if s > 0.0 { s / wo.z.max(wi.z) } else { s };
        let single = flat * (1.0 + self.roughness * retro);
        let mean = flat * (1.0 + MEAN * self.roughness);
        // What one bounce loses comes back, coloured once more by each further bounce.
        let lost = (1.0 - self.once(wo.z)) * (1.0 - self.once(wi.z)) / (1.0 - mean).max(1e-6);
        let colour = self.reflectance.map(|rho| rho * single + rho * rho * mean / (1.0 - rho * (1.0 - mean)) * lost.max(0.0));
        Evaluation { value: colour * (INV_PI * wi.z), density: diffuse_density(wi) }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<Scatter> {
        if !reflects(wo, self.two_sided) {
            return None;
        }
        let wi = upper(diffuse(u)?, wo);
        scattered(wi, self.evaluate(wo, wi))
    }

    pub(super) fn albedo(&self) -> Spectrum {
        self.reflectance
    }
}

//! The GGX distribution of microfacet normals, sampled by visible normals.

use crate::math::{INV_PI, PI, Vec3, safe_sqrt, sin_cos};

/// Isotropic GGX (Trowbridge–Reitz) with Smith's separable shadowing.
///
/// # Source
/// Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    alpha: f32,
}

impl Ggx {
    /// Smallest roughness that is told from a mirror: below it f32 cannot resolve the lobe.
    pub const SHARPEST: f32 = 1e-4;

    /// Of the given roughness; `None` for 0, which is a mirror. Values in between are raised to [`Ggx::SHARPEST`].
    pub fn new(alpha: f32) -> Option<Self> {
        (alpha > 0.0).then(|| Self { alpha: alpha.max(Self::SHARPEST) })
    }

    /// Roughness.
    #[inline]
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    /// D(h) [sr⁻¹], for `h` in the upper hemisphere.
    #[inline]
    pub(super) fn distribution(&self, h: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        let e = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
        INV_PI / (a2 * e * e)
    }

    /// Smith's G₁: the visible fraction of the microfacets that face `w`.
    #[inline]
    pub(super) fn visible(&self, w: Vec3) -> f32 {
        let z2 = w.z * w.z;
        if z2 == 0.0 {
            return 0.0;
        }
        let tan2 = (w.x * w.x + w.y * w.y) / z2;
        2.0 / (1.0 + safe_sqrt(1.0 + self.alpha * self.alpha * tan2))
    }

    /// Density of [`sample`](Self::sample) [sr⁻¹].
    #[inline]
    pub(super) fn density(&self, wo: Vec3, h: Vec3) -> f32 {
        self.visible(wo) * wo.dot(h).max(0.0) * self.distribution(h) / wo.z.abs()
    }

    /// A microfacet normal visible from `wo`, which must lie in the upper hemisphere.
    ///
    /// # Source
    /// Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", HPG 2023.
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let stretched = Vec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z).normalize();
        let z = (1.0 - u[0]) * (1.0 + stretched.z) - stretched.z;
        let r = safe_sqrt(1.0 - z * z);
        let (s, c) = sin_cos(2.0 * PI * u[1]);
        let h = Vec3::new(r * c, r * s, z) + stretched;
        Vec3::new(self.alpha * h.x, self.alpha * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
    }
}

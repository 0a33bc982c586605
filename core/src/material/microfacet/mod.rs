//! Distributions of microfacet normals, sampled by those that are visible.
//!
//! Everything is written by the projected area σ(w) of the facets that `w` sees: Smith's G₁(w) is w.z/σ(w), and the density of
//! visible normals is D(h)·(w·h)/σ(w), both finite at grazing angles.

mod beckmann;
mod error_function;
mod ggx;

use crate::math::{Vec3, safe_sqrt};

/// Which distribution of facets a rough surface has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Trowbridge and Reitz's, with long tails.
    Ggx,
    /// Beckmann's, with short ones.
    Beckmann,
}

/// The facets of a rough surface, with Smith's separable shadowing.
///
/// # Source
/// Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007; anisotropic forms by Heitz, JCGT 3(2), 2014.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacets {
    distribution: Distribution,
    alpha_u: f32,
    alpha_v: f32,
}

/// A reflection off facets, before Fresnel's factor.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacetReflection {
    /// Value of a white mirror's facets, times |cosθᵢ| [sr⁻¹].
    pub value: f32,
    /// Density of sampling visible normals [sr⁻¹].
    pub density: f32,
    /// Cosine between either direction and the facet's normal.
    pub cos: f32,
}

impl Microfacets {
    /// Smallest roughness that is told from a mirror: below it f32 cannot resolve the lobe.
    pub const SHARPEST: f32 = 1e-4;

    /// Of roughness α along x and y; `None` where both are 0, which is a mirror. Other values are raised to
    /// [`SHARPEST`](Self::SHARPEST).
    pub fn new(distribution: Distribution, alpha_u: f32, alpha_v: f32) -> Option<Self> {
        let raised = |alpha: f32| alpha.max(Self::SHARPEST);
        (alpha_u > 0.0 || alpha_v > 0.0).then(|| Self { distribution, alpha_u: raised(alpha_u), alpha_v: raised(alpha_v) })
    }

    /// GGX of the same roughness α in all directions; `None` for 0, which is a mirror.
    pub fn ggx(alpha: f32) -> Option<Self> {
        Self::new(Distribution::Ggx, alpha, alpha)
    }

    /// GGX that is never a mirror: roughness below [`SHARPEST`](Self::SHARPEST) is raised to it.
    pub fn ggx_at_least(alpha_u: f32, alpha_v: f32) -> Self {
        Self { distribution: Distribution::Ggx, alpha_u: alpha_u.max(Self::SHARPEST), alpha_v: alpha_v.max(Self::SHARPEST) }
    }

    /// The smaller roughness α.
    #[inline]
    pub fn alpha(&self) -> f32 {
        self.alpha_u.min(self.alpha_v)
    }

    /// Whether both roughnesses differ.
    #[inline]
    pub fn is_anisotropic(&self) -> bool {
        self.alpha_u != self.alpha_v
    }

    /// Roughness α of the isotropic surface that stands for this one in tables of albedo.
    #[inline]
    pub(super) fn mean_alpha(&self) -> f32 {
        if self.alpha_u == self.alpha_v { self.alpha_u } else { (self.alpha_u * self.alpha_v).sqrt() }
    }

    /// Which distribution.
    #[inline]
    pub(super) fn kind(&self) -> Distribution {
        self.distribution
    }

    /// D(h) [sr⁻¹], for `h` in the upper hemisphere.
    #[inline]
    pub(super) fn density_of_normals(&self, h: Vec3) -> f32 {
        match self.distribution {
            Distribution::Ggx => ggx::density_of_normals(h, self.alpha_u, self.alpha_v),
            Distribution::Beckmann => beckmann::density_of_normals(h, self.alpha_u, self.alpha_v),
        }
    }

    /// σ(w) ≥ |w.z|: the area of the facets that `w` sees, of either side.
    #[inline]
    pub(super) fn projected_area(&self, w: Vec3) -> f32 {
        let (x, y) = (self.alpha_u * w.x, self.alpha_v * w.y);
        let across = safe_sqrt(x * x + y * y);
        match self.distribution {
            Distribution::Ggx => ggx::projected_area(w.z.abs(), across),
            Distribution::Beckmann => beckmann::projected_area(w.z.abs(), across),
        }
    }

    /// Smith's G₁: the visible fraction of the microfacets that face `w`.
    #[inline]
    pub(super) fn visible(&self, w: Vec3) -> f32 {
        if w.z == 0.0 { 0.0 } else { (w.z.abs() / self.projected_area(w)).min(1.0) }
    }

    /// Density of [`sample`](Self::sample) [sr⁻¹].
    #[inline]
    pub(super) fn density(&self, wo: Vec3, h: Vec3) -> f32 {
        wo.dot(h).max(0.0) * self.density_of_normals(h) / self.projected_area(wo)
    }

    /// A microfacet normal visible from `wo`, which must lie in the upper hemisphere.
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let stretched = Vec3::new(self.alpha_u * wo.x, self.alpha_v * wo.y, wo.z).normalize();
        let h = match self.distribution {
            Distribution::Ggx => ggx::sample(stretched, u),
            Distribution::Beckmann => beckmann::sample(stretched, u),
        };
        Vec3::new(self.alpha_u * h.x, self.alpha_v * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
    }

    /// Reflection from `wo` to `wi`, both in the upper hemisphere; `None` where they leave no half vector.
    #[inline]
    pub(super) fn reflect(&self, wo: Vec3, wi: Vec3) -> Option<FacetReflection> {
        let raw = wo + wi;
        let length2 = raw.length_squared();
        if length2 == 0.0 || wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let h = raw / length2.sqrt();
        let density = self.density_of_normals(h) / (4.0 * self.projected_area(wo));
        Some(FacetReflection { value: density * self.visible(wi), density, cos: wo.dot(h) })
    }

    /// The mirror direction at a facet sampled from `wo` in the upper hemisphere; `None` where it points into the surface.
    #[inline]
    pub(super) fn sample_reflection(&self, wo: Vec3, u: [f32; 2]) -> Option<Vec3> {
        let h = self.sample(wo, u);
        let wi = h * (2.0 * wo.dot(h)) - wo;
        (wi.z > 0.0).then_some(wi)
    }
}

#[cfg(test)]
mod tests;

//! Light that leaves rough glass after several bounces between its facets.

use super::albedo::{ByRoughness, Profile, dielectric_albedo};
use super::fresnel;
use super::microfacet::{Distribution, Microfacets};
use crate::math::Vec3;

/// A wide lobe to both sides that makes up for what the first bounce loses.
///
/// Light lost from one side leaves on both, in shares that keep all of it and make the lobe reciprocal: with the mean losses
/// l₊, l₋ of the front and the back and the diffuse reflectances F₊, F₋, the reflected shares are 1 − (1 − F₊)·x and
/// 1 − (1 − F₋)·(1 − x), x = l₋/(l₊ + l₋).
///
/// # Source
/// Kulla and Conty, "Revisiting Physically Based Shading at Imageworks", SIGGRAPH 2017 course, on dielectrics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BouncedGlass {
    /// Fraction lost, seen from the front and from the back.
    lost: [Profile; 2],
    /// Its means.
    mean: [f32; 2],
    /// Diffuse reflectance of the smooth boundary.
    diffuse: [f32; 2],
    /// Reflected share of the lost light.
    reflected: [f32; 2],
}

/// Losses below this are rounding.
const LEAST: f32 = 1e-6;

impl BouncedGlass {
    /// For a boundary of these facets with `eta` behind it; `None` for a smooth one, and where less than 0.2 % is lost.
    pub fn new(eta: f32, facets: Option<Microfacets>) -> Option<Self> {
        let alpha = facets?.mean_alpha();
        Self::of_facets(eta, Microfacets::new(facets?.kind(), alpha, alpha)?).if_noticeable()
    }

    fn of_facets(eta: f32, round: Microfacets) -> Self {
        Self::of(
            eta,
            [eta, 1.0 / eta].map(|eta| {
                let albedo = dielectric_albedo(round, eta);
                Profile::new(|cos| (1.0 - albedo.at(cos)).max(0.0))
            }),
        )
    }

    fn nothing(eta: f32) -> Self {
        Self::of(eta, [Profile::new(|_| 0.0); 2])
    }

    fn of(eta: f32, lost: [Profile; 2]) -> Self {
        let diffuse = [eta, 1.0 / eta].map(fresnel::diffuse_dielectric);
        Self { lost, mean: [0.0; 2], diffuse, reflected: [0.0; 2] }.with_means([lost[0].mean(), lost[1].mean()])
    }

    fn if_noticeable(self) -> Option<Self> {
        (self.mean[0].max(self.mean[1]) > 0.002).then_some(self)
    }

    fn with_means(self, mean: [f32; 2]) -> Self {
        let mean = mean.map(|m| m.max(LEAST));
        let x = mean[1] / (mean[0] + mean[1]);
        let reflected = [1.0 - (1.0 - self.diffuse[0]) * x, 1.0 - (1.0 - self.diffuse[1]) * (1.0 - x)];
        Self { mean, reflected, ..self }
    }

    fn mix(a: &Self, b: &Self, t: f32) -> Self {
        let lost = [Profile::mix(&a.lost[0], &b.lost[0], t), Profile::mix(&a.lost[1], &b.lost[1], t)];
        // The shares follow from the means, so that the lobe stays reciprocal between the rows.
        let mean = [0, 1].map(|side| a.mean[side] + (b.mean[side] - a.mean[side]) * t);
        Self { lost, ..*a }.with_means(mean)
    }

    #[inline]
    fn side(w: Vec3) -> usize {
        usize::from(w.z < 0.0)
    }

    /// Fraction of light from `wo` that the first bounce loses.
    #[inline]
    pub(super) fn lost(&self, wo: Vec3) -> f32 {
        self.lost[Self::side(wo)].at(wo.z).clamp(0.0, 1.0)
    }

    /// Share of the lost light that stays on the side of `wo`.
    #[inline]
    pub(super) fn reflected(&self, wo: Vec3) -> f32 {
        self.reflected[Self::side(wo)]
    }

    /// The loss at `wo`, and the product of the losses at both ends over the mean loss where `wi` is.
    #[inline]
    pub(super) fn coupling(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let lost = self.lost(wo);
        (lost, lost * self.lost(wi) / self.mean[Self::side(wi)])
    }
}

/// The same for every roughness, for glass whose roughness comes from a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct BouncedGlassTable(ByRoughness<BouncedGlass>);

impl BouncedGlassTable {
    /// For boundaries of this distribution with `eta` behind them. Takes some tens of milliseconds.
    pub fn new(distribution: Distribution, eta: f32) -> Self {
        let row = |alpha| {
            Microfacets::new(distribution, alpha, alpha).map_or(BouncedGlass::nothing(eta), |facets| BouncedGlass::of_facets(eta, facets))
        };
        Self(ByRoughness::new(row))
    }

    /// For these facets; `None` where too little is lost.
    #[inline]
    pub fn at(&self, facets: Option<Microfacets>) -> Option<BouncedGlass> {
        self.0.at(facets?.mean_alpha(), BouncedGlass::mix).if_noticeable()
    }
}

//! Albedos of microfacet surfaces, by quadrature over the visible normals. The same numbers on every machine.

use std::sync::LazyLock;

use super::super::fresnel;
use super::super::microfacet::{Distribution, Microfacets};
use super::{ByRoughness, Profile};
use crate::math::Vec3;

/// Side of the grid over the unit square of each quadrature.
const GRID: u32 = 32;

/// Σ over visible normals h seen at cosθ, weighted to one.
fn over_normals(facets: Microfacets, cos: f32, mut f: impl FnMut(Vec3, Vec3) -> f32) -> f32 {
    let wo = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let mut sum = 0.0f64;
    for i in 0..GRID {
        for j in 0..GRID {
            let u = [(i as f32 + 0.5) / GRID as f32, (j as f32 + 0.5) / GRID as f32];
            sum += f64::from(f(wo, facets.sample(wo, u)));
        }
    }
    (sum / f64::from(GRID * GRID)) as f32
}

/// G₁ of the mirror direction, 0 below the horizon.
fn kept(facets: Microfacets, wo: Vec3, h: Vec3) -> f32 {
    let wi = h * (2.0 * wo.dot(h)) - wo;
    if wi.z > 0.0 { facets.visible(wi) } else { 0.0 }
}

/// Weight of the light that the facet `h` reflects.
fn reflected(facets: Microfacets, eta: f32, wo: Vec3, h: Vec3) -> f32 {
    fresnel::dielectric(wo.dot(h).clamp(0.0, 1.0), eta).0 * kept(facets, wo, h)
}

/// Weight of the light that the facet `h` lets through.
fn transmitted(facets: Microfacets, eta: f32, wo: Vec3, h: Vec3) -> f32 {
    let cos_o = wo.dot(h).clamp(0.0, 1.0);
    let (f, cos_t) = fresnel::dielectric(cos_o, eta);
    let through = h * (cos_o / eta - cos_t) - wo / eta;
    if f < 1.0 && through.z < 0.0 { (1.0 - f) * facets.visible(through) } else { 0.0 }
}

/// Fraction of light transmitted by a rough dielectric boundary after meeting one facet, seen at cosθ, with `eta` behind it over in front.
pub(in super::super) fn dielectric_transmittance(facets: Microfacets, eta: f32) -> Profile {
    Profile::new(|cos| over_normals(facets, cos, |wo, h| transmitted(facets, eta, wo, h)))
}

/// Its mean over the hemisphere, weighted by the cosine, taken over 64 even nodes with both ends, as Mitsuba's rough plastic takes it.
/// That is up to 1.5 % less than the integral, which would tell in comparisons.
pub(in super::super) fn mean_dielectric_reflectance(facets: Microfacets, eta: f32) -> f32 {
    let n = 64;
    let sum: f32 = (0..n)
        .map(|i| {
            let cos = (i as f32 / (n - 1) as f32).max(1e-6);
            2.0 * cos * over_normals(facets, cos, |wo, h| reflected(facets, eta, wo, h))
        })
        .sum();
    sum / n as f32
}

/// Fraction of light reflected or transmitted after meeting one facet.
pub(in super::super) fn dielectric_albedo(facets: Microfacets, eta: f32) -> Profile {
    Profile::new(|cos| over_normals(facets, cos, |wo, h| reflected(facets, eta, wo, h) + transmitted(facets, eta, wo, h)))
}

/// Albedos of facets that are white mirrors.
struct Facets {
    /// Reflected once, with reflectance 1.
    white: Profile,
    /// The same with Schlick's factor (1 − cos)⁵ in place of the reflectance.
    schlick: Profile,
    /// Means of both over the hemisphere.
    means: [f32; 2],
}

impl Facets {
    fn new(distribution: Distribution, alpha: f32) -> Option<Self> {
        let facets = Microfacets::new(distribution, alpha, alpha)?;
        let white = Profile::new(|cos| over_normals(facets, cos, |wo, h| kept(facets, wo, h)));
        let schlick = Profile::new(|cos| over_normals(facets, cos, |wo, h| kept(facets, wo, h) * fresnel::schlick_weight(wo.dot(h))));
        let means = [white.mean(), schlick.mean()];
        Some(Self { white, schlick, means })
    }
}

static GGX: LazyLock<ByRoughness<Option<Facets>>> = LazyLock::new(|| ByRoughness::new(|alpha| Facets::new(Distribution::Ggx, alpha)));
static BECKMANN: LazyLock<ByRoughness<Option<Facets>>> =
    LazyLock::new(|| ByRoughness::new(|alpha| Facets::new(Distribution::Beckmann, alpha)));

/// Directional albedo of facets that are mirrors.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct FacetAlbedo {
    /// With reflectance 1 [1].
    pub white: f32,
    /// With Schlick's factor (1 − cos)⁵ as reflectance [1].
    pub schlick: f32,
}

/// The albedo seen at cosθ, or its mean over the hemisphere for `None`. Tables are computed at their first use.
#[inline]
pub(in super::super) fn facet_albedo(facets: &Microfacets, cos: Option<f32>) -> FacetAlbedo {
    let table = match facets.kind() {
        Distribution::Ggx => &GGX,
        Distribution::Beckmann => &BECKMANN,
    };
    let read = |row: &Option<Facets>| match (row, cos) {
        (None, _) => [1.0, 0.0],
        (Some(row), None) => row.means,
        (Some(row), Some(cos)) => [row.white.at(cos), row.schlick.at(cos)],
    };
    table.at(facets.mean_alpha(), |a, b, t| {
        let (a, b) = (read(a), read(b));
        let mixed = |k: usize| (a[k] + (b[k] - a[k]) * t).clamp(0.0, 1.0);
        FacetAlbedo { white: mixed(0), schlick: mixed(1) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn tables_agree_with_quadrature_between_their_nodes() {
        for distribution in [Distribution::Ggx, Distribution::Beckmann] {
            for alpha in [0.013f32, 0.11, 0.37, 0.78, 0.99] {
                let facets = Microfacets::new(distribution, alpha, alpha).unwrap();
                for cos in [0.013f32, 0.07, 0.33, 0.71, 0.98] {
                    let white = over_normals(facets, cos, |wo, h| kept(facets, wo, h));
                    let schlick = over_normals(facets, cos, |wo, h| kept(facets, wo, h) * fresnel::schlick_weight(wo.dot(h)));
                    let found = facet_albedo(&facets, Some(cos));
                    // Sharp lobes bend within a thousandth of the horizon, below the nodes.
                    let tolerance = if alpha < 0.04 { 0.02 } else { 0.005 };
                    assert!((found.white - white).abs() < tolerance, "{distribution:?} {alpha} {cos}: {} against {white}", found.white);
                    assert!(
                        (found.schlick - schlick).abs() < tolerance,
                        "{distribution:?} {alpha} {cos}: {} against {schlick}",
                        found.schlick
                    );
                }
            }
        }
    }

    #[test]
    fn a_smooth_boundary_loses_nothing() {
        let facets = Microfacets::ggx(1e-3).unwrap();
        for eta in [1.5, 1.0 / 1.5] {
            let albedo = dielectric_albedo(facets, eta);
            let passed = dielectric_transmittance(facets, eta);
            for cos in [0.2, 0.5, 0.9] {
                assert!((albedo.at(cos) - 1.0).abs() < 2e-3);
                let fresnel = 1.0 - fresnel::dielectric(cos, eta).0;
                assert!((passed.at(cos) - fresnel).abs() < 0.03, "{eta} {cos}: {} against {fresnel}", passed.at(cos));
            }
        }
    }
}

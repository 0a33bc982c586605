//! The sheen of fabrics: a distribution of fibres, and how much of the light it takes.

use std::sync::LazyLock;

use super::{ByRoughness, Profile};
use crate::math::{INV_PI, PI, Vec3, sin_cos};

/// Smallest roughness α of sheen: below, the lobe is but a line along the horizon. A row of the table, so that it shows there too.
const SHARPEST: f32 = 25.0 / 529.0;

/// Value of white sheen [sr⁻¹], without the cosine, for directions of the upper hemisphere.
///
/// # Source
/// Distribution: Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", SIGGRAPH 2017; visibility: Neubelt and Pettineo,
/// "Crafting a Next-Gen Material Pipeline for The Order: 1886", SIGGRAPH 2013; as in glTF's KHR_materials_sheen.
#[inline]
pub(in super::super) fn charlie(wo: Vec3, wi: Vec3, alpha: f32) -> f32 {
    let inverse = 1.0 / alpha.max(SHARPEST);
    let raw = wo + wi;
    let length2 = raw.length_squared();
    let below = wo.z + wi.z - wo.z * wi.z;
    if length2 == 0.0 || below <= 0.0 {
        return 0.0;
    }
    let sin2 = ((raw.x * raw.x + raw.y * raw.y) / length2).min(1.0);
    let fibres = (2.0 + inverse) * libm::powf(sin2, 0.5 * inverse) * (0.5 * INV_PI);
    fibres / (4.0 * below)
}

static CHARLIE: LazyLock<ByRoughness<Profile>> = LazyLock::new(|| ByRoughness::new(|alpha| Profile::new(|cos| quadrature(cos, alpha))));

/// Albedo of white sheen by the midpoint rule, finer towards the horizon.
fn quadrature(cos: f32, alpha: f32) -> f32 {
    let (rows, columns) = (64, 48);
    let wo = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let mut sum = 0.0f64;
    for i in 0..rows {
        let t = (i as f32 + 0.5) / rows as f32;
        let (z, step) = (t * t, 2.0 * t);
        let r = (1.0 - z * z).sqrt();
        for j in 0..columns {
            // Half the turn is enough: the other half mirrors it.
            let (s, c) = sin_cos(PI * (j as f32 + 0.5) / columns as f32);
            sum += f64::from(charlie(wo, Vec3::new(r * c, r * s, z), alpha) * z * step);
        }
    }
    (sum * 2.0 * std::f64::consts::PI / f64::from(rows * columns)) as f32
}

/// Fraction of light that white sheen of roughness α scatters, seen at cosθ. The table is computed at its first use.
#[inline]
pub(in super::super) fn sheen_albedo(cos: f32, alpha: f32) -> f32 {
    CHARLIE.at(alpha, |a, b, t| (a.at(cos) + (b.at(cos) - a.at(cos)) * t).max(0.0))
}

/// Factor on the sheen of roughness α that keeps it from creating energy. At grazing angles the bare model reflects up to twice
/// the light for smooth fabrics.
pub(in super::super) fn sheen_scale(alpha: f32) -> f32 {
    1.0 / (1.01 * sheen_albedo(0.0, alpha)).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn the_table_agrees_with_quadrature_and_scaled_sheen_stays_below_one() {
        for alpha in [0.01f32, 0.04, 0.09, 0.3, 0.6, 1.0] {
            for cos in [0.003f32, 0.02, 0.1, 0.4, 0.8, 1.0] {
                let (found, expected) = (sheen_albedo(cos, alpha), quadrature(cos, alpha));
                assert!((found - expected).abs() < 0.02, "{alpha} {cos}: {found} against {expected}");
                assert!(expected * sheen_scale(alpha) < 1.0, "{alpha} {cos}: {expected}");
            }
        }
    }
}

//! Fresnel reflectance.

use crate::math::safe_sqrt;
use crate::spectrum::Spectrum;

/// Indices beyond this [1] reflect all, to f32 rounding; their squares still fit.
const LARGEST_INDEX: f32 = 1e9;

/// Unpolarised reflectance of a dielectric boundary, and the cosine of the transmitted direction (0 under total reflection).
///
/// `cos` ≥ 0 is of the incident direction, `eta` the index of the transmitted side over that of the incident side.
#[inline]
pub(super) fn dielectric(cos: f32, eta: f32) -> (f32, f32) {
    let eta = eta.min(LARGEST_INDEX);
    // (η cosθₜ)² = η² − sin²θ, written so that nothing cancels near the horizon and near η = 1.
    let bent2 = (eta - 1.0) * (eta + 1.0) + cos * cos;
    if bent2 <= 0.0 {
        return (1.0, 0.0);
    }
    let bent = bent2.sqrt();
    let cos_t = (bent / eta).min(1.0);
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - bent) / (cos + bent);
    (0.5 * (parallel * parallel + perpendicular * perpendicular), cos_t)
}

/// Unpolarised reflectance of a conductor with complex index η + ik, relative to the outside.
#[inline]
pub(super) fn conductor(cos: f32, eta: Spectrum, k: Spectrum) -> Spectrum {
    let [er, eg, eb] = eta.to_rgb();
    let [kr, kg, kb] = k.to_rgb();
    Spectrum::rgb(conductor_lane(cos, er, kr), conductor_lane(cos, eg, kg), conductor_lane(cos, eb, kb))
}

#[inline]
fn conductor_lane(cos: f32, eta: f32, k: f32) -> f32 {
    let (eta, k) = (eta.min(LARGEST_INDEX), k.min(LARGEST_INDEX));
    let cos2 = cos * cos;
    let sin2 = 1.0 - cos2;
    // η² − k² − sin²θ, written so that nothing cancels near the horizon.
    let t0 = (eta - 1.0) * (eta + 1.0) - k * k + cos2;
    let across = 2.0 * eta * k;
    let a2b2 = safe_sqrt(t0 * t0 + across * across);
    let a = safe_sqrt(0.5 * (a2b2 + t0));
    // Where both terms vanish, at the horizon or without any index, nothing enters.
    let ratio = |t: f32, u: f32| if t + u > 0.0 { (t - u) / (t + u) } else { 1.0 };
    let t2 = 2.0 * cos * a;
    let perpendicular = ratio(a2b2 + cos2, t2);
    let parallel = perpendicular * ratio(cos2 * a2b2 + sin2 * sin2, t2 * sin2);
    0.5 * (perpendicular + parallel)
}

/// (1 − cos)⁵, the weight of Schlick's approximation (1994).
#[inline]
pub(super) fn schlick_weight(cos: f32) -> f32 {
    let x = (1.0 - cos).clamp(0.0, 1.0);
    let x2 = x * x;
    x2 * x2 * x
}

/// Mean of the reflectance over a hemisphere of incident light, weighted by the cosine: 2 ∫ F(μ) μ dμ.
fn mean(reflectance: impl Fn(f32) -> f32) -> f32 {
    let n = 64;
    (0..n)
        .map(|i| {
            // Steps grow away from the horizon, where the reflectance is steep.
            let t = (i as f32 + 0.5) / n as f32;
            reflectance(t * t) * 4.0 * t * t * t
        })
        .sum::<f32>()
        / n as f32
}

/// Fraction of diffuse light that a dielectric boundary reflects, with `eta` behind it over in front.
pub(super) fn diffuse_dielectric(eta: f32) -> f32 {
    // From the denser side through the other: total reflection has a kink that a quadrature would miss.
    if eta < 1.0 { 1.0 - (1.0 - diffuse_dielectric(1.0 / eta)) * eta * eta } else { mean(|cos| dielectric(cos, eta).0) }
}

/// Fraction of diffuse light that a conductor with index η + ik reflects [1].
pub fn diffuse_conductor(eta: Spectrum, k: Spectrum) -> Spectrum {
    let ([er, eg, eb], [kr, kg, kb]) = (eta.to_rgb(), k.to_rgb());
    let lane = |e: f32, k: f32| mean(|cos| conductor_lane(cos, e, k));
    Spectrum::rgb(lane(er, kr), lane(eg, kg), lane(eb, kb))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_has_closed_forms() {
        let (r, cos_t) = dielectric(1.0, 1.5);
        assert!((r - 0.04).abs() < 1e-6 && (cos_t - 1.0).abs() < 1e-6);
        let (eta, k) = (0.2f32, 3.9f32);
        let expected = ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        assert!((conductor(1.0, Spectrum::grey(eta), Spectrum::grey(k)).to_rgb()[0] - expected).abs() < 1e-5);
    }

    #[test]
    fn total_reflection_and_matched_index() {
        assert_eq!(dielectric(0.3, 1.0 / 1.5), (1.0, 0.0));
        let (r, cos_t) = dielectric(0.3, 1.0);
        assert!(r < 1e-12 && (cos_t - 0.3).abs() < 1e-6);
        // Without absorption the conductor formula is the dielectric one.
        for cos in [0.05, 0.4, 0.9] {
            let c = conductor(cos, Spectrum::grey(1.5), Spectrum::BLACK).to_rgb()[0];
            assert!((c - dielectric(cos, 1.5).0).abs() < 1e-5);
        }
    }

    #[test]
    fn matched_index_passes_all_at_every_angle() {
        for cos in [1e-18, 1e-6, 1.745e-5, 1e-4, 1e-3, 1.0] {
            let (r, cos_t) = dielectric(cos, 1.0);
            assert!(r == 0.0 && (cos_t / cos - 1.0).abs() < 1e-6, "{cos:e}: {r}, {cos_t:e}");
        }
    }

    /// Against the same formulas in f64, from the normal to the horizon, from matched indices to extreme ones.
    #[test]
    fn extreme_angles_and_indices() {
        for cos in [0.0, 1e-30, 1e-10, 1.745e-5, 1e-4, 1e-2, 0.5, 1.0f32] {
            for eta in [1e-30, 1e-3, 0.999, 1.0 - 6e-8, 1.0 + 1.2e-7, 1.0001, 1.5, 1e3, 1e8, 1e30f32] {
                let (r, cos_t) = dielectric(cos, eta);
                assert!((0.0..=1.0).contains(&r) && (0.0..=1.0).contains(&cos_t), "{cos:e}, {eta:e}: {r}, {cos_t}");
                let (c, n) = (f64::from(cos), f64::from(eta));
                let bent2 = (n - 1.0) * (n + 1.0) + c * c;
                let expected = if bent2 <= 0.0 {
                    1.0
                } else {
                    let (p, q) = ((n * n * c - bent2.sqrt()) / (n * n * c + bent2.sqrt()), (c - bent2.sqrt()) / (c + bent2.sqrt()));
                    0.5 * (p * p + q * q)
                };
                // At the critical angle the reflectance falls from 1 with infinite slope.
                let allowed = if bent2.abs() < 1e-6 * c * c { 2e-3 } else { 1e-5 };
                assert!(eta > LARGEST_INDEX || (f64::from(r) - expected).abs() <= allowed, "{cos:e}, {eta:e}: {r} of {expected}");
                for k in [0.0, 1e-20, 1.0, 1e6, 1e30] {
                    let metal = conductor_lane(cos, eta, k);
                    assert!((0.0..=1.0 + 1e-6).contains(&metal), "{cos:e}, {eta:e} + i {k:e}: {metal}");
                }
            }
        }
        assert!((conductor_lane(1.0, 0.0, 0.0) - 1.0).abs() < 1e-6 && conductor_lane(0.7, 1.5, 1e30) > 1.0 - 1e-6);
    }

    #[test]
    fn diffuse_reflectance_matches_tables() {
        // Duntley's closed form gives 0.0918 for 1.5 from outside and 0.5963 from inside; for water 0.0664 (Judd, 1942).
        assert!((diffuse_dielectric(1.5) - 0.0918).abs() < 3e-4, "{}", diffuse_dielectric(1.5));
        assert!((diffuse_dielectric(1.0 / 1.5) - 0.5963).abs() < 3e-4, "{}", diffuse_dielectric(1.0 / 1.5));
        assert!((diffuse_dielectric(4.0 / 3.0) - 0.0664).abs() < 5e-4, "{}", diffuse_dielectric(4.0 / 3.0));
        assert!(diffuse_dielectric(1.0).abs() < 1e-6);
    }
}

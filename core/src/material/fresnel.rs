//! Fresnel reflectance.

use crate::math::safe_sqrt;
use crate::spectrum::Spectrum;

/// Unpolarised reflectance of a dielectric boundary, and the cosine of the transmitted direction (0 under total reflection).
///
/// `cos` ≥ 0 is of the incident direction, `eta` the index of the transmitted side over that of the incident side.
#[inline]
pub(super) fn dielectric(cos: f32, eta: f32) -> (f32, f32) {
    let sin2_t = (1.0 - cos * cos).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return (1.0, 0.0);
    }
    let cos_t = safe_sqrt(1.0 - sin2_t);
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
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
    let cos2 = cos * cos;
    let sin2 = 1.0 - cos2;
    let (eta2, k2) = (eta * eta, k * k);
    let t0 = eta2 - k2 - sin2;
    let a2b2 = safe_sqrt(t0 * t0 + 4.0 * eta2 * k2);
    let a = safe_sqrt(0.5 * (a2b2 + t0));
    let t1 = a2b2 + cos2;
    let t2 = 2.0 * cos * a;
    let perpendicular = (t1 - t2) / (t1 + t2);
    let t3 = cos2 * a2b2 + sin2 * sin2;
    let t4 = t2 * sin2;
    let parallel = perpendicular * (t3 - t4) / (t3 + t4);
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
    fn diffuse_reflectance_matches_tables() {
        // Duntley's closed form gives 0.0918 for 1.5 from outside and 0.5963 from inside; for water 0.0664 (Judd, 1942).
        assert!((diffuse_dielectric(1.5) - 0.0918).abs() < 3e-4, "{}", diffuse_dielectric(1.5));
        assert!((diffuse_dielectric(1.0 / 1.5) - 0.5963).abs() < 3e-4, "{}", diffuse_dielectric(1.0 / 1.5));
        assert!((diffuse_dielectric(4.0 / 3.0) - 0.0664).abs() < 5e-4, "{}", diffuse_dielectric(4.0 / 3.0));
        assert!(diffuse_dielectric(1.0).abs() < 1e-6);
    }
}

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
}

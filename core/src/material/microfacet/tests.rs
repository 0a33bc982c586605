//! Laws of the distributions: areas project to one, visible normals too.

use super::*;
use crate::math::PI;

fn all() -> Vec<Microfacets> {
    let sizes = [(0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (0.2, 0.6)];
    [Distribution::Ggx, Distribution::Beckmann].into_iter().flat_map(|d| sizes.map(|(u, v)| Microfacets::new(d, u, v).unwrap())).collect()
}

/// Integral over the upper hemisphere by the midpoint rule in cosθ and φ.
fn integrate(f: impl Fn(Vec3) -> f32) -> f64 {
    let (rows, columns) = (1000, 500);
    let mut sum = 0.0f64;
    for i in 0..rows {
        // Square steps of z put points where lobes at the pole are.
        let t = (i as f32 + 0.5) / rows as f32;
        let z = 1.0 - t * t;
        let r = (1.0 - z * z).sqrt();
        for j in 0..columns {
            let (s, c) = crate::math::sin_cos(2.0 * PI * (j as f32 + 0.5) / columns as f32);
            sum += f64::from(f(Vec3::new(r * c, r * s, z)) * 2.0 * t);
        }
    }
    sum * 2.0 * std::f64::consts::PI / f64::from(rows * columns)
}

#[test]
fn the_facets_cover_the_surface() {
    for facets in all() {
        let area = integrate(|h| facets.density_of_normals(h) * h.z);
        assert!((area - 1.0).abs() < 2e-3, "{facets:?}: {area}");
    }
}

#[test]
fn the_projected_area_is_the_integral_of_the_visible_facets() {
    for facets in all() {
        for w in [Vec3::Z, Vec3::new(0.5, 0.3, 0.6), Vec3::new(-0.9, 0.2, 0.1), Vec3::new(0.1, 0.9, 0.01)].map(Vec3::normalize) {
            let seen = integrate(|h| facets.density_of_normals(h) * w.dot(h).max(0.0));
            let area = f64::from(facets.projected_area(w));
            assert!((seen - area).abs() < 3e-3 * area, "{facets:?} from {w}: {seen} against {area}");
        }
    }
}

#[test]
fn sampled_normals_follow_their_density() {
    // Means of two test functions over samples against their integrals.
    for facets in all() {
        for w in [Vec3::new(0.01, 0.0, 1.0), Vec3::new(0.5, 0.3, 0.6), Vec3::new(-0.9, 0.4, 0.1)].map(Vec3::normalize) {
            let n = 300u32;
            let (mut tilt, mut forward) = (0.0f64, 0.0f64);
            for i in 0..n {
                for j in 0..n {
                    let h = facets.sample(w, [(i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32]);
                    tilt += f64::from(h.z);
                    forward += f64::from(h.x - 0.5 * h.y);
                }
            }
            let (tilt, forward) = (tilt / f64::from(n * n), forward / f64::from(n * n));
            let expected_tilt = integrate(|h| facets.density(w, h) * h.z);
            let expected_forward = integrate(|h| facets.density(w, h) * (h.x - 0.5 * h.y));
            assert!((tilt - expected_tilt).abs() < 3e-3, "{facets:?} from {w}: {tilt} against {expected_tilt}");
            assert!((forward - expected_forward).abs() < 3e-3, "{facets:?} from {w}: {forward} against {expected_forward}");
        }
    }
}

#[test]
fn nothing_breaks_at_the_limits() {
    for distribution in [Distribution::Ggx, Distribution::Beckmann] {
        for alpha in [1e-6, 1e-4, 1e-3, 0.03, 1.0] {
            let facets = Microfacets::new(distribution, alpha, alpha).unwrap();
            for degrees in [0.0f32, 45.0, 89.0, 89.999] {
                let (s, c) = crate::math::sin_cos(degrees.to_radians());
                let w = Vec3::new(s, 0.0, c);
                for u in [[0.0, 0.0], [0.5, 0.5], [0.999_999_9, 0.999_999_9], [0.0, 0.999_999_9]] {
                    let h = facets.sample(w, u);
                    assert!(h.is_finite() && (h.length() - 1.0).abs() < 1e-5, "{facets:?} at {degrees}: {h}");
                    assert!(facets.density(w, h).is_finite() && facets.visible(w) <= 1.0);
                }
            }
        }
    }
}

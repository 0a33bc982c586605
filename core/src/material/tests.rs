//! Laws that every material keeps: sampling matches density, energy is not created, reflection is reciprocal.

use super::*;
use crate::math::PI;
use crate::sampling::{Dimension, SampleKey, SampleStream};

fn stream(k: u32) -> SampleStream {
    SampleStream::open(SampleKey { seed: 5, frame: 0, x: k, y: 0, index: k % 1024 })
}

fn gold(alpha: f32) -> Bsdf {
    Bsdf::Conductor(Conductor {
        eta: Spectrum::rgb(0.14, 0.37, 1.44),
        k: Spectrum::rgb(3.98, 2.39, 1.6),
        reflectance: Spectrum::WHITE,
        ggx: Ggx::new(alpha),
        two_sided: true,
    })
}

fn glass(alpha: f32) -> Bsdf {
    Bsdf::Dielectric(Dielectric { eta: 1.5, reflectance: Spectrum::WHITE, transmittance: Spectrum::WHITE, ggx: Ggx::new(alpha) })
}

fn rough() -> Vec<Bsdf> {
    let white = Bsdf::Diffuse(Diffuse { reflectance: Spectrum::WHITE, two_sided: true });
    vec![white, gold(0.2), gold(0.7), glass(0.15), glass(0.5)]
}

fn views() -> [Vec3; 3] {
    [Vec3::new(0.3, -0.2, 0.9), Vec3::new(0.8, 0.3, 0.25), Vec3::new(-0.4, 0.5, -0.7)].map(Vec3::normalize)
}

/// Bins of the sphere: equal steps of cosθ and of azimuth.
const BINS: (usize, usize) = (24, 24);

fn bin(w: Vec3) -> usize {
    let row = (((w.z + 1.0) * 0.5 * BINS.0 as f32) as usize).min(BINS.0 - 1);
    let turn = (libm::atan2f(w.y, w.x) / (2.0 * PI) + 1.0).fract();
    row * BINS.1 + ((turn * BINS.1 as f32) as usize).min(BINS.1 - 1)
}

#[test]
fn sampling_matches_density() {
    // χ² over bins of the sphere; the bound is the 10⁻⁴ quantile by Wilson and Hilferty, Šidák-corrected for 15 tests.
    let n = 200_000u32;
    for material in rough() {
        for wo in views() {
            let mut counts = vec![0.0f64; BINS.0 * BINS.1];
            for k in 0..n {
                let s = stream(k);
                if let Some(scatter) = material.sample(wo, s.number(Dimension::lobe(9)), s.pair(Dimension::direction(9))) {
                    counts[bin(scatter.wi)] += 1.0;
                }
            }
            let mut chi2 = 0.0;
            let mut freedom = 0.0f64;
            let steps = 12;
            for row in 0..BINS.0 {
                for column in 0..BINS.1 {
                    let mut integral = 0.0f64;
                    for i in 0..steps {
                        for j in 0..steps {
                            let z = -1.0 + 2.0 * (row as f32 + (i as f32 + 0.5) / steps as f32) / BINS.0 as f32;
                            let phi = 2.0 * PI * (column as f32 + (j as f32 + 0.5) / steps as f32) / BINS.1 as f32;
                            let r = (1.0 - z * z).sqrt();
                            integral += f64::from(material.evaluate(wo, Vec3::new(r * libm::cosf(phi), r * libm::sinf(phi), z)).density);
                        }
                    }
                    let cell = 4.0 * std::f64::consts::PI / (BINS.0 * BINS.1 * steps * steps) as f64;
                    let expected = integral * cell * f64::from(n);
                    let found = counts[row * BINS.1 + column];
                    if expected > 50.0 {
                        // Room for the error of the quadrature beside the sampling error.
                        let spread = expected + (0.02 * expected).powi(2);
                        chi2 += (found - expected).powi(2) / spread;
                        freedom += 1.0;
                    }
                }
            }
            let bound = freedom * (1.0 - 2.0 / (9.0 * freedom) + 4.4 * (2.0 / (9.0 * freedom)).sqrt()).powi(3);
            assert!(chi2 < bound, "{material:?} from {wo}: χ² {chi2} over {freedom} degrees, bound {bound}");
        }
    }
}

#[test]
fn samples_carry_their_own_evaluation() {
    for material in rough() {
        for wo in views() {
            for k in 0..2000 {
                let s = stream(k);
                if let Some(scatter) = material.sample(wo, s.number(Dimension::lobe(9)), s.pair(Dimension::direction(9))) {
                    let again = material.evaluate(wo, scatter.wi);
                    let (a, b) = (again.density, scatter.evaluation.density);
                    assert!((a - b).abs() <= 1e-3 * a.max(b), "{material:?}: {a} against {b}");
                }
            }
        }
    }
}

#[test]
fn no_material_creates_energy_and_white_ones_lose_little() {
    let n = 40_000;
    for (material, floor) in rough().into_iter().zip([0.999, 0.0, 0.0, 0.9, 0.0]) {
        for wo in views() {
            let mut sum = 0.0f64;
            for k in 0..n {
                let s = stream(k);
                if let Some(x) = material.sample(wo, s.number(Dimension::lobe(9)), s.pair(Dimension::direction(9))) {
                    // Undo the compression of radiance on crossing, which is not loss.
                    let scale = if wo.z * x.wi.z < 0.0 { material.relative_ior(wo).powi(2) } else { 1.0 };
                    sum += f64::from(x.evaluation.value.max() * scale / x.evaluation.density);
                }
            }
            let albedo = sum / f64::from(n);
            assert!(albedo < 1.0 + 1e-4 && albedo > floor, "{material:?}: albedo {albedo}");
        }
    }
}

#[test]
fn reflection_and_refraction_are_reciprocal() {
    for material in rough() {
        for k in 0..3000 {
            let s = stream(k);
            let wo = crate::sampling::warp::uniform_sphere(s.pair(Dimension::direction(9)));
            let wi = crate::sampling::warp::uniform_sphere(s.pair(Dimension::direction(10)));
            if wo.z.abs() < 0.05 || wi.z.abs() < 0.05 {
                continue;
            }
            // f(wo, wi)/η_i² is symmetric: with the radiance convention f(wo, wi)·η(wo)² = f(wi, wo).
            let scale = if wo.z * wi.z < 0.0 { material.relative_ior(wo).powi(2) } else { 1.0 };
            let a = material.evaluate(wo, wi).value.to_rgb()[1] / wi.z.abs() * scale;
            let b = material.evaluate(wi, wo).value.to_rgb()[1] / wo.z.abs();
            assert!((a - b).abs() <= 2e-3 * a.max(b) + 1e-6, "{material:?}: {a} against {b}");
        }
    }
}

#[test]
fn delta_lobes_split_all_light() {
    let glass = glass(0.0);
    for wo in views() {
        let reflected = glass.evaluate_delta(wo, false);
        let transmitted = glass.evaluate_delta(wo, true);
        assert!((reflected.density + transmitted.density - 1.0).abs() < 1e-6);
        assert_eq!(glass.evaluate(wo, Vec3::Z), Evaluation::NONE);
    }
    let mirror = gold(0.0);
    let wo = views()[1];
    let x = mirror.sample(wo, 0.5, [0.5, 0.5]).unwrap();
    assert_eq!(x.wi, Vec3::new(-wo.x, -wo.y, wo.z));
}

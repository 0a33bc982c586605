//! Sampling against density.

use super::*;
use crate::math::PI;

/// Bins of the sphere: equal steps of cosθ and of azimuth.
const BINS: (usize, usize) = (24, 24);
/// Side of the midpoint rule's grid in each bin.
const STEPS: usize = 16;
const SAMPLES: u32 = 100_000;

fn bin(w: Vec3) -> usize {
    let row = (((w.z + 1.0) * 0.5 * BINS.0 as f32) as usize).min(BINS.0 - 1);
    let turn = (libm::atan2f(w.y, w.x) / (2.0 * PI) + 1.0).fract();
    row * BINS.1 + ((turn * BINS.1 as f32) as usize).min(BINS.1 - 1)
}

/// Probability of each bin by the density of the lobes that are no deltas.
fn expected(bsdf: &Subject, wo: Vec3) -> Vec<f64> {
    let cell = 4.0 * std::f64::consts::PI / (BINS.0 * BINS.1 * STEPS * STEPS) as f64;
    let mut bins = vec![0.0f64; BINS.0 * BINS.1];
    for i in 0..BINS.0 * STEPS {
        let z = -1.0 + 2.0 * (i as f32 + 0.5) / (BINS.0 * STEPS) as f32;
        let r = (1.0 - z * z).sqrt();
        for j in 0..BINS.1 * STEPS {
            let (s, c) = crate::math::sin_cos(2.0 * PI * (j as f32 + 0.5) / (BINS.1 * STEPS) as f32);
            bins[i / STEPS * BINS.1 + j / STEPS] += f64::from(bsdf.evaluate(wo, Vec3::new(r * c, r * s, z)).density) * cell;
        }
    }
    bins
}

/// The number of standard deviations that a normal number exceeds with probability `p`.
fn quantile(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..100 {
        let z = 0.5 * (low + high);
        if 0.5 * libm::erfc(z / std::f64::consts::SQRT_2) > p { low = z } else { high = z }
    }
    low
}

#[test]
fn sampling_matches_density() {
    // χ² over bins of the sphere at a joint level of 10⁻³, Šidák-corrected for all configurations; quantile by Wilson and Hilferty.
    let cases = all();
    let tests = (cases.len() * views().len()) as f64;
    let z = quantile(1.0 - (1.0 - 1e-3f64).powf(1.0 / tests));
    for case in &cases {
        for wo in views() {
            let mut counts = vec![0.0f64; BINS.0 * BINS.1];
            let (mut found, mut deltas) = (0.0f64, 0.0f64);
            for k in 0..SAMPLES {
                match sample(&case.bsdf, wo, k) {
                    Some(scatter) if scatter.delta => deltas += 1.0,
                    Some(scatter) => {
                        counts[bin(scatter.wi)] += 1.0;
                        found += 1.0;
                    }
                    None => {}
                }
            }
            let n = f64::from(SAMPLES);
            let p = f64::from(case.bsdf.delta_probability(wo));
            assert!((deltas - p * n).abs() <= 5.0 * (n * p * (1.0 - p)).sqrt() + 1.0, "{}: {deltas} deltas", case.name);
            let expected = expected(&case.bsdf, wo);
            let total: f64 = expected.iter().sum();
            assert!(total <= 1.0 - p + 0.01, "{} from {wo}: the density integrates to {total}", case.name);
            assert!(
                (found - total * n).abs() < 5.0 * (n * total * (1.0 - total).max(0.0)).sqrt() + 0.01 * n,
                "{} from {wo}: {found} of {total}",
                case.name
            );
            let (mut chi2, mut freedom) = (0.0, 0.0f64);
            for (count, probability) in counts.iter().zip(&expected) {
                let expected = probability * n;
                if expected > 30.0 {
                    // Room for the error of the quadrature beside the sampling error.
                    chi2 += (count - expected).powi(2) / (expected + (0.015 * expected).powi(2));
                    freedom += 1.0;
                }
            }
            if freedom > 0.0 {
                let bound = freedom * (1.0 - 2.0 / (9.0 * freedom) + z * (2.0 / (9.0 * freedom)).sqrt()).powi(3);
                assert!(chi2 < bound, "{} from {wo}: χ² {chi2} over {freedom} degrees, bound {bound}", case.name);
            }
        }
    }
}

#[test]
fn the_test_of_sampling_can_fail() {
    // The same counts against the density of a slightly rougher metal.
    let at = |alpha| Subject::from(metal(Microfacets::ggx(alpha), false));
    let (wo, n) = (views()[0], f64::from(SAMPLES));
    let mut counts = vec![0.0f64; BINS.0 * BINS.1];
    for k in 0..SAMPLES {
        if let Some(scatter) = sample(&at(0.2), wo, k) {
            counts[bin(scatter.wi)] += 1.0;
        }
    }
    let chi2 = |bsdf: &Subject| -> f64 {
        let terms = counts.iter().zip(expected(bsdf, wo)).filter(|(_, p)| p * n > 30.0);
        terms.map(|(count, p)| (count - p * n).powi(2) / (p * n + (0.015 * p * n).powi(2))).sum()
    };
    let (same, other) = (chi2(&at(0.2)), chi2(&at(0.22)));
    assert!(other > 3.0 * same, "{same} and {other}");
}

#[test]
fn samples_carry_their_own_evaluation() {
    for case in all() {
        for wo in views() {
            for k in 0..2000 {
                let Some(scatter) = sample(&case.bsdf, wo, k) else { continue };
                let again = if scatter.delta {
                    case.bsdf.evaluate_delta(wo, wo.z * scatter.wi.z < 0.0)
                } else {
                    case.bsdf.evaluate(wo, scatter.wi)
                };
                assert_eq!(again, scatter.evaluation, "{}", case.name);
                assert!((scatter.wi.length() - 1.0).abs() < 1e-4, "{}: {}", case.name, scatter.wi);
            }
        }
    }
}

#[test]
fn delta_lobes_own_the_choices_below_their_probability() {
    for case in all() {
        for wo in views() {
            let p = case.bsdf.delta_probability(wo);
            for k in 0..2000 {
                let s = stream(k);
                let choice = s.number(Dimension::lobe(9));
                if let Some(scatter) = case.bsdf.sample(wo, choice, s.pair(Dimension::direction(9))) {
                    assert_eq!(scatter.delta, choice < p, "{} from {wo}", case.name);
                }
            }
            // The probabilities of the two delta lobes make up the whole.
            let sum = case.bsdf.evaluate_delta(wo, false).density + case.bsdf.evaluate_delta(wo, true).density;
            assert!((sum - p).abs() < 1e-5, "{} from {wo}: {sum} against {p}", case.name);
        }
    }
}

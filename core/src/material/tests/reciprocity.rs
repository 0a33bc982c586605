//! Light that runs backwards is scattered alike.

use super::*;
use crate::sampling::warp::uniform_sphere;

#[test]
fn reflection_and_refraction_are_reciprocal() {
    for case in all() {
        let mut compared = 0;
        for k in 0..4000 {
            let s = stream(k);
            let wo = uniform_sphere(s.pair(Dimension::direction(9)));
            let wi = uniform_sphere(s.pair(Dimension::direction(10)));
            if wo.z.abs() < 0.05 || wi.z.abs() < 0.05 {
                continue;
            }
            // f(wo, wi)/η_i² is symmetric: with the radiance convention f(wo, wi)·η(wo)² = f(wi, wo).
            let there = case.bsdf.evaluate(wo, wi).value.to_rgb();
            let back = case.bsdf.evaluate(wi, wo).value.to_rgb();
            for (a, b) in there.into_iter().zip(back) {
                let (a, b) = (a / wi.z.abs() * crossing(&case.bsdf, wo, wi), b / wo.z.abs());
                assert!((a - b).abs() <= 2e-3 * a.max(b) + 1e-6, "{}: {a} against {b} for {wo} and {wi}", case.name);
                compared += usize::from(a > 0.0);
            }
        }
        assert!(compared > 500 || case.bsdf.delta_probability(Vec3::Z) == 1.0, "{}: only {compared} pairs", case.name);
    }
}

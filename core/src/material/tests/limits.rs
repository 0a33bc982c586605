//! Nothing breaks at grazing angles, at the smallest roughness, or at the edges of the unit square.

use super::*;
use crate::math::sin_cos;

/// Every leaf that has a roughness.
fn of_roughness(alpha: f32) -> Vec<(&'static str, Bsdf)> {
    use Distribution::{Beckmann, Ggx};
    let principled = |change: &dyn Fn(&mut PrincipledParameters)| {
        let mut p = PrincipledParameters { roughness: alpha.sqrt(), clearcoat: 0.8, clearcoat_roughness: alpha.sqrt(), ..PRINCIPLED };
        (p.sheen_color, p.sheen_roughness) = (Spectrum::grey(0.5), alpha.sqrt());
        change(&mut p);
        Bsdf::Principled(Principled::new(&p))
    };
    let grey = Spectrum::grey(0.5);
    let mut leaves = vec![
        ("rough diffuse", Bsdf::RoughDiffuse(RoughDiffuse::new(grey, alpha, true))),
        ("phong", Bsdf::Phong(Phong { diffuse: grey, specular: grey, exponent: 2.0 / (alpha * alpha), two_sided: true })),
        ("ward", Bsdf::Ward(Ward { diffuse: grey, specular: grey, alpha_u: alpha, alpha_v: alpha, two_sided: true })),
        ("principled metal", principled(&|p| p.metallic = 1.0)),
        ("principled", principled(&|_| ())),
        ("principled glass", principled(&|p| p.transmission = 1.0)),
        ("principled wall", principled(&|p| (p.transmission, p.thin) = (1.0, true))),
    ];
    for (distribution, v) in [(Ggx, alpha), (Beckmann, alpha), (Ggx, 1.0), (Beckmann, 1.0)] {
        let facets = Microfacets::new(distribution, alpha, v);
        leaves.push(("metal", metal(facets, false)));
        leaves.push(("metal, conserving", metal(facets, true)));
        leaves.push(("glass", glass(1.5, facets, false)));
        leaves.push(("glass, conserving", glass(1.5, facets, true)));
        leaves.push(("glass of nearly no effect", glass(1.0001, facets, false)));
        leaves.push(("plastic", Bsdf::Plastic(plastic(1.5, grey, facets, true))));
    }
    leaves
}

#[test]
fn everything_stays_finite_and_small() {
    for alpha in [1e-6, 1e-4, 1e-3, 0.01, 0.1, 0.5, 1.0] {
        for (name, bsdf) in of_roughness(alpha) {
            for degrees in [0.0f32, 30.0, 80.0, 89.0, 89.9, 89.999, 90.001, 91.0, 130.0, 180.0] {
                let (s, c) = sin_cos(degrees.to_radians());
                let (s2, c2) = sin_cos(0.7);
                let wo = Vec3::new(s * c2, s * s2, c);
                for k in 0..400 {
                    let stream = stream(k);
                    let edges = [0.0, f32::MIN_POSITIVE, 0.5, 1.0 - f32::EPSILON / 2.0];
                    let pick = |i: u32, x: f32| if i < 4 { edges[i as usize] } else { x };
                    let [a, b] = stream.pair(Dimension::direction(9));
                    let u = [pick(k % 8, a), pick(k / 8 % 8, b)];
                    let choice = pick(k / 64 % 8, stream.number(Dimension::lobe(9)));
                    let Some(x) = bsdf.sample(wo, choice, u) else { continue };
                    let (value, density) = (x.evaluation.value, x.evaluation.density);
                    let what = || format!("{name} {alpha} at {degrees}° by {choice} {u:?}: {x:?}");
                    assert!(x.wi.is_finite() && value.is_finite() && density.is_finite() && density > 0.0, "{}", what());
                    assert!(value.to_rgb().into_iter().all(|v| v >= 0.0), "{}", what());
                    // Importance sampling keeps weights bounded, but for matt facets: they shine back along the horizon without bound.
                    let weight = value.max() / density * crossing(&bsdf.into(), wo, x.wi);
                    assert!(weight < 50.0 || name == "rough diffuse", "weight {weight}: {}", what());
                    let other = bsdf.evaluate(x.wi, wo);
                    assert!(other.value.is_finite() && other.density.is_finite() && other.density >= 0.0, "{}", what());
                }
            }
        }
    }
}

#[test]
fn the_back_of_what_is_not_two_sided_is_black() {
    let back = Vec3::new(0.3, 0.2, -0.8).normalize();
    let leaves = [
        Bsdf::Diffuse(Diffuse { reflectance: Spectrum::WHITE, two_sided: false }),
        Bsdf::RoughDiffuse(RoughDiffuse::new(Spectrum::WHITE, 0.3, false)),
        Bsdf::Plastic(Plastic { two_sided: false, ..plastic(1.5, Spectrum::WHITE, None, false) }),
        Bsdf::Plastic(Plastic { two_sided: false, ..plastic(1.5, Spectrum::WHITE, Microfacets::ggx(0.3), false) }),
        Bsdf::Phong(Phong { diffuse: Spectrum::WHITE, specular: Spectrum::WHITE, exponent: 5.0, two_sided: false }),
        Bsdf::Ward(Ward { diffuse: Spectrum::WHITE, specular: Spectrum::WHITE, alpha_u: 0.2, alpha_v: 0.2, two_sided: false }),
        Bsdf::Principled(Principled::new(&PrincipledParameters { two_sided: false, ..PRINCIPLED })),
    ];
    for bsdf in leaves {
        for k in 0..200 {
            assert!(sample(&bsdf.into(), back, k).is_none(), "{bsdf:?}");
            assert!(sample(&bsdf.into(), -back, k).is_none_or(|x| x.wi.z > 0.0), "{bsdf:?}");
        }
        assert_eq!(bsdf.evaluate(back, back), Evaluation::NONE);
        assert_eq!(bsdf.evaluate_delta(back, false), Evaluation::NONE);
        assert_eq!(bsdf.delta_probability(back), 0.0);
    }
}

#[test]
fn leaves_stay_small() {
    // They are passed by value along paths.
    assert!(std::mem::size_of::<Bsdf>() <= 256, "{}", std::mem::size_of::<Bsdf>());
}

//! White furnaces: no leaf creates energy, and those that conserve it lose little.

use super::*;

#[test]
fn albedos_lie_within_their_bounds() {
    let n = 20_000;
    let mut report = Vec::new();
    for case in all() {
        for wo in views() {
            let mut sum = 0.0f64;
            for k in 0..n {
                if let Some(x) = sample(&case.bsdf, wo, k) {
                    sum += f64::from(x.evaluation.value.max() * crossing(&case.bsdf, wo, x.wi) / x.evaluation.density);
                }
            }
            let albedo = sum / f64::from(n);
            let [least, most] = case.albedo;
            if !(least..=most).contains(&albedo) {
                report.push(format!("{} from {wo}: albedo {albedo}, bounds {least} to {most}", case.name));
            }
        }
    }
    assert!(report.is_empty(), "{}", report.join("\n"));
}

#[test]
fn conserving_forms_only_add() {
    for alpha in [0.1, 0.5, 1.0] {
        let facets = Microfacets::ggx(alpha);
        for (plain, kept) in [(metal(facets, false), metal(facets, true)), (glass(1.5, facets, false), glass(1.5, facets, true))] {
            for wo in views() {
                for k in 0..500 {
                    let wi = crate::sampling::warp::uniform_sphere(stream(k).pair(Dimension::direction(3)));
                    let (a, b) = (plain.evaluate(wo, wi).value, kept.evaluate(wo, wi).value);
                    assert!(a.to_rgb().into_iter().zip(b.to_rgb()).all(|(a, b)| a <= b));
                }
            }
        }
    }
}

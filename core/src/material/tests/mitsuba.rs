//! The same numbers as Mitsuba 3.9.1, which renders the references that scenes are compared with.
//!
//! From `pip install mitsuba==3.9.1`, variant `scalar_rgb`: `mi.load_dict({...}).eval(mi.BSDFContext(), si, wo)` and `.pdf(...)` with
//! `si.wi` = our `wo`, `wo` = our `wi`; for delta lobes `.sample(...)`, its weight times its probability. The dictionaries are those
//! that the functions below repeat: gold is `roughconductor` of η (0.14, 0.37, 1.44) and k (3.98, 2.39, 1.6).

use super::*;

type Row = (&'static str, [f32; 3], [f32; 3], [f32; 3], f32);
type DeltaRow = (&'static str, [f32; 3], bool, [f32; 3], f32, [f32; 3]);

fn material(name: &str) -> Bsdf {
    use Distribution::{Beckmann, Ggx};
    let colour = Spectrum::rgb(0.6, 0.3, 0.1);
    match name {
        "gold_mirror" => metal(None, false),
        "gold_ggx" => metal(Microfacets::ggx(0.2), false),
        "gold_beckmann_stretched" => metal(Microfacets::new(Beckmann, 0.15, 0.45), false),
        "gold_ggx_stretched" => metal(Microfacets::new(Ggx, 0.5, 0.1), false),
        "glass" => glass(1.5, None, false),
        "sheet" => Bsdf::ThinDielectric(ThinDielectric { eta: 1.5, reflectance: Spectrum::WHITE, transmittance: Spectrum::WHITE }),
        "frosted_ggx" => glass(1.5, Microfacets::ggx(0.3), false),
        "frosted_beckmann" => glass(1.33, Microfacets::new(Beckmann, 0.3, 0.3), false),
        "smooth_plastic" => Bsdf::Plastic(plastic(1.49, colour, None, false)),
        "smooth_plastic_nonlinear" => Bsdf::Plastic(plastic(1.9, colour, None, true)),
        "rough_plastic_ggx" => Bsdf::Plastic(plastic(1.49, colour, Microfacets::ggx(0.2), false)),
        "rough_plastic_beckmann_nonlinear" => {
            let plastic = plastic(1.6, colour, Microfacets::new(Beckmann, 0.4, 0.4), true);
            Bsdf::Plastic(Plastic { specular: Spectrum::grey(0.5), ..plastic })
        }
        // `principled` of metallic 1, roughness 0.5.
        "principled_metal" => {
            let base_color = Spectrum::rgb(0.9, 0.6, 0.3);
            Bsdf::Principled(Principled::new(&PrincipledParameters { base_color, metallic: 1.0, ..PRINCIPLED }))
        }
        other => panic!("no material {other}"),
    }
}

fn near(found: f32, expected: f32, tolerance: f32) -> bool {
    (found - expected).abs() <= tolerance * expected.abs() + 1e-6
}

#[test]
fn values_and_densities_agree() {
    for (name, wo, wi, value, density) in VALUES {
        // Mitsuba takes rational fits for Beckmann's shadowing and for the reflectance of smooth plastic's inside.
        let tolerance = if name.contains("beckmann") || name.contains("plastic") { 6e-3 } else { 5e-4 };
        let found = material(name).evaluate(Vec3::from(wo).normalize(), Vec3::from(wi).normalize());
        for (found, expected) in found.value.to_rgb().into_iter().zip(value) {
            assert!(near(found, expected, tolerance), "{name} {wo:?} {wi:?}: value {found} against {expected}");
        }
        assert!(near(found.density, density, tolerance), "{name} {wo:?} {wi:?}: density {} against {density}", found.density);
    }
}

#[test]
fn delta_lobes_agree() {
    for (name, wo, transmits, value, probability, wi) in DELTAS {
        let (bsdf, wo) = (material(name), Vec3::from(wo).normalize());
        let found = bsdf.evaluate_delta(wo, transmits);
        for (found, expected) in found.value.to_rgb().into_iter().zip(value) {
            assert!(near(found, expected, 1e-4), "{name} {wo} {transmits}: value {found} against {expected}");
        }
        assert!(near(found.density, probability, 1e-4), "{name} {wo} {transmits}: {} against {probability}", found.density);
        let subject = Subject::from(bsdf);
        let directions = (0..64).filter_map(|k| sample(&subject, wo, k)).filter(|x| x.delta && (x.wi.z * wo.z < 0.0) == transmits);
        let directions: Vec<Vec3> = directions.map(|x| x.wi).collect();
        assert!(!directions.is_empty(), "{name}: no sample");
        assert!(directions.iter().all(|found| (*found - Vec3::from(wi)).length() < 2e-5), "{name}: {directions:?} against {wi:?}");
    }
}

#[rustfmt::skip]
const VALUES: [Row; 38] = [
    ("gold_ggx", [0.3, -0.2, 0.9], [-0.2, 0.3, 0.8], [1.49313, 1.24243, 0.500271], 1.54682),
    ("gold_ggx", [0.8, 0.3, 0.25], [-0.7, -0.1, 0.4], [0.788248, 0.668248, 0.332109], 0.845051),
    ("gold_ggx", [0.1, 0.1, 0.95], [0.6, -0.5, 0.2], [0.0158337, 0.0131722, 0.00538513], 0.0185812),
    ("gold_beckmann_stretched", [0.3, -0.2, 0.9], [-0.2, 0.3, 0.8], [1.1123, 0.925538, 0.372673], 1.14996),
    ("gold_beckmann_stretched", [0.8, 0.3, 0.25], [-0.7, -0.1, 0.4], [2.90118, 2.45951, 1.22234], 3.01869),
    ("gold_beckmann_stretched", [0.1, 0.1, 0.95], [0.6, -0.5, 0.2], [1.05359e-09, 8.7649e-10, 3.58331e-10], 1.14699e-09),
    ("gold_ggx_stretched", [0.3, -0.2, 0.9], [-0.2, 0.3, 0.8], [0.691837, 0.575676, 0.231799], 0.718297),
    ("gold_ggx_stretched", [0.8, 0.3, 0.25], [-0.7, -0.1, 0.4], [0.0501935, 0.0425522, 0.0211478], 0.0608179),
    ("gold_ggx_stretched", [0.1, 0.1, 0.95], [0.6, -0.5, 0.2], [0.00724566, 0.00602775, 0.00246429], 0.0105686),
    ("frosted_ggx", [0.3, -0.2, 0.9], [-0.2, 0.3, 0.8], [0.0331142, 0.0331142, 0.0331142], 0.0332649),
    ("frosted_ggx", [0.8, 0.3, 0.25], [-0.7, -0.1, 0.4], [0.105755, 0.105755, 0.105755], 0.112731),
    ("frosted_ggx", [0.1, 0.1, 0.95], [0.6, -0.5, 0.2], [0.00126385, 0.00126385, 0.00126385], 0.00160527),
    ("frosted_ggx", [0.3, -0.2, 0.9], [-0.25, 0.1, -0.9], [6.50779, 6.50779, 6.50779], 14.672),
    ("frosted_ggx", [0.8, 0.3, 0.25], [-0.6, -0.25, -0.7], [2.97936, 2.97936, 2.97936], 6.83119),
    ("frosted_ggx", [-0.4, 0.5, -0.7], [0.6, -0.6, 0.5], [4.16065, 4.16065, 4.16065], 1.96211),
    ("frosted_ggx", [0.2, 0.3, -0.9], [-0.1, -0.3, -0.8], [0.0379775, 0.0379775, 0.0379775], 0.0381105),
    ("frosted_beckmann", [0.3, -0.2, 0.9], [-0.2, 0.3, 0.8], [0.01813, 0.01813, 0.01813], 0.01813),
    ("frosted_beckmann", [0.8, 0.3, 0.25], [-0.7, -0.1, 0.4], [0.143304, 0.143304, 0.143304], 0.143304),
    ("frosted_beckmann", [0.1, 0.1, 0.95], [0.6, -0.5, 0.2], [4.1464e-05, 4.1464e-05, 4.1464e-05], 4.33891e-05),
    ("frosted_beckmann", [0.3, -0.2, 0.9], [-0.25, 0.1, -0.9], [15.8964, 15.8964, 15.8964], 28.1191),
    ("frosted_beckmann", [0.8, 0.3, 0.25], [-0.6, -0.25, -0.7], [2.27927, 2.27927, 2.27927], 4.0318),
    ("frosted_beckmann", [-0.4, 0.5, -0.7], [0.6, -0.6, 0.5], [9.48421, 9.48421, 9.48421], 5.36164),
    ("frosted_beckmann", [0.2, 0.3, -0.9], [-0.1, -0.3, -0.8], [0.0194879, 0.0194879, 0.0194879], 0.0194879),
    ("smooth_plastic", [0.3, -0.2, 0.9], [-0.2, 0.3, 0.8], [0.176897, 0.0884487, 0.0294829], 0.258623),
    ("smooth_plastic", [0.8, 0.3, 0.25], [-0.7, -0.1, 0.4], [0.0729245, 0.0364622, 0.0121541], 0.083622),
    ("smooth_plastic", [0.1, 0.1, 0.95], [0.6, -0.5, 0.2], [0.0368503, 0.0184251, 0.00614171], 0.0704472),
    ("smooth_plastic_nonlinear", [0.3, -0.2, 0.9], [-0.2, 0.3, 0.8], [0.0726038, 0.0255128, 0.0070979], 0.219595),
    ("smooth_plastic_nonlinear", [0.8, 0.3, 0.25], [-0.7, -0.1, 0.4], [0.0294734, 0.0103569, 0.00288138], 0.0726933),
    ("smooth_plastic_nonlinear", [0.1, 0.1, 0.95], [0.6, -0.5, 0.2], [0.0150206, 0.00527821, 0.00146845], 0.0598307),
    ("rough_plastic_ggx", [0.3, -0.2, 0.9], [-0.2, 0.3, 0.8], [0.198378, 0.129416, 0.0834418], 0.441394),
    ("rough_plastic_ggx", [0.8, 0.3, 0.25], [-0.7, -0.1, 0.4], [0.165911, 0.136194, 0.116383], 0.438896),
    ("rough_plastic_ggx", [0.1, 0.1, 0.95], [0.6, -0.5, 0.2], [0.0319474, 0.016325, 0.00591006], 0.0719873),
    ("rough_plastic_beckmann_nonlinear", [0.3, -0.2, 0.9], [-0.2, 0.3, 0.8], [0.103961, 0.0501335, 0.0246196], 0.309067),
    ("rough_plastic_beckmann_nonlinear", [0.8, 0.3, 0.25], [-0.7, -0.1, 0.4], [0.126728, 0.102782, 0.0914319], 0.396411),
    ("rough_plastic_beckmann_nonlinear", [0.1, 0.1, 0.95], [0.6, -0.5, 0.2], [0.0219488, 0.00920018, 0.00315736], 0.0746263),
    ("principled_metal", [0.3, -0.2, 0.9], [-0.2, 0.3, 0.8], [0.996103, 0.66407, 0.332036], 1.11028),
    ("principled_metal", [0.8, 0.3, 0.25], [-0.7, -0.1, 0.4], [0.77312, 0.537208, 0.301296], 0.891493),
    ("principled_metal", [0.1, 0.1, 0.95], [0.6, -0.5, 0.2], [0.0204296, 0.0136226, 0.00681559], 0.0272104),
];

#[rustfmt::skip]
const DELTAS: [DeltaRow; 16] = [
    ("gold_mirror", [0.3, -0.2, 0.9], false, [0.967257, 0.80486, 0.323993], 1.0, [-0.30943, 0.20628, 0.92828]),
    ("gold_mirror", [0.8, 0.3, 0.25], false, [0.959851, 0.836936, 0.47709], 1.0, [-0.89865, -0.33699, 0.28083]),
    ("glass", [0.3, -0.2, 0.9], false, [0.0403851, 0.0403851, 0.0403851], 0.0403851, [-0.30943, 0.20628, 0.92828]),
    ("glass", [0.3, -0.2, 0.9], true, [0.426496, 0.426496, 0.426496], 0.959615, [-0.20628, 0.13752, -0.96878]),
    ("glass", [0.8, 0.3, 0.25], false, [0.227562, 0.227562, 0.227562], 0.227562, [-0.89865, -0.33699, 0.28083]),
    ("glass", [0.8, 0.3, 0.25], true, [0.343306, 0.343306, 0.343306], 0.772438, [-0.59910, -0.22466, -0.76851]),
    ("glass", [0.4, -0.3, -0.7], false, [0.0925981, 0.0925981, 0.0925981], 0.0925981, [-0.46499, 0.34874, -0.81373]),
    ("glass", [0.4, -0.3, -0.7], true, [2.04165, 2.04165, 2.04165], 0.907402, [-0.69749, 0.52311, 0.48976]),
    ("sheet", [0.3, -0.2, 0.9], false, [0.0776348, 0.0776348, 0.0776348], 0.0776348, [-0.30943, 0.20628, 0.92828]),
    ("sheet", [0.3, -0.2, 0.9], true, [0.922365, 0.922365, 0.922365], 0.922365, [-0.30943, 0.20628, -0.92828]),
    ("sheet", [0.8, 0.3, 0.25], false, [0.370754, 0.370754, 0.370754], 0.370754, [-0.89865, -0.33699, 0.28083]),
    ("sheet", [0.8, 0.3, 0.25], true, [0.629246, 0.629246, 0.629246], 0.629246, [-0.89865, -0.33699, -0.28083]),
    ("sheet", [0.4, -0.3, -0.7], false, [0.0829713, 0.0829713, 0.0829713], 0.0829713, [-0.46499, 0.34874, -0.81373]),
    ("sheet", [0.4, -0.3, -0.7], true, [0.917029, 0.917029, 0.917029], 0.917029, [-0.46499, 0.34874, 0.81373]),
    ("smooth_plastic", [0.3, -0.2, 0.9], false, [0.0391045, 0.0391045, 0.0391045], 0.108804, [-0.30943, 0.20628, 0.92828]),
    ("smooth_plastic", [0.8, 0.3, 0.25], false, [0.225648, 0.225648, 0.225648], 0.466441, [-0.89865, -0.33699, 0.28083]),
];

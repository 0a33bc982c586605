//! What a vertex costs in each material: to evaluate a pair of directions, and to sample one.
//!
//! `cargo bench -p gradfarm-core --bench material`. Directions cycle through 256 pairs, so that no branch is learnt by heart.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gradfarm_core::material::{
    Bounced, BouncedGlass, Bsdf, Coat, Conductor, Dielectric, Diffuse, Distribution, Microfacets, Phong, Plastic, Principled,
    PrincipledParameters, RoughDiffuse, ThinDielectric, Ward,
};
use gradfarm_core::math::Vec3;
use gradfarm_core::sampling::{Dimension, SampleKey, SampleStream, warp};
use gradfarm_core::spectrum::Spectrum;
use std::hint::black_box;
use std::time::Duration;

const PAIRS: u32 = 256;

/// A pair of directions above the surface, and three numbers to sample by.
struct Draw {
    wo: Vec3,
    wi: Vec3,
    choice: f32,
    u: [f32; 2],
}

fn draws() -> Vec<Draw> {
    (0..PAIRS)
        .map(|index| {
            let stream = SampleStream::open(SampleKey { seed: 1, frame: 0, x: 0, y: 0, index });
            let direction = |k| warp::cosine_hemisphere(stream.pair(Dimension::direction(k)));
            Draw { wo: direction(4), wi: direction(5), choice: stream.number(Dimension::lobe(6)), u: stream.pair(Dimension::direction(6)) }
        })
        .collect()
}

fn materials() -> Vec<(&'static str, Bsdf)> {
    let (white, grey) = (Spectrum::WHITE, Spectrum::grey(0.5));
    let (eta, k) = (Spectrum::rgb(0.14, 0.37, 1.44), Spectrum::rgb(3.98, 2.39, 1.6));
    let metal = |facets, bounced| Bsdf::Conductor(Conductor { eta, k, reflectance: white, facets, bounced, two_sided: true });
    let glass = |facets, bounced| Bsdf::Dielectric(Dielectric { eta: 1.5, reflectance: white, transmittance: white, facets, bounced });
    let plastic =
        |facets| Bsdf::Plastic(Plastic { diffuse: grey, specular: white, coat: Coat::new(1.5, facets), nonlinear: false, two_sided: true });
    let plain = PrincipledParameters {
        base_color: grey,
        metallic: 0.0,
        roughness: 0.5,
        anisotropy: 0.0,
        ior: 1.5,
        specular: 1.0,
        specular_color: white,
        clearcoat: 0.0,
        clearcoat_roughness: 0.1,
        sheen_color: Spectrum::BLACK,
        sheen_roughness: 0.5,
        transmission: 0.0,
        thin: true,
        two_sided: true,
    };
    let rich = PrincipledParameters { metallic: 0.3, clearcoat: 0.5, sheen_color: grey, transmission: 0.3, thin: false, ..plain };
    let (ggx, beckmann) = (Microfacets::ggx(0.2), Microfacets::new(Distribution::Beckmann, 0.2, 0.2));
    vec![
        ("diffuse", Bsdf::Diffuse(Diffuse { reflectance: grey, two_sided: true })),
        ("rough diffuse", Bsdf::RoughDiffuse(RoughDiffuse::new(grey, 0.5, true))),
        ("mirror", metal(None, None)),
        ("metal ggx", metal(ggx, None)),
        ("metal beckmann", metal(beckmann, None)),
        ("metal conserving", metal(ggx, Bounced::new(eta, k, ggx))),
        ("glass", glass(None, None)),
        ("glass ggx", glass(ggx, None)),
        ("glass conserving", glass(ggx, BouncedGlass::new(1.5, ggx))),
        ("sheet", Bsdf::ThinDielectric(ThinDielectric { eta: 1.5, reflectance: white, transmittance: white })),
        ("plastic", plastic(None)),
        ("plastic ggx", plastic(ggx)),
        ("principled", Bsdf::Principled(Principled::new(&plain))),
        ("principled rich", Bsdf::Principled(Principled::new(&rich))),
        ("phong", Bsdf::Phong(Phong { diffuse: grey, specular: grey, exponent: 50.0, two_sided: true })),
        ("ward", Bsdf::Ward(Ward { diffuse: grey, specular: grey, alpha_u: 0.2, alpha_v: 0.3, two_sided: true })),
        ("null", Bsdf::Null),
    ]
}

fn bench(c: &mut Criterion) {
    let draws = draws();
    for (what, sampling) in [("evaluate", false), ("sample", true)] {
        let mut group = c.benchmark_group(format!("material/{what}"));
        group.throughput(Throughput::Elements(u64::from(PAIRS))).sample_size(20);
        group.warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(1));
        for (name, bsdf) in materials() {
            group.bench_function(name, |b| {
                b.iter(|| {
                    for draw in &draws {
                        let bsdf = black_box(&bsdf);
                        if sampling {
                            black_box(bsdf.sample(draw.wo, draw.choice, draw.u));
                        } else {
                            black_box(bsdf.evaluate(draw.wo, draw.wi));
                        }
                    }
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);

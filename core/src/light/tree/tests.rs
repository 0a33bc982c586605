//! The tree's probabilities, and what it saves.

use super::*;
use crate::geometry::{Disk, Sphere};
use crate::light::{AreaLight, Emitter, Environment, Falloff, Light, Lights, PointLight, SpotLight};
use crate::sampling::warp::uniform_sphere;
use crate::sampling::{Dimension, SampleKey, SampleStream};
use crate::spectrum::Spectrum;

fn stream(index: u32) -> SampleStream {
    SampleStream::open(SampleKey { seed: 5, frame: 0, x: 1, y: 0, index })
}

/// Small lamps of all kinds all over a hall of 40 × 10 × 40 metres.
fn lamps(count: u32) -> Vec<Light> {
    (0..count)
        .map(|k| {
            let s = stream(k);
            let ([x, y], z) = (s.pair(Dimension::PIXEL), s.number(Dimension::lobe(0)));
            let place = Vec3::new(40.0 * x - 20.0, 3.0 + 7.0 * y, 40.0 * z - 20.0);
            let axis = uniform_sphere(s.pair(Dimension::LENS));
            let brightness = Spectrum::grey(0.2 + 5.0 * s.number(Dimension::lobe(1)));
            let frame = crate::math::Frame::from_normal(axis);
            let disk = Disk { centre: place, x: frame.tangent * 0.1, y: frame.bitangent * 0.1 };
            let area = |emitter, two_sided| Light::Area(AreaLight { radiance: (brightness * 40.0).into(), two_sided, emitter });
            match k % 5 {
                0 => Light::Point(PointLight { position: place, intensity: brightness }),
                1 => Light::Spot(SpotLight {
                    position: place,
                    axis,
                    intensity: brightness * 4.0,
                    inner: 0.3,
                    outer: 0.8,
                    falloff: Falloff::Smoothstep,
                }),
                2 => area(Emitter::Analytic(Sphere { centre: place, radius: 0.1 }.into()), false),
                3 => area(Emitter::Analytic(disk.into()), true),
                _ => area(Emitter::Analytic(disk.into()), false),
            }
        })
        .collect()
}

fn places() -> impl Iterator<Item = Vec3> {
    (0..40).map(|k| {
        let [x, z] = stream(9000 + k).pair(Dimension::PIXEL);
        Vec3::new(38.0 * x - 19.0, if k % 4 == 0 { 5.0 } else { 0.0 }, 38.0 * z - 19.0)
    })
}

#[test]
fn probabilities_sum_to_one_and_are_those_of_samples() {
    let mut lights = lamps(60);
    lights.push(Light::Environment(Environment { radiance: Spectrum::grey(0.001) }));
    let all = Lights::choosing(lights, 25.0, 8);
    for from in places() {
        let sum: f64 = (0..all.len() as u32).map(|light| f64::from(all.probability(from, light))).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{from}: {sum}");
        let n = 20_000;
        let mut counts = vec![0u32; all.len()];
        for k in 0..n {
            let (light, probability) = all.choose(from, (k as f32 + 0.5) / n as f32).unwrap();
            assert_eq!(probability, all.probability(from, light));
            counts[light as usize] += 1;
        }
        for (light, count) in counts.iter().enumerate() {
            let expected = f64::from(all.probability(from, light as u32)) * f64::from(n);
            assert!((f64::from(*count) - expected).abs() < 2.0 + 1e-3 * expected, "{from}, light {light}: {count}, expected {expected}");
        }
    }
}

#[test]
fn whatever_shines_somewhere_can_be_chosen_there() {
    let lights = lamps(200);
    let all = Lights::choosing(lights.clone(), 25.0, 8);
    let alone: Vec<Lights> = lights.into_iter().map(|light| Lights::choosing(vec![light], 25.0, 8)).collect();
    let mut dark = 0;
    for from in places() {
        for (light, one) in alone.iter().enumerate() {
            let lit = (0..16)
                .filter_map(|k| one.sample(from, || 0.5, stream(k).pair(Dimension::LENS)))
                .any(|sample| !one.radiance(&sample.point, from).is_black());
            let probability = all.probability(from, light as u32);
            assert!(!lit || probability > 0.0, "light {light} at {from}");
            dark += u32::from(probability == 0.0);
        }
    }
    assert!(dark > 500, "lights that shine elsewhere are never chosen: {dark} of 8000");
}

/// Mean over lit places of the variance of one sample of the irradiance on level ground, nothing in between, relative to its square.
fn relative_variance(lights: &Lights) -> f64 {
    let each = places().filter_map(|from| {
        let n = 4000;
        let (mut first, mut second) = (0.0f64, 0.0f64);
        for k in 0..n {
            let s = stream(k);
            let sample = lights.sample(from, || s.number(Dimension::light_choice(0)), s.pair(Dimension::light_point(0)));
            let value = sample.map_or(0.0, |sample| {
                let towards = (sample.point.position - from).normalize();
                f64::from(lights.radiance(&sample.point, from).mean() * towards.y.max(0.0) / sample.density)
            });
            first += value / f64::from(n);
            second += value * value / f64::from(n);
        }
        (first > 0.0).then(|| (second - first * first) / (first * first))
    });
    let (sum, count) = each.fold((0.0, 0.0), |(sum, count), variance| (sum + variance, count + 1.0));
    sum / count
}

#[test]
fn a_tree_beats_power_on_many_lights() {
    for count in [4, 8, 16, 32, 64, 1000] {
        let by_power = relative_variance(&Lights::choosing(lamps(count), 25.0, usize::MAX));
        let by_tree = relative_variance(&Lights::choosing(lamps(count), 25.0, 1));
        let ratio = by_power / by_tree;
        eprintln!("{count} lights: relative variance {by_power:.2} by power, {by_tree:.2} by the tree, ratio {ratio:.2}");
        assert!(count < super::super::choice::TREE_FROM as u32 || ratio > 1.0);
        assert!(count < 1000 || ratio > 3.0, "ratio {ratio}");
    }
}

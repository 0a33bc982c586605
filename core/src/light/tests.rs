//! Closed forms of what lights give, and samples against their densities.

use std::sync::Arc;

use super::*;
use crate::math::{Frame, sin_cos};
use crate::sampling::{Dimension, SampleKey, SampleStream};

fn pair(index: u32) -> [f32; 2] {
    SampleStream::open(SampleKey { seed: 17, frame: 0, x: 0, y: 0, index }).pair(Dimension::light_point(0))
}

/// Irradiance of level ground at a place, nothing in between, by samples of one light.
fn irradiance(light: Light, at: Vec3) -> f64 {
    let lights = Lights::new(vec![light], 10.0);
    let n = 20_000;
    let each = (0..n).filter_map(|k| lights.sample(at, || 0.5, pair(k))).map(|sample| {
        let point = &sample.point;
        let towards = if point.infinite { point.position } else { (point.position - at).normalize() };
        f64::from(lights.radiance(point, at).mean() * towards.y.max(0.0) / sample.density)
    });
    each.sum::<f64>() / f64::from(n)
}

#[test]
fn lights_without_extent_give_their_closed_form() {
    // 2 m above and 1.5 m aside: d = 2.5, cosθ = 0.8.
    let (at, position, intensity) = (Vec3::new(1.5, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0), Spectrum::grey(10.0));
    let expected = 10.0 * 0.8 / 6.25;
    let point = irradiance(Light::Point(PointLight { position, intensity }), at);
    assert!((point / expected - 1.0).abs() < 1e-5, "{point}");
    // Half-way between the angles of a spot whose axis points straight down, falling linearly.
    let angle = libm::atanf(0.75);
    let spot = SpotLight { position, axis: -Vec3::Y, intensity, inner: angle - 0.1, outer: angle + 0.1, falloff: Falloff::Linear };
    let spot = irradiance(Light::Spot(spot), at);
    assert!((spot / (0.5 * expected) - 1.0).abs() < 1e-4, "{spot}");
    let towards = Vec3::new(0.6, 0.8, 0.0);
    let parallel = irradiance(Light::Directional(DirectionalLight { towards, irradiance: Spectrum::grey(3.0) }), at);
    assert!((parallel / 2.4 - 1.0).abs() < 1e-5, "{parallel}");
}

#[test]
fn surroundings_give_their_closed_form() {
    let pi = std::f64::consts::PI;
    let constant = irradiance(Light::Environment(Environment { radiance: Spectrum::grey(2.0) }), Vec3::ZERO);
    assert!((constant / (2.0 * pi) - 1.0).abs() < 2e-3, "{constant}");
    // Radiance 4 above the horizon and none below; rows blend only at the horizon, where the cosine is small.
    let texels = (0..64 * 32).map(|k| Spectrum::grey(if k < 64 * 16 { 4.0 } else { 0.0 })).collect();
    let image = ImageEnvironment::new(64, 32, texels, Frame::WORLD).unwrap();
    let image = irradiance(Light::Image(Arc::new(image)), Vec3::ZERO);
    assert!((image / (4.0 * pi) - 1.0).abs() < 5e-3, "{image}");
    // A disk of radius 1 at height 1: E = π L r²/(r² + h²).
    let disk = crate::geometry::Disk { centre: Vec3::Y, x: Vec3::X, y: Vec3::Z };
    let emitter = Emitter::Analytic(disk.into());
    let lamp = irradiance(Light::Area(AreaLight { radiance: Spectrum::WHITE.into(), two_sided: false, emitter }), Vec3::ZERO);
    assert!((lamp / (0.5 * pi) - 1.0).abs() < 2e-3, "{lamp}");
}

#[test]
fn directions_to_an_image_have_their_density() {
    // χ² over 8 × 16 cells of (cosθ, φ) about an axis that is none of the image's.
    let (rows, columns, fine) = (8usize, 16usize, 24usize);
    let texels = (0..16 * 8u32).map(|k| Spectrum::grey(0.2 + (k * 7 % 11) as f32 + if k == 37 { 90.0 } else { 0.0 })).collect();
    let image = ImageEnvironment::new(16, 8, texels, Frame::from_normal(Vec3::new(0.48, 0.6, 0.64))).unwrap();
    let direction = |row: f32, column: f32| {
        let cos = 1.0 - 2.0 * row / rows as f32;
        let (s, c) = sin_cos(2.0 * PI * column / columns as f32);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        Vec3::new(sin * c, sin * s, cos)
    };
    let n = 200_000u32;
    let mut counts = vec![0u32; rows * columns];
    for k in 0..n {
        let numbers = SampleStream::open(SampleKey { seed: 3, frame: 0, x: k, y: 0, index: 0 }).pair(Dimension::light_point(0));
        let (point, _) = image.sample(0, numbers).unwrap();
        let d = point.position;
        let row = ((1.0 - d.z) * 0.5 * rows as f32) as usize;
        let turns = libm::atan2f(d.y, d.x) / (2.0 * PI);
        let column = ((turns - turns.floor()) * columns as f32) as usize;
        counts[row.min(rows - 1) * columns + column.min(columns - 1)] += 1;
    }
    let mut statistic = 0.0;
    let mut sum = 0.0;
    for (cell, count) in counts.iter().enumerate() {
        let (row, column) = ((cell / columns) as f32, (cell % columns) as f32);
        let place = |k: usize| (k as f32 + 0.5) / fine as f32;
        let mean: f64 =
            (0..fine * fine).map(|k| f64::from(image.density(direction(row + place(k % fine), column + place(k / fine))))).sum::<f64>()
                / (fine * fine) as f64;
        let share = mean * 4.0 * std::f64::consts::PI / (rows * columns) as f64;
        sum += share;
        let expected = share * f64::from(n);
        statistic += (f64::from(*count) - expected).powi(2) / expected;
    }
    assert!((sum - 1.0).abs() < 2e-3, "{sum}");
    // 127 degrees of freedom: mean 127, deviation 16; the rest is the coarse integral of a density with steps.
    assert!(statistic < 250.0, "χ² = {statistic}");
}

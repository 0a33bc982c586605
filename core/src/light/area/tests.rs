//! Area lights: densities, sides and textures.

use super::*;
use crate::geometry::{Cylinder, Disk};
use crate::sampling::{Dimension, SampleKey, SampleStream};
use crate::texture::{Checkerboard, Texture};
use std::sync::Arc;

fn of(emitter: Emitter, two_sided: bool) -> AreaLight {
    AreaLight { radiance: Spectrum::WHITE.into(), two_sided, emitter }
}

fn pair(k: u32) -> [f32; 2] {
    SampleStream::open(SampleKey { seed: 2, frame: 0, x: 0, y: 0, index: k }).pair(Dimension::light_point(0))
}

/// ∫ over directions of the function of light points, by sampled points.
fn integral(light: &AreaLight, from: Vec3, f: impl Fn(&LightPoint) -> f64) -> f64 {
    let n = 20_000;
    let sum: f64 = (0..n).filter_map(|k| light.sample(0, from, pair(k))).map(|(point, density)| f(&point) / f64::from(density)).sum();
    sum / f64::from(n)
}

fn square() -> Emitter {
    Emitter::Parallelogram { corner: Vec3::ZERO, edges: [Vec3::X, Vec3::Y] }
}

#[test]
fn densities_integrate_to_the_solid_angle() {
    let tau = 2.0 * std::f64::consts::PI;
    let sphere = of(Emitter::Analytic(Sphere { centre: Vec3::ZERO, radius: 1.0 }.into()), false);
    let expected = tau * (1.0 - (1.0f64 - 0.25).sqrt());
    assert!((integral(&sphere, Vec3::new(0.0, 2.0, 0.0), |_| 1.0) / expected - 1.0).abs() < 1e-3);
    // A unit square seen from one unit above a corner fills asin-shaped Ω = atan(1/√3) = π/6.
    let one = of(square(), false);
    assert!((integral(&one, Vec3::Z, |_| 1.0) / (std::f64::consts::PI / 6.0) - 1.0).abs() < 1e-3);
    assert_eq!(integral(&one, -Vec3::Z, |_| 1.0), 0.0);
    // A unit disk from one unit above its centre.
    let disk = Emitter::Analytic(Disk { centre: Vec3::ZERO, x: Vec3::X, y: Vec3::Y }.into());
    let expected = tau * (1.0 - 0.5f64.sqrt());
    assert!((integral(&of(disk, false), Vec3::Z, |_| 1.0) / expected - 1.0).abs() < 1e-3);
}

#[test]
fn the_inside_of_a_tube_fills_all_but_its_ends() {
    let tube = Analytic { flipped: true, ..Cylinder { start: -Vec3::Z, axis: Vec3::Z, length: 2.0, radius: 1.0 }.into() };
    // From the middle the wall fills the directions with |cosθ| < 1/√2.
    let expected = 4.0 * std::f64::consts::PI * 0.5f64.sqrt();
    let found = integral(&of(Emitter::Analytic(tube), false), Vec3::ZERO, |_| 1.0);
    assert!((found / expected - 1.0).abs() < 1e-3, "{found}, expected {expected}");
}

#[test]
fn two_sides_give_the_same_light_to_both() {
    for emitter in [square(), Emitter::Analytic(Sphere { centre: Vec3::new(0.5, 0.5, 0.0), radius: 0.3 }.into())] {
        let one = of(emitter.clone(), false);
        let both = of(emitter, true);
        let above = integral(&one, Vec3::Z, |_| 1.0);
        assert!((integral(&both, Vec3::Z, |_| 1.0) / above - 1.0).abs() < 1e-3);
        assert!((integral(&both, -Vec3::Z, |_| 1.0) / above - 1.0).abs() < 1e-2);
        assert_eq!(both.power(), 2.0 * one.power());
    }
    let (point, _) = of(square(), true).sample(0, -Vec3::Z, [0.3, 0.4]).unwrap();
    assert_eq!(of(square(), true).radiance(&point, -Vec3::Z), Spectrum::WHITE);
    assert_eq!(of(square(), false).radiance(&point, -Vec3::Z), Spectrum::BLACK);
    // From inside a sphere, every direction meets its back.
    let shell = of(Emitter::Analytic(Sphere { centre: Vec3::ZERO, radius: 1.0 }.into()), true);
    let all = integral(&shell, Vec3::new(0.2, 0.3, -0.4), |_| 1.0);
    assert!((all / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-2, "{all}");
}

#[test]
fn a_texture_lights_by_its_place() {
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    assert!(matches!(Emitter::from_mesh(&mesh, false), Some(Emitter::Parallelogram { .. })));
    let checkerboard =
        Checkerboard { even: Spectrum::grey(3.0).into(), odd: Spectrum::grey(1.0).into(), uv: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
    let radiance = ColourInput::Texture(Arc::new(Texture::Checkerboard(checkerboard)));
    let light = AreaLight { radiance, two_sided: false, emitter: Emitter::from_mesh(&mesh, true).unwrap() };
    assert!((light.power() - 2.0).abs() < 0.02, "mean of 3 and 1 over a square metre");
    for k in 0..500 {
        let (point, _) = light.sample(0, Vec3::Z, pair(k)).unwrap();
        assert!((point.at.uv - point.position.truncate()).length() < 1e-5, "{point:?}");
        if (point.at.uv - 0.5).abs().min_element() < 1e-5 {
            continue;
        }
        let same = (point.position.x < 0.5) == (point.position.y < 0.5);
        assert_eq!(light.radiance(&point, Vec3::Z), Spectrum::grey(if same { 3.0 } else { 1.0 }));
    }
}

#[test]
fn two_triangles_become_a_parallelogram() {
    let mesh =
        Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y], triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
    let emitter = Emitter::from_mesh(&mesh, false).unwrap();
    assert!(matches!(emitter, Emitter::Parallelogram { .. }));
    assert_eq!(emitter.area(), 1.0);
}

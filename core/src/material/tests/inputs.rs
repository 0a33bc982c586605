//! Inputs from textures: numbers, tables over roughness, reliefs.

use super::*;
use crate::math::Vec2;
use crate::texture::{Checkerboard, ColourInput, Texture};
use std::sync::Arc;

/// `even` where both coordinates are below one half, `odd` beyond in u.
fn fields(even: Spectrum, odd: Spectrum) -> Arc<Texture> {
    let uv = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    Arc::new(Texture::Checkerboard(Checkerboard { even: ColourInput::Constant(even), odd: ColourInput::Constant(odd), uv }))
}

fn at(u: f32) -> TexturePoint {
    TexturePoint { uv: Vec2::new(u, 0.25), ..TexturePoint::default() }
}

#[test]
fn textures_speak_where_they_are_asked() {
    let (dark, bright) = (Spectrum::rgb(0.1, 0.2, 0.3), Spectrum::rgb(0.9, 3.0, -1.0));
    let material = Material::Textured(Textured::Phong {
        diffuse: ColourInput::Texture(fields(dark, bright)),
        specular: ColourInput::Constant(Spectrum::BLACK),
        exponent: ScalarInput::Texture(fields(Spectrum::grey(2.0), Spectrum::grey(1e30))),
        two_sided: true,
    });
    assert_eq!(material.albedo(&at(0.25)), dark);
    assert_eq!(material.albedo(&at(0.75)), Spectrum::rgb(0.9, 1.0, 0.0), "held within 0 to 1");
    assert!(material.evaluate(&at(0.75), Vec3::Z, Vec3::Z).density.is_finite());
}

#[test]
fn a_textured_roughness_may_be_a_mirror_here_and_rough_there() {
    let rough =
        RoughInput { distribution: Distribution::Ggx, u: ScalarInput::Texture(fields(Spectrum::BLACK, Spectrum::grey(0.4))), v: None };
    let (eta, reflectance) = (1.5, ColourInput::Constant(Spectrum::WHITE));
    let bounces = GlassBounces::Table(BouncedGlassTable::new(Distribution::Ggx, eta));
    let material = Material::Textured(Textured::Dielectric { eta, transmittance: reflectance.clone(), reflectance, rough, bounces });
    assert_eq!(material.delta_probability(&at(0.25), Vec3::Z), 1.0);
    assert_eq!(material.delta_probability(&at(0.75), Vec3::Z), 0.0);
    assert!((material.roughness(&at(0.75)) - 0.4).abs() < 1e-6);
}

#[test]
fn tables_over_roughness_agree_with_what_they_tabulate() {
    for distribution in [Distribution::Ggx, Distribution::Beckmann] {
        let (glasses, coats) = (BouncedGlassTable::new(distribution, 1.5), CoatTable::new(distribution, 1.5));
        for alpha in [0.12, 0.33, 0.71, 1.0] {
            let facets = Microfacets::new(distribution, alpha, alpha);
            let white = Spectrum::WHITE;
            let glass_of = |bounced| Bsdf::Dielectric(Dielectric { eta: 1.5, reflectance: white, transmittance: white, facets, bounced });
            let plastic_of = |coat| Bsdf::Plastic(Plastic { diffuse: white, specular: white, coat, nonlinear: true, two_sided: true });
            let pairs = [
                (glass_of(glasses.at(facets)), glass_of(BouncedGlass::new(1.5, facets))),
                (plastic_of(coats.at(facets)), plastic_of(Coat::new(1.5, facets))),
            ];
            for (tabulated, exact) in pairs {
                for wo in views() {
                    for k in 0..200 {
                        let wi = crate::sampling::warp::uniform_sphere(stream(k).pair(Dimension::direction(3)));
                        let (a, b) = (tabulated.evaluate(wo, wi), exact.evaluate(wo, wi));
                        let near = |a: f32, b: f32| (a - b).abs() <= 0.02 * b + 3e-3;
                        assert!(
                            near(a.value.max(), b.value.max()) && near(a.density, b.density),
                            "{distribution:?} {alpha}: {a:?} against {b:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn reliefs_bend_the_normal() {
    let surface = Surface { normal: Vec3::Z, du: Vec3::X, dv: Vec3::Y };
    let matt = || Material::from(Bsdf::Diffuse(Diffuse { reflectance: Spectrum::WHITE, two_sided: true }));
    // At the edge of two fields the height steps by one, over a difference of 1/8192.
    let height = ScalarInput::Texture(fields(Spectrum::BLACK, Spectrum::WHITE));
    let bumpy = |scale| Material::from(Composite::Bent { material: matt(), relief: Relief::Bumps { height: height.clone(), scale } });
    let up = bumpy(1.0 / 8192.0).bent(&at(0.5), &surface, true);
    assert!((up - Vec3::new(-1.0, 0.0, 1.0).normalize()).length() < 1e-6, "{up}");
    assert_eq!(bumpy(1.0).bent(&at(0.25), &surface, true), Vec3::Z, "even ground");
    let carved = |colour, scale| {
        let relief = Relief::Normals { normals: ColourInput::Constant(colour), scale };
        Material::from(Composite::Bent { material: matt(), relief })
    };
    let right = carved(Spectrum::rgb(1.0, 0.5, 1.0), 2.0);
    let expected = Vec3::new(2.0, 0.0, 1.0).normalize();
    assert!((right.bent(&at(0.0), &surface, true) - expected).length() < 1e-6);
    // A surface without texture coordinates keeps its own normal under bumps.
    let plain = Surface { du: Vec3::ZERO, dv: Vec3::ZERO, ..surface };
    assert_eq!(bumpy(1.0).bent(&at(0.25), &plain, true), Vec3::Z);
    // Each side has its own relief, and a blend lies between its parts.
    let flat = carved(Spectrum::rgb(0.5, 0.5, 1.0), 1.0);
    let sides = Material::from(Composite::TwoSided { front: right.clone(), back: flat.clone() });
    assert!((sides.bent(&at(0.0), &surface, true) - expected).length() < 1e-6);
    assert!((sides.bent(&at(0.0), &surface, false) - Vec3::Z).length() < 1e-6);
    let both = Material::from(Composite::Blend { first: right, second: flat, weight: ScalarInput::Constant(0.5) });
    let between = (expected + Vec3::Z).normalize();
    assert!((both.bent(&at(0.0), &surface, true) - between).length() < 1e-6);
    assert!(both.needs_tangents() && both.is_textured() && both.bends());
}

//! Emitters: where they stand, how bright they are.

use super::*;
use crate::scene::description::{Falloff, Light};

fn read(inner: &str) -> (SceneDescription, Vec<String>) {
    import(&around(inner), "s.xml").unwrap()
}

#[test]
fn lights_without_a_surface() {
    let look = "<transform name=\"to_world\"><lookat origin=\"1, 2, 3\" target=\"1, 0, 3\" up=\"0, 0, 1\"/></transform>";
    let (scene, _) = read(&format!(
        "<emitter type=\"point\" id=\"Bulb\"><point name=\"position\" x=\"1\" y=\"2\" z=\"3\"/><rgb name=\"intensity\" value=\"4 5 6\"/></emitter>\
         <emitter type=\"spot\">{look}<float name=\"cutoff_angle\" value=\"40\"/></emitter>\
         <emitter type=\"directional\"><vector name=\"direction\" x=\"1\" y=\"-1\"/><float name=\"irradiance\" value=\"7\"/></emitter>\
         <emitter type=\"directional\">{look}</emitter>"
    ));
    let Light::Point(bulb) = &scene.lights[0] else { panic!() };
    assert_eq!((bulb.name.as_str(), bulb.position, bulb.intensity), ("Bulb", [1.0, 2.0, 3.0], Colour([4.0, 5.0, 6.0])));
    let Light::Spot(spot) = &scene.lights[1] else { panic!() };
    assert_eq!((spot.position, spot.inner_angle, spot.outer_angle, spot.falloff), ([1.0, 2.0, 3.0], 30.0, 40.0, Falloff::Linear));
    assert!(glam::DVec3::from(spot.direction).abs_diff_eq(glam::DVec3::NEG_Y, 1e-12));
    let (Light::Directional(first), Light::Directional(second)) = (&scene.lights[2], &scene.lights[3]) else { panic!() };
    assert_eq!((first.direction, first.irradiance), ([1.0, -1.0, 0.0], Colour::grey(7.0)));
    assert!(glam::DVec3::from(second.direction).abs_diff_eq(glam::DVec3::NEG_Y, 1e-12));
}

#[test]
fn environment_images_are_turned_to_where_mitsuba_has_them() {
    let (scene, _) =
        read("<emitter type=\"envmap\"><string name=\"filename\" value=\"sky.exr\"/><float name=\"scale\" value=\"2\"/></emitter>");
    let image = scene.environment.unwrap().image.unwrap();
    assert_eq!((image.file.as_str(), image.scale), ("sky.exr", Colour::grey(2.0)));
    // −Z of Mitsuba's is at the left edge, which in our image is +Z.
    let turned = image.to_world.matrix().transform_vector3(glam::DVec3::Z);
    assert!(turned.abs_diff_eq(glam::DVec3::NEG_Z, 1e-12), "{turned}");
}

#[test]
fn skies_keep_their_sun_where_it_is_in_the_world() {
    let world = |inner: &str| {
        let (scene, report) = read(inner);
        assert!(report.iter().any(|line| line.contains("sky model")));
        let sky = scene.environment.unwrap().sky.unwrap();
        let sun = glam::DVec3::from(sky.sun_direction);
        (sky.to_world.matrix().transform_vector3(sun.normalize()), sun.y, sky)
    };
    let given = "<vector name=\"sun_direction\" x=\"0.3\" y=\"0.2\" z=\"0.9\"/>";
    let expected = glam::DVec3::new(0.3, 0.2, 0.9).normalize();
    let (sun, height, _) = world(&format!("<emitter type=\"sunsky\">{given}<float name=\"sun_scale\" value=\"0\"/></emitter>"));
    assert!(sun.abs_diff_eq(expected, 1e-9) && (height - 0.9).abs() < 1e-9, "{sun}: the zenith is +Z");
    let turn = "<transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/></transform>";
    let (sun, height, _) = world(&format!("<emitter type=\"sunsky\">{given}{turn}</emitter>"));
    assert!(sun.abs_diff_eq(expected, 1e-9) && (height - 0.2).abs() < 1e-9, "{sun} {height}: the zenith is +Y now");
    // Mitsuba 3.9.1's own sun of its default place and time.
    let (sun, ..) = world("<emitter type=\"sunsky\"/>");
    assert!(sun.abs_diff_eq(glam::DVec3::new(0.0513854, 0.691748, 0.720308), 2e-3), "{sun}");
}

#[test]
fn radiance_is_white_where_mitsuba_has_it_white() {
    let radiance = |inner: &str| {
        let (scene, _) = read(&format!("<shape type=\"sphere\"><emitter type=\"area\">{inner}</emitter></shape>"));
        *scene.shapes[0].emission.as_ref().unwrap().radiance.constant().unwrap()
    };
    assert_eq!(radiance("<float name=\"radiance\" value=\"2\"/>"), Colour::grey(2.0));
    assert_eq!(radiance("<rgb name=\"radiance\" value=\"2\"/>"), Colour::grey(2.0));
    assert_eq!(radiance("<spectrum name=\"radiance\" type=\"d65\"><float name=\"scale\" value=\"2\"/></spectrum>"), Colour::grey(2.0));
    // Flat over wavelengths: the same power at each is redder than daylight.
    let Colour(flat) = radiance("<spectrum name=\"radiance\" value=\"2\"/>");
    assert!(flat.iter().zip([2.40959, 1.89658, 1.81783]).all(|(a, b)| (a - b).abs() < 0.02 * b), "{flat:?}");
    // A light without a bsdf reflects nothing.
    let (scene, _) = read("<shape type=\"sphere\"><emitter type=\"area\"/></shape>");
    let Material::Diffuse(black) = &scene.materials[scene.shapes[0].material.as_ref().unwrap()] else { panic!() };
    assert!(black.reflectance.is_black());
}

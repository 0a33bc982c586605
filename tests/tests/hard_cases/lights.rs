//! Hazards of lights: the tiny, the fierce, the near and the invisible.

use super::harness::{EFFORT, Effort, gradients_hold, looks, same, scene, shows};

/// A floor with these shapes and lights over it.
fn floor(shapes: &str, rest: &str) -> String {
    let then = if shapes.is_empty() { String::new() } else { format!(", {shapes}") };
    scene(
        &looks([0.0, 2.0, 5.0], [0.0, 0.0, 0.0], 30.0),
        r#""floor": { "diffuse": { "reflectance": [0.8, 0.5, 0.3] } }, "lamp": { "diffuse": { "reflectance": 0 } }"#,
        &format!(
            r#"{{ "geometry": "rectangle", "to_world": [{{ "rotate": {{ "axis": [1, 0, 0], "degrees": -90 }} }}, {{ "scale": [90, 1, 90] }}], "material": "floor" }}{then}"#
        ),
        rest,
    )
}

fn lamp(centre: [f64; 3], radius: f64, radiance: f64) -> String {
    format!(
        r#"{{ "geometry": {{ "sphere": {{ "center": {centre:?}, "radius": {radius} }} }}, "material": "lamp", "emission": {{ "radiance": {radiance:e} }} }}"#
    )
}

fn point(position: [f64; 3], intensity: f64) -> String {
    format!(r#", "lights": [{{ "point": {{ "position": {position:?}, "intensity": {intensity} }} }}]"#)
}

/// A ball of 10⁻⁸ m² cross section that glows with 10¹² W m⁻² sr⁻¹ is a point of 10⁴ W sr⁻¹.
#[test]
fn tiny_and_fierce_lamp() {
    let at = [0.5, 1.5, 0.5];
    let radius = (1e-8 / std::f64::consts::PI).sqrt();
    same("tiny lamp", &floor(&lamp(at, radius, 1e12), ""), &floor("", &point(at, 1e4)), 1.0, EFFORT);
}

/// A point a hair above the floor: the fierce spot stays within its pixels, and gradients are differences of pixels.
#[test]
fn point_beside_a_wall() {
    let text = floor("", &point([0.1, 1e-3, 0.0], 1.0));
    gradients_hold("point beside a wall", &text, Effort { samples: 256, depth: 3, ..EFFORT });
    same(
        "point beside a wall",
        &text,
        &floor(&lamp([0.1, 1e-3, 0.0], 1e-5, 1.0 / (std::f64::consts::PI * 1e-10)), ""),
        1.0,
        Effort { depth: 3, ..EFFORT },
    );
}

/// A lamp that faces away lights nothing, and is no chance either.
#[test]
fn lamp_that_faces_away() {
    let away = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "translate": [0, 1.5, 0] }, { "scale": [1, 1, 1] }], "material": "lamp", "emission": { "radiance": 100 } }"#;
    let with = floor(away, &point([0.5, 1.0, 1.5], 3.0));
    let unlit = away.replace(r#", "emission": { "radiance": 100 }"#, "");
    // The camera looks down on the glowing side in both: only the floor is compared.
    let low = |text: String| text.replace("[0.0, 2.0, 5.0]", "[0.0, 0.6, 5.0]").replace("[0.0, 0.0, 0.0]", "[0.0, 0.0, 2.0]");
    same("lamp that faces away", &low(with), &low(floor(&unlit, &point([0.5, 1.0, 1.5], 3.0))), 1.0, EFFORT);
}

/// A lamp seen edge-on from the floor's end: no direction to it is a division by nothing.
#[test]
fn lamp_seen_edge_on() {
    let edge = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [0, 1, 0], "degrees": 90 } }, { "translate": [0, 1.0, 0] }], "material": "lamp", "emission": { "radiance": 5, "two_sided": true } }"#;
    gradients_hold("lamp seen edge-on", &floor(edge, ""), Effort { samples: 256, depth: 3, ..EFFORT });
}

/// Radiance of 10⁻³⁰ and of 10¹⁵ is what radiance of 1 is, times that: nothing underflows on the way, nothing overflows.
#[test]
fn faint_and_fierce_sky() {
    let sky = |radiance: f64| floor("", &format!(r#", "environment": {{ "radiance": {radiance:e} }}"#));
    for radiance in [1e-30, 1e15] {
        same(&format!("sky of {radiance:e}"), &sky(radiance), &sky(1.0), radiance, EFFORT);
    }
}

/// Reflectance of 10⁻⁶ and of 1 − 10⁻⁶ under a sky of 1 show themselves.
#[test]
fn darkest_and_whitest() {
    for albedo in [1e-6, 0.999_999] {
        let text = floor("", r#", "environment": { "radiance": 1 }"#).replace("[0.8, 0.5, 0.3]", &albedo.to_string());
        shows(&format!("reflectance of {albedo}"), &text, albedo, 1e-4, EFFORT);
    }
}

/// A thousand lamps, of which all but one are dark as night, are that one.
#[test]
fn one_lamp_among_many_dark_ones() {
    let mut all: Vec<String> =
        (0..200).map(|k| lamp([f64::from(k % 20) * 0.4 - 4.0, 3.0, f64::from(k / 20) * 0.4 - 4.0], 0.01, 1e-12)).collect();
    all.push(lamp([0.5, 1.5, 0.5], 0.2, 20.0));
    let one = lamp([0.5, 1.5, 0.5], 0.2, 20.0);
    same("one lamp among many", &floor(&all.join(", "), ""), &floor(&one, ""), 1.0, EFFORT);
}

//! Hazards of media and holes: the all but empty, the all but solid.

use super::harness::{EFFORT, Effort, gradients_hold, looks, same, scene, shows};
use super::surfaces::corner;

/// A corner with a ball that is a boundary and nothing else, around this medium.
fn cloud(extinction: &str, albedo: &str) -> String {
    let ball = r#"{ "geometry": { "sphere": { "center": [0.2, 0.7, 0.5], "radius": 0.6 } }, "material": "air", "interior": "cloud" }"#;
    let text = corner(r#""air": "null""#, ball);
    let media = format!(r#", "media": {{ "cloud": {{ "homogeneous": {{ "extinction": {extinction}, "albedo": {albedo} }} }} }} }}"#);
    text.strip_suffix('}').map(|open| format!("{}{media}", open.trim_end())).unwrap_or(text)
}

/// A medium with a free path of 10¹² lengths is not there.
#[test]
fn thinnest_medium() {
    same("thinnest medium", &cloud("1e-12", "0.9"), &corner("", ""), 1.0, EFFORT);
}

/// A medium with a free path of a millionth of a length, which absorbs all, is a black ball.
#[test]
fn thickest_medium() {
    let ball = r#"{ "geometry": { "sphere": { "center": [0.2, 0.7, 0.5], "radius": 0.6 } }, "material": "black" }"#;
    same("thickest medium", &cloud("1e6", "0"), &corner("", ball), 1.0, EFFORT);
}

/// One colour passes, another is stopped at once: each is right by itself.
#[test]
fn medium_of_one_colour() {
    gradients_hold("medium of one colour", &cloud("[1e-3, 1, 30]", "[0.9, 0.5, 0.1]"), Effort { samples: 192, depth: 5, ..EFFORT });
}

/// A cloud that absorbs nothing under a white sky is white, thin or thick.
#[test]
fn white_cloud_under_a_white_sky() {
    for extinction in [0.01, 1.0, 5.0] {
        let text = scene(
            &looks([0.0, 0.0, -5.0], [0.0, 0.0, 0.0], 10.0),
            r#""air": "null""#,
            r#"{ "geometry": { "sphere": { "radius": 1 } }, "material": "air", "interior": "cloud" }"#,
            &format!(
                r#", "media": {{ "cloud": {{ "homogeneous": {{ "extinction": {extinction}, "albedo": 1 }} }} }}, "environment": {{ "radiance": 1 }}, "integrator": {{ "roulette_depth": 400 }}"#
            ),
        );
        shows(&format!("white cloud of extinction {extinction}"), &text, 1.0, 1e-4, Effort { depth: 300, samples: 32, ..EFFORT });
    }
}

/// A camera that stands in fog which it cannot see through sees the fog's own white.
#[test]
fn camera_inside_a_medium() {
    let text = scene(
        &looks([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], 40.0),
        r#""air": "null""#,
        r#"{ "geometry": { "sphere": { "radius": 1 } }, "material": "air", "interior": "cloud" }"#,
        r#", "media": { "cloud": { "homogeneous": { "extinction": 4, "albedo": 1 } } }, "medium": "cloud", "environment": { "radiance": 1 }, "integrator": { "roulette_depth": 400 }"#,
    );
    shows("camera inside a cloud", &text, 1.0, 1e-4, Effort { depth: 300, samples: 32, ..EFFORT });
}

/// A sheet of which a millionth is there is not there; one of which all but a millionth is, is.
#[test]
fn sheets_that_are_almost_holes_and_almost_whole() {
    let sheet = |opacity: f64| {
        let materials = format!(
            r#""red": {{ "diffuse": {{ "reflectance": [0.6, 0.1, 0.1] }} }}, "sheet": {{ "mask": {{ "material": "red", "opacity": {opacity:e} }} }}"#
        );
        let quad = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -60 } }, { "translate": [0.2, 0.7, 0.5] }], "material": "sheet" }"#;
        corner(&materials, quad)
    };
    same("almost a hole", &sheet(1e-6), &corner("", ""), 1.0, EFFORT);
    same("almost whole", &sheet(1.0 - 1e-6), &sheet(1.0), 1.0, EFFORT);
    gradients_hold("half a sheet", &sheet(0.5), Effort { samples: 192, ..EFFORT });
}

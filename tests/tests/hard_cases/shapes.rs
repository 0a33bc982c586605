//! Hazards of geometry: scales, places, slivers, gaps, and normals that disagree.

use super::harness::{EFFORT, Effort, gradients_hold, looks, same, scene, shows};
use super::surfaces::corner;

/// A corner under a panel, every length times a factor and everything moved.
fn placed(scale: f64, moved: [f64; 3]) -> String {
    let at = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] * scale + moved[k]);
    let to = |p: [f64; 3], edges: [f64; 2], turn: &str| {
        let [x, y, z] = at(p);
        let (a, b) = (edges[0] * scale, edges[1] * scale);
        format!(r#""to_world": [{{ "scale": [{a}, {b}, 1] }}, {turn} {{ "translate": [{x}, {y}, {z}] }}]"#)
    };
    let down = r#"{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } },"#;
    let up = r#"{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } },"#;
    let [x, y, z] = at([0.6, 0.5, 0.2]);
    let shapes = format!(
        r#"{{ "geometry": "rectangle", {}, "material": "white" }}, {{ "geometry": "rectangle", {}, "material": "white" }},
        {{ "geometry": "rectangle", {}, "material": "black", "emission": {{ "radiance": 4 }} }},
        {{ "geometry": {{ "sphere": {{ "center": [{x}, {y}, {z}], "radius": {} }} }}, "material": "glass" }}"#,
        to([0.0, 0.0, 0.0], [3.0, 3.0], up),
        to([0.0, 0.0, -1.5], [3.0, 3.0], ""),
        to([0.0, 3.0, 0.5], [1.0, 1.0], down),
        0.5 * scale
    );
    let materials = r#""white": { "diffuse": { "reflectance": [0.7, 0.6, 0.5] } }, "black": { "diffuse": { "reflectance": 0 } },
        "glass": { "dielectric": { "interior_ior": 1.5 } }"#;
    scene(&looks(at([0.0, 1.0, 4.0]), at([0.0, 0.6, 0.0]), 40.0), materials, &shapes, "")
}

const PLACED: Effort = Effort { samples: 128, ..EFFORT };

/// A scene a millionth of its size looks the same.
#[test]
fn scaled_by_a_millionth() {
    same("scaled by 1e-6", &placed(1e-6, [0.0; 3]), &placed(1.0, [0.0; 3]), 1.0, PLACED);
}

/// So does one a million times its size.
#[test]
fn scaled_by_a_million() {
    same("scaled by 1e6", &placed(1e6, [0.0; 3]), &placed(1.0, [0.0; 3]), 1.0, PLACED);
}

/// Far from the origin, where positions are rounded to a ten-thousandth of the scene's size, the light is the same.
#[test]
fn moved_by_a_million() {
    same("moved by 1e6", &placed(1e3, [1e6, -1e6, 1e6]), &placed(1.0, [0.0; 3]), 1.0, PLACED);
}

/// Two surfaces in the same place are one.
#[test]
fn coincident_surfaces() {
    let again = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [3, 1, 3] }], "material": "white" }"#;
    same("coincident surfaces", &corner("", &[again, again].join(", ")), &corner("", ""), 1.0, EFFORT);
}

/// So are two that are a gap apart which no ray can tell.
#[test]
fn thin_gap() {
    let above = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [3, 1, 3] }, { "translate": [0, 1e-6, 0] }], "material": "white" }"#;
    same("thin gap", &corner("", above), &corner("", ""), 1.0, EFFORT);
}

/// A floor that is cut into slivers, among them triangles without area and points used twice, is a floor.
#[test]
fn slivers_and_triangles_without_area() {
    let mut positions = vec![[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0]];
    let mut indices = Vec::new();
    // A fan of slivers from both ends of one edge, ever thinner.
    let mut z: f64 = 3.0;
    for k in 0..24 {
        z = -3.0 + (z + 3.0) * 0.6;
        let z = if k == 23 { -3.0 } else { z };
        positions.push([-3.0, 0.0, z]);
        positions.push([3.0, 0.0, z]);
        let n = positions.len();
        indices.extend([[n - 4, n - 3, n - 1], [n - 4, n - 1, n - 2], [n - 4, n - 4, n - 1], [n - 2, n - 2, n - 2]]);
    }
    // Points on one line span no area.
    positions.push([0.0, 0.0, 3.0]);
    indices.push([0, positions.len() - 1, 1]);
    let mesh = format!(r#"{{ "geometry": {{ "mesh": {{ "positions": {positions:?}, "indices": {indices:?} }} }}, "material": "white" }}"#);
    let whole = corner("", "");
    let floor = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [3, 1, 3] }], "material": "white" },"#;
    assert!(whole.contains(floor));
    same("slivers", &whole.replace(floor, &format!("{mesh},")), &whole, 1.0, EFFORT);
}

/// Vertex normals that point anywhere never make light: under a white sky a white mesh shows no more than white, and gradients stay
/// differences of pixels.
#[test]
fn normals_that_disagree() {
    let mesh = r#"{ "geometry": { "mesh": { "positions": [[-1, -1, 0], [1, -1, 0], [1, 1, 0.2], [-1, 1, -0.2]], "indices": [[0, 1, 2], [0, 2, 3]],
        "normals": [[0.7, 0, 0.7], [-0.9, 0.1, 0.2], [0, 0.99, 0.1], [0, -0.6, 0.8]] } }, "material": "wall" }"#;
    let text = scene(
        &looks([0.0, 0.0, 4.0], [0.0, 0.0, 0.0], 25.0),
        r#""wall": { "diffuse": { "reflectance": 1 } }"#,
        mesh,
        r#", "environment": { "radiance": 1 }"#,
    );
    gradients_hold("normals that disagree", &text, Effort { samples: 192, ..EFFORT });
    for film in super::harness::films("normals that disagree", &text, gradfarm_core::plan::Technique::Pt, EFFORT, 0) {
        let mean = super::harness::seen(&film).iter().sum::<f64>() / (3 * EFFORT.extent.pixels()) as f64;
        assert!((0.3..1.02).contains(&mean), "a white wall shows {mean}");
    }
}

/// At silhouettes a neighbour may be a thousand times as far away: gradients stay differences of pixels.
#[test]
fn silhouettes_before_a_far_wall() {
    let near = r#"{ "geometry": { "sphere": { "center": [0.1, 0.95, 3.5], "radius": 0.08 } }, "material": "gloss" },
        { "geometry": "rectangle", "to_world": [{ "scale": [3e3, 3e3, 1] }, { "translate": [0, 0, -2e3] }], "material": "white" }"#;
    let text = corner(r#""gloss": { "conductor": { "metal": "Au", "roughness": 0.2 } }"#, near);
    gradients_hold("silhouettes", &text, Effort { samples: 256, ..EFFORT });
}

/// A thin panel seen edge-on: pixels on either side of its plane join at its two sides.
#[test]
fn pixels_on_both_sides_of_a_thin_panel() {
    let panel = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [1, 1, 0.8] }, { "translate": [0, 0.72, -0.5] }], "material": "white" }"#;
    gradients_hold("thin panel", &corner("", panel), Effort { samples: 512, depth: 3, ..EFFORT });
}

/// A view of almost half the world, and one of a millionth of a degree, both see the sky that is everywhere.
#[test]
fn extreme_fields_of_view() {
    let ball = r#"{ "geometry": { "sphere": { "radius": 50 } }, "material": "ball", "flip_normals": true }"#;
    for fov in [179.0, 1e-6] {
        let text = scene(&looks([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], fov), r#""ball": "null""#, ball, r#", "environment": { "radiance": 1 }"#);
        shows(&format!("field of view of {fov}°"), &text, 1.0, 1e-5, EFFORT);
    }
}

/// A camera that stands in a surface sees what is on the side that it looks to.
#[test]
fn camera_on_a_surface() {
    let plane = r#"{ "geometry": "rectangle", "to_world": [{ "scale": [5, 5, 1] }], "material": "plane" },
        { "geometry": "rectangle", "to_world": [{ "scale": [50, 50, 1] }, { "translate": [0, 0, -9] }], "material": "plane" }"#;
    let text = scene(
        &looks([0.0, 0.0, 0.0], [0.0, 0.0, -1.0], 30.0),
        r#""plane": { "diffuse": { "reflectance": 0.5 } }"#,
        plane,
        r#", "environment": { "radiance": 1 }"#,
    );
    // The plane that the camera stands in is no wall before it; the one behind sees half a sky less what that plane covers.
    for film in super::harness::films("camera on a surface", &text, gradfarm_core::plan::Technique::Gpt, EFFORT, 0) {
        let values = super::harness::seen(&film);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        assert!((0.3..0.5).contains(&mean), "found {mean}");
    }
}

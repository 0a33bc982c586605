//! Hazards of materials: limits of roughness, index and albedo.

use super::harness::{EFFORT, Effort, gradients_hold, looks, same, scene, shows};

/// A ball of this material under a constant sky of radiance 1.
fn ball(material: &str) -> String {
    let shapes = r#"{ "geometry": { "sphere": { "radius": 1 } }, "material": "ball" }"#;
    scene(
        &looks([0.0, 0.0, -5.0], [0.0, 0.0, 0.0], 14.0),
        &format!(r#""ball": {material}"#),
        shapes,
        r#", "environment": { "radiance": 1 }"#,
    )
}

/// A lit corner with these shapes in it.
pub(crate) fn corner(materials: &str, shapes: &str) -> String {
    let more = if materials.is_empty() { String::new() } else { format!(", {materials}") };
    let then = if shapes.is_empty() { String::new() } else { format!(", {shapes}") };
    scene(
        &looks([0.0, 1.0, 4.0], [0.0, 0.6, 0.0], 40.0),
        &format!(
            r#""white": {{ "diffuse": {{ "reflectance": [0.7, 0.6, 0.5] }} }}, "black": {{ "diffuse": {{ "reflectance": 0 }} }}{more}"#
        ),
        &format!(
            r#"{{ "geometry": "rectangle", "to_world": [{{ "rotate": {{ "axis": [1, 0, 0], "degrees": -90 }} }}, {{ "scale": [3, 1, 3] }}], "material": "white" }},
            {{ "geometry": "rectangle", "to_world": [{{ "scale": [3, 3, 1] }}, {{ "translate": [0, 0, -1.5] }}], "material": "white" }},
            {{ "geometry": "rectangle", "to_world": [{{ "rotate": {{ "axis": [1, 0, 0], "degrees": 90 }} }}, {{ "translate": [0, 3, 0.5] }}], "material": "black",
               "emission": {{ "radiance": 4 }} }}{then}"#
        ),
        "",
    )
}

/// A white metal under a white sky is white, from the smoothest to the roughest: nothing is lost or gained at any roughness.
#[test]
fn roughness_from_a_millionth_to_one() {
    for (roughness, error) in [(0.0, 1e-5), (1e-6, 1e-4), (1e-4, 1e-4), (1e-3, 1e-3), (0.01, 2e-3), (0.1, 5e-3), (0.4, 1e-2), (1.0, 2e-2)] {
        let material = format!(r#"{{ "conductor": {{ "eta": 0, "k": 1, "roughness": {roughness}, "energy_conserving": true }} }}"#);
        shows(&format!("white metal of roughness {roughness}"), &ball(&material), 1.0, error, EFFORT);
    }
}

/// Clear glass loses nothing: with paths long enough the sky is seen through it as it is, however near its index is to that of air.
#[test]
fn index_near_one() {
    for ior in [1.0, 1.0 + 1e-6, 1.0001, 1.01] {
        let material = format!(r#"{{ "dielectric": {{ "interior_ior": {ior} }} }}"#);
        shows(&format!("glass of index {ior}"), &ball(&material), 1.0, 1e-4, EFFORT);
    }
}

/// The same for rough glass, which has no half vector where nothing is bent.
#[test]
fn rough_glass_of_index_near_one() {
    for ior in [1.00001, 1.001] {
        let material = format!(r#"{{ "dielectric": {{ "interior_ior": {ior}, "roughness": 0.3, "energy_conserving": true }} }}"#);
        shows(&format!("rough glass of index {ior}"), &ball(&material), 1.0, 5e-3, EFFORT);
    }
}

/// Glass whose index is that of what surrounds it is not there.
#[test]
fn index_matched_glass_is_not_there() {
    let glass = r#""glass": { "dielectric": { "interior_ior": 1.33, "exterior_ior": 1.33 } }"#;
    let shape = r#"{ "geometry": { "sphere": { "center": [0.2, 0.7, 0.5], "radius": 0.6 } }, "material": "glass" }"#;
    // Straight lines through glass are no chance of next-event estimation: light from the lamp is found by walking.
    same("index-matched glass", &corner(glass, shape), &corner("", ""), 1.0, Effort { samples: 256, depth: 8, ..EFFORT });
}

/// Water in glass in water under a white sky: three boundaries, nothing lost.
#[test]
fn nested_dielectrics_lose_nothing() {
    let balls: Vec<String> = [(1.0, "outer"), (0.8, "shell"), (0.5, "core")]
        .iter()
        .map(|(radius, material)| format!(r#"{{ "geometry": {{ "sphere": {{ "radius": {radius} }} }}, "material": "{material}" }}"#))
        .collect();
    let materials = r#""outer": { "dielectric": { "interior_ior": 1.33 } },
        "shell": { "dielectric": { "interior_ior": 1.5, "exterior_ior": 1.33 } },
        "core": { "dielectric": { "interior_ior": 1.33, "exterior_ior": 1.5 } }"#;
    let text =
        scene(&looks([0.0, 0.0, -5.0], [0.0, 0.0, 0.0], 14.0), materials, &balls.join(", "), r#", "environment": { "radiance": 1 }"#);
    shows("nested dielectrics", &text, 1.0, 1e-3, Effort { depth: 64, ..EFFORT });
}

/// From inside glass the sky is brighter by the square of the index, however often light is totally reflected before.
#[test]
fn camera_inside_glass() {
    let shapes = r#"{ "geometry": { "sphere": { "radius": 1 } }, "material": "glass" }"#;
    let materials = r#""glass": { "dielectric": { "interior_ior": 1.5 } }"#;
    for (name, origin) in [("in the middle", [0.0, 0.0, 0.0]), ("near the surface", [0.0, 0.0, -0.9])] {
        let text = scene(&looks(origin, [0.0, 0.1, 1.0], 30.0), materials, shapes, r#", "environment": { "radiance": 1 }"#);
        shows(&format!("camera inside glass, {name}"), &text, 2.25, 1e-4, Effort { depth: 64, ..EFFORT });
    }
}

/// At the critical angle a neighbour's refraction turns into total reflection: gradients stay differences of pixels.
#[test]
fn total_reflection_that_flips_under_the_shift() {
    let materials = r#""white": { "diffuse": { "reflectance": 0.6 } }, "water": { "dielectric": { "interior_ior": 1.33 } }"#;
    let under = |roughness: &str| {
        let water = format!(
            r#""white": {{ "diffuse": {{ "reflectance": 0.6 }} }}, "water": {{ "dielectric": {{ "interior_ior": 1.33{roughness} }} }}"#
        );
        let shapes = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [30, 1, 30] }, { "translate": [0, 1, 0] }], "material": "water" },
            { "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [30, 1, 30] }], "material": "white" }"#;
        // The critical angle of water is 48.75° from the normal.
        scene(&looks([0.0, 0.2, 0.0], [0.0, 1.0, 0.912], 25.0), &water, shapes, r#", "environment": { "radiance": 1 }"#)
    };
    assert!(materials.contains("water"));
    for roughness in ["", r#", "roughness": 0.05"#] {
        gradients_hold(&format!("critical angle {roughness}"), &under(roughness), Effort { samples: 256, depth: 8, ..EFFORT });
    }
}

/// A surface that is half mirror, half matte shifts as each of its lobes does.
#[test]
fn mirror_beside_matte_in_one_surface() {
    let materials = r#""mirror": { "conductor": { "eta": 0, "k": 1 } }, "chalk": { "diffuse": { "reflectance": 1 } },
        "ball": { "blend": { "first": "mirror", "second": "chalk", "weight": 0.5 } }"#;
    let shapes = r#"{ "geometry": { "sphere": { "radius": 1 } }, "material": "ball" }"#;
    let text = scene(&looks([0.0, 0.0, -5.0], [0.0, 0.0, 0.0], 14.0), materials, shapes, r#", "environment": { "radiance": 1 }"#);
    shows("half mirror, half chalk", &text, 1.0, 1e-4, EFFORT);
    let inside = corner(materials, r#"{ "geometry": { "sphere": { "center": [0.2, 0.7, 0.5], "radius": 0.6 } }, "material": "ball" }"#);
    gradients_hold("half mirror, half chalk", &inside, Effort { samples: 192, ..EFFORT });
}

/// A plane seen at 89.999° from its normal has the radiance that it has from above.
#[test]
fn grazing_view() {
    let shapes = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [1e6, 1, 1e6] }], "material": "plane" }"#;
    let height = 10.0 * (0.001f64).to_radians();
    for material in
        [r#""plane": { "diffuse": { "reflectance": 0.5 } }"#, r#""plane": { "rough_diffuse": { "reflectance": 1, "roughness": 0 } }"#]
    {
        let white = if material.contains("rough") { 1.0 } else { 0.5 };
        let text = scene(&looks([0.0, height, 10.0], [0.0, 0.0, 0.0], 0.0005), material, shapes, r#", "environment": { "radiance": 1 }"#);
        shows("grazing view", &text, white, 1e-4, EFFORT);
    }
}

/// Metal and glass seen at 89.999°: all is reflected, nothing more.
#[test]
fn grazing_mirror() {
    let shapes = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [1e6, 1, 1e6] }], "material": "plane" }"#;
    let height = 10.0 * (0.001f64).to_radians();
    for material in [r#""plane": { "dielectric": { "interior_ior": 1.5 } }"#, r#""plane": { "conductor": { "metal": "Cu" } }"#] {
        let text = scene(&looks([0.0, height, 10.0], [0.0, 0.0, 0.0], 0.0005), material, shapes, r#", "environment": { "radiance": 1 }"#);
        shows("grazing mirror", &text, 1.0, 1e-3, EFFORT);
    }
}

/// Between two perfect mirrors paths run on for a hundred vertices; each of them sees the sky in the end.
#[test]
fn hundred_mirrors() {
    let shapes = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [0, 1, 0], "degrees": 90 } }, { "scale": [1, 2, 60] }, { "translate": [-0.5, 0, 0] }], "material": "mirror" },
        { "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [0, 1, 0], "degrees": -90 } }, { "scale": [1, 2, 60] }, { "translate": [0.5, 0, 0] }], "material": "mirror" }"#;
    let text = scene(
        &looks([0.0, 0.0, 0.0], [2.0, 0.0, 1.3], 2.0),
        r#""mirror": { "conductor": { "eta": 0, "k": 1 } }"#,
        shapes,
        r#", "environment": { "radiance": 1 }, "integrator": { "roulette_depth": 200 }"#,
    );
    shows("a hundred mirrors", &text, 1.0, 1e-5, Effort { depth: 160, samples: 8, ..EFFORT });
}

/// A closed white room whose walls glow: a thousand edges carry a thousand times the glow, none lost to rounding or roulette.
#[test]
fn white_room_of_a_thousand_edges() {
    let shapes = r#"{ "geometry": "cube", "flip_normals": true, "material": "wall", "emission": { "radiance": 1 } }"#;
    let text = scene(
        &looks([0.3, 0.2, -0.5], [0.0, -0.1, 1.0], 50.0),
        r#""wall": { "diffuse": { "reflectance": 1 } }"#,
        shapes,
        r#", "integrator": { "roulette_depth": 2000 }"#,
    );
    let effort = Effort { depth: 1000, samples: 4, seeds: 6, ..EFFORT };
    shows("white room", &text, 1000.0, 1e-4, effort);
}

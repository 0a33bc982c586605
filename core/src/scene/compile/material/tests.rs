//! What written materials become.

use super::super::super::assets::NoAssets;
use super::*;
use crate::material::Conductor;
use crate::scene::Scene;
use crate::spectrum::Spectrum;

/// Compiles a scene of these materials and gives the one called `it`.
fn compile(materials: &str) -> Result<Material, Error> {
    let text = format!(
        r#"{{ "version": 1, "camera": {{ "perspective": {{ "fov": 40 }} }},
            "textures": {{ "board": {{ "checkerboard": {{ "color0": 0.2, "color1": 0.6 }} }} }},
            "materials": {{ {materials} }}, "shapes": [] }}"#
    );
    let description = SceneDescription::from_json(&text, "test.json")?;
    let place = description.materials.keys().position(|name| name == "it").unwrap();
    Ok(Scene::compile(&description, &NoAssets)?.materials[place].clone())
}

#[test]
fn every_kind_compiles() {
    let kinds = [
        r#""diffuse": { "reflectance": 0.5 }"#,
        r#""rough_diffuse": { "reflectance": 0.5, "roughness": 0.4 }"#,
        r#""conductor": { "metal": "Au", "roughness": 0.1, "roughness_v": 0.3, "distribution": "beckmann", "energy_conserving": true }"#,
        r#""dielectric": { "roughness": 0.2, "energy_conserving": true }"#,
        r#""dielectric": { "thin": true }"#,
        r#""plastic": {}"#,
        r#""plastic": { "roughness": 0.2, "nonlinear": true, "distribution": "beckmann" }"#,
        r#""principled": { "metallic": 0.5, "clearcoat": 1 }"#,
        r#""phong": {}"#,
        r#""ward": {}"#,
    ];
    for kind in kinds {
        let plain = compile(&format!(r#""it": {{ {kind} }}"#)).unwrap();
        assert!(matches!(plain, Material::Plain(_)), "{kind}: {plain:?}");
    }
    let textured = [
        r#""diffuse": { "reflectance": { "texture": "board" } }"#,
        r#""rough_diffuse": { "reflectance": { "texture": "board" }, "roughness": { "texture": "board" } }"#,
        r#""conductor": { "metal": "Au", "roughness": { "texture": "board" }, "energy_conserving": true }"#,
        r#""dielectric": { "roughness": { "texture": "board" }, "energy_conserving": true }"#,
        r#""dielectric": { "thin": true, "transmittance": { "texture": "board" } }"#,
        r#""plastic": { "roughness": { "texture": "board" } }"#,
        r#""principled": { "base_color": { "texture": "board" }, "roughness": { "texture": "board" } }"#,
        r#""phong": { "exponent": { "texture": "board" } }"#,
        r#""ward": { "roughness_v": { "texture": "board" } }"#,
    ];
    for kind in textured {
        let textured = compile(&format!(r#""it": {{ {kind} }}"#)).unwrap();
        assert!(textured.is_textured(), "{kind}: {textured:?}");
        let at = TexturePoint::default();
        assert!(textured.roughness(&at) > 0.0 || textured.delta_probability(&at, crate::math::Vec3::Z) == 1.0);
    }
}

#[test]
fn a_metal_keeps_its_numbers() {
    let Material::Plain(Bsdf::Conductor(Conductor { eta, facets, bounced, two_sided, .. })) =
        compile(r#""it": { "conductor": { "eta": [0.1, 0.2, 0.3], "k": 3, "roughness": 0.25, "two_sided": false } }"#).unwrap()
    else {
        panic!("no plain conductor")
    };
    assert_eq!(eta, Spectrum::rgb(0.1, 0.2, 0.3));
    assert_eq!(facets.unwrap().alpha(), 0.25);
    assert!(bounced.is_none() && !two_sided);
}

const PARTS: &str =
    r#""matt": { "diffuse": { "reflectance": 0.5 } }, "glass": { "dielectric": {} }, "water": { "dielectric": { "interior_ior": 1.33 } }"#;

#[test]
fn composites_are_made_of_what_they_name() {
    let board = r#"{ "texture": "board" }"#;
    for (it, textured, bends) in [
        (r#""blend": { "first": "matt", "second": "glass", "weight": 0.25 }"#.to_string(), false, false),
        (format!(r#""blend": {{ "first": "matt", "second": "glass", "weight": {board} }}"#), true, false),
        (r#""two_sided": { "front": "matt", "back": "matt" }"#.to_string(), false, false),
        (format!(r#""bump_map": {{ "material": "matt", "height": {board} }}"#), true, true),
        (format!(r#""normal_map": {{ "material": "glass", "normals": {board} }}"#), true, true),
    ] {
        let material = compile(&format!(r#"{PARTS}, "it": {{ {it} }}"#)).unwrap();
        assert!(matches!(material, Material::Composite(_)), "{it}");
        assert_eq!((material.is_textured(), material.bends()), (textured, bends), "{it}");
    }
    let masked = compile(&format!(r#"{PARTS}, "it": {{ "mask": {{ "material": "matt", "opacity": 0.5 }} }}"#)).unwrap();
    assert_eq!(masked, compile(r#""it": { "diffuse": { "reflectance": 0.5 } }"#).unwrap());
    assert_eq!(compile(r#""it": "null""#).unwrap(), Bsdf::Null.into());
}

#[test]
fn what_cannot_be_rendered_is_named() {
    let refused = |it: &str, words: &[&str]| {
        let message = compile(&format!(r#"{PARTS}, {it}"#)).unwrap_err().to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    refused(r#""it": { "two_sided": { "front": "matt", "back": "glass" } }"#, &["materials.it", "two-sided", "transmits"]);
    refused(r#""it": { "blend": { "first": "water", "second": "glass", "weight": 0.5 } }"#, &["materials.it", "1.33", "1.5"]);
    // Five storeys of pairs: 32 parts.
    let tower = (1..=5).map(|k| {
        let (name, below) =
            (if k == 5 { "it".into() } else { format!("m{k}") }, if k == 1 { "matt".into() } else { format!("m{}", k - 1) });
        format!(r#""{name}": {{ "blend": {{ "first": "{below}", "second": "{below}", "weight": 0.5 }} }}"#)
    });
    refused(&tower.collect::<Vec<_>>().join(", "), &["materials.it", "32 parts", "16"]);
}

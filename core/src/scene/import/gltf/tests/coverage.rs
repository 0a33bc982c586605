//! What becomes of each of glTF's elements, tried out; the table in `docs/formats.md` is this one.

use super::super::super::coverage::Fate::{Approximated, Honoured, LeftOut, Refused};
use super::super::super::coverage::{Fate, Row, check_document, fault};
use super::*;

/// (kind, element, what is put where in the square scene, fate, remark)
type Tried = (&'static str, &'static str, Vec<(&'static str, Value)>, Fate, &'static str);

#[rustfmt::skip]
fn table() -> Vec<Tried> {
    let material = |name: &str, value: Value| vec![("/materials/0/extensions", json!({name: value}))];
    let image = json!([{"uri": "a.png"}]);
    let textured = |more: Vec<(&'static str, Value)>| {
        [vec![("/images", image.clone()), ("/textures", json!([{"source": 0}]))], more].concat()
    };
    let skin = vec![
        ("/nodes/1/skin", json!(0)),
        ("/skins", json!([{"joints": [0]}])),
        ("/meshes/0/primitives/0/attributes/JOINTS_0", json!(4)),
        ("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(4)),
    ];
    // One key at 0 s: the first bytes of the buffer that are zero, and a colour as a quaternion.
    let animated = |path: &str| vec![
        ("/bufferViews/-", json!({"buffer": 0, "byteOffset": 48, "byteLength": 4})),
        ("/accessors/-", json!({"bufferView": 5, "componentType": 5126, "count": 1, "type": "SCALAR"})),
        ("/accessors/-", json!({"bufferView": 4, "componentType": 5121, "count": 1, "type": "VEC4", "normalized": true})),
        ("/animations", json!([{"channels": [{"sampler": 0, "target": {"node": 0, "path": path}}], "samplers": [{"input": 5, "output": 6}]}])),
    ];
    let base = ("/materials/0/pbrMetallicRoughness/baseColorTexture", json!({"index": 0}));
    let light = |light: Value| vec![
        ("/extensions", json!({"KHR_lights_punctual": {"lights": [light]}})),
        ("/nodes/-", json!({"extensions": {"KHR_lights_punctual": {"light": 0}}})),
        ("/scenes/0/nodes", json!([0, 1, 2])),
    ];
    vec![
        ("file", "GLB, data: addresses, files in the folder", vec![], Honoured, "buffers and images"),
        ("file", "files outside the folder", vec![("/buffers/0/uri", json!("../a.bin"))], Refused, ""),
        ("file", "extensionsRequired, unknown", vec![("/extensionsRequired", json!(["EXT_meshopt_compression"]))], Refused, "names it"),
        ("file", "extensionsUsed, unknown", vec![("/extensionsUsed", json!(["KHR_xmp"]))], LeftOut, ""),
        ("animation", "translation, rotation, scale, weights", animated("rotation"), Honoured, "all animations of the file together; of two channels that move the same, the first"),
        ("animation", "STEP, LINEAR, CUBICSPLINE", animated("rotation"), Honoured, ""),
        ("animation", "KHR_animation_pointer and other channels", animated("pointer"), LeftOut, ""),
        ("node", "matrix, translation, rotation, scale, children", vec![("/nodes/1/scale", json!([2, 2, -2])), ("/nodes/1/rotation", json!([0, 1, 0, 0]))], Honoured, ""),
        ("node", "skin", skin.clone(), Approximated, "as its joints stand"),
        ("node", "skin, joints that move", [skin.clone(), animated("rotation")].concat(), Honoured, "eight joints a vertex"),
        ("node", "EXT_mesh_gpu_instancing", vec![("/nodes/1/extensions", json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}))], Honoured, "as instances"),
        ("mesh", "triangles, strips, fans", vec![("/meshes/0/primitives/0/mode", json!(5))], Honoured, "used twice: as instances"),
        ("mesh", "points, lines", vec![("/meshes/0/primitives/0/mode", json!(1))], LeftOut, ""),
        ("mesh", "POSITION, NORMAL, TEXCOORD_n, COLOR_0", vec![("/meshes/0/primitives/0/attributes/COLOR_0", json!(4))], Honoured, "one set of texture coordinates a material"),
        ("mesh", "sparse accessors, KHR_mesh_quantization", vec![("/accessors/0/sparse", json!({"count": 1, "indices": {"bufferView": 3, "componentType": 5123}, "values": {"bufferView": 1}}))], Honoured, ""),
        ("mesh", "morph targets", vec![("/meshes/0/primitives/0/targets", json!([{"POSITION": 0}])), ("/meshes/0/weights", json!([0.5]))], Honoured, "of positions and normals"),
        ("mesh", "KHR_draco_mesh_compression", vec![("/meshes/0/primitives/0/extensions", json!({"KHR_draco_mesh_compression": {}}))], LeftOut, "refused where it is required"),
        ("material", "pbrMetallicRoughness", textured(vec![base.clone(), ("/materials/0/pbrMetallicRoughness/metallicRoughnessTexture", json!({"index": 0}))]), Honoured, ""),
        ("material", "normalTexture", textured(vec![("/materials/0/normalTexture", json!({"index": 0, "scale": 2}))]), Honoured, ""),
        ("material", "occlusionTexture", vec![("/materials/0/occlusionTexture", json!({"index": 0}))], LeftOut, "shadows are computed"),
        ("material", "emissive factor and texture, KHR_materials_emissive_strength", material("KHR_materials_emissive_strength", json!({"emissiveStrength": 5})), Honoured, "in W·sr⁻¹·m⁻²"),
        ("material", "alphaMode BLEND", vec![("/materials/0/emissiveFactor", json!([0, 0, 0])), ("/materials/0/alphaMode", json!("BLEND")), ("/materials/0/pbrMetallicRoughness/baseColorFactor", json!([1, 1, 1, 0.5]))], Honoured, "as a mask; not on what gives off light"),
        ("material", "alphaMode MASK with a texture", textured(vec![("/materials/0/emissiveFactor", json!([0, 0, 0])), ("/materials/0/alphaMode", json!("MASK")), base.clone()]), Approximated, "soft edges"),
        ("material", "doubleSided", vec![("/materials/0/doubleSided", json!(true))], Honoured, "otherwise black from behind"),
        ("material", "KHR_materials_ior", material("KHR_materials_ior", json!({"ior": 1.3})), Honoured, ""),
        ("material", "KHR_materials_specular", material("KHR_materials_specular", json!({"specularFactor": 0.5, "specularColorFactor": [2, 1, 1]})), Honoured, ""),
        ("material", "KHR_materials_transmission", material("KHR_materials_transmission", json!({"transmissionFactor": 0.5})), Honoured, ""),
        ("material", "KHR_materials_volume", vec![("/materials/0/extensions", json!({"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [0.5, 0.6, 0.7]}}))], Approximated, "bends light; absorbs at the surface"),
        ("material", "KHR_materials_clearcoat", material("KHR_materials_clearcoat", json!({"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.1})), Honoured, "without normals of its own"),
        ("material", "KHR_materials_sheen", material("KHR_materials_sheen", json!({"sheenColorFactor": [0.5, 0.5, 0.5], "sheenRoughnessFactor": 0.4})), Honoured, ""),
        ("material", "KHR_materials_anisotropy", material("KHR_materials_anisotropy", json!({"anisotropyStrength": 0.5})), Honoured, "along u"),
        ("material", "KHR_materials_anisotropy, turned", material("KHR_materials_anisotropy", json!({"anisotropyStrength": 0.5, "anisotropyRotation": 1})), LeftOut, "the turn"),
        ("material", "KHR_materials_dispersion", material("KHR_materials_dispersion", json!({"dispersion": 1})), LeftOut, ""),
        ("material", "KHR_materials_unlit", material("KHR_materials_unlit", json!({})), Approximated, "gives off its base colour"),
        ("material", "KHR_materials_pbrSpecularGlossiness", material("KHR_materials_pbrSpecularGlossiness", json!({"diffuseFactor": [1, 0, 0, 1], "glossinessFactor": 0.5})), Honoured, "glossiness without its texture"),
        ("material", "KHR_materials_iridescence and others", material("KHR_materials_iridescence", json!({})), LeftOut, ""),
        ("texture", "PNG, JPEG", textured(vec![base.clone()]), Honoured, "sRGB or linear by their slot"),
        ("texture", "KHR_texture_basisu, EXT_texture_webp", vec![("/textures", json!([{"extensions": {"KHR_texture_basisu": {"source": 0}}}])), base.clone()], LeftOut, ""),
        ("texture", "samplers", textured(vec![base.clone(), ("/textures/0/sampler", json!(0)), ("/samplers", json!([{"magFilter": 9728, "wrapS": 33071, "wrapT": 33071}]))]), Honoured, "the same wrapping both ways"),
        ("texture", "KHR_texture_transform", textured(vec![("/materials/0/pbrMetallicRoughness/baseColorTexture", json!({"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}))]), Honoured, ""),
        ("texture", "two sets of coordinates in one material", textured(vec![base, ("/materials/0/normalTexture", json!({"index": 0, "texCoord": 1}))]), Approximated, "that of the base colour"),
        ("light", "KHR_lights_punctual: point, spot, directional", light(json!({"type": "point", "intensity": 3})), Honoured, "candela as W·sr⁻¹, lux as W·m⁻²"),
        ("light", "KHR_lights_punctual: range", light(json!({"type": "point", "range": 3})), LeftOut, ""),
        ("light", "none at all", vec![("/materials/0/emissiveFactor", json!([0, 0, 0]))], Approximated, "lit from everywhere with radiance 1"),
        ("camera", "perspective, orthographic", vec![], Honoured, "the first one; the size of the film is reported"),
        ("camera", "none at all", vec![("/nodes/0/camera", Value::Null)], Approximated, "one that sees all of the scene"),
    ]
}

#[test]
fn every_element_meets_the_fate_that_the_table_tells() {
    let dark = ("/materials/0/emissiveFactor", json!([0, 0, 0]));
    let usual = [read(&square()), read(&with(std::slice::from_ref(&dark)))].map(|imported| imported.unwrap().report);
    let faults = table().into_iter().filter_map(|(kind, name, changes, fate, remark)| {
        let imported = import(with(&changes).to_string().as_bytes(), "t.gltf", &NoAssets);
        let is_dark = kind != "light" && changes.contains(&dark);
        fault(&Row { kind, name, fate, remark }, imported, &usual[usize::from(is_dark)])
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_document_has_this_table() {
    let rows: Vec<Row> = table().into_iter().map(|(kind, name, _, fate, remark)| Row { kind, name, fate, remark }).collect();
    check_document("gltf", &rows);
}

//! glTF scenes: small ones written here, and the sample models where they are at hand.

use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};
use serde_json::{Value, json};

use super::*;
use crate::scene::assets::{NoAssets, SceneAssets};
use crate::scene::description::{Camera, Geometry, Input, Light, Material, Shape, Texture};
use crate::scene::{Stage, load};

mod animation;
mod coverage;

/// A data: address.
fn data(bytes: &[u8]) -> String {
    let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let word = three.iter().fold(0u32, |word, byte| word << 8 | u32::from(*byte)) << (8 * (3 - three.len()));
        let letter = |k: usize| if k <= three.len() { char::from(letters[(word >> (18 - 6 * k) & 63) as usize]) } else { '=' };
        text.extend((0..4).map(letter));
    }
    format!("data:application/octet-stream;base64,{text}")
}

/// A scene of one square of 2 × 2 metres at z = −5 with everything that a square can have, seen by a camera at the origin.
fn square() -> Value {
    let mut bytes: Vec<u8> = Vec::new();
    let positions = [[-1.0f32, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    bytes.extend(positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([[0.0f32, 0.0, 1.0]; 4].as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([[0.0f32, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([[255u8, 0, 51, 255]; 4].as_flattened());
    let address = data(&bytes);
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"camera": 0}, {"name": "Square", "mesh": 0, "translation": [0, 0, -5]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "aspectRatio": 1.5, "znear": 0.1}}],
        "meshes": [{"name": "Sheet", "primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0}]}],
        "materials": [{"name": "Paint", "emissiveFactor": [1, 0.5, 0], "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 1]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 4, "componentType": 5121, "count": 4, "type": "VEC4", "normalized": true}
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 48},
            {"buffer": 0, "byteOffset": 96, "byteLength": 32},
            {"buffer": 0, "byteOffset": 128, "byteLength": 12},
            {"buffer": 0, "byteOffset": 140, "byteLength": 16}
        ],
        "buffers": [{"byteLength": 156, "uri": address}]
    })
}

fn read(scene: &Value) -> Result<Imported, Error> {
    import(scene.to_string().as_bytes(), "t.gltf", &NoAssets)
}

/// The square with something put in at a JSON pointer.
fn with(changes: &[(&str, Value)]) -> Value {
    let mut scene = square();
    for (pointer, value) in changes {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = scene.pointer_mut(parent).unwrap_or_else(|| panic!("no {parent}"));
        match parent {
            Value::Array(list) if key == "-" => list.push(value.clone()),
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value.clone(),
            parent => parent[key] = value.clone(),
        }
    }
    scene
}

fn mesh(imported: &Imported, shape: &Shape) -> crate::geometry::Mesh {
    let Geometry::Ply(file) = &shape.geometry else { panic!("{shape:?}") };
    let assets = SceneAssets::new(crate::scene::DirectoryAssets::new("/nonexistent"), imported.made.clone());
    crate::scene::mesh::read(&assets, &file.file, crate::scene::mesh::MeshFormat::Ply, file.normals).unwrap()
}

#[test]
fn a_square_before_a_camera_comes_out_as_written() {
    let imported = read(&square()).unwrap();
    let scene = &imported.description;
    let Camera::Perspective(camera) = &scene.camera else { panic!("{:?}", scene.camera) };
    let sight = camera.to_world.matrix().transform_vector3(DVec3::Z);
    let left = camera.to_world.matrix().transform_vector3(DVec3::X);
    assert!((sight - DVec3::NEG_Z).length() < 1e-12 && (left - DVec3::NEG_X).length() < 1e-12, "{sight} {left}");
    assert_eq!((camera.fov, scene.film.width, scene.film.height), (0.5f64.to_degrees(), 960, 640));
    let [shape] = &scene.shapes[..] else { panic!("{:?}", scene.shapes) };
    assert_eq!((shape.name.as_str(), shape.to_world.matrix().w_axis.z), ("Square", -5.0));
    let emission = shape.emission.as_ref().unwrap();
    assert_eq!((&emission.radiance, emission.two_sided), (&Colour([1.0, 0.5, 0.0]).into(), false));
    let Material::Principled(paint) = &scene.materials["Paint"] else { panic!("{:?}", scene.materials) };
    assert_eq!((&paint.base_color, &paint.metallic, &paint.roughness), (&Colour([0.1, 0.2, 0.3]).into(), &1.0.into(), &1.0.into()));
    let mesh = mesh(&imported, shape);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!((mesh.positions[2].to_array(), mesh.normals[3].to_array()), ([1.0, 1.0, 0.0], [0.0, 0.0, 1.0]));
    assert_eq!((mesh.uvs[0].to_array(), mesh.uvs[2].to_array()), ([0.0, 0.0], [1.0, 1.0]), "the image's last row is at the bottom");
    let [film] = &imported.report[..] else { panic!("{:?}", imported.report) };
    assert!(film.contains("960 × 640"), "{film}");
    assert_eq!(SceneDescription::from_json(&scene.to_json(), "s.json").unwrap(), *scene);
}

#[test]
fn meshes_used_twice_become_groups_and_colours_of_vertices_count() {
    let scene = with(&[
        ("/materials/0/emissiveFactor", json!([0, 0, 0])),
        ("/meshes/0/primitives/0/attributes/COLOR_0", json!(4)),
        ("/nodes/-", json!({"mesh": 0, "rotation": [0, 1, 0, 0], "scale": [2, 2, 2]})),
        ("/scenes/0/nodes/-", json!(2)),
    ]);
    let imported = read(&scene).unwrap();
    let scene = &imported.description;
    assert_eq!(scene.groups.keys().collect::<Vec<_>>(), ["Sheet"]);
    assert_eq!(scene.shapes.len(), 2);
    let turned = scene.shapes[1].to_world.matrix().transform_point3(DVec3::new(1.0, 0.0, 1.0));
    assert!((turned - DVec3::new(-2.0, 0.0, -2.0)).length() < 1e-9, "{turned}");
    let colours = mesh(&imported, &scene.groups["Sheet"][0]).colours;
    assert!((colours[0] - crate::math::Vec3::new(1.0, 0.0, 0.2)).length() < 1e-6, "{colours:?}");
    let Material::Principled(paint) = &scene.materials["Paint"] else { panic!("{:?}", scene.materials) };
    let Input::Texture(texture) = &paint.base_color else { panic!("{paint:?}") };
    assert!(matches!(&scene.textures[texture], Texture::VertexColour(colours) if colours.scale == Colour([0.1, 0.2, 0.3])));
    assert!(imported.report.iter().any(|line| line.contains("no light")), "{:?}", imported.report);
}

#[test]
fn lights_stand_where_their_nodes_do() {
    let scene = with(&[
        (
            "/extensions",
            json!({"KHR_lights_punctual": {"lights": [
                {"type": "spot", "color": [1, 0.5, 0.25], "intensity": 8, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}},
                {"type": "directional", "intensity": 3, "range": 4}
            ]}}),
        ),
        (
            "/nodes/-",
            json!({"translation": [0, 4, 0], "rotation": [-0.5f64.sqrt(), 0, 0, 0.5f64.sqrt()], "extensions": {"KHR_lights_punctual": {"light": 0}}}),
        ),
        ("/nodes/-", json!({"extensions": {"KHR_lights_punctual": {"light": 1}}})),
        ("/scenes/0/nodes", json!([0, 1, 2, 3])),
    ]);
    let imported = read(&scene).unwrap();
    let [Light::Spot(spot), Light::Directional(sun)] = &imported.description.lights[..] else {
        panic!("{:?}", imported.description.lights)
    };
    assert_eq!((spot.position, spot.intensity), ([0.0, 4.0, 0.0], Colour([8.0, 4.0, 2.0])));
    assert!((DVec3::from(spot.direction) - DVec3::NEG_Y).length() < 1e-9, "{:?}", spot.direction);
    assert!((spot.outer_angle - 0.2f64.to_degrees()).abs() < 1e-9);
    assert_eq!((sun.direction, sun.irradiance), ([0.0, 0.0, -1.0], Colour::grey(3.0)));
    assert!(imported.report.iter().any(|line| line.starts_with("lights[1]: its range is left out")), "{:?}", imported.report);
}

/// (what to change, parts of the message)
#[test]
fn faults_are_named() {
    let faults: &[(&str, Value, &[&str])] = &[
        ("/asset/version", json!("1.0"), &["t.gltf: at asset.version", "\"1.0\""]),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), &["extensionsRequired", "KHR_draco_mesh_compression", "KHR_lights"]),
        ("/scene", json!(7), &["at scene", "scenes[7]", "below 1"]),
        ("/nodes/1/mesh", json!(9), &["nodes[1]", "meshes[9]"]),
        ("/nodes/1/mesh", json!(-1), &["nodes[1].mesh", "-1"]),
        ("/nodes/1/children", json!([0]), &["nodes[0]", "twice"]),
        ("/nodes/1/children", json!([1]), &["nodes[1]", "circles"]),
        ("/meshes/0/primitives/0/material", json!(3), &["meshes[0].primitives[0]", "materials[3]"]),
        ("/meshes/0/primitives/0/mode", json!(9), &["meshes[0].primitives[0]", "mode 9"]),
        ("/meshes/0/primitives/0/indices", json!(0), &["accessors[0]", "SCALAR"]),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!(2), &["accessors[2]", "VEC2", "3 components"]),
        ("/accessors/0/count", json!(1_000_000_000), &["accessors[0]", "1000000000"]),
        ("/accessors/0/count", json!(5), &["accessors[0]", "bufferViews[0]"]),
        ("/accessors/0/byteOffset", json!(u64::MAX), &["accessors[0]", "18446744073709551615"]),
        ("/accessors/3/componentType", json!(5122), &["accessors[3]", "unsigned"]),
        ("/bufferViews/0/byteLength", json!(u64::MAX), &["bufferViews[0]"]),
        ("/buffers/0/byteLength", json!(1u64 << 30), &["buffers[0]", "1073741824"]),
        ("/buffers/0/uri", json!("../secret.bin"), &["../secret.bin"]),
        ("/materials/0/alphaMode", json!("GLASS"), &["materials[0]", "GLASS"]),
        ("/cameras/0", json!({"type": "perspective"}), &["cameras[0]", "no projection"]),
        ("/cameras/0/perspective/yfov", json!(4.0), &["camera.perspective.fov"]),
        ("/nodes/0/scale", json!([0, 0, 0]), &["cameras[0]", "flat"]),
        ("/nodes", json!("none"), &["t.gltf", "at nodes", "string"]),
    ];
    for (pointer, value, parts) in faults {
        let message = read(&with(&[(pointer, value.clone())])).expect_err(pointer).to_string();
        for part in *parts {
            assert!(message.contains(part), "{pointer} = {value}\n  gave: {message}\n  without: {part}");
        }
    }
}

#[test]
fn a_skin_stands_where_its_joints_do() {
    let mut scene = with(&[
        ("/skins", json!([{"joints": [2]}])),
        ("/nodes/-", json!({"translation": [0, 7, 0]})),
        ("/scenes/0/nodes", json!([0, 1, 2])),
        ("/nodes/1/skin", json!(0)),
        ("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(4)),
        ("/meshes/0/primitives/0/attributes/JOINTS_0", json!(5)),
    ]);
    // The x of the first normal: four bytes of zeros.
    scene["bufferViews"].as_array_mut().unwrap().push(json!({"buffer": 0, "byteOffset": 48, "byteLength": 4}));
    scene["accessors"].as_array_mut().unwrap().push(json!({"bufferView": 5, "componentType": 5121, "count": 1, "type": "VEC4"}));
    let message = read(&scene).unwrap_err().to_string();
    assert!(message.contains("1 joints and 4 weights"), "{message}");
    scene["accessors"][5] = json!({"componentType": 5121, "count": 4, "type": "VEC4", "sparse": {
        "count": 1, "indices": {"bufferView": 5, "componentType": 5121}, "values": {"bufferView": 5}
    }});
    let imported = read(&scene).unwrap();
    let shape = &imported.description.shapes[0];
    assert!(shape.to_world.is_identity(), "its node at z = −5 has no bearing");
    let lifted = mesh(&imported, shape).positions;
    assert!((lifted[2] - crate::math::Vec3::new(1.0, 8.0, 0.0)).length() < 1e-6, "{lifted:?}");
    assert!(imported.report.iter().any(|line| line.contains("skin")), "{:?}", imported.report);
}

#[test]
fn a_mesh_that_names_missing_vertices_is_refused() {
    let mut scene = square();
    scene["accessors"][0]["count"] = json!(2);
    scene["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 0});
    let message = read(&scene).unwrap_err().to_string();
    assert!(message.contains("names vertex") && message.contains("meshes[0].primitives[0]"), "{message}");
}

#[test]
fn every_sample_model_is_read_and_compiled_where_it_is_at_hand() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes");
    let mut files = vec![folder.join("anim-box/scene.gltf")];
    let mut open = vec![folder.join("gltf")];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten() {
            let path = entry.unwrap().path();
            let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_string();
            if path.is_dir() {
                open.push(path);
            } else if ["gltf", "glb"].contains(&extension.as_str()) {
                files.push(path);
            }
        }
    }
    files.sort();
    for file in files.iter().filter(|file: &&PathBuf| file.is_file()) {
        let loaded = load(file).unwrap_or_else(|fault| panic!("{fault}"));
        assert!(!loaded.description.shapes.is_empty(), "{}", file.display());
        for name in loaded.description.assets() {
            crate::scene::Assets::open(&loaded.assets, &name).unwrap();
        }
        // What the rest of the program cannot do yet is an error of its own kind; anything else is a fault of the importer.
        let stage = Stage::new(loaded.description.clone(), std::sync::Arc::new(loaded.assets.clone())).unwrap();
        let [start, end] = loaded.description.animation.as_ref().and_then(|animation| animation.span()).unwrap_or([0.0; 2]);
        for share in [0.0, 0.3, 0.77, 1.0] {
            if let Err(fault) = stage.scene(start + share * (end - start)) {
                assert_eq!(fault.kind, ErrorKind::Unsupported, "{}: {fault}", file.display());
            }
        }
    }
}

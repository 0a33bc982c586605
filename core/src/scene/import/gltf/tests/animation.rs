//! What moves in a glTF file moves in the description.

use super::*;
use crate::scene::description::{Interpolation, Operation, Transform};

/// The square with more numbers: each list becomes an accessor of that type, from 5 on.
fn with_numbers(changes: &[(&str, Value)], lists: &[(&str, &[f32])]) -> Value {
    let mut scene = with(changes);
    let bytes: Vec<u8> = lists.iter().flat_map(|(_, list)| list.iter().flat_map(|x| x.to_le_bytes())).collect();
    scene["buffers"].as_array_mut().unwrap().push(json!({"byteLength": bytes.len(), "uri": data(&bytes)}));
    let mut start = 0;
    for (kind, list) in lists {
        let width = match *kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let views = scene["bufferViews"].as_array_mut().unwrap();
        views.push(json!({"buffer": 1, "byteOffset": start, "byteLength": list.len() * 4}));
        let view = views.len() - 1;
        let accessors = scene["accessors"].as_array_mut().unwrap();
        accessors.push(json!({"bufferView": view, "componentType": 5126, "count": list.len() / width, "type": kind}));
        start += list.len() * 4;
    }
    scene
}

fn channels(list: &[(usize, &str, usize, usize, &str)]) -> Value {
    let channels: Vec<Value> =
        list.iter().enumerate().map(|(k, (node, path, ..))| json!({"sampler": k, "target": {"node": node, "path": path}})).collect();
    let samplers: Vec<Value> =
        list.iter().map(|(_, _, input, output, kind)| json!({"input": input, "output": output, "interpolation": kind})).collect();
    json!([{"name": "all", "channels": channels, "samplers": samplers}])
}

fn point(transform: &Transform, point: [f64; 3]) -> DVec3 {
    transform.matrix().transform_point3(point.into())
}

#[test]
fn nodes_move_what_stands_in_them() {
    // The square stands in a node that is moved by its parent; light and camera stand in it too.
    let half = 0.5f32.sqrt();
    let scene = with_numbers(
        &[
            ("/extensions", json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}})),
            ("/nodes/0/translation", json!([0, 0, 3])),
            ("/nodes/-", json!({"name": "arm", "translation": [1, 0, 0], "children": [3]})),
            ("/nodes/-", json!({"scale": [2, 2, 2], "children": [0, 1, 4]})),
            ("/nodes/-", json!({"translation": [0, 1, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}})),
            ("/scenes/0/nodes", json!([2])),
            ("/animations", channels(&[(2, "rotation", 5, 6, "LINEAR"), (1, "translation", 5, 7, "STEP")])),
        ],
        &[("SCALAR", &[0.0, 2.0]), ("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half]), ("VEC3", &[0.0, 0.0, -5.0, 0.0, 0.0, -7.0])],
    );
    let imported = read(&scene).unwrap();
    let scene = &imported.description;
    assert_eq!(scene.animation.as_ref().unwrap().span(), Some([0.0, 2.0]));
    assert_eq!(scene.animation.as_ref().unwrap().nodes.keys().collect::<Vec<_>>(), ["Square", "arm"]);
    assert!(!imported.report.iter().any(|line| line.contains("left out")), "{:?}", imported.report);
    for (seconds, corner, left, lamp) in [
        (0.0, [3.0, 2.0, -10.0], [-1.0, 0.0, 0.0], [1.0, 2.0, 0.0]),
        // A quarter turn around +Y takes +X to −Z: (2, 2, −14) becomes (−14, 2, −2), one metre to the right.
        (2.0, [-13.0, 2.0, -2.0], [0.0, 0.0, 1.0], [1.0, 2.0, 0.0]),
    ] {
        let still = scene.at(seconds).unwrap();
        let found = point(&still.shapes[0].to_world, [1.0, 1.0, 0.0]);
        assert!((found - DVec3::from(corner)).length() < 1e-5, "{found} at {seconds} s");
        let x = still.camera.to_world().matrix().transform_vector3(DVec3::X);
        assert!((x - DVec3::from(left)).length() < 1e-6, "the camera has no scale: {x}");
        let [Light::Spot(spot)] = &still.lights[..] else { panic!("{:?}", still.lights) };
        assert!((point(&spot.to_world, spot.position) - DVec3::from(lamp)).length() < 1e-6);
    }
    assert_eq!(scene.at(1.9).unwrap().shapes[0].to_world.0.len(), 1);
    assert_eq!(SceneDescription::from_json(&scene.to_json(), "s.json").unwrap(), *scene);
}

#[test]
fn cubic_splines_bring_their_tangents() {
    let keys = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [-3.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]];
    let scene = with_numbers(
        &[("/animations", channels(&[(1, "translation", 5, 6, "CUBICSPLINE")]))],
        &[("SCALAR", &[0.0, 1.0]), ("VEC3", keys.as_flattened())],
    );
    let scene = read(&scene).unwrap().description;
    assert_eq!(scene.animation.as_ref().unwrap().tracks[0].interpolation, Interpolation::Cubic);
    // Hermite with p = 1 and 2, slopes 3 and −3, at a half: 1.5 + (3 + 3) / 8.
    let x = point(&scene.at(0.5).unwrap().shapes[0].to_world, [0.0; 3]).x;
    assert!((x - 2.25).abs() < 1e-6, "{x}");
}

#[test]
fn forms_are_blended_and_joints_pull() {
    let identity = DMat4::IDENTITY.to_cols_array().map(|x| x as f32);
    let deltas = [[0.0f32, 0.0, 1.0], [0.0; 3], [0.0; 3], [0.0; 3]];
    let ones = [[1.0f32, 0.0, 0.0, 0.0]; 4];
    let scene = with_numbers(
        &[
            ("/nodes/1/skin", json!(0)),
            ("/nodes/-", json!({"name": "bone", "translation": [0, 7, 0]})),
            ("/scenes/0/nodes", json!([0, 1, 2])),
            ("/skins", json!([{"joints": [2], "inverseBindMatrices": 8}])),
            ("/meshes/0/primitives/0/targets", json!([{"POSITION": 9}])),
            ("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(10)),
            ("/meshes/0/primitives/0/attributes/JOINTS_0", json!(11)),
            ("/animations", channels(&[(1, "weights", 5, 6, "LINEAR"), (2, "translation", 5, 7, "LINEAR")])),
        ],
        &[
            ("SCALAR", &[0.0, 1.0]),
            ("SCALAR", &[0.0, 2.0]),
            ("VEC3", &[0.0, 7.0, 0.0, 0.0, 9.0, 0.0]),
            ("MAT4", &identity),
            ("VEC3", deltas.as_flattened()),
            ("VEC4", ones.as_flattened()),
            ("VEC4", &[0.0; 16]),
        ],
    );
    let mut scene = scene;
    scene["accessors"][11]["componentType"] = json!(5123);
    let imported = read(&scene).unwrap();
    let still = imported.description.at(0.5).unwrap();
    let Geometry::Mesh(mesh) = &still.shapes[0].geometry else { panic!("{:?}", still.shapes[0].geometry) };
    // Blended half-way to z = 2, pulled up by 8; the node's z = −5 has no bearing.
    assert_eq!((mesh.positions[0], mesh.positions[1]), ([-1.0, 7.0, 1.0], [1.0, 7.0, 0.0]));
    assert_eq!(imported.report.len(), 1, "{:?}", imported.report);
}

#[test]
fn what_is_hidden_by_a_scale_of_zero_is_very_small() {
    let scene = with_numbers(
        &[("/animations", channels(&[(1, "scale", 5, 6, "STEP")]))],
        &[("SCALAR", &[0.0, 1.0]), ("VEC3", &[1.0, 1.0, 1.0, 0.0, 0.0, 0.0])],
    );
    let imported = read(&scene).unwrap();
    let still = imported.description.at(1.0).unwrap();
    let Operation::Matrix(rows) = &still.shapes[0].to_world.0[0] else { panic!("{:?}", still.shapes[0].to_world) };
    assert_eq!(rows[0][0], 1e-6);
    assert!(imported.report.iter().any(|line| line.contains("a scale of 0")), "{:?}", imported.report);
}

#[test]
fn faulty_channels_are_named() {
    let fault = |channel: (usize, &str, usize, usize, &str), times: &[f32], values: (&str, &[f32])| {
        let scene = with_numbers(&[("/animations", channels(&[channel]))], &[("SCALAR", times), values]);
        read(&scene).unwrap_err().to_string()
    };
    for (message, parts) in [
        (fault((9, "scale", 5, 6, "STEP"), &[0.0], ("VEC3", &[1.0; 3])), ["animations[0].channels[0]", "nodes[9]"]),
        (fault((1, "scale", 5, 6, "STEP"), &[0.0, 0.0], ("VEC3", &[1.0; 6])), ["animations[0].samplers[0]", "key 1 at 0 s"]),
        (fault((1, "scale", 5, 6, "STEP"), &[0.0], ("VEC3", &[1.0; 6])), ["samplers[0]", "6 numbers for 1 keys"]),
        (fault((1, "scale", 5, 6, "BEZIER"), &[0.0], ("VEC3", &[1.0; 3])), ["samplers[0]", "\"BEZIER\""]),
        (fault((1, "rotation", 5, 6, "LINEAR"), &[0.0], ("VEC3", &[1.0; 3])), ["accessors[6]", "4 components"]),
        (fault((1, "rotation", 5, 6, "LINEAR"), &[0.0], ("VEC4", &[0.0; 4])), ["animation.tracks[0].values[0]", "a quaternion"]),
    ] {
        for part in parts {
            assert!(message.contains(part), "{message}\nlacks {part}");
        }
    }
}

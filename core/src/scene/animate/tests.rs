//! Tests of descriptions over time: what moves, what hangs on what, what is refused and how that is said.

use glam::DVec3;
use proptest::prelude::*;

use crate::scene::SceneDescription;
use crate::scene::description::Geometry;

const SCENE: &str = r#"{
  "version": 1,
  "camera": {"perspective": {"to_world": [{"look_at": {"origin": [0, 1, 5], "target": [0, 1, 0]}}], "fov": 40}},
  "film": {"width": 8, "height": 6},
  "materials": {"wall.white": {"diffuse": {"reflectance": 0.5}}, "wall": {"diffuse": {"reflectance": [0.1, 0.2, 0.3]}}},
  "groups": {"pair": [{"geometry": "cube", "material": "wall", "to_world": [{"translate": [1, 0, 0]}]}]},
  "shapes": [
    {"geometry": "rectangle", "material": "wall", "to_world": [{"scale": [2, 2, 2]}, {"translate": [0, 0, 0]}]},
    {"geometry": "cube", "material": "wall.white", "to_world": [{"scale": [0.1, 0.1, 0.1]}, {"node": "hand"}]},
    {"geometry": {"instance": {"of": "pair"}}},
    {"geometry": {"mesh": {"positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 2, 0]], "indices": [[0, 1, 2], [1, 3, 2]],
      "normals": [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1]],
      "morph": {"weights": [0, 0], "targets": [{"positions": [[0, 0, 0], [0, 0, 0], [0, 0, 1], [0, 0, 2]]},
        {"positions": [[0, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, 0]], "normals": [[1, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]}]},
      "skin": {"joints": [{"node": "arm", "bind": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]},
          {"node": "hand", "bind": [[1, 0, 0, 0], [0, 1, 0, -1], [0, 0, 1, 0], [0, 0, 0, 1]]}],
        "influences": [{"joints": [[0, 0, 0, 0], [0, 0, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0]],
          "weights": [[1, 0, 0, 0], [2, 0, 0, 0], [0.5, 0.5, 0, 0], [1, 0, 0, 0]]}]}}}, "material": "wall"}
  ],
  "lights": [{"point": {"position": [0, 3, 0], "intensity": 4}}, {"spot": {"position": [0, 0, 0], "direction": [0, 0, 1], "intensity": 1,
    "inner_angle": 10, "outer_angle": 20, "to_world": [{"node": "hand"}]}}],
  "animation": {
    "nodes": {"hand": {"parent": "arm", "to_parent": [{"quaternion": [0, 0, 0, 1]}, {"translate": [0, 1, 0]}]}, "arm": {"to_parent": [{"translate": [3, 0, 0]}]}},
    "tracks": [
      {"target": "camera.perspective.fov", "times": [0, 2], "values": [40, 60]},
      {"target": "camera.perspective.lens_radius", "times": [0, 2], "values": [0, 0.5]},
      {"target": "shapes[0].to_world[1].translate", "times": [1, 2], "values": [[0, 0, 0], [0, 4, 0]]},
      {"target": "shapes[2].geometry.instance.of", "times": [1], "values": [1]},
      {"target": "materials.wall.white.diffuse.reflectance", "times": [0, 1], "values": [0.5, 1.0], "interpolation": "step"},
      {"target": "lights[0].point.intensity", "times": [0, 1], "values": [[1, 1, 1], [3, 2, 1]]},
      {"target": "groups.pair[0].to_world[0].translate[2]", "times": [0, 1], "values": [0, 1]},
      {"target": "animation.nodes.hand.to_parent[0].quaternion", "times": [0, 1], "values": [[0, 0, 0, 1], [0, 0, 1, 0]]},
      {"target": "shapes[3].geometry.mesh.morph.weights", "times": [0, 1], "values": [[0, 0], [1, 0.5]]}
    ]
  }
}"#;

/// The scene above without the track that cannot be.
fn written() -> String {
    SCENE.replace("      {\"target\": \"shapes[2].geometry.instance.of\", \"times\": [1], \"values\": [1]},\n", "")
}

fn scene() -> SceneDescription {
    SceneDescription::from_json(&written(), "s.json").unwrap()
}

fn fault(from: &str, to: &str) -> String {
    let text = written();
    assert!(text.contains(from), "{from}");
    SceneDescription::from_json(&text.replacen(from, to, 1), "s.json").unwrap_err().to_string()
}

fn close(found: impl Into<DVec3>, expected: [f64; 3]) {
    let found = found.into();
    assert!((found - DVec3::from(expected)).length() < 1e-6, "{found} is not {expected:?}");
}

/// The vertices of shape 3.
fn vertices(still: &SceneDescription) -> Vec<[f64; 3]> {
    let Geometry::Mesh(mesh) = &still.shapes[3].geometry else { panic!("no mesh") };
    assert!(mesh.skin.is_none() && mesh.morph.is_none(), "baked");
    mesh.positions.iter().map(|p| p.map(f64::from)).collect()
}

#[test]
fn every_kind_of_part_moves() {
    let scene = scene();
    assert!(scene.is_animated());
    assert_eq!(scene.animation.as_ref().unwrap().span(), Some([0.0, 2.0]));
    let still = scene.at(1.0).unwrap();
    assert!(!still.is_animated() && still.animation.is_none());
    still.validate("still").unwrap();
    let json = serde_json::to_value(&still).unwrap();
    assert_eq!(json["camera"]["perspective"]["fov"], 50.0);
    assert_eq!(json["camera"]["perspective"]["lens_radius"], 0.25, "a field that was left out");
    assert_eq!(json["materials"]["wall.white"]["diffuse"]["reflectance"], 1.0);
    assert_eq!(json["materials"]["wall"]["diffuse"]["reflectance"], serde_json::json!([0.1, 0.2, 0.3]));
    assert_eq!(json["lights"][0]["point"]["intensity"], serde_json::json!([3.0, 2.0, 1.0]));
    assert_eq!(json["groups"]["pair"][0]["to_world"][0]["translate"], serde_json::json!([1.0, 0.0, 1.0]));
    close(scene.at(1.5).unwrap().shapes[0].to_world.matrix().transform_point3(DVec3::ZERO), [0.0, 2.0, 0.0]);
}

#[test]
fn nodes_hang_on_their_parents() {
    let scene = scene();
    // Scaled by 0.1, turned by half of 180° about +Z, moved by (0, 1, 0), then by (3, 0, 0).
    let matrix = scene.at(0.5).unwrap().shapes[1].to_world.matrix();
    close(matrix.transform_point3(DVec3::X), [3.0, 1.1, 0.0]);
    let light = serde_json::to_value(scene.at(0.5).unwrap().lights[1].clone()).unwrap();
    assert!(light["spot"]["to_world"][0]["matrix"].is_array(), "{light}");
}

#[test]
fn morphs_then_skins_as_by_hand() {
    let scene = scene();
    // At 0 the hand stands at (3, 1, 0) and was bound at (0, 1, 0): everything moves by (3, 0, 0).
    let at_0 = vertices(&scene.at(0.0).unwrap());
    for (found, expected) in at_0.iter().zip([[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [3.0, 1.0, 0.0], [3.0, 2.0, 0.0]]) {
        close(*found, expected);
    }
    // At 1 the forms are added with 1 and 0.5, and the hand has turned by 180° about +Z around its own origin.
    let at_1 = vertices(&scene.at(1.0).unwrap());
    // (0, 1, 1): the mean of (3, 1, 1) by the arm and (3, 1, 1) by the hand. (0, 2, 2) by the hand: down to (3, 0, 2).
    for (found, expected) in at_1.iter().zip([[3.0, 0.0, 0.0], [4.5, 0.0, 0.0], [3.0, 1.0, 1.0], [3.0, 0.0, 2.0]]) {
        close(*found, expected);
    }
    let still = scene.at(1.0).unwrap();
    let Geometry::Mesh(mesh) = &still.shapes[3].geometry else { panic!("no mesh") };
    let normal = mesh.normals.as_ref().unwrap()[0].map(f64::from);
    close(normal, DVec3::new(0.5, 0.0, 1.0).normalize().into());
}

#[test]
fn what_rests_is_equal_and_what_moves_is_not() {
    let scene = scene();
    let at = |seconds: f64| scene.at(seconds).unwrap();
    assert_eq!(at(2.0), at(3.0));
    assert_eq!(at(2.0), at(1e6));
    assert_eq!(at(0.0), at(-1.0));
    assert_ne!(at(1.0), at(1.1));
    let still = at(0.5);
    assert_eq!(still.at(7.0).unwrap(), still);
    assert!(scene.at(f64::NAN).is_err());
}

#[test]
fn faults_name_track_and_path() {
    let error = SceneDescription::from_json(SCENE, "s.json").unwrap_err().to_string();
    assert!(error.contains("animation.tracks[3].target") && error.contains("a number for something that is no number"), "{error}");
    for (from, to, words) in [
        ("\"values\": [40, 60]", "\"values\": [40, 190]", &["animation.tracks[0], camera.perspective.fov", "190 at 2 s", "(0, 180)"][..]),
        ("\"values\": [40, 60]", "\"values\": [40, 60, 70]", &["animation.tracks[0].values", "3 values", "2, one for each time"]),
        ("\"values\": [40, 60]", "\"values\": [[40], 60]", &["animation.tracks[0].values[1]", "values of one form"]),
        ("\"times\": [0, 2], \"values\": [40", "\"times\": [0, 0], \"values\": [40", &["tracks[0].times[1]", "later than the key before"]),
        ("\"values\": [0.5, 1.0]", "\"values\": [0.5, 1.5]", &["tracks[3], materials.wall.white", "channels from 0 to 1"]),
        ("lights[0].point.int", "lights[7].point.int", &["tracks[4].target", "lights[7]", "that the scene has"]),
        ("lights[0].point.int", "lights[0].pont.int", &["tracks[4].target", "no `pont` there"]),
        ("perspective.lens_radius\"", "perspective.lens_radios\"", &["tracks[1], camera.perspective", "unknown field `lens_radios`"]),
        ("perspective.lens_radius\"", "perspective.fov\"", &["tracks[1].target", "tracks[0] moves"]),
        ("[0, 0, 1, 0]]}", "[0, 0, 0, 0]]}", &["tracks[6].values[1]", "a quaternion"]),
        ("\"parent\": \"arm\"", "\"parent\": \"leg\"", &["animation.nodes.hand.parent", "\"leg\"", "`arm`"]),
        ("\"parent\": \"arm\"", "\"parent\": \"hand\"", &["the circle hand → hand"]),
        ("[{\"node\": \"hand\"}]}}],\n  \"anim", "[{\"node\": \"foot\"}]}}],\n  \"anim", &["lights[1].to_world", "the node \"foot\""]),
        ("[{\"translate\": [3, 0, 0]}]", "[{\"node\": \"hand\"}]", &["animation.nodes.arm.to_parent", "no node here"]),
        ("\"joints\": [[0, 0", "\"joints\": [[0, 9", &["shapes[3].geometry.mesh.skin.influences[0].joints", "found 9, expected 0 to 1"]),
        ("{\"node\": \"arm\", \"bind\"", "{\"node\": \"leg\", \"bind\"", &["mesh.skin.joints[0].node", "\"leg\""]),
        ("\"weights\": [0, 0]", "\"weights\": [0]", &["tracks[7].target", "a list of 2 for a list of 1"]),
        ("[[0, 0], [1, 0.5]]", "[[0], [1]]", &["tracks[7].target", "a list of 1 for a list of 2"]),
        ("\"times\": [0, 2], \"values\": [0, 0.5]", "\"times\": [], \"values\": []", &["tracks[1].times", "no keys"]),
    ] {
        let error = fault(from, to);
        for word in words {
            assert!(error.contains(word), "{error}\nlacks {word:?}");
        }
    }
}

#[test]
fn a_cubic_that_leaves_the_domain_between_keys_is_refused() {
    let cubic = "\"times\": [0, 1, 2, 3], \"values\": [0.2, 1, 1, 0.2], \"interpolation\": \"cubic\"";
    let error = fault("\"times\": [0, 1], \"values\": [0.5, 1.0], \"interpolation\": \"step\"", cubic);
    assert!(error.contains("tracks[3], materials.wall.white.diffuse.reflectance") && error.contains("at 1.5 s"), "{error}");
}

#[test]
fn what_leaves_the_domain_between_keys_is_an_error_of_that_instant() {
    let text = written().replace(
        "lights[0].point.intensity\", \"times\": [0, 1], \"values\": [[1, 1, 1], [3, 2, 1]]",
        "lights[1].spot.direction\", \"times\": [0, 1], \"values\": [[0, 0, 1], [0, 0, -1]]",
    );
    let scene = SceneDescription::from_json(&text, "s.json").unwrap();
    assert!(scene.at(0.4).is_ok());
    let error = scene.at(0.5).unwrap_err().to_string();
    assert!(error.contains("animation.tracks[4], lights[1].spot.direction") && error.contains("at 0.5 s"), "{error}");
}

#[test]
fn a_description_that_nobody_checked_is_refused_and_not_trusted() {
    type Damage = fn(&mut SceneDescription);
    let damages: [(Damage, &str); 6] = [
        (|scene| scene.animation.as_mut().unwrap().tracks[0].times.clear(), "tracks[0].times"),
        (|scene| scene.animation.as_mut().unwrap().tracks[0].values.clear(), "tracks[0].values"),
        (|scene| scene.animation.as_mut().unwrap().nodes.clear(), "the node"),
        (|scene| scene.animation = None, "joints[0].node"),
        (|scene| scene.shapes.truncate(1), "tracks[7].target"),
        (
            |scene| {
                let Geometry::Mesh(mesh) = &mut scene.shapes[3].geometry else { return };
                mesh.skin.as_mut().unwrap().influences[0].joints.pop();
            },
            "influences[0].joints",
        ),
    ];
    for (damage, words) in damages {
        let mut scene = scene();
        damage(&mut scene);
        let error = scene.at(0.5).unwrap_err().to_string();
        assert!(error.contains(words), "{error}\nlacks {words}");
    }
}

#[test]
fn what_is_written_is_read_back() {
    let scene = scene();
    assert_eq!(SceneDescription::from_json(&scene.to_json(), "again").unwrap(), scene);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn any_time_gives_one_sound_description(seconds in prop_oneof![-1.0..4.0, -1e300..1e300f64, Just(f64::MAX), Just(f64::MIN_POSITIVE)]) {
        let scene = scene();
        let still = scene.at(seconds).unwrap();
        prop_assert_eq!(&still, &scene.at(seconds).unwrap());
        prop_assert!(still.validate("still").is_ok());
    }
}

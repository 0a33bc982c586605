//! What compiled scenes look like to rays.

use super::*;
use crate::lattice::Extent;
use crate::math::Ray;
use crate::scene::assets::NoAssets;

fn compile(rest: &str) -> Result<Scene, Error> {
    let text = format!(
        r#"{{ "version": 1,
            "camera": {{ "perspective": {{ "to_world": [{{ "look_at": {{ "origin": [0, 0, 5], "target": [0, 0, 0] }} }}], "fov": 90 }} }},
            "materials": {{ "black": {{ "diffuse": {{ "reflectance": 0 }} }}, "white": {{ "diffuse": {{ "reflectance": 1 }} }} }},
            {rest} }}"#
    );
    Scene::compile(&SceneDescription::from_json(&text, "test.json")?, &NoAssets)
}

fn towards(origin: [f32; 3], direction: [f32; 3]) -> Ray {
    Ray::new(origin.into(), direction.into())
}

#[test]
fn left_in_the_picture_is_left_in_the_world() {
    let scene = compile(r#""shapes": []"#).unwrap();
    let view = scene.sensor.view(Extent { width: 10, height: 10 });
    // Looking along −Z with +Y up, the left is −X and the top is +Y.
    let corner = view.ray([0.0, 0.0], [0.5, 0.5]);
    assert!((corner.direction - Vec3::new(-1.0, 1.0, -1.0).normalize()).length() < 1e-6, "{:?}", corner.direction);
}

#[test]
fn a_cube_faces_outwards() {
    let scene = compile(r#""shapes": [{ "geometry": "cube", "material": "white" }]"#).unwrap();
    for axis in 0..3 {
        for sign in [-1.0f32, 1.0] {
            let mut from = [0.1, 0.2, 0.3];
            from[axis] = 4.0 * sign;
            let mut direction = [0.0; 3];
            direction[axis] = -sign;
            let point = scene.trace(&towards(from, direction)).unwrap();
            assert_eq!(point.normal[axis], sign);
            assert!((point.t - 3.0).abs() < 1e-5);
        }
    }
}

#[test]
fn a_rectangle_is_one_parallelogram_however_it_is_turned() {
    for turn in [r#""flip_normals": true"#, r#""to_world": [{ "scale": [-1, 1, 1] }]"#, r#""name": "plain""#] {
        let scene =
            compile(&format!(r#""shapes": [{{ "geometry": "rectangle", "material": "black", "emission": {{ "radiance": 2 }}, {turn} }}]"#))
                .unwrap();
        let point = scene.trace(&towards([0.2, 0.3, 5.0], [0.0, 0.0, -1.0])).unwrap();
        let front = if turn.contains("flip") { -1.0 } else { 1.0 };
        assert_eq!(point.normal, Vec3::Z * front, "{turn}");
        let light = scene.light_point(&point).unwrap();
        let before = Vec3::new(0.2, 0.3, 5.0 * front);
        assert_eq!(scene.lights.radiance(&light, before).to_rgb(), [2.0; 3]);
        assert!(scene.lights.radiance(&light, -before).is_black());
        // The light's own idea of its front agrees with that of the surface.
        assert!(scene.lights.sample(before, || 0.5, [0.3, 0.6]).is_some());
        assert!(scene.lights.sample(-before, || 0.5, [0.3, 0.6]).is_none());
    }
}

#[test]
fn nested_instances_stand_where_their_transforms_put_them() {
    let scene = compile(
        r#""groups": {
            "ball": [{ "geometry": { "sphere": { "radius": 0.5, "center": [0, 0, 1] } }, "material": "white" }],
            "pair": [{ "geometry": { "instance": { "of": "ball" } }, "to_world": [{ "translate": [2, 0, 0] }] },
                     { "geometry": { "instance": { "of": "ball" } }, "to_world": [{ "translate": [-2, 0, 0] }] }]
        },
        "shapes": [{ "geometry": { "instance": { "of": "pair" } }, "to_world": [{ "scale": [2, 2, 2] }, { "translate": [0, 0, 10] }] }]"#,
    )
    .unwrap();
    for x in [-4.0, 4.0] {
        let point = scene.trace(&towards([x, 0.0, 0.0], [0.0, 0.0, 1.0])).unwrap();
        assert!((point.t - 11.0).abs() < 1e-5, "{}", point.t);
        assert_eq!(scene.shape(point.shape).material, 1);
    }
    assert!(scene.trace(&towards([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])).is_none());
}

#[test]
fn spheres_scale_evenly_and_black_emission_is_no_light() {
    let scene = compile(
        r#""shapes": [{ "geometry": { "sphere": { "radius": 1, "center": [1, 0, 0] } }, "material": "white",
                        "to_world": [{ "scale": [3, 3, -3] }], "emission": { "radiance": 0 } }],
           "environment": { "radiance": 0 }"#,
    )
    .unwrap();
    let point = scene.trace(&towards([3.0, 0.0, 9.0], [0.0, 0.0, -1.0])).unwrap();
    assert!((point.t - 6.0).abs() < 1e-5);
    assert!(scene.lights.is_empty());
}

#[test]
fn what_overflows_single_precision_is_refused() {
    let sphere = r#"{ "geometry": { "sphere": { "radius": RADIUS } }, "material": "white", "to_world": [OPS] }"#;
    let cases = [("1e-30", r#"{ "scale": [1e-18, 1e-18, 1e-18] }"#), ("1e30", r#"{ "scale": [1e18, 1e18, 1e18] }"#)];
    for (radius, operations) in cases {
        let error = compile(&format!(r#""shapes": [{}]"#, sphere.replace("RADIUS", radius).replace("OPS", operations))).unwrap_err();
        assert!(error.to_string().contains("shapes[0]: found a sphere at"), "{error}");
    }
    let mesh = r#""shapes": [{ "geometry": { "mesh": { "positions": [[1e30, 0, 0], [0, 0, 0], [0, 1, 0]], "indices": [[0, 1, 2]] } },
                  "material": "white", "to_world": [{ "scale": [1e18, 1, 1] }] }]"#;
    assert!(compile(mesh).unwrap_err().to_string().contains("vertex 0 is not finite"));
}

#[test]
fn a_missing_file_is_named() {
    let error = compile(r#""shapes": [{ "geometry": { "obj": { "file": "lost.obj" } }, "material": "white" }]"#).unwrap_err();
    assert_eq!((error.kind, error.place.file.as_str()), (ErrorKind::Unreadable, "lost.obj"));
}

#[test]
fn light_from_a_surface_without_area_is_refused() {
    let error = compile(
        r#""shapes": [{ "geometry": { "mesh": { "positions": [[0, 0, 0]], "indices": [[0, 0, 0]] } }, "material": "white",
                        "emission": { "radiance": 1 } }]"#,
    )
    .unwrap_err();
    assert!(error.to_string().contains("shapes[0].emission: found emission from a surface without area"), "{error}");
}

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
        assert!(error.to_string().contains("shapes[0]: found a surface of area"), "{error}");
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

#[test]
fn disks_tubes_and_spheres_stand_where_the_description_says() {
    let scene = compile(
        r#""textures": { "fields": { "checkerboard": { "color0": 0, "color1": 1 } } },
           "shapes": [{ "geometry": "disk", "material": "white", "to_world": [{ "scale": [-2, 1, 1] }] },
                      { "geometry": { "cylinder": { "p0": [0, 0, 1], "p1": [0, 0, 3], "radius": 0.5 } }, "material": "white",
                        "flip_normals": true, "to_world": [{ "scale": [2, 2, 2] }] },
                      { "geometry": { "sphere": { "radius": 1 } }, "material": "white", "flip_normals": true,
                        "to_world": [{ "translate": [9, 0, 0] }] }]"#,
    )
    .unwrap();
    // A disk that is stretched and mirrored along x still faces +Z; half-way to the rim u is ½.
    let disk = scene.trace(&towards([1.0, 0.0, 1.0], [0.0, 0.0, -1.0])).unwrap();
    assert_eq!((disk.normal, disk.shape), (Vec3::Z, ShapeId(0)));
    assert!((disk.uv - Vec2::new(0.5, 0.5)).length() < 1e-6, "{}", disk.uv);
    assert!(scene.trace(&towards([0.0, 1.1, 1.0], [0.0, 0.0, -1.0])).is_none_or(|point| point.shape != ShapeId(0)));
    // The tube runs from z = 2 to 6 at radius 1; turned inside out its front is its inside.
    let tube = scene.trace(&towards([0.0, -5.0, 3.0], [0.0, 1.0, 0.0])).unwrap();
    assert!((tube.t - 4.0).abs() < 1e-5 && (tube.normal - Vec3::Y).length() < 1e-6 && (tube.uv.y - 0.25).abs() < 1e-6, "{tube:?}");
    assert!(scene.trace(&towards([0.0, -5.0, 6.5], [0.0, 1.0, 0.0])).is_none());
    let sphere = scene.trace(&towards([9.0, 0.0, 5.0], [0.0, 0.0, -1.0])).unwrap();
    assert_eq!(sphere.normal, -Vec3::Z);
    assert!(sphere.uv.y < 1e-3, "+z is where v is 0: {}", sphere.uv);
}

#[test]
fn cameras_and_films_are_taken_as_written() {
    let text = r#"{ "version": 1, "camera": { "orthographic": { "scale": 2 } },
        "film": { "width": 40, "height": 20, "crop": { "x": 10, "y": 5, "width": 4, "height": 5 }, "filter": { "mitchell": {} } },
        "materials": {}, "shapes": [] }"#;
    let scene = Scene::compile(&SceneDescription::from_json(text, "test.json").unwrap(), &NoAssets).unwrap();
    let ray = scene.sensor.view(Extent { width: 4, height: 5 }).ray([0.0, 0.0], [0.5; 2]);
    // A quarter of the way from the left edge, which is +X, and from the top, at half the width's scale.
    assert!((ray.origin - Vec3::new(1.0, 0.5, 0.0)).length() < 1e-6, "{}", ray.origin);
    assert_eq!(ray.direction, Vec3::Z);
    assert!((0..100).any(|k| scene.sensor.filter.place([k as f32 / 100.0, 0.5]).1 < 0.0));
}

#[test]
fn a_sky_is_an_environment_with_its_sun_where_it_is_said_to_be() {
    let scene = compile(
        r#""shapes": [], "environment": { "sky": { "sun_direction": [0, 1, 0.5],
           "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }] } }"#,
    )
    .unwrap();
    let seen = |direction: Vec3| {
        let point = scene.lights.at_infinity(direction).unwrap();
        scene.lights.radiance(&point, Vec3::ZERO).mean()
    };
    // Turned so that up is +Z: the sun at (0, 1, ½) comes to (0, −½, 1).
    assert!(seen(Vec3::new(0.0, -0.5, 1.0)) > 3e3);
    assert!((0.01..1.0).contains(&seen(Vec3::new(0.5, 0.5, 0.5))));
    assert_eq!(seen(Vec3::new(0.0, 0.3, -1.0)), 0.0);
}

#[test]
fn light_may_leave_both_sides_and_follow_a_texture() {
    let scene = compile(
        r#""textures": { "fields": { "checkerboard": { "color0": 4, "color1": 1 } } },
           "shapes": [{ "geometry": "rectangle", "material": "black", "emission": { "radiance": { "texture": "fields" }, "two_sided": true } }]"#,
    )
    .unwrap();
    for (x, expected) in [(-0.5, 4.0), (0.5, 1.0)] {
        for side in [-1.0, 1.0] {
            let point = scene.trace(&towards([x, -0.5, 5.0 * side], [0.0, 0.0, -side])).unwrap();
            let light = scene.light_point(&point).unwrap();
            let from = Vec3::new(x, -0.5, side);
            assert_eq!(scene.lights.radiance(&light, from).to_rgb(), [expected; 3]);
            assert!(scene.lights.density(from, &light) > 0.0);
        }
    }
}

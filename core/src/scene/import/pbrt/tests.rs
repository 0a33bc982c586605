//! pbrt scenes: small ones written here, and whole ones where they are at hand.

use std::collections::BTreeMap;

use glam::DVec3;

use super::*;
use crate::scene::assets::NoAssets;
use crate::scene::description::{Colour, Falloff, Filter, Geometry, Input};
use crate::scene::{Scene, load};

mod coverage;

/// Files by name.
struct Files(BTreeMap<&'static str, String>);

impl Assets for Files {
    fn open(&self, name: &str) -> Result<Vec<u8>, Error> {
        match self.0.get(name) {
            Some(text) => Ok(text.clone().into_bytes()),
            None => NoAssets.open(name),
        }
    }
}

fn read(text: &str) -> Result<Imported, Error> {
    import(text, "s.pbrt", &NoAssets)
}

const SMALL: &str = r#"# a small scene
Film "rgb" "integer xresolution" 64 "integer yresolution" [ 32 ]
PixelFilter "box"
LookAt 0 1 5  0 1 0  0 1 0
Camera "perspective" "float fov" 40
Integrator "path" "integer maxdepth" 7
WorldBegin
Texture "checks" "spectrum" "checkerboard" "rgb tex1" [1 0 0] "float uscale" 4
MakeNamedMaterial "Wall" "string type" "diffuse" "texture reflectance" "checks"
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [1 1 1] "rgb sigma_s" [3 1 0] "float scale" 0.5 "float g" 0.25
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [17 12 4] "float scale" 2 "bool twosided" true
  Translate 1 2 3
  Scale 2 2 2
  Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2]
AttributeEnd
NamedMaterial "Wall"
Shape "sphere" "float radius" 0.5
Material "conductor" "float roughness" 0.04 "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k"
AttributeBegin
  MediumInterface "fog" ""
  ReverseOrientation
  Shape "disk" "float radius" 3 "float height" 1
AttributeEnd
ObjectBegin "Thing"
  Shape "cylinder" "float zmax" 4
ObjectEnd
Rotate 90 0 1 0
ObjectInstance "Thing"
LightSource "spot" "rgb I" [8 4 2] "point3 from" [0 4 0] "point3 to" [0 0 0] "float coneangle" 20 "float conedeltaangle" 5
LightSource "infinite" "rgb L" [0.5 0.5 0.5]
"#;

#[test]
fn a_small_scene_comes_out_as_written() {
    let Imported { description: scene, report, .. } = read(SMALL).unwrap();
    let Camera::Perspective(camera) = &scene.camera else { panic!("{:?}", scene.camera) };
    assert_eq!((scene.film.width, scene.film.height, scene.film.filter), (64, 32, Filter::Box));
    // 40 degrees span the shorter side, the height.
    let vertical = 2.0 * libm::atan(libm::tan((camera.fov * 0.5).to_radians()) * 0.5).to_degrees();
    assert!((vertical - 40.0).abs() < 1e-9, "{vertical}");
    let matrix = camera.to_world.matrix();
    // pbrt's world is left-handed: who looks along −Z there with +Y up has −X at the right hand, and X of our frame points to the left.
    let (left, sight) = (matrix.transform_vector3(DVec3::X), matrix.transform_vector3(DVec3::Z));
    assert!((left - DVec3::X).length() < 1e-9 && (sight - DVec3::NEG_Z).length() < 1e-9, "{left} {sight}");
    assert_eq!(scene.integrator.max_depth, 8);
    assert_eq!(scene.shapes.len(), 4);
    let lamp = &scene.shapes[0];
    let emission = lamp.emission.as_ref().unwrap();
    assert_eq!((&emission.radiance, emission.two_sided), (&Colour([34.0, 24.0, 8.0]).into(), true));
    let moved = lamp.to_world.matrix().transform_point3(DVec3::ONE);
    assert!((moved - DVec3::new(3.0, 4.0, 5.0)).length() < 1e-12, "{moved}");
    assert_eq!(scene.shapes[1].material.as_deref(), Some("Wall"));
    let Material::Diffuse(wall) = &scene.materials["Wall"] else { panic!("{:?}", scene.materials) };
    assert_eq!(wall.reflectance, Input::Texture("checks".to_string()));
    let Texture::Checkerboard(checks) = &scene.textures["checks"] else { panic!("{:?}", scene.textures) };
    assert_eq!((checks.uv.scale, &checks.color1), ([2.0, 0.5], &Colour::grey(0.0).into()));
    let Material::Conductor(gold) = &scene.materials["conductor"] else { panic!("{:?}", scene.materials) };
    assert_eq!(
        (gold.roughness.constant(), gold.index_of_refraction()),
        (Some(&0.2), Some(crate::scene::description::Metal::Au.index_of_refraction()))
    );
    let disk = &scene.shapes[2];
    assert_eq!((disk.interior.as_deref(), disk.exterior.as_deref(), disk.flip_normals), (Some("fog"), None, true));
    assert!((disk.to_world.matrix().transform_point3(DVec3::X) - DVec3::new(3.0, 0.0, 1.0)).length() < 1e-12);
    let Medium::Homogeneous(fog) = &scene.media["fog"];
    assert_eq!((fog.extinction, fog.albedo), (Colour([2.0, 1.0, 0.5]), Colour([0.75, 0.5, 0.0])));
    let thing = &scene.shapes[3];
    assert!(matches!(&thing.geometry, Geometry::Instance(instance) if instance.of == "Thing"));
    assert!((thing.to_world.matrix().transform_point3(DVec3::Z) - DVec3::X).length() < 1e-12);
    assert_eq!(scene.groups["Thing"].len(), 1);
    let [Light::Spot(spot)] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    // The spot stands in the turned frame, on its axis.
    assert_eq!((spot.position, spot.outer_angle, spot.inner_angle, spot.falloff), ([0.0, 4.0, 0.0], 20.0, 15.0, Falloff::Smoothstep));
    assert_eq!(scene.environment.as_ref().unwrap().radiance, Some(Colour::grey(0.5)));
    assert_eq!(report, [""; 0], "nothing here is approximated");
    assert_eq!(SceneDescription::from_json(&scene.to_json(), "s.json").unwrap(), scene);
}

#[test]
fn faults_are_named() {
    let faults = [
        ("PixelFilter \"box\"", "PixelFiltre \"box\"", &["s.pbrt:3:1", "PixelFiltre", "directive"][..]),
        ("\"float fov\" 40", "\"float fov\" 400", &["s.pbrt:5:1", "fov 400"]),
        ("LookAt 0 1 5", "LookAt 0 1 0", &["s.pbrt:4:1", "LookAt", "line of sight"]),
        ("Camera \"perspective\"", "Camera \"realistic\"", &["s.pbrt:5:1", "Camera \"realistic\"", "orthographic"]),
        ("\"integer xresolution\" 64", "\"integer xresolution\" 0", &["film.width"]),
        ("\"integer maxdepth\" 7", "\"integer maxdepth\" -7", &["s.pbrt:6:", "-7", "whole numbers"]),
        ("Camera \"perspective\" \"float fov\" 40", "", &["no Camera"]),
        ("\"texture reflectance\" \"checks\"", "\"texture reflectance\" \"chess\"", &["s.pbrt:9:1", "chess", "checks"]),
        ("NamedMaterial \"Wall\"\nShape", "NamedMaterial \"Wand\"\nShape", &["s.pbrt:17:1", "Wand", "Wall"]),
        ("[0 1 2]", "[0 1 3]", &["s.pbrt:15:3", "trianglemesh", "vertex 3"]),
        ("[0 1 2]", "[0 1]", &["s.pbrt:15:3", "2 indices"]),
        ("\"float radius\" 0.5", "\"float radius\" -1", &["s.pbrt:18:1", "radius -1"]),
        ("AttributeEnd\nNamed", "Named", &["no end of an attribute block"]),
        ("AttributeBegin\n  Area", "Area", &["AttributeEnd", "without a beginning"]),
        ("ObjectInstance \"Thing\"", "ObjectInstance \"Ding\"", &["ObjectInstance \"Ding\"", "object defined above"]),
        ("ObjectEnd\nRotate 90 0 1 0\nObjectInstance \"Thing\"\n", "", &["no end of the object \"Thing\""]),
        ("MediumInterface \"fog\"", "MediumInterface \"smog\"", &["smog", "medium"]),
        ("Scale 2 2 2", "Scale 2 2 two", &["s.pbrt:14:", "two", "finite numbers"]),
        ("[17 12 4]", "[17 12]", &["2 numbers", "3 numbers"]),
        ("WorldBegin", "WorldBegin Include \"../other.pbrt\"", &["../other.pbrt"]),
        ("Shape \"sphere\"", "Shape \"plymesh\" \"string filename\" \"/etc/passwd\" #", &["/etc/passwd"]),
    ];
    for (good, bad, parts) in faults {
        assert!(SMALL.contains(good), "{good} does not stand in the scene");
        let message = read(&SMALL.replacen(good, bad, 1)).expect_err(bad).to_string();
        for part in parts {
            assert!(message.contains(part), "{bad}\n  gave: {message}\n  without: {part}");
        }
    }
}

#[test]
fn includes_are_read_in_their_place_and_never_in_a_circle() {
    let scene = "Camera \"perspective\"\nWorldBegin\nInclude \"ball.pbrt\"\nShape \"sphere\"";
    let files = |ball: &str| Files(BTreeMap::from([("ball.pbrt", ball.to_string())]));
    let imported = import(scene, "s.pbrt", &files("Scale 2 2 2\nShape \"sphere\" \"float spin\" 3")).unwrap();
    assert_eq!(imported.description.shapes.len(), 2);
    assert_eq!(imported.description.shapes[1].to_world.matrix().x_axis.x, 2.0, "what an include sets stays set");
    assert_eq!(imported.report, ["ball.pbrt, line 2, Shape \"sphere\": the parameter \"float spin\" is left out"]);
    let circle = import(scene, "s.pbrt", &files("Include \"ball.pbrt\"")).unwrap_err().to_string();
    assert!(circle.contains("ball.pbrt:1:1") && circle.contains("16 deep"), "{circle}");
    // Ten files in each of fifteen files and so on: stopped by number, not by patience.
    let bomb = import(scene, "s.pbrt", &files(&"Include \"empty.pbrt\"\n".repeat(20_000))).unwrap_err().to_string();
    assert!(bomb.contains("empty.pbrt"), "{bomb}");
}

#[test]
fn handedness_power_and_exposure() {
    let scene = |light: &str, shape: &str| {
        read(&format!("Film \"rgb\" \"float iso\" 200 Camera \"perspective\" \"float shutterclose\" 0.25 WorldBegin\n{light} {shape}"))
            .unwrap()
            .description
    };
    // Half the exposure halves all light.
    let lit = scene("AreaLightSource \"diffuse\" \"rgb L\" [4 4 4]", "Shape \"disk\"");
    assert_eq!(lit.shapes[0].emission.as_ref().unwrap().radiance, Colour::grey(2.0).into());
    // A lamp of 8 W, at half exposure, of 2 m²: power / (π · area).
    let square = "Shape \"bilinearmesh\" \"point3 P\" [-1 0 -0.5 1 0 -0.5 -1 0 0.5 1 0 0.5]";
    let lamp = scene("AreaLightSource \"diffuse\" \"float power\" 8", &format!("Scale 1 1 -1 {square}"));
    let Input::Constant(radiance) = lamp.shapes[0].emission.as_ref().unwrap().radiance else { panic!("{lamp:?}") };
    assert!((radiance.0[1] - 2.0 * 4.0 / (2.0 * std::f64::consts::PI)).abs() < 1e-6, "two triangles, a light each: {radiance:?}");
    let black_body = scene("LightSource \"point\" \"blackbody I\" 3000 \"float power\" 100", "Shape \"sphere\"");
    let [Light::Point(point)] = &black_body.lights[..] else { panic!("{black_body:?}") };
    let luminance = spectrum::luminance(point.intensity);
    assert!((luminance - 50.0 / (4.0 * std::f64::consts::PI)).abs() < 1e-3, "{luminance}");
    assert!(point.intensity.0[0] > point.intensity.0[2], "3000 K is warm");
}

#[test]
fn normals_decide_which_side_is_the_front() {
    let mesh = |normal: &str| {
        let scene = format!(
            "Camera \"perspective\" WorldBegin Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal N\" [{}]",
            normal.repeat(3)
        );
        let Geometry::Mesh(mesh) = read(&scene).unwrap().description.shapes[0].geometry.clone() else { panic!("no mesh") };
        mesh.indices[0]
    };
    assert_eq!(mesh("0 0 1 "), [0, 1, 2]);
    assert_eq!(mesh("0 0 -1 "), [0, 2, 1]);
}

#[test]
fn whole_scenes_are_read_where_they_are_at_hand() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes");
    for (name, shapes) in [("cornell-box", 8), ("veach-ajar", 20), ("veach-bidir", 14), ("veach-mis", 6), ("water-caustic", 7)] {
        let file = folder.join(name).join("pbrt/scene-v4.pbrt");
        if !file.is_file() {
            continue;
        }
        let loaded = load(&file).unwrap_or_else(|fault| panic!("{fault}"));
        let found = loaded.description.shapes.len();
        assert!(found >= shapes, "{name} has {found} shapes");
        assert!(loaded.description.shapes.iter().any(|shape| shape.emission.is_some()), "{name} has no light");
        if let Err(fault) = Scene::compile(&loaded.description, &loaded.assets) {
            assert_eq!(fault.kind, ErrorKind::Unsupported, "{}: {fault}", file.display());
        }
    }
}

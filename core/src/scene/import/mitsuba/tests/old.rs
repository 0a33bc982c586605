//! Scenes of Mitsuba 0.x.

use super::*;
use crate::scene::description::{Filter, FovAxis, Texture};

const OLD: &str = include_str!("old.xml");
const PAIR: Files = Files(&[("m.serialized", include_bytes!("pair.serialized"))]);

#[test]
fn an_old_scene_comes_out_in_todays_words() {
    let imported = super::super::import(OLD, "s.xml", &PAIR).unwrap();
    let (scene, report) = (imported.description, imported.report);
    assert_eq!((scene.integrator.max_depth, scene.integrator.roulette_depth), (12, 7));
    let Camera::Perspective(camera) = &scene.camera else { panic!("{:?}", scene.camera) };
    assert_eq!((camera.fov, camera.fov_axis), (35.0, FovAxis::Smaller));
    assert!(camera.to_world.matrix().determinant() < 0.0, "the mirrored picture stays mirrored");
    assert!(matches!(scene.film.filter, Filter::Tent(tent) if tent.radius == 1.0));
    let Material::Conductor(copper) = &scene.materials["Copper"] else { panic!() };
    assert_eq!((copper.metal, copper.two_sided), (Some(Metal::Cu), false), "copper is what says nothing");
    let Material::Dielectric(glass) = &scene.materials["Glass"] else { panic!() };
    assert_eq!((glass.interior_ior, glass.exterior_ior), (1.5, 1.000277));
    let Material::Phong(phong) = &scene.materials["Shiny"] else { panic!() };
    let Colour([r, g, b]) = *phong.diffuse.constant().unwrap();
    assert!((r - 0.215_861).abs() < 1e-4 && (g - 0.051_269).abs() < 1e-4 && (b - 0.014_444).abs() < 1e-4, "{r} {g} {b}");
    // A quarter of the floor, half copper, the rest black.
    let Material::Blend(blend) = &scene.materials["Half (v turned round)"] else { panic!() };
    assert_eq!((blend.second.as_str(), &blend.weight), ("Floor (v turned round)", &0.25.into()), "{blend:?}");
    // The image times one half, its four fields by two; turned round for the rectangle, which is no OBJ file.
    let Texture::Product(dark) = &scene.textures["Dark"] else { panic!() };
    assert_eq!(dark.first, Colour::grey(0.5).into());
    let image = |name: &str| match &scene.textures[name] {
        Texture::Product(product) => match &scene.textures[product.second.texture().unwrap()] {
            Texture::Bitmap(bitmap) => bitmap.clone(),
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    };
    assert_eq!((image("Dark").uv.scale, image("Dark").uv.offset), ([4.0, 2.0], [0.0, -1.0]));
    assert_eq!((image("Dark (v turned round)").uv.scale, image("Dark (v turned round)").uv.offset), ([4.0, -2.0], [0.0, 1.0]));
    assert_eq!(scene.shapes[1].material.as_deref(), Some("Floor (v turned round)"));
    assert!(matches!(&scene.shapes[0].geometry, Geometry::Obj(mesh) if mesh.file == "models/floor.obj"));
    // One mesh of two, as a file that the importer made.
    assert!(matches!(&scene.shapes[3].geometry, Geometry::Ply(mesh) if mesh.file == "m.serialized.1.ply"));
    assert_eq!(imported.made.keys().collect::<Vec<_>>(), ["m.serialized.1.ply"]);
    // Sun and sky of one day are one environment.
    let sky = scene.environment.as_ref().unwrap().sky.as_ref().unwrap();
    assert_eq!((sky.sky_scale, sky.sun_scale, sky.turbidity), (0.5, 1.0, 4.0));
    for part in ["ldrfilm", "strict_normals", "sky model", "Windows"] {
        assert!(report.iter().any(|line| line.contains(part)), "{part} is not in {report:#?}");
    }
    assert_eq!(SceneDescription::from_json(&scene.to_json(), "s.json").unwrap(), scene);
}

#[test]
fn both_generations_say_the_same_thing() {
    let new = r#"<sensor type="thinlens"><float name="fov" value="40"/><float name="aperture_radius" value="0.1"/>
        <float name="focus_distance" value="2"/><transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
        <film type="hdrfilm"><rfilter type="box"/></film></sensor><integrator type="path"><integer name="max_depth" value="5"/></integrator>
        <shape type="sphere"><bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.1, 0.2, 0.3"/><float name="int_ior" value="1.6"/>
        <float name="ext_ior" value="1"/></bsdf></shape>"#;
    let mut old = new.to_string();
    for (today, then) in [
        ("aperture_radius", "apertureRadius"),
        ("focus_distance", "focusDistance"),
        ("to_world", "toWorld"),
        ("lookat", "lookAt"),
        ("max_depth", "maxDepth"),
        ("diffuse_reflectance", "diffuseReflectance"),
        ("int_ior", "intIOR"),
        ("ext_ior", "extIOR"),
    ] {
        old = old.replace(today, then);
    }
    let read = |version: &str, text: &str| import(&format!("<scene version=\"{version}\">{text}</scene>"), "s.xml").unwrap();
    let (expected, _) = read("3.0.0", new);
    for version in ["0.5.0", "0.6.0"] {
        let (scene, report) = read(version, &old);
        assert_eq!((scene, report.len()), (expected.clone(), 0), "{report:?}");
    }
}

#[test]
fn what_old_scenes_say_beyond_knowledge_is_noted() {
    let (_, report) = import(&around_old("<shape type=\"sphere\"><float name=\"kdMaxDepth\" value=\"3\"/></shape>"), "s.xml").unwrap();
    assert!(report.iter().any(|line| line.contains("kd_max_depth") && line.contains("not known here")), "{report:?}");
    let error = import(&around("<shape type=\"sphere\"><float name=\"kd_max_depth\" value=\"3\"/></shape>"), "s.xml").unwrap_err();
    assert!(error.to_string().contains("cannot honour"), "{error}");
}

/// The same scene in both generations: the same pictures, but for its larger film and longer paths.
#[test]
fn the_cornell_box_is_the_same_in_both_generations_where_it_is_at_hand() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes/cornell-box");
    if !folder.is_dir() {
        return;
    }
    let (new, old) = (load(folder.join("scene.xml")).unwrap().description, load(folder.join("mitsuba05.xml")).unwrap().description);
    let bare = |scene: &SceneDescription| {
        let shapes = scene.shapes.iter().map(|shape| {
            let reflectance = match &scene.materials[shape.material.as_ref().unwrap()] {
                Material::Diffuse(diffuse) => diffuse.reflectance.clone(),
                other => panic!("{other:?}"),
            };
            (shape.geometry.clone(), shape.to_world.matrix(), shape.emission.clone(), reflectance)
        });
        shapes.collect::<Vec<_>>()
    };
    assert_eq!(bare(&new), bare(&old));
    assert_eq!(new.camera, old.camera);
}

#[test]
fn animations_move_what_they_stand_in() {
    let animation = |more: &str| {
        format!(
            "<animation name=\"toWorld\"><transform time=\"0\">{more}<translate x=\"1\"/></transform>\
             <transform time=\"2\">{more}<rotate y=\"1\" angle=\"90\"/><translate x=\"3\"/></transform></animation>"
        )
    };
    let text = |inside: &str| {
        format!(
            "<scene version=\"0.6.0\"><sensor type=\"perspective\">{}<film type=\"hdrfilm\"/><float name=\"shutterClose\" value=\"1\"/></sensor>{inside}</scene>",
            animation("")
        )
    };
    let inside = format!(
        "<shape type=\"rectangle\">{}<emitter type=\"area\"/></shape><emitter type=\"spot\">{}</emitter>",
        animation("<scale value=\"2\"/>"),
        animation("")
    );
    let imported = super::super::import(&text(&inside), "s.xml", &PAIR).unwrap();
    let still = imported.description.at(1.0).unwrap();
    // Half-way: turned by 45° about +Y, moved by 2. A corner of the square, twice as large: (2, 2, 0).
    let half = 0.5f64.sqrt();
    let corner = still.shapes[0].to_world.matrix().transform_point3(glam::DVec3::new(1.0, 1.0, 0.0));
    assert!((corner - glam::DVec3::new(2.0 + 2.0 * half, 2.0, -2.0 * half)).length() < 1e-9, "{corner}");
    let sight = still.camera.to_world().matrix().transform_vector3(glam::DVec3::Z);
    assert!((sight - glam::DVec3::new(half, 0.0, half)).length() < 1e-9, "{sight}");
    let place = still.lights[0].to_world().matrix().w_axis.truncate();
    assert!((place - glam::DVec3::new(2.0, 0.0, 0.0)).length() < 1e-9, "{place}");
    assert_eq!(imported.description.animation.as_ref().unwrap().span(), Some([0.0, 2.0]));
    assert!(imported.report.iter().any(|line| line.contains("shutter")), "{:?}", imported.report);
    for (from, to, words) in [
        ("time=\"2\"", "time=\"0\"", "each later than the one before"),
        ("<transform time=\"0\">", "<transform>", "no attribute `time`"),
        ("type=\"spot\"", "type=\"sky\"", "a to_world that does not move"),
    ] {
        let error = super::super::import(&text(&inside).replacen(from, to, 1), "s.xml", &PAIR).unwrap_err().to_string();
        assert!(error.contains(words), "{error}\nlacks {words}");
    }
}

//! Imports of small scenes written here, and of whole scenes where they are at hand.

use super::*;
use crate::scene::description::{Colour, Geometry, Material, Metal, Normals};
use crate::scene::limits;
use crate::scene::{NoAssets, load};

fn import(text: &str, file: &str) -> Result<(SceneDescription, Vec<String>), Error> {
    super::import(text, file, &NoAssets).map(|imported| (imported.description, imported.report))
}

mod coverage;
mod light;
mod mapping;
mod mutations;
mod old;

/// A scene with nothing but a camera, and what is put into it.
fn around(inner: &str) -> String {
    format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/>\
         <film type=\"hdrfilm\"><rfilter type=\"box\"/></film></sensor>\
         <integrator type=\"path\"><integer name=\"max_depth\" value=\"4\"/></integrator>\n{inner}\n</scene>"
    )
}

/// The same for the generation 0.x.
fn around_old(inner: &str) -> String {
    around(inner).replace("3.0.0", "0.6.0")
}

/// Files in memory.
struct Files(&'static [(&'static str, &'static [u8])]);

impl Assets for Files {
    fn open(&self, name: &str) -> Result<Vec<u8>, Error> {
        let found = self.0.iter().find(|(file, _)| *file == name).map(|(_, bytes)| bytes.to_vec());
        found.ok_or_else(|| Error::new(ErrorKind::Unreadable, name, "", "no such file", "a readable file"))
    }
}

const SMALL: &str = r#"<!-- a comment -->
<scene version="3.0.0">
    <default name="size" value="32"/>
    <default name="depth" value="8"/>
    <integrator type="path"><integer name="max_depth" value="$depth"/></integrator>
    <sensor type="thinlens">
        <string name="fov_axis" value="larger"/>
        <float name="fov" value="40"/>
        <float name="aperture_radius" value="0.1"/>
        <float name="focus_distance" value="4"/>
        <transform name="to_world"><lookat origin="0, 1, 5" target="0 1 0" up="0, 1, 0"/></transform>
        <sampler type="independent"><integer name="sample_count" value="64"/></sampler>
        <film type="hdrfilm"><integer name="width" value="$size"/><integer name="height" value="24"/><rfilter type="box"/></film>
    </sensor>
    <bsdf type="twosided" id="Wall"><bsdf type="diffuse"><rgb name="reflectance" value="0.1, 0.2, 0.3"/></bsdf></bsdf>
    <bsdf type="roughdielectric" id="Ice">
        <string name="int_ior" value="water ice"/><float name="ext_ior" value="1"/>
        <string name="distribution" value="ggx"/><float name="alpha" value="0.3"/>
    </bsdf>
    <shape type="rectangle" id="Lamp">
        <transform name="to_world"><scale x="2"/><rotate x="1" angle="90"/><translate y="3"/></transform>
        <ref id="Wall"/>
        <emitter type="area"><rgb name="radiance" value="17, 12, 4"/></emitter>
    </shape>
    <shape type="sphere">
        <point name="center" x="1" y="2" z="3"/><float name="radius" value="0.5"/>
        <bsdf type="roughconductor">
            <string name="material" value="Au"/><string name="distribution" value="ggx"/><float name="alpha" value="0.2"/>
        </bsdf>
    </shape>
    <shape type="obj"><string name="filename" value="models/a.obj"/><ref id="Ice"/></shape>
    <shape type="cube"/>
    <emitter type="constant"><float name="radiance" value="0.5"/></emitter>
</scene>
"#;

#[test]
fn a_small_scene_comes_out_as_written() {
    let (scene, report) = import(SMALL, "dir/s.xml").unwrap();
    let Camera::Perspective(camera) = &scene.camera else { panic!("{:?}", scene.camera) };
    assert_eq!((camera.fov, camera.lens_radius, camera.focus_distance), (40.0, 0.1, 4.0));
    assert_eq!(camera.fov_axis, crate::scene::description::FovAxis::Larger);
    assert_eq!((scene.film, scene.integrator.max_depth), (Film::new(32, 24), 8));
    assert_eq!(scene.shapes.iter().map(|shape| shape.name.as_str()).collect::<Vec<_>>(), ["Lamp", "", "", ""]);
    assert_eq!(scene.shapes[0].emission.as_ref().unwrap().radiance, Colour([17.0, 12.0, 4.0]).into());
    let moved = scene.shapes[0].to_world.matrix().transform_point3(glam::DVec3::new(1.0, 1.0, 0.0));
    assert!((moved - glam::DVec3::new(2.0, 3.0, 1.0)).length() < 1e-12, "{moved}");
    let Material::Conductor(gold) = &scene.materials[scene.shapes[1].material.as_ref().unwrap()] else { panic!("no conductor") };
    assert_eq!((gold.metal, &gold.roughness, gold.two_sided), (Some(Metal::Au), &0.2.into(), false));
    let Material::Dielectric(ice) = &scene.materials["Ice"] else { panic!("no dielectric") };
    assert_eq!((ice.interior_ior, ice.exterior_ior, &ice.roughness), (1.31, 1.0, &0.3.into()));
    let Geometry::Obj(mesh) = &scene.shapes[2].geometry else { panic!("no mesh") };
    assert_eq!((mesh.file.as_str(), mesh.normals), ("models/a.obj", Normals::Smooth));
    assert_eq!(scene.materials["default of shapes without a bsdf"], bsdf::default_material());
    assert!(matches!(&scene.materials["Wall"], Material::Diffuse(wall) if wall.two_sided));
    assert_eq!(scene.environment.as_ref().unwrap().radiance, Some(Colour::grey(0.5)));
    assert_eq!(report, ["line 12, <sampler type=\"independent\">: left aside: samples are chosen for each job"]);
    // What was imported is a native scene like any other.
    assert_eq!(SceneDescription::from_json(&scene.to_json(), "s.json").unwrap(), scene);
}

/// (what stands in `SMALL`, what to put there, parts of the message)
const FAULTS: &[(&str, &str, &[&str])] = &[
    ("version=\"3.0.0\"", "version=\"1.5.0\"", &["s.xml:2:1: at <scene>", "\"1.5.0\"", "3.0.0"]),
    ("type=\"path\"", "type=\"guess\"", &["s.xml:5:5: at <integrator type=\"guess\">", "expected path"]),
    ("$depth", "$deep", &["s.xml:5:", "$deep", "$depth, $size"]),
    ("value=\"$depth\"", "value=\"many\"", &["s.xml:5:", "max_depth", "\"many\"", "a whole number"]),
    ("value=\"$depth\"", "value=\"-7\"", &["s.xml:5:", "integrator.max_depth", "1 to"]),
    ("\"larger\"", "\"slanted\"", &["s.xml:6:", "slanted", "x, y, diagonal, smaller or larger"]),
    ("name=\"focus_distance\"", "name=\"focus\"", &["at <sensor type=\"thinlens\">", "no focus_distance"]),
    ("value=\"$size\"", "value=\"0\"", &["s.xml:6:", "film.width", "found 0"]),
    ("up=\"0, 1, 0\"", "up=\"0, 0, 1\"", &["s.xml:6:", "camera.perspective.to_world", "line of sight"]),
    ("type=\"hdrfilm\"", "type=\"specfilm\"", &["<film type=\"specfilm\">", "hdrfilm"]),
    ("<rfilter type=\"box\"/>", "<integer name=\"crop_height\" value=\"300\"/>", &["s.xml:6:", "film.crop", "300"]),
    (
        "<rgb name=\"reflectance\" value=\"0.1, 0.2, 0.3\"/>",
        "<texture name=\"reflectance\" type=\"bitmap\"/>",
        &["s.xml:15:", "<texture type=\"bitmap\" name=\"reflectance\">", "no filename"],
    ),
    ("bsdf type=\"diffuse\"", "bsdf type=\"hair\"", &["s.xml:15:", "<bsdf type=\"hair\">", "diffuse, roughdiffuse"]),
    ("0.1, 0.2, 0.3", "0.1, 0.2", &["s.xml:15:", "2 numbers", "1 or 3"]),
    ("0.1, 0.2, 0.3", "0.1, 0.2, 1.3", &["s.xml:15:", "materials.Wall", "0 to 1"]),
    ("value=\"water ice\"", "value=\"lemonade\"", &["s.xml:16:", "int_ior \"lemonade\"", "diamond"]),
    (
        "value=\"ggx\"/><float name=\"alpha\" value=\"0.3\"",
        "value=\"cosine\"/><float name=\"alpha\" value=\"0.3\"",
        &["s.xml:16:", "the distribution cosine", "expected beckmann or ggx"],
    ),
    ("<ref id=\"Wall\"/>", "<ref id=\"Wand\"/>", &["s.xml:22:", "<ref id=\"Wand\">", "Ice, Lamp, Wall"]),
    ("<ref id=\"Wall\"/>", "<ref id=\"Wall\"/><ref id=\"Ice\"/>", &["s.xml:16:", "a second bsdf"]),
    ("type=\"area\"", "type=\"spot\"", &["s.xml:23:", "<emitter type=\"spot\">", "expected area"]),
    ("<rotate x=\"1\" angle=\"90\"/>", "<shear/>", &["s.xml:21:", "<shear>"]),
    ("value=\"Au\"", "value=\"Xx\"", &["s.xml:27:", "\"Xx\"", "Au"]),
    ("name=\"radius\" value=\"0.5\"", "name=\"radius\" value=\"0\"", &["s.xml:25:", "shapes[1].geometry.sphere.radius", "found 0"]),
    ("name=\"radius\"", "name=\"radios\"", &["s.xml:26:", "name=\"radios\"", "cannot honour"]),
    ("models/a.obj", "../a.obj", &["s.xml:31:", "shapes[2].geometry.obj.file", "../a.obj"]),
    ("type=\"cube\"", "type=\"hair\"", &["s.xml:32:", "<shape type=\"hair\">", "rectangle"]),
    ("type=\"constant\"", "type=\"envmap\"", &["s.xml:33:", "<emitter type=\"envmap\">", "no filename"]),
    ("<shape type=\"cube\"/>", "<subsurface/>", &["s.xml:32:", "<subsurface>"]),
    ("id=\"Ice\">", "id=\"Wall\">", &["s.xml:16:", "\"Wall\" twice"]),
    ("</scene>", "", &["no end of it", "</scene>"]),
];

#[test]
fn what_cannot_be_honoured_is_named_with_its_line() {
    for (good, bad, parts) in FAULTS {
        assert!(SMALL.contains(good), "{good} does not stand in the scene");
        let message = import(&SMALL.replacen(good, bad, 1), "s.xml").expect_err(bad).to_string();
        for part in *parts {
            assert!(message.contains(part), "{bad}\n  gave: {message}\n  without: {part}");
        }
    }
}

#[test]
fn what_only_says_how_mitsuba_works_is_reported() {
    let changed = SMALL
        .replace("<rfilter type=\"box\"/>", "<rfilter type=\"gaussian\"/><string name=\"pixel_format\" value=\"luminance\"/>")
        .replace("<integer name=\"max_depth\" value=\"$depth\"/>", "")
        .replace("<float name=\"fov\"", "<float name=\"near_clip\" value=\"1\"/><float name=\"fov\"")
        .replace("<scale x=\"2\"/>", "<scale x=\"-2\"/>");
    let (scene, report) = import(&changed, "s.xml").unwrap();
    assert_eq!(scene.integrator.max_depth, limits::PATH_EDGES);
    assert!(matches!(scene.film.filter, crate::scene::description::Filter::Gaussian(_)));
    for part in ["pixel_format luminance", "paths of any length", "near_clip"] {
        assert!(report.iter().any(|line| line.contains(part)), "{part} is not in {report:?}");
    }
}

/// What the renderer cannot do yet is its own matter: here all that the scenes say must arrive.
#[test]
fn whole_scenes_are_read_where_they_are_at_hand() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes");
    let scenes = [
        ("cornell-box/scene.xml", 8),
        ("cornell-box/mitsuba05.xml", 8),
        ("door-simple/scene.xml", 13),
        ("veach-ajar/scene.xml", 22),
        ("veach-mis/scene.xml", 9),
        ("glossy-counter/scene.xml", 16),
        ("classroom/scene.xml", 79),
        ("veach-bidir/scene.xml", 14),
        ("water-caustic/scene.xml", 10),
        ("sds-pool/scene.xml", 8),
        ("medium-glass/scene.xml", 8),
        ("fog-beam/scene.xml", 6),
    ];
    for (name, shapes) in scenes {
        let file = folder.join(name);
        if !file.is_file() {
            continue;
        }
        let loaded = load(&file).unwrap();
        assert_eq!(loaded.description.shapes.len(), shapes, "{name}");
        for asset in loaded.description.assets() {
            loaded.assets.open(&asset).unwrap();
        }
    }
}

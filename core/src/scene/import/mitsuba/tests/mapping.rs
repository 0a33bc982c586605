//! Surfaces, textures, shapes and media: each mapping with its numbers.

use super::*;
use crate::scene::description::{
    Channels, ColourInput, Crop, Distribution, Encoding, Filter, FovAxis, Instance, Medium, Phase, ScalarInput, Texture, TextureFilter,
    Wrap,
};

/// The scene around `inner`, with its report.
fn read(inner: &str) -> (SceneDescription, Vec<String>) {
    import(&around(inner), "s.xml").unwrap()
}

/// The material of a sphere with this bsdf.
fn material(bsdf: &str) -> (Material, Vec<String>, SceneDescription) {
    let (scene, report) = read(&format!("<shape type=\"sphere\">{bsdf}</shape>"));
    (scene.materials[scene.shapes[0].material.as_ref().unwrap()].clone(), report, scene)
}

#[test]
fn plain_surfaces() {
    let (Material::Diffuse(grey), ..) = material("<bsdf type=\"diffuse\"/>") else { panic!() };
    assert_eq!((grey.reflectance, grey.two_sided), (ColourInput::grey(0.5), false));
    let (Material::Conductor(mirror), ..) = material("<bsdf type=\"conductor\"/>") else { panic!() };
    assert_eq!((mirror.eta, mirror.k, mirror.roughness), (Some(Colour::grey(0.0)), Some(Colour::WHITE), ScalarInput::zero()));
    let (Material::Conductor(metal), ..) = material(
        "<bsdf type=\"roughconductor\"><string name=\"material\" value=\"Ag\"/><float name=\"alpha_u\" value=\"0.1\"/>\
         <float name=\"alpha_v\" value=\"0.3\"/><rgb name=\"specular_reflectance\" value=\".9 .8 .7\"/></bsdf>",
    ) else {
        panic!()
    };
    assert_eq!((metal.metal, metal.distribution), (Some(Metal::Ag), Distribution::Beckmann), "Beckmann is Mitsuba's default");
    assert_eq!((metal.roughness, metal.roughness_v), (0.1.into(), Some(0.3.into())));
    assert_eq!(metal.reflectance, Colour([0.9, 0.8, 0.7]).into());
    let (Material::Plastic(plastic), ..) = material(
        "<bsdf type=\"roughplastic\"><boolean name=\"nonlinear\" value=\"true\"/><string name=\"int_ior\" value=\"acrylic glass\"/>\
         <string name=\"distribution\" value=\"ggx\"/><float name=\"alpha\" value=\"0.25\"/></bsdf>",
    ) else {
        panic!()
    };
    assert_eq!((plastic.interior_ior, plastic.exterior_ior, plastic.nonlinear), (1.49, 1.000277, true));
    assert_eq!((plastic.roughness, plastic.distribution, plastic.diffuse), (0.25.into(), Distribution::Ggx, ColourInput::grey(0.5)));
    let (Material::Dielectric(sheet), ..) = material("<bsdf type=\"thindielectric\"/>") else { panic!() };
    assert!(sheet.thin && sheet.interior_ior == 1.5046);
    assert_eq!(material("<bsdf type=\"null\"/>").0, Material::Null);
}

#[test]
fn surfaces_made_of_others() {
    let (Material::TwoSided(sides), _, scene) =
        material("<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/><bsdf type=\"conductor\"/></bsdf>")
    else {
        panic!()
    };
    assert!(
        matches!(scene.materials[&sides.front], Material::Diffuse(_)) && matches!(scene.materials[&sides.back], Material::Conductor(_))
    );
    // One plain surface on both sides needs no material around it.
    let (Material::Diffuse(both), _, scene) = material("<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf>") else { panic!() };
    assert!(both.two_sided && scene.materials.len() == 1);
    let (Material::Mask(mask), _, scene) = material(
        "<bsdf type=\"mask\"><float name=\"opacity\" value=\"0.25\"/><bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf></bsdf>",
    ) else {
        panic!()
    };
    assert!(mask.opacity == 0.25.into() && matches!(&scene.materials[&mask.material], Material::Diffuse(inner) if inner.two_sided));
    let (Material::Blend(blend), ..) = material(
        "<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.75\"/><bsdf type=\"diffuse\"/><bsdf type=\"dielectric\"/></bsdf>",
    ) else {
        panic!()
    };
    assert!(blend.weight == 0.75.into() && blend.first.starts_with("diffuse") && blend.second.starts_with("dielectric"));
    let (Material::BumpMap(bumps), _, scene) = material(
        "<bsdf type=\"bumpmap\"><texture type=\"bitmap\"><string name=\"filename\" value=\"h.png\"/><boolean name=\"raw\" value=\"true\"/>\
         </texture><float name=\"scale\" value=\"3\"/><bsdf type=\"plastic\"/></bsdf>",
    ) else {
        panic!()
    };
    assert_eq!(bumps.scale, 3.0);
    assert!(matches!(&scene.textures[bumps.height.texture().unwrap()], Texture::Bitmap(image) if image.encoding == Encoding::Linear));
    let error = import(&around("<shape type=\"sphere\"><bsdf type=\"twosided\"><bsdf type=\"dielectric\"/></bsdf></shape>"), "s.xml");
    assert!(error.unwrap_err().to_string().contains("a surface that light passes"));
}

#[test]
fn principled_surfaces_are_approximated() {
    let (Material::Principled(paint), report, _) = material(
        "<bsdf type=\"principled\"><rgb name=\"base_color\" value=\"0.8 0.4 0.2\"/><float name=\"specular\" value=\"0.5\"/>\
         <float name=\"roughness\" value=\"0.3\"/><float name=\"spec_tint\" value=\"1\"/><float name=\"clearcoat\" value=\"1\"/>\
         <float name=\"clearcoat_gloss\" value=\"1\"/><float name=\"flatness\" value=\"0.5\"/></bsdf>",
    ) else {
        panic!()
    };
    assert_eq!((paint.base_color, paint.roughness, paint.thin), (Colour([0.8, 0.4, 0.2]).into(), 0.3.into(), false));
    assert!((paint.ior - 1.5).abs() < 1e-12, "half of the specular parameter is glass: {}", paint.ior);
    assert_eq!(paint.specular_color, Colour([1.0, 0.5, 0.25]).into());
    assert_eq!(paint.clearcoat, 0.25.into());
    assert!((paint.clearcoat_roughness.constant().unwrap() - 0.001f64.sqrt()).abs() < 1e-12);
    assert!(report.iter().any(|line| line.contains("approximated")) && report.iter().any(|line| line.contains("flatness")));
}

#[test]
fn textures_are_turned_round_for_shapes_that_mitsuba_does_not_turn() {
    let image = "<texture type=\"bitmap\" id=\"t\"><string name=\"filename\" value=\"t/a.png\"/><string name=\"filter_type\" value=\"nearest\"/>\
                 <string name=\"wrap_mode\" value=\"mirror\"/><transform name=\"to_uv\"><scale x=\"2\" y=\"3\"/><translate x=\"0.5\" y=\"0.25\"/>\
                 </transform></texture><bsdf type=\"diffuse\" id=\"b\"><ref name=\"reflectance\" id=\"t\"/></bsdf>";
    let (scene, _) = read(&format!(
        "{image}<shape type=\"obj\"><string name=\"filename\" value=\"a.obj\"/><ref id=\"b\"/></shape>\
         <shape type=\"obj\"><string name=\"filename\" value=\"a.obj\"/><boolean name=\"flip_tex_coords\" value=\"false\"/><ref id=\"b\"/></shape>\
         <shape type=\"cube\"><ref id=\"b\"/></shape><shape type=\"cube\"/>"
    ));
    let used: Vec<&str> = scene.shapes.iter().map(|shape| shape.material.as_deref().unwrap()).collect();
    assert_eq!(used, ["b", "b (v turned round)", "b (v turned round)", "default of shapes without a bsdf"]);
    // Mitsuba looks up row (3 v + 0.25) of the image from its top, and of OBJ files v counts from the top as well.
    let row = |name: &str, v: f64| {
        let Texture::Bitmap(image) = &scene.textures[name] else { panic!() };
        assert_eq!((image.filter, image.wrap, image.channels), (TextureFilter::Nearest, Wrap::Mirror, Channels::Rgb));
        assert_eq!((image.encoding, image.uv.rotate), (Encoding::Srgb, 0.0));
        1.0 - (image.uv.scale[1] * v + image.uv.offset[1])
    };
    for v in [0.0, 0.3, 1.0] {
        assert!((row("t", v) - (3.0 * (1.0 - v) + 0.25)).abs() < 1e-12);
        assert!((row("t (v turned round)", v) - (3.0 * v + 0.25)).abs() < 1e-12);
    }
    // Our cubes carry no texture coordinates: one with a texture is written out with Mitsuba's.
    assert!(matches!(&scene.shapes[2].geometry, Geometry::Mesh(mesh) if mesh.uvs.as_ref().is_some_and(|uvs| uvs.len() == 24)));
    assert_eq!(scene.shapes[3].geometry, Geometry::Cube);
}

#[test]
fn the_written_cube_is_the_cube() {
    let Geometry::Mesh(mesh) = super::super::cube::textured() else { panic!() };
    assert_eq!(mesh.indices.len(), 12);
    for [a, b, c] in mesh.indices {
        let [a, b, c] = [a, b, c].map(|k| glam::Vec3::from(mesh.positions[k as usize]));
        let normal = (b - a).cross(c - a);
        assert!(normal.dot(a + b + c) > 0.0 && normal.length() == 4.0, "every face looks outwards: {normal}");
    }
}

#[test]
fn checkerboards_and_vertex_colours() {
    let (scene, _) = read(
        "<shape type=\"obj\"><string name=\"filename\" value=\"a.obj\"/><bsdf type=\"roughconductor\"><texture name=\"specular_reflectance\" \
         type=\"checkerboard\"><rgb name=\"color0\" value=\".8\"/><transform name=\"to_uv\"><scale x=\"20\" y=\"80\"/></transform></texture></bsdf>\
         </shape><shape type=\"ply\"><string name=\"filename\" value=\"a.ply\"/><bsdf type=\"diffuse\"><texture name=\"reflectance\" \
         type=\"mesh_attribute\"><string name=\"name\" value=\"vertex_color\"/></texture></bsdf></shape>",
    );
    let texture = |shape: usize| {
        let material = &scene.materials[scene.shapes[shape].material.as_ref().unwrap()];
        scene.textures[material.textures()[0]].clone()
    };
    let Texture::Checkerboard(board) = texture(0) else { panic!() };
    assert_eq!((board.color0, board.color1), (ColourInput::grey(0.8), ColourInput::grey(0.2)));
    assert_eq!((board.uv.scale, board.uv.offset), ([20.0, -80.0], [0.0, 80.0]), "v of OBJ files is turned first");
    assert!(matches!(texture(1), Texture::VertexColour(colours) if colours.scale.is_white()));
}

#[test]
fn shapes_groups_and_media() {
    let (scene, report) = read(
        "<medium type=\"homogeneous\" id=\"milk\"><rgb name=\"albedo\" value=\".98 .95 .85\"/><float name=\"sigma_t\" value=\"8\"/>\
         <float name=\"scale\" value=\"0.5\"/><phase type=\"hg\"><float name=\"g\" value=\"0.5\"/></phase></medium>\
         <shape type=\"cylinder\"><point name=\"p0\" x=\"1\"/><point name=\"p1\" x=\"1\" y=\"2\"/><float name=\"radius\" value=\"0.25\"/>\
         <bsdf type=\"null\"/><ref id=\"milk\" name=\"interior\"/></shape>\
         <shape type=\"shapegroup\" id=\"g\"><shape type=\"disk\"><transform name=\"to_world\"><translate z=\"1\"/></transform></shape></shape>\
         <shape type=\"shapegroup\" id=\"h\"><shape type=\"instance\"><ref id=\"g\"/></shape></shape>\
         <shape type=\"instance\"><ref id=\"h\"/><transform name=\"to_world\"><scale value=\"2\"/></transform></shape>\
         <shape type=\"obj\"><string name=\"filename\" value=\"./a.obj\"/><boolean name=\"face_normals\" value=\"true\"/>\
         <transform name=\"to_world\"><scale x=\"-1\"/></transform></shape>",
    );
    let Geometry::Cylinder(cylinder) = scene.shapes[0].geometry else { panic!() };
    assert_eq!((cylinder.p0, cylinder.p1, cylinder.radius), ([1.0, 0.0, 0.0], [1.0, 2.0, 0.0], 0.25));
    assert_eq!((scene.shapes[0].interior.as_deref(), scene.shapes[0].exterior.as_deref()), (Some("milk"), None));
    let Medium::Homogeneous(milk) = &scene.media["milk"];
    assert_eq!((milk.extinction, milk.albedo), (Colour::grey(4.0), Colour([0.98, 0.95, 0.85])));
    assert!(matches!(milk.phase, Phase::HenyeyGreenstein(phase) if phase.g == 0.5));
    assert_eq!(scene.groups["g"][0].geometry, Geometry::Disk);
    assert_eq!(scene.groups["h"][0].geometry, Geometry::Instance(Instance { of: "g".to_string() }));
    assert_eq!(scene.shapes[1].geometry, Geometry::Instance(Instance { of: "h".to_string() }));
    assert!(scene.shapes[2].flip_normals, "a mirrored mesh of bare faces shows its back");
    assert_eq!(report, Vec::<String>::new());
}

#[test]
fn cameras_and_films() {
    let read = |kind: &str, inside: &str, film: &str| {
        let text = format!(
            "<scene version=\"3.0.0\"><sensor type=\"{kind}\">{inside}<film type=\"hdrfilm\"><integer name=\"width\" value=\"200\"/>\
             <integer name=\"height\" value=\"100\"/>{film}</film></sensor></scene>"
        );
        import(&text, "s.xml").unwrap().0
    };
    let perspective = |inside: &str| match read("perspective", inside, "").camera {
        Camera::Perspective(camera) => camera,
        other => panic!("{other:?}"),
    };
    // The numbers are Mitsuba 3.9.1's.
    let lens = perspective("<string name=\"focal_length\" value=\"50mm\"/>");
    assert!((lens.fov - 42.311_714).abs() < 1e-4 && lens.fov_axis == FovAxis::X, "{}", lens.fov);
    let diagonal = perspective("<float name=\"fov\" value=\"60\"/><string name=\"fov_axis\" value=\"diagonal\"/>");
    assert!((diagonal.fov - 54.623_459).abs() < 1e-4, "{}", diagonal.fov);
    let shifted = perspective("<float name=\"fov\" value=\"60\"/><float name=\"principal_point_offset_x\" value=\"0.1\"/>");
    assert_eq!(shifted.principal_point, [-0.1, 0.0], "the line of sight meets the film left of its centre");
    let grown =
        perspective("<float name=\"fov\" value=\"60\"/><transform name=\"to_world\"><scale value=\"3\"/><translate x=\"4\"/></transform>");
    assert!(grown.to_world.matrix().abs_diff_eq(glam::DMat4::from_translation(glam::DVec3::new(4.0, 0.0, 0.0)), 1e-12));
    let Camera::Orthographic(flat) =
        read("orthographic", "<transform name=\"to_world\"><scale x=\"2\" y=\"2\"/><translate z=\"-9\"/></transform>", "").camera
    else {
        panic!()
    };
    assert_eq!(flat.scale, 2.0);
    assert!(flat.to_world.matrix().abs_diff_eq(glam::DMat4::from_translation(glam::DVec3::new(0.0, 0.0, -9.0)), 1e-12));
    let film = read(
        "perspective",
        "",
        "<integer name=\"crop_offset_x\" value=\"50\"/><integer name=\"crop_width\" value=\"30\"/>\
                                        <rfilter type=\"catmullrom\"/>",
    )
    .film;
    assert_eq!(film.crop, Some(Crop { x: 50, y: 0, width: 30, height: 100 }));
    assert!(matches!(film.filter, Filter::Mitchell(filter) if filter.b == 0.0 && filter.c == 0.5));
    assert!(matches!(read("perspective", "", "").film.filter, Filter::Gaussian(filter) if filter.deviation == 0.5 && filter.radius == 2.0));
}

#[test]
fn aliases_includes_paths_and_what_nothing_refers_to() {
    let files = Files(&[
        (
            "parts/wood.xml",
            b"<scene version=\"0.6.0\"><bsdf type=\"plastic\" id=\"Wood\"><float name=\"intIOR\" value=\"$ior\"/></bsdf></scene>",
        ),
        ("meshes/a.obj", b""),
    ]);
    let text = around(
        "<default name=\"ior\" value=\"1.7\"/><path value=\"meshes/\"/><include filename=\"parts/wood.xml\"/><alias id=\"Wood\" as=\"Oak\"/>\
         <bsdf type=\"hair\" id=\"Idle\"/><shape type=\"obj\"><string name=\"filename\" value=\"a.obj\"/><ref id=\"Oak\"/></shape>",
    );
    let imported = super::super::import(&text, "s.xml", &files).unwrap();
    assert!(matches!(&imported.description.materials["Wood"], Material::Plastic(wood) if wood.interior_ior == 1.7));
    assert!(matches!(&imported.description.shapes[0].geometry, Geometry::Obj(mesh) if mesh.file == "meshes/a.obj"));
    assert!(!imported.description.materials.contains_key("Idle"));
    assert!(
        imported.report.iter().any(|line| line.contains("id=\"Idle\"") && line.contains("nothing refers to it")),
        "{:?}",
        imported.report
    );
    let broken = super::super::import(&text.replace("1.7", "-1"), "s.xml", &files).unwrap_err().to_string();
    assert!(broken.starts_with("parts/wood.xml:1:"), "faults name the file they stand in: {broken}");
}

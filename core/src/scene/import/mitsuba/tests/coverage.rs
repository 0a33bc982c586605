//! What becomes of each of Mitsuba's plugins, tried out; the table in `docs/formats.md` is this one.

use std::fmt::Write;

use super::*;

/// What becomes of a plugin.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Fate {
    /// It comes over as it is.
    Honoured,
    /// Something like it comes over, and the report says so.
    Approximated,
    /// An error names it.
    Refused,
}

use Fate::{Approximated, Honoured, Refused};

/// A bsdf on a sphere.
const BSDF: &str = "<shape type=\"sphere\"><bsdf type=\"PLUGIN\">INSIDE</bsdf></shape>";
const TEXTURE: &str =
    "<shape type=\"rectangle\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"PLUGIN\">INSIDE</texture></bsdf></shape>";
const SPECTRUM: &str =
    "<shape type=\"rectangle\"><bsdf type=\"diffuse\"><spectrum name=\"reflectance\" type=\"PLUGIN\">INSIDE</spectrum></bsdf></shape>";
const GLOW: &str =
    "<shape type=\"sphere\"><emitter type=\"area\"><spectrum name=\"radiance\" type=\"PLUGIN\">INSIDE</spectrum></emitter></shape>";
const EMITTER: &str = "<emitter type=\"PLUGIN\">INSIDE</emitter>";
const SHAPE: &str = "<shape type=\"PLUGIN\">INSIDE</shape>";
const MEDIUM: &str = "<shape type=\"sphere\"><medium name=\"interior\" type=\"PLUGIN\">INSIDE</medium></shape>";
const PHASE: &str =
    "<shape type=\"sphere\"><medium name=\"interior\" type=\"homogeneous\"><phase type=\"PLUGIN\">INSIDE</phase></medium></shape>";
const SENSOR: &str = "sensor";
const FILM: &str = "film";
const FILTER: &str = "rfilter";
const INTEGRATOR: &str = "integrator";

const FILE: &str = "<string name=\"filename\" value=\"a.png\"/>";
const MESH: &str = "<string name=\"filename\" value=\"a.obj\"/>";
const ONE: &str = "<bsdf type=\"diffuse\"/>";
const TWO: &str = "<bsdf type=\"diffuse\"/><bsdf type=\"conductor\"/>";
const IMAGE: &str = "<texture type=\"bitmap\"><string name=\"filename\" value=\"a.png\"/></texture><bsdf type=\"diffuse\"/>";

/// (kind, how it is written, what stands inside, plugin, generations, fate, remark)
type Row = (&'static str, &'static str, &'static str, &'static str, &'static str, Fate, &'static str);

#[rustfmt::skip]
const TABLE: &[Row] = &[
    ("bsdf", BSDF, "", "diffuse", "0.x 3", Honoured, ""),
    ("bsdf", BSDF, "", "roughdiffuse", "0.x", Approximated, "Oren and Nayar's short formula"),
    ("bsdf", BSDF, "", "conductor", "0.x 3", Honoured, "metals by name, or eta and k"),
    ("bsdf", BSDF, "", "roughconductor", "0.x 3", Honoured, "beckmann and ggx, alpha_u and alpha_v; phong as beckmann"),
    ("bsdf", BSDF, "", "dielectric", "0.x 3", Honoured, ""),
    ("bsdf", BSDF, "", "roughdielectric", "0.x 3", Honoured, "beckmann and ggx"),
    ("bsdf", BSDF, "", "thindielectric", "0.x 3", Honoured, ""),
    ("bsdf", BSDF, "", "plastic", "0.x 3", Honoured, ""),
    ("bsdf", BSDF, "", "roughplastic", "0.x 3", Honoured, ""),
    ("bsdf", BSDF, "", "principled", "3", Approximated, "by glTF's principled surface"),
    ("bsdf", BSDF, "", "principledthin", "3", Approximated, "by glTF's principled surface, as a thin wall"),
    ("bsdf", BSDF, "", "phong", "0.x", Honoured, ""),
    ("bsdf", BSDF, "", "ward", "0.x", Honoured, "other variants as the balanced one"),
    ("bsdf", BSDF, ONE, "mask", "0.x 3", Honoured, ""),
    ("bsdf", BSDF, TWO, "blendbsdf", "0.x 3", Honoured, ""),
    ("bsdf", BSDF, "<string name=\"weights\" value=\".5 .5\"/><bsdf type=\"diffuse\"/><bsdf type=\"conductor\"/>", "mixturebsdf", "0.x", Honoured, "as blends"),
    ("bsdf", BSDF, TWO, "twosided", "0.x 3", Honoured, "one surface or two"),
    ("bsdf", BSDF, IMAGE, "bumpmap", "0.x 3", Honoured, ""),
    ("bsdf", BSDF, "<texture name=\"normalmap\" type=\"bitmap\"><string name=\"filename\" value=\"a.png\"/></texture><bsdf type=\"diffuse\"/>", "normalmap", "0.x 3", Honoured, ""),
    ("bsdf", BSDF, "", "null", "0.x 3", Honoured, ""),
    ("bsdf", BSDF, ONE, "coating", "0.x", Approximated, "plastic over a diffuse surface, left out over others"),
    ("bsdf", BSDF, ONE, "roughcoating", "0.x", Approximated, "as coating"),
    ("bsdf", BSDF, "", "difftrans", "0.x", Refused, ""),
    ("bsdf", BSDF, "", "hk", "0.x", Refused, ""),
    ("bsdf", BSDF, "", "irawan", "0.x", Refused, ""),
    ("bsdf", BSDF, "", "hair", "3", Refused, ""),
    ("bsdf", BSDF, "", "measured", "3", Refused, ""),
    ("bsdf", BSDF, "", "pplastic", "3", Refused, "polarised"),
    ("texture", TEXTURE, FILE, "bitmap", "0.x 3", Honoured, "to_uv without shear; uscale and its kin of 0.x"),
    ("texture", TEXTURE, "", "checkerboard", "0.x 3", Honoured, ""),
    ("texture", TEXTURE, "", "mesh_attribute", "3", Honoured, "vertex_color"),
    ("texture", TEXTURE, "", "vertexcolors", "0.x", Honoured, ""),
    ("texture", TEXTURE, "<float name=\"scale\" value=\".5\"/><texture type=\"bitmap\"><string name=\"filename\" value=\"a.png\"/></texture>", "scale", "0.x", Honoured, ""),
    ("texture", TEXTURE, "", "gridtexture", "0.x", Refused, ""),
    ("texture", TEXTURE, "", "wireframe", "0.x", Refused, ""),
    ("texture", TEXTURE, "", "volume", "3", Refused, ""),
    ("spectrum", SPECTRUM, "", "uniform", "3", Honoured, ""),
    ("spectrum", SPECTRUM, "", "srgb", "3", Honoured, ""),
    ("spectrum", SPECTRUM, "", "d65", "3", Honoured, ""),
    ("spectrum", SPECTRUM, "<string name=\"wavelengths\" value=\"400 700\"/><string name=\"values\" value=\".1 .9\"/>", "irregular", "3", Approximated, "its colour"),
    ("spectrum", GLOW, "<float name=\"temperature\" value=\"5000\"/>", "blackbody", "0.x 3", Approximated, "its colour"),
    ("emitter", "<shape type=\"sphere\"><emitter type=\"PLUGIN\">INSIDE</emitter></shape>", "", "area", "0.x 3", Honoured, "textured too"),
    ("emitter", EMITTER, "", "point", "0.x 3", Honoured, ""),
    ("emitter", EMITTER, "", "spot", "0.x 3", Honoured, "without a texture"),
    ("emitter", EMITTER, "", "directional", "0.x 3", Honoured, ""),
    ("emitter", EMITTER, "", "constant", "0.x 3", Honoured, ""),
    ("emitter", EMITTER, FILE, "envmap", "0.x 3", Honoured, ""),
    ("emitter", EMITTER, "", "sunsky", "0.x 3", Approximated, "by our own sky"),
    ("emitter", EMITTER, "", "sky", "0.x", Approximated, "by our own sky"),
    ("emitter", EMITTER, "", "sun", "0.x", Approximated, "by our own sky"),
    ("emitter", EMITTER, "", "collimated", "0.x", Refused, ""),
    ("emitter", EMITTER, "", "directionalarea", "3", Refused, ""),
    ("emitter", EMITTER, "", "projector", "3", Refused, ""),
    ("sensor", SENSOR, "", "perspective", "0.x 3", Honoured, "fov along any axis, focal_length, principal_point_offset"),
    ("sensor", SENSOR, "<float name=\"aperture_radius\" value=\".1\"/><float name=\"focus_distance\" value=\"2\"/>", "thinlens", "0.x 3", Honoured, "a round lens"),
    ("sensor", SENSOR, "", "orthographic", "0.x 3", Honoured, ""),
    ("sensor", SENSOR, "", "radiancemeter", "0.x 3", Refused, ""),
    ("sensor", SENSOR, "", "irradiancemeter", "0.x 3", Refused, ""),
    ("sensor", SENSOR, "", "batch", "3", Refused, ""),
    ("sensor", SENSOR, "", "spherical", "0.x", Refused, ""),
    ("film", FILM, "", "hdrfilm", "0.x 3", Honoured, "size and crop; files are OpenEXR"),
    ("film", FILM, "", "ldrfilm", "0.x", Approximated, "tone mapping is a step of its own"),
    ("film", FILM, "", "specfilm", "3", Refused, ""),
    ("rfilter", FILTER, "", "box", "0.x 3", Honoured, "radius 0.5"),
    ("rfilter", FILTER, "", "tent", "0.x 3", Honoured, ""),
    ("rfilter", FILTER, "", "gaussian", "0.x 3", Honoured, ""),
    ("rfilter", FILTER, "", "mitchell", "0.x 3", Honoured, ""),
    ("rfilter", FILTER, "", "catmullrom", "0.x 3", Honoured, ""),
    ("rfilter", FILTER, "", "lanczos", "0.x 3", Approximated, "mitchell with B = 0, C = 0.5"),
    ("shape", SHAPE, MESH, "obj", "0.x 3", Honoured, ""),
    ("shape", SHAPE, "<string name=\"filename\" value=\"a.ply\"/>", "ply", "0.x 3", Honoured, ""),
    ("shape", SHAPE, "<string name=\"filename\" value=\"m.serialized\"/>", "serialized", "0.x 3", Honoured, "versions 3 and 4"),
    ("shape", SHAPE, "", "sphere", "0.x 3", Honoured, ""),
    ("shape", SHAPE, "", "rectangle", "0.x 3", Honoured, ""),
    ("shape", SHAPE, "", "cube", "0.x 3", Honoured, ""),
    ("shape", SHAPE, "", "disk", "0.x 3", Honoured, ""),
    ("shape", SHAPE, "", "cylinder", "0.x 3", Honoured, ""),
    ("shape", "<shape type=\"PLUGIN\" id=\"g\"><shape type=\"cube\"/></shape><shape type=\"instance\"><ref id=\"g\"/></shape>", "", "shapegroup", "0.x 3", Honoured, ""),
    ("shape", "<shape type=\"shapegroup\" id=\"g\"><shape type=\"cube\"/></shape><shape type=\"PLUGIN\"><ref id=\"g\"/></shape>", "", "instance", "0.x 3", Honoured, "also of instances"),
    ("shape", SHAPE, "", "hair", "0.x", Refused, ""),
    ("shape", SHAPE, "", "heightfield", "0.x", Refused, ""),
    ("shape", SHAPE, "", "deformable", "0.x", Refused, ""),
    ("shape", SHAPE, "", "bsplinecurve", "3", Refused, ""),
    ("shape", SHAPE, "", "linearcurve", "3", Refused, ""),
    ("shape", SHAPE, "", "sdfgrid", "3", Refused, ""),
    ("shape", SHAPE, "", "ellipsoids", "3", Refused, ""),
    ("medium", MEDIUM, "", "homogeneous", "0.x 3", Honoured, "no materials by name"),
    ("medium", MEDIUM, "", "heterogeneous", "0.x 3", Refused, ""),
    ("phase", PHASE, "", "isotropic", "0.x 3", Honoured, ""),
    ("phase", PHASE, "", "hg", "0.x 3", Honoured, ""),
    ("phase", PHASE, "", "rayleigh", "0.x 3", Approximated, "isotropic"),
    ("phase", PHASE, "", "sggx", "3", Refused, ""),
    ("phase", PHASE, "", "tabphase", "3", Refused, ""),
    ("integrator", INTEGRATOR, "", "path", "0.x 3", Honoured, "max_depth, rr_depth"),
    ("integrator", INTEGRATOR, "", "direct", "0.x 3", Honoured, "as paths of two edges"),
    ("integrator", INTEGRATOR, "", "volpath", "0.x 3", Approximated, "as path, which measures the same; so are bdpt, ptracer, mlt and the like"),
    ("integrator", INTEGRATOR, "", "depth", "3", Refused, "measures no light"),
];

/// A scene of the generation in which the plugin is found, with the plugin in its place.
fn scene(row: &Row) -> String {
    let (_, how, inside, plugin, generations, ..) = row;
    let generation = if generations.contains('3') { "3.0.0" } else { "0.6.0" };
    let part = |kind: &str, default: &str, inner: &str| {
        let (plugin, inside) = if *how == kind { (*plugin, *inside) } else { (default, "") };
        format!("<{kind} type=\"{plugin}\">{inside}{inner}</{kind}>")
    };
    let film = part("film", "hdrfilm", &part("rfilter", "box", ""));
    let body = if how.contains("PLUGIN") { how.replace("PLUGIN", plugin).replace("INSIDE", inside) } else { String::new() };
    let body = if *plugin == "mesh_attribute" {
        body.replace("type=\"mesh_attribute\">", "type=\"mesh_attribute\"><string name=\"name\" value=\"vertex_color\"/>")
    } else {
        body
    };
    let integrator = part("integrator", "path", "<integer name=\"max_depth\" value=\"4\"/>");
    format!("<scene version=\"{generation}\">{integrator}{}{body}</scene>", part("sensor", "perspective", &film))
}

#[test]
fn every_plugin_meets_the_fate_that_the_table_tells() {
    let files = Files(&[("m.serialized", include_bytes!("pair.serialized"))]);
    for row in TABLE {
        let (kind, _, _, plugin, _, fate, _) = row;
        let named = |text: &str| text.contains(&format!("<{kind} type=\"{plugin}\""));
        match (super::super::import(&scene(row), "s.xml", &files), *fate) {
            (Ok(imported), Honoured) => assert!(!imported.report.iter().any(|line| named(line)), "{kind} {plugin}: {:?}", imported.report),
            (Ok(imported), Approximated) => {
                assert!(imported.report.iter().any(|line| named(line)), "{kind} {plugin}: {:?}", imported.report)
            }
            (Ok(_), Refused) => panic!("{kind} {plugin} is not refused"),
            (Err(error), Refused) => {
                assert!(named(&error.to_string()) && error.kind == ErrorKind::Unsupported, "{kind} {plugin}: {error}");
            }
            (Err(error), _) => panic!("{kind} {plugin}: {error}"),
        }
    }
}

/// The section of the document that this table writes.
fn section() -> String {
    let words = |fate| match fate {
        Honoured => "honoured",
        Approximated => "approximated",
        Refused => "refused",
    };
    let count = |kind: Option<&str>, fate| TABLE.iter().filter(|row| kind.is_none_or(|kind| row.0 == kind) && row.5 == fate).count();
    let mut kinds: Vec<&str> = TABLE.iter().map(|row| row.0).collect();
    kinds.dedup();
    let mut text = "| kind | honoured | approximated | refused |\n|---|---|---|---|\n".to_string();
    for kind in &kinds {
        let [a, b, c] = [Honoured, Approximated, Refused].map(|fate| count(Some(kind), fate));
        writeln!(text, "| {kind} | {a} | {b} | {c} |").unwrap();
    }
    let [a, b, c] = [Honoured, Approximated, Refused].map(|fate| count(None, fate));
    writeln!(text, "| **all** | **{a}** | **{b}** | **{c}** |\n").unwrap();
    text.push_str("| kind | plugin | generation | | remark |\n|---|---|---|---|---|\n");
    for (kind, _, _, plugin, generations, fate, remark) in TABLE {
        writeln!(text, "| {kind} | `{plugin}` | {} | {} | {remark} |", generations.replace(' ', ", "), words(*fate)).unwrap();
    }
    text
}

#[test]
fn the_document_has_this_table() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/formats.md");
    let text = std::fs::read_to_string(path).unwrap();
    let (start, end) = ("<!-- mitsuba: this table is written by a test -->\n", "<!-- end of mitsuba -->");
    let found = text.split_once(start).and_then(|(_, rest)| rest.split_once(end)).map(|(section, _)| section);
    assert!(found == Some(&section()), "between {start:?} and {end:?} in docs/formats.md there must stand:\n{}", section());
}

//! What becomes of each of pbrt's elements, tried out; the table in `docs/formats.md` is this one.

use super::super::super::coverage::Fate::{Approximated, Honoured, LeftOut, Refused};
use super::super::super::coverage::{Fate, Row, check_document, fault};
use super::*;

const POINTS: &str = "\"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]";

/// (kind, element, what stands in the world; before it, if it starts with `@`, fate, remark)
#[rustfmt::skip]
fn table() -> Vec<(&'static str, &'static str, String, Fate, &'static str)> {
    let s = str::to_string;
    let material = |kind: &str| format!("Material \"{kind}\"");
    let texture = |class: &str| format!("Texture \"t\" \"spectrum\" \"{class}\"");
    vec![
        ("directive", "Identity, Translate, Scale, Rotate", s("Identity Translate 1 2 3 Scale 1 2 3 Rotate 30 0 0 1"), Honoured, ""),
        ("directive", "LookAt, Transform, ConcatTransform", s("LookAt 0 0 5 0 0 0 0 1 0 Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1] ConcatTransform [2 0 0 0 0 2 0 0 0 0 2 0 1 0 0 1]"), Honoured, ""),
        ("directive", "CoordinateSystem, CoordSysTransform", s("CoordinateSystem \"a\" CoordSysTransform \"a\" CoordSysTransform \"camera\""), Honoured, ""),
        ("directive", "AttributeBegin, TransformBegin", s("AttributeBegin TransformBegin TransformEnd AttributeEnd"), Honoured, "and their ends"),
        ("directive", "ReverseOrientation", s("ReverseOrientation Shape \"disk\""), Honoured, ""),
        ("directive", "ObjectBegin, ObjectInstance", s("ObjectBegin \"a\" Shape \"sphere\" ObjectEnd ObjectInstance \"a\""), Honoured, "as groups and instances"),
        ("directive", "Include, Import", s("Include \"part.pbrt\" Import \"part.pbrt\""), Honoured, "an import is read in its place"),
        ("directive", "ColorSpace", s("ColorSpace \"rec2020\""), Honoured, "srgb, rec2020, dci-p3, aces2065-1, as linear Rec.709"),
        ("directive", "NamedMaterial, MakeNamedMaterial", s("MakeNamedMaterial \"a\" \"string type\" \"diffuse\" NamedMaterial \"a\""), Honoured, ""),
        ("directive", "ActiveTransform", s("ActiveTransform EndTime"), LeftOut, "things stand as at the start"),
        ("directive", "TransformTimes", s("TransformTimes 0 1"), LeftOut, ""),
        ("directive", "Attribute", s("Attribute \"shape\" \"float radius\" 2"), LeftOut, ""),
        ("directive", "Option, Sampler, Accelerator", s("@Option \"bool disablepixeljitter\" true Sampler \"halton\" Accelerator \"bvh\""), LeftOut, "they say how pbrt works"),
        ("camera", "perspective", s("@Camera \"perspective\" \"float fov\" 30 \"float lensradius\" 0.1 \"float focaldistance\" 3"), Honoured, "screen window, thin lens; exposure scales the lights"),
        ("camera", "orthographic", s("@Camera \"orthographic\""), Honoured, ""),
        ("camera", "realistic", s("@Camera \"realistic\""), Refused, ""),
        ("camera", "spherical", s("@Camera \"spherical\""), Refused, ""),
        ("film", "rgb", s("@Film \"rgb\" \"integer xresolution\" 64 \"float iso\" 200"), Honoured, "resolution, crop window, ISO"),
        ("film", "gbuffer, spectral", s("@Film \"gbuffer\""), Approximated, "as rgb"),
        ("filter", "box, triangle, gaussian, mitchell", s("@PixelFilter \"box\" PixelFilter \"triangle\" PixelFilter \"gaussian\" PixelFilter \"mitchell\""), Honoured, "of one radius both ways"),
        ("filter", "sinc", s("@PixelFilter \"sinc\""), Approximated, "as mitchell"),
        ("integrator", "path, volpath", s("@Integrator \"volpath\" \"integer maxdepth\" 8"), Honoured, "maxdepth"),
        ("integrator", "bdpt, mlt, sppm and others", s("@Integrator \"sppm\""), Approximated, "path tracing measures the same picture"),
        ("shape", "trianglemesh", format!("Shape \"trianglemesh\" {POINTS} \"integer indices\" [0 1 2]"), Honoured, "without tangents"),
        ("shape", "bilinearmesh", format!("Shape \"bilinearmesh\" {POINTS}"), Honoured, "flat patches"),
        ("shape", "bilinearmesh, bent", s("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 1]"), Approximated, "128 triangles a patch"),
        ("shape", "plymesh", s("Shape \"plymesh\" \"string filename\" \"a.ply\""), Honoured, "not compressed"),
        ("shape", "loopsubdiv", format!("Shape \"loopsubdiv\" {POINTS} \"integer indices\" [0 1 2]"), Honoured, "refined, on its limit surface"),
        ("shape", "sphere, disk, cylinder", s("Shape \"sphere\" Shape \"disk\" Shape \"cylinder\""), Honoured, "whole, evenly scaled"),
        ("shape", "sphere, disk, cylinder, cut", s("Shape \"sphere\" \"float phimax\" 90"), Approximated, "triangles; so when unevenly scaled"),
        ("shape", "curve", s("Shape \"curve\""), LeftOut, ""),
        ("shape", "alpha", s("Shape \"disk\" \"float alpha\" 0.5"), Honoured, "as a mask"),
        ("material", "diffuse", material("diffuse"), Honoured, ""),
        ("material", "coateddiffuse", material("coateddiffuse"), Approximated, "plastic"),
        ("material", "conductor", material("conductor"), Honoured, "named, eta and k, or reflectance"),
        ("material", "coatedconductor", material("coatedconductor"), Approximated, "principled metal under a clear coat"),
        ("material", "dielectric", material("dielectric"), Honoured, ""),
        ("material", "dielectric of a named glass", s("Material \"dielectric\" \"spectrum eta\" \"glass-BK7\""), Approximated, "one index for all colours"),
        ("material", "thindielectric", material("thindielectric"), Honoured, ""),
        ("material", "diffusetransmission", material("diffusetransmission"), Approximated, "rough thin wall"),
        ("material", "mix", s("MakeNamedMaterial \"a\" \"string type\" \"diffuse\" Material \"mix\" \"string materials\" [\"a\" \"a\"]"), Honoured, ""),
        ("material", "interface", material("interface"), Honoured, ""),
        ("material", "subsurface", material("subsurface"), Approximated, "as coateddiffuse"),
        ("material", "hair, measured", material("hair"), Approximated, "as diffuse"),
        ("material", "displacement", s("Texture \"h\" \"float\" \"imagemap\" \"string filename\" \"a.png\" Material \"diffuse\" \"texture displacement\" \"h\""), Honoured, "as bumps"),
        ("material", "normalmap", s("Material \"diffuse\" \"string normalmap\" \"a.png\""), Honoured, ""),
        ("texture", "constant", texture("constant"), Honoured, ""),
        ("texture", "imagemap", s("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.png\" \"string encoding\" \"linear\" \"float uscale\" 2"), Honoured, "PNG, JPEG, OpenEXR, Radiance HDR; uv mapping"),
        ("texture", "imagemap of another kind", s("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.tga\""), Approximated, "0.5"),
        ("texture", "scale, mix", s("Texture \"t\" \"float\" \"scale\" \"float scale\" 0.5 Texture \"u\" \"spectrum\" \"mix\" \"float amount\" 0.5"), Honoured, ""),
        ("texture", "checkerboard", texture("checkerboard"), Honoured, "of two dimensions"),
        ("texture", "bilerp", texture("bilerp"), Approximated, "its mean"),
        ("texture", "dots", texture("dots"), LeftOut, "what lies outside of them"),
        ("texture", "fbm, wrinkled, windy, marble, ptex, directionmix", texture("fbm"), Approximated, "0.5"),
        ("texture", "mapping spherical, cylindrical, planar", s("Texture \"t\" \"spectrum\" \"checkerboard\" \"string mapping\" \"planar\""), LeftOut, "the shape's coordinates count"),
        ("spectrum", "rgb, blackbody, sampled", s("LightSource \"point\" \"rgb I\" [1 2 3] LightSource \"point\" \"blackbody I\" 3000 LightSource \"point\" \"spectrum I\" [400 1 700 2]"), Honoured, "by the CIE 1931 observer"),
        ("spectrum", "metal-*", s("Material \"conductor\" \"spectrum eta\" \"metal-Ag-eta\" \"spectrum k\" \"metal-Ag-k\""), Honoured, ""),
        ("spectrum", "others by name or file", s("LightSource \"point\" \"spectrum I\" \"canon_eos\""), Approximated, "white, or 0.5"),
        ("light", "point, spot, distant", s("LightSource \"point\" LightSource \"spot\" LightSource \"distant\""), Honoured, "scale, power, illuminance"),
        ("light", "infinite", s("LightSource \"infinite\" \"float illuminance\" 2"), Honoured, ""),
        ("light", "infinite with an image", s("LightSource \"infinite\" \"string filename\" \"sky.exr\""), Approximated, "resampled from the equal-area square"),
        ("light", "infinite with a portal", s("LightSource \"infinite\" \"point3 portal\" [0 0 0 1 0 0 1 1 0 0 1 0]"), LeftOut, "the portal"),
        ("light", "goniometric, projection", s("LightSource \"projection\""), LeftOut, ""),
        ("light", "diffuse area light", s("AreaLightSource \"diffuse\" \"float scale\" 2 \"bool twosided\" true Shape \"disk\""), Honoured, "scale, power, two-sided, images"),
        ("medium", "homogeneous", s("MakeNamedMedium \"m\" \"string type\" \"homogeneous\" MediumInterface \"m\" \"\" Shape \"sphere\""), Honoured, ""),
        ("medium", "homogeneous with a preset", s("MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"string preset\" \"Skin1\""), Approximated, "pbrt's default coefficients"),
        ("medium", "homogeneous that glows", s("MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb Le\" [1 1 1]"), LeftOut, "its glow"),
        ("medium", "uniformgrid, rgbgrid, cloud, nanovdb", s("MakeNamedMedium \"m\" \"string type\" \"cloud\" MediumInterface \"m\" \"\""), LeftOut, "the space is empty"),
    ]
}

struct Beside;

impl Assets for Beside {
    fn open(&self, name: &str) -> Result<Vec<u8>, Error> {
        match name {
            "part.pbrt" => Ok(b"# nothing\n".to_vec()),
            "a.ply" => Ok(include_bytes!("../../../../../../tests/scenes/seeds/square.ply").to_vec()),
            "sky.exr" => Ok(include_bytes!("../../../../../../tests/scenes/seeds/picture.exr").to_vec()),
            _ => NoAssets.open(name),
        }
    }
}

#[test]
fn every_element_meets_the_fate_that_the_table_tells() {
    let faults = table().into_iter().filter_map(|(kind, name, text, fate, remark)| {
        let (before, within) = match text.strip_prefix('@') {
            Some(before) => (before.to_string(), String::new()),
            None => (String::new(), text),
        };
        let camera = if before.contains("Camera") { "" } else { "Camera \"perspective\"" };
        let scene = format!("{camera} {before} WorldBegin Shape \"sphere\" {within}");
        fault(&Row { kind, name, fate, remark }, import(&scene, "s.pbrt", &Beside), &[])
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_document_has_this_table() {
    let rows: Vec<Row> = table().into_iter().map(|(kind, name, _, fate, remark)| Row { kind, name, fate, remark }).collect();
    check_document("pbrt", &rows);
}

//! The same scene as the importers of several formats bring it over: one picture, whatever hand the world was written with.

#![allow(clippy::unwrap_used)]

use gradfarm_core::plan::{Plan, ReconstructionKind, Request, Technique, resolve};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_core::scene::read::{Format, read};
use gradfarm_core::scene::{NoAssets, Scene, SceneDescription};
use gradfarm_tests::frame::render;
use gradfarm_tests::statistics::{Comparison, Estimate};

/// Correct code fails each comparison with this probability.
const LEVEL: f64 = 1e-4;
const SEEDS: u64 = 8;
const BLOCK: u32 = 8;

/// A red ball left and a green one right on a grey floor, lit by a lamp above on the right and a little from everywhere.
const NATIVE: &str = r#"{
    "version": 1, "film": {"width": 32, "height": 24}, "integrator": {"max_depth": 4},
    "camera": {"perspective": {"fov": 45, "fov_axis": "y", "to_world": [{"look_at": {"origin": [0.5, 2, 5], "target": [0, 0.5, 0]}}]}},
    "materials": {"grey": {"diffuse": {"reflectance": 0.5}}, "red": {"diffuse": {"reflectance": [0.8, 0.1, 0.1]}},
                  "green": {"diffuse": {"reflectance": [0.1, 0.8, 0.1]}}},
    "shapes": [
        {"geometry": "rectangle", "to_world": [{"scale": [3, 3, 1]}, {"rotate": {"axis": [1, 0, 0], "degrees": -90}}], "material": "grey"},
        {"geometry": {"sphere": {"center": [-1.2, 0.5, 0], "radius": 0.5}}, "material": "red"},
        {"geometry": {"sphere": {"center": [1, 0.8, -0.5], "radius": 0.8}}, "material": "green"},
        {"geometry": "rectangle", "to_world": [{"scale": [0.5, 0.5, 1]}, {"rotate": {"axis": [1, 0, 0], "degrees": 90}}, {"translate": [1.5, 3, 1]}],
         "material": "grey", "emission": {"radiance": [9, 8, 7]}}
    ],
    "environment": {"radiance": 0.1}
}"#;

const MITSUBA: &str = r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="4"/></integrator>
    <sensor type="perspective"><float name="fov" value="45"/><string name="fov_axis" value="y"/>
        <transform name="to_world"><lookat origin="0.5, 2, 5" target="0, 0.5, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/><rfilter type="box"/></film></sensor>
    <bsdf type="twosided" id="grey"><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></bsdf>
    <shape type="rectangle"><transform name="to_world"><scale x="3" y="3"/><rotate x="1" angle="-90"/></transform><ref id="grey"/></shape>
    <shape type="sphere"><point name="center" x="-1.2" y="0.5" z="0"/><float name="radius" value="0.5"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.1, 0.1"/></bsdf></shape>
    <shape type="sphere"><point name="center" x="1" y="0.8" z="-0.5"/><float name="radius" value="0.8"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.1, 0.8, 0.1"/></bsdf></shape>
    <shape type="rectangle"><transform name="to_world"><scale x="0.5" y="0.5"/><rotate x="1" angle="90"/><translate x="1.5" y="3" z="1"/></transform>
        <ref id="grey"/><emitter type="area"><rgb name="radiance" value="9, 8, 7"/></emitter></shape>
    <emitter type="constant"><rgb name="radiance" value="0.1"/></emitter>
</scene>"#;

/// The same through a looking-glass: pbrt's world is left-handed, so x has the other sign.
const PBRT: &str = r#"
    Film "rgb" "integer xresolution" 32 "integer yresolution" 24
    PixelFilter "box"
    Integrator "path" "integer maxdepth" 3
    LookAt -0.5 2 5  0 0.5 0  0 1 0
    Camera "perspective" "float fov" 45
    WorldBegin
    LightSource "infinite" "rgb L" [0.1 0.1 0.1]
    Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
    Shape "trianglemesh" "point3 P" [-3 0 -3  3 0 -3  3 0 3  -3 0 3] "integer indices" [0 1 2 0 2 3]
    AttributeBegin
        AreaLightSource "diffuse" "rgb L" [4.5 4 3.5] "float scale" 2
        Translate -1.5 3 1
        Shape "bilinearmesh" "point3 P" [-0.5 0 -0.5  0.5 0 -0.5  -0.5 0 0.5  0.5 0 0.5] "normal N" [0 -1 0 0 -1 0 0 -1 0 0 -1 0]
    AttributeEnd
    Material "diffuse" "rgb reflectance" [0.8 0.1 0.1]
    AttributeBegin Translate 1.2 0.5 0 Shape "sphere" "float radius" 0.5 AttributeEnd
    Material "diffuse" "rgb reflectance" [0.1 0.8 0.1]
    ObjectBegin "ball" Shape "sphere" "float radius" 0.4 ObjectEnd
    AttributeBegin Translate -1 0.8 -0.5 Scale 2 2 2 ObjectInstance "ball" AttributeEnd
"#;

/// Means over blocks and channels, from several seeds.
fn pictured(description: &SceneDescription) -> Vec<Estimate> {
    let scene = Scene::compile(description, &NoAssets).unwrap();
    let plan = |seed| -> Plan {
        let request = Request { technique: Some(Technique::Pt), samples: Some(32), seed, ..Request::default() };
        resolve(description, &request).unwrap()
    };
    let run = |seed| -> Vec<f64> {
        let image = reconstruct(&render(&scene, &plan(seed)).unwrap(), ReconstructionKind::None, 0.2).unwrap().image;
        let mut means = Vec::new();
        for channel in 0..3 {
            for block in image.extent().tiles(BLOCK) {
                let pixels = (0..block.pixels() as u32).map(|k| (block.x + k % block.width, block.y + k / block.width));
                means.push(pixels.map(|(x, y)| f64::from(image.at(x, y, channel))).sum::<f64>() / block.pixels() as f64);
            }
        }
        means
    };
    let runs: Vec<Vec<f64>> = (0..SEEDS).map(run).collect();
    (0..runs[0].len()).map(|k| Estimate::of(&runs.iter().map(|run| run[k]).collect::<Vec<_>>())).collect()
}

fn brought(format: Format, text: &str) -> SceneDescription {
    let imported = read(format, text.as_bytes().to_vec(), "scene", &NoAssets).unwrap();
    assert!(imported.made.is_empty());
    imported.description
}

#[test]
fn every_format_makes_the_same_picture() {
    let native = pictured(&brought(Format::Native, NATIVE));
    for (format, text) in [(Format::Mitsuba, MITSUBA), (Format::Pbrt, PBRT)] {
        let compared = Comparison::of(pictured(&brought(format, text)).into_iter().zip(native.iter().copied()));
        eprintln!("{format:?}: over {} block means worst |t| {:.2}", compared.pairs, compared.worst);
        assert!(compared.agrees(LEVEL), "{format:?}: block {} has a chance of {:e}", compared.place, compared.chance);
    }
    // The comparison has teeth: the mirror image is another picture.
    let mirrored = pictured(&brought(Format::Pbrt, &PBRT.replace("LookAt -0.5", "Scale -1 1 1 LookAt -0.5")));
    assert!(!Comparison::of(mirrored.into_iter().zip(native)).agrees(LEVEL), "the looking-glass does not show");
}

//! What the plan of effects saves: a closed room without media, holes or textures, rendered as it is and with their code switched on.
//!
//! The images are the same to the last bit (a test of `gradient` says so), so the difference in time is the price of the switches.

#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gradfarm_core::lattice::{Extent, Moment};
use gradfarm_core::material::{Bsdf, Material, Textured};
use gradfarm_core::plan::{self, Plan, Request, Technique, WorkUnit};
use gradfarm_core::render::render_unit;
use gradfarm_core::scene::{Boundary, NoAssets, Scene, SceneDescription};
use gradfarm_core::texture::{ColourInput, ScalarInput};
use std::hint::black_box;

const ROOM: &str = r#"{
    "version": 1,
    "camera": { "perspective": { "to_world": [{ "look_at": { "origin": [0, 1, 3.4], "target": [0, 1, 0] } }], "fov": 40 } },
    "film": { "width": 32, "height": 32 },
    "materials": {
        "white": { "diffuse": { "reflectance": 0.7 } }, "red": { "diffuse": { "reflectance": [0.6, 0.1, 0.1] } },
        "green": { "diffuse": { "reflectance": [0.1, 0.5, 0.1] } }
    },
    "shapes": [
        { "geometry": "rectangle", "material": "white", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }] },
        { "geometry": "rectangle", "material": "white", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 2, 0] }] },
        { "geometry": "rectangle", "material": "white", "to_world": [{ "translate": [0, 1, -1] }] },
        { "geometry": "rectangle", "material": "red", "to_world": [{ "rotate": { "axis": [0, 1, 0], "degrees": 90 } }, { "translate": [-1, 1, 0] }] },
        { "geometry": "rectangle", "material": "green", "to_world": [{ "rotate": { "axis": [0, 1, 0], "degrees": -90 } }, { "translate": [1, 1, 0] }] },
        { "geometry": "cube", "material": "white", "to_world": [{ "scale": [0.3, 0.6, 0.3] }, { "translate": [-0.35, 0.6, -0.3] }] },
        { "geometry": "cube", "material": "white", "to_world": [{ "scale": [0.3, 0.3, 0.3] }, { "translate": [0.35, 0.3, 0.3] }] },
        { "geometry": "rectangle", "material": "white", "emission": { "radiance": 12 },
          "to_world": [{ "scale": [0.3, 0.3, 1] }, { "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 1.99, 0] }] }
    ]
}"#;

fn switches(criterion: &mut Criterion) {
    let description = SceneDescription::from_json(ROOM, "room.json").unwrap();
    let clear = Scene::compile(&description, &NoAssets).unwrap();
    let mut through = clear.clone();
    through.boundaries.push(Boundary { opacity: ScalarInput::Constant(1.0), media: None });
    let mut looked_up = clear.clone();
    for material in &mut looked_up.materials {
        if let Material::Plain(Bsdf::Diffuse(diffuse)) = material {
            let reflectance = ColourInput::Constant(diffuse.reflectance);
            *material = Material::Textured(Textured::Diffuse { reflectance, two_sided: diffuse.two_sided });
        }
    }
    for technique in Technique::ALL {
        let request = Request { technique: Some(technique), samples: Some(Plan::BATCH), ..Request::default() };
        let plan = plan::resolve(&description, &request).unwrap();
        let tile = Extent { width: 32, height: 32 }.tiles(32)[0];
        let unit = WorkUnit { moment: Moment::of(0), tile, samples: plan.sample_ranges()[0] };
        let mut group = criterion.benchmark_group(format!("switches/{}", technique.name()));
        group.sample_size(20).throughput(Throughput::Elements(u64::from(Plan::BATCH) * 32 * 32));
        for (name, scene) in [("as planned", &clear), ("media and holes on", &through), ("textures on", &looked_up)] {
            group.bench_function(name, |bencher| bencher.iter(|| render_unit(black_box(scene), &plan, &unit)));
        }
        group.finish();
    }
}

criterion_group!(benches, switches);
criterion_main!(benches);

//! Scenes that nobody here wrote, against images that another renderer made: Mitsuba 3.9.1, with its standard error for each pixel.
//!
//! A small slice of the whole table, which `just truth` renders. The scenes lie beside the workspace, in `../shared/scenes`; where they are
//! absent the test says so and passes.

#![allow(clippy::unwrap_used)]

use gradfarm_core::plan::Technique;
use gradfarm_core::scene::SceneDescription;
use gradfarm_core::scene::description::Material;
use gradfarm_tests::truth::{Effort, Row, measure, measure_changed, scenes};

/// Correct code fails each comparison with this probability; there are a dozen.
const LEVEL: f64 = 1e-4;

fn check(name: &str, technique: Technique, samples: u32) {
    let Some(scenes) = scenes() else { return eprintln!("skipped: ../shared/scenes is not here") };
    agree(name, &measure(&scenes.join(name), "scene.xml", technique, Effort { seeds: 8, samples }).unwrap());
}

fn agree(name: &str, rows: &[Row]) {
    for row in rows {
        eprintln!(
            "{name}, {}: mean ratio {:.4} (t {:.2}); over {} blocks worst |t| {:.2}, mean {:.3}, mean square {:.3}",
            row.reconstruction.name(),
            row.ours / row.theirs,
            row.t,
            row.blocks.pairs,
            row.blocks.worst,
            row.blocks.mean,
            row.blocks.mean_square
        );
        row.agrees(LEVEL).unwrap_or_else(|fault| panic!("{name}: {fault}"));
    }
}

#[test]
fn cornell_box_by_path_tracing() {
    check("cornell-box", Technique::Pt, 12);
}

#[test]
fn cornell_box_in_the_gradient_domain() {
    check("cornell-box", Technique::Gpt, 6);
}

/// The same box in the words of Mitsuba 0.5. This file has no `twosided`, and three of its walls look outwards: they are black, and Mitsuba 3.9.1
/// gives its picture 0.529 of the mean of the other file's. With both sides of every surface it is the same picture.
#[test]
fn cornell_box_of_an_old_generation_by_path_tracing() {
    let Some(scenes) = scenes() else { return eprintln!("skipped: ../shared/scenes is not here") };
    let (folder, effort) = (scenes.join("cornell-box"), Effort { seeds: 8, samples: 6 });
    let both_sides = |scene: &mut SceneDescription| {
        for material in scene.materials.values_mut() {
            let Material::Diffuse(diffuse) = material else { panic!("{material:?}") };
            diffuse.two_sided = true;
        }
    };
    let rows = measure_changed(&folder, "mitsuba05.xml", both_sides, Technique::Pt, effort).unwrap();
    agree("cornell-box of 0.5 with both sides", &rows);
    let written = &measure(&folder, "mitsuba05.xml", Technique::Pt, effort).unwrap()[0];
    assert!((written.ours / written.theirs - 0.529).abs() < 0.005, "as written: {}", written.ours / written.theirs);
}

#[test]
fn room_behind_a_door_by_path_tracing() {
    check("door-simple", Technique::Pt, 24);
}

#[test]
fn room_behind_a_door_in_the_gradient_domain() {
    check("door-simple", Technique::Gpt, 12);
}

/// Light that passes smooth dielectrics twice: chains of half vectors on nearly every path.
#[test]
fn caustics_under_water_in_the_gradient_domain() {
    check("water-caustic", Technique::Gpt, 4);
}

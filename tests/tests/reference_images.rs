//! Scenes that nobody here wrote, against images that another renderer made: Mitsuba 3.9.1, with its standard error for each pixel.
//!
//! A small slice of the whole table, which `just truth` renders. The scenes lie beside the workspace, in `../shared/scenes`; where they are
//! absent the test says so and passes.

#![allow(clippy::unwrap_used)]

use gradfarm_core::plan::Technique;
use gradfarm_tests::truth::{Effort, measure, scenes};

/// Correct code fails each comparison with this probability; there are a dozen.
const LEVEL: f64 = 1e-4;

fn check(name: &str, technique: Technique, samples: u32) {
    check_form(name, "scene.xml", technique, samples);
}

/// One form of a scene: they all have one reference.
fn check_form(name: &str, file: &str, technique: Technique, samples: u32) {
    let Some(scenes) = scenes() else { return eprintln!("skipped: ../shared/scenes is not here") };
    for row in measure(&scenes.join(name), file, technique, Effort { seeds: 8, samples }).unwrap() {
        eprintln!(
            "{name}/{file}, {} and {}: mean ratio {:.4} (t {:.2}); over {} blocks worst |t| {:.2}, mean {:.3}, mean square {:.3}",
            technique.name(),
            row.reconstruction.name(),
            row.ours / row.theirs,
            row.t,
            row.blocks.pairs,
            row.blocks.worst,
            row.blocks.mean,
            row.blocks.mean_square
        );
        row.agrees(LEVEL).unwrap_or_else(|fault| panic!("{name}/{file}: {fault}"));
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

/// The same box in the words of Mitsuba 0.5.
#[test]
fn cornell_box_of_an_old_generation_by_path_tracing() {
    check_form("cornell-box", "mitsuba05.xml", Technique::Pt, 6);
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

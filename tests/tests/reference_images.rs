//! Scenes that nobody here wrote, against images that another renderer made: Mitsuba 3.9.1, with its standard error for each pixel.
//!
//! The scenes lie beside the workspace, in `../shared/scenes`; where they are absent the test says so and passes. Values are
//! compared as means over blocks of 8 × 8 pixels: single pixels have heavy tails, and their standard errors are too small.

#![allow(clippy::unwrap_used)]

use gradfarm_core::film::Image;
use gradfarm_core::output::exr::read_rgb;
use gradfarm_core::plan::{Plan, ReconstructionKind, Request, Technique, resolve};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_core::scene::{Scene, load};
use gradfarm_tests::frame::render;
use gradfarm_tests::statistics::{Comparison, Estimate, student_tail};
use std::path::{Path, PathBuf};

/// Correct code fails each comparison with this probability; there are a dozen.
const LEVEL: f64 = 1e-4;
const BLOCK: u32 = 8;
const SEEDS: u64 = 8;

fn folder(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: {} is not here", folder.display());
    None
}

/// Mean of each block, per channel: sums of `value` over its pixels, over their number.
fn blocks(image: &Image, value: impl Fn(f64) -> f64) -> Vec<f64> {
    let extent = image.extent();
    let mut means = Vec::new();
    for channel in 0..3 {
        for block in extent.tiles(BLOCK) {
            let pixels = (0..block.pixels() as u32).map(|k| (block.x + k % block.width, block.y + k / block.width));
            let sum: f64 = pixels.map(|(x, y)| value(f64::from(image.at(x, y, channel)))).sum();
            means.push(sum / block.pixels() as f64);
        }
    }
    means
}

/// The reference's block means with their standard errors.
fn reference(folder: &Path) -> Vec<Estimate> {
    let read = |name: &str| read_rgb(&std::fs::read(folder.join(name)).unwrap()).unwrap();
    let (image, error) = (read("reference.exr"), read("reference_stderr.exr"));
    let squares = blocks(&error, |e| e * e);
    let pixels = f64::from(BLOCK * BLOCK);
    blocks(&image, |v| v).into_iter().zip(squares).map(|(mean, square)| Estimate::known(mean, (square / pixels).sqrt())).collect()
}

fn check(name: &str, technique: Technique, samples: u32) {
    let Some(folder) = folder(name) else { return };
    let loaded = load(folder.join("scene.xml")).unwrap();
    let scene = Scene::compile(&loaded.description, &loaded.assets).unwrap();
    let reference = reference(&folder);
    let plan = |seed| -> Plan {
        let request = Request { technique: Some(technique), samples: Some(samples), seed, ..Request::default() };
        resolve(&loaded.description, &request).unwrap()
    };
    let films: Vec<_> = (0..SEEDS).map(|seed| render(&scene, &plan(seed)).unwrap()).collect();
    for kind in [ReconstructionKind::None, ReconstructionKind::L2] {
        if kind == ReconstructionKind::L2 && !technique.measures_gradients() {
            continue;
        }
        let runs: Vec<Vec<f64>> = films.iter().map(|film| blocks(&reconstruct(film, kind, 0.2).unwrap().image, |v| v)).collect();
        let pairs = reference.iter().enumerate().map(|(k, r)| (Estimate::of(&runs.iter().map(|run| run[k]).collect::<Vec<_>>()), *r));
        let compared = Comparison::of(pairs);
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / reference.len() as f64;
        let frames: Vec<f64> = runs.iter().map(|run| mean(&mut run.iter().copied())).collect();
        let ours = Estimate::of(&frames);
        let error = reference.iter().map(|r| r.variance).sum::<f64>().sqrt() / reference.len() as f64;
        let theirs = Estimate::known(mean(&mut reference.iter().map(|r| r.mean)), error);
        let (t, freedom) = ours.t(&theirs).unwrap();
        eprintln!(
            "{name}, {} and {}: mean ratio {:.4} (t {t:.2}); over {} blocks worst |t| {:.2}, mean {:.3}, mean square {:.3}",
            technique.name(),
            kind.name(),
            ours.mean / theirs.mean,
            compared.pairs,
            compared.worst,
            compared.mean,
            compared.mean_square
        );
        assert!(student_tail(t, freedom) > LEVEL, "{name}: the mean is {} times the reference's", ours.mean / theirs.mean);
        assert!(compared.agrees(LEVEL), "{name}: block {} has a chance of {:e}", compared.place, compared.chance);
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

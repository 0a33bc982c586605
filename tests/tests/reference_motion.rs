//! An animated glTF scene that nobody here wrote, with and without an open shutter, against images that Mitsuba 3.9.1 made instant by
//! instant. The scene lies beside the workspace, in `../shared/scenes`; where it is absent the test says so and passes.

#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Moment;
use gradfarm_core::output::exr::read_rgb;
use gradfarm_core::plan::{Plan, ReconstructionKind, Request, Technique, Timeline, resolve};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_core::scene::description::Film;
use gradfarm_core::scene::{Stage, load};
use gradfarm_tests::animation::whole;
use gradfarm_tests::statistics::{Comparison, Estimate, student_tail};
use gradfarm_tests::truth::scenes;

/// Correct code fails each comparison with this probability; there are six.
const LEVEL: f64 = 1e-4;
const SEEDS: u64 = 6;
const BLOCK: u32 = 8;
/// The relative mean square error of the reference's pixels, as its authors estimate it: the worst of its images.
const REFERENCE: f64 = 3e-4;

/// Means over blocks, all channels together.
fn blocks(image: &Image) -> Vec<f64> {
    let (width, height) = (image.extent().width, image.extent().height);
    let mut means = Vec::new();
    for top in (0..height).step_by(BLOCK as usize) {
        for left in (0..width).step_by(BLOCK as usize) {
            let pixels = (top..top + BLOCK).flat_map(|y| (left..left + BLOCK).map(move |x| (x, y)));
            let sum: f64 = pixels.flat_map(|(x, y)| [0, 1, 2].map(|channel| image.at(x, y, channel))).map(f64::from).sum();
            means.push(sum / f64::from(BLOCK * BLOCK * 3));
        }
    }
    means
}

fn check(frame: u32, shutter: f64, reference: &str) {
    let Some(scenes) = scenes() else { return eprintln!("skipped: ../shared/scenes is not here") };
    let folder = scenes.join("anim-box");
    let mut loaded = load(folder.join("scene.gltf")).unwrap();
    loaded.description.film = Film::new(96, 72);
    loaded.description.integrator.max_depth = 6;
    let assets = Arc::new(loaded.assets.clone());
    let stage = Stage::new(loaded.description.clone(), assets).unwrap();
    let image = |seed: u64| {
        // As many samples in a half as there are instants: each is seen once by each half.
        let request = Request { technique: Some(Technique::Pt), samples: Some(32), seed, ..Request::default() };
        let timeline = Some(Timeline { fps: 24.0, shutter, instants: 16 });
        let plan = Plan { timeline, ..resolve(&loaded.description, &request).unwrap() };
        let moment = Moment::of(frame);
        let exposure = plan.exposure(&stage, moment).unwrap();
        assert_eq!(exposure.instants.len(), if shutter > 0.0 { 16 } else { 1 });
        let film = whole(&(&exposure).into(), &plan, moment).unwrap();
        blocks(&reconstruct(&film, ReconstructionKind::None, 0.2).unwrap().image)
    };
    let runs: Vec<Vec<f64>> = (0..SEEDS).map(image).collect();
    let theirs = blocks(&read_rgb(&std::fs::read(folder.join(reference)).unwrap()).unwrap());
    let error = (REFERENCE / f64::from(BLOCK * BLOCK)).sqrt();
    let mean = |run: &[f64]| run.iter().sum::<f64>() / run.len() as f64;
    let pairs = theirs.iter().enumerate().map(|(k, block)| {
        let ours = Estimate::of(&runs.iter().map(|run| run[k]).collect::<Vec<_>>());
        (ours, Estimate::known(*block, block * error))
    });
    let found = Comparison::of(pairs);
    let ours = Estimate::of(&runs.iter().map(|run| mean(run)).collect::<Vec<_>>());
    let whole = Estimate::known(mean(&theirs), mean(&theirs) * error / (theirs.len() as f64).sqrt());
    let (t, freedom) = ours.t(&whole).unwrap();
    eprintln!(
        "{reference}: mean ratio {:.4} (t {t:.2}); worst |t| {:.2}, mean square {:.2}",
        ours.mean / whole.mean,
        found.worst,
        found.mean_square
    );
    assert!(found.agrees(LEVEL), "{reference}: block {} has |t| {}", found.place, found.worst);
    assert!(student_tail(t, freedom) > LEVEL, "{reference}: the mean has t {t}");
}

#[test]
fn an_instant_is_as_the_reference_has_it() {
    check(7, 0.0, "static_f0007.exr");
}

#[test]
fn an_open_shutter_blurs_as_the_reference_does() {
    check(7, 0.5, "reference_f0007.exr");
    check(21, 0.5, "reference_f0021.exr");
}

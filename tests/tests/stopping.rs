//! Frames stop near the error that was asked for. (`cargo run --example stopping` measures that at full size.)

#![allow(clippy::unwrap_used)]

use gradfarm_core::accuracy::Stop;
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{Plan, Request, Technique, resolve};
use gradfarm_core::scene::{NoAssets, Scene, SceneDescription};
use gradfarm_tests::stopping::outcomes;

/// Frames of each technique.
const SEEDS: u64 = 16;
/// A frame may exceed 1.3 times its target in one of ten cases; in five or more of sixteen it would with 2 in 100.
const FEW: usize = 4;

#[test]
fn frames_stop_near_the_error_that_was_asked_for() {
    let description = SceneDescription::from_json(include_str!("../scenes/cornell-box.json"), "cornell-box.json").unwrap();
    let scene = Scene::compile(&description, &NoAssets).unwrap();
    for (technique, target, rounds) in [(Technique::Gpt, 0.04, 1), (Technique::Pt, 0.08, 1), (Technique::Gpt, 0.03, 6)] {
        let stop = Stop { error: Some(target), ..Stop::default() };
        let extent = Some(Extent { width: 32, height: 32 });
        let request = Request { technique: Some(technique), extent, stop, samples: Some(4096), rounds: Some(rounds), ..Request::default() };
        let all = outcomes(&scene, &resolve(&description, &request).unwrap(), 40, SEEDS).unwrap();
        // The truth is the mean of the others, whose own error adds a share.
        let bound = Stop::SURE * target * (1.0 + 1.0 / (SEEDS - 1) as f64);
        let far = all.iter().filter(|outcome| outcome.found > bound).count();
        assert!(far <= FEW, "{far} of {SEEDS} frames stopped too early: {all:?}");
        assert!(rounds == 1 || all.iter().any(|outcome| outcome.samples > Plan::FIRST_ROUND), "some go into their second round");
        let mean = all.iter().map(|outcome| outcome.found).sum::<f64>() / SEEDS as f64;
        assert!(mean > 0.2 * target, "frames go on for much longer than asked: relMSE {mean} for {target}");
        assert!(all.iter().all(|outcome| outcome.told.relmse <= target && outcome.samples < 4096));
    }
}

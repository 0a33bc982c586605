//! Samples placed in rounds: the film is unbiased although the values decide where samples go, and tiles leave no trace.

#![allow(clippy::unwrap_used)]

use gradfarm_core::film::{Film, FrameFold, Noise, TileFold};
use gradfarm_core::lattice::{Extent, Moment};
use gradfarm_core::plan::{Plan, Request, Stop, Technique, WorkUnit};
use gradfarm_core::render::render_unit;
use gradfarm_tests::frame::{render, render_steered};
use gradfarm_tests::scenes::{compile, plan};
use gradfarm_tests::statistics::{Comparison, Estimate};
use rayon::prelude::*;

/// A floor half in the shade of a board under a small bright lamp: strong contrast, and rare bright paths.
const SCENE: &str = r#"{
  "version": 1,
  "camera": { "perspective": { "to_world": [{ "look_at": { "origin": [0, 1.2, 3], "target": [0, 0.3, 0], "up": [0, 1, 0] } }], "fov": 60 } },
  "film": { "width": 16, "height": 2 },
  "materials": { "white": { "diffuse": { "reflectance": 0.7 } }, "black": { "diffuse": { "reflectance": 0 } } },
  "shapes": [
    {
      "geometry": "rectangle",
      "to_world": [{ "scale": [4, 4, 4] }, { "rotate": { "axis": [1, 0, 0], "degrees": -90 } }],
      "material": "white"
    },
    {
      "geometry": "rectangle",
      "to_world": [{ "scale": [0.6, 0.6, 1] }, { "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [-0.8, 0.8, 0] }],
      "material": "white"
    },
    {
      "geometry": "rectangle",
      "to_world": [{ "scale": [0.1, 0.1, 1] }, { "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [-0.8, 2.2, 0] }],
      "material": "black",
      "emission": { "radiance": 80 }
    }
  ]
}"#;
const EXTENT: Extent = Extent { width: 16, height: 2 };
/// Correct code fails a comparison with this probability; there are two, over all values and of their sum alone.
const LEVEL: f64 = 1e-4;

fn request(technique: Technique, samples: u32, rounds: u32, seed: u64) -> Request {
    Request {
        technique: Some(technique),
        samples: Some(samples),
        extent: Some(EXTENT),
        rounds: Some(rounds),
        max_depth: Some(4),
        seed,
        ..Request::default()
    }
}

/// Every value of a film that must be unbiased: primal, direct and gradients of both halves together, the primal of each half, and at
/// the end the sum of the primal over the film, which shows a common trend long before single pixels do.
fn values(film: &Film) -> Vec<f64> {
    let both = film.combined();
    let gradients = both.gradients.as_ref().unwrap();
    let images = [&both.primal, &both.direct, &gradients.dx, &gradients.dy, &film.halves[0].primal, &film.halves[1].primal];
    let mut values: Vec<f64> = images.iter().flat_map(|image| image.data()).map(|v| f64::from(*v)).collect();
    values.push(both.primal.data().iter().map(|v| f64::from(*v)).sum());
    values
}

fn measured(seeds: std::ops::Range<u64>, film: impl Fn(u64) -> Film + Sync) -> Vec<Estimate> {
    let runs: Vec<Vec<f64>> = seeds.into_par_iter().map(|seed| values(&film(seed))).collect();
    (0..runs[0].len()).map(|k| Estimate::of(&runs.iter().map(|run| run[k]).collect::<Vec<f64>>())).collect()
}

/// Noise to the fourth power: samples then follow it greedily. What is unbiased is so for whatever the other half asks; what is not shows
/// it sooner.
fn greedy(noise: [Noise; 2]) -> [Noise; 2] {
    noise.map(|mut noise| {
        for image in [&mut noise.primal, &mut noise.gradients] {
            image.data_mut().iter_mut().for_each(|v| *v = v.min(1e8).powi(4));
        }
        noise
    })
}

/// Rounds that double, as they do where frames are checked on the way: 8 samples, then 2 even ones and 6 more.
fn doubling(plan: Plan) -> Plan {
    Plan { batch: 2, stop: Stop { curve: true, ..Stop::default() }, ..plan }
}

fn selfish(noise: [Noise; 2]) -> [Noise; 2] {
    let [a, b] = greedy(noise);
    [b, a]
}

#[test]
fn films_in_rounds_are_unbiased_and_self_steering_would_be_seen() {
    let (description, scene) = compile(SCENE, "board").unwrap();
    let in_rounds = |seed| plan(&description, &request(Technique::Gpt, 16, 2, seed));
    let even = measured(100_000..104_000, |seed| render(&scene, &plan(&description, &request(Technique::Gpt, 64, 1, seed))).unwrap());
    let compare = |found: Vec<Estimate>| {
        let (all, sum) = (even.len(), even.len() - 1);
        let [all, sum] =
            [0..all, sum..all].map(|range| Comparison::of(even[range.clone()].iter().copied().zip(found[range].iter().copied())));
        eprintln!("{all:?}\nthe sum alone: {sum:?}");
        all.agrees(LEVEL) && sum.agrees(LEVEL)
    };
    assert!(compare(measured(10_000..22_000, |seed| render_steered(&scene, &in_rounds(seed), 8, greedy).unwrap())));
    assert!(compare(measured(50_000..56_000, |seed| render_steered(&scene, &doubling(in_rounds(seed)), 8, greedy).unwrap())));
    // Each half steered by itself: values that happen to be large get more samples, which make them small again.
    assert!(!compare(measured(30_000..42_000, |seed| render_steered(&scene, &in_rounds(seed), 8, selfish).unwrap())));
}

#[test]
fn tiles_leave_no_trace_and_samples_go_where_noise_is() {
    let (description, scene) = compile(SCENE, "board").unwrap();
    let extent = Extent { width: 48, height: 36 };
    for technique in [Technique::Pt, Technique::Gpt] {
        let plan = plan(&description, &Request { extent: Some(extent), ..request(technique, 65, 4, 3) });
        let film = render_steered(&scene, &plan, 8, |noise| noise).unwrap();
        for edge in [5, 32] {
            assert_eq!(film, render_steered(&scene, &plan, edge, |noise| noise).unwrap(), "{technique:?}, tiles of {edge}");
        }
        let checked = Plan { samples: 120, ..doubling(plan.clone()) };
        let grown = render_steered(&scene, &checked, 8, |noise| noise).unwrap();
        assert_eq!(grown, render_steered(&scene, &checked, 32, |noise| noise).unwrap(), "{technique:?}, rounds that double");
        let counts = grown.counts.as_ref().unwrap().data();
        assert!(counts.iter().all(|n| *n >= 36.0) && counts.iter().any(|n| *n > 150.0), "most are placed");
        let counts = film.counts.as_ref().unwrap().data();
        let sum: f64 = counts.iter().map(|n| f64::from(*n)).sum();
        assert_eq!(sum, 65.0 * extent.pixels() as f64, "as many samples as planned");
        let (least, most) = counts.iter().fold((f32::MAX, 0.0f32), |(least, most), n| (least.min(*n), most.max(*n)));
        assert!(least >= plan.even_before(4) as f32 && most > 1.25 * 65.0, "{least} to {most}");
    }
}

#[test]
fn one_round_is_the_even_film() {
    let (description, scene) = compile(SCENE, "board").unwrap();
    let plan: Plan = plan(&description, &request(Technique::Gpt, 20, 1, 5));
    let layout = plan.layout();
    let mut frame = FrameFold::new(plan.extent, &layout);
    for tile in plan.extent.tiles(8) {
        let mut fold = TileFold::new(tile, &layout);
        for samples in plan.sample_ranges() {
            fold.add(&render_unit(&scene, &plan, &WorkUnit { moment: Moment::of(0), tile, samples })).unwrap();
        }
        frame.place(&fold).unwrap();
    }
    let film = frame.finish().unwrap();
    assert!(film.counts.is_none());
    assert_eq!(film, render(&scene, &plan).unwrap());
}

//! Gradients estimate differences of pixels, path length by path length, and the L2 image estimates the primal.
//!
//! Gradients and primals come from different seeds, so that they are independent. Seeds are the measurements: nothing is
//! assumed about the spread of single samples, which are stratified.

#![allow(clippy::unwrap_used)]

use gradfarm_core::film::{Film, Image};
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{ReconstructionKind, Request, Technique};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_tests::frame::render;
use gradfarm_tests::scenes::{StillLife, plan, still_lifes};
use gradfarm_tests::statistics::{Comparison, Estimate, student_tail};

/// Correct code fails each of about fifty comparisons with this probability.
const LEVEL: f64 = 2e-5;
const EXTENT: Extent = Extent { width: 7, height: 5 };
const DEPTHS: [u32; 4] = [2, 3, 4, 6];
const SEEDS: u64 = 20;

fn films(life: &StillLife, technique: Technique, max_depth: u32, samples: u32, first: u64) -> Vec<Film> {
    (first..first + SEEDS)
        .map(|seed| {
            let request = Request {
                technique: Some(technique),
                samples: Some(samples),
                extent: Some(EXTENT),
                max_depth: Some(max_depth),
                seed,
                ..Request::default()
            };
            render(&life.scene, &plan(&life.description, &request)).unwrap()
        })
        .collect()
}

/// Differences to the next column, then to the next row, of every pixel that has one, channel by channel.
fn differences(columns: impl Fn(u32, u32, usize) -> f32, rows: impl Fn(u32, u32, usize) -> f32) -> Vec<f64> {
    let mut found = Vec::new();
    for channel in 0..3 {
        for y in 0..EXTENT.height {
            for x in 0..EXTENT.width {
                if x + 1 < EXTENT.width {
                    found.push(f64::from(columns(x, y, channel)));
                }
                if y + 1 < EXTENT.height {
                    found.push(f64::from(rows(x, y, channel)));
                }
            }
        }
    }
    found
}

fn gradients(film: &Film) -> Vec<f64> {
    let gradients = film.combined().gradients.unwrap();
    differences(|x, y, c| gradients.dx.at(x, y, c), |x, y, c| gradients.dy.at(x, y, c))
}

fn differences_of(image: &Image) -> Vec<f64> {
    differences(|x, y, c| image.at(x + 1, y, c) - image.at(x, y, c), |x, y, c| image.at(x, y + 1, c) - image.at(x, y, c))
}

/// Estimates over runs, value by value.
fn estimates(runs: &[Vec<f64>]) -> Vec<Estimate> {
    (0..runs[0].len()).map(|k| Estimate::of(&runs.iter().map(|run| run[k]).collect::<Vec<_>>())).collect()
}

#[test]
fn gradients_estimate_differences_at_every_path_length() {
    for life in still_lifes().unwrap() {
        let name = life.name;
        for max_depth in DEPTHS {
            let measured: Vec<_> = films(&life, Technique::Gpt, max_depth, 96, 0).iter().map(gradients).collect();
            let primals: Vec<_> =
                films(&life, Technique::Pt, max_depth, 256, 1000).iter().map(|film| differences_of(&film.combined().primal)).collect();
            let compared = Comparison::of(estimates(&measured).into_iter().zip(estimates(&primals)));
            // The sum over each row of pixels telescopes: a bias too small for single pixels adds up.
            let total = |runs: &[Vec<f64>]| Estimate::of(&runs.iter().map(|run| run.iter().sum()).collect::<Vec<f64>>());
            let (t, freedom) = total(&measured).t(&total(&primals)).unwrap();
            eprintln!(
                "{name}, at most {max_depth} edges: {} values, worst |t| {:.2}, mean {:.3}, mean square {:.3}; sum t {t:.2}",
                compared.pairs, compared.worst, compared.mean, compared.mean_square
            );
            assert!(compared.agrees(LEVEL), "{name}, {max_depth} edges: value {} has a chance of {:e}", compared.place, compared.chance);
            assert!(student_tail(t, freedom) > LEVEL, "{name}, {max_depth} edges: the sum of gradients is off, t {t}");
            // Squares of t average to little more than 1 if variances are right; channels go together, so chance spreads them widely.
            assert!(compared.mean_square < 2.0, "{name}, {max_depth} edges: mean square {}", compared.mean_square);
        }
    }
}

#[test]
fn l2_images_estimate_the_primal_and_keep_its_sum() {
    for life in still_lifes().unwrap() {
        let name = life.name;
        let films = films(&life, Technique::Gpt, 6, 48, 0);
        let mut apart = Vec::new();
        for film in &films {
            let primal = film.combined();
            let reconstructed = reconstruct(film, ReconstructionKind::L2, 0.2).unwrap();
            let sum = |image: &Image| (0..3).map(|c| image.plane(c).iter().map(|v| f64::from(*v)).sum::<f64>()).collect::<Vec<_>>();
            // Constants have no gradient, so the primal alone decides about the sum.
            for (image, expected) in sum(&reconstructed.image).into_iter().zip(sum(&reconstructed.primal)) {
                assert!((image / expected - 1.0).abs() < 1e-5, "{name}: the image sums to {image}, the primal to {expected}");
            }
            let with_direct: Vec<f64> =
                primal.primal.data().iter().zip(primal.direct.data()).map(|(p, d)| f64::from(*p) + f64::from(*d)).collect();
            apart.push(reconstructed.image.data().iter().zip(with_direct).map(|(i, p)| f64::from(*i) - p).collect::<Vec<_>>());
        }
        // Pairs of one run share their noise; only what is left of it after reconstruction spreads.
        let compared = Comparison::of(estimates(&apart).into_iter().map(|e| (e, Estimate::known(0.0, 1e-6))));
        eprintln!("{name}: {} values, worst |t| {:.2}, mean square {:.3}", compared.pairs, compared.worst, compared.mean_square);
        assert!(compared.agrees(LEVEL), "{name}: value {} has a chance of {:e}", compared.place, compared.chance);
    }
}

//! Gradients estimate differences of pixels, path length by path length, for every technique with every shift; and the L2 image
//! estimates the primal.
//!
//! Estimates are sums over path lengths, and a path does not know how long it could become: what frames of at most L edges have
//! over those of at most L − 1, drawn by the same numbers, is what paths of exactly L edges carry.
//!
//! Gradients and primals come from different seeds, so that they are independent. Seeds are the measurements: nothing is
//! assumed about the spread of single samples, which are stratified.

#![allow(clippy::unwrap_used)]

use gradfarm_core::film::{Film, Image};
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{ReconstructionKind, Request, ShiftKind, Technique, resolve};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_tests::frame::render;
use gradfarm_tests::scenes::{StillLife, compile, plan, still_lifes};
use gradfarm_tests::statistics::{Comparison, Estimate, student_tail};

/// Correct code fails each of about five hundred comparisons with this probability.
const LEVEL: f64 = 2e-6;
const EXTENT: Extent = Extent { width: 6, height: 4 };
/// Longest paths that are told apart [edges].
const LONGEST: u32 = 6;
const SEEDS: u64 = 20;
/// A technique with a shift, or with none.
type Method = (Technique, Option<ShiftKind>);

/// Every technique that measures differences to the next pixel, with every shift that it takes.
fn methods(life: &StillLife) -> Vec<Method> {
    let all = Technique::ALL.into_iter().flat_map(|technique| ShiftKind::ALL.map(|shift| (technique, Some(shift))));
    all.filter(|(technique, _)| technique.takes(ReconstructionKind::L2))
        .filter(|method| resolve(&life.description, &request(*method, LONGEST, 2, 0)).is_ok())
        .collect()
}

fn told(method: Method) -> String {
    format!("{} by shift {}", method.0.name(), method.1.map_or("none", ShiftKind::name))
}

fn request((technique, shift): Method, max_depth: u32, samples: u32, seed: u64) -> Request {
    let (technique, samples, extent, max_depth) = (Some(technique), Some(samples), Some(EXTENT), Some(max_depth));
    Request { technique, shift, samples, extent, max_depth, reuse_edge: Some(3), seed, ..Request::default() }
}

fn films(life: &StillLife, method: Method, max_depth: u32, samples: u32, first: u64) -> Vec<Film> {
    let film = |seed| render(&life.scene, &plan(&life.description, &request(method, max_depth, samples, seed))).unwrap();
    (first..first + SEEDS).map(film).collect()
}

/// What `values` reads off films of paths of exactly 2, 3, … edges: by length, then by seed.
fn by_length(life: &StillLife, method: Method, samples: u32, first: u64, values: impl Fn(&Film) -> Vec<f64>) -> Vec<Vec<Vec<f64>>> {
    let read = |depth| films(life, method, depth, samples, first).iter().map(&values).collect::<Vec<_>>();
    let mut shorter = read(1);
    let mut lengths = Vec::new();
    for depth in 2..=LONGEST {
        let longer = read(depth);
        let apart = |(l, s): (&Vec<f64>, &Vec<f64>)| l.iter().zip(s).map(|(l, s)| l - s).collect();
        lengths.push(longer.iter().zip(&shorter).map(apart).collect());
        shorter = longer;
    }
    lengths
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
        let primals = by_length(&life, (Technique::Pt, None), 512, 1000, |film| differences_of(&film.combined().primal));
        for method in methods(&life) {
            let measured = by_length(&life, method, 32, 0, gradients);
            for (length, (measured, primals)) in (2..).zip(measured.iter().zip(&primals)) {
                let what = format!("{}, {}, {length} edges", life.name, told(method));
                let compared = Comparison::of(estimates(measured).into_iter().zip(estimates(primals)));
                // The sum over each row of pixels telescopes: a bias too small for single pixels adds up.
                let total = |runs: &[Vec<f64>]| Estimate::of(&runs.iter().map(|run| run.iter().sum()).collect::<Vec<f64>>());
                let (t, freedom) = total(measured).t(&total(primals)).unwrap();
                eprintln!(
                    "{what}: {} values, worst |t| {:.2}, mean {:.3}, mean square {:.3}; sum t {t:.2}",
                    compared.pairs, compared.worst, compared.mean, compared.mean_square
                );
                assert!(compared.agrees(LEVEL), "{what}: value {} has a chance of {:e}", compared.place, compared.chance);
                assert!(student_tail(t, freedom) > LEVEL, "{what}: the sum of gradients is off, t {t}");
                // Squares of t average to little more than 1 if variances are right. Channels go together, and the primals are the same for
                // all methods, so chance spreads them widely.
                assert!(compared.mean_square < 2.8, "{what}: mean square {}", compared.mean_square);
            }
        }
    }
}

#[test]
fn no_shift_touches_the_primal_of_its_base_paths() {
    for life in still_lifes().unwrap() {
        let without = films(&life, (Technique::Pt, None), LONGEST, 4, 7);
        for shift in ShiftKind::ALL {
            let with = films(&life, (Technique::Gpt, Some(shift)), LONGEST, 4, 7);
            for (with, without) in with.iter().zip(&without) {
                for (with, without) in with.halves.iter().zip(&without.halves) {
                    assert_eq!(with.primal, without.primal, "{}, {}", life.name, shift.name());
                    assert_eq!(with.direct, without.direct, "{}, {}", life.name, shift.name());
                }
            }
        }
    }
}

#[test]
fn an_even_plane_under_an_even_sky_has_no_difference_at_all() {
    // Light at infinity keeps its direction, and every point of the plane scatters alike: each path's difference is zero but for
    // rounding, not only their mean.
    let text = r#"{
        "version": 1,
        "camera": { "perspective": { "to_world": [{ "look_at": { "origin": [0, 2, -2], "target": [0, 0, 0] } }], "fov": 40 } },
        "materials": { "plane": { "diffuse": { "reflectance": [0.3, 0.5, 0.8] } } },
        "shapes": [{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [90, 1, 90] }], "material": "plane" }],
        "environment": { "radiance": [1, 2, 3] },
        "lights": [{ "directional": { "direction": [0.3, -1, 0.2], "irradiance": 1 } }]
    }"#;
    let (description, scene) = compile(text, "plane under the sky").unwrap();
    let life = StillLife { name: "plane under the sky", description, scene };
    for method in methods(&life) {
        for film in films(&life, method, LONGEST, 16, 0) {
            assert!(film.combined().primal.data().iter().all(|v| *v > 0.0));
            let worst = gradients(&film).into_iter().fold(0.0f64, |worst, v| worst.max(v.abs()));
            assert!(worst < 1e-6, "{}: {worst:e}", told(method));
        }
    }
}

#[test]
fn l2_images_estimate_the_primal_and_keep_its_sum() {
    for life in still_lifes().unwrap() {
        let name = life.name;
        let films = films(&life, (Technique::Gpt, None), LONGEST, 48, 0);
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

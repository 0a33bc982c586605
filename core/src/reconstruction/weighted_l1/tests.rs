//! The weighted norm: the plain one where noise is alike, weights from the other half, and less error where noise differs.

use super::super::l1;
use super::super::tests::{differences, random};
use super::super::weighted::tests::{Noise, Uneven, worst};
use super::*;
use crate::lattice::Extent;

#[test]
fn equal_noise_gives_the_plain_norm() {
    for (w, h) in [(1, 1), (1, 9), (7, 1), (16, 12), (33, 17)] {
        let extent = Extent { width: w, height: h };
        let (p, dx, dy) = (random(extent, 1, 2.0), random(extent, 2, 0.5), random(extent, 3, 0.5));
        // 3 · 0.25 of the primal against 0.03 of differences: √(0.03 / 0.75) = 0.2.
        let noise = Noise::even(extent, 0.25, 0.03);
        let m = Measurements { variance: Some(noise.variance()), ..Measurements::new(&p, &dx, &dy) };
        let (weighted, report) = WeightedL1.solve(&m, None, 1.0).unwrap();
        let (expected, _) = l1::L1.solve(&m, None, 0.2).unwrap();
        assert!(worst(&weighted, &expected) < 1e-3, "{w}×{h}: {}", worst(&weighted, &expected));
        assert!(report.residual <= 1e-2 && WeightedL1.alpha(&m) == 1.0);
        // Nothing varies: the usual weight, and the plain norm again.
        let silent = Noise::even(extent, 0.0, 0.0);
        let m = Measurements { variance: Some(silent.variance()), ..m };
        assert_eq!(WeightedL1.alpha(&m), noise::TYPICAL);
        assert!(worst(&WeightedL1.solve(&m, None, 0.2).unwrap().0, &expected) < 1e-3);
    }
}

#[test]
fn no_small_step_lowers_the_weighted_sum() {
    let extent = Extent { width: 12, height: 10 };
    let (p, dx, dy) = (random(extent, 1, 2.0), random(extent, 2, 0.5), random(extent, 3, 0.5));
    let noise = Noise::of(extent, 5);
    let m = Measurements { variance: Some(noise.variance()), ..Measurements::new(&p, &dx, &dy) };
    let (image, _) = WeightedL1.solve(&m, None, 1.0).unwrap();
    let deviations = Deviations::new(Variances::new(&noise.variance()), 1.0);
    let sum = |image: &Image| l1::told(&m, image, &deviations);
    let best = sum(&image);
    for seed in 0..50 {
        for step in [0.1, 0.01] {
            let mut moved = image.clone();
            moved.data_mut().iter_mut().zip(random(extent, 100 + seed, step).data()).for_each(|(v, d)| *v += d);
            assert!(sum(&moved) > best * (1.0 - 2e-3), "{} after {best}", sum(&moved));
        }
    }
    let plain = l1::L1.solve(&m, None, deviations.typical).unwrap().0;
    assert!(sum(&plain) > best, "the weights matter: {} against {best}", sum(&plain));
}

#[test]
fn weights_come_from_the_other_half_and_are_asked_for() {
    let extent = Extent { width: 12, height: 9 };
    let (p, dx, dy) = (random(extent, 1, 2.0), random(extent, 2, 0.5), random(extent, 3, 0.5));
    let (own, other) = (Noise::of(extent, 5), Noise::of(extent, 15));
    let bare = Measurements::new(&p, &dx, &dy);
    let m = Measurements { variance: Some(own.variance()), ..bare };
    let n = Measurements { variance: Some(other.variance()), ..bare };
    assert_eq!(WeightedL1.solve(&bare, Some(&n), 1.0).unwrap(), WeightedL1.solve(&n, None, 1.0).unwrap());
    assert_ne!(WeightedL1.solve(&m, Some(&n), 1.0).unwrap(), WeightedL1.solve(&m, None, 1.0).unwrap());
    assert!(WeightedL1.solve(&bare, None, 1.0).unwrap_err().to_string().contains("needs variances"));
}

#[test]
fn uneven_noise_costs_less_than_without_weights_and_leaves_no_trend() {
    let extent = Extent { width: 24, height: 18 };
    let mut sum = vec![0.0f64; 3 * extent.pixels()];
    let (mut one, mut plain) = (0.0, 0.0);
    const RUNS: usize = 64;
    for k in 0..RUNS {
        let (a, b) = (Uneven::new(extent, 100 + 20 * k), Uneven::new(extent, 110 + 20 * k));
        let (image, _) = WeightedL1.solve(&a.measurements(), Some(&b.measurements()), 1.0).unwrap();
        sum.iter_mut().zip(image.data()).for_each(|(s, v)| *s += f64::from(*v));
        one += a.squared_error(&image) / RUNS as f64;
        plain += a.squared_error(&l1::L1.solve(&a.measurements(), None, 0.2).unwrap().0) / RUNS as f64;
    }
    // Noise that is symmetric about the truth moves no norm's minimum to one side: what is left of the mean is noise.
    let mean = Image::from_planes(extent, 3, sum.iter().map(|s| (s / RUNS as f64) as f32).collect()).unwrap();
    let left = Uneven::new(extent, 0).squared_error(&mean) * RUNS as f64;
    eprintln!("squared error {one:.3e} weighted, {plain:.3e} plain; of the mean of {RUNS} times {RUNS}: {left:.3e}");
    assert!(one < 0.8 * plain, "{one} weighted, {plain} plain");
    assert!((left / one - 1.0).abs() < 0.5, "{left} against {one}");
}

#[test]
fn an_outlier_is_passed_over_where_its_place_is_known_as_quiet() {
    let extent = Extent { width: 24, height: 24 };
    let image = super::super::tests::picture(extent);
    let (mut dx, dy) = differences(&image);
    dx.set(5, 12, 0, 40.0);
    let noise = Noise::of(extent, 3);
    let m = Measurements { variance: Some(noise.variance()), ..Measurements::new(&image, &dx, &dy) };
    let (solved, _) = WeightedL1.solve(&m, None, 1.0).unwrap();
    assert!(worst(&solved, &image) < 0.05, "{}", worst(&solved, &image));
}

#[test]
fn odd_films_are_solved() {
    for (w, h) in [(1, 1), (1, 40), (40, 1), (2, 2), (31, 5)] {
        let extent = Extent { width: w, height: h };
        let noise = Noise::of(extent, 3);
        let full = |f: &dyn Fn(usize) -> f32| Image::from_planes(extent, 3, (0..3 * extent.pixels()).map(f).collect()).unwrap();
        for truth in [full(&|_| 0.0), full(&|_| 7.0), full(&|k| (k % 2) as f32), full(&|k| 10f32.powi((k % 31) as i32 - 15))] {
            let (dx, dy) = differences(&truth);
            let m = Measurements { variance: Some(noise.variance()), ..Measurements::new(&truth, &dx, &dy) };
            let (image, _) = WeightedL1.solve(&m, None, 1.0).unwrap();
            let largest = truth.data().iter().fold(0.0f32, |a, b| a.max(*b));
            assert!(worst(&image, &truth) <= 1e-3 * largest, "{w}×{h}: {}", worst(&image, &truth));
        }
    }
}

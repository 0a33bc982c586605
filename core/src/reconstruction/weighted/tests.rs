//! Weighted least squares: against least squares where weights are alike, no bias from cross weights, and less noise where noise differs.

use super::*;
use crate::lattice::Extent;
use crate::reconstruction::tests::{differences, picture, random};
use crate::reconstruction::{Variance, l2};

/// Variances of any kind.
pub(in crate::reconstruction) struct Noise {
    primal: Image,
    dx: Image,
    dy: Image,
}

impl Noise {
    /// Between 0 and 1.
    pub(in crate::reconstruction) fn of(extent: Extent, seed: usize) -> Self {
        let positive = |seed: usize, channels: usize| {
            let values = random(extent, seed, 1.0).data()[..channels * extent.pixels()].iter().map(|v| v + 0.5).collect();
            Image::from_planes(extent, channels, values).unwrap()
        };
        Self { primal: positive(seed, 3), dx: positive(seed + 1, 1), dy: positive(seed + 2, 1) }
    }

    /// The same everywhere: of each channel of the primal, and of each difference.
    pub(in crate::reconstruction) fn even(extent: Extent, primal: f32, difference: f32) -> Self {
        let full = |channels: usize, value: f32| Image::from_planes(extent, channels, vec![value; channels * extent.pixels()]).unwrap();
        Self { primal: full(3, primal), dx: full(1, difference), dy: full(1, difference) }
    }

    pub(in crate::reconstruction) fn variance(&self) -> Variance<'_> {
        Variance { primal: &self.primal, dx: &self.dx, dy: &self.dy }
    }
}

pub(in crate::reconstruction) fn worst(a: &Image, b: &Image) -> f32 {
    a.data().iter().zip(b.data()).fold(0.0, |w, (a, b)| w.max((a - b).abs()))
}

#[test]
fn equal_weights_give_least_squares() {
    for (w, h) in [(1, 1), (1, 9), (7, 1), (16, 12), (33, 17)] {
        let extent = Extent { width: w, height: h };
        let (p, dx, dy) = (random(extent, 1, 2.0), random(extent, 2, 0.5), random(extent, 3, 0.5));
        // 3 · 0.25 of the primal against 0.03 of differences: √(0.03 / 0.75) = 0.2.
        let noise = Noise::even(extent, 0.25, 0.03);
        let m = Measurements { variance: Some(noise.variance()), ..Measurements::new(&p, &dx, &dy) };
        let (weighted, report) = WeightedL2.solve(&m, None, 1.0).unwrap();
        let (expected, _) = l2::L2.solve(&m, None, 0.2).unwrap();
        assert!(worst(&weighted, &expected) < 1e-3, "{w}×{h}: {}", worst(&weighted, &expected));
        assert!(report.residual <= TOLERANCE);
        assert_eq!(WeightedL2.alpha(&m), 1.0);
        // Nothing varies: the usual weight, and least squares again.
        let silent = Noise::even(extent, 0.0, 0.0);
        let m = Measurements { variance: Some(silent.variance()), ..m };
        assert_eq!(WeightedL2.alpha(&m), noise::TYPICAL);
        assert!(worst(&WeightedL2.solve(&m, None, 0.2).unwrap().0, &expected) < 1e-3);
    }
}

#[test]
fn weights_come_from_the_other_half_and_are_asked_for() {
    let extent = Extent { width: 12, height: 9 };
    let (p, dx, dy) = (random(extent, 1, 2.0), random(extent, 2, 0.5), random(extent, 3, 0.5));
    let (own, other) = (Noise::of(extent, 5), Noise::of(extent, 15));
    let bare = Measurements::new(&p, &dx, &dy);
    let m = Measurements { variance: Some(own.variance()), ..bare };
    let n = Measurements { variance: Some(other.variance()), ..bare };
    assert_eq!(WeightedL2.solve(&bare, Some(&n), 1.0).unwrap(), WeightedL2.solve(&n, None, 1.0).unwrap());
    assert_ne!(WeightedL2.solve(&m, Some(&n), 1.0).unwrap(), WeightedL2.solve(&m, None, 1.0).unwrap());
    assert!(WeightedL2.solve(&bare, None, 1.0).unwrap_err().to_string().contains("needs variances"));
}

/// Measurements whose differences are all but free of noise in one half of the picture and noisier than the primal in the other, with the
/// variances that tell so.
pub(in crate::reconstruction) struct Uneven {
    truth: Image,
    p: Image,
    dx: Image,
    dy: Image,
    noise: Noise,
}

impl Uneven {
    pub(in crate::reconstruction) fn new(extent: Extent, seed: usize) -> Self {
        let truth = picture(extent);
        let (dx, dy) = differences(&truth);
        let pixels = extent.pixels();
        // Uniform on ±½ σ √12; variances as from a few samples, a factor of up to two off.
        let spoil = |image: &Image, sigma: &dyn Fn(usize) -> f32, seed: usize| {
            let (mut image, unit) = (image.clone(), random(extent, seed, 12f32.sqrt()));
            for (k, v) in image.data_mut().iter_mut().enumerate() {
                *v += sigma(k % pixels) * unit.data()[k];
            }
            image
        };
        let guess = |sigma: &dyn Fn(usize) -> f32, channels: usize, seed: usize| {
            let off = random(extent, seed, 1.0);
            let value = |k: usize| sigma(k % pixels).powi(2) * (1.0 + off.data()[k]) * if channels == 1 { 3.0 } else { 1.0 };
            Image::from_planes(extent, channels, (0..channels * pixels).map(value).collect()).unwrap()
        };
        let primal = |_| 0.3;
        let difference = |pixel: usize| if (pixel % extent.width as usize) * 2 < extent.width as usize { 0.5 } else { 0.015 };
        let noise = Noise { primal: guess(&primal, 3, seed + 3), dx: guess(&difference, 1, seed + 4), dy: guess(&difference, 1, seed + 5) };
        Self { p: spoil(&truth, &primal, seed), dx: spoil(&dx, &difference, seed + 1), dy: spoil(&dy, &difference, seed + 2), truth, noise }
    }

    pub(in crate::reconstruction) fn measurements(&self) -> Measurements<'_> {
        Measurements { variance: Some(self.noise.variance()), ..Measurements::new(&self.p, &self.dx, &self.dy) }
    }

    pub(in crate::reconstruction) fn squared_error(&self, image: &Image) -> f64 {
        image.data().iter().zip(self.truth.data()).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / image.data().len() as f64
    }
}

#[test]
fn the_mean_of_many_cross_weighted_images_tends_to_the_truth() {
    let extent = Extent { width: 24, height: 18 };
    let mut sum = vec![0.0f64; 3 * extent.pixels()];
    let (mut one, mut plain) = (0.0, 0.0);
    const RUNS: usize = 256;
    for k in 0..RUNS {
        let (a, b) = (Uneven::new(extent, 100 + 20 * k), Uneven::new(extent, 110 + 20 * k));
        let (image, _) = WeightedL2.solve(&a.measurements(), Some(&b.measurements()), 1.0).unwrap();
        sum.iter_mut().zip(image.data()).for_each(|(s, v)| *s += f64::from(*v));
        one += a.squared_error(&image) / RUNS as f64;
        plain += a.squared_error(&l2::L2.solve(&a.measurements(), None, 0.2).unwrap().0) / RUNS as f64;
    }
    let mean = Image::from_planes(extent, 3, sum.iter().map(|s| (s / RUNS as f64) as f32).collect()).unwrap();
    let left = Uneven::new(extent, 0).squared_error(&mean) * RUNS as f64;
    eprintln!("squared error {one:.3e} weighted, {plain:.3e} plain; of the mean of {RUNS} times {RUNS}: {left:.3e}");
    // The squared error of a mean of K is a Kth part, but for a bias, which would stay and count K times here. Noise of 1296 values, of
    // which neighbours share theirs, leaves that a few percent either way.
    assert!((left / one - 1.0).abs() < 0.25, "{left} against {one}");
    assert!(one < 0.8 * plain, "{one} weighted, {plain} plain");
}

#[test]
fn odd_films_are_solved() {
    for (w, h) in [(1, 1), (1, 40), (40, 1), (2, 2), (31, 5)] {
        let extent = Extent { width: w, height: h };
        let noise = Noise::of(extent, 3);
        let solve = |truth: &Image| {
            let (dx, dy) = differences(truth);
            let m = Measurements { variance: Some(noise.variance()), ..Measurements::new(truth, &dx, &dy) };
            WeightedL2.solve(&m, None, 1.0).unwrap().0
        };
        let full = |f: &dyn Fn(usize) -> f32| Image::from_planes(extent, 3, (0..3 * extent.pixels()).map(f).collect()).unwrap();
        // Black, constant, half black, and over thirty orders of magnitude.
        assert_eq!(solve(&full(&|_| 0.0)), full(&|_| 0.0));
        let constant = full(&|_| 7.0);
        assert!(worst(&solve(&constant), &constant) < 1e-4);
        let half = full(&|k| if k % 2 == 0 { 0.0 } else { 1.0 });
        assert!(worst(&solve(&half), &half) < 1e-4);
        let steep = full(&|k| 10f32.powi((k % 31) as i32 - 15));
        let solved = solve(&steep);
        assert!(solved.data().iter().all(|v| v.is_finite()) && worst(&solved, &steep) < 1e-4 * 1e15);
    }
}

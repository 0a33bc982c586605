//! Pixel filters, by importance: a sample belongs to one pixel and falls where the filter's size says, so that a gradient is
//! the difference of two filtered pixels.
//!
//! # Source
//! Ernst, Stamminger and Greiner, "Filter Importance Sampling", IEEE Symposium on Interactive Ray Tracing, 2006; Mitchell and
//! Netravali, "Reconstruction Filters in Computer Graphics", SIGGRAPH 1988, equation 8.

use crate::sampling::Discrete;
use std::sync::Arc;

/// How radiance around a pixel's centre makes its value. Its integral is 1.
#[derive(Clone, Debug, Default)]
pub enum PixelFilter {
    /// The mean over the pixel's area.
    #[default]
    Box,
    /// A tent that falls to zero at this distance [pixels], > 0.
    Tent(f32),
    /// Any other product of two equal curves.
    Curve(Arc<Curve>),
}

/// A filter along one axis as a staircase of [`STEPS`] even steps.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Half its width [pixels].
    radius: f32,
    /// Choice of a step by the size of its integral.
    choice: Discrete,
    /// Weight of a sample in each step: the sign of its integral, times ∫|f| / ∫f.
    weights: Vec<f32>,
}

/// Steps of a curve. The filter that is rendered is this staircase: each step holds the curve's integral over it.
const STEPS: usize = 512;

impl PixelFilter {
    /// A Gaussian of this standard deviation, lowered so that it is zero at `radius` [pixels]; both > 0.
    pub fn gaussian(deviation: f64, radius: f64) -> Self {
        let bell = |x: f64| libm::exp(-0.5 * (x / deviation) * (x / deviation));
        Self::curve(radius, |x| bell(x) - bell(radius))
    }

    /// Mitchell and Netravali's cubic with the parameters B and C, over ±2 pixels. The sum of its shifted copies is 1.
    pub fn mitchell(b: f64, c: f64) -> Self {
        let near = [(12.0 - 9.0 * b - 6.0 * c), (-18.0 + 12.0 * b + 6.0 * c), 0.0, (6.0 - 2.0 * b)];
        let far = [(-b - 6.0 * c), (6.0 * b + 30.0 * c), (-12.0 * b - 48.0 * c), (8.0 * b + 24.0 * c)];
        Self::curve(2.0, |x| {
            let x = x.abs();
            let [p, q, r, s] = if x < 1.0 { near } else { far };
            (((p * x + q) * x + r) * x + s) / 6.0
        })
    }

    /// From a curve over ±radius. A curve whose integral is not > 0 has no filter: it becomes the box.
    fn curve(radius: f64, value: impl Fn(f64) -> f64) -> Self {
        let width = 2.0 * radius / STEPS as f64;
        // Simpson's rule is exact for cubics.
        let integrals: Vec<f64> = (0..STEPS)
            .map(|k| {
                let a = k as f64 * width - radius;
                (value(a) + 4.0 * value(a + 0.5 * width) + value(a + width)) * (width / 6.0)
            })
            .collect();
        let (sum, size) = integrals.iter().fold((0.0, 0.0), |(sum, size), x| (sum + x, size + x.abs()));
        let sizes: Vec<f32> = integrals.iter().map(|x| x.abs() as f32).collect();
        match Discrete::new(&sizes) {
            Some(choice) if sum > 0.0 => {
                let weight = (size / sum) as f32;
                // A filter without negative lobes weighs exactly 1.
                let weights = integrals.iter().map(|x| if *x < 0.0 { -weight } else { weight }).collect();
                PixelFilter::Curve(Arc::new(Curve { radius: radius as f32, choice, weights }))
            }
            _ => PixelFilter::Box,
        }
    }

    /// Where a sample falls for two numbers in [0, 1)² [pixels, from the upper left corner of its pixel], and its weight [1], which
    /// is below zero in negative lobes. The mean of all weights is 1.
    #[inline]
    pub fn place(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        match self {
            PixelFilter::Box => (u, 1.0),
            PixelFilter::Tent(radius) => (u.map(|u| 0.5 + radius * tent(u)), 1.0),
            PixelFilter::Curve(curve) => {
                let ([x, a], [y, b]) = (curve.place(u[0]), curve.place(u[1]));
                ([x, y], a * b)
            }
        }
    }
}

impl Curve {
    #[inline]
    fn place(&self, u: f32) -> [f32; 2] {
        let (step, _, rest) = self.choice.sample(u);
        let x = (step as f32 + rest) * (2.0 / STEPS as f32) - 1.0;
        [0.5 + self.radius * x, self.weights[step]]
    }
}

/// A number in [-1, 1) with density 1 − |x|.
#[inline]
fn tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 * (1.0 - u)).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and second moment of the filter along x, and the mean weight, by a grid of samples.
    fn moments(filter: &PixelFilter) -> [f64; 3] {
        let n = 1 << 18;
        let mut sums = [0.0f64; 3];
        for k in 0..n {
            let ([x, _], weight) = filter.place([(k as f32 + 0.5) / n as f32, (f64::from(k) * 0.618_033_988_749_895).fract() as f32]);
            let (x, weight) = (f64::from(x) - 0.5, f64::from(weight));
            for (sum, term) in sums.iter_mut().zip([weight, weight * x, weight * x * x]) {
                *sum += term / f64::from(n);
            }
        }
        sums
    }

    #[test]
    fn filters_have_their_closed_form_moments() {
        let (cut, deviation) = (2.0f64, 0.5f64);
        // The lowered Gaussian by a fine sum.
        let bell = |x: f64| (-0.5 * (x / deviation) * (x / deviation)).exp() - (-0.5 * (cut / deviation) * (cut / deviation)).exp();
        let sums = (0..100_000).map(|k| (k as f64 + 0.5) * 4e-5 - cut).fold([0.0; 2], |s, x| [s[0] + bell(x), s[1] + x * x * bell(x)]);
        for (name, filter, second) in [
            ("box", PixelFilter::Box, 1.0 / 12.0),
            ("tent", PixelFilter::Tent(1.5), 1.5 * 1.5 / 6.0),
            ("gaussian", PixelFilter::gaussian(deviation, cut), sums[1] / sums[0]),
            // ∫x²f = B/3 whatever C: from the two cubics.
            ("mitchell", PixelFilter::mitchell(1.0 / 3.0, 1.0 / 3.0), 1.0 / 9.0),
            ("b-spline", PixelFilter::mitchell(1.0, 0.0), 1.0 / 3.0),
            ("catmull-rom", PixelFilter::mitchell(0.0, 0.5), 0.0),
        ] {
            let [weight, mean, square] = moments(&filter);
            assert!((weight - 1.0).abs() < 2e-3, "{name}: weight {weight}");
            assert!(mean.abs() < 1e-3, "{name}: mean {mean}");
            assert!((square - second).abs() < 2e-3, "{name}: second moment {square}, expected {second}");
        }
    }

    #[test]
    fn filters_without_negative_lobes_weigh_exactly_one() {
        for filter in [PixelFilter::Tent(0.7), PixelFilter::gaussian(0.5, 2.0), PixelFilter::mitchell(1.0, 0.0)] {
            assert!((0..1000).all(|k| filter.place([k as f32 / 1000.0, 0.3]).1 == 1.0));
        }
        let sharp = PixelFilter::mitchell(1.0 / 3.0, 1.0 / 3.0);
        assert!((0..1000).any(|k| sharp.place([k as f32 / 1000.0, 0.5]).1 < 0.0));
    }
}

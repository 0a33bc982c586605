//! Image-space control variates: each pixel is averaged again and again with what its neighbours say it is, their value and the measured
//! difference to them.
//!
//! The uniform one gives all of them the same weight. It is linear, so unbiased where the measurements are; many iterations pull towards
//! the gradients as a small α does. The weighted one weighs by variance: a pixel's variance falls with each iteration, and a noisy
//! difference stays noisy. Weights of a half come from the variances of the other half, which tell nothing about its values, and so the
//! halves stay unbiased and their mean too. A half that stands alone weighs itself by its own variances, which biases.
//!
//! # Source
//! Rousselle, Jarosz and Novák, "Image-space Control Variates for Rendering", ACM TOG 35(6), 2016.

use super::field::Field;
use super::smooth::smoothed;
use super::{Measurements, Reconstruct, ReconstructError, SolveReport, Variance};
use crate::film::Image;

/// All neighbours count alike.
pub(super) struct Uniform;

/// Neighbours count by the inverse of their variance.
pub(super) struct Weighted;

/// Most iterations: an image of any size is done in a few seconds, and α is then below one hundredth of the usual.
const MOST: u32 = 500;
/// Iterations of the weighted one. The fall of variance that its weights suppose has then long come to rest.
const WEIGHTED: u32 = 50;
/// What is added to each variance, over the mean of all primal variances: nothing is trusted without limit.
const EPSILON: f64 = 1e-2;
/// Pixels to each side over which a variance is smoothed: estimates of few samples are too rough to weigh by.
const RADIUS: usize = 1;

impl Reconstruct for Uniform {
    fn joins_halves(&self) -> bool {
        true
    }

    fn is_unbiased(&self) -> bool {
        true
    }

    fn solve(&self, own: &Measurements, _other: Option<&Measurements>, alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        let (width, height) = (own.extent.width as usize, own.extent.height as usize);
        iterate(own, iterations(alpha), &Weights::alike(width, height))
    }
}

impl Reconstruct for Weighted {
    fn joins_halves(&self) -> bool {
        true
    }

    fn is_unbiased(&self) -> bool {
        true
    }

    fn solve(&self, own: &Measurements, other: Option<&Measurements>, _alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        let variance = other.unwrap_or(own).variance;
        let weights = Weights::of(own, variance.ok_or(ReconstructError::NoVariances { wanted: "weighted-cv" })?);
        iterate(own, WEIGHTED, &weights)
    }
}

/// How many iterations keep half the power of the primal at the frequency where least squares with this α do. Far from the lattice's
/// limit one iteration multiplies a wave of frequency ω by 1 − ω²/5, and least squares by α² / (α² + ω²): k = 5 ln 2 / α².
fn iterations(alpha: f32) -> u32 {
    let k = 5.0 * std::f64::consts::LN_2 / (f64::from(alpha) * f64::from(alpha));
    k.round().clamp(1.0, f64::from(MOST)) as u32
}

/// How uncertain each value is, in units of what is uncertain everywhere.
struct Weights {
    width: usize,
    primal: Vec<f32>,
    dx: Vec<f32>,
    dy: Vec<f32>,
}

impl Weights {
    fn alike(width: usize, height: usize) -> Self {
        let zeros = || vec![0.0; width * height];
        Self { width, primal: zeros(), dx: zeros(), dy: zeros() }
    }

    fn of(m: &Measurements, variance: Variance) -> Self {
        let (width, height) = (m.extent.width as usize, m.extent.height as usize);
        let mut primal = vec![0.0f32; width * height];
        for c in 0..3 {
            primal.iter_mut().zip(variance.primal.plane(c)).for_each(|(sum, v)| *sum += v);
        }
        let mean = primal.iter().map(|v| f64::from(*v)).sum::<f64>() / primal.len().max(1) as f64;
        // Without noise, or with noise beyond all numbers, nothing can be told apart.
        if !(mean > 0.0 && mean.is_finite()) {
            return Self::alike(width, height);
        }
        let scale = (1.0 / (EPSILON * mean)) as f32;
        let scaled = |values: &[f32]| {
            let mut smooth = smoothed(values, width, height, RADIUS);
            smooth.iter_mut().for_each(|v| *v = (*v * scale).min(1e20));
            smooth
        };
        Self { width, primal: scaled(&primal), dx: scaled(variance.dx.plane(0)), dy: scaled(variance.dy.plane(0)) }
    }

    fn row<'a>(&self, values: &'a [f32], y: usize) -> &'a [f32] {
        &values[y * self.width..(y + 1) * self.width]
    }

    /// Fills in the weights of one row of pixels, when variances have fallen by `factor`.
    fn fill(&self, y: usize, height: usize, factor: f32, row: &mut Weighing) {
        let w = self.width;
        let one = |v: f32| 1.0 / (1.0 + v);
        let (here, dx, dy) = (self.row(&self.primal, y), self.row(&self.dx, y), self.row(&self.dy, y));
        let above = y.checked_sub(1).map(|y| (self.row(&self.primal, y), self.row(&self.dy, y)));
        let below = (y + 1 < height).then(|| self.row(&self.primal, y + 1));
        for x in 0..w {
            let own = one(factor * here[x]);
            let left = if x > 0 { one(factor * here[x - 1] + dx[x - 1]) } else { 0.0 };
            let right = if x + 1 < w { one(factor * here[x + 1] + dx[x]) } else { 0.0 };
            let up = above.map_or(0.0, |(primal, dy)| one(factor * primal[x] + dy[x]));
            let down = below.map_or(0.0, |primal| one(factor * primal[x] + dy[x]));
            let sum = 1.0 / (own + left + right + up + down);
            (row.left[x], row.right[x]) = (left * sum, right * sum);
            (row.up[x], row.down[x]) = (up * sum, down * sum);
        }
    }
}

/// Weights of the neighbours of a row of pixels; the pixel itself has what is left of 1.
struct Weighing {
    left: Vec<f32>,
    right: Vec<f32>,
    up: Vec<f32>,
    down: Vec<f32>,
}

impl Weighing {
    fn new(width: usize) -> Self {
        let zeros = || vec![0.0; width];
        Self { left: zeros(), right: zeros(), up: zeros(), down: zeros() }
    }
}

fn iterate(m: &Measurements, iterations: u32, weights: &Weights) -> Result<(Image, SolveReport), ReconstructError> {
    let (width, height) = (m.extent.width as usize, m.extent.height as usize);
    let mut image = m.primal.clone();
    if width * height == 0 {
        return Ok((image, SolveReport::default()));
    }
    let (mut now, mut next) = (Field::from_image(m.primal), Field::new(width, height));
    let (dx, dy) = (Field::from_image(m.dx), Field::from_image(m.dy));
    let (mut factor, mut gain) = (1.0f64, 4.0f64);
    for _ in 0..iterations {
        let row = |weighing: &mut Weighing, y: usize, out: &mut [f32]| {
            weights.fill(y, height, factor as f32, weighing);
            for (c, out) in out.chunks_exact_mut(width).enumerate() {
                average([&now, &dx, &dy], y, c, weighing, out);
            }
        };
        next.each_line(|| Weighing::new(width), row);
        std::mem::swap(&mut now, &mut next);
        // What one more average does to the variance: less and less, because neighbours come to share their noise.
        factor /= 1.01 + gain;
        gain *= 0.5;
    }
    now.copy_to(&mut image);
    if image.data().iter().any(|v| !v.is_finite()) {
        return Err(ReconstructError::Diverged { iterations, residual: f64::INFINITY });
    }
    Ok((image, SolveReport { iterations, ..SolveReport::default() }))
}

/// One channel of one row, averaged with what its neighbours say.
fn average([now, dx, dy]: [&Field; 3], y: usize, c: usize, weighing: &Weighing, out: &mut [f32]) {
    let n = out.len();
    let (here, right) = (&now.row(y, c)[..n], &dx.row(y, c)[..n]);
    out.copy_from_slice(here);
    for x in 1..n {
        out[x] += weighing.left[x] * (here[x - 1] + right[x - 1] - here[x]);
        out[x - 1] += weighing.right[x - 1] * (here[x] - right[x - 1] - here[x - 1]);
    }
    if y > 0 {
        let (above, step) = (&now.row(y - 1, c)[..n], &dy.row(y - 1, c)[..n]);
        for x in 0..n {
            out[x] += weighing.up[x] * (above[x] + step[x] - here[x]);
        }
    }
    if y + 1 < now.height {
        let (below, step) = (&now.row(y + 1, c)[..n], &dy.row(y, c)[..n]);
        for x in 0..n {
            out[x] += weighing.down[x] * (below[x] - step[x] - here[x]);
        }
    }
}

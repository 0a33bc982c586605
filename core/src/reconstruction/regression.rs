//! First-order regression of an image on the features of what its pixels see, in a window around each pixel.
//!
//! The weights of the window come from [`Band`]; they are the same for both halves of a frame, and so is the normal matrix. The value of
//! the fit at its own pixel is a fixed linear combination of the window's values, so one small solve serves all channels of both halves.
//!
//! # Source
//! Bitterli et al., "Nonlinearly Weighted First-order Regression for Denoising Monte Carlo Renderings", CGF 35(4), 2016.

use super::patches::{Band, Guide};
use crate::film::{Features, Image};
use rayon::prelude::*;

/// How a window is weighed and fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    /// Pixels to each side of the window.
    pub(super) radius: usize,
    /// Squared difference that makes a patch count for nothing, in variances of the difference.
    pub(super) tolerance: f32,
    /// What is added to the diagonal for each feature, relative to the sum of weights.
    pub(super) ridge: f32,
}

/// What a pixel brings into a fit: the constant and seven features, RGB of both halves and two zeros, its place and two zeros. The zeros
/// fill registers.
const ROW: usize = 20;
/// First of the values in a row.
const VALUES: usize = 8;
/// Terms of the fit, by their places in a row: a constant, albedo, normal, depth, and the place itself.
const TERMS: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 16, 17];
/// Pixels that are summed at once.
const AT_ONCE: usize = 4;

/// Fits both halves of an image. Gives each value of the fit at its own pixel. Features and
/// images have the same size.
pub(super) fn fit(halves: [&Image; 2], features: &Features, fit: &Fit) -> [Image; 2] {
    let extent = halves[0].extent();
    let (width, height) = (extent.width as usize, extent.height as usize);
    let mut out = halves.map(Image::clone);
    let scale = mean_magnitude(halves);
    if !(scale > 0.0 && scale.is_finite() && width * height > 0) {
        return out;
    }
    let taps = taps(fit);
    let frame = Frame { width, pixels: pixels(halves, 1.0 / scale, features), taps: &taps, fit };
    let guide = Guide::new(halves, 1.0 / scale);
    let mut fitted = vec![[0.0f32; 6]; width * height];
    fitted.par_chunks_mut(Band::ROWS * width).enumerate().for_each_init(
        || Band::new(width, taps.len()),
        |band, (k, rows)| {
            let first = k * Band::ROWS;
            band.weigh(&guide, &taps, fit.tolerance, first..first + rows.len() / width);
            for (i, out) in rows.iter_mut().enumerate() {
                *out = frame.at(i % width, first + i / width, band.row(i / width));
            }
        },
    );
    for (half, image) in out.iter_mut().enumerate() {
        for c in 0..3 {
            for (v, fitted) in image.plane_mut(c).iter_mut().zip(&fitted) {
                // A fit that leaves the numbers leaves the value as it was.
                let value = (f64::from(fitted[3 * half + c]) * scale) as f32;
                *v = if value.is_finite() { value } else { *v };
            }
        }
    }
    out
}

/// Displacements of the pixels of a window.
fn taps(fit: &Fit) -> Vec<[isize; 2]> {
    let reach = fit.radius as isize;
    (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [x, y])).collect()
}

fn mean_magnitude(halves: [&Image; 2]) -> f64 {
    let sum = |image: &Image| image.data().iter().map(|v| f64::from(v.abs())).sum::<f64>();
    (sum(halves[0]) + sum(halves[1])) / (2 * halves[0].data().len()).max(1) as f64
}

/// The first sixteen numbers of each pixel's row; features each about as large as 1, values in units of their mean magnitude.
fn pixels(halves: [&Image; 2], scale: f64, features: &Features) -> Vec<[f32; 16]> {
    let depth = features.depth.plane(0);
    let mean = depth.iter().map(|v| f64::from(*v)).sum::<f64>() / depth.len().max(1) as f64;
    let pixel = |i: usize| {
        let mut pixel = [0.0; 16];
        for c in 0..3 {
            pixel[1 + c] = features.albedo.plane(c)[i];
            pixel[4 + c] = features.normal.plane(c)[i];
            for (half, image) in halves.iter().enumerate() {
                pixel[VALUES + 3 * half + c] = (f64::from(image.plane(c)[i]) * scale) as f32;
            }
        }
        // Bounded, and finest about the mean.
        let far = f64::from(depth[i]);
        pixel[7] = if mean > 0.0 { (far / (far + mean)) as f32 } else { 0.0 };
        pixel
    };
    (0..depth.len()).map(pixel).collect()
}

/// Everything about a frame that windows share.
struct Frame<'a> {
    width: usize,
    pixels: Vec<[f32; 16]>,
    taps: &'a [[isize; 2]],
    fit: &'a Fit,
}

impl Frame<'_> {
    /// The fit of one pixel at itself. `weights` are those of its row: tap by tap, pixel by pixel.
    fn at(&self, x: usize, y: usize, weights: &[f32]) -> [f32; 6] {
        let index = y * self.width + x;
        let own = &self.pixels[index];
        let reach = 1.0 / self.fit.radius.max(1) as f32;
        let mut sums = [[0.0f32; ROW]; TERMS.len()];
        let (mut rows, mut shares, mut filled) = ([[0.0f32; ROW]; AT_ONCE], [0.0f32; AT_ONCE], 0);
        for ([dx, dy], weight) in self.taps.iter().zip(weights[x..].iter().step_by(self.width)) {
            if *weight == 0.0 {
                continue;
            }
            let there = &self.pixels[(index as isize + dy * self.width as isize + dx) as usize];
            let row = &mut rows[filled];
            for k in 0..16 {
                row[k] = there[k] - own[k];
            }
            row[0] = 1.0;
            (row[16], row[17]) = (*dx as f32 * reach, *dy as f32 * reach);
            shares[filled] = *weight;
            filled += 1;
            if filled == AT_ONCE {
                add(&mut sums, &rows, &shares);
                filled = 0;
            }
        }
        shares[filled..].fill(0.0);
        add(&mut sums, &rows, &shares);
        let ridge = self.fit.ridge * sums[0][0];
        for (row, term) in sums.iter_mut().zip(TERMS).skip(1) {
            row[term] += ridge;
        }
        let kernel = first_column_of_inverse(&sums);
        let moved = |c: usize| kernel.iter().zip(&sums).map(|(k, row)| k * f64::from(row[VALUES + c])).sum::<f64>();
        std::array::from_fn(|c| own[VALUES + c] + moved(c) as f32)
    }
}

/// Adds some pixels' weighted products of terms with all that they bring.
#[inline]
fn add(sums: &mut [[f32; ROW]; TERMS.len()], rows: &[[f32; ROW]; AT_ONCE], shares: &[f32; AT_ONCE]) {
    for (sum, term) in sums.iter_mut().zip(TERMS) {
        let factors: [f32; AT_ONCE] = std::array::from_fn(|k| shares[k] * rows[k][term]);
        for j in 0..ROW {
            sum[j] += (factors[0] * rows[0][j] + factors[1] * rows[1][j]) + (factors[2] * rows[2][j] + factors[3] * rows[3][j]);
        }
    }
}

/// The first column of the inverse of the normal matrix, by Cholesky's factors. Terms that the window does not determine get nothing.
fn first_column_of_inverse(sums: &[[f32; ROW]; TERMS.len()]) -> [f64; TERMS.len()] {
    const N: usize = TERMS.len();
    let mut lower = [[0.0f64; N]; N];
    let mut inverse = [0.0f64; N];
    for i in 0..N {
        for j in 0..=i {
            let rest: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
            let left = f64::from(sums[i][TERMS[j]]) - rest;
            if i == j {
                inverse[i] = if left > 0.0 { 1.0 / left.sqrt() } else { 0.0 };
                lower[i][i] = left.max(0.0).sqrt();
            } else {
                lower[i][j] = left * inverse[j];
            }
        }
    }
    let mut x = [0.0; N];
    for i in 0..N {
        let rest: f64 = (0..i).map(|k| lower[i][k] * x[k]).sum();
        x[i] = (f64::from(u8::from(i == 0)) - rest) * inverse[i];
    }
    for i in (0..N).rev() {
        let rest: f64 = (i + 1..N).map(|k| lower[k][i] * x[k]).sum();
        x[i] = (x[i] - rest) * inverse[i];
    }
    x
}

//! How alike the patches around two pixels are, told by two halves that know nothing of each other.
//!
//! The product of the halves' differences is an unbiased estimate of the squared true difference, and the square of half their
//! disagreement is one of the variance of the mean difference. No model of the noise is needed: what the noise of neighbours has in
//! common drops out, and in an image that gradients were integrated to that is most of it.
//!
//! # Source
//! Non-local means with two buffers: Rousselle, Knaus and Zwicker, "Adaptive Rendering with Non-Local Means Filtering", ACM TOG 31(6),
//! 2012; the product of differences takes the place of their squared difference less its variance.

use crate::film::Image;
use std::ops::Range;

/// Pixels to each side of a patch.
const PATCH: usize = 3;
/// Pixels across a patch.
const ACROSS: usize = 2 * PATCH + 1;
/// Squared difference that no eye would see, relative to the image's mean square.
const INVISIBLE: f32 = 1e-6;

/// Both halves of an image that windows are weighed by.
pub(super) struct Guide {
    height: usize,
    /// RGB of half A, then of half B.
    planes: [Vec<f32>; 6],
}

impl Guide {
    /// Values are multiplied by `scale`, which makes their mean magnitude about 1.
    pub(super) fn new(halves: [&Image; 2], scale: f64) -> Self {
        let extent = halves[0].extent();
        let plane = |k: usize| halves[k / 3].plane(k % 3).iter().map(|v| (f64::from(*v) * scale) as f32).collect();
        Self { height: extent.height as usize, planes: std::array::from_fn(plane) }
    }
}

/// The weights of the windows of a few rows of pixels, and what a thread writes on to get them.
pub(super) struct Band {
    width: usize,
    taps: usize,
    /// Row by row, tap by tap, pixel by pixel.
    weights: Vec<f32>,
    /// Products and squared disagreements of the differences of one row of pixels.
    raw: [Vec<f32>; 2],
    /// The same summed along rows, for as many rows as the patches reach.
    summed: [Vec<f32>; 2],
    /// The same summed over patches.
    total: [Vec<f32>; 2],
}

impl Band {
    /// Rows that are weighed together.
    pub(super) const ROWS: usize = 8;

    /// Room for the windows of a frame of that width.
    pub(super) fn new(width: usize, taps: usize) -> Self {
        let pair = |length: usize| [vec![0.0; length], vec![0.0; length]];
        Self {
            width,
            taps,
            weights: vec![0.0; width * taps * Self::ROWS],
            raw: pair(width + 2 * PATCH),
            summed: pair(width * (Self::ROWS + 2 * PATCH)),
            total: pair(width),
        }
    }

    /// The weights of one of the rows.
    pub(super) fn row(&self, row: usize) -> &[f32] {
        let length = self.width * self.taps;
        &self.weights[row * length..(row + 1) * length]
    }

    /// Weighs the windows of some rows; `taps` are the displacements of a window's pixels. Weights lie within [0, 1] and fall to 0 where the
    /// squared difference is `tolerance` variances; pixels that lie outside the frame have 0.
    pub(super) fn weigh(&mut self, guide: &Guide, taps: &[[isize; 2]], tolerance: f32, rows: Range<usize>) {
        for (k, tap) in taps.iter().enumerate() {
            for row in 0..rows.len() + 2 * PATCH {
                self.sum_row(guide, (rows.start + row) as isize - PATCH as isize, *tap, row);
            }
            for row in 0..rows.len() {
                let start = (row * self.taps + k) * self.width;
                let weights = &mut self.weights[start..start + self.width];
                weights.fill(0.0);
                let there = (rows.start + row) as isize + tap[1];
                if there < 0 || there >= guide.height as isize {
                    continue;
                }
                for (sums, total) in self.summed.iter().zip(&mut self.total) {
                    total.fill(0.0);
                    for line in sums[row * self.width..].chunks_exact(self.width).take(ACROSS) {
                        total.iter_mut().zip(line).for_each(|(total, v)| *total += v);
                    }
                }
                const LEAST: f32 = INVISIBLE * (3 * ACROSS * ACROSS) as f32;
                for x in columns(self.width, tap[0]) {
                    let alike = 1.0 - self.total[0][x] / (tolerance * self.total[1][x] + LEAST);
                    // What is not a number becomes 0.
                    let alike = if alike > 0.0 { alike.min(1.0) } else { 0.0 };
                    weights[x] = alike * alike;
                }
            }
        }
    }

    /// Compares a row of pixels with the one that a tap leads to, and sums along it.
    fn sum_row(&mut self, guide: &Guide, y: isize, [dx, dy]: [isize; 2], row: usize) {
        let width = self.width;
        let out = row * width..(row + 1) * width;
        let inside = |y: isize| y >= 0 && y < guide.height as isize;
        let columns = columns(width, dx);
        if !(inside(y) && inside(y + dy)) || columns.is_empty() {
            self.summed.iter_mut().for_each(|sums| sums[out.clone()].fill(0.0));
            return;
        }
        let (here, there) = (y as usize * width, (y + dy) as usize * width);
        let shifted = (columns.start as isize + dx) as usize..(columns.end as isize + dx) as usize;
        let [products, squares] = &mut self.raw;
        products.fill(0.0);
        squares.fill(0.0);
        let inner = columns.start + PATCH..columns.end + PATCH;
        let (products, squares) = (&mut products[inner.clone()], &mut squares[inner]);
        for c in 0..3 {
            let [a, b] = [&guide.planes[c], &guide.planes[c + 3]];
            let (a, a2) = (&a[here..][columns.clone()], &a[there..][shifted.clone()]);
            let (b, b2) = (&b[here..][columns.clone()], &b[there..][shifted.clone()]);
            for i in 0..products.len() {
                let (a, b) = (a[i] - a2[i], b[i] - b2[i]);
                products[i] += a * b;
                squares[i] += 0.25 * (a - b) * (a - b);
            }
        }
        for (raw, sums) in self.raw.iter().zip(&mut self.summed) {
            let sums = &mut sums[out.clone()];
            sums.copy_from_slice(&raw[..width]);
            for k in 1..ACROSS {
                sums.iter_mut().zip(&raw[k..]).for_each(|(sum, v)| *sum += v);
            }
        }
    }
}

/// The columns from which a step of `dx` stays on the image.
fn columns(width: usize, dx: isize) -> Range<usize> {
    let low = (-dx).max(0) as usize;
    let high = (width as isize - dx.max(0)).max(0) as usize;
    low.min(high)..high
}

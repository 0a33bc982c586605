//! Three channels of a frame in the layout that the iterative solver walks through: row by row, the channels of a row side by side.
//!
//! A band of rows is then one run of memory, so threads share work by bands; the bands have one height, and sums over them are added
//! in their order, so nothing depends on how many threads there are.

use crate::film::Image;
use rayon::prelude::*;

/// Rows of one band.
pub(super) const BAND: usize = 16;
/// Accumulators of an inner product: fixed, so that its rounding is.
const LANES: usize = 8;

/// Values of three channels.
#[derive(Clone, Debug, Default)]
pub(super) struct Field {
    pub(super) width: usize,
    pub(super) height: usize,
    values: Vec<f32>,
}

/// The values of one channel in one row, and which row and channel that is.
pub(super) struct Row<'a> {
    pub(super) y: usize,
    pub(super) channel: usize,
    pub(super) values: &'a mut [f32],
}

impl Field {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, height, values: vec![0.0; 3 * width * height] }
    }

    pub(super) fn from_image(image: &Image) -> Self {
        let (width, height) = (image.extent().width as usize, image.extent().height as usize);
        let mut field = Self::new(width, height);
        field.copy_from(image);
        field
    }

    /// Takes the values of an image of the same size.
    pub(super) fn copy_from(&mut self, image: &Image) {
        let width = self.width;
        self.each_row(|row| row.values.copy_from_slice(&image.plane(row.channel)[row.y * width..(row.y + 1) * width]));
    }

    pub(super) fn copy_to(&self, image: &mut Image) {
        for c in 0..3 {
            for (y, row) in image.plane_mut(c).chunks_mut(self.width.max(1)).enumerate() {
                row.copy_from_slice(self.row(y, c));
            }
        }
    }

    /// One channel of one row.
    #[inline]
    pub(super) fn row(&self, y: usize, channel: usize) -> &[f32] {
        let start = (3 * y + channel) * self.width;
        &self.values[start..start + self.width]
    }

    /// All values: channel c of the pixel (x, y) stands at (3 y + c) · width + x.
    #[inline]
    pub(super) fn values(&self) -> &[f32] {
        &self.values
    }

    /// Calls `f` for every row and channel, bands in parallel.
    pub(super) fn each_row(&mut self, f: impl Fn(Row) + Sync) {
        self.sum_rows(|row| {
            f(row);
            0.0
        });
    }

    /// Calls `f` for every row with its three channels one after the other, rows in parallel; `scratch` is what a thread writes on.
    pub(super) fn each_line<S>(&mut self, scratch: impl Fn() -> S + Sync + Send, f: impl Fn(&mut S, usize, &mut [f32]) + Sync + Send) {
        let length = (3 * self.width).max(1);
        self.values.par_chunks_mut(length).enumerate().for_each_init(scratch, |scratch, (y, line)| f(scratch, y, line));
    }

    /// Calls `f` for every row and channel and adds up what it returns, by channel.
    pub(super) fn sum_rows(&mut self, f: impl Fn(Row) -> f64 + Sync) -> [f64; 3] {
        let width = self.width;
        self.sum_bands(|first, band| {
            let mut sums = [0.0; 3];
            for (line, values) in band.chunks_mut(width).enumerate() {
                let (y, channel) = (first + line / 3, line % 3);
                sums[channel] += f(Row { y, channel, values });
            }
            sums
        })
    }

    /// Calls `f` for every band with its first row and its values, and adds up what it returns, by channel.
    pub(super) fn sum_bands(&mut self, f: impl Fn(usize, &mut [f32]) -> [f64; 3] + Sync) -> [f64; 3] {
        let length = self.band();
        let bands = self.values.par_chunks_mut(length).enumerate().map(|(k, band)| f(k * BAND, band));
        total(&bands.collect::<Vec<_>>())
    }

    /// Calls `f` for every row and channel of this field together with the same one of another, to write both.
    pub(super) fn each_pair(&mut self, other: &mut Field, f: impl Fn(Row, &mut [f32]) + Sync) {
        let (width, length) = (self.width, self.band());
        self.values.par_chunks_mut(length).zip(other.values.par_chunks_mut(length)).enumerate().for_each(|(k, (band, others))| {
            for (line, (values, other)) in band.chunks_mut(width).zip(others.chunks_mut(width)).enumerate() {
                f(Row { y: k * BAND + line / 3, channel: line % 3, values }, other);
            }
        });
    }

    /// Values of one band.
    pub(super) fn band(&self) -> usize {
        (3 * self.width * BAND).max(1)
    }

    /// The bands, to be written.
    pub(super) fn bands_mut(&mut self) -> rayon::slice::ChunksMut<'_, f32> {
        let length = self.band();
        self.values.par_chunks_mut(length)
    }

    /// Inner products with another field, by channel.
    pub(super) fn dot(&self, other: &Field) -> [f64; 3] {
        let width = self.width;
        let band = |(a, b): (&[f32], &[f32])| {
            let mut sums = [0.0; 3];
            for (line, (a, b)) in a.chunks(width).zip(b.chunks(width)).enumerate() {
                sums[line % 3] += dot(a, b);
            }
            sums
        };
        let length = self.band();
        let bands: Vec<[f64; 3]> = self.values.par_chunks(length).zip(other.values.par_chunks(length)).map(band).collect();
        total(&bands)
    }
}

pub(super) fn total(bands: &[[f64; 3]]) -> [f64; 3] {
    bands.iter().fold([0.0; 3], |sum, band| std::array::from_fn(|c| sum[c] + band[c]))
}

/// Inner product of two rows in f64.
#[inline]
pub(super) fn dot(a: &[f32], b: &[f32]) -> f64 {
    let mut lanes = [0.0f64; LANES];
    let (a_blocks, b_blocks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a_blocks.remainder().iter().zip(b_blocks.remainder()).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
    for (a, b) in a_blocks.zip(b_blocks) {
        for k in 0..LANES {
            lanes[k] += f64::from(a[k]) * f64::from(b[k]);
        }
    }
    lanes.iter().sum::<f64>() + rest
}

//! How far an image is from the truth, told without a reference.
//!
//! The two halves of a film are independent. For each value of the image let a and b be what the halves' images show, and c and d what
//! unbiased reconstructions of the same halves show. Then
//!
//! * (a − b)² / 4 estimates the variance of the image that both halves make together, and
//! * (a − c)(b − d) estimates the squared bias: each factor has the bias as its expected value, and they are independent.
//!
//! Their sum is an unbiased estimate of the squared error, value by value; one value alone says little, regions say more. Where the image
//! is solved for from both halves together, its bias is taken to be that of the halves' images, which is an upper bound for every method
//! whose bias falls with the noise. Where a method lets one half decide about the other, the halves' images are only nearly independent.

use super::robust::trimmed_mean;
use super::zip;
use crate::film::Image;
use crate::lattice::{Extent, Tile};
use crate::metrics::REL_MSE_FLOOR;

/// An estimate of an image's squared error.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Squared error of each value. RGB; below zero where the estimate of a small bias is.
    pub squared: Image,
    /// The same relative, as relMSE counts it: mean of RGB over grey² + 10⁻³, grey from the pixels around, without outliers. One channel.
    pub relative: Image,
    /// Mean of `relative`, its share of bias not below zero: the estimated relMSE.
    pub relmse: f64,
    /// What of it is squared bias; 0 where the reconstruction has none.
    pub bias: f64,
    /// Where the true relMSE of this very image lies with 95 % confidence. `None` for frames too small to tell.
    pub interval: Option<[f64; 2]>,
}

/// Edge of the blocks that count as independent: several times as far as a reconstruction carries noise [pixels].
const BLOCK: u32 = 16;
/// Fewest blocks; in small frames they are cut smaller.
const LEAST_BLOCKS: usize = 24;

impl ErrorEstimate {
    /// From the image, its halves' images, the unbiased ones where they differ, and the number of samples of each half.
    pub(super) fn new(image: &Image, halves: &[Image; 2], unbiased: Option<&[Image; 2]>, samples: [u32; 2]) -> Self {
        let extent = image.extent();
        let [na, nb] = samples.map(f64::from);
        // Var of the weighted mean over E (a − b)², if noise falls with the number of samples.
        let share = na * nb / ((na + nb) * (na + nb));
        let (mut squared, mut relative) = (Image::new(extent, 3), Image::new(extent, 1));
        let [u, v] = unbiased.unwrap_or(halves);
        let grey = brightness(&grey(u), &grey(v));
        let mut bias_sum = 0.0;
        for i in 0..extent.pixels() {
            let brightness = f64::from(grey.data()[i]);
            let scale = 1.0 / (brightness * brightness + REL_MSE_FLOOR);
            let mut sum = 0.0;
            for c in 0..3 {
                let at = |image: &Image| f64::from(image.plane(c)[i]);
                let [a, b] = [at(&halves[0]), at(&halves[1])];
                let bias = unbiased.map_or(0.0, |[u, v]| (a - at(u)) * (b - at(v)));
                let error = share * (a - b) * (a - b) + bias;
                squared.plane_mut(c)[i] = error as f32;
                sum += error;
                bias_sum += bias * scale;
            }
            relative.data_mut()[i] = (sum * scale / 3.0) as f32;
        }
        // Over a whole frame a square below zero is nothing but noise.
        let bias = bias_sum / (3 * extent.pixels().max(1)) as f64;
        let relmse = mean(relative.data()) - bias.min(0.0);
        let bias = bias.max(0.0);
        let interval = interval(&relative, relmse);
        Self { squared, relative, relmse, bias, interval }
    }

    /// The estimated relMSE of a tile of the image.
    pub fn of_tile(&self, tile: Tile) -> f64 {
        let extent = self.relative.extent();
        let row = |y: u32| &self.relative.data()[extent.index(tile.x, y)..][..tile.width as usize];
        (tile.y..tile.y + tile.height).flat_map(row).map(|v| f64::from(*v)).sum::<f64>() / tile.pixels() as f64
    }
}

/// How bright each pixel is, from the grey images of two independent halves. Dark pixels count most in a relative error, so the brightness
/// that it is relative to must be neither noisy nor biased: each pixel shows what it has itself as far as that stands out of its noise, and
/// else what stands around it, without outliers (James and Stein's shrinkage).
fn brightness(u: &Image, v: &Image) -> Image {
    let own = zip(u, v, |u, v| 0.5 * (u + v));
    let noise = zip(u, v, |u, v| 0.25 * (u - v) * (u - v));
    let (mut out, around) = (trimmed_mean(&own), trimmed_mean(&noise));
    for (i, out) in out.data_mut().iter_mut().enumerate() {
        let (away, noise) = (own.data()[i] - *out, noise.data()[i].max(around.data()[i]));
        if away * away > noise {
            *out += away * (1.0 - noise / (away * away));
        }
    }
    out
}

fn grey(image: &Image) -> Image {
    let mut out = Image::new(image.extent(), 1);
    for (i, v) in out.data_mut().iter_mut().enumerate() {
        *v = (0..3).map(|c| image.plane(c)[i]).sum::<f32>() / 3.0;
    }
    out
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len().max(1) as f64
}

/// The interval for the error of the image at hand. That error and its estimate are two draws of one distribution, so their quotient
/// varies twice as much as each; on a logarithmic scale, because errors are positive and skewed.
fn interval(relative: &Image, relmse: f64) -> Option<[f64; 2]> {
    let blocks = blocks(relative.extent());
    if blocks.len() < 4 {
        return None;
    }
    if relmse <= 0.0 {
        return Some([0.0; 2]);
    }
    let sums: Vec<f64> = blocks
        .iter()
        .map(|block| {
            let row = |y: u32| &relative.data()[relative.extent().index(block.x, y)..][..block.width as usize];
            (block.y..block.y + block.height).flat_map(row).map(|v| f64::from(*v) - relmse).sum()
        })
        .collect();
    let n = sums.len() as f64;
    let variance = sums.iter().map(|s| s * s).sum::<f64>() * n / (n - 1.0);
    let deviation = variance.sqrt() / (relmse * relative.data().len() as f64);
    let reach = libm::exp(quantile(n - 1.0) * std::f64::consts::SQRT_2 * libm::sqrt(libm::log1p(deviation * deviation)));
    Some([relmse / reach, relmse * reach])
}

/// Blocks of nearly equal size.
fn blocks(extent: Extent) -> Vec<Tile> {
    let mut edge = BLOCK;
    while edge > 2 && extent.tiles(edge).len() < LEAST_BLOCKS {
        edge /= 2;
    }
    extent.tiles(edge)
}

/// 97.5 % quantile of Student's t, by the leading terms of its expansion about the normal one (Abramowitz and Stegun 26.7.5).
fn quantile(freedom: f64) -> f64 {
    let z: f64 = 1.959_964;
    let (z3, z5) = (z * z * z, z * z * z * z * z);
    z + (z3 + z) / (4.0 * freedom) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * freedom * freedom)
}

#[cfg(test)]
mod tests;

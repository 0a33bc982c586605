//! Exposures of HDR-FLIP: from the one that leaves only the brightest pixel visible to the one that burns out half of the image.

use crate::film::Image;
use rayon::prelude::*;

/// Numerator and denominator of the ACES approximation in powers x², x, 1.
///
/// # Source
/// Narkowicz, "ACES Filmic Tone Mapping Curve", 2015, with the input scaled by 0.6.
const NUMERATOR: [f64; 3] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0];
const DENOMINATOR: [f64; 3] = [0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];
/// The tone-mapped value at which a pixel counts as bright.
const BRIGHT: f64 = 0.85;
/// Exposures at most. One stop apart they span the range of f32 sensibly; a reference with more says nothing at the far end.
const MOST: usize = 40;
/// Brighter values than this are taken for it: their square must not overflow [radiance].
const BRIGHTEST: f32 = 1e12;

/// Exposures [stops] at which images are compared, from the reference's brightest and median luminance.
///
/// A black reference is compared at its own exposure, 0. Where the median is black, that of the pixels that are not is used.
pub(super) fn of_reference(reference: &Image) -> Vec<f32> {
    let mut luminance: Vec<f32> = (0..reference.extent().pixels())
        .map(|i| {
            let [r, g, b] = [0, 1, 2].map(|c| sane(reference.plane(c)[i]));
            0.2126 * r + 0.7152 * g + 0.0722 * b
        })
        .collect();
    luminance.sort_unstable_by(f32::total_cmp);
    let Some(brightest) = luminance.last().copied().filter(|y| *y > 0.0) else {
        return vec![0.0];
    };
    let mut median = middle(&luminance);
    if median <= 0.0 {
        median = middle(&luminance[luminance.partition_point(|y| *y <= 0.0)..]);
    }
    let bright = bright_input();
    let stops = |y: f64| libm::log2(bright / y);
    let (first, last) = (stops(f64::from(brightest)), stops(median));
    let count = ((last - first).ceil() as usize).clamp(2, MOST);
    (0..count).map(|k| (first + (last - first) * k as f64 / (count - 1) as f64) as f32).collect()
}

/// The image exposed and tone mapped, in linear [0, 1].
pub(super) fn tone_mapped(image: &Image, stops: f32) -> Image {
    let scale = libm::exp2f(stops);
    let [n2, n1, n0] = NUMERATOR.map(|v| v as f32);
    let [d2, d1, d0] = DENOMINATOR.map(|v| v as f32);
    let mut out = image.clone();
    out.data_mut().par_iter_mut().for_each(|v| {
        let x = (sane(*v) * scale).min(BRIGHTEST);
        *v = ((n2 * x * x + n1 * x + n0) / (d2 * x * x + d1 * x + d0)).clamp(0.0, 1.0);
    });
    out
}

/// NaN and negative values are black.
fn sane(value: f32) -> f32 {
    if value > 0.0 { value.min(BRIGHTEST) } else { 0.0 }
}

fn middle(sorted: &[f32]) -> f64 {
    let n = sorted.len();
    0.5 * (f64::from(sorted[(n - 1) / 2]) + f64::from(sorted[n / 2]))
}

/// The input that is tone mapped to [`BRIGHT`].
fn bright_input() -> f64 {
    let [a, b, c]: [f64; 3] = std::array::from_fn(|k| NUMERATOR[k] - BRIGHT * DENOMINATOR[k]);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

//! FLIP: the difference that a person sees who flips between an image and its reference.
//!
//! Radiance has no fixed range, so this is HDR-FLIP: both images are exposed from the shortest to the longest exposure in which
//! the reference shows anything, tone mapped, compared by LDR-FLIP, and each pixel keeps its largest difference.
//! Parameters are those of the papers: 67 pixels per degree (a 3840-pixel monitor 0.7 m wide, seen from 0.7 m), ACES tone mapping.
//!
//! # Source
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating Images",
//! Proc. ACM CGIT 3(2), 2020; Andersson, Nilsson, Shirley and Akenine-Möller, "Visualizing Errors in Rendered High Dynamic
//! Range Images", Eurographics 2021 short papers.

mod colour;
mod exposure;
mod filter;

use super::{MetricError, check};
use crate::film::Image;
use colour::Tristimulus;
use filter::{ContrastSensitivity, Detectors, Planes};
use rayon::prelude::*;

/// Exponent of the colour difference.
const COLOUR_EXPONENT: f32 = 0.7;
/// Colour differences below this part of the largest one …
const KNEE_IN: f32 = 0.4;
/// … are stretched over this part of the range; the rest share what is left.
const KNEE_OUT: f32 = 0.95;
/// Exponent of the feature difference.
const FEATURE_EXPONENT: f32 = 0.5;

/// Mean of [`flip_map`], in [0, 1].
///
/// # Errors
/// As [`flip_map`].
pub fn flip(image: &Image, reference: &Image) -> Result<f64, MetricError> {
    let map = flip_map(image, reference)?;
    Ok(map.data().iter().map(|v| f64::from(*v)).sum::<f64>() / map.data().len() as f64)
}

/// HDR-FLIP of each pixel, in [0, 1]: 0 where no difference is seen. One channel.
///
/// Not symmetric: the exposures are those of the reference. Negative and NaN values are taken for black, infinite ones for very bright.
///
/// # Errors
/// If the images differ in shape, have no pixels, or are not RGB.
pub fn flip_map(image: &Image, reference: &Image) -> Result<Image, MetricError> {
    check(image, reference)?;
    if reference.channels() != 3 {
        return Err(MetricError::NotColour { metric: "FLIP", found: reference.channels() });
    }
    let mut worst = Image::new(reference.extent(), 1);
    for stops in exposure::of_reference(reference) {
        let exposed = |i| exposure::tone_mapped(i, stops);
        let map = ldr_flip(&exposed(image), &exposed(reference));
        for (w, v) in worst.data_mut().iter_mut().zip(&map) {
            *w = w.max(*v);
        }
    }
    Ok(worst)
}

/// LDR-FLIP of each pixel of two RGB images in linear [0, 1].
fn ldr_flip(image: &Image, reference: &Image) -> Vec<f32> {
    let (colour_a, feature_a) = perceive(image);
    let (colour_b, feature_b) = perceive(reference);
    let largest = colour::largest_difference(COLOUR_EXPONENT);
    let pixel = |i: usize| {
        let [edge_a, edge_b] = [&feature_a, &feature_b].map(|f| f.edge[i]);
        let [point_a, point_b] = [&feature_a, &feature_b].map(|f| f.point[i]);
        let feature = (edge_a - edge_b).abs().max((point_a - point_b).abs());
        let feature = libm::powf((std::f32::consts::FRAC_1_SQRT_2 * feature).min(1.0), FEATURE_EXPONENT);
        let colour = libm::powf(colour::hyab(colour_a[i], colour_b[i]), COLOUR_EXPONENT);
        let colour = redistribute(colour, largest).min(1.0);
        libm::powf(colour, 1.0 - feature)
    };
    (0..colour_a.len()).into_par_iter().map(pixel).collect()
}

/// Lays colour differences out over [0, 1], with most of the range for small ones.
fn redistribute(difference: f32, largest: f32) -> f32 {
    let knee = KNEE_IN * largest;
    if difference < knee { KNEE_OUT / knee * difference } else { KNEE_OUT + (difference - knee) / (largest - knee) * (1.0 - KNEE_OUT) }
}

/// What the eye makes of an image: its colours at this distance, and where its edges and points are.
fn perceive(image: &Image) -> (Vec<Tristimulus>, Detectors) {
    let (width, height) = (image.extent().width as usize, image.extent().height as usize);
    let opponent: Vec<Tristimulus> = (0..width * height)
        .into_par_iter()
        .map(|i| colour::opponent(Tristimulus([image.plane(0)[i], image.plane(1)[i], image.plane(2)[i]])))
        .collect();
    let plane = |c: usize| Planes { width, height, values: opponent.iter().map(|v| v.0[c]).collect() };
    let achromatic = plane(0);
    let features = Detectors::of(&achromatic.map(colour::grey));
    let seen: [Vec<f32>; 3] = [
        (ContrastSensitivity::ACHROMATIC, achromatic),
        (ContrastSensitivity::RED_GREEN, plane(1)),
        (ContrastSensitivity::BLUE_YELLOW, plane(2)),
    ]
    .map(|(sensitivity, plane)| sensitivity.filter(&plane));
    let colours =
        (0..width * height).into_par_iter().map(|i| colour::hunt_lab(Tristimulus([seen[0][i], seen[1][i], seen[2][i]]))).collect();
    (colours, features)
}

/// LDR-FLIP alone, for tests of what only it promises.
#[cfg(test)]
pub(super) fn ldr_for_test(image: &Image, reference: &Image) -> Vec<f32> {
    ldr_flip(image, reference)
}

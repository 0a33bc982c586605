//! Screened Poisson held to what features predict, with several strengths at once and a map of which to believe where.
//!
//! The prediction F is the first-order regression on features. Each set of parameters screens the measured gradients by it,
//! argmin ‖∇I − G‖² + μ²‖I − F‖², which the cosine transform solves exactly: the larger μ, the more the image is held to be locally linear in
//! its features. An unbiased image U and F itself are the ends of the row. For each set the halves tell the variance, (R(A) − R(B))² / 4,
//! and the squared bias, (R(A) − U(A)) (R(B) − U(B)); both are smoothed, each pixel takes the set of least sum, and the map of choices is
//! smoothed again, so that no seam shows.
//!
//! It costs three least squares more than the regression. It pays where spikes dominate, and takes back a little of what the regression
//! gains elsewhere, because the errors that it chooses by are noisy too.
//!
//! # Source
//! Manzi, Vicini and Zwicker, "Regularizing Image Reconstruction for Gradient-Domain Rendering with Feature Patches", CGF 35(2), 2016.
//! There each patch is held to its own fit inside of the solve; here the fit comes first, which leaves the solve a transform.

use super::l2::L2;
use super::nfor::Nfor;
use super::smooth::smoothed;
use super::together::{Together, unbiased};
use super::{Measurements, Reconstruct, ReconstructError, ReconstructionKind, SolveReport};
use crate::film::Image;

/// The reconstruction.
pub(super) struct Regularised;

/// Strengths μ.
const STRENGTHS: [f32; 3] = [0.1, 0.3, 1.0];
/// Pixels to each side over which errors are smoothed.
const ERRORS: usize = 5;
/// Pixels to each side over which choices are.
const CHOICES: usize = 3;
/// Squared brightness below which errors are not taken relatively any more, over the squared mean.
const DARK: f64 = 1e-2;

impl Together for Regularised {
    const KIND: ReconstructionKind = ReconstructionKind::Regularised;

    fn solve_both(&self, halves: [&Measurements; 2], alphas: [f32; 2]) -> Result<[(Image, SolveReport); 2], ReconstructError> {
        let [(ua, report_a), (ub, report_b)] = unbiased(halves, alphas)?;
        let [(fa, _), (fb, _)] = Nfor.solve_both(halves, alphas)?;
        let mut sets = vec![[ua, ub]];
        for strength in STRENGTHS {
            let held = |half: &Measurements, prediction: &Image| {
                let (image, _) = L2.solve(&Measurements { primal: prediction, ..*half }, None, strength)?;
                Ok::<_, ReconstructError>(image)
            };
            sets.push([held(halves[0], &fa)?, held(halves[1], &fb)?]);
        }
        sets.push([fa, fb]);
        let [a, b] = selected(&sets);
        Ok([(a, report_a), (b, report_b)])
    }
}

/// Of each pixel the image that seems nearest to the truth. The first of the sets is unbiased.
fn selected(sets: &[[Image; 2]]) -> [Image; 2] {
    let extent = sets[0][0].extent();
    let (width, height, pixels) = (extent.width as usize, extent.height as usize, extent.pixels());
    let last = &sets[sets.len() - 1];
    let grey = |i: usize| last.iter().flat_map(|image| (0..3).map(|c| f64::from(image.plane(c)[i]))).sum::<f64>() / 6.0;
    let mean = (0..pixels).map(|i| grey(i).abs()).sum::<f64>() / pixels.max(1) as f64;
    let weights: Vec<f64> = (0..pixels).map(|i| 1.0 / (grey(i) * grey(i) + DARK * mean * mean)).collect();
    let errors: Vec<Vec<f32>> = sets.iter().map(|set| error(set, &sets[0], &weights)).collect();
    let errors: Vec<Vec<f32>> =
        errors.iter().map(|error| smoothed(&smoothed(error, width, height, ERRORS), width, height, ERRORS)).collect();
    let mut out = [Image::new(extent, 3), Image::new(extent, 3)];
    let mut least = vec![0usize; pixels];
    for (i, least) in least.iter_mut().enumerate() {
        for k in 1..sets.len() {
            if errors[k][i] < errors[*least][i] {
                *least = k;
            }
        }
    }
    for (k, set) in sets.iter().enumerate() {
        let chosen: Vec<f32> = least.iter().map(|least| f32::from(u8::from(*least == k))).collect();
        let share = smoothed(&smoothed(&chosen, width, height, CHOICES), width, height, CHOICES);
        for (out, image) in out.iter_mut().zip(set) {
            for c in 0..3 {
                for ((out, v), share) in out.plane_mut(c).iter_mut().zip(image.plane(c)).zip(&share) {
                    *out += share * v;
                }
            }
        }
    }
    out
}

/// Estimated squared error of each pixel of the mean of two halves.
fn error(set: &[Image; 2], unbiased: &[Image; 2], weights: &[f64]) -> Vec<f32> {
    let of = |(i, weight): (usize, &f64)| {
        let mut sum = 0.0;
        for c in 0..3 {
            let at = |image: &Image| f64::from(image.plane(c)[i]);
            let [a, b] = [at(&set[0]), at(&set[1])];
            sum += 0.25 * (a - b) * (a - b) + (a - at(&unbiased[0])) * (b - at(&unbiased[1]));
        }
        (weight * sum) as f32
    };
    weights.iter().enumerate().map(of).collect()
}

//! First-order regression of an unbiased image from gradients, on features of what the pixels see.
//!
//! Gradients come in twice: what is fitted is not the primal but an image that they were joined to without bias, and the windows are
//! weighed by how alike its patches are. Most of the primal's noise is gone from it before anything is blurred, so a window tells shadows,
//! which features do not know, from noise. Fitting the primal in the same windows gives twice the error. The joining is by weighted
//! control variates where there are variances: the less noise the fit starts from the better, and theirs is a third less than that of
//! least squares.
//!
//! The fit is biased where neither features nor gradients tell what the image does, so it is drawn towards the unbiased image as far as
//! the halves say that it pays, and converges to the truth.
//!
//! # Source
//! Bitterli et al., "Nonlinearly Weighted First-order Regression for Denoising Monte Carlo Renderings", CGF 35(4), 2016; gradients as a
//! guide: Hua et al., "A Survey on Gradient-Domain Rendering", CGF 38(2), 2019.

use super::regression::{Fit, fit};
use super::shrink::drawn;
use super::together::{Together, unbiased};
use super::{Measurements, ReconstructError, ReconstructionKind, SolveReport};
use crate::film::Image;

/// The regression.
pub(super) struct Nfor;

const FIT: Fit = Fit { radius: 7, tolerance: 8.0, ridge: 1e-3 };

impl Together for Nfor {
    const KIND: ReconstructionKind = ReconstructionKind::Nfor;

    fn solve_both(&self, halves: [&Measurements; 2], alphas: [f32; 2]) -> Result<[(Image, SolveReport); 2], ReconstructError> {
        let features = halves[0].features.ok_or(ReconstructError::NoFeatures { wanted: Self::KIND.name() })?;
        let [(a, report_a), (b, report_b)] = unbiased(halves, alphas)?;
        let fitted = fit([&a, &b], features, &FIT);
        let [a, b] = drawn([a, b], &fitted);
        Ok([(a, report_a), (b, report_b)])
    }
}

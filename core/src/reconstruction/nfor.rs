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

use super::control_variates::Weighted;
use super::l2::L2;
use super::regression::{Fit, fit};
use super::shrink::drawn;
use super::{Measurements, Reconstruct, ReconstructError, SolveReport};
use crate::film::Image;

/// The regression.
pub(super) struct Nfor;

const FIT: Fit = Fit { radius: 7, tolerance: 8.0, ridge: 1e-3 };

impl Reconstruct for Nfor {
    fn joins_halves(&self) -> bool {
        true
    }

    fn is_unbiased(&self) -> bool {
        false
    }

    fn solve(&self, own: &Measurements, other: Option<&Measurements>, alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        match other {
            Some(other) => {
                let [done, _] = self.solve_halves([own, other], [alpha; 2])?;
                Ok(done)
            }
            // One half alone does not tell noise from picture.
            None => L2.solve(own, None, alpha),
        }
    }

    fn solve_halves(&self, halves: [&Measurements; 2], alphas: [f32; 2]) -> Result<[(Image, SolveReport); 2], ReconstructError> {
        let features = halves[0].features.ok_or(ReconstructError::NoFeatures { wanted: "nfor" })?;
        let [(a, report_a), (b, report_b)] = unbiased(halves, alphas)?;
        let fitted = fit([&a, &b], features, &FIT);
        let [a, b] = drawn([a, b], &fitted);
        Ok([(a, report_a), (b, report_b)])
    }
}

/// The unbiased images of least noise that biased methods start from and are drawn to.
pub(super) fn unbiased(halves: [&Measurements; 2], alphas: [f32; 2]) -> Result<[(Image, SolveReport); 2], ReconstructError> {
    if halves.iter().all(|half| half.variance.is_some()) { Weighted.solve_halves(halves, alphas) } else { L2.solve_halves(halves, alphas) }
}

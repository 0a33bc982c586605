//! First-order regression of an unbiased image from gradients, on features of what the pixels see.
//!
//! Gradients come in twice: what is fitted is not the primal but the least-squares image, and the windows are weighed by how alike its
//! patches are. Most of the primal's noise is gone from it before anything is blurred, so a window tells shadows, which features do not
//! know, from noise. Fitting the primal in the same windows gives twice the error.
//!
//! The fit is biased where neither features nor gradients tell what the image does, so it is drawn towards the least-squares image as far
//! as the halves say that it pays, and converges to the truth.
//!
//! # Source
//! Bitterli et al., "Nonlinearly Weighted First-order Regression for Denoising Monte Carlo Renderings", CGF 35(4), 2016; gradients as a
//! guide: Hua et al., "A Survey on Gradient-Domain Rendering", CGF 38(2), 2019.

use super::l2::L2;
use super::regression::{Fit, fit};
use super::shrink::drawn;
use super::{Measurements, Reconstruct, ReconstructError, SolveReport};
use crate::film::Image;

/// The regression.
pub(super) struct Nfor;

const FIT: Fit = Fit { radius: 7, tolerance: 8.0, ridge: 1e-3 };

pub(super) fn env(name: &str, default: f32) -> f32 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

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
                let [done, _] = self.solve_halves([own, other], alpha)?;
                Ok(done)
            }
            // One half alone does not tell noise from picture.
            None => L2.solve(own, None, alpha),
        }
    }

    fn solve_halves(&self, halves: [&Measurements; 2], alpha: f32) -> Result<[(Image, SolveReport); 2], ReconstructError> {
        let features = halves[0].features.ok_or(ReconstructError::NoFeatures { wanted: "nfor" })?;
        let data: &dyn Reconstruct = if env("DATA", 0.0) == 1.0 { &super::control_variates::Weighted } else { &L2 };
        let [(a, report_a), (b, report_b)] = data.solve_halves(halves, alpha)?;
        let fit_ = Fit { tolerance: env("TOL", 8.0), radius: env("RADIUS", 7.0) as usize, ..FIT };
        let fitted = fit([&a, &b], [&a, &b], features, &fit_);
        if env("JS", 1.0) == 0.0 {
            let [x, y] = fitted;
            return Ok([(x, report_a), (y, report_b)]);
        }
        let [a, b] = drawn([a, b], &fitted);
        Ok([(a, report_a), (b, report_b)])
    }
}

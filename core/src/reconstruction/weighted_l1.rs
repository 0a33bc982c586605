//! Screened Poisson in the L1 norm with inverse deviations as weights: argmin Σ ‖∇I − G‖ / σ(G) + Σ ‖α(I − P)‖ / σ(P), by iteratively reweighted
//! least squares.
//!
//! The norm of a residual is taken in units of its noise, so that what is known well counts for more than what is not, and an outlier is what
//! lies far outside its own noise rather than what is large. The variances come from the *other* half's samples, as for least squares: a
//! measurement that is an outlier does not say how much it counts. Not linear, so biased all the same; the bias falls with the noise.
//!
//! # Source
//! L1 as in Lehtinen et al., "Gradient-Domain Metropolis Light Transport", ACM TOG 32(4), 2013; weights by variances and cross weighting of
//! halves as in Rousselle et al., "Image-space Control Variates for Rendering", ACM TOG 35(6), 2016.

use super::l1::{EFFORT, Share, Shares, minimise};
use super::variances::Variances;
use super::{Measurements, Reconstruct, ReconstructError, ReconstructionKind, SolveReport, noise};
use crate::film::Image;

/// The L1 norm in units of the noise.
pub(super) struct WeightedL1;

impl Reconstruct for WeightedL1 {
    fn joins_halves(&self) -> bool {
        true
    }

    fn is_unbiased(&self) -> bool {
        false
    }

    /// Errors in units of their noise need no further weight. Where nothing tells what that is, it is that of `l1`.
    fn alpha(&self, source: &Measurements) -> f32 {
        let varies = |image: &Image| image.data().iter().any(|v| *v > 0.0);
        let known = source.variance.is_some_and(|v| varies(v.primal) || varies(v.dx) || varies(v.dy));
        if known { 1.0 } else { noise::TYPICAL }
    }

    fn solve(&self, own: &Measurements, other: Option<&Measurements>, alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        let source = other.unwrap_or(own);
        let variance = source.variance.ok_or(ReconstructError::NoVariances { wanted: ReconstructionKind::WeightedL1.name() })?;
        let deviations = Deviations::new(Variances::new(&variance), alpha);
        let (image, report) = minimise(own, &deviations, deviations.typical, &EFFORT, |_| {})?;
        Ok((image, SolveReport { alpha, ..report }))
    }
}

/// What errors are multiplied by: one over their deviations, so that it is 1 for a difference on average.
struct Deviations {
    width: usize,
    dx: Vec<f32>,
    dy: Vec<f32>,
    /// Times α.
    primal: Vec<f32>,
    /// Mean of `primal`.
    typical: f32,
}

impl Deviations {
    fn new(variances: Variances, alpha: f32) -> Self {
        let (width, [primal, dx, dy]) = variances.into_planes();
        let inverse = |mut plane: Vec<f32>| {
            plane.iter_mut().for_each(|v| *v = 1.0 / v.sqrt());
            plane
        };
        let mean = |plane: &[f32]| plane.iter().map(|v| f64::from(*v)).sum::<f64>() / plane.len().max(1) as f64;
        let [mut primal, mut dx, mut dy] = [inverse(primal), inverse(dx), inverse(dy)];
        let unit = 0.5 * (mean(&dx) + mean(&dy));
        // Nothing is lost where there is no pixel at all.
        let scale = |plane: &mut [f32], factor: f64| plane.iter_mut().for_each(|v| *v = (f64::from(*v) * factor / unit) as f32);
        scale(&mut dx, 1.0);
        scale(&mut dy, 1.0);
        scale(&mut primal, f64::from(alpha));
        let typical = mean(&primal) as f32;
        Self { width, dx, dy, primal, typical }
    }
}

impl Shares for Deviations {
    fn row(&self, y: usize) -> [Share<'_>; 3] {
        let line = y * self.width..(y + 1) * self.width;
        [&self.dx, &self.dy, &self.primal].map(|plane| Share::Each(&plane[line.clone()]))
    }
}

#[cfg(test)]
mod tests;
